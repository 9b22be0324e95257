"""Components of q and v: names and units as formulas spell them, ranges for random draws, rates of q, quaternions of
unit length."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie.numeric import rotated, unit
from eomgen.lie.product import Factor
from eomgen.system.description import Coordinates, component_names

_POSE = (("1",) * 4 + ("m",) * 3, ("rad/s",) * 3 + ("m/s",) * 3)
#: Units of q and of v, by group.
_UNITS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "SO3": (("1",) * 4, ("rad/s",) * 3),
    "SE3": _POSE,
    "R3xSO3": _POSE,
}


def coordinate_names(factors: Sequence[Factor]) -> tuple[list[str], list[str]]:
    """Return the names of all components in q and in v, in order."""
    by_q, by_v = sorted(factors, key=lambda factor: factor.q_start), sorted(factors, key=lambda factor: factor.v_start)
    q = [name for factor in by_q for name in component_names("q", factor.name, factor.q_size)]
    v = [name for factor in by_v for name in component_names("v", factor.name, factor.v_size)]
    return q, v


def coordinate_units(factors: Sequence[Factor], coordinates: Iterable[Coordinates]) -> tuple[list[str], list[str]]:
    """Return the SI units of all components in q and in v; ``coordinates`` describes the factors of group R."""
    described = {
        item.name: (item.units, tuple(f"{unit}/s" if unit else "" for unit in item.units)) for item in coordinates
    }
    q_units: list[str] = []
    v_units: list[str] = []
    # one order: no factor overtakes another in v only
    for factor in sorted(factors, key=lambda factor: factor.q_start):
        q, v = _UNITS.get(factor.group) or described.get(factor.name, (("",) * factor.q_size, ("",) * factor.v_size))
        q_units += q
        v_units += v
    return q_units, v_units


def reaches(factors: Sequence[Factor], coordinates: Iterable[Coordinates]) -> list[float]:
    """Return the range of each component of v for random draws, in the unit of the component; infinity for any
    value."""
    known = {item.name: item.reach for item in coordinates if item.reach}
    result = [math.inf] * sum(factor.v_size for factor in factors)
    for factor in factors:
        if factor.name in known:
            result[factor.v] = known[factor.name]
    return result


def configuration_rate(factors: Sequence[Factor], q: Array, v: Array) -> Array:
    """Return the time derivative of configurations.

    Quaternions change by p * (0, omega) / 2, positions by R xdot. References of angles, which are not part of the
    factors, have zero rates.

    Parameters
    ----------
    factors : of the configuration, a product of groups
    q : (..., nq) configurations
    v : (..., nv) velocities, body axes, angular first

    Returns
    -------
    (..., nq)
    """
    result = np.zeros((*np.broadcast_shapes(q.shape[:-1], v.shape[:-1]), q.shape[-1]))
    for factor in factors:
        velocity = v[..., factor.v]
        if factor.group == "R":
            result[..., factor.q] = velocity
            continue
        p, omega = q[..., factor.q_start : factor.q_start + 4], velocity[..., :3]
        w, axis = p[..., :1], p[..., 1:]
        result[..., factor.q_start] = -0.5 * np.sum(axis * omega, axis=-1)
        result[..., factor.q_start + 1 : factor.q_start + 4] = 0.5 * (w * omega + np.cross(axis, omega))
        if factor.q_size == 7:
            position_rate = rotated(unit(p), velocity[..., 3:]) if factor.group == "SE3" else velocity[..., 3:]
            result[..., factor.q_start + 4 : factor.q_start + 7] = position_rate
    return result


def with_unit_quaternions(factors: Sequence[Factor], q: Array) -> Array:
    """Return q with quaternions scaled to unit length."""
    result = np.array(q)
    for factor in factors:
        if factor.group != "R":
            part = slice(factor.q_start, factor.q_start + 4)
            result[..., part] = unit(q[..., part])
    return result


class StateArrays(NamedTuple):
    """Time (...), configuration (..., nq), velocity and acceleration (..., nv), internal states (..., nz)."""

    t: Array
    q: Array
    v: Array
    a: Array
    z: Array
