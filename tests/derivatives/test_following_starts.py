"""Derivatives of runs whose start follows from parameters: rest, corrections onto constraints, absolute bodies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.compiled.initial_state import initial_state
from eomgen.errors import UsageError
from eomgen.integrators.families.register import method_named
from eomgen.mechanics import initial_coordinates
from eomgen.pipeline.model import Model
from eomgen.pipeline.scenes import AbsoluteStart
from eomgen.products.derivatives.run_sensitivities import Sensitivities
from eomgen.scene.builder import SceneBuilder
from tests.derivatives.checks import hold_adjoints, oracle_of, places_of, sixth_order, tunable
from tests.derivatives.test_sensitivities import STEP, TO_ROUNDING, built, loop, refusal, tree
from tests.oracles.complex_runs import STEP as TINY
from tests.oracles.complex_runs import ComplexRun, derivatives

STEPS = 6


def table_of(found: Sensitivities) -> Array:
    """Return derivatives (rows, components, directions)."""
    tables = [np.atleast_3d(d).reshape(len(found.t), -1, len(found.by)) for d in found.derivatives.values()]
    return np.concatenate(tables, axis=1)


def hold(found: Sensitivities, expected: Array, tolerance: float) -> None:
    """Hold tangents to those that are expected, and adjoints to tangents."""
    table, size = table_of(found), np.max(np.abs(expected), axis=(0, 1))
    assert np.all(size > 0.0)
    assert np.all(np.max(np.abs(table - expected), axis=(0, 1)) <= tolerance * size)
    hold_adjoints(found, table, tolerance)


def refused_twice(found: Sensitivities, output: str) -> str:
    told = []
    calls: Sequence[Callable[[], object]] = (
        lambda: found.hessian(f"final({output})"),
        lambda: found.hessian_products(f"final({output})", np.ones(len(found.by))),
    )
    for call in calls:
        with pytest.raises(UsageError) as caught:
            call()
        told.append(str(caught.value).partition(": ")[2].partition(": ")[2])
    assert told[0] == told[1]
    return told[0]


def resting_tree() -> SceneBuilder:
    """Return the double pendulum at rest, pushed aside by a parameter and then shaken."""
    return tree().effort("push", "a", "0.5*length + 2*sin(3*t)").simulation(start="equilibrium")


def resting_loop() -> SceneBuilder:
    """Return two links that a rod closes to a loop, at rest on a spring: multipliers carry weight there."""
    builder = tunable("resting_loop", mass=1.3, length=0.5, stiffness=6.0)
    builder.body("one", "mass", center_of_mass=[0.25, 0, 0], inertia=[0.1, 0.12, 0.05])
    builder.body("two", 0.4, center_of_mass=["length/2", 0.05, 0.1], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    builder.joint("b", "revolute", "one", "two", axis=[0, 1, 0], position=["length", 0, 0])
    ends = {"body": "two", "position": ["length", 0, 0]}, {"body": "base", "position": [0.6, 0.1, 0.2]}
    builder.constraint("rod", "distance", *ends, length=0.5)
    builder.effort("spring", "a", "-stiffness*(q.a - length) + 3*sin(5*t)")
    return builder.output("y", formula=["v.a*v.b", "a.b", "q.a"]).simulation(start="equilibrium")


def resting_controller() -> SceneBuilder:
    """Return a pendulum that a controller with internal states holds up, at rest."""
    builder = tunable("resting_control", mass=1.3, lag=0.2, gain=9.0, wanted=0.4)
    builder.body("one", "mass", center_of_mass=[0.25, 0, -0.3], inertia=[0.1, 0.12, 0.05])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    builder.state("filtered", "(q.a - filtered)/lag").state("other", "wanted**2*filtered - other")
    builder.effort("motor", "a", "-gain*(filtered + other - wanted) - 0.3*v.a + 2*sin(4*t)")
    return builder.output("y", formula=["q.a", "a.a", "other"]).simulation(start="equilibrium")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("builder", "method", "by"),
    [
        (resting_tree, "generalized_alpha", ["mass", "stiffness", "length"]),
        (resting_controller, "trapezoidal", ["mass", "lag", "gain", "wanted"]),
        (resting_loop, "generalized_alpha", ["mass", "length", "stiffness"]),
    ],
)
def test_a_start_at_rest_moves_with_parameters(
    builder: Callable[[], SceneBuilder], method: str, by: Sequence[str]
) -> None:
    scene, model = built(builder())
    found = model.sensitivities(STEPS * STEP, STEP, by=by, method=method, settings=TO_ROUNDING)
    begun = found._run.motion.start
    p = np.repeat(np.array([model.parameter_array()], complex), len(by), axis=0)
    for number, name in enumerate(by):
        p[number, list(model.parameters).index(name)] += 1j * TINY
    rest = ComplexRun(scene, method_named("trapezoidal"), STEP)
    q, z = rest.rest(begun["q"], begun.get("z", np.zeros(0)), p)
    np.testing.assert_allclose(q[0].real, begun["q"], atol=1e-11)
    assert np.max(np.abs(q.imag)) > 1e-3 * TINY
    outputs = oracle_of(model, scene, method, found, STEP).outputs(STEPS, q, np.zeros((len(by), model.nv)), z, p)
    hold(found, np.moveaxis(outputs.imag / TINY, 0, -1), 1e-10)  # rest is found to 1e-11 of the forces


@pytest.mark.slow
def test_a_start_at_rest_that_is_held_or_moved_by_hand() -> None:
    _, model = built(resting_tree())
    options: dict[str, Any] = {"by": ["length", "q.a"], "settings": TO_ROUNDING}
    whole = model.sensitivities(STEPS * STEP, STEP, **options)
    held = model.sensitivities(STEPS * STEP, STEP, initial=model.equilibrium().initial, **options)
    of_start, of_rest = (found.derivatives["angle"][:, 1] for found in (whole, held))
    np.testing.assert_allclose(of_start, of_rest, rtol=1e-9)  # q.a: of the state that the run starts from
    assert np.max(np.abs(whole.derivatives["angle"][:, 0] - held.derivatives["angle"][:, 0])) > 1e-3
    assert held.hessian("final(angle)").shape == (2, 2)


@pytest.mark.slow
def test_rest_that_nothing_determines_or_beside_what_moves() -> None:
    builder = SceneBuilder("sliding_rest").parameter("mass", 1.0, tunable=True)
    builder.body("one", "mass", center_of_mass=[0.1, 0, 0], inertia=[0.1, 0.1, 0.1]).body("two", 2.0)
    builder.joint("slide", "prismatic", "base", "two", axis=[1, 0, 0])
    builder.joint("hinge", "revolute", "two", "one", axis=[0, 1, 0]).output("y", formula="q.slide")
    told = refusal(built(builder.simulation(start="equilibrium"))[1], 0.1, STEP)
    assert "static equilibrium, which no force determines along slide; try: a spring at slide; or initial = " in told
    shaken = resting_tree().base([0, 0, "0.01*sin(9*t)"])
    told = refusal(built(shaken)[1], 0.1, STEP)
    assert "starts at equilibrium relative to moving drives, which has no derivatives here; try: initial = m" in told


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "initial"),
    [
        ("generalized_alpha", {"a": {"position": 0.15, "velocity": 1.0}, "b": -0.1}),
        ("trapezoidal", {"v": [1, 2, -1, 0.5, 2]}),
    ],
)
def test_a_start_far_off_the_constraints_moves_as_its_steps_onto_them_do(method: str, initial: dict[str, Any]) -> None:
    scene, model = built(loop())
    if "v" in initial:  # positions on the constraints, and velocities off them
        initial = {"q": model.initial_q, **initial}
    by = ["mass", "length", "damping", "q.a", "q.c[0]", "v.c[1]"]
    found = model.sensitivities(STEPS * STEP, STEP, by=by, method=method, initial=initial, settings=TO_ROUNDING)
    assert found._run.beginning.moved_far
    asked = initial_state(model, initial, model.parameter_array(), asked=True)
    oracle = oracle_of(model, scene, method, found, STEP)
    start = {"q": asked.q, "v": asked.v, "z": asked.z}
    hold(found, derivatives(oracle, STEPS, start, model.parameter_array(), places_of(model, found))[1], 1e-12)
    assert refused_twice(found, "y[0]") == (
        "the initial state is moved onto the constraints, without known second derivatives; try: state ="
        ' model.consistent(q, v), and initial={"q": state.q, "v": state.v}'
    )


def four_bar(crank: float = 0.3) -> SceneBuilder:
    """Return a loop whose initial angles do not close it, with a length that is tunable."""
    builder = SceneBuilder("asked_loop").parameter("crank", crank, tunable=True).parameter("load", 0.2, tunable=True)
    builder.body("one", 1.0, center_of_mass=["crank/2", 0, 0], inertia=[0.01, 0.02, 0.01])
    builder.body("two", 1.5, center_of_mass=[0.4, 0, 0], inertia=[0.05, 0.06, 0.02])
    start = {"position": 0.9, "velocity": 1.5}
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0], initial=start)
    builder.joint("b", "revolute", "one", "two", axis=[0, 1, 0], position=["crank", 0, 0], initial={"position": -0.7})
    ends = {"body": "two", "position": [0.8, 0, 0]}, {"body": "base", "position": [0.7, 0, -0.5]}
    builder.constraint("rod", "distance", *ends, length=0.6).effort("load", "b", "load*cos(q.a)")
    return builder.output("y", formula=["q.a", "v.b"])


@pytest.mark.slow
def test_derivatives_of_a_loop_are_those_of_the_scene_with_other_values() -> None:
    _, model = built(four_bar())
    by = ["crank", "load", "q.a"]
    found = model.sensitivities(0.1, STEP, by=by, settings=TO_ROUNDING).derivatives["y"][-1]
    expected = sixth_order(lambda change: final(model, parameters={"crank": 0.3 + change}), 1e-3)
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-7)
    asked = [{"a": {"position": 0.9 + sign * 1e-4, "velocity": 1.5}} for sign in (1.0, -1.0)]
    ahead, behind = (final(model, initial=initial) for initial in asked)
    np.testing.assert_allclose(found[:, 2], (ahead - behind) / 2e-4, rtol=1e-5)
    assert model.sensitivities(0.1, STEP, by=["load"]).hessian("final(y[0])").shape == (1, 1)  # it moves no start
    assert refused_twice(model.sensitivities(0.1, STEP, by=["crank"]), "y[0]").startswith("the initial state is moved")


def final(model: Model, **given: Any) -> Array:
    return np.asarray(model.simulate(0.1, STEP, error_estimate=False, settings=TO_ROUNDING, **given)["y"][-1])


def raised() -> SceneBuilder:
    """Return two links in absolute coordinates that start turned and moving, joined where a parameter says."""
    builder = tunable("raised_absolute", coordinates="absolute", length=0.5, offset=0.05)
    builder.body("one", 1.3, center_of_mass=[0.25, 0, "offset"], inertia=[0.1, 0.12, 0.05])
    builder.body("two", 0.4, center_of_mass=["length/2", 0.05, 0], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0], initial={"position": 0.4, "velocity": 0.7})
    bent = {"position": 0.3, "velocity": -1}
    builder.joint("b", "revolute", "one", "two", axis=[0, 0, 1], position=["length", 0, 0], initial=bent)
    builder.point("tip", "two", [0.3, 0, 0.1])
    return builder.effort("spring", "a", "-3*q.a").output("y", formula=["q.a", "v.b", "position.tip[2]"])


@pytest.mark.slow
def test_absolute_bodies_start_where_the_joints_have_them() -> None:
    """Against differences of whole runs, extrapolated."""
    _, model = built(raised())
    by, options = ["length", "offset"], {"settings": TO_ROUNDING}
    found = model.sensitivities(STEPS * STEP, STEP, by=by, **options)

    columns = []
    for name in by:

        def run(change: float, name: str = name) -> Array:
            changed = {name: model.parameters[name] + change}
            return model.simulate(STEPS * STEP, STEP, parameters=changed, error_estimate=False, **options).outputs["y"]

        columns.append(sixth_order(run, 1e-3))
    hold(found, np.stack(columns, axis=-1), 1e-9)
    assert refused_twice(found, "y[0]").startswith("the initial state follows from parameters")
    place = next(k for k, factor in enumerate(model.factors) if factor.name == "two")
    factor = model.factors[place]
    kept = {"two": {"position": model.initial_q[factor.q].tolist()}}
    for same in (kept, {"q.two": kept["two"]["position"]}):
        slopes_kept = model.sensitivities(STEPS * STEP, STEP, by=by, initial=same, **options)._run.asked
        assert not np.any(slopes_kept.dq[factor.v]) and np.any(slopes_kept.dv[factor.v])
    assert np.any(found._run.asked.dq[factor.v])


def test_starts_of_absolute_bodies_are_derived_once(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = raised().build()
    wanted = [AbsoluteStart(scene)({"length": value}) for value in (0.4, 0.7)]
    start = AbsoluteStart(scene)
    assert start({"length": 0.4}) == wanted[0] != wanted[1]
    slopes = start.slopes({"length": 0.4}, ["length"])
    monkeypatch.setattr(initial_coordinates, "Derivation", None)
    assert start({"length": 0.7}) == wanted[1]
    again = start.slopes({"length": 0.4}, ["length"])
    assert slopes is not None and again is not None and all(map(np.array_equal, slopes, again))
