"""Random scenes as files hold them, full of structure: zeros, ones, coordinate axes, right angles, equal moments of
inertia.

``eomgen`` makes such numbers cheap. These scenes ask whether it also makes them special: ``shifted`` moves chosen
numbers by a little, so that what is computed before and after can be compared.
"""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from eomgen.errors import DescriptionError
from eomgen.scene.load import from_data
from tests.oracles.evaluation import Array

#: A path of keys and indices to a number.
Place = tuple[str | int, ...]
Data = dict[str, Any]

_TYPES = ("revolute", "prismatic", "helical", "cylindrical", "universal", "planar", "spherical", "free", "fixed")
_COORDINATES = {"revolute": 1, "prismatic": 1, "helical": 1, "cylindrical": 2, "universal": 2, "planar": 3}
_ANGLES = {"revolute": 1, "helical": 1, "cylindrical": 1, "universal": 2, "planar": 1}
_CONSTRAINTS = (
    "spherical", "distance", "revolute", "cylindrical", "planar", "point_on_line", "rolling", "universal", "prismatic",
    "helical", "fixed",
)  # fmt: skip  # a table

#: Keys whose numbers are geometry, with the size of what they are a part of.
_SIZES = {
    "axis": 1.0,
    "x_axis": 1.0,
    "second_axis": 1.0,
    "position": 1.0,
    "center_of_mass": 1.0,
    "point": 1.0,
    "angle": 1.0,
    "pitch": 1.0,
    "multiplier": 1.0,
    "offset": 1.0,
    "rest": 1.0,
    "length": 1.0,
    "gravity": 10.0,
    "mass": 1.0,
    "inertia": 0.05,
    "orientation": 1.0,
}
#: Between one seed and the next that is tried for the same scene.
_SEEDS = 10_000
#: Less than what the reader takes for rounding in axes and inertias.
_ROUNDING = 2e-7


class _Writer:
    def __init__(self, seed: int, absolute: bool) -> None:
        self.rng = np.random.default_rng(seed)
        self.absolute = absolute
        self.data: Data = {
            "format": 1,
            "name": f"written_{seed}",
            "bodies": {},
            "joints": {},
            "points": {},
            "gravity": self.gravity(),
        }
        if absolute:
            self.data["coordinates"] = "absolute"

    def chance(self, share: float) -> bool:
        return bool(self.rng.uniform() < share)

    def one_of(self, *values: Any) -> Any:
        return values[self.rng.integers(len(values))]

    def numbers(self, low: float, high: float, count: int) -> list[float]:
        return [float(number) for number in self.rng.uniform(low, high, count)]

    def gravity(self) -> list[float]:
        return list(self.one_of([0.0, 0.0, -9.81], [0.0, 9.81, 0.0], self.numbers(-7.0, 7.0, 3)))

    def place(self) -> list[float]:
        return [0.0 if self.chance(0.4) else float(self.rng.uniform(-0.6, 0.6)) for _ in range(3)]

    def direction(self) -> list[float]:
        kind = self.rng.uniform()
        unit = np.zeros(3)
        unit[self.rng.integers(3)] = self.one_of(-1.0, 1.0, 2.0)
        if kind < 0.6:
            return unit.tolist()
        if kind < 0.75:
            return list(
                np.roll(self.one_of([1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [3.0, 0.0, -4.0]), self.rng.integers(3)).tolist()
            )
        return list(self.one_of([1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], self.rng.normal(size=3).tolist()))

    def across(self, axis: list[float]) -> list[float]:
        while True:
            found = np.cross(axis, self.direction())
            if np.linalg.norm(found) > 0.3:
                return list((found + 0.0).tolist())

    def beside(self, axis: list[float]) -> list[float]:
        while True:
            found = self.direction()
            if np.linalg.norm(np.cross(axis, found)) > 0.3 * float(np.linalg.norm(axis) * np.linalg.norm(found)):
                return found

    def rotations(self) -> list[Data]:
        angles = (0.0, math.pi / 2, -math.pi / 2, math.pi, float(self.rng.uniform(-3.0, 3.0)))
        return [{"axis": self.direction(), "angle": self.one_of(*angles)} for _ in range(self.rng.integers(3))]

    def inertia(self) -> list[float]:
        a, b = self.numbers(0.03, 0.05, 2)
        principal = self.one_of([a, a, a], [a, a, b], [a, b, a], [b, a, a], [a, b, a + b], [a + b, b, a], [0.0, a, a])
        if self.chance(0.3):
            turned, _ = np.linalg.qr(self.rng.normal(size=(3, 3)))
            tensor = turned @ np.diag([a, b, 0.9 * (a + b)]) @ turned.T
            return [float(tensor[k]) for k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        return [*principal, 0.0, 0.0, 0.0]

    def body(self, name: str) -> None:
        entry: Data = {"mass": self.one_of(1.0, float(self.rng.uniform(0.3, 1.5))), "inertia": self.inertia()}
        if self.chance(0.8):
            entry["center_of_mass"] = self.place()
        self.data["bodies"][name] = entry

    def beam(self, name: str) -> None:
        self.data.setdefault("beams", {})[name] = {
            "length": 1.0,
            "mass_per_length": 1.0,
            "polar_inertia": 0.01,
            "bending_y": {"shapes": "clamped_free", "modes": 1, "stiffness": 20.0},
            self.one_of("bending_z", "stretch", "torsion"): {"shapes": "clamped_free", "modes": 1, "stiffness": 30.0},
        }

    def joint(self, name: str, kind: str, parent: str, child: str) -> None:
        entry: Data = {"type": kind, "parent": parent, "child": child, "position": self.place()}
        if parent in self.data.get("beams", {}):
            entry["position"][0] = self.one_of(1.0, 0.5, 1.0)
        if self.chance(0.3):
            signs = np.diag(self.rng.choice([-1.0, 1.0], 3))[self.rng.permutation(3)]
            entry["orientation"] = (signs * np.linalg.det(signs) + 0.0).tolist()
        else:
            entry["rotation"] = self.rotations()
        count = _COORDINATES.get(kind, 0)
        if count:
            entry["axis"] = self.direction()
            if kind == "universal":
                entry["second_axis"] = self.across(entry["axis"])
            if kind == "planar" and self.chance(0.5):
                entry["x_axis"] = self.beside(entry["axis"])
            if kind == "helical":
                entry["pitch"] = float(self.rng.uniform(0.02, 0.3))
            if self.chance(0.4):
                entry["stiffness"], entry["damping"] = self.numbers(1.0, 9.0, count), self.numbers(0.1, 2.0, count)
            if not self.absolute and self.chance(0.3):
                entry["rotor_inertia"] = self.numbers(0.0, 0.05, count)
            entry["initial"] = {"position": self.numbers(-0.5, 0.5, count), "velocity": self.numbers(-1.0, 1.0, count)}
        elif kind == "spherical":
            entry["initial"] = {"position": [1.0, 0.0, 0.0, 0.0], "velocity": [1.0, 0.0, 0.0]}
        self.data["joints"][name] = entry

    def tree(self, links: int) -> None:
        parents = ["base"]
        for number in range(links):
            body = f"body{number}"
            elastic = number == 1 and not self.absolute and self.chance(0.12)
            (self.beam if elastic else self.body)(body)
            kind = "revolute" if elastic or (not number and self.chance(0.3)) else self.one_of(*_TYPES)
            self.joint(f"joint{number}", kind, self.one_of(*parents[-2:]), body)
            if self.absolute and kind != "fixed" and self.chance(0.5):
                self.data["bodies"][body]["group"] = "R3xSO3"
            parents.append(body)
        single = [name for name, joint in self.data["joints"].items() if _COORDINATES.get(joint["type"]) == 1]
        if len(single) > 1 and not self.absolute and self.chance(0.4):
            multiplier, offset = self.one_of(1.0, -1.0, 0.7), self.one_of(0.0, 0.3)
            follower = self.data["joints"][single[-1]]
            follower["mimic"] = {"joint": single[0], "multiplier": multiplier, "offset": offset}
            del follower["initial"]

    def frame(self, body: str, need: str) -> Data:
        entry: Data = {"body": body, "position": self.place()}
        if body in self.data.get("beams", {}):
            entry["position"][0] = self.one_of(1.0, 0.0, 0.5)
        if need == "nothing":
            return entry
        if self.chance(0.4):
            return {**entry, "rotation": self.rotations()}
        axis = self.direction()
        return {**entry, "axis": axis} if need == "z" else {**entry, "axis": axis, "x_axis": self.beside(axis)}

    def constraint(self, kind: str) -> None:
        first_need, second_need = {
            "spherical": ("nothing", "nothing"),
            "distance": ("nothing", "nothing"),
            "revolute": ("z", "z"),
            "cylindrical": ("z", "z"),
            "planar": ("z", "z"),
            "point_on_line": ("z", "nothing"),
            "rolling": ("z", "z"),
        }.get(kind, ("x", "x"))
        first, second = self.two_bodies()
        entry: Data = {"type": kind, "first": self.frame(first, first_need), "second": self.frame(second, second_need)}
        entry |= {"distance": {"length": 0.8}, "rolling": {"radius": 0.3}, "helical": {"pitch": 0.1}}.get(kind, {})
        self.data.setdefault("constraints", {})[f"hold_{kind}"] = entry

    def two_bodies(self) -> tuple[str, str]:
        """Return two bodies, the second the outermost one."""
        names = [joint["child"] for joint in self.data["joints"].values()]
        return str(self.one_of("base", *names[:-1])), names[-1]

    def loads(self) -> None:
        names = [joint["child"] for joint in self.data["joints"].values()]
        self.data["points"] = {"ground": {"body": "base", "position": self.place()}}
        for number, name in enumerate(names[-2:]):
            self.data["points"][f"mark{number}"] = {"body": name, "position": self.place()}
            if name in self.data.get("beams", {}):
                self.data["points"][f"mark{number}"]["position"][0] = self.one_of(1.0, 0.0, 0.25)
        self.data["points"]["ground"]["position"][2] = -2.5
        self.data["springs"] = {
            "tie": {"first": "ground", "second": "mark0", "stiffness": 20.0, "damping": 1.0, "length": 1.0}
        }
        force, torque = ["sin(t)", 1.0, "-velocity.mark0[0]"], [0.0, 0.2, 0.1]
        push = {
            "body": names[0],
            "point": self.place(),
            "force": force,
            "torque": torque,
            "axes": self.one_of("world", "body"),
        }
        self.data["forces"] = {"push": push}
        if names[0] in self.data.get("beams", {}):
            push["point"][0] = 0.5
        self.data["outputs"] = {
            "place": {"position": "mark0"}, "speed": {"velocity": "mark0"}, "acceleration": {"acceleration": "mark0"},
        }  # fmt: skip  # a table
        turning = [name for name, joint in self.data["joints"].items() if _ANGLES.get(joint["type"]) == 1]
        if turning and self.chance(0.3):
            self.data["torsion_springs"] = {"twist": {"first": turning[0], "stiffness": 3.0, "damping": 0.1}}
        if self.chance(0.3):
            first, second = self.two_bodies()
            self.data["bushings"] = {
                "mount": {
                    "first": self.frame(first, "x"),
                    "second": self.frame(second, "x"),
                    "stiffness": [100.0, 200.0, 300.0],
                    "rotational_stiffness": [5.0, 6.0, 7.0],
                    "damping": [1.0, 0.0, 2.0],
                    "rest": self.place(),
                    "rest_rotation": self.rotations(),
                }
            }
        if self.chance(0.2):
            slip = {"axis": self.direction(), "stiffness": [10.0, 12.0], "velocity": 1.0}
            self.data["tyres"] = {
                "wheel": {
                    "center": "mark0",
                    "radius": 1.5,
                    "stiffness": 100.0,
                    "damping": 1.0,
                    "onset": 0.5,
                    "slip": slip,
                }
            }

    def base(self) -> None:
        turns = [{"axis": self.direction(), "angle": f"{self.one_of(0.3, 0.8)}*sin({rate}*t)"} for rate in (1.1, 0.7)]
        position = self.one_of([0.0, 0.0, 0.0], ["0.2*sin(t)", 0.0, "0.1*t"])
        self.data["base"] = {"position": position, "rotation": turns[: self.rng.integers(1, 3)]}


def structured_scene(number: int) -> Data:
    """Return nested data of a random scene of two or three bodies, as a scene file holds it.

    Every third scene is in absolute coordinates, every second one is constrained, though not to a state that it can be
    in.
    """
    # joints may carry what has no inertia, frames may be in one rigid body
    for seed in itertools.count(number, _SEEDS):
        data = _written(seed, absolute=number % 3 == 2, constrained=number % 2 == 1)
        try:
            from_data(data)
        except DescriptionError:
            continue
        return data
    raise AssertionError


def _written(seed: int, *, absolute: bool, constrained: bool) -> Data:
    writer = _Writer(seed, absolute)
    writer.tree(int(writer.rng.integers(2, 4)))
    writer.loads()
    if writer.chance(0.4):
        writer.base()
    if constrained:
        for number in writer.rng.permutation(len(_CONSTRAINTS))[: writer.rng.integers(1, 4)]:
            writer.constraint(_CONSTRAINTS[number])
    return writer.data


def structure(data: Data) -> list[list[Place]]:
    """Return the places of all numbers that are geometry or inertia, those of one vector together.

    An orientation, which is a matrix, has three: the components of a rotation vector by which it is turned.
    """
    return [list(_numbers(key, value, place)) for key, value, place in _entries(data, ())]


def _entries(data: Any, place: Place) -> Iterator[tuple[str, Any, Place]]:
    for key, value in data.items() if isinstance(data, Mapping) else enumerate(data):
        if key in _SIZES and not isinstance(value, Mapping):
            if next(_numbers(key, value, ()), None) is not None:
                yield key, value, (*place, key)
        elif isinstance(value, Mapping | list):
            yield from _entries(value, (*place, key))


def _numbers(key: str, value: Any, place: Place) -> Iterator[Place]:
    if key == "orientation":
        yield from ((*place, number) for number in range(3))
    elif isinstance(value, list):
        yield from ((*place, number) for number, entry in enumerate(value) if isinstance(entry, float))
    elif isinstance(value, float):
        yield place


def shifted(data: Data, amounts: Mapping[Place, float]) -> Data:
    """Return the data with numbers moved by the given amounts, times the size of what they are a part of.

    What has to hold between numbers still does: the second axis of a universal joint stays across the first,
    quaternions keep their length, and moments of inertia grow where an amount is too large to pass for rounding of a
    flat body's.
    """
    result = copy.deepcopy(data)
    turns: dict[Place, Array] = {}
    for place, amount in amounts.items():
        holder, key = _at(result, place[:-1]), str(next(part for part in reversed(place) if isinstance(part, str)))
        if key == "orientation":
            turns.setdefault(place[:-1], np.zeros(3))[place[-1]] = amount
            continue
        holder[place[-1]] += amount * _SIZES[key]
        if key == "inertia" and abs(amount) > _ROUNDING:
            holder[:3] = [moment + 4.0 * abs(amount) * _SIZES[key] for moment in holder[:3]]
    for place, vector in turns.items():
        matrix = np.array(_at(result, place)) @ Rotation.from_rotvec(vector).as_matrix()
        _at(result, place[:-1])[place[-1]] = matrix.tolist()
    for joint in result["joints"].values():
        if "second_axis" in joint:
            axis, second = np.array(joint["axis"]), np.array(joint["second_axis"])
            if abs(axis @ second) > _ROUNDING:
                joint["second_axis"] = (second - (axis @ second) / (axis @ axis) * axis).tolist()
        if joint["type"] == "spherical":
            quaternion = np.array(joint["initial"]["position"])
            joint["initial"]["position"] = (quaternion / np.linalg.norm(quaternion)).tolist()
    return result


def _at(data: Any, place: Place) -> Any:
    for part in place:
        data = data[part]
    return data
