"""Constraints keep their rows wherever on a line or a plane a machine stands: its place is no lever of it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from eomgen.errors import ModelError
from eomgen.mechanics.derive import derive
from eomgen.pipeline.initial_assembly import constraint_equations, with_initial_assembly
from eomgen.scene.load import from_data
from eomgen.symbolic.evaluate import evaluate
from eomgen.system.system import System

Data = dict[str, Any]
TERMS = (
    "mass",
    "constraint",
    "constraint_velocity",
    "constraint_bias",
    "constraint_jacobian",
    "constraint_size",
    "residual",
)
COORDINATES = {
    "joint": ({}, {}), "SE3": ({"coordinates": "absolute"}, {"group": "SE3"}),
    "R3xSO3": ({"coordinates": "absolute"}, {"group": "R3xSO3"}),
}  # fmt: skip  # a table
#: What the constraint lets slide, and how many rows it has.
SLIDES = {
    "point_on_line": ([0, 0, 1], 2),
    "prismatic": ([0, 0, 1], 5),
    "cylindrical": ([0, 0, 1], 4),
    "planar": ([1, 0, 0], 3),
    "distance": ([0, 0, 1], 1),
}
UTM = (500000.0, 5400000.0)


def wheel(
    place: tuple[float, float], coordinates: str = "joint", radius: float = 0.2, tilt: float = 0.1, spin: float = 5.0
) -> Data:
    top, group = COORDINATES[coordinates]
    initial = {
        "position": [*place, radius],
        "rotation": [{"axis": [1, 0, 0], "angle": tilt}],
        "velocity": [0, spin, 0, 5 * radius, 0, 0],
    }
    ground = {
        "type": "rolling",
        "first": {"body": "base", "axis": [0, 0, 1]},
        "second": {"body": "wheel", "axis": [0, 1, 0]},
    }
    return {
        "format": 1,
        "name": "wheel",
        **top,
        "bodies": {"wheel": {"mass": 3.0, "inertia": [0.02, 0.04, 0.02], **group}},
        "joints": {"wheel": {"type": "free", "parent": "base", "child": "wheel", "initial": initial}},
        "constraints": {"ground": {**ground, "radius": radius}},
    }


def sliding(kind: str, far: float, coordinates: str, *, exchanged: bool) -> Data:
    """Return a body in flight that a constraint to the base's origin lets slide, so far from it."""
    top, group = COORDINATES[coordinates]
    axes: Data = {} if kind == "distance" else {"axis": [0, 0, 1]}
    if kind == "prismatic":
        axes["x_axis"] = [1, 0, 0]
    arm = np.array([0.3, 0.1, -0.2])
    place = np.array(SLIDES[kind][0]) * far - arm + ([0.0, 0.0, 2.0] if kind == "distance" else 0.0)
    on_base: Data = {"body": "base", **axes}
    on_body: Data = {"body": "b", "position": arm.tolist(), **axes}
    first, second = (on_body, on_base) if exchanged else (on_base, on_body)
    if kind == "point_on_line":
        second.pop("axis")
    item = {"type": kind, "first": first, "second": second} | ({"length": 2.0 + far} if kind == "distance" else {})
    body = {"mass": 2.0, "center_of_mass": [0.1, 0.2, 0.05], "inertia": [0.1, 0.2, 0.15], **group}
    initial = {"position": place.tolist(), "velocity": [0.0, 0.0, 0.5, 0.1, 0.2, 0.3]}
    return {
        "format": 1,
        "name": "sliding",
        "gravity": [1.0, 2.0, -9.81],
        **top,
        "bodies": {"b": body},
        "joints": {"j": {"type": "free", "parent": "base", "child": "b", "initial": initial}},
        "constraints": {"held": item},
    }


def assembled(data: Data) -> System:
    return with_initial_assembly(partial(derive, from_data(data)), TERMS)


def accelerations(system: System) -> NDArray[np.float64]:
    equations, q, v = constraint_equations(system), np.array(system.initial_q), np.array(system.initial_v)
    rows, nv = len(system.multipliers), system.nv
    inputs = {"q": q, "v": v, "a": np.zeros(nv), "lam": np.zeros(rows), "t": np.zeros(1)}

    def at(name: str) -> NDArray[np.float64]:
        return np.array(evaluate(system.tape, system.functions[name].refs, inputs), dtype=float)

    B = equations.jacobian(q, 0.0)
    matrix = np.block([[equations.mass(q), B.T], [B, np.zeros((rows, rows))]])
    return np.asarray(np.linalg.solve(matrix, -np.concatenate([at("residual"), at("constraint_bias")]))[:nv])


@pytest.mark.parametrize("coordinates", COORDINATES)
@pytest.mark.parametrize("tilt", [0.0, 0.1])
def test_wheel_rolls_anywhere(tilt: float, coordinates: str) -> None:
    near, far = (assembled(wheel(place, coordinates, tilt=tilt)) for place in ((0.0, 0.0), UTM))
    assert len(near.multipliers) == len(far.multipliers) == 3
    assert not any("left out" in note for note in far.notes)
    assert accelerations(far) == pytest.approx(accelerations(near), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("coordinates", COORDINATES)
def test_small_wheel_keeps_its_rows(coordinates: str) -> None:
    assert len(assembled(wheel((50.0, 0.0), coordinates, radius=2e-5)).multipliers) == 3


@pytest.mark.slow
def test_run_far_away() -> None:
    heights = []
    for place, method in (((0.0, 0.0), "generalized_alpha"), (UTM, "generalized_alpha"), (UTM, "rk4_partitioned")):
        run = eomgen.build(wheel(place)).simulate(0.05, 1e-3, method=method)
        assert run.success
        assert run.multipliers.shape[1] == 3
        heights.append(run.q[-1][6])
    assert heights == pytest.approx([heights[0]] * 3, abs=1e-7)


def test_frame_that_turns_far_away() -> None:
    text = (
        r"cannot be met together: after 0 corrections still off: .*held: origins meet along y by .*; turning moves"
        r" held: "
        r"origins meet along y by 1e\+06 m per rad, but the bodies that it joins measure 0.6 m; try: the two frames of"
        r" the"
        r" constraint "
        r"near each other, or its first and second exchanged"
    )
    with pytest.raises(ModelError, match=text):
        assembled(sliding("prismatic", 1e6, "joint", exchanged=False))


def test_a_lever_too_long_to_tell_whether_rows_of_angles_follow() -> None:
    text = (
        r"turning moves held: origins meet along x by 1e\+12 m per rad, but the bodies that it joins measure 0.6 m,"
        r" so that it is unknown whether these rows follow from others: held: z stays perpendicular to x, "
        r"held: z stays perpendicular to y; try: the two frames of the constraint near each other, or "
    )
    with pytest.raises(ModelError, match=text):
        assembled(sliding("prismatic", 1e12, "joint", exchanged=False))


def test_rows_that_rounding_hides() -> None:
    """A lever of 0.03 mm 1e8 m away from the plane's origin is some two thousand units of the last place of the
    distance."""
    hinge = {"type": "revolute", "parent": "base", "child": "b", "axis": [0, 1, 0], "position": [1e8, 0, 0]}
    plane = {"body": "base", "axis": [0, 0, 1], "position": [0, 0, 0]}
    tip = {"body": "b", "position": [3e-5, 0, 0]}
    data = {
        "format": 1,
        "name": "tip",
        "bodies": {"b": {"mass": 1.0, "inertia": [1.0, 1.0, 1.0]}},
        "joints": {"h": hinge},
        "constraints": {"table": {"type": "rolling", "shape": "sphere", "first": plane, "second": tip, "radius": 1e-9}},
    }
    text = (
        r"rounding hides whether these rows follow from others: table: contact.*; places up to 1e\+08 m away are"
        r" subtracted in them, and the bodies that they join measure 3e-05 m; try: frames of"
        r" constraints and an origin nearer to the machine"
    )
    with pytest.raises(ModelError, match=text):
        assembled(data)


@pytest.mark.parametrize("kind", ["prismatic", "cylindrical"])
def test_a_slider_that_has_travelled_far_in_absolute_coordinates_keeps_its_rows(kind: str) -> None:
    """Its rows for places have the travel for a lever, beside which its rows for angles seem small: rotations count as
    the displacements that they make. The forward force of 1 N/kg moves it by t^2/2."""
    for travel in (1e5, 1e6):
        position = travel if kind == "prismatic" else [0.0, travel]
        joint = {"type": kind, "parent": "base", "child": "car", "axis": [1, 0, 0], "initial": {"position": position}}
        scene = {
            "format": 1,
            "name": "train",
            "coordinates": "absolute",
            "gravity": [1, 2, -3],
            "joints": {"road": joint},
            "bodies": {"car": {"mass": 1500.0, "inertia": [100.0, 200.0, 300.0]}},
        }
        model = eomgen.build(scene, profile="quick")
        assert len(model.multipliers) == (5 if kind == "prismatic" else 4)
        run = model.simulate(1.0, 1e-2, error_estimate=False)
        assert run.success
        assert run.q[-1][4] - travel == pytest.approx(0.5, abs=1e-9)
