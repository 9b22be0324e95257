"""Parts of importers on numbers: poses, trees, loops, stops; and formulas of MJCF, evaluated as Python, against
functions of MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from eomgen.products.robots.draft import Axis, DraftJoint, DraftMimic, WrittenPose
from eomgen.products.robots.frames import WORLD_NODE, Pose
from eomgen.products.robots.joints import forces_of, friction_of, gap_of, loop_frame, stops_of
from eomgen.products.robots.leftovers import ElementPlace, off_right
from eomgen.products.robots.mjcf.muscles import Muscle, activation_rate
from eomgen.products.robots.scene_draft import LinkPlace
from eomgen.products.robots.tree import Edge, tree_of

HERE = ElementPlace("a.xml", 1)
#: Names in formulas that Python has.
WORDS = {name: getattr(math, name) for name in ("sin", "cos", "sqrt", "exp", "atan2")} | {"pi": math.pi}


def evaluated(formula: str, **values: Any) -> float:
    return float(eval(formula, {**WORDS, **values}))  # of the functions under test


def axis(**values: Any) -> Axis:
    return Axis(HERE, (0.0, 0.0, 2.0), **values)


def joint(name: str, kind: str, **values: Any) -> DraftJoint:
    return DraftJoint(name, HERE, WrittenPose(HERE), kind, kind, "", "", **values)


def turn(*vector: float) -> np.ndarray:
    return Rotation.from_rotvec(vector).as_matrix()


# -- poses, loops and stops --------------------------------------------------------------------------------------------


def test_rounding_of_places_is_zero() -> None:
    first = Pose(np.eye(3), np.array([1.0, 2.0, 3.0]))
    near = Pose(np.eye(3), first.position + np.array([4e-16, 0.0, 0.1]))  # of 1 m
    assert near.seen_from(first).position.tolist()[:2] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("kind", "shift", "turned", "gap", "angle"),
    [
        ("fixed", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0),
        ("fixed", (0.3, 0.0, 0.4), (0.0, 0.0, 0.2), 0.5, np.sin(0.2)),
        ("revolute", (0.0, 0.0, 0.4), (0.0, 0.0, 0.2), 0.4, 0.0),
        ("revolute", (0.0, 0.0, 0.0), (0.2, 0.0, 0.0), 0.0, np.sin(0.2)),
        ("prismatic", (0.3, 0.4, 7.0), (0.0, 0.0, 0.2), 0.5, np.sin(0.2)),
        ("planar", (3.0, 4.0, -0.2), (0.0, 0.0, 0.7), 0.2, 0.0),
        ("planar", (3.0, 4.0, 0.0), (0.0, -0.3, 0.7), 0.0, None),
        ("spherical", (0.0, 0.3, 0.4), (0.5, 0.6, 0.7), 0.5, 0.0),
        ("universal", (0.3, 0.4, 0.0), (0.0, 0.0, 0.7), 0.5, 1.0),
        ("universal", (0.0, 0.0, 0.0), (np.pi / 2, 0.0, 0.0), 0.0, 0.0),
    ],
)
def test_gaps_count_in_the_directions_that_a_constraint_holds(
    kind: str, shift: Sequence[float], turned: Sequence[float], gap: float, angle: float | None
) -> None:
    """Both ends seen from the first, which stands anywhere in the body."""
    start = Pose(turn(0.4, 0.1, -0.3), np.array([0.1, -0.2, 0.5]))
    end = start @ Pose(turn(*turned), np.array(shift))
    apart, about = gap_of(kind, [LinkPlace("b", item.orientation, item.position) for item in (start, end)])
    assert apart == pytest.approx(gap, abs=1e-14)
    assert about > 0.2 if angle is None else about == pytest.approx(angle, abs=1e-14)


def test_frames_of_loops_have_z_along_the_axis_or_x_and_y_along_two() -> None:
    one, two = np.array([0.6, 0.0, 0.8]), np.array([0.0, 1.0, 0.0])
    np.testing.assert_array_equal(loop_frame("fixed", []), np.eye(3))
    for frame in (loop_frame("revolute", [one]), loop_frame("universal", [one, two])):
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-15)
        assert np.linalg.det(frame) > 0.0
    np.testing.assert_allclose(loop_frame("revolute", [one])[:, 2], one)
    np.testing.assert_allclose(loop_frame("universal", [one, two])[:, :2].T, [one, two], atol=1e-15)


def test_springs_friction_and_stops_of_axes() -> None:
    """Numbers of one axis, lists of two; a stop gives way by 0.01 rad or 1 mm under the largest effort."""
    full = axis(damping=2.0, stiffness=3.0, rest=0.4, friction=0.5, lower=-1.0, upper=2.0, effort=10.0)
    assert forces_of([full]) == {"damping": 2.0, "stiffness": 3.0, "rest": 0.4}
    assert forces_of([axis(rest=0.4, damping=2.0)]) == {"damping": 2.0}
    assert forces_of([axis(), full]) == {"damping": [0.0, 2.0], "stiffness": [0.0, 3.0], "rest": [0.0, 0.4]}
    assert friction_of([full], "rad") == {"coulomb": 0.5, "velocity": 0.01}
    assert friction_of([axis(), full], "m") == {"coulomb": [0.0, 0.5], "velocity": 0.001}
    assert friction_of([axis(friction=-1.0)], "m") is None
    assert stops_of([full], "rad") == {"lower": -1.0, "upper": 2.0, "stiffness": 1000.0, "damping": 10.0}
    assert stops_of([full], "m") == {"lower": -1.0, "upper": 2.0, "stiffness": 10000.0, "damping": 100.0}
    assert stops_of([axis(upper=2.0, stop=(5.0, 6.0))], "m") == {"upper": 2.0, "stiffness": 5.0, "damping": 6.0}
    two = stops_of([full, axis(stop=(5.0, 6.0))], "rad")
    assert two is not None and two["stiffness"] == [1000.0, 5.0] and two["damping"] == [10.0, 6.0]
    for bad in (axis(), axis(lower=1.0, upper=1.0, effort=1.0), axis(upper=1.0), axis(upper=1.0, effort=0.0)):
        assert stops_of([bad], "rad") is None
    assert stops_of([full, axis(upper=1.0)], "rad") is None


# -- the tree of links -------------------------------------------------------------------------------------------------


def node(name: str) -> tuple[tuple[str, ...], str]:
    return WORLD_NODE if name == "world" else ((), name)


def edge(name: str, parent: str, child: str, held: float | None = None, kind: str = "revolute", **values: Any) -> Edge:
    return Edge(node(name), joint(name, kind, **values), node(parent), node(child), held)


def walks(links: str, *edges: Edge, roots: Mapping[str, str] | None = None) -> tuple[dict[str, list[str]], list[str]]:
    """Return the steps of each walk as ``joint>link``, with ``<`` of a reversed joint, and the joints of loops."""
    nodes = [node(name) for name in links]
    at = {item: node((roots or {}).get(item[1], links[0])) for item in nodes}
    walked, loops = tree_of(nodes, edges, at)
    found = {
        start[1]: [f"{step.edge.key[1]}{'<' if step.is_reversed else '>'}{step.end[1]}" for step in steps]
        for start, steps in walked.items()
    }
    return found, [item.key[1] for item in loops]


def test_joints_with_forces_are_of_the_tree_and_one_without_closes_a_loop() -> None:
    """Of a ring from the world over a, b and c: the one that the file cuts, else the last without forces."""
    ring = [edge("1", "world", "a"), edge("2", "a", "b"), edge("3", "world", "c"), edge("4", "c", "b")]
    assert walks("abc", *ring) == ({"world": ["1>a", "2>b", "3>c"]}, ["4"])
    damped = [*ring[:3], edge("4", "c", "b", axes=(axis(damping=1.0),))]
    assert walks("abc", *damped) == ({"world": ["1>a", "2>b", "4<c"]}, ["3"])
    cut = [edge("1", "world", "a", cut=True, axes=(axis(friction=1.0),)), *ring[1:]]
    assert walks("abc", *cut) == ({"world": ["3>c", "4>b", "2<a"]}, ["1"])
    fixed = [ring[0], *damped[1:3], edge("4", "c", "b", kind="fixed"), edge("5", "a", "c", 0.3)]
    tree, loops = walks("abc", *fixed)
    assert loops == ["2", "3"] and tree == {"world": ["1>a", "5>c", "4>b"]}
    mimic = DraftMimic(HERE, "1", 1.0, 0.0)
    for forces in ({"stiffness": 1.0}, {"friction": 1.0}, {"mimic": mimic}):
        assert walks("abc", *ring[:3], edge("4", "c", "b", axes=(axis(**forces),)))[1] == ["3"]


def test_free_parts_begin_at_the_link_of_their_model_unless_a_joint_carries_it() -> None:
    pair = edge("1", "a", "b")
    assert walks("abc", pair, roots={"c": "c"}) == ({"world": [], "a": ["1>b"], "c": []}, [])
    assert walks("ba", pair)[0] == {"world": [], "a": ["1>b"]}  # b is the root, and the joint's child
    assert walks("ab", edge("1", "a", "b"), edge("2", "b", "a"))[0] == {"world": [], "a": ["1>b"]}


# -- numbers -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.5708, -1.5708, 3.1416, 1.4, 4.6])
def test_distances_from_right_angles(angle: float) -> None:
    expected = 0.0 if angle in (0.0, 0.3) else min(abs(abs(angle) - k * np.pi / 2) for k in (1, 2, 3))
    assert off_right(angle) == pytest.approx(expected, abs=1e-15)


#: Of MuJoCo: range of lengths (2), force, scale, lmin, lmax, vmax, fpmax, fvmax.
MUSCLES = ((0.75, 1.05, -1.0, 200.0, 0.5, 1.6, 1.5, 1.3, 1.2), (0.7, 1.1, 50.0, 1.0, 0.4, 1.7, 2.0, 1.1, 1.0))


@pytest.mark.parametrize("parameters", MUSCLES)
def test_muscles_pull_like_mujoco_s(parameters: tuple[float, ...]) -> None:
    """Over all pieces of the curves of length and rate."""
    reach, acceleration = (0.4, 1.2), 0.7
    muscle = Muscle(parameters, reach, acceleration)
    for length in np.linspace(0.0, 2.5, 41):
        normal = evaluated(muscle.length("length"), length=length)
        passive = mujoco.mju_muscleBias(length, np.array(reach), acceleration, np.array(parameters))
        assert evaluated(muscle.passive("l"), l=normal) == pytest.approx(passive, rel=1e-12, abs=1e-12)
        for rate in (-6.0, -1.0, -0.3, 0.0, 0.1, 0.5, 3.0):
            pace = evaluated(muscle.rate("rate"), rate=rate)
            gain = mujoco.mju_muscleGain(length, rate, np.array(reach), acceleration, np.array(parameters))
            assert evaluated(muscle.gain("l", "v"), l=normal, v=pace) == pytest.approx(gain, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("width", [0.0, 0.3, 5.0])
def test_activations_change_like_mujoco_s(width: float) -> None:
    parameters = np.array([0.01, 0.04, width])
    formula = activation_rate("c", "a", parameters)
    for control in (-0.2, 0.0, 0.3, 0.5, 1.0, 1.4):
        for activation in (-0.1, 0.0, 0.2, 0.5, 0.8, 1.2):
            expected = mujoco.mju_muscleDynamics(control, activation, parameters)
            assert evaluated(formula, c=control, a=activation) == pytest.approx(expected, rel=1e-11, abs=1e-12)
