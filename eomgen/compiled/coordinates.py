"""Names and units of the components of q and v, written as formulas write them: ``q.hinge``, ``v.ball[2]``."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.arrays import Array
from eomgen.lie.product import FactorLike
from eomgen.scene.bodies.beam import Beam
from eomgen.scene.bodies.model import Body
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene

#: Part of a beam's length (of 1 rad, for torsion) that is a small deformation of its first mode.
_SMALL = 0.01
_QUATERNION = ("1",) * 4
_POSE = ((*_QUATERNION, "m", "m", "m"), (*("rad/s",) * 3, *("m/s",) * 3))
#: Units of q and of v, by group.
_UNITS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "SO3": (_QUATERNION, ("rad/s",) * 3),
    "SE3": _POSE,
    "R3xSO3": _POSE,
}


@dataclass(frozen=True)
class Factor:
    """One factor of the configuration group as the layout of a library holds it; ``name`` is its joint's or beam's."""

    group: str
    name: str
    q_start: int
    q_size: int
    v_start: int
    v_size: int

    @property
    def q(self) -> slice:
        return slice(self.q_start, self.q_start + self.q_size)

    @property
    def v(self) -> slice:
        return slice(self.v_start, self.v_start + self.v_size)


def joint_factors(scene: Scene) -> tuple[Factor, ...]:
    """Return the factors of the configuration that the scene's joints have in joint coordinates, in the order of the joints."""
    factors: list[Factor] = []
    q = v = 0
    for joint in scene.leading_joints:
        q_size, v_size = joint.kind.sizes
        factors.append(Factor(joint.kind.group, joint.name, q, q_size, v, v_size))
        q, v = q + q_size, v + v_size
    return tuple(factors)


def component_names(letter: str, name: str, size: int) -> list[str]:
    """Return ``q.hinge`` for one component, ``q.ball[0]`` and so on for several; without a letter, the name alone."""
    full = f"{letter}.{name}" if letter else name
    return [full] if size == 1 else [f"{full}[{index}]" for index in range(size)]


def coordinate_names(factors: Sequence[Factor]) -> tuple[list[str], list[str]]:
    """Return the names of all components of q and of v, in the order of the components."""
    by_q, by_v = sorted(factors, key=lambda factor: factor.q_start), sorted(factors, key=lambda factor: factor.v_start)
    q = [name for factor in by_q for name in component_names("q", factor.name, factor.q_size)]
    v = [name for factor in by_v for name in component_names("v", factor.name, factor.v_size)]
    return q, v


def coordinate_units(
    factors: Sequence[Factor], joints: Iterable[Joint], bodies: Iterable[Body] = ()
) -> tuple[list[str], list[str]]:
    """Return the SI units of all components of q and of v."""
    of_joints = {joint.name: joint.kind.units for joint in joints}
    elastic = {body.name: _of_beam(body.beam) for body in bodies if body.beam is not None}
    q_units: list[str] = []
    v_units: list[str] = []
    for factor in sorted(factors, key=lambda factor: factor.q_start):  # one order: no factor overtakes another in v only
        unknown = ("m" if factor.name.endswith(".position") else "",) * factor.q_size
        units = of_joints.get(factor.name, unknown)
        of_numbers = units, tuple(f"{unit}/s" if unit else "" for unit in units)
        q, v = elastic.get(factor.name) or _UNITS.get(factor.group, of_numbers)
        q_units += q
        v_units += v
    return q_units, v_units


def elastic_amplitudes(factors: Sequence[Factor], bodies: Iterable[Body]) -> list[float]:
    """Return for each component of v how far elastic coordinates may be drawn at random, in their own units; infinity for others.

    A beam of order 1 is right, and its inertia positive definite, for deformations that are small against its length. Higher
    modes have steeper slopes at the same deflection, so they get less.
    """
    beams = {body.name: body.beam for body in bodies if body.beam is not None}
    found = [math.inf] * sum(factor.v_size for factor in factors)
    for factor in factors:
        if factor.name in beams:
            found[factor.v] = _amplitudes(beams[factor.name])
    return found


def _amplitudes(beam: Beam) -> list[float]:
    amplitudes: list[float] = []
    for item in beam.deformations:
        length = min(beam.length, 1.0) if item.nodal else 1.0 if item.kind == "torsion" else beam.length
        amplitudes += [_SMALL * length / (item.modes if item.nodal else number + 1) for number in range(item.modes)]
    return amplitudes


def _of_beam(beam: Beam) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the units of elastic coordinates; nodal ones are deflections and slopes in turn, so those have none of their own."""
    units: list[str] = []
    for item in beam.deformations:
        units += ["" if item.nodal else "rad" if item.kind == "torsion" else "m"] * item.modes
    return tuple(units), tuple(f"{unit}/s" if unit else "" for unit in units)


def configuration_rate(factors: Sequence[FactorLike], q: Array, v: Array) -> Array:
    """Return qdot (..., nq) of velocities v (..., nv): quaternions by p * (0, omega) / 2, positions by R xdot.

    References of angles, which are no part of the factors, stay.
    """
    result = np.zeros((*np.broadcast_shapes(q.shape[:-1], v.shape[:-1]), q.shape[-1]))
    for factor in factors:
        velocity = v[..., factor.v_start : factor.v_start + factor.v_size]
        if factor.group == "R":
            result[..., factor.q_start : factor.q_start + factor.q_size] = velocity
            continue
        p, omega = q[..., factor.q_start : factor.q_start + 4], velocity[..., :3]
        w, axis = p[..., :1], p[..., 1:]
        result[..., factor.q_start] = -0.5 * np.sum(axis * omega, axis=-1)
        result[..., factor.q_start + 1 : factor.q_start + 4] = 0.5 * (w * omega + np.cross(axis, omega))
        if factor.q_size == 7:
            position_rate = rotated(unit(p), velocity[..., 3:]) if factor.group == "SE3" else velocity[..., 3:]
            result[..., factor.q_start + 4 : factor.q_start + 7] = position_rate
    return result


def with_unit_quaternions(factors: Sequence[FactorLike], q: Array) -> Array:
    """Return q with its quaternions scaled to unit length."""
    result = np.array(q)
    for factor in factors:
        if factor.group != "R":
            part = slice(factor.q_start, factor.q_start + 4)
            result[..., part] = unit(q[..., part])
    return result


def unit(quaternion: Array) -> Array:
    """Return a quaternion divided by its length."""
    scaled: Array = quaternion / np.sqrt(np.sum(quaternion * quaternion, axis=-1, keepdims=True))
    return scaled


def rotated(quaternion: Array, r: Array) -> Array:
    """Return R(quaternion) r, (..., 3), for unit quaternions."""
    w, axis = quaternion[..., :1], quaternion[..., 1:]
    twice = 2.0 * np.cross(axis, r)
    result: Array = r + w * twice + np.cross(axis, twice)
    return result
