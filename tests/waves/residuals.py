"""Residuals of the full nonlinear Lagrangian equations, from positions and pressures alone: derivatives by labels are
differences of fourth order, whose own error is below 1e-9."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.base.arrays import Array
from eomgen.waves import Components, Motion, Sea

STEP = 0.1
_PLACES = np.array([-2.0, -1.0, 1.0, 2.0])
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * STEP)


@dataclass(frozen=True)
class Residuals:
    """Greatest magnitudes over all labels."""

    continuity: float
    vorticity: float
    momentum: float
    pressure: float
    bottom: float

    @property
    def of_equations(self) -> Array:
        return np.array([self.continuity, self.vorticity, self.momentum])


def _around(sea: Sea, places: Array, time: float, c: float) -> Callable[[Callable[[Motion], Array]], Array]:
    """Return what takes the gradient by labels of a quantity of the motion, (points, ..., 3)."""
    at = [
        [sea.motion(places + move[:2], time, c + move[2]) for move in _PLACES[:, None] * STEP * np.eye(3)[axis]]
        for axis in range(3)
    ]

    def gradient(of: Callable[[Motion], Array]) -> Array:
        columns = [sum(w * of(m) for w, m in zip(_WEIGHTS, row, strict=True)) for row in at]
        return np.stack(columns, axis=-1)

    return gradient


def vorticity(sea: Sea, places: Array, time: float, c: float) -> Array:
    """Return the invariants of Cauchy, (points, 3, 3), which keep their values on a particle."""
    gradient = _around(sea, places, time, c)
    products = np.einsum("nki,nkj->nij", gradient(lambda m: m.position), gradient(lambda m: m.velocity))
    return products - np.swapaxes(products, 1, 2)


def residuals(sea: Sea, depths: Sequence[float], labels: int = 60) -> Residuals:
    """Return residuals at random labels of several depths, at a random time each."""
    random = np.random.default_rng(3)
    worst = np.zeros(4)
    for c in depths:
        places, time = random.uniform(-100.0, 100.0, (labels, 2)), float(random.uniform(0.0, 10.0))
        gradient = _around(sea, places, time, c)
        here = sea.motion(places, time, c)
        X, U = gradient(lambda m: m.position), gradient(lambda m: m.velocity)
        products = np.einsum("nki,nkj->nij", X, U)
        carried = np.einsum("nki,nk->ni", X, here.acceleration)
        momentum = carried + sea.restoring * X[:, 2] + gradient(lambda m: m.pressure)
        found = [np.linalg.det(X) - 1.0, products - np.swapaxes(products, 1, 2), momentum]
        found.append(here.pressure if c == 0.0 else np.zeros(1))
        worst = np.maximum(worst, [np.abs(x).max() for x in found])
    bottom = 0.0
    if np.isfinite(sea.depth):
        low = sea.motion(places, time, -sea.depth).position[:, 2]
        bottom = float(np.abs(low + sea.depth).max())
    return Residuals(*map(float, worst), bottom)


def three_waves(small: float, vectors: Sequence[tuple[float, float]]) -> Components:
    """Return three components with amplitudes in the ratio 1 : 0.7 : 0.5, steepest about ``small``."""
    amplitude = np.array([1.0, 0.7, 0.5]) * small / 0.06
    return Components(np.array(vectors), amplitude, np.array([0.3, 1.0, 2.0]))
