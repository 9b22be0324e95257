"""Random scene files: trees, loops and absolute coordinates with every joint, force element and kind of formula."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.oracles.interpreter.equations import State
from tests.oracles.interpreter.machine import ANGLES, COORDINATES, SIZES, Machine

Array = NDArray[Any]
Data = dict[str, Any]

JOINT_TYPES = ("revolute", "prismatic", "helical", "cylindrical", "universal", "planar", "spherical", "free", "fixed")
FREEDOMS = {
    "spherical": 3, "revolute": 5, "universal": 4, "cylindrical": 4, "helical": 5, "prismatic": 5, "planar": 3,
    "fixed": 6, "distance": 1, "point_on_line": 2, "rolling": 3,
}  # fmt: skip  # a table: rows of each constraint


class Writer:
    """Writer of one random scene."""

    def __init__(self, seed: int, kind: str) -> None:
        self.rng, self.kind = np.random.default_rng([seed, len(kind)]), kind
        self.data: Data = {"format": 1, "name": "generated", "bodies": {}, "joints": {}}

    def chance(self, p: float) -> bool:
        return bool(self.rng.uniform() < p)

    def pick(self, options: Any) -> Any:
        return options[self.rng.integers(len(options))]

    def number(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def vector(self, size: float, n: int = 3) -> list[float]:
        """Return a vector; coordinate directions and zeros are as likely as any other."""
        values = self.rng.uniform(-size, size, n)
        if self.chance(0.4):
            values *= self.rng.integers(0, 2, n)
        return [float(x) for x in values]

    def axis(self) -> list[float]:
        if self.chance(0.5):
            return [float(x) for x in self.pick([1.0, -1.0]) * np.eye(3)[self.rng.integers(3)]]
        return [float(x) for x in self.rng.normal(size=3)]

    def turn(self) -> list[Data]:
        angle = self.pick(["pi / 2", "-pi / 2", "pi"]) if self.chance(0.4) else self.number(-3, 3)
        return [{"axis": self.axis(), "angle": angle} for _ in range(self.rng.integers(1, 3))]

    def parameter(self, value: float) -> Any:
        """Return the value, or the name of a parameter that has it."""
        if self.chance(0.75):
            return value
        table = self.data.setdefault("parameters", {})
        name = f"p{len(table)}"
        table[name] = {"value": value, "tunable": self.chance(0.6)}
        return f"{name}" if self.chance(0.5) else f"2 * {name} - {value!r}"

    # -- bodies and joints -----------------------------------------------------------------------------------------

    def body(self, massless: bool) -> Data:
        if massless:
            return {"mass": 0}
        masses, places = self.rng.uniform(0.1, 0.6, 6), self.rng.uniform(-0.3, 0.3, (6, 3))
        if self.chance(0.3):
            J = np.diag(0.1 + 0.05 * self.rng.uniform(0, 1, 3))
        else:
            J = np.zeros((3, 3))
            for m, r in zip(masses, places, strict=True):
                J += m * ((r @ r) * np.eye(3) - np.outer(r, r))
        J = 0.5 * (J + J.T)
        forms = [
            [J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]],
            J.tolist(),
            {"xx": J[0, 0], "yy": J[1, 1], "zz": J[2, 2], "xy": J[0, 1], "xz": J[0, 2], "yz": J[1, 2]},
        ]
        inertia: Any = self.pick(forms)
        if not np.any(J - np.diag(np.diag(J))):
            inertia = [float(x) for x in np.diag(J)]
        body = {"mass": self.parameter(float(masses.sum())), "inertia": _plain(inertia)}
        if self.chance(0.7):
            body["center_of_mass"] = self.vector(0.3)
        return body

    def joint(self, name: str, parent: str, child: str, kind: str) -> Data:
        joint: Data = {"type": kind, "parent": parent, "child": child}
        if self.chance(0.8):
            joint["position"] = self.vector(0.8)
        if self.chance(0.4):
            joint["rotation"] = self.turn()
        if kind not in ("fixed", "spherical", "free"):
            joint["axis"] = self.axis()
        if kind == "universal":
            across = np.cross(joint["axis"], self.rng.normal(size=3))
            if self.chance(0.6):
                flat = np.abs(joint["axis"])
                across = np.eye(3)[int(np.argmin(flat))]
                across = across - np.array(joint["axis"]) * (across @ joint["axis"]) / np.dot(
                    joint["axis"], joint["axis"]
                )
            joint["second_axis"] = [float(x) for x in across]
        if kind == "planar" and self.chance(0.5):
            joint["x_axis"] = [float(x) for x in np.cross(joint["axis"], self.rng.normal(size=3))]
        if kind == "helical":
            joint["pitch"] = self.parameter(self.number(-0.3, 0.3) or 0.1)
        count = COORDINATES.get(kind, 0)
        if count:
            self._joint_forces(joint, kind, count)
        return joint

    def _listed(self, low: float, high: float, count: int) -> Any:
        values = [self.number(low, high) for _ in range(count)]
        return values[0] if count == 1 else values

    def _joint_forces(self, joint: Data, kind: str, count: int) -> None:
        if self.chance(0.3):
            joint["stiffness"], joint["rest"] = self._listed(0, 30, count), self._listed(-0.5, 0.5, count)
        if self.chance(0.4):
            joint["damping"] = self._listed(0, 2, count)
        if self.kind != "absolute" and self.chance(0.2):
            joint["rotor_inertia"] = self._listed(0, 0.3, count)
        if self.chance(0.2):
            joint["friction"] = {"coulomb": self._listed(0, 3, count), "velocity": self._listed(0.05, 1, count)}
            if self.chance(0.5):
                friction = joint["friction"]
                extra = self._listed(0, 1, count)
                coulomb = friction["coulomb"]
                friction["static"] = (
                    coulomb + extra if count == 1 else [a + b for a, b in zip(coulomb, extra, strict=True)]
                )
                friction["stribeck"] = self._listed(1.1, 2, count)
        if self.chance(0.2):
            joint["limits"] = {
                "lower": self._listed(-0.8, -0.1, count),
                "upper": self._listed(0.1, 0.8, count),
                "stiffness": self._listed(10, 500, count),
                "damping": self._listed(0, 5, count),
            }
            if self.chance(0.5):
                joint["limits"]["onset"] = self._listed(0.01, 0.5, count)

    def tree(self) -> None:
        count = int(self.rng.integers(1, 7))
        names = [f"b{k}" for k in range(count)]
        kinds = [str(self.pick(JOINT_TYPES)) for _ in names]
        for k, name in enumerate(names):
            parent = "base" if k == 0 or self.chance(0.2) else self.pick(names[max(0, k - 3) : k])
            chain = (kinds[k], kinds[k + 1]) if k + 1 < count else ()
            massless = self.kind != "absolute" and chain == ("prismatic", "spherical") and self.chance(0.5)
            self.data["bodies"][name] = self.body(massless)
            if massless:  # carries the next body, so that its joint moves mass
                parent_of_next = name
            elif k and "mass" in self.data["bodies"][names[k - 1]] and self.data["bodies"][names[k - 1]]["mass"] == 0:
                parent = parent_of_next
            self.data["joints"][f"j{k}"] = self.joint(f"j{k}", parent, name, kinds[k])
        self._mimics()

    def _mimics(self) -> None:
        single = [n for n, j in self.data["joints"].items() if COORDINATES.get(j["type"]) == 1]
        if len(single) >= 2 and self.chance(0.25):
            leader, follower = single[0], single[-1]
            joint = self.data["joints"][follower]
            joint["mimic"] = {"joint": leader, "multiplier": self.number(-2, 2), "offset": self.number(-0.5, 0.5)}

    # -- forces -------------------------------------------------------------------------------------------------

    def places(self) -> None:
        points = self.data.setdefault("points", {})
        for k, name in enumerate([*self.data["bodies"], "base", "world"]):
            points[f"at{k}"] = {"body": name, "position": self.vector(0.9)}

    def formula(self, *, here: bool = False, time_only: bool = False) -> str:
        """Return a smooth formula of moderate size."""
        rng = self.rng
        atoms = ["t", f"{rng.uniform(-2, 2):.3f}", "sin(3 * t)"]
        if "inputs" in self.data:
            atoms += list(self.data["inputs"])
        if not time_only:
            for name, joint in self.data["joints"].items():
                count = COORDINATES.get(joint["type"], 0)
                atoms += [f"{kind}.{name}" for kind in "qv"] if count == 1 else []
                if count > 1:
                    atoms += [f"{kind}.{name}[{rng.integers(count)}]" for kind in "qv"]
            moving = self._moving()  # other points rest to rounding, which comparisons and waves would decide by
            for name in [name for name, point in self.data["points"].items() if point["body"] in moving][:4]:
                atoms += [f"position.{name}[{rng.integers(3)}]", f"velocity.{name}[{rng.integers(3)}]"]
            atoms += list(self.data.get("states", {}))
        if here:
            atoms += [
                f"{kind}.here[{rng.integers(3)}]" for kind in ("position", "velocity", "angular_velocity", "rotation")
            ]
        a, b, c = (str(self.pick(atoms)) for _ in range(3))
        number = f"{rng.uniform(0.2, 3):.4f}"
        curves = list(self.data.get("curves", {}))
        forms = [
            f"{number} * {a} - {b}",
            f"{a} * sin({b}) + {c}",
            f"{number} * tanh({a} + {b})",
            f"({a} + {b}) / (1 + ({c})**2)",
            f"max({a}, {b}, -{number})",
            f"({a} if {b} > {c} else {number})",
            f"exp(-({a})**2) * ({b})",
            f"atan2({a}, 1 + ({b})**2) * {number}",
            f"sqrt(1 + ({a})**2) - abs({b})",
            f"({a} < {b}) * {number} + ({a} >= {c}) - (not {b} > 0.3)",
            f"-({a})**3 + cosh(tanh({b}))",
        ]
        if curves:
            curve = self.pick(curves)
            forms += [f"{curve}(2 * sin({a}) + 0.0371) + {b}"] * 3 + [
                f"derivative.{curve}(2 * sin({a}) + 0.0371) - {b}"
            ]
        return str(self.pick(forms))

    def curves(self) -> None:
        curves = {}
        for k in range(self.rng.integers(0, 3)):
            x = np.cumsum(self.rng.uniform(0.3, 1.2, 9))
            x = (x - x[0]) / (x[-1] - x[0]) * 5.0 - 2.5
            points = [[float(a), float(b)] for a, b in zip(x, self.rng.uniform(-2, 2, 9), strict=True)]
            options: list[Data] = [
                {"points": points},
                {"points": points, "outside": "hold"},
                {"points": points, "interpolation": "linear"},
                {"wave": {"shape": "triangle", "period": 1.7, "low": -0.5, "high": 1.5, "duty": 0.3, "start": 0.2}},
                {"wave": {"shape": "sawtooth", "period": 0.9, "high": 0.7}},
                {"wave": {"shape": "square", "period": 1.3, "low": -1, "high": 2, "duty": 0.4}},
            ]
            curves[f"curve{k}"] = self.pick(options)
        if curves:
            self.data["curves"] = curves

    def elements(self) -> None:
        data, bodies, points = self.data, list(self.data["bodies"]), list(self.data["points"])
        if self.chance(0.5):
            data["inputs"] = {"motor": {"formula": "1.3 * sin(2 * t) + t"}, "push": {"formula": "exp(-t)"}}
        if self.chance(0.4):
            data["states"] = {"z0": {"rate": 0.0, "initial": 0.3}, "z1": {"rate": 0.0, "initial": -0.4}}
            data["states"] = {name: {**entry, "rate": self.formula()} for name, entry in data["states"].items()}
        moving = self._moving()
        if self.chance(0.5):
            first, second = self._two_points(points, moving)
            data["springs"] = {"spring": {
                "first": first, "second": second, "stiffness": self.parameter(self.number(0, 50)),
                "damping": self.number(0, 3), "length": self.number(0, 1),
            }}  # fmt: skip  # an entry
            if self.chance(0.4):
                data["springs"]["spring"]["force"] = self.formula()
        if moving and self.chance(0.6):
            data["forces"] = {"force": {
                "body": self.pick(moving), "point": self.vector(0.5), "axes": self.pick(["world", "body"]),
                "force": [self.formula(here=True), self.number(-2, 2), 0], "torque": [0, self.formula(here=True), 0.3],
            }}  # fmt: skip  # an entry
        if moving and self.chance(0.4):
            entry = {
                "first": self._frame(self.pick(["base", *bodies])), "second": self._frame(self.pick(moving)),
                "stiffness": [self.number(0, 90) for _ in "xyz"], "damping": [self.number(0, 3) for _ in "xyz"],
                "rotational_stiffness": [self.number(0, 9) for _ in "xyz"], "rest": self.vector(0.3),
                "rotational_damping": [self.number(0, 1) for _ in "xyz"], "rest_rotation": self.turn(),
                "preload": self.vector(2), "rotational_preload": self.vector(0.5),
            }  # fmt: skip  # an entry
            groups = self._rigid_groups()
            if groups[entry["first"]["body"]] != groups[entry["second"]["body"]]:
                data["bushings"] = {"mount": entry}
        if moving and self.chance(0.4):
            name = next(p for p in points if data["points"][p]["body"] == self.pick(moving[:1]))
            road = self.pick(["0.3 * t", f"0.2 * sin(position.{name}[0]) + 0.1 * position.{name}[1]", "-0.4"])
            data["tyres"] = {
                "tyre": {
                    "center": name,
                    "radius": self.number(0.3, 2),
                    "stiffness": 300.0,
                    "damping": self.number(0, 9),
                    "onset": self.number(0.01, 0.4),
                    "road": road,
                }
            }
        self._coordinate_forces()

    def _two_points(self, points: list[str], moving: list[str]) -> tuple[str, str]:
        carried = [p for p in points if self.data["points"][p]["body"] in moving]
        second = self.pick(carried) if carried else points[0]
        others = [p for p in points if self.data["points"][p]["body"] != self.data["points"][second]["body"]]
        return self.pick(others), second

    def _moving(self) -> list[str]:
        """Return the bodies that some joint moves against the base."""
        return [name for name, host in self._rigid_groups().items() if host != "base"]

    def _coordinate_forces(self) -> None:
        joints = self.data["joints"]
        angled = [n for n, j in joints.items() if ANGLES.get(j["type"])]
        if angled and self.chance(0.4):
            entry = {"first": angled[0], "stiffness": self.number(0, 9), "damping": self.number(0, 1), "rest": 0.2}
            if len(angled) > 1:
                entry["second"] = angled[-1]
            self.data["torsion_springs"] = {"belt": entry}
        driven = [n for n, j in joints.items() if SIZES[j["type"]][1]]
        if self.kind == "absolute":
            driven = [n for n in driven if joints[n]["type"] in COORDINATES]
        if driven and self.chance(0.5):
            name = self.pick(driven)
            index = int(self.rng.integers(SIZES[joints[name]["type"]][1]))
            self.data["efforts"] = {"effort": {"joint": name, "effort": self.formula(), "index": index}}

    def _frame(self, body: str) -> Data:
        frame: Data = {"body": body, "position": self.vector(0.6)}
        if self.chance(0.5):
            z = self.axis()
            frame["axis"], frame["x_axis"] = z, [float(x) for x in np.cross(z, self.rng.normal(size=3))]
        elif self.chance(0.5):
            frame["rotation"] = self.turn()
        return frame

    def base(self) -> None:
        if self.chance(0.4):
            base: Data = {}
            if self.chance(0.8):
                base["position"] = [self.pick([0, "0.2 * sin(2 * t)", "0.3 * t**2", "exp(-t)"]) for _ in "xyz"]
            if self.chance(0.7):
                angles = ["0.4 * t", "0.3 * sin(3 * t)", "0.2 + 0.1 * t**2", 0.5]
                count = self.rng.integers(1, 3)
                base["rotation"] = [{"axis": self.axis(), "angle": self.pick(angles)} for _ in range(count)]
            if base:
                self.data["base"] = base

    def outputs(self) -> None:
        outputs: Data = {}
        for name in list(self.data["points"])[:3]:
            outputs[f"{name}_acceleration"] = {"acceleration": name}
            outputs[f"{name}_velocity"] = {"velocity": name}
        outputs["formula"] = {"formula": [self.formula() for _ in range(3)]}
        if "springs" in self.data:
            outputs["spring"] = {"formula": ["tension.spring", "length.spring", "rate.spring"]}
        if "tyres" in self.data:
            outputs["tyre"] = {"formula": ["load.tyre", "deflection.tyre"]}
        self.data["outputs"] = outputs

    def _rigid_groups(self) -> dict[str, str]:
        """Return for each body the one that carries it through fixed joints."""
        host = {"base": "base"}
        for joint in self.data["joints"].values():
            host[joint["child"]] = host[joint["parent"]] if joint["type"] == "fixed" else joint["child"]
        return host

    # -- loops -----------------------------------------------------------------------------------------------------

    def start(self) -> Array:
        """Write a random initial state into the joints and return it."""
        machine = Machine(self.data)
        q = np.zeros(machine.nq)
        for name, joint in self.data["joints"].items():
            if "mimic" in joint or joint["type"] == "fixed":
                continue
            i, kind = machine.q_start[name], joint["type"]
            if kind in COORDINATES:
                values = self.rng.uniform(-0.8, 0.8, COORDINATES[kind])
                q[i : i + len(values)] = values
                joint["initial"] = {"position": _plain(values if len(values) > 1 else values[0])}
                continue
            quaternion = self.rng.normal(size=4)
            quaternion /= np.linalg.norm(quaternion)
            q[i : i + 4] = quaternion
            if kind == "spherical":
                joint["initial"] = {"position": _plain(quaternion)}
            else:
                q[i + 4 : i + 7] = self.rng.uniform(-0.8, 0.8, 3)
                joint["initial"] = {"orientation": _plain(quaternion), "position": _plain(q[i + 4 : i + 7])}
        return q

    def loop(self, q: Array) -> None:
        """Close one or two loops whose frames meet at the initial configuration."""
        machine = Machine(self.data)
        groups = self._rigid_groups()
        moving = [name for name in self._moving() if groups[name] != "base"]
        left = machine.nv - 1
        constraints: Data = {}
        for k in range(self.rng.integers(1, 3)):
            kinds = [kind for kind, rows in FREEDOMS.items() if rows <= left]
            bodies = ["base", *moving]
            if not kinds or len(bodies) < 2:
                break
            kind = str(self.pick(kinds))
            first, second = (str(x) for x in self.rng.choice(bodies, 2, replace=False))
            if groups[first] == groups[second]:
                continue
            if second == "base":
                first, second = second, first
            constraints[f"loop{k}"] = self._closed(kind, first, second, machine, q)
            left -= FREEDOMS[kind]
        if constraints:
            self.data["constraints"] = constraints

    def _closed(self, kind: str, first: str, second: str, machine: Machine, q: Array) -> Data:
        state = State(machine, q, np.zeros(machine.nv), 0.0)
        one = {"body": first, "position": self.vector(0.6), "rotation": self.turn()}
        pose = state.frame(one, state.motion)
        R1, x1 = pose.R.value, pose.x.value
        rng, entry = self.rng, {"type": kind}
        angle, travel = self.number(-2, 2), self.number(-0.8, 0.8)
        about_z = Rotation.from_rotvec([0, 0, angle]).as_matrix()
        anyhow = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
        R, x = np.eye(3), np.zeros(3)
        match kind:
            case "spherical":
                R = anyhow
            case "revolute":
                R = about_z
                if self.chance(0.3):
                    entry["drive"] = f"{angle!r} + 0.3 * sin(t)"
            case "universal":
                R = Rotation.from_euler("XY", rng.uniform(-1, 1, 2)).as_matrix()
            case "cylindrical":
                R, x = about_z, np.array([0, 0, travel])
            case "helical":
                entry["pitch"] = 0.21
                R, x = about_z, np.array([0, 0, 0.21 * angle])
            case "prismatic":
                x = np.array([0, 0, travel])
                if self.chance(0.3):
                    entry["drive"] = f"{travel!r} + 0.3 * t"
            case "planar":
                R, x = about_z, np.array([travel, self.number(-0.5, 0.5), 0])
            case "distance":
                R, x = anyhow, rng.normal(size=3)
                entry["length"] = (
                    float(np.linalg.norm(x)) if self.chance(0.6) else f"{float(np.linalg.norm(x))!r} + 0.1 * sin(2 * t)"
                )
            case "point_on_line":
                R, x = anyhow, np.array([0, 0, travel])
            case "rolling":
                entry["radius"], entry["shape"] = 0.4, str(self.pick(["disc", "sphere"]))
                R = anyhow
                height = 0.4 if entry["shape"] == "sphere" else 0.4 * math.sqrt(1 - R[2, 2] ** 2)
                x = np.array([travel, self.number(-0.5, 0.5), height])
        body = state.motion.poses[second]
        axes = body.R.value.T @ R1 @ R
        vector = Rotation.from_matrix(axes).as_rotvec()
        place = body.R.value.T @ (x1 + R1 @ x - body.x.value)
        size = float(np.linalg.norm(vector))
        turn = [{"axis": _plain(vector / size), "angle": size}] if size > 1e-12 else []
        entry.update(
            first=one, second={"body": second, "position": _plain(place), **({"rotation": turn} if turn else {})}
        )
        if not turn:
            entry["second"]["rotation"] = [{"axis": [1, 0, 0], "angle": 0}]
        return entry

    # -- beams and hulls -------------------------------------------------------------------------------------------

    def shaped_beam(self) -> None:
        """Hang a beam of shape functions on the last body, and a spring on its axis."""
        bodies = list(self.data["bodies"])
        shapes, joint = [("clamped_free", "revolute"), ("clamped_free", "universal"), ("clamped_free", "fixed"),
                         ("pinned_pinned", "revolute"), ("free_free", "free")][self.rng.integers(5)]  # fmt: skip
        length = self.number(0.5, 3)
        beam: Data = {"length": length, "mass_per_length": self.number(0.5, 2), "order": int(self.rng.integers(1, 3))}
        beam["stiffening"] = self.chance(0.8)
        if shapes == "free_free" or joint == "universal":
            beam["polar_inertia"] = self.number(0.01, 0.05)
        if shapes == "free_free":
            beam["start"] = -0.5 * length
        if self.chance(0.5):
            beam["mass_profile"] = [1, self.number(-0.7, 0.3)]
        ways = ["bending_y"] if shapes == "pinned_pinned" else ["bending_y", "bending_z", "stretch"]
        ways = [way for way in ways if self.chance(0.7)] or ["bending_y"]
        for way in ways:
            beam[way] = {"shapes": shapes, "modes": int(self.rng.integers(1, 3)), "stiffness": self.number(5, 90)}
            if self.chance(0.5):
                beam[way]["stiffness_damping"] = self.number(0, 0.02)
            if self.chance(0.5):
                beam[way]["profile"] = [1, self.number(-0.6, 0.4)]
        hung = self.joint("blade_joint", self.pick(["base", *bodies]), "blade", joint)
        for key in ("friction", "limits", "rotor_inertia"):
            hung.pop(key, None)
        if joint == "revolute":
            hung["axis"] = [0, 0, 1]
        if joint == "universal":
            hung["axis"], hung["second_axis"] = [0, 1, 0], [0, 0, 1]
        self.data["beams"], self.data["joints"]["blade_joint"] = {"blade": beam}, hung
        start = beam.get("start", 0.0)
        self.data["points"] = {
            "on_blade": {"body": "blade", "position": [start + length * self.number(0.2, 1), 0, 0]},
            "at_rest": {"body": "world", "position": self.vector(2)},
        }
        self.data["springs"] = {"line": {"first": "at_rest", "second": "on_blade", "stiffness": 30.0, "damping": 1.0}}
        self.data["outputs"] = {"place": {"acceleration": "on_blade"}, "speed": {"velocity": "on_blade"}}

    def hulls(self) -> None:
        """Put hulls deep under water on moving bodies, in still water or regular waves."""
        moving = self._moving()
        self.data["gravity"] = [0, 0, -9.81]
        hulls: Data = {}
        for k in range(self.rng.integers(1, 3)):
            start = np.array(self.vector(0.8))
            end = start + np.array(self.axis()) * self.number(0.3, 1.5)
            hulls[f"hull{k}"] = {
                "body": self.pick(moving), "start": _plain(start), "end": _plain(end),
                "diameter": self.number(0.1, 0.6),
                "stations": int(self.rng.integers(1, 12)),
                "added_mass": self.number(0, 1.5), "drag": self.number(0, 1.5),
                "axial_added_mass": self.number(0, 20), "axial_drag": self.number(0, 20), "level": 40.0,
            }  # fmt: skip  # an entry
        if self.chance(0.6):
            self.data["waves"] = {"sea": {"level": 40.0, "stretching": self.pick(["wheeler", "none"]), "regular": [
                {"amplitude": self.number(0.2, 2), "period": self.number(8, 14), "heading": self.number(-3, 3),
                 "phase": self.number(-3, 3)} for _ in range(self.rng.integers(1, 4))]}}  # fmt: skip  # an entry
            for hull in hulls.values():
                hull["waves"] = "sea"
                del hull["level"]
        self.data["hulls"] = hulls


def exact_beam(seed: int) -> Data:
    """Return a random straight beam of the model cosserat on a free joint, in absolute coordinates."""
    rng = np.random.default_rng([seed, 5])

    def between(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(low, high))

    keys = ("stretch", "shear_y", "shear_z", "torsion", "bending_y", "bending_z")
    beam: Data = {
        "model": "cosserat", "length": between(-0.5, 0.7), "elements": int(rng.integers(1, 9)),
        "mass_per_length": between(-1, 1), "rotary_inertia": [between(-2, -1) for _ in range(3)],
        "stiffness": {key: between(0, 3) for key in keys}, "stiffness_damping": between(-3, -1),
        "group": str(rng.choice(["SE3", "R3xSO3"])),
    }  # fmt: skip  # an entry
    beam["rotary_inertia"][0] = beam["rotary_inertia"][1] + beam["rotary_inertia"][2]
    joint = {"type": "free", "parent": "base", "child": "rope"}
    gravity = [float(x) for x in rng.normal(size=3) * 9]
    data = {"format": 1, "name": "generated", "coordinates": "absolute", "gravity": gravity}
    return {**data, "beams": {"rope": beam}, "joints": {"hold": joint}}


def _plain(values: Any) -> Any:
    if isinstance(values, np.ndarray):
        return values.tolist()
    if isinstance(values, dict):
        return {key: _plain(value) for key, value in values.items()}
    if isinstance(values, list):
        return [_plain(value) for value in values]
    return float(values)


def scene(seed: int, kind: str) -> Data:
    """Return a random scene file: ``tree``, ``loop``, ``absolute``, ``beam``, ``hull`` or ``exact_beam``."""
    if kind == "exact_beam":
        return exact_beam(seed)
    writer = Writer(seed, kind)
    if writer.chance(0.4):
        writer.data["gravity"] = writer.vector(10)
    writer.tree()
    if all(joint["type"] == "fixed" for joint in writer.data["joints"].values()):
        writer.data["joints"]["j0"].update(type="revolute", axis=[0, 1, 0])
    if kind == "beam":
        writer.base()
        writer.shaped_beam()
        writer.start()
        return copy.deepcopy(writer.data)
    writer.places()
    writer.curves()
    writer.base()
    q = writer.start()
    if kind == "loop" or (kind == "absolute" and writer.chance(0.5)):
        writer.loop(q)
    if kind == "hull":
        writer.hulls()
    writer.elements()
    writer.outputs()
    if kind == "absolute":
        writer.data["coordinates"] = "absolute"
        fixed = {j["child"] for j in writer.data["joints"].values() if j["type"] == "fixed"}
        for name, body in writer.data["bodies"].items():
            if name not in fixed and writer.chance(0.5):
                body["group"] = "R3xSO3"
    return copy.deepcopy(writer.data)
