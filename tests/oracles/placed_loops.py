"""Planar loops closed by joints in space, in any plane, anywhere, on the base or on a body that flies.

Every vector of a scene is turned, in whatever frame it is given: body frames stay parallel to the world's, so that axes
and places have three components that are no round numbers.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Data = dict[str, Any]

AXIS = (0.0, -1.0, 0.0)


def rod(length: float) -> Data:
    return {
        "mass": 2 * length,
        "center_of_mass": [length / 2, 0, 0],
        "inertia": [1e-3 * length**3, length**3 / 6, length**3 / 6],
    }


def hinge(parent: str, child: str, place: float, angle: float, speed: float = 0.0) -> Data:
    initial = {"position": angle, "velocity": speed}
    return {
        "type": "revolute",
        "parent": parent,
        "child": child,
        "axis": AXIS,
        "position": [place, 0, 0],
        "initial": initial,
    }


def four_bar(
    closing: str, lengths: Sequence[float] = (0.1, 0.35, 0.3, 0.4), angles: Sequence[float] = (0.5, 0.3, 1.5)
) -> Data:
    """Return crank, coupler and rocker in the xz plane, closed at the rocker's end by a joint in space."""
    crank, coupler, rocker, ground = lengths
    return {
        "format": 1,
        "name": "bars",
        "gravity": [0, 0, -9.81],
        "bodies": {"crank": rod(crank), "coupler": rod(coupler), "rocker": rod(rocker)},
        "joints": {
            "drive": hinge("base", "crank", 0.0, angles[0], 30.0),
            "pin": hinge("crank", "coupler", crank, angles[1]),
            "support": hinge("base", "rocker", ground, angles[2]),
        },
        "constraints": {"closure": _closure(closing, ("coupler", coupler), ("rocker", rocker))},
    }


def parallelogram(closing: str) -> Data:
    return four_bar(closing, (0.3, 0.5, 0.3, 0.5), (0.8, -0.8, 0.8))


def slider_crank(closing: str) -> Data:
    """Return crank and rod in the xz plane and a slider along x, closed at the rod's end by a joint in space."""
    return {
        "format": 1,
        "name": "engine",
        "gravity": [0, 0, -9.81],
        "bodies": {"crank": rod(0.1), "rod": rod(0.3), "slider": {"mass": 1.0, "inertia": [0.01, 0.01, 0.01]}},
        "joints": {
            "drive": hinge("base", "crank", 0.0, 0.7, 20.0),
            "pin": hinge("crank", "rod", 0.1, -0.9),
            "guide": {
                "type": "prismatic",
                "parent": "base",
                "child": "slider",
                "axis": [1, 0, 0],
                "initial": {"position": 0.37},
            },
        },
        "constraints": {"closure": _closure(closing, ("rod", 0.3), ("slider", 0.0))},
    }


def windows(count: int) -> Data:
    """Return posts of 1 m joined by lintels of 1 m, upright, whose tops move with 1 m/s: IFToMM benchmark A02.

    All rods lie on one line twice in a turn, where every window can fold of its own.
    """
    post: Data = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0, 1 / 12, 1 / 12]}
    feet = {f"foot{k}": hinge("base", f"post{k}", float(k), np.pi / 2, -1.0) for k in range(count + 1)}
    corners = {f"corner{k}": hinge(f"post{k}", f"lintel{k}", 1.0, -np.pi / 2, 1.0) for k in range(count)}
    return {
        "format": 1,
        "name": "windows",
        "gravity": [0, 0, -9.81],
        "bodies": {joint["child"]: dict(post) for joint in (*feet.values(), *corners.values())},
        "joints": feet | corners,
        "constraints": {
            f"top{k}": _closure("point_on_line", (f"lintel{k}", 1.0), (f"post{k + 1}", 1.0)) for k in range(count)
        },
    }


def _closure(kind: str, first: tuple[str, float], second: tuple[str, float]) -> Data:
    frames: list[Data] = [{"body": body, "position": [place, 0, 0]} for body, place in (first, second)]
    for frame in {"spherical": [], "point_on_line": frames[:1]}.get(kind, frames):
        frame |= {"axis": AXIS, "x_axis": (1, 0, 0)}
    return {"type": kind, "first": frames[0], "second": frames[1]}


#: Loops of one degree of freedom, and the joints that close them.
LOOPS = {"four_bar": four_bar, "parallelogram": parallelogram, "slider_crank": slider_crank}
CLOSINGS = ("revolute", "spherical", "cylindrical", "point_on_line")


def turned(scene: Mapping[str, Any], R: Array, shift: Sequence[float] = (0.0, 0.0, 0.0)) -> Data:
    """Return a scene with all its vectors turned by R and what is on the base shifted besides."""
    result = copy.deepcopy(dict(scene))
    result["gravity"] = _times(R, result["gravity"])
    for body in result["bodies"].values():
        body["center_of_mass"] = _times(R, body.get("center_of_mass", (0, 0, 0)))
        moments = R @ np.diag(body["inertia"]) @ R.T
        body["inertia"] = [float(moments[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    frames = [frame for item in result["constraints"].values() for frame in (item["first"], item["second"])]
    for table, place in [(joint, joint["parent"]) for joint in result["joints"].values()] + [
        (f, f["body"]) for f in frames
    ]:
        start = np.array(shift) if place == "base" else np.zeros(3)
        table["position"] = [float(x) for x in np.array(_times(R, table.get("position", (0, 0, 0)))) + start]
        for key in {"axis", "x_axis"} & set(table):
            table[key] = _times(R, table[key])
    for joint in result["joints"].values():
        if joint["type"] == "free":  # its angular and its linear velocity
            velocity = joint["initial"]["velocity"]
            joint["initial"]["velocity"] = [*_times(R, velocity[:3]), *_times(R, velocity[3:])]
    for point in result.get("points", {}).values():
        point["position"] = _times(R, point["position"])
    return result


def on_free_body(scene: Mapping[str, Any], shift: Sequence[float] = (0.0, 0.0, 0.0)) -> Data:
    """Return a scene on a body that flies, in place of the base, without gravity."""
    result = copy.deepcopy(dict(scene))
    result["gravity"] = [0, 0, 0]
    for joint in result["joints"].values():
        joint["parent"] = "hull" if joint["parent"] == "base" else joint["parent"]
    hull = {"mass": 5.0, "inertia": [0.3, 0.4, 0.5]}
    spin = {"position": list(shift), "velocity": [0.3, 2.0, -0.5, 0.1, 0.2, 0.3]}
    result["bodies"] = {"hull": hull} | result["bodies"]
    result["joints"] = {"float": {"type": "free", "parent": "base", "child": "hull", "initial": spin}} | result[
        "joints"
    ]
    return result


def random_rotation(rng: np.random.Generator) -> Array:
    """Return a rotation matrix, uniformly distributed."""
    Q, upper = np.linalg.qr(rng.standard_normal((3, 3)))
    Q = Q * np.sign(np.diag(upper))
    return np.asarray(Q * np.linalg.det(Q))


def rotation_about(axis: Sequence[float], angle: float) -> Array:
    """Return a rotation matrix, by Rodrigues' formula."""
    n = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


def _times(R: Array, x: Sequence[float]) -> list[float]:
    return [float(value) for value in R @ np.array(x, dtype=float)]
