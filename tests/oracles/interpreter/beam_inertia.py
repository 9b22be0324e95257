"""Inertia of beams of shape functions, cut off at the order of the beam in its elastic coordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tests.oracles.interpreter.jets import Jet, rotated
from tests.oracles.interpreter.machine import Motion

if TYPE_CHECKING:
    from tests.oracles.interpreter.equations import State

Array = NDArray[Any]


def scaled(state: State, name: str, scale: float) -> tuple[Motion, Motion]:
    """Motions with the elastic coordinates of a beam, their rates and accelerations scaled; unit rates are not."""
    _, i, j = state.machine.beams[name]
    count = state.machine.beams[name][0].count
    q, v, a = state.q.copy(), state.v.copy(), state.a.copy()
    for array, start in ((q, i), (v, j), (a, j)):
        array[start : start + count] *= scale
    nv = state.machine.nv
    units = state.machine.motion(q, np.eye(nv), np.zeros((nv, nv)), state.t, still=True)
    return state.machine.motion(q, v, a, state.t), units


def beam_places(state: State, name: str, motion: Motion) -> Jet:
    beam, pose = state.machine.beams[name][0], motion.poses[name]
    R = Jet(*(part[..., None, :, :] for part in pose.R.c))
    x = Jet(*(part[..., None, :] for part in pose.x.c))
    return x + rotated(R, beam.positions(motion.elastic[name]))


def beam_inertia(state: State, name: str, scale: float) -> tuple[Array, Array]:
    now, units = scaled(state, name, scale)
    masses = state.machine.beams[name][0].masses
    J = beam_places(state, name, units).rate
    M = np.einsum("ipk,jpk,p->ij", J, J, masses)
    return M, np.einsum("ipk,pk,p->i", J, beam_places(state, name, now).second, masses)


def truncated(state: State, name: str, terms: Any, mass: bool = False) -> Array:
    """Keep kinetic energy to second order in the elastic coordinates and rates of beams of order 1.

    ``terms(scale)`` is a polynomial in the scale of degree 6 at most; its coefficients follow from seven values.
    Rows of elastic coordinates lose one order by the derivative, so do their columns in M.
    """
    beam, _, j = state.machine.beams[name]
    if beam.order == 2:
        return np.asarray(terms(1.0))
    scales = np.cos(np.pi * (np.arange(7) + 0.5) / 7)
    values = np.array([terms(scale) for scale in scales])
    coefficients = np.linalg.solve(np.vander(scales, increasing=True), values.reshape(7, -1)).reshape(values.shape)
    elastic = np.zeros(state.machine.nv, int)
    elastic[j : j + beam.count] = 1
    degree = 2 - (elastic[:, None] + elastic[None, :] if mass else elastic)
    return sum(coefficients[k] * (k <= degree) for k in range(3))


def beam_energy(state: State, name: str, scale: float) -> Array:
    speed = beam_places(state, name, scaled(state, name, scale)[0]).rate
    return np.array([0.5 * np.einsum("pk,pk,p->", speed, speed, state.machine.beams[name][0].masses)])


def kinetic_energy(state: State, name: str) -> float:
    if state.machine.beams[name][0].order == 2:
        return float(beam_energy(state, name, 1.0)[0])
    scales = np.cos(np.pi * (np.arange(7) + 0.5) / 7)
    values = np.array([beam_energy(state, name, scale)[0] for scale in scales])
    return float(np.linalg.solve(np.vander(scales, increasing=True), values)[:3].sum())
