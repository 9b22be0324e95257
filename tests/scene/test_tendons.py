"""Tendons: lengths by closed forms, forces by virtual work of the length, smooth contact, and every message."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import eomgen
from eomgen.errors import DescriptionError
from eomgen.formula.nodes import Number
from eomgen.lie.numeric import rotation_matrix
from eomgen.lie.product import update
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene
from tests.models.library import scene
from tests.oracles.evaluation import tape_evaluator

ARM = """\
format = 1
name = "arm"
gravity = [0, 0, 0]
bodies.upper = { mass = 1.0, inertia = [0.01, 0.01, 0.01] }
bodies.lower = { mass = 0.7, inertia = [0.01, 0.01, 0.01] }
joints.shoulder = { type = "spherical", parent = "base", child = "upper" }
joints.elbow = { type = "revolute", parent = "upper", child = "lower", position = [0.3, 0, 0], axis = [0, 1, 0] }
[points]
origin = { body = "base", position = [0.05, 0.02, 0.1] }
guide = { body = "upper", position = [0.15, 0.01, 0.06] }
end = { body = "lower", position = [0.12, -0.02, 0.04] }
away = { body = "upper", position = [0.3, 0.0, 0.2] }
"""
TENDON = """[tendons.biceps]
points = ["origin", "guide", "end"]
stiffness = 300
damping = 5
length = 0.2
force = "3 + 0.1 * path_length.biceps"
wraps = [WRAPS]
[outputs]
length = { formula = "path_length.biceps" }
rate = { formula = "path_rate.biceps" }
tension = { formula = "path_tension.biceps" }
"""
ELBOW = '{ after = "guide", shape = "cylinder", center = { body = "upper", position = [0.3, 0, 0], axis = [0.1, 1, 0] }'
WRAPS = (
    ELBOW
    + ', radius = 0.05, side = "away" }, { after = "origin", center = { body = "base", position = [0.1, 0, 0.06] }, '
    "radius = 0.03 }"
)


def read(wraps: str = WRAPS, old: str = "", new: str = "") -> Scene:
    return load_toml((ARM + TENDON).replace("WRAPS", wraps).replace(old, new), file="arm.toml")


def problem(wraps: str = WRAPS, old: str = "", new: str = "") -> str:
    with pytest.raises(DescriptionError) as caught:
        read(wraps, old, new)
    return str(caught.value.problems[0]).partition(": ")[2]


@cache
def arm() -> eomgen.Model:
    return eomgen.build(read(), profile="quick")


def states(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    turns = rng.standard_normal((count, 4))
    q = np.column_stack([turns / np.linalg.norm(turns, axis=1, keepdims=True), rng.uniform(-2.5, 2.5, count)])
    return q, rng.standard_normal((count, 4))


def test_keys_and_defaults() -> None:
    (tendon,) = read().tendons
    assert tendon.points == ("origin", "guide", "end") and tendon.damping == Number(5.0)
    first, second = tendon.wraps
    assert (first.after, first.cylinder, first.side) == (0, False, "")
    assert (second.after, second.cylinder, second.side, second.radius) == (1, True, "away", Number(0.05))
    assert tendon.label == "tendon biceps" and tendon.passive().force == Number(0.0)


@pytest.mark.parametrize(
    ("wraps", "old", "new", "message"),
    [
        ("", 'points = ["origin", "guide", "end"]', 'points = ["end"]', "a path needs two points, not 1"),
        ("", '"guide", "end"]', '"end", "end"]', "the path goes from the point end to itself; try: another point"),
        (ELBOW.replace("guide", "end") + ", radius = 1 }", "", "", "no point of the path follows a point end"),
        (ELBOW + ", radius = 0 }", "", "", "the radius of an obstacle is 0"),
        (ELBOW + ", radius = 1 }, " + ELBOW + ", radius = 1 }", "", "", "two obstacles follow the point guide"),
        (ELBOW + ", radius = 1 }", '"guide", "end"]', '"guide", "end", "guide", "away"]',
            "passes the point guide twice"),
        (ELBOW + ', radius = 1, side = "away", inside = true }', "", "", "a path through a ring has no side"),
        (ELBOW.replace(", axis = [0.1, 1, 0]", "") + ", radius = 1 }", "", "", "a cylinder needs the axes of this"),
    ],
)  # fmt: skip  # a table
def test_mistakes_have_a_place_and_a_remedy(wraps: str, old: str, new: str, message: str) -> None:
    assert message in problem(wraps, old, new)


@pytest.mark.slow
def test_forces_are_the_virtual_work_of_the_length(rng: np.random.Generator) -> None:
    model, step = arm(), 1e-5
    wrapped = 0
    for q, v in zip(*states(rng, 40), strict=True):
        outputs = model.outputs(q, v)
        lengths = [
            [model.outputs(update(model.factors, q, sign * step * along), v)["length"] for sign in (1.0, -1.0)]
            for along in np.eye(4)
        ]
        slopes = np.array([(ahead - back) / (2.0 * step) for ahead, back in lengths])
        assert outputs["rate"] == pytest.approx(slopes @ v, abs=2e-8)
        spring = 300.0 * (outputs["length"] - 0.2) + 3.0 + 0.1 * outputs["length"]
        assert outputs["tension"] == pytest.approx(spring + 5.0 * outputs["rate"], rel=1e-13)
        at_rest = model.inverse_dynamics(q, np.zeros(4), np.zeros(4))  # bodies at rest: minus the generalized force
        np.testing.assert_allclose(at_rest, spring * slopes, atol=1e-6)
        wrapped += int(abs(outputs["length"] - straight(q)) > 1e-6)
    assert 10 < wrapped < 40


def straight(q: np.ndarray) -> float:
    """Return the length of the path without obstacles."""
    upper, lower = rotation_matrix(q[:4]), rotation_matrix(q[:4]) @ about_y(q[4])
    elbow = upper @ [0.3, 0.0, 0.0]
    points = [[0.05, 0.02, 0.1], upper @ [0.15, 0.01, 0.06], elbow + lower @ [0.12, -0.02, 0.04]]
    return float(np.linalg.norm(np.diff(np.array(points), axis=0), axis=1).sum())


def about_y(angle: float) -> np.ndarray:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])


BELT = """\
format = 1
name = "belt"
gravity = [0, 0, 0]
bodies.end = { mass = 2.0, inertia = [0.1, 0.1, 0.1] }
joints.free = { type = "free", parent = "base", child = "end" }
[points]
start = { body = "base", position = [-2, -1, 0] }
end = { body = "end" }
above = { body = "base", position = [0, 3, 0] }
[tendons.belt]
points = ["start", "end"]
stiffness = 40
wraps = [{ after = "start", shape = "SHAPE", center = CENTER, radius = 0.5, side = "above" }]
[outputs]
length = { formula = "path_length.belt" }
"""


@cache
def belt(shape: str) -> eomgen.Model:
    center = '{ body = "base", axis = [0, 0, 1] }' if shape == "cylinder" else '{ body = "base" }'
    return eomgen.build(load_toml(BELT.replace("SHAPE", shape).replace("CENTER", center)), profile="quick")


def length_at(shape: str, place: tuple[float, float, float]) -> float:
    return float(belt(shape).outputs(np.array([1.0, 0.0, 0.0, 0.0, *place]), np.zeros(6))["length"])


def over_the_circle(radius: float, first: tuple[float, float], second: tuple[float, float]) -> float:
    """Return the length of both tangents and of the arc above the circle."""
    distances = [float(np.hypot(*point)) for point in (first, second)]
    tangents = [np.sqrt(distance**2 - radius**2) for distance in distances]
    angles = [np.arctan2(point[1], point[0]) % (2 * np.pi) for point in (first, second)]
    swept = (angles[0] - angles[1]) % (2 * np.pi)
    arc = swept - sum(np.arccos(radius / distance) for distance in distances)
    return float(sum(tangents) + radius * arc)


@pytest.mark.slow
def test_wrapped_lengths_are_tangents_and_arc() -> None:
    for end in ((2.0, -1.0), (1.0, -0.2), (2.0, 0.1), (0.4, -0.4)):
        plane = over_the_circle(0.5, (-2.0, -1.0), end)
        assert length_at("sphere", (*end, 0.0)) == pytest.approx(plane, rel=1e-14)
        assert length_at("cylinder", (*end, 0.0)) == pytest.approx(plane, rel=1e-14)
        assert length_at("cylinder", (*end, 1.5)) == pytest.approx(np.hypot(plane, 1.5), rel=1e-14)  # a helix


def test_the_path_leaves_the_obstacle_smoothly() -> None:
    model = belt("cylinder")
    # the line from the start touches the circle from above at this height over x = 2
    slope = float(np.tan(np.arctan2(1.0, 2.0) + np.arcsin(0.5 / np.hypot(2.0, 1.0))))
    forces = []
    for offset in (-1e-7, 1e-7):
        q = np.array([1.0, 0.0, 0.0, 0.0, 2.0, -1.0 + 4.0 * slope + offset, 0.3])
        length = float(model.outputs(q, np.zeros(6))["length"])
        direct = float(np.linalg.norm(q[4:] - [-2.0, -1.0, 0.0]))
        assert (length - direct > 1e-16) == (offset < 0.0) or abs(length - direct) < 1e-13
        forces.append(model.inverse_dynamics(q, np.zeros(6), np.zeros(6)))
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-5)


def test_a_path_from_the_base_to_the_world_by_hand() -> None:
    points = {"a": {"body": "base", "position": [1, 0, 0]}, "b": {"body": "rod", "position": [0, 0, -1]}}
    points["c"] = {"body": "world", "position": [0, 0, 2]}
    path = {"points": ["a", "b", "c"], "stiffness": 10.0, "length": 1.0, "damping": 2.0}
    outputs = {"T": {"formula": "path_tension.rope"}}
    system = eomgen.derive(scene("pendulum", points=points, tendons={"rope": path}, outputs=outputs), ["outputs"])
    found = tape_evaluator(system)("outputs", {"q": np.zeros(1), "v": np.full(1, 3.0), "a": np.zeros(1)})["y"]
    assert found == pytest.approx(10.0 * (np.sqrt(2.0) + 3.0 - 1.0) + 2.0 * 3.0 / np.sqrt(2.0), rel=1e-14)
    points["b"]["position"], points["a"] = [0, 0, 0], {"body": "base"}
    with pytest.raises(eomgen.ModelError, match="the points a and b coincide for all coordinates, so the path has no"):
        eomgen.derive(scene("pendulum", points=points, tendons={"rope": path}), ["force"])


RING = BELT.replace(', side = "above"', ", inside = true")


@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_a_path_through_a_ring_has_equal_angles_at_the_ring(shape: str) -> None:
    center = '{ body = "base", axis = [0, 0, 1] }' if shape == "cylinder" else '{ body = "base" }'
    model = eomgen.build(load_toml(RING.replace("SHAPE", shape).replace("CENTER", center)), profile="quick")
    start, end = np.array([-2.0, -1.0]), np.array([1.5, -1.2])
    q = np.array([1.0, 0.0, 0.0, 0.0, *end, 0.0])
    length = float(model.outputs(q, np.zeros(6))["length"])

    def by_way_of(angle: float) -> float:
        point = 0.5 * np.array([np.cos(angle), np.sin(angle)])
        return float(np.linalg.norm(point - start) + np.linalg.norm(end - point))

    # From within, the ring holds the path at the shortest of all ways over its points.
    shortest = minimize_scalar(by_way_of, bounds=(-np.pi, 0.0), method="bounded", options={"xatol": 1e-12})
    assert length == pytest.approx(shortest.fun, rel=1e-13)
    contact = 0.5 * np.array([np.cos(shortest.x), np.sin(shortest.x)])
    pull = 40.0 * length * (contact - end) / np.linalg.norm(contact - end)
    np.testing.assert_allclose(-model.inverse_dynamics(q, np.zeros(6), np.zeros(6))[3:5], pull, rtol=1e-6)
    through = np.array([1.0, 0.0, 0.0, 0.0, 2.0, 0.9, 0.0])  # the straight line goes through the ring
    direct = float(model.outputs(through, np.zeros(6))["length"])
    assert direct == pytest.approx(np.hypot(4.0, 1.9), rel=1e-14)


def test_a_spring_around_a_cylinder_keeps_its_energy() -> None:
    model = belt("cylinder")
    run = model.simulate(2.0, 1e-3, method="generalized_alpha", rho_inf=1.0)
    assert run.success
    total = run.energy["total"]
    assert np.ptp(run.q[:, 5]) > 0.5
    assert np.max(np.abs(total - total[0])) < 1e-4 * np.max(run.energy["kinetic"])


@pytest.mark.slow
def test_partials_of_a_wrapped_path(rng: np.random.Generator) -> None:
    model, step = arm(), 1e-6
    for q, v in zip(*states(rng, 8), strict=True):
        found = model.derivatives("inverse_dynamics", q=q, v=v, a=np.zeros(4), of=["q"])
        for k, along in enumerate(np.eye(4)):
            ahead, back = (
                model.inverse_dynamics(update(model.factors, q, sign * step * along), v, np.zeros(4))
                for sign in (1.0, -1.0)
            )
            np.testing.assert_allclose(found[:, k], (ahead - back) / (2 * step), atol=2e-5)
