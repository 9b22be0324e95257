"""Equations of motion of a scene file by Jacobian projection, written from docs/scene.md.

Every body moves by Taylor series in time; M, inverse dynamics, constraint rows and accelerations follow from virtual
work in the world's axes. Slow, dense and without any of the package's algorithms: an oracle for generated scenes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from tests.oracles.interpreter.beams import ShapedBeam
from tests.oracles.interpreter.formulas import Names, evaluated
from tests.oracles.interpreter.jets import Jet, cos, jet, rotated, sin, stack

Array = NDArray[Any]
Data = Mapping[str, Any]

COORDINATES = {"fixed": 0, "revolute": 1, "prismatic": 1, "helical": 1, "cylindrical": 2, "universal": 2, "planar": 3}
ANGLES = {"revolute": 1, "helical": 1, "cylindrical": 1, "universal": 2, "planar": 1}
SIZES = {**{kind: (n, n) for kind, n in COORDINATES.items()}, "spherical": (4, 3), "free": (7, 6)}


def rotation_matrix(axis: Any, angle: Any) -> Jet:
    """Rodrigues' formula about an axis of any length; angle (...)."""
    n = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    angle = jet(angle)
    s, c = sin(angle)[..., None, None], cos(angle)[..., None, None]
    return np.eye(3) + s * K + (1.0 - c) * (K @ K)


def unit(vector: Any) -> Array:
    vector = np.asarray(vector, float)
    return vector / np.linalg.norm(vector)


def perpendicular_axes(z: Any, x: Any) -> Array:
    """Columns x, y, z: x is the part of the given direction across z."""
    z = unit(z)
    x = np.asarray(x, float)
    x = unit(x - z * (x @ z))
    return np.stack([x, np.cross(z, x), z], axis=1)


def farthest_axis(axis: Any) -> Array:
    """Return the coordinate axis farthest from a direction, the first of equals."""
    share = np.abs(unit(axis))
    return np.eye(3)[next(k for k in range(3) if share[k] <= share.min() + 1e-6)]


@dataclass
class Pose:
    """Orientation (..., 3, 3) and position (..., 3) in the world, as series in time."""

    R: Jet
    x: Jet

    def at(self, r: Any) -> Jet:
        return self.x + rotated(self.R, r)

    @property
    def omega(self) -> Jet:
        """Angular velocity in world axes, a series of first order."""
        R, R1, R2 = self.R.value, self.R.rate, self.R.second
        T = np.swapaxes(R, -1, -2)
        spin = R1 @ T
        rate = R2 @ T + R1 @ np.swapaxes(R1, -1, -2)
        return Jet(axial(spin), axial(rate), np.nan)


def axial(W: Array) -> Array:
    """Vector of the skew part of W."""
    return 0.5 * np.stack([W[..., 2, 1] - W[..., 1, 2], W[..., 0, 2] - W[..., 2, 0], W[..., 1, 0] - W[..., 0, 1]], -1)


@dataclass
class Motion:
    """Everything that formulas may ask for, along one series in time (or one for each unit velocity)."""

    t: Jet
    base: Pose
    poses: dict[str, Pose]
    coordinates: dict[str, list[Jet]]
    velocities: dict[str, list[Jet]] = field(default_factory=dict)
    elastic: dict[str, list[Jet]] = field(default_factory=dict)


class Machine:
    """A scene file's data with its parameters; sizes, kinematics and equations."""

    def __init__(self, data: Data, parameters: Mapping[str, float] | None = None) -> None:
        self.data = data
        given = {
            name: entry["value"] if isinstance(entry, Mapping) else entry
            for name, entry in data.get("parameters", {}).items()
        }
        self.parameters = {**given, **(parameters or {})}
        self.constants = Names(self.parameters, _no_quantity)
        self.gravity = self.values(data.get("gravity", [0, 0, -9.81]))
        self.joints = self._sorted_joints()
        self.beams: dict[str, tuple[ShapedBeam, int, int]] = {}
        self.q_start, self.v_start, self.nq, self.nv = {}, {}, 0, 0
        for name, joint in self.joints.items():
            self.q_start[name], self.v_start[name] = self.nq, self.nv
            if "mimic" not in joint:
                q_size, v_size = SIZES[joint["type"]]
                self.nq, self.nv = self.nq + q_size, self.nv + v_size
            if joint["child"] in data.get("beams", {}):
                beam = ShapedBeam(data["beams"][joint["child"]], self.value)
                self.beams[joint["child"]] = (beam, self.nq, self.nv)
                self.nq, self.nv = self.nq + beam.count, self.nv + beam.count
        self.curves = {name: self._curve(entry) for name, entry in data.get("curves", {}).items()}

    # -- values ----------------------------------------------------------------------------------------------------

    def value(self, text: Any) -> float:
        result = evaluated(text, self.constants)
        return float(result.value) if isinstance(result, Jet) else float(result)

    def values(self, texts: Any) -> Array:
        return np.array([self.value(text) for text in texts])

    def listed(self, joint: Data, key: str, index: int, default: float = 0.0, table: Data | None = None) -> float:
        entry = (joint if table is None else table).get(key)
        if entry is None:
            return default
        return self.value(entry[index] if isinstance(entry, list) else entry)

    def rotation(self, entries: Any) -> Array:
        R = np.eye(3)
        for entry in entries or []:
            R = R @ rotation_matrix(self.values(entry["axis"]), self.value(entry["angle"])).value
        return R

    def _curve(self, entry: Data) -> Callable[[Any], Jet]:
        if "points" in entry:
            points = np.array(entry["points"], float)
            x, y = points[:, 0], points[:, 1]
            kind = entry.get("interpolation", "quintic")
            outside = entry.get("outside", "error" if kind == "quintic" else "hold")
            if kind == "quintic":
                at_rest = outside == "hold"
                orders = (1, 2) if at_rest else (3, 4)
                spline = make_interp_spline(x, y, 5, bc_type=([(k, 0.0) for k in orders],) * 2)

                def quintic(argument: Any) -> Jet:
                    def derivatives(a: Array) -> tuple[Any, Any, Any]:
                        inside = (x[0] <= a) & (a <= x[-1])
                        b = np.clip(a, x[0], x[-1])
                        return spline(b), inside * spline(b, 1), inside * spline(b, 2)

                    return jet(argument).mapped(derivatives)

                return quintic

            def linear(argument: Any) -> Jet:
                def derivatives(a: Array) -> tuple[Any, Any, Any]:
                    k = np.clip(np.searchsorted(x, a, side="right") - 1, 0, len(x) - 2)
                    slope = (y[k + 1] - y[k]) / (x[k + 1] - x[k])
                    inside = (x[0] <= a) & (a < x[-1])
                    return np.interp(a, x, y), slope * inside, 0.0 * slope

                return jet(argument).mapped(derivatives)

            return linear
        wave = entry["wave"]
        period, low, high = self.value(wave["period"]), self.value(wave.get("low", 0)), self.value(wave.get("high", 1))
        start, duty, shape = self.value(wave.get("start", 0)), self.value(wave.get("duty", 0.5)), wave["shape"]

        def periodic(argument: Any) -> Jet:
            def derivatives(a: Array) -> tuple[Any, Any, Any]:
                s = np.mod((a - start) / period, 1.0)
                if shape == "square":
                    return np.where(s < duty, high, low), 0 * s, 0 * s
                if shape == "sawtooth":
                    return low + (high - low) * s, 0 * s + (high - low) / period, 0 * s
                up = s < duty
                y = np.where(up, s / duty, (1 - s) / (1 - duty))
                slope = np.where(up, 1 / duty, -1 / (1 - duty)) / period
                return low + (high - low) * y, (high - low) * slope, 0 * s

            return jet(argument).mapped(derivatives)

        return periodic

    # -- kinematics ------------------------------------------------------------------------------------------------

    def _sorted_joints(self) -> dict[str, Data]:
        """Return the joints with parents first, otherwise in the order of the file."""
        left, known, found = dict(self.data.get("joints", {})), {"base"}, {}
        while left:
            name = next(name for name, joint in left.items() if joint["parent"] in known)
            found[name] = left.pop(name)
            known.add(found[name]["child"])
        return found

    @property
    def held_on_base(self) -> set[str]:
        """Bodies that fixed joints hold on the base."""
        held = {"base"}
        for joint in self.joints.values():
            if joint["type"] == "fixed" and joint["parent"] in held:
                held.add(joint["child"])
        return held

    def _inputs(self) -> Data:
        return self.data.get("inputs", {})

    def _time(self, t: Jet, more: Mapping[str, Any] | None = None) -> Names:
        return Names({"t": t, **self.parameters, **self.curves, **(more or {})}, self._curve_derivative)

    def _curve_derivative(self, kind: str, name: str) -> Any:
        def derivative(argument: Any) -> Jet:
            a = jet(argument)
            found = self.curves[name](Jet(a.value, 1.0, 0.0))
            return Jet(found.rate) if kind == "derivative" else Jet(found.second)

        return derivative

    def motion(self, q: Array, v: Array, a: Array, t: float, *, still: bool = False) -> Motion:
        """Return the motion from q with velocities (..., nv) and accelerations; ``still``: time stands."""
        v, a = np.asarray(v, float), np.asarray(a, float)
        time = Jet(np.zeros(v.shape[:-1]) + t, 0.0 if still else 1.0, 0.0)
        base = self._base(time)
        shape = v.shape[:-1]
        poses = {
            "base": base,
            "world": Pose(jet(np.broadcast_to(np.eye(3), (*shape, 3, 3))), jet(np.zeros((*shape, 3)))),
        }
        motion = Motion(time, base, poses, {})
        for name, joint in self.joints.items():
            numbers, twist = self._joint_state(name, joint, q, v, a, motion)
            motion.coordinates[name] = numbers
            motion.poses[joint["child"]] = self._child(name, joint, motion.poses[joint["parent"]], numbers, twist, q)
        for name, (beam, i, j) in self.beams.items():
            motion.elastic[name] = [Jet(q[i + k], v[..., j + k], 0.5 * a[..., j + k]) for k in range(beam.count)]
        return motion

    def _base(self, t: Jet) -> Pose:
        shape = t.value.shape
        R, x = jet(np.broadcast_to(np.eye(3), (*shape, 3, 3))), jet(np.zeros((*shape, 3)))
        if "base" in self.data:
            names = self._time(t)
            base = self.data["base"]
            for entry in base.get("rotation", []):
                R = R @ rotation_matrix(self.values(entry["axis"]), evaluated(entry["angle"], names) + 0.0 * t)
            x = stack([evaluated(part, names) + 0.0 * t for part in base.get("position", [0, 0, 0])])
        return Pose(R, x)

    def _joint_state(
        self, name: str, joint: Data, q: Array, v: Array, a: Array, motion: Motion
    ) -> tuple[list[Jet], tuple[Array, Array] | None]:
        if "mimic" in joint:
            follow = joint["mimic"]
            lead = motion.coordinates[follow["joint"]][0]
            return [lead * self.value(follow.get("multiplier", 1.0)) + self.value(follow.get("offset", 0.0))], None
        q0, v0 = self.q_start[name], self.v_start[name]
        if joint["type"] in COORDINATES:
            count = COORDINATES[joint["type"]]
            return [Jet(q[q0 + k], v[..., v0 + k], 0.5 * a[..., v0 + k]) for k in range(count)], None
        size = SIZES[joint["type"]][1]
        return [], (v[..., v0 : v0 + size], a[..., v0 : v0 + size])

    def _child(self, name: str, joint: Data, parent: Pose, numbers: list[Jet], twist: Any, q: Array) -> Pose:
        fixed = (
            np.array(joint["orientation"], float) if "orientation" in joint else self.rotation(joint.get("rotation"))
        )
        place, kind = self.values(joint.get("position", [0, 0, 0])), joint["type"]
        axis = unit(self.values(joint["axis"])) if "axis" in joint else np.zeros(3)
        turn, travel = jet(np.eye(3)), jet(np.zeros(3))
        match kind:
            case "revolute":
                turn = rotation_matrix(axis, numbers[0])
            case "prismatic":
                travel = numbers[0][..., None] * axis
            case "helical":
                turn = rotation_matrix(axis, numbers[0])
                travel = numbers[0][..., None] * (self.value(joint["pitch"]) * axis)
            case "cylindrical":
                turn, travel = rotation_matrix(axis, numbers[0]), numbers[1][..., None] * axis
            case "universal":
                second = self.values(joint["second_axis"])
                turn = rotation_matrix(axis, numbers[0]) @ rotation_matrix(second, numbers[1])
            case "planar":
                x_axis = self.values(joint["x_axis"]) if "x_axis" in joint else farthest_axis(axis)
                frame = perpendicular_axes(axis, x_axis)
                turn = rotation_matrix(axis, numbers[0])
                travel = numbers[1][..., None] * frame[:, 0] + numbers[2][..., None] * frame[:, 1]
            case "spherical" | "free":
                start = self.q_start[name]
                w, x, y, z = q[start : start + 4]
                R0 = Rotation.from_quat([x, y, z, w]).as_matrix()
                omega, alpha = twist[0][..., :3], twist[1][..., :3]
                W, A = skew(omega), skew(alpha)
                turn = Jet(R0, R0 @ W, 0.5 * R0 @ (W @ W + A))
                if kind == "free":
                    u, du = twist[0][..., 3:], twist[1][..., 3:]
                    travel = Jet(q[start + 4 : start + 7], u @ R0.T, 0.5 * (np.cross(omega, u) + du) @ R0.T)
        middle = parent.R @ fixed
        return Pose(middle @ turn, parent.x + rotated(parent.R, place) + rotated(middle, travel))


def skew(w: Array) -> Array:
    zero = np.zeros_like(w[..., 0])
    rows = [zero, -w[..., 2], w[..., 1], w[..., 2], zero, -w[..., 0], -w[..., 1], w[..., 0], zero]
    return np.stack(rows, axis=-1).reshape(*w.shape[:-1], 3, 3)


def _no_quantity(kind: str, name: str) -> Any:
    raise KeyError(f"{kind}.{name}")
