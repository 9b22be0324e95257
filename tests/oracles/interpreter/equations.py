"""Equations of motion of a ``Machine`` at a state: M, inverse dynamics, accelerations, energies, outputs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.oracles.interpreter import jets
from tests.oracles.interpreter.beam_inertia import beam_inertia, kinetic_energy, truncated
from tests.oracles.interpreter.forces import Load, loads_of, tyre
from tests.oracles.interpreter.formulas import Names, evaluated
from tests.oracles.interpreter.jets import Jet, dot, jet, stack
from tests.oracles.interpreter.machine import (
    COORDINATES,
    SIZES,
    Machine,
    Motion,
    Pose,
    perpendicular_axes,
    unit,
)
from tests.oracles.interpreter.rows import row_functions
from tests.oracles.interpreter.water import slices

Array = NDArray[Any]
Data = Mapping[str, Any]


class State:
    """A machine at q, v, t with internal states z and accelerations a (zero until they are known)."""

    def __init__(
        self,
        machine: Machine,
        q: Array,
        v: Array,
        t: float,
        z: Mapping[str, float] | None = None,
        a: Array | None = None,
    ) -> None:
        self.machine, self.data = machine, machine.data
        self.q, self.v, self.t, self.z = np.asarray(q, float), np.asarray(v, float), t, dict(z or {})
        self.a = np.zeros(machine.nv) if a is None else np.asarray(a, float)
        self.motion = machine.motion(self.q, self.v, self.a, t)
        self.units = machine.motion(self.q, np.eye(machine.nv), np.zeros((machine.nv, machine.nv)), t, still=True)
        self._tensions: dict[str, Any] = {}

    # -- names of formulas -----------------------------------------------------------------------------------------

    def names(self, here: Mapping[str, Jet] | None = None) -> Names:
        machine, t = self.machine, self.motion.t
        inputs = {
            name: evaluated(entry.get("formula", 0.0), machine._time(t)) for name, entry in machine._inputs().items()
        }
        plain = {"t": t, **machine.parameters, **machine.curves, **inputs, **self.z}

        def quantity(kind: str, name: str) -> Any:
            if name == "here" and here is not None:
                return here[kind]
            return self._quantity(kind, name)

        return Names(plain, quantity)

    def _quantity(self, kind: str, name: str) -> Any:
        motion, joints = self.motion, self.machine.joints
        match kind:
            case "derivative" | "second_derivative":
                return self.machine._curve_derivative(kind, name)
            case "q" | "v" | "a":
                if name in motion.elastic:
                    numbers = stack(motion.elastic[name])
                elif joints[name]["type"] in COORDINATES:
                    numbers = stack(motion.coordinates[name])
                    if len(motion.coordinates[name]) == 1:
                        numbers = numbers[..., 0]
                else:
                    q_size, v_size = SIZES[joints[name]["type"]]
                    i, j = self.machine.q_start[name], self.machine.v_start[name]
                    values = {"q": self.q[i : i + q_size], "v": self.v[j : j + v_size], "a": self.a[j : j + v_size]}
                    return jet(values[kind])
                return {"q": numbers, "v": numbers.derivative, "a": Jet(numbers.second)}[kind]
            case "position":
                return self.point(name)
            case "velocity":
                return self.point(name).derivative
            case "acceleration":
                return Jet(self.point(name).second)
            case "length":
                return self.spring_length(name)
            case "rate":
                return self.spring_length(name).derivative
            case "tension":
                return self.tension(name)
            case "load" | "deflection":
                deflection, force, slope = tyre(self, name)
                return deflection if kind == "deflection" else jet(force * math.sqrt(1.0 + slope @ slope))
            case "energy":
                raise KeyError("energies are compared directly")
        raise KeyError(f"{kind}.{name}")

    def _evaluate(self, text: Any, here: Mapping[str, Jet] | None = None) -> Jet:
        return jet(evaluated(text, self.names(here)))

    # -- places ----------------------------------------------------------------------------------------------------

    def place(self, name: str) -> tuple[str, Array]:
        entry = self.data.get("frames", {}).get(name) or self.data["points"][name]
        return entry["body"], self.machine.values(entry.get("position", [0, 0, 0]))

    def point(self, name: str, motion: Motion | None = None) -> Jet:
        (body, r), motion = self.place(name), motion or self.motion
        if body in self.machine.beams:  # on its axis
            beam = self.machine.beams[body][0]
            s = np.array([(r[0] - beam.start) / beam.length])
            return motion.poses[body].at(beam.positions(motion.elastic[body], s)[..., 0, :])
        return motion.poses[body].at(r)

    def frame(self, entry: Any, motion: Motion) -> Pose:
        """Pose of a frame of constraints and bushings: a point's name or a table."""
        if isinstance(entry, str):
            body, r = self.place(entry)
            axes = self._axes(self.data.get("frames", {}).get(entry, {}))
        else:
            body, r = self.place(entry["point"]) if "point" in entry else (entry["body"], np.zeros(3))
            r = r + self.machine.values(entry.get("position", [0, 0, 0]))
            axes = self._axes(entry)
        pose = motion.poses[body]
        return Pose(pose.R @ axes, pose.at(r))

    def _axes(self, entry: Data) -> Array:
        if "rotation" in entry:
            return self.machine.rotation(entry["rotation"])
        if "orientation" in entry:
            return np.array(entry["orientation"], float)
        if "axis" in entry:
            z = self.machine.values(entry["axis"])
            x = self.machine.values(entry["x_axis"]) if "x_axis" in entry else np.eye(3)[np.argmin(np.abs(unit(z)))]
            return perpendicular_axes(z, x)
        return np.eye(3)

    # -- inertia ---------------------------------------------------------------------------------------------------

    def _bodies(self) -> Iterator[tuple[str, float, Array, Array]]:
        for name, body in self.data.get("bodies", {}).items():
            center = self.machine.values(body.get("center_of_mass", [0, 0, 0]))
            yield name, self.machine.value(body["mass"]), center, self._inertia(body.get("inertia"))
        for name, (beam, _, _) in self.machine.beams.items():  # sections turn about the axis with their frame
            yield name, 0.0, np.zeros(3), np.diag([beam.polar_inertia, 0.0, 0.0])

    def _inertia(self, entry: Any) -> Array:
        if entry is None:
            return np.zeros((3, 3))
        value = self.machine.value
        if isinstance(entry, Mapping):
            xx, yy, zz, xy, xz, yz = (value(entry.get(key, 0.0)) for key in ("xx", "yy", "zz", "xy", "xz", "yz"))
        elif isinstance(entry[0], list):
            return np.array([[value(x) for x in row] for row in entry])
        else:
            xx, yy, zz, xy, xz, yz = [*(value(x) for x in entry), 0.0, 0.0, 0.0][:6]
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def rotors(self) -> Iterator[tuple[str, int, float]]:
        for name, joint in self.machine.joints.items():
            for k in range(COORDINATES.get(joint["type"], 0)):
                rotor = self.machine.listed(joint, "rotor_inertia", k)
                if rotor:
                    yield name, k, rotor

    @cached_property
    def mass(self) -> Array:
        """M, (nv, nv)."""
        M = np.zeros((self.machine.nv, self.machine.nv))
        for name, m, center, inertia in self._bodies():
            pose = self.units.poses[name]
            J, W = pose.at(center).rate, pose.omega.value
            R = self.motion.poses[name].R.value
            M += m * J @ J.T + W @ (R @ inertia @ R.T) @ W.T
        for name, k, rotor in self.rotors():
            d = self.units.coordinates[name][k].rate
            M += rotor * np.outer(d, d)
        for name in self.machine.beams:
            M += truncated(self, name, lambda scale, n=name: beam_inertia(self, n, scale)[0], mass=True)
        for slice_ in slices(self):
            for m, across in slice_.added:
                J = slice_.quantity(self.units).rate @ across
                M += m * J @ J.T
        return M

    @cached_property
    def inertial(self) -> Array:
        """M a + h + b with the state's accelerations, (nv,)."""
        total = np.zeros(self.machine.nv)
        for name, m, center, inertia in self._bodies():
            pose, unit_pose = self.motion.poses[name], self.units.poses[name]
            R, omega = pose.R.value, pose.omega
            I = R @ inertia @ R.T  # noqa: E741  the symbol of the field
            w, alpha = omega.value, omega.rate
            total += m * unit_pose.at(center).rate @ pose.at(center).second
            total += unit_pose.omega.value @ (I @ alpha + np.cross(w, I @ w))
        for name, k, rotor in self.rotors():
            total += rotor * self.units.coordinates[name][k].rate * self.motion.coordinates[name][k].second
        for name in self.machine.beams:
            total += truncated(self, name, lambda scale, n=name: beam_inertia(self, n, scale)[1])
        for slice_ in slices(self):
            for m, across in slice_.added:
                J, a = slice_.quantity(self.units).rate @ across, slice_.quantity(self.motion).second @ across
                total += m * J @ a
        return total

    # -- hulls -----------------------------------------------------------------------------------------------------

    @cached_property
    def kinetic(self) -> float:
        """Kinetic energy without bodies that fixed joints hold on the base."""
        total = 0.0
        held = self.machine.held_on_base
        for name, m, center, inertia in self._bodies():
            if name in held:
                continue
            pose = self.motion.poses[name]
            R, w, u = pose.R.value, pose.omega.value, pose.at(center).rate
            total += 0.5 * m * u @ u + 0.5 * w @ (R @ inertia @ R.T) @ w
        for name, k, rotor in self.rotors():
            total += 0.5 * rotor * self.motion.coordinates[name][k].rate ** 2
        for name in self.machine.beams:
            total += kinetic_energy(self, name)
        return float(total)

    # -- forces ----------------------------------------------------------------------------------------------------

    @cached_property
    def loads(self) -> list[Load]:
        return list(loads_of(self))

    def spring_length(self, name: str, motion: Motion | None = None) -> Jet:
        spring = self.data["springs"][name]
        between = self.point(spring["second"], motion) - self.point(spring["first"], motion)
        return jets.sqrt(dot(between, between))

    def tension(self, name: str) -> Jet:
        entry, value = self.data["springs"][name], self.machine.value
        length = self.spring_length(name)
        elastic = value(entry.get("stiffness", 0)) * (length - value(entry.get("length", 0)))
        rest = value(entry.get("damping", 0)) * Jet(length.rate) + self._evaluate(entry.get("force", 0))
        return elastic + rest

    @cached_property
    def force(self) -> Array:
        """Q, (nv,)."""
        return sum((load.directions @ load.force for load in self.loads), np.zeros(self.machine.nv))

    @cached_property
    def power(self) -> float:
        return float(sum(load.rate @ load.force for load in self.loads if load.power))

    @property
    def inverse_dynamics(self) -> Array:
        """M a + h + b - Q, (nv,)."""
        return self.inertial - self.force

    def internal_rates(self) -> dict[str, float]:
        return {name: float(self._evaluate(entry["rate"]).value) for name, entry in self.data.get("states", {}).items()}

    # -- constraints -----------------------------------------------------------------------------------------------

    @cached_property
    def rows(self) -> tuple[Array, Array, Array, Array]:
        """Phi of holonomic rows (nan at velocity level), B, B v + Phi_t or psi, and B a + g at the state's a."""
        phi, B, w, g = [], [], [], []
        for quantity, holonomic in row_functions(self):
            units, now = quantity(self.units), quantity(self.motion)
            if holonomic:
                phi.append(float(now.value))
                B.append(units.rate)
                w.append(float(now.rate))
                g.append(float(now.second))
            else:
                phi.append(math.nan)
                B.append(units.value)
                w.append(float(now.value))
                g.append(float(now.rate))
        nv = self.machine.nv
        return np.array(phi), np.array(B).reshape(-1, nv), np.array(w), np.array(g)

    def _of_time(self, text: Any, motion: Motion) -> Jet:
        return jet(evaluated(text, self.machine._time(motion.t))) + 0.0 * motion.t

    @cached_property
    def accelerations(self) -> Array:
        """Solve the bordered system for a; call on a state with zero accelerations."""
        _, B, _, g = self.rows
        kept = np.abs(B).max(axis=1, initial=0.0) > 1e-12  # other rows hold whatever moves
        B, g = B[kept], g[kept]
        nv, m = self.machine.nv, len(B)
        K = np.block([[self.mass, B.T], [B, np.zeros((m, m))]])
        right = np.concatenate([-self.inverse_dynamics, -g])
        scale = np.sqrt(np.maximum(np.abs(K).max(axis=1), 1e-300))
        scaled = K / scale[:, None] / scale
        return (np.linalg.lstsq(scaled, right / scale, rcond=1e-13)[0] / scale)[:nv]

    # -- outputs ---------------------------------------------------------------------------------------------------

    def outputs(self) -> dict[str, Array]:
        found = {}
        for name, entry in self.data.get("outputs", {}).items():
            if "formula" in entry:
                texts = entry["formula"] if isinstance(entry["formula"], list) else [entry["formula"]]
                found[name] = np.array([float(self._evaluate(text).value) for text in texts])
            else:
                kind = next(key for key in ("position", "velocity", "acceleration") if key in entry)
                place = self.point(entry[kind])
                found[name] = {"position": place.value, "velocity": place.rate, "acceleration": place.second}[kind]
        return found

    # -- moving along the group ------------------------------------------------------------------------------------

    def moved(self, step: Array) -> Array:
        """Return q moved by a velocity step, (nq,)."""
        machine, q = self.machine, self.q.copy()
        for name, joint in machine.joints.items():
            if "mimic" in joint:
                continue
            if joint["child"] in machine.beams:
                beam, i, j = machine.beams[joint["child"]]
                q[i : i + beam.count] += step[j : j + beam.count]
            i, j = machine.q_start[name], machine.v_start[name]
            if joint["type"] in COORDINATES:
                count = COORDINATES[joint["type"]]
                q[i : i + count] += step[j : j + count]
                continue
            w, x, y, z = q[i : i + 4]
            turned = Rotation.from_quat([x, y, z, w])
            if joint["type"] == "free":
                q[i + 4 : i + 7] += turned.apply(step[j + 3 : j + 6])
            x, y, z, w = (turned * Rotation.from_rotvec(step[j : j + 3])).as_quat()
            q[i : i + 4] = [w, x, y, z]
        return q

    def onto_constraints(self) -> State:
        """Return the nearest state by Gauss-Newton steps whose rows vanish, with velocities to match."""
        state: State = self
        for _ in range(60):
            phi, B, w, _ = state.rows
            holonomic = ~np.isnan(phi)
            if not len(phi) or np.abs(phi[holonomic]).max(initial=0.0) < 1e-13:
                break
            step = -np.linalg.lstsq(B[holonomic], phi[holonomic], rcond=1e-10)[0]
            step *= min(1.0, 0.3 / max(np.abs(step).max(), 1e-300))
            state = State(self.machine, state.moved(step), state.v, self.t, self.z)
        phi, B, w, _ = state.rows
        v = state.v - np.linalg.lstsq(B, w, rcond=1e-10)[0] if len(w) else state.v
        return State(self.machine, state.q, v, self.t, self.z)
