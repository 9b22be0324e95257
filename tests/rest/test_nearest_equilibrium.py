"""Rest is where a damped motion from the start comes to, held against damped runs; what is doubtful of it is named."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from tests.integrators.similar_scenes import four_bar, servo, tree
from tests.models.scenes import pendulum
from tests.oracles.similarity import BINARY, DECIMAL, UnitsOf, in_units
from tests.simulation.rails import built

pytestmark = pytest.mark.slow

HALF_CAR = Path(__file__).parent / "half_car.toml"
RESTS = [-0.01881844, 0.00108133, -0.0207645, -0.017004]
INSIDE_OUT = [-0.55388945, -0.01970462, -0.02076475, -0.01700375]


@cache
def half_car() -> eomgen.Model:
    """Return the half car with lagged actuators and feedback that a user found at rest inside out."""
    return eomgen.build(HALF_CAR, profile="quick")


def point_mass(name: str, **joint: Any) -> eomgen.SceneBuilder:
    """Return a mass of 2 kg on a vertical rail, with a point at it and one at the origin."""
    builder = eomgen.SceneBuilder(name).body("mass", 2.0)
    builder.joint("lift", "prismatic", "base", "mass", axis=[0, 0, 1], **joint)
    return builder.point("end", "mass", [0, 0, 0]).point("origin", "base", [0, 0, 0])


# -- the half car ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("any_kind", [False, True])
def test_a_half_car_with_actuators_rests_where_it_settles(any_kind: bool) -> None:
    model = half_car()
    found = model.equilibrium(any_kind=any_kind)
    np.testing.assert_allclose(found.q, RESTS, atol=1e-8)
    assert not found.notes
    run = model.simulate(15.0, 2e-3)
    np.testing.assert_allclose(run.q[-1], found.q, atol=1e-9)
    np.testing.assert_allclose(run.z[-1], found.z, rtol=1e-5)


def noted(builder: eomgen.SceneBuilder, *given: Any, **options: Any) -> list[str]:
    """Return the notes of an equilibrium."""
    return list(built(builder).equilibrium(*given, **options).notes)


def coil(start: float, stiffness: float, length: float) -> eomgen.SceneBuilder:
    """Return the mass below or above a spring."""
    builder = point_mass("sprung", initial={"position": start})
    return builder.spring("coil", "origin", "end", stiffness=stiffness, length=length)


def test_runs_linear_models_and_generated_code_take_that_rest() -> None:
    model = half_car()
    run = model.simulate(0.1, 1e-3, start="equilibrium")
    np.testing.assert_allclose(run.q, np.tile(RESTS, (len(run.t), 1)), atol=1e-7)
    assert "at rest" not in run.message
    assert np.max(model.linearize().modes().eigenvalues.real) == pytest.approx(-3.9, abs=0.05)


def test_other_starts_come_to_the_rest_of_their_basins() -> None:
    """Above the hubs to the right one; from below them the motion itself ends with the springs inside out."""
    model = half_car()
    for heave, expected in ((0.5, RESTS), (-0.1, RESTS), (-0.3, INSIDE_OUT), (-0.6, INSIDE_OUT)):
        found = model.equilibrium({"heave": heave})
        np.testing.assert_allclose(found.q, expected, atol=1e-7)
    run = model.simulate(15.0, 2e-3, initial={"heave": -0.3})
    np.testing.assert_allclose(run.q[-1], INSIDE_OUT, atol=1e-7)


# -- damped runs as an oracle ------------------------------------------------------------------------------------------


@cache
def wells() -> eomgen.Model:
    """Return three links in space, each with two springs to places that parameters say: as many wells as one likes."""
    builder = eomgen.SceneBuilder("wells")
    for k, axis in enumerate(([0, 1, 0], [1, 0, 0], [0, 1, 0])):
        builder.body(f"link{k}", 1.0 + 0.5 * k, center_of_mass=[0.1, 0, -0.2], inertia=[0.02, 0.02, 0.01])
        carrier = f"link{k - 1}" if k else "base"
        builder.joint(f"j{k}", "revolute", carrier, f"link{k}", axis=axis, position=[0, 0, -0.4 if k else 0])
        builder.point(f"end{k}", f"link{k}", [0.05, 0.1, -0.4])
        for s in range(2):
            place = [f"{c}{k}{s}" for c in "xyz"]
            for name in (*place, f"k{k}{s}", f"l{k}{s}"):
                builder.parameter(name, 1.0, tunable=True)
            builder.point(f"wall{k}{s}", "base", place)
            builder.spring(f"cord{k}{s}", f"wall{k}{s}", f"end{k}", stiffness=f"k{k}{s}", length=f"l{k}{s}")
    return eomgen.build(builder.build(), ["mass", "residual", "partials", "forward_dynamics", "poses"], profile="quick")


def sample(seed: int) -> tuple[dict[str, float], np.ndarray]:
    """Return parameters of the wells, with springs that push as often as they pull, and a start."""
    rng = np.random.default_rng(seed)
    given = {}
    for name in wells().parameters:
        spread = {"k": 10 ** rng.uniform(0.5, 2.5), "l": rng.uniform(0.2, 2.0)}
        given[name] = float(spread.get(name[0], 0.7 * rng.normal()))
    return given, rng.uniform(-3.0, 3.0, 3)


def damped_run(model: eomgen.Model, q: np.ndarray, parameters: dict[str, float]) -> np.ndarray:
    """Return where the motion with a damping of 600 1/s per inertia ends, from rest."""
    p, rest, damping = model.parameter_array(parameters), np.zeros(model.nv), 600.0

    def rates(_t: float, y: np.ndarray) -> np.ndarray:
        q, v = y[: model.nq], y[model.nq :]
        return np.concatenate([v, model.forward_dynamics(q, rest, parameters=p) - damping * v])

    run = solve_ivp(rates, (0.0, 1e6), np.concatenate([q, rest]), method="LSODA", rtol=1e-7, atol=1e-9)
    result: np.ndarray = run.y[: model.nq, -1]
    return result


def compare_with_damped_runs(seeds: range) -> int:
    """Return in how many random scenes rest is where the damped run ends; the equilibrium is stable and never far from
    it."""
    model, same = wells(), 0
    for seed in seeds:
        parameters, start = sample(seed)
        found = model.equilibrium({"q": start}, parameters)
        assert found.stable and found.acceleration < 1e-9
        expected = damped_run(model, start, parameters)
        same += bool(np.max(np.abs(np.exp(1j * found.q) - np.exp(1j * expected))) < 1e-4)
        nearest = model.equilibrium({"q": start}, parameters, any_kind=True)
        M = model.mass(start, parameters=parameters)
        far, near = ((q - start) @ M @ (q - start) for q in (found.q, nearest.q))
        assert near <= far * (1.0 + 1e-9)
        elsewhere = any("it is not where a damped motion from the start settles" in note for note in nearest.notes)
        assert elsewhere == bool(np.max(np.abs(nearest.q - found.q)) > 1e-6)
    return same


@pytest.mark.slow
def test_rest_is_where_damped_runs_end() -> None:
    """All but starts so close to the border of two basins that errors of a tenth of a step decide."""
    assert compare_with_damped_runs(range(16)) >= 15


def test_the_nearest_of_any_kind_is_named_where_motions_settle_elsewhere() -> None:
    found = pendulum().equilibrium({"hinge": 2.9}, u={"torque": 0.0}, any_kind=True)
    assert found.q == pytest.approx([np.pi])
    assert list(found.notes) == [
        "it is not where a damped motion from the start settles, which is -3.142 rad from here along hinge"
    ]
    assert found.message.endswith(found.notes[0])
    assert not pendulum().equilibrium({"hinge": 0.4}, u={"torque": 0.0}, any_kind=True).notes


# -- forces that begin, end and jump -----------------------------------------------------------------------------------


def test_a_wheel_falls_onto_the_road() -> None:
    model = built(point_mass("falling").tyre("tyre", center="end", radius=0.3, stiffness=1e5))
    for height in (500.0, 5.0, 0.31, -0.2):
        found = model.equilibrium({"lift": height})
        assert found.q == pytest.approx([0.3 - 2.0 * 9.81 / 1e5], abs=1e-3) and found.stable
        assert height != 500.0 or found.notes == ()


def test_springs_that_end_inside_out_are_named() -> None:
    """A weight that presses the ends of its spring past one another; forces jump there, and push on."""
    model, said = built(coil(0.2, 100.0, 0.15)), "inside out, for their ends have passed one another: spring coil"
    for height in (0.5, 0.01):
        found = model.equilibrium({"lift": height})
        assert found.q == pytest.approx([-0.15 - 2.0 * 9.81 / 100.0], abs=1e-12)
        assert said in found.notes
    assert f"the start at rest: {said}" in model.simulate(0.01, 1e-3, start="equilibrium").message
    with pytest.warns(RuntimeWarning, match="sprung: linear about an equilibrium in doubt: inside out"):
        model.linearize()
    with pytest.raises(eomgen.NumericalError, match=r"the force along v\.lift is not a finite number"):
        model.equilibrium({"lift": 0.0})


def test_springs_tyres_and_bodies_that_go_far_are_named() -> None:
    soft = coil(-0.1, 30.0, 0.1)
    far = "moved farther than they were apart at the start: the ends of spring coil (0.654 m, 0.1 m apart)"
    assert noted(soft) == [far] and not noted(soft, {"lift": -0.6})
    tyre = point_mass("sunk", initial={"position": 0.4}).input("kerb", unit="m")
    tyre.tyre("tyre", center="end", radius=0.3, stiffness=50.0, road="kerb")
    sunk = ["inside out, for their centres are below the road: tyre tyre"]
    assert noted(tyre, u={"kerb": 0.0}) == sunk == noted(tyre, {"lift": 0.8}, u=[0.1])
    assert noted(point_mass("far", stiffness=1.0, rest=0.5)) == [
        "farther from the start than the whole scene is large, 0.5 m: the body mass, by 19.12 m"
    ]


def test_where_no_damped_motion_settles_newton_does_and_says_so() -> None:
    """A double integral feedback without damping is unstable in any motion, and its equilibrium is the same."""
    builder = point_mass("integrals", stiffness=50.0).effort("push", "lift", "9e3 * second")
    found = built(builder.state("first", rate="-(q.lift - 0.1)").state("second", rate="first")).equilibrium()
    assert found.q == pytest.approx([0.1]) and found.stable is None
    not_seen = (
        "whether a motion from the start comes to rest here is not known, for a damped one was not seen to settle"
    )
    assert found.notes[0] == not_seen


def test_generated_code_carries_the_notes(tmp_path: Path) -> None:
    eomgen.generate(coil(0.2, 100.0, 0.15).simulation(start="equilibrium").build(), tmp_path)
    text = " ".join((tmp_path / "README.md").read_text(encoding="utf-8").split())
    assert "Note: inside out, for their ends have passed one another: spring coil." in text


# -- other units -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("make", "any_kind"), [(tree, False), (servo, False), (four_bar, True)])
def test_rest_is_the_same_in_other_units(make: Any, any_kind: bool) -> None:
    """The same steps lead there, and the same is said, in micrometres and megametres, days and microseconds."""
    model = eomgen.build(in_units({key: value for key, value in make().items() if key != "terms"}), profile="quick")
    first = model.equilibrium(any_kind=any_kind, parameters=similar_parameters(model, UnitsOf()))
    for units in (*BINARY, *DECIMAL):
        found = model.equilibrium(initial_in(model, units), similar_parameters(model, units), any_kind=any_kind)
        assert found.iterations == first.iterations and len(found.notes) == len(first.notes)
        sizes = np.array([units.size(unit) for unit in model.q_units])
        np.testing.assert_allclose(found.q / sizes, first.q, atol=1e-11)
        np.testing.assert_allclose(found.frequencies * units.time, first.frequencies, rtol=1e-9, atol=1e-6)


def similar_parameters(model: eomgen.Model, units: UnitsOf) -> np.ndarray:
    given = {"unit_length": units.length, "unit_mass": units.mass, "unit_time": units.time}
    result: np.ndarray = model.parameter_array(given)
    return result


def initial_in(model: eomgen.Model, units: UnitsOf) -> dict[str, np.ndarray]:
    """Return the scene's initial state in other units."""
    blocks = (
        (model.initial_q, model.q_units, "q"),
        (model.initial_v, model.v_units, "v"),
        (model.initial_z, model.z_units, "z"),
    )
    return {
        name: values * np.array([units.size(unit) for unit in names]) for values, names, name in blocks if len(values)
    }
