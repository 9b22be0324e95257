"""Generalized forces by virtual work: weight, joints, springs, bushings, tyres, forces, efforts, hulls."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.oracles.interpreter.beam_inertia import beam_places
from tests.oracles.interpreter.formulas import Names, evaluated
from tests.oracles.interpreter.jets import Jet, jet, rotated, rotation_vector, stack
from tests.oracles.interpreter.machine import ANGLES, COORDINATES, Motion
from tests.oracles.interpreter.water import slices

if TYPE_CHECKING:
    from tests.oracles.interpreter.equations import State

Array = NDArray[Any]
Data = Mapping[str, Any]


@dataclass(frozen=True)
class Load:
    """A generalized force by virtual work: a force on a rate (one number or a vector), with its power."""

    directions: Array  # (nv, k): rate of the loaded quantity by unit velocities
    rate: Array  # (k,) along the motion
    force: Array  # (k,)
    power: bool  # whether it counts as power; else its potential is counted


def loads_of(state: State) -> Iterator[Load]:
    """Generate all loads of a state."""
    kinds = (
        weights, beam_loads, joint_forces, springs, torsion_springs, bushings, tyres, forces, efforts, hulls,
    )  # fmt: skip  # a table
    for kind in kinds:
        yield from kind(state)


def along(state: State, quantity: Any, force: Any, power: bool) -> Load:
    """Load on a scalar or vector quantity, a function of the motion."""
    units, now = jet(quantity(state.units)).rate, jet(quantity(state.motion)).rate
    nv = state.machine.nv
    return Load(units.reshape(nv, -1), np.atleast_1d(now), np.atleast_1d(np.asarray(force, float)), power)


def turning(state: State, body: str, torque: Array, power: bool) -> Load:
    return Load(state.units.poses[body].omega.value, state.motion.poses[body].omega.value, np.asarray(torque), power)


def weights(state: State) -> Iterator[Load]:
    for name, m, center, _ in state._bodies():
        yield along(state, lambda s, n=name, c=center: s.poses[n].at(c), m * state.machine.gravity, False)


def joint_forces(state: State) -> Iterator[Load]:
    listed = state.machine.listed
    for name, joint in state.machine.joints.items():
        for k in range(COORDINATES.get(joint["type"], 0)):
            number = state.motion.coordinates[name][k]
            x, rate = float(number.value), float(number.rate)

            def quantity(s: Motion, n: str = name, i: int = k) -> Jet:
                return s.coordinates[n][i]

            stiffness = listed(joint, "stiffness", k)
            yield along(state, quantity, -stiffness * (x - listed(joint, "rest", k)), False)
            yield along(state, quantity, -listed(joint, "damping", k) * rate, True)
            if "friction" in joint:
                yield along(state, quantity, friction(state, joint["friction"], k, rate), True)
            if "limits" in joint:
                angle = k < ANGLES.get(joint["type"], 0)
                for spring, damper in stops(state, joint["limits"], k, x, rate, angle):
                    yield along(state, quantity, spring, False)
                    yield along(state, quantity, damper, True)


def friction(state: State, entry: Data, k: int, rate: float) -> float:
    listed = state.machine.listed
    coulomb, velocity = listed({}, "coulomb", k, table=entry), listed({}, "velocity", k, table=entry)
    level = coulomb
    if "static" in entry:
        static, stribeck = listed({}, "static", k, table=entry), listed({}, "stribeck", k, table=entry)
        level = coulomb + (static - coulomb) * math.exp(-((rate / stribeck) ** 2))
    return -level * math.tanh(rate / velocity)


def stops(state: State, entry: Data, k: int, x: float, rate: float, angle: bool) -> Iterator[tuple[float, float]]:
    listed = state.machine.listed
    stiffness, damping = listed({}, "stiffness", k, table=entry), listed({}, "damping", k, table=entry)
    onset = listed({}, "onset", k, 1e-3 if angle else 1e-4, table=entry)
    for key, side in (("lower", 1.0), ("upper", -1.0)):
        end = listed({}, key, k, -side * math.inf, table=entry)
        depth, depth_rate = side * (end - x), -side * rate
        if depth > 0:
            scale = smooth_onset(depth / onset)
            spring = scale * stiffness * depth
            whole = scale * max(0.0, stiffness * depth + damping * depth_rate)
            yield side * spring, side * (whole - spring)


def springs(state: State) -> Iterator[Load]:
    for name, entry in state.data.get("springs", {}).items():
        value, length = state.machine.value, state.spring_length(name)
        elastic = value(entry.get("stiffness", 0)) * (length.value - value(entry.get("length", 0)))
        other = value(entry.get("damping", 0)) * length.rate + state._evaluate(entry.get("force", 0)).value

        def quantity(s: Motion, n: str = name) -> Jet:
            return state.spring_length(n, s)

        yield along(state, quantity, -elastic, False)
        yield along(state, quantity, -other, True)


def torsion_angle(state: State, entry: Data, motion: Motion) -> Jet:
    angle = motion.coordinates[entry["first"]][entry.get("first_index", 0)]
    if entry.get("second"):
        angle = angle - motion.coordinates[entry["second"]][entry.get("second_index", 0)]
    return angle - state.machine.value(entry.get("rest", 0))


def torsion_springs(state: State) -> Iterator[Load]:
    for entry in state.data.get("torsion_springs", {}).values():
        angle = torsion_angle(state, entry, state.motion)

        def quantity(s: Motion, e: Data = entry) -> Jet:
            return torsion_angle(state, e, s)

        yield along(state, quantity, -state.machine.value(entry.get("stiffness", 0)) * angle.value, False)
        yield along(state, quantity, -state.machine.value(entry.get("damping", 0)) * angle.rate, True)


def deformation(state: State, entry: Data, motion: Motion) -> Jet:
    """Rotation vector and displacement of the second frame in the first, against their rest, (..., 6)."""
    first, second = state.frame(entry["first"], motion), state.frame(entry["second"], motion)
    R = first.R.transposed() @ second.R @ state.machine.rotation(entry.get("rest_rotation")).T
    travel = rotated(first.R.transposed(), second.x - first.x) - state.machine.values(entry.get("rest", [0, 0, 0]))
    turned = rotation_vector(R)
    return Jet(*(np.concatenate([a, b], axis=-1) for a, b in zip(turned.c, travel.c, strict=True)))


def bushing_matrices(state: State, entry: Data) -> tuple[Array, Array, Array]:
    values, zero = state.machine.values, [0.0] * 3
    K = np.diag([*values(entry.get("rotational_stiffness", zero)), *values(entry.get("stiffness", zero))])
    D = np.diag([*values(entry.get("rotational_damping", zero)), *values(entry.get("damping", zero))])
    preload = np.array([*values(entry.get("rotational_preload", zero)), *values(entry.get("preload", zero))])
    return np.array(entry.get("stiffness_matrix", K)), np.array(entry.get("damping_matrix", D)), preload


def bushings(state: State) -> Iterator[Load]:
    for entry in state.data.get("bushings", {}).values():
        K, D, preload = bushing_matrices(state, entry)
        e = deformation(state, entry, state.motion)

        def quantity(s: Motion, e: Data = entry) -> Jet:
            return deformation(state, e, s)

        yield along(state, quantity, preload - K @ e.value, False)
        yield along(state, quantity, -D @ e.rate, True)


def tyre(state: State, name: str) -> tuple[Jet, float, Array]:
    """Deflection, force along it and slope of the road under the centre."""
    entry, value = state.data["tyres"][name], state.machine.value
    deflection = tyre_deflection(state, entry, state.motion, state.motion.t)
    d = float(deflection.value)
    force = 0.0
    if d > 0.0:
        scale = smooth_onset(d / value(entry.get("onset", 0.001)))
        pressed = value(entry["stiffness"]) * d + value(entry.get("damping", 0)) * float(deflection.rate)
        force = scale * max(0.0, pressed)
    return deflection, force, slope(state, entry)


def tyre_deflection(state: State, entry: Data, motion: Motion, t: Jet) -> Jet:
    center = state.point(entry["center"], motion)
    names = Names({"t": t, **state.machine.parameters, **state.machine.curves}, lambda kind, name: center)
    road = evaluated(entry.get("road", 0), names)
    return state.machine.value(entry["radius"]) + road - center[..., 2]


def slope(state: State, entry: Data) -> Array:
    center = state.point(entry["center"]).value
    slopes = []
    for axis in range(2):
        x = Jet(center, np.eye(3)[axis], 0.0)
        names = Names(
            {"t": jet(state.t), **state.machine.parameters, **state.machine.curves}, lambda kind, name, at=x: at
        )
        slopes.append(float(jet(evaluated(entry.get("road", 0), names)).rate))
    return np.array(slopes)


def tyres(state: State) -> Iterator[Load]:
    value = state.machine.value
    for name, entry in state.data.get("tyres", {}).items():
        deflection, force, slope = tyre(state, name)
        direction = np.array([-slope[0], -slope[1], 1.0])
        spring, d = 0.0, float(deflection.value)
        moved = {"t", *state.machine._inputs()} & {
            node.id for node in ast.walk(_tree(entry)) if isinstance(node, ast.Name)
        }
        if d > 0.0 and not moved:  # over places alone the spring has a potential
            spring = smooth_onset(d / value(entry.get("onset", 0.001))) * value(entry["stiffness"]) * d
        for part, power in ((spring, False), (force - spring, True)):
            yield along(state, lambda s, e=entry: state.point(e["center"], s), part * direction, power)


def forces(state: State) -> Iterator[Load]:
    for entry in state.data.get("forces", {}).values():
        body, r = entry["body"], state.machine.values(entry.get("point", [0, 0, 0]))
        pose = state.motion.poses[body]
        axes = pose.R.value if entry.get("axes", "world") == "body" else np.eye(3)
        place = pose.at(r)
        turned = Rotation.from_matrix(pose.R.value).as_rotvec()
        here = {
            "position": Jet(place.value @ axes),
            "velocity": Jet(place.rate @ axes),
            "angular_velocity": Jet(pose.omega.value @ axes),
            "rotation": Jet(turned),
        }
        force = axes @ np.array([float(state._evaluate(part, here).value) for part in entry.get("force", [0] * 3)])
        torque = axes @ np.array([float(state._evaluate(part, here).value) for part in entry.get("torque", [0] * 3)])
        yield along(state, lambda s, b=body, p=r: s.poses[b].at(p), force, True)
        yield turning(state, body, torque, True)


def efforts(state: State) -> Iterator[Load]:
    for entry in state.data.get("efforts", {}).values():
        effort, k = float(state._evaluate(entry["effort"]).value), entry.get("index", 0)
        name = entry["joint"]
        if state.machine.joints[name]["type"] in COORDINATES:
            yield along(state, lambda s, n=name, i=k: s.coordinates[n][i], effort, True)
        else:
            index = state.machine.v_start[name] + k
            direction = np.zeros((state.machine.nv, 1))
            direction[index] = 1.0
            yield Load(direction, state.v[index : index + 1], np.array([effort]), True)


def beam_loads(state: State) -> Iterator[Load]:
    for name, (beam, _, j) in state.machine.beams.items():
        J, rate = beam_places(state, name, state.units).rate, beam_places(state, name, state.motion).rate
        weights = beam.masses[:, None] * state.machine.gravity
        yield Load(J.reshape(len(J), -1), rate.ravel(), weights.ravel(), False)
        directions = np.zeros((state.machine.nv, beam.count))
        directions[j : j + beam.count] = np.eye(beam.count)
        numbers = stack(state.motion.elastic[name])
        yield Load(directions, numbers.rate, -beam.K @ numbers.value, False)
        yield Load(directions, numbers.rate, -beam.D @ numbers.rate, True)


def hulls(state: State) -> Iterator[Load]:
    for slice_ in slices(state):
        yield along(state, slice_.quantity, slice_.force, True)
        if slice_.couple is not None:  # pressure that changes across the section
            yield turning(state, slice_.body, slice_.couple, True)


def _tree(entry: Data) -> ast.AST:
    return ast.parse(str(entry.get("road", 0)), mode="eval")


def smooth_onset(x: float) -> float:
    return 1.0 if x >= 1.0 else x * x * (3.0 - 2.0 * x)
