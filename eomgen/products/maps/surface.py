"""Surfaces through a grid of values, for maps in formulas: tensor products of splines of one argument, with values,
derivatives and recording on the tape.

Interpolation P along an axis is linear in the values: P f = sum_j f_j w_j, with w_j the spline through 1 at node j and
0 at all other nodes. So P_x P_y f (x, y) = sum_j w_j(y) (P_x f_j)(x): one spline along x for each line of the grid,
weighted by splines along y. Quintic splines are four times continuously differentiable, and so is the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.errors import ModelError, Problem
from eomgen.formula.curves import Curve, Interpolation, Outside
from eomgen.formula.nodes import Application, Formula
from eomgen.formula.recording import curve_at
from eomgen.formula.words import Signature, Word
from eomgen.symbolic.scalar import Algebra, Scalar


@dataclass(frozen=True, eq=False)
class MapSurface:
    """A function of two arguments through the values at the nodes of a grid.

    Attributes
    ----------
    x, y : (n,), (m,) arrays
        Nodes along both axes, increasing.
    z : (n, m) array
        Values at the nodes.
    interpolation : str
        ``quintic``: four times continuously differentiable. ``linear``: bilinear, with bends at the nodes' lines.
    outside : str
        Along both axes, as of ``Curve``: ``error`` (not a number), ``hold`` or ``periodic``.
    units : tuple of str
        Of both arguments, in SI, and of the value; empty for any.
    """

    name: str
    x: Array
    y: Array
    z: Array
    interpolation: Interpolation = "quintic"
    outside: Outside = "error"
    units: tuple[str, str, str] = ("", "", "")

    def __str__(self) -> str:
        return (
            f"{len(self.x)} x {len(self.y)} values from {self.x[0]:.6g}, {self.y[0]:.6g} to {self.x[-1]:.6g},"
            f" {self.y[-1]:.6g}, {self.interpolation}, outside {self.outside}"
        )

    @cached_property
    def terms(self) -> tuple[tuple[tuple[Curve, int], tuple[Curve, int]], ...]:
        """Pairs of splines whose products add up to the surface, each with the number of its argument; as many as the
        shorter axis has nodes."""
        along, across, lines, of_lines, axes = self.x, self.y, self.z.T, 0, "xy"
        if len(self.x) < len(self.y):
            along, across, lines, of_lines, axes = self.y, self.x, self.z, 1, "yx"
        return tuple(
            (
                (self._spline(f"along {axes[0]}, line {number}", along, line), of_lines),
                (self._spline(f"along {axes[1]}, line {number}", across, unit), 1 - of_lines),
            )
            for number, (line, unit) in enumerate(zip(lines, np.eye(len(across)), strict=True), 1)
        )

    @cached_property
    def profiles(self) -> tuple[Curve, ...]:
        """Splines through the values along lines of the grid, in both directions; of many lines only about 50 in
        each."""
        directions = ("xy", self.x, self.y, self.z.T), ("yx", self.y, self.x, self.z)
        return tuple(
            self._spline(f"along {axes[0]} at {axes[1]} = {across[index]:.6g}", along, values[index])
            for axes, along, across, values in directions
            for index in range(0, len(across), 1 + len(across) // 50)
        )

    def _spline(self, line: str, nodes: Array, values: Array) -> Curve:
        return Curve(f"map.{self.name} {line}", nodes, values, self.interpolation, self.outside)

    def curves(self, arguments: tuple[Formula, ...]) -> tuple[Application, ...]:
        """Return the splines of ``terms``, each applied to its argument, x or y."""
        return tuple(Application(curve, arguments[index]) for pair in self.terms for curve, index in pair)

    def value(self, word: str, component: int, x: ArrayLike, y: ArrayLike) -> Array:
        """Return the values at x and y, of the broadcast shape of x and y."""
        xy = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        products = (line(xy[first]) * weight(xy[second]) for (line, first), (weight, second) in self.terms)
        return np.asarray(sum(products))


def recorded(algebra: Algebra, surface: MapSurface, word: str, component: int, arguments: Sequence[Scalar]) -> Scalar:
    """Record a surface at two arguments on the tape and return its scalar. Raises ModelError for constant arguments
    beyond the grid."""
    with algebra.tape.block(f"map {surface.name}, line by line"):
        result = algebra.zero
        try:
            for (line, first), (weight, second) in surface.terms:
                product = curve_at(algebra, line, arguments[first]) * curve_at(algebra, weight, arguments[second])
                result = result + product
        except (ValueError, ArithmeticError):
            fault = f"the map {surface.name} has no value at constant arguments beyond the grid [E0934]"
            raise ModelError(Problem("", fault, 'arguments within the grid, or outside = "hold"')) from None
    return result


def _signature(surface: MapSurface) -> Signature:
    *arguments, value = surface.units
    return Signature(dict(zip("xy", arguments, strict=True)), {"value": value})


MAP = Word(
    name="map",
    section="maps",
    arguments=("x", "y"),
    values=MapSurface.value,
    recording=f"{__name__}:recorded",
    curves=MapSurface.curves,
    signature=_signature,
)
