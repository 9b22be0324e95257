"""Integrals along a beam by Gauss's rule on panels so short that products of shape functions are integrated to rounding."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence

import numpy as np

from eomgen.mechanics.beams.families import Array, Family

_NODES = 24
_WAVE_PER_PANEL = 1.5  # rad, or degrees of a polynomial; products of four functions are then exact to 1e-16


@functools.cache
def _rule() -> tuple[Array, Array]:
    """Return nodes and weights of Gauss's rule on 0 .. 1."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return (nodes + 1.0) / 2.0, weights / 2.0


@functools.cache
def _running() -> Array:
    """Return (n, n): integrals from 0 to each node of what has values at the nodes, on 0 .. 1."""
    nodes = 2.0 * _rule()[0] - 1.0
    powers = np.polynomial.legendre.legvander(nodes, _NODES)
    # int_(-1)^x P_j = (P_(j+1) - P_(j-1)) / (2 j + 1), and x + 1 for j = 0
    antiderivatives = np.empty((_NODES, _NODES))
    antiderivatives[:, 0] = nodes + 1.0
    for degree in range(1, _NODES):
        antiderivatives[:, degree] = (powers[:, degree + 1] - powers[:, degree - 1]) / (2 * degree + 1)
    weights = 2.0 * _rule()[1]
    coefficients = (powers[:, :_NODES] * weights[:, None]).T * (np.arange(_NODES) + 0.5)[:, None]
    return np.asarray(antiderivatives @ coefficients / 2.0)


class Grid:
    """Places along s = 0 .. 1 at which functions are summed up.

    Parameters
    ----------
    families : sequence of Family
        What is to be integrated.
    split : sequence of float
        Further ends of panels.
    """

    def __init__(self, families: Sequence[Family], split: Sequence[float] = ()) -> None:
        edges = sorted({0.0, 1.0, *split, *(place for family in families for place in family.breaks)})
        wave = max((family.wave_number for family in families), default=0.0)
        panels = [
            np.linspace(first, last, 1 + max(1, int(np.ceil(wave * (last - first) / _WAVE_PER_PANEL))))
            for first, last in itertools.pairwise(edges)
        ]
        starts = np.concatenate([panel[:-1] for panel in panels])
        self.lengths = np.concatenate([np.diff(panel) for panel in panels])
        nodes, weights = _rule()
        self.places = (starts[:, None] + self.lengths[:, None] * nodes).ravel()
        self.weights = (self.lengths[:, None] * weights).ravel()
        self.starts = starts

    def from_origin(self, values: Array, origin: float) -> Array:
        """Return running integrals from ``origin``, an end of panels, to each place, of values (..., m) at the places."""
        shape = values.shape
        parts = values.reshape(*shape[:-1], len(self.lengths), _NODES)
        within = (parts @ _running().T) * self.lengths[:, None]
        whole = (parts @ _rule()[1]) * self.lengths
        before = np.concatenate([np.zeros((*shape[:-1], 1)), np.cumsum(whole, axis=-1)], axis=-1)
        at_origin = before[..., int(np.searchsorted(self.starts, origin))]
        return np.asarray((before[..., :-1, None] + within - at_origin[..., None, None]).reshape(shape))
