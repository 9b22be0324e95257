"""``Composition``: one step of a symplectic method as drifts and kicks in turn, its properties.

A drift moves coordinates with momenta held, a kick changes momenta with coordinates held. Time is a coordinate, so it
moves in drifts: a force that depends on time is evaluated at the time that drifts have come to.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from typing import Literal

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED

Part = Literal["drift", "kick"]


@dataclass(frozen=True)
class Composition:
    """A symmetric composition of drifts and kicks.

    Attributes
    ----------
    name : argument of ``composition_named`` for this composition
    order : even; of the flows of any two operators
    first : first and last part of a step
    fractions : of a step, of drifts and kicks in turn, beginning with ``first``
    source : publication
    levels : of a recursion of leapfrogs: for m = 2, 4, ..., the sizes of the steps of order m in a step of order m + 2;
        the order and the matrix of the recursion for the oscillator follow level by level
    """

    name: str
    order: int
    first: Part
    fractions: tuple[float, ...]
    source: str = ""
    levels: tuple[tuple[float, ...], ...] = ()

    @property
    def drifts(self) -> tuple[float, ...]:
        """Fractions of the drifts of a step; one more than kicks if a step begins with a drift, else one less."""
        return self.fractions[0 if self.first == "drift" else 1 :: 2]

    @property
    def kicks(self) -> tuple[float, ...]:
        """Fractions of the kicks of a step."""
        return self.fractions[0 if self.first == "kick" else 1 :: 2]

    @property
    def gradients(self) -> int:
        """Evaluations of the force in each of many steps, with adjacent parts of steps merged."""
        return len(self.fractions) // 2

    @functools.cached_property
    def kick_times(self) -> tuple[float, ...]:
        """Fractions of the step at which kicks are: sums of the drifts before each."""
        moved = tuple(itertools.accumulate(self.drifts, initial=0.0))
        return moved[1:-1] if self.first == "drift" else (*moved[:-1], 1.0)

    def parts(self, steps: int = 1) -> Iterator[tuple[Part, float]]:
        """Yield the parts of a number of steps, as (drift or kick, fraction of a step), adjacent parts merged."""
        kinds: tuple[Part, Part] = ("drift", "kick") if self.first == "drift" else ("kick", "drift")
        last = len(self.fractions) - 1
        for step in range(steps):
            for index, fraction in enumerate(self.fractions):
                if index == 0 and step:
                    continue  # part of the previous leapfrog
                merged = index == last and step < steps - 1
                yield kinds[index % 2], fraction + (self.fractions[0] if merged else 0.0)

    @functools.cached_property
    def leapfrogs(self) -> tuple[float, ...]:
        """The fractions of the leapfrogs whose product is a step, in order; empty if the step is not such a product.

        In place of leapfrogs any other symmetric steps of order 2 give a method of the same order.
        """
        inner = self.kicks if self.first == "drift" else self.drifts
        outer = self.drifts if self.first == "drift" else self.kicks
        halves = (0.0, *inner, 0.0)
        sums = ((before + after) / 2 for before, after in itertools.pairwise(halves))
        return inner if all(abs(fraction - mean) < 1e-14 for fraction, mean in zip(outer, sums, strict=True)) else ()

    def oscillator(self, steps: Array) -> Array:
        """Return the matrices by which steps change (q, p) of the oscillator q'' = -q, shape (..., 2, 2).

        Parameters
        ----------
        steps : any shape; in 1/omega
        """
        return self._by_level(np.asarray(steps), len(self.levels)) if self.levels else _matrices(self.parts(), steps)

    def _by_level(self, steps: Array, level: int) -> Array:
        """Return the matrices (..., 2, 2) of the oscillator q'' = -q for steps (...) of a level of a recursion; 0:
        leapfrogs."""
        if level == 0:
            opposite: Part = "kick" if self.first == "drift" else "drift"
            return _matrices([(self.first, 0.5), (opposite, 1.0), (self.first, 0.5)], steps)
        sizes = self.levels[level - 1]
        inner = {size: self._by_level(size * steps, level - 1) for size in dict.fromkeys(sizes)}
        return functools.reduce(np.matmul, (inner[size] for size in sizes))

    @functools.cached_property
    def stability_limit(self) -> float:
        """Largest omega h up to which all smaller steps keep oscillations bounded: the first at which half the trace
        of the oscillator's matrix leaves [-1, 1].

        If the half trace only touches the bounds, as for tabulated coefficients up to rounding, steps remain stable.
        """

        def beyond(steps: Array) -> Array:
            matrices = self.oscillator(steps)
            return np.asarray(np.abs(matrices[..., 0, 0] + matrices[..., 1, 1]) / 2 - 1)

        for start in range(2 * self.gradients + 1):  # no composition is stable beyond twice its kicks
            grid = np.linspace(start, start + 1, 500 + 1)
            excess = beyond(grid)
            # a maximum between two points may lie beyond the bound though both points do not
            before, here, after = excess[:-2], excess[1:-1], excess[2:]
            peaks = 1 + np.flatnonzero((here >= before) & (here >= after) & (here > -1e-4))
            finer = [np.linspace(grid[peak - 1], grid[peak + 1], 513) for peak in peaks]
            points = np.unique(np.concatenate([grid, *finer]))
            outside = np.flatnonzero(beyond(points) > COMPUTED)
            if len(outside) and outside[0]:
                return _bisect(beyond, points[outside[0] - 1], points[outside[0]])
        raise AssertionError("unreachable: the trace is a polynomial of even degree in the step")

    @functools.cached_property
    def error_constant(self) -> float:
        """The limit of sqrt(rho)/(omega h)^order for small steps; rho sin^2 is the mean energy error of an oscillator
        with thermal energy after any number of steps, relative to the temperature.

        With b and c, the off-diagonal entries of the oscillator's matrix, rho = -(b + c)^2/(2 b c) (Blanes, Casas,
        Sanz-Serna, SIAM J. Sci. Comput. 36 (2014) A1556).
        """
        degree = self.order + 2
        rows = np.zeros((2, 2, degree))  # of (q, p), as power series in the step
        rows[0, 0, 0] = rows[1, 1, 0] = 1.0
        for part, fraction in self.parts():
            moved, by, sign = (0, 1, 1.0) if part == "drift" else (1, 0, -1.0)
            rows[moved, :, 1:] += sign * fraction * rows[by, :, :-1]
        return float(abs(rows[0, 1, -1] + rows[1, 0, -1]) / math.sqrt(2.0))


def _matrices(parts: Iterable[tuple[Part, float]], steps: Array) -> Array:
    """Return the matrices (..., 2, 2) by which drifts and kicks in turn change (q, p) of the oscillator q'' = -q.
    `parts` are pairs of drift or kick and fraction of a step; `steps` (...) are in 1/omega."""
    matrices = np.broadcast_to(np.eye(2), (*np.shape(steps), 2, 2)).copy()
    for part, fraction in parts:
        moved = np.asarray(steps) * fraction
        if part == "drift":
            matrices[..., 0, :] += moved[..., None] * matrices[..., 1, :]
        else:
            matrices[..., 1, :] -= moved[..., None] * matrices[..., 0, :]
    return matrices


def _bisect(beyond: Callable[[Array], Array], inside: float, outside: float) -> float:
    """Return a step between `inside`, at which a function is 0 or less, and `outside`, at which it is positive, at a
    zero."""
    for _ in range(60):
        middle = (inside + outside) / 2
        if beyond(np.asarray(middle)) > 0:
            outside = middle
        else:
            inside = middle
    return float(inside)
