"""Derivatives of whole runs: tangents and adjoints against complex steps of the discrete equations."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.errors import NumericalError, UsageError
from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor
from eomgen.pipeline.model import Model
from eomgen.products.derivatives.linear_run import undefined_derivatives
from eomgen.products.derivatives.linear_steps import turning as turned_in_c
from eomgen.products.derivatives.run_sensitivities import Sensitivities
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.scene import Scene
from tests.derivatives.checks import hold_adjoints, oracle_of, places_of, sixth_order, tunable
from tests.models.library import scene
from tests.oracles.complex_runs import derivatives

STEP = 0.01
TO_ROUNDING = {"rtol": 1e-16, "atol": 1e-18}
#: Directions of the scenes below, and states that they start from.
OF_TREE = ["mass", "stiffness", "damping", "length", "q.a", "v.b"]
OF_TURNS = ["mass", "length", "damping", "shake", "q.a[0]", "q.f[1]", "q.f[4]", "v.a[2]", "v.f[3]"]
OF_CONTROL = ["mass", "length", "lag", "gain", "q.a", "v.a", "z.filtered"]
OF_BEAM = ["bend", "tip", "speed", "q.axle"]
SWUNG = {"a": {"position": 0.7, "velocity": 0.2}, "b": {"position": -0.3, "velocity": 1.0}}
SPUN = {"v": [1, 2, -1, 0.5, 2, 0.1, 0.3, 0.2, 0.1]}


def tree() -> SceneBuilder:
    """Return a double pendulum with a spring and a damper, all of it tunable."""
    builder = tunable("sensitive_tree", mass=1.3, stiffness=2.1, damping=0.3, length=0.8)
    builder.parameter("fixed", 0.7)
    builder.body("one", "mass", center_of_mass=[0, 0, -0.4], inertia=[0.1, 0.12, 0.05])
    builder.body("two", "fixed", center_of_mass=[0.1, 0, -0.3], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    builder.joint("b", "revolute", "one", "two", axis=[0.3, 1, 0], position=[0, 0, "-length"])
    builder.effort("spring", "b", "-stiffness*q.b - damping*v.b")
    builder.output("angle", formula="q.a + q.b**2")
    return builder.output("two", formula=["v.a*q.b", "mass*a.b"])


def turning() -> SceneBuilder:
    """Return a ball joint and a free body on a base that shakes by a parameter, joined by a spring."""
    builder = tunable("sensitive_turns", mass=1.3, length=0.5, damping=0.2, shake=0.05)
    builder.base([0, 0, "shake*sin(9*t)"])
    builder.body("one", "mass", center_of_mass=[0.1, 0, "-length"], inertia=[0.1, 0.12, 0.05])
    builder.body("two", 0.4, center_of_mass=[0.1, 0.05, -0.3], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "spherical", "base", "one")
    builder.joint("f", "free", "base", "two", position=[0, 0, 1])
    builder.effort("damper", "a", "-damping*v.a[0]", index=0)
    builder.point("tip", "one", [0, 0, -0.5]).point("eye", "two", [0.1, 0, 0])
    builder.spring("rope", "tip", "eye", stiffness=40, length="length", damping="damping")
    return builder.output("y", formula=["v.a[0]*v.a[1]", "v.f[3]", "a.a[2]"])


def loop() -> SceneBuilder:
    """Return three links that a rod closes to a loop, whose lengths are a parameter."""
    builder = tunable("sensitive_loop", mass=1.3, length=0.5, damping=0.2)
    builder.body("one", "mass", center_of_mass=[0.25, 0, 0], inertia=[0.1, 0.12, 0.05])
    builder.body("two", 0.4, center_of_mass=["length/2", 0.05, 0], inertia=[0.05, 0.06, 0.02])
    builder.body("three", 0.6, center_of_mass=[0.2, 0.0, 0], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    builder.joint("b", "revolute", "one", "two", axis=[0, 1, 0], position=["length", 0, 0])
    builder.joint("c", "spherical", "two", "three", position=["length", 0, 0])
    ends = {"body": "three", "position": [0.3, 0, 0]}, {"body": "base", "position": [0.6, 0.1, 0.2]}
    builder.constraint("rod", "distance", *ends, length=0.9)
    builder.effort("damper", "a", "-damping*v.a")
    return builder.output("y", formula=["v.a*v.b", "a.b", "v.c[1]"])


def absolute() -> SceneBuilder:
    """Return two links in absolute coordinates, with an angle that counts over turns."""
    builder = tunable("sensitive_absolute", coordinates="absolute", mass=1.3, length=0.5, damping=0.2)
    builder.body("one", "mass", center_of_mass=[0.25, 0, 0], inertia=[0.1, 0.12, 0.05])
    builder.body("two", 0.4, center_of_mass=["length/2", 0.05, 0], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    builder.joint("b", "spherical", "one", "two", position=["length", 0, 0])
    builder.effort("spring", "a", "-damping*v.a - 3*q.a").point("tip", "two", [0.3, 0, 0])
    return builder.output("y", formula=["v.a", "q.a", "position.tip[2]"])


def bending() -> SceneBuilder:
    """Return a hub that turns a beam with a load at its end."""
    builder = tunable("sensitive_beam", bend=60.0, tip=0.2, speed=2.0)
    builder.body("hub", 0.5, center_of_mass=[0, 0, 0], inertia=[0.02, 0.02, 0.02])
    builder.joint("axle", "revolute", "base", "hub", axis=[0, 1, 0])
    bent = {"bending_z": {"modes": 2, "stiffness": "bend"}, "bending_y": {"modes": 1, "stiffness": "2*bend"}}
    builder.beam("rod", 1.0, mass_per_length=0.4, **bent)
    builder.joint("clamp", "fixed", "hub", "rod")
    builder.body("load", "tip", center_of_mass=[0, 0, 0.02], inertia=[1e-3, 1e-3, 1e-3])
    builder.joint("end", "fixed", "rod", "load", position=[1.0, 0, 0])
    builder.effort("motor", "axle", "speed - v.axle")
    return builder.output("y", formula=["v.axle", "a.axle", "q.axle"])


def controlled() -> SceneBuilder:
    """Return a pendulum with a filter and an integrator whose product acts on it."""
    builder = tunable("sensitive_control", mass=1.3, length=0.5, lag=0.2, gain=6.0)
    builder.body("one", "mass", center_of_mass=[0.25, 0, "-length"], inertia=[0.1, 0.12, 0.05])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    builder.state("filtered", "(q.a - filtered)/lag").state("sum", "v.a*filtered - sum")
    builder.effort("motor", "a", "-gain*filtered - sum*v.a")
    return builder.output("y", formula=["v.a*filtered", "a.a", "sum"])


def built(builder: SceneBuilder) -> tuple[Scene, Model]:
    scene = builder.build()
    return scene, eomgen.build(scene, profile="instant")


def check(
    builder: SceneBuilder,
    method: str,
    by: Sequence[str],
    initial: Mapping[str, Any],
    steps: int = 12,
    tolerance: float = 1e-12,
    step: float = STEP,
) -> Sensitivities:
    """Hold derivatives of a run along directions to complex steps of it, and adjoints to tangents."""
    scene, model = built(builder)
    options: dict[str, Any] = {"method": method, "initial": initial, "settings": TO_ROUNDING}
    found = model.sensitivities(steps * step, step, by=by, **options)
    run = model.simulate(steps * step, step, error_estimate=False, **options)
    oracle, places = oracle_of(model, scene, method, found, step), places_of(model, found)
    start = {"q": run.q[0], "v": run.v[0], "z": run.z[0]}
    values, expected = derivatives(oracle, steps, start, model.parameter_array(), places)
    table = np.concatenate([np.atleast_3d(d).reshape(steps + 1, -1, len(by)) for d in found.derivatives.values()], 1)
    np.testing.assert_array_equal(found.t, run.t)
    for name, array in found.outputs.items():
        np.testing.assert_array_equal(array, run.outputs[name])
    columns = np.concatenate([array.reshape(steps + 1, -1) for array in found.outputs.values()], axis=1)
    assert np.max(np.abs(columns - values)) <= tolerance * np.max(np.abs(values))
    size = np.max(np.abs(expected), axis=(0, 1))
    assert np.all(size > 0.0)
    assert np.all(np.max(np.abs(table - expected), axis=(0, 1)) <= tolerance * size)
    hold_adjoints(found, table, tolerance)
    return found


@pytest.mark.parametrize(
    ("builder", "method", "by", "initial"),
    [
        (tree, "generalized_alpha", OF_TREE, SWUNG),
        (tree, "trapezoidal", OF_TREE, SWUNG),
        (tree, "hht", OF_TREE, SWUNG),
        (turning, "generalized_alpha", OF_TURNS, SPUN),
        (controlled, "trapezoidal", OF_CONTROL, {"a": 0.6}),
    ],
    ids=["tree", "tree_trapezoidal", "tree_hht", "turning", "controlled"],
)
def test_directions_of_parameters_and_of_the_initial_state(
    builder: Any, method: str, by: Sequence[str], initial: Mapping[str, Any]
) -> None:
    check(builder(), method, by, initial)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "trapezoidal"])
def test_a_loop_whose_rows_move_with_a_parameter(method: str) -> None:
    _, model = built(loop())
    start = model.consistent(model.initial_q, np.array([1.0, 2.0, -1.0, 0.5, 2.0]))
    by = ["mass", "length", "damping", "q.a", "v.c[1]"]
    check(loop(), method, by, {"q": start.q, "v": start.v})


@pytest.mark.slow
def test_the_speed_on_a_road_of_a_class_has_derivatives() -> None:
    builder = tunable("quarter", speed=15.0).body("wheel", 40.0).body("body", 300.0)
    builder.joint("hop", "prismatic", "base", "wheel", axis=[0, 0, 1])
    builder.joint("heave", "prismatic", "wheel", "body", axis=[0, 0, 1])
    builder.input("height", road={"class": "C", "seed": 3, "speed": "speed"})
    builder.effort("tyre", "hop", "-2e5*(q.hop - height)").effort("strut", "heave", "-2e4*q.heave - 1500*v.heave")
    _, model = built(builder.output("bounce", formula="a.heave + a.hop"))
    options: dict[str, Any] = {"initial": {"q": [0.0, 0.0]}, "settings": TO_ROUNDING}

    def bounce(change: float) -> Any:
        given = {"parameters": {"speed": 15.0 + change}, "error_estimate": False, **options}
        return model.simulate(0.5, 2e-3, **given).outputs["bounce"]

    found, expected = model.sensitivities(0.5, 2e-3, by=["speed"], **options), sixth_order(bounce, 2e-4)
    off = np.max(np.abs(found.derivatives["bounce"][:, 0] - expected))
    assert off < 1e-9 * np.max(np.abs(expected))
    assert found.gradient("final(bounce)")["speed"] == pytest.approx(found.derivatives["bounce"][-1, 0], rel=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-9, 0.3, 0.49, 0.51, 3.0])
def test_tangents_of_groups_in_c(size: float) -> None:
    factors: list[Factor] = []
    first = 0
    for name, q_size, v_size in (("SO3", 4, 3), ("R", 2, 2), ("SE3", 7, 6), ("R3xSO3", 7, 6)):
        factors.append(Factor(name, name, sum(factor.q_size for factor in factors), q_size, first, v_size))
        first += v_size
    theta = np.random.default_rng(1).normal(size=(5, first)) * size / 2.0
    A, T = turned_in_c(factors, theta)
    place = 0
    for factor in factors:
        if factor.group == "R":
            continue
        group, part, square = group_named(factor.group, factor.v_size), theta[:, factor.v], factor.v_size**2
        pairs = (A, numeric.adjoint(group, numeric.exp(group, -part))), (T, numeric.tangent(group, part))
        for found, expected in pairs:
            own = found[:, place : place + square].reshape(expected.shape)
            np.testing.assert_allclose(own, expected, rtol=0, atol=4e-15 * (1.0 + size) ** 2)
        place += square


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.001, 0.01])
def test_a_beam_at_steps_that_resolve_it_and_that_do_not(step: float) -> None:
    found = check(bending(), "generalized_alpha", OF_BEAM, {"axle": {"velocity": 1.0}}, steps=10, step=step)
    begun = found._run.motion.start
    assert np.any(begun["a"] != begun["vdot"]) == (step == 0.001)


def test_a_first_step_that_damps_is_refused() -> None:
    _, model = built(bending())
    text = "the start excites motions too fast for the step: the damped first step has no derivatives"
    assert text in refusal(model, 0.3, 0.1, initial={"axle": {"velocity": 1.0}})


def test_functionals_are_sums_over_rows() -> None:
    _, model = built(tree())
    told = "10 steps are not a whole number of rows of 4 steps: the end has no row; try: record_every = 2"
    assert told in refusal(model, 0.1, STEP, record_every=4)
    found = model.sensitivities(0.2, STEP, by=["mass", "v.a"], initial={"a": 0.5})
    d, rng = found.derivatives, np.random.default_rng(1)
    weights = rng.normal(size=(21, 2))
    of = ["integral(angle)", "mean(two[1])", "sum(two[0])", {"two": weights, "angle": weights[:, 0]}]
    expected = [
        np.trapezoid(d["angle"], found.t, axis=0),
        np.trapezoid(d["two"][:, 1], found.t, axis=0) / 0.2,
        d["two"][:, 0].sum(axis=0),
        np.einsum("tk,tkd->d", weights, d["two"]) + weights[:, 0] @ d["angle"],
    ]
    np.testing.assert_allclose(found.gradients(of), expected, rtol=1e-12)
    assert found.gradient("sum(two[0])") == pytest.approx(
        dict(zip(["mass", "v.a"], expected[2], strict=True)), rel=1e-12
    )
    sparse = model.sensitivities(0.2, STEP, by=["mass", "v.a"], initial={"a": 0.5}, record_every=4)
    np.testing.assert_array_equal(sparse.derivatives["two"], d["two"][::4])


def refusal(model: Model, *given: Any, **options: Any) -> str:
    with pytest.raises((UsageError, NumericalError)) as caught:
        model.sensitivities(*given, **options)
    return str(caught.value)


@pytest.mark.slow
def test_parameters_that_move_the_instant_of_a_jump_are_refused() -> None:
    builder = SceneBuilder("late", gravity=[0, 0, 0]).parameter("k", 2.0, tunable=True)
    builder.parameter("start", 0.055, tunable=True).body("mass", 1.0)
    builder.joint("slide", "prismatic", "base", "mass", axis=[1, 0, 0]).output("place", formula="q.slide")
    builder.effort("push", "slide", "k * max(t - start, 0) + (3 if t > start else 0)")
    _, model = built(builder)
    assert refusal(model, 0.1, STEP, by=["k", "start"]) == (
        "usage error: by: start moves the instant at which a formula takes another branch, without derivatives; try: a"
        " smooth law in its place, max(t - start, 0) for a ramp"
    )
    assert model.sensitivities(0.1, STEP, by=["k"]).gradient("final(place)")["k"] > 0.0


@pytest.mark.slow
def test_runs_and_scenes_without_derivatives_say_why() -> None:
    _, model = built(tree())
    found = model.sensitivities(0.1, STEP)
    given: list[tuple[Callable[[], object], str]] = [  # mistakes of types on purpose
        (lambda: found.gradient(cast(Any, 3.0)), "a functional is a text or weights by output, not float; try:"),
        (lambda: found.gradient({"angle": "a"}), "weights of angle: an array of real numbers is needed, not str"),
        (lambda: found.gradients("final(angle)"), "of: a list is needed, not the text 'final(angle)'; try: [\"final"),
        (lambda: found.stationary("angle"), "of: a list of outputs is needed, not the text 'angle'"),
        (lambda: found.derivatives["angel"], "there is no output 'angel'; try: angle"),
    ]
    for call, text in given:
        with pytest.raises(UsageError, match=re.escape(text)):
            call()
    single = eomgen.build(tree().build(), profile="quick", real="float")
    assert "the model computes with float, whose rounding derivatives would be lost in" in refusal(single, 0.1, STEP)
    silent = SceneBuilder("silent").parameter("mass", 1.0, tunable=True)
    silent.body("one", "mass", center_of_mass=[0.1, 0, 0], inertia=[1, 1, 1])
    silent.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    assert "of: the scene has no outputs to differentiate" in refusal(built(silent)[1], 0.1, STEP)


@pytest.mark.slow
def test_forces_that_jump_and_runs_that_fail() -> None:
    jumping = tree().effort("push", "a", "1 if t < 0.05 else 2")
    told = refusal(built(jumping)[1], 0.1, STEP)
    assert "forces jump at t = 0.05 s, and steps cut in two there have no derivatives here" in told
    failing = tree().effort("push", "a", "sqrt(0.055 - t)")
    with pytest.raises(NumericalError, match=r"sensitivities: the run fails at t = 0\.0[56] s: "):
        _ = built(failing)[1].sensitivities(0.1, STEP, by=["mass"]).derivatives


def test_steps_that_converge_in_halves_or_have_no_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    _, model = built(tree())
    found = model.sensitivities(0.1, STEP, by=["mass"])
    with monkeypatch.context() as patch:
        patch.setattr(type(found._run.motion.stepper), "statistics", {"halvings": 1})
        with pytest.raises(NumericalError, match=r"a step near t = \S+ s converged in halves only, without derivat"):
            _ = found.derivatives
    with pytest.raises(
        NumericalError, match=r"the equations of the step to t = 0\.02 s, made linear, have no solution"
    ):
        found._run.linear._check(1, 3, np.array([0.01, 0.02, 0.03]))


@pytest.mark.slow
@pytest.mark.parametrize(("make", "method"), [(loop, "hht_index3"), (absolute, "generalized_alpha_index3")])
def test_runs_in_index_3_have_the_derivatives_of_differences(make: Any, method: str) -> None:
    """Velocities are off the constraints, which are of positions alone; gradients are those of tangents, and second
    derivatives differences of gradients. Differences have the rounding of accelerations, which is of the order of
    1/step^2."""
    _, model = built(make())
    v = 0.5 * np.ones(model.nv)
    start = model.consistent(model.initial_q, v)
    by = ["mass", "length", "damping"]
    options: dict[str, Any] = {"method": method, "initial": {"q": start.q, "v": start.v}}
    with pytest.raises(UsageError, match=r'off the constraints, which have no .*; try: settings={"perturb": 0}, for a'):
        model.sensitivities(10 * STEP, STEP, by=by, **options)
    options["settings"] = {**TO_ROUNDING, "perturb": 0}
    found = model.sensitivities(10 * STEP, STEP, by=by, **options)
    expected, second = [], []
    for name in by:

        def run(change: float, name: str = name) -> Sensitivities:
            changed = {name: model.parameters[name] + change}
            return model.sensitivities(10 * STEP, STEP, by=by, parameters=changed, **options)

        expected.append(sixth_order(lambda change, run=run: run(change).outputs["y"], 1e-3))
        second.append(sixth_order(lambda change, run=run: run(change).gradients(["final(y[0])"])[0], 1e-3))
    table = found.derivatives["y"]
    scale = np.max(np.abs(table), axis=(0, 1))
    assert np.all(np.max(np.abs(table - np.stack(expected, axis=-1)), axis=(0, 1)) < 3e-8 * scale)
    assert found.gradients(["final(y[0])"])[0] == pytest.approx(table[-1, 0], rel=1e-10, abs=1e-12)
    hessian = found.hessian("final(y[0])")
    assert np.max(np.abs(hessian - np.stack(second))) < 3e-8 * np.max(np.abs(hessian))


def test_derivatives_that_are_not_finite_have_a_reason_without_rough_formulas() -> None:
    assert str(undefined_derivatives(eomgen.build(scene("oscillator"), profile="quick"), "at t = 1 s")) == (
        "numerical error: sensitivities: derivatives are not finite numbers at t = 1 s: a formula has none there"
        " (a root, a logarithm or a power at zero); try: a formula of finite slope there, x / sqrt(x + width) for"
        " sqrt(x); eomgen check names formulas without"
    )


def test_a_scene_with_auto_is_differentiated_with_the_method_of_its_runs() -> None:
    parameters = {"k": {"value": 4.0, "unit": "N m/rad", "tunable": True}}
    simulation = {"duration": 0.5, "step": 0.05, "method": "auto"}
    model = eomgen.build(scene("arm", joints__elbow__stiffness="k", parameters=parameters, simulation=simulation))
    assert "rk4" in model.simulate().message

    def last(k: float) -> np.ndarray:
        return np.asarray(model.simulate(parameters={"k": k}, error_estimate=False).outputs["tip"][-1])

    slope = model.sensitivities(by=["k"], of=["tip"]).derivatives["tip"][-1, ..., 0]
    np.testing.assert_allclose(slope, (last(4.0 + 1e-4) - last(4.0 - 1e-4)) / 2e-4, rtol=0, atol=1e-8)
