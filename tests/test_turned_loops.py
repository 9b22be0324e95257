"""Planar loops closed by joints in space keep their mobility in any plane, anywhere, on the base and in flight, in any
units."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.pipeline.initial_assembly import constraint_equations, with_initial_assembly
from eomgen.scene.load import from_data
from eomgen.solvers.constraint_rows import EPSILON
from eomgen.system.system import System
from tests.oracles.placed_loops import (
    AXIS,
    CLOSINGS,
    LOOPS,
    Data,
    four_bar,
    on_free_body,
    random_rotation,
    rotation_about,
    slider_crank,
    turned,
)
from tests.oracles.similarity import DECIMAL, UnitsOf, in_units

pytestmark = pytest.mark.slow

#: Planes in which rows that say nothing vanish exactly, nearly, and not at all.
NAMED = {
    "as drawn": np.eye(3),
    "by a hair": rotation_about((1, 0, 0), 1e-9),
    "a little": rotation_about((1, 0, 1), 1e-6),
    "about x": rotation_about((1, 0, 0), 0.3),
    "to the ground": rotation_about((1, 0, 0), np.pi / 2),
    "in the plane": rotation_about((0, 1, 0), 0.7),
}
TERMS = ("mass", "constraint", "constraint_velocity", "constraint_jacobian", "constraint_size")


def assembled(data: Data) -> System:
    return with_initial_assembly(partial(derive, from_data(data)), TERMS)


def free(system: System) -> int:
    """Return the degrees of freedom, the rows of B being well apart from each other."""
    assert system.warnings == ()
    equations, q = constraint_equations(system), np.array(system.initial_q)
    rows = np.linalg.solve(np.linalg.cholesky(equations.mass(q)), equations.jacobian(q, 0.0).T).T
    values = np.linalg.svd(rows / np.linalg.norm(rows, axis=1, keepdims=True), compute_uv=False)
    assert values[-1] > 1e-4 * values[0]
    assert np.all(np.abs(equations.constraint(q, 0.0)) <= 1e3 * EPSILON * equations.sizes(q, 0.0)[0])
    return system.nv - len(system.multipliers)


# -- mobility ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("plane", NAMED)
@pytest.mark.parametrize("loop", LOOPS)
def test_named_planes(loop: str, plane: str) -> None:
    for closing in CLOSINGS:
        scene = turned(LOOPS[loop](closing), NAMED[plane])
        assert free(assembled(scene)) == 1, closing
        assert free(assembled(on_free_body(scene))) == 7, closing


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("loop", LOOPS)
def test_any_plane_anywhere(loop: str, coordinates: str, rng: np.random.Generator) -> None:
    for closing in CLOSINGS if coordinates == "joint" else ("revolute",):
        shift = rng.standard_normal(3) * 10.0 ** rng.uniform(-2, 5)
        drawn, R = LOOPS[loop](closing) | {"coordinates": coordinates}, random_rotation(rng)
        assert free(assembled(turned(drawn, R, shift))) == 1, closing
        assert free(assembled(on_free_body(turned(drawn, R), shift))) == 7, closing


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_a_million_lengths_away(loop: str, coordinates: str, rng: np.random.Generator) -> None:
    shift = rng.standard_normal(3) * 3e5
    drawn, R = LOOPS[loop]("revolute") | {"coordinates": coordinates}, random_rotation(rng)
    system = assembled(turned(drawn, R, shift))
    equations = constraint_equations(system)
    assert system.warnings == () and system.nv - len(system.multipliers) == 1
    far = 1.0 if coordinates == "joint" else np.abs(shift).max()
    assert np.abs(equations.constraint(np.array(system.initial_q), 0.0)).max() <= 2e-15 * far
    flying = assembled(on_free_body(turned(drawn, R), shift))
    assert flying.nv - len(flying.multipliers) == 7


# -- starts ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_a_start_is_brought_onto_the_constraints_in_every_plane_alike(
    coordinates: str, rng: np.random.Generator
) -> None:
    scene = four_bar("revolute") | {"coordinates": coordinates}
    first = assembled(scene)
    for R in (random_rotation(rng), random_rotation(rng)):
        system = assembled(turned(scene, R, (100.0, -300.0, 20.0)))
        if coordinates == "joint":
            assert system.notes == first.notes
            assert system.initial_q == pytest.approx(first.initial_q, abs=1e-13)
            assert system.initial_v == pytest.approx(first.initial_v, abs=1e-12 * 30)


def in_these(scene: Mapping[str, Any], units: UnitsOf) -> Data:
    """Return a scene whose initial state is one of angles only in other units."""
    data = in_units(scene)
    for name, value in (("length", units.length), ("mass", units.mass), ("time", units.time)):
        data["parameters"][f"unit_{name}"]["value"] = value
    for joint in data["joints"].values():
        initial = dict(joint["initial"])
        linear = units.length if joint["type"] == "prismatic" else 1.0
        initial["position"] = initial.get("position", 0.0) * linear
        initial["velocity"] = initial.get("velocity", 0.0) * linear / units.time
        joint["initial"] = initial
    return data


@pytest.mark.long_cases("four_bar-absolute", "four_bar-joint", "slider_crank-absolute", "slider_crank-joint")
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("loop", ["four_bar", "slider_crank"])
def test_a_start_in_other_units(loop: str, coordinates: str, rng: np.random.Generator) -> None:
    scene = turned(LOOPS[loop]("revolute"), random_rotation(rng)) | {"coordinates": coordinates}
    first = assembled(in_these(scene, UnitsOf()))
    angles = [k for k, name in enumerate(first.factors) if name.name != "guide"]
    for units in DECIMAL if coordinates == "joint" else DECIMAL[-2:]:
        system = assembled(in_these(scene, units))
        assert system.multipliers == first.multipliers and system.nv - len(system.multipliers) == 1
        if coordinates == "joint":
            for k in angles:
                assert system.initial_q[k] == pytest.approx(first.initial_q[k], abs=1e-12)
                assert system.initial_v[k] * units.time == pytest.approx(first.initial_v[k], rel=1e-10, abs=1e-10)


def test_a_loop_that_opens_by_a_part_of_its_size_is_refused_in_any_units_and_anywhere() -> None:
    """A coupler too short by 2e-6 of the ground's length, where nothing can turn to make up for it."""
    for units in (UnitsOf(), *DECIMAL[-2:]):
        scene = in_these(four_bar("revolute", (0.1, 0.2, 0.1 - 2e-6, 0.4), (0.0, 0.0, np.pi)), units)
        for shift in (0.0, 1e5):
            moved = {**scene, "joints": {name: dict(joint) for name, joint in scene["joints"].items()}}
            for name in ("drive", "support"):
                place = moved["joints"][name]["position"]
                moved["joints"][name]["position"] = [f"{place[0]} + {shift} * unit_length", 0, 0]
            with pytest.raises(eomgen.ModelError, match="positions of the constraints cannot be met together"):
                assembled(moved)


def test_a_loop_that_opens_by_less_than_is_a_contradiction_says_by_how_much() -> None:
    system = assembled(four_bar("revolute", (0.1, 0.2, 0.1 - 1e-7, 0.4), (0.0, 0.0, np.pi)))
    assert "closure: origins meet along x stays off by 1e-07" in system.notes


# -- nothing can move --------------------------------------------------------------------------------------------------


def truss() -> Data:
    """Return two rods on the ground whose ends a hinge holds together: a triangle."""
    scene = four_bar("revolute", (0.3, 0.1, 0.4, 0.5), (0.9, 0.0, 2.2))
    del scene["bodies"]["coupler"], scene["joints"]["pin"]
    scene["constraints"]["closure"]["first"] = {"body": "crank", "position": [0.3, 0, 0], "axis": AXIS}
    return scene


LOCKED = (
    "nothing can move: 2 velocities are held by as many constraint rows that do not follow from each other; try: a"
    " constraint less, or one of fewer rows; for a motion that is prescribed, a drive or t in one of the equations"
)


def test_a_truss_cannot_move_and_every_run_says_so(rng: np.random.Generator) -> None:
    model = eomgen.build(turned(truss(), random_rotation(rng)), profile="quick")
    assert LOCKED in model.notes
    run = model.simulate(0.01, 1e-3)
    assert run.success and run.message.endswith(LOCKED) and "reached t = 0.01 s" in run.message
    assert np.abs(run.v).max() < 1e-9


def test_a_machine_that_drivers_move_is_prescribed_and_runs_say_nothing(rng: np.random.Generator) -> None:
    scene = four_bar("revolute")
    frames = [{"body": body, "axis": AXIS, "x_axis": [1, 0, 0]} for body in ("base", "crank")]
    scene["constraints"]["motor"] = {
        "type": "revolute",
        "first": frames[0],
        "second": frames[1],
        "drive": "0.5 + 30 * t",
    }
    model = eomgen.build(turned(scene, random_rotation(rng)), profile="quick")
    assert "all motion is prescribed: motor: driven angle and the constraints leave no velocity free" in model.notes
    assert model.simulate(0.01, 1e-3).message == "reached t = 0.01 s in 10 steps"


def test_a_driven_truss_cannot_move_either() -> None:
    scene = truss()
    frames = [{"body": body, "axis": AXIS, "x_axis": [1, 0, 0]} for body in ("base", "crank")]
    scene["constraints"]["motor"] = {"type": "revolute", "first": frames[0], "second": frames[1], "drive": "0.9"}
    with pytest.raises(eomgen.ModelError, match="positions of the constraints cannot be met together"):
        assembled(scene)


def test_all_rows_may_follow_from_the_joints() -> None:
    """A plane that holds a chain which its joints keep in that plane: rows of no use, and a model without
    constraints."""
    scene = slider_crank("revolute")
    scene["constraints"] = {
        "slab": {"type": "planar", "first": {"body": "base", "axis": AXIS}, "second": {"body": "rod", "axis": AXIS}},
    }
    model = eomgen.build(turned(scene, rotation_about((1, 2, 3), 0.8)), profile="quick")
    assert model.multipliers == () and len([note for note in model.notes if note.endswith("is left out")]) == 3
    assert model.simulate(0.01, 1e-3).success
    assert model.simulate(0.01, 1e-3, method="rk4").success


# -- the example, turned -----------------------------------------------------------------------------------------------

METHODS = ("generalized_alpha", "generalized_alpha_index3", "rk4_partitioned", "rattlie")
FAR = (1e4, -1e4, 5e3)


@pytest.fixture(scope="module")
def examples() -> dict[str, eomgen.Model]:
    """Return the example in one plane and turned to another, on the base and in flight, near the origin and far
    away."""
    drawn, R = four_bar("revolute"), random_rotation(np.random.default_rng(4))
    flying = on_free_body(drawn)
    scenes = {
        "drawn": drawn,
        "turned": turned(drawn, R),
        "far": turned(drawn, R, FAR),
        "flying": flying,
        "flying, turned": turned(flying, R),
        "flying, far": turned(on_free_body(drawn, FAR), R),
    }
    return {name: eomgen.build(scene, profile="quick") for name, scene in scenes.items()}


def angles_of(model: eomgen.Model, method: str, step: float = 5e-4) -> np.ndarray:
    """Return the angles of drive, pin and support at 41 times of a run, (41, 3), which do not depend on where the
    machine is."""
    run = model.simulate(0.2, step, method=method, record_every=round(5e-3 / step))
    assert run.success, run.message
    return run.q[:, -3:]


@pytest.mark.long
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("first", "others"), [("drawn", ("turned", "far")), ("flying", ("flying, turned", "flying, far"))]
)
def test_the_turned_example_moves_as_the_one_that_is_not(
    first: str, others: tuple[str, str], method: str, examples: dict[str, eomgen.Model]
) -> None:
    expected = angles_of(examples[first], method)
    assert np.ptp(expected[:, 0]) > np.pi
    for name, tolerance in zip(others, (1e-8, 1e-6), strict=True):
        assert np.abs(angles_of(examples[name], method) - expected).max() < tolerance


@pytest.mark.long_cases("turned")
@pytest.mark.parametrize("example", ["turned", "far", "flying, turned", "flying, far"])
def test_methods_agree_on_the_turned_example(example: str, examples: dict[str, eomgen.Model]) -> None:
    model = examples[example]
    expected = angles_of(model, "rk4_partitioned", 2.5e-4)
    for method in METHODS[:2]:
        whole, half = (angles_of(model, method, step) for step in (5e-4, 2.5e-4))
        assert np.abs(half - expected).max() < 5e-3
        assert np.abs((4.0 * half - whole) / 3.0 - expected).max() < 1e-4
