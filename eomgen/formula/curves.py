"""Curves: piecewise polynomial functions of one number with derivatives; the form of tables, points and waves.

The quintic spline through points is the one of least integral of the third derivative squared (natural ends), or of
given ends.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.base.rounding import COMPUTED

Interpolation = Literal["quintic", "linear", "steps"]
Outside = Literal["error", "hold", "periodic"]

#: An argument outside the range by at most this part of the range is taken for rounding of the last point.
EDGE = COMPUTED
_EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Bump:
    """A haversine bump: height/2 (1 - cos(2 pi (x - position)/length)) from ``position`` over ``length``, else 0."""

    name: str
    position: float
    length: float
    height: float

    def __str__(self) -> str:
        return f"a bump {self.height:.6g} high over {self.length:.6g} from {self.position:.6g}"

    def kinks(self) -> list[tuple[float, int]]:
        """Return the kinks of the curve, as ``Curve.kinks``: the second derivative of the bump jumps at both ends."""
        return [(self.position, 2), (self.position + self.length, 2)]

    def __call__(self, x: ArrayLike, derivative: int = 0) -> NDArray[Any]:
        """Return the bump, or a derivative of the bump, at x (...)."""
        along = (np.asarray(x, dtype=float) - self.position) / self.length
        rate = 2.0 * math.pi
        wave = np.cos(rate * along + derivative * math.pi / 2.0)
        value = 0.5 * self.height * ((1.0 if derivative == 0 else 0.0) - (rate / self.length) ** derivative * wave)
        return np.where((along < 0.0) | (along >= 1.0), 0.0, value)


@dataclass(frozen=True)
class Waves:
    """A sum of harmonics (amplitude, angular frequency, phase): amplitude cos(angular frequency x + phase) each."""

    name: str
    harmonics: tuple[tuple[float, float, float], ...]

    def __str__(self) -> str:
        return f"{len(self.harmonics)} harmonics"

    def kinks(self) -> list[tuple[float, int]]:
        """Return no places: the curve is smooth."""
        return []

    def __call__(self, x: ArrayLike, derivative: int = 0) -> NDArray[Any]:
        """Return the sum, or a derivative of the sum, at x (...)."""
        places = np.asarray(x, dtype=float)
        value = np.zeros(places.shape)
        for amplitude, frequency, phase in self.harmonics:
            angle = frequency * places + phase + derivative * math.pi / 2.0
            value += amplitude * frequency**derivative * np.cos(angle)
        return value


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve through points.

    Attributes
    ----------
    x, y : (n,) arrays
        Points, x in increasing order; ``linear`` may hold an x twice, for a jump. A periodic curve of steps ends with
        the x at which the next period begins.
    interpolation : str
        ``quintic``: four times continuously differentiable. ``linear``. ``steps``: each value until the next point.
    outside : str
        ``error``: not a number beyond the points, and natural ends (third and fourth derivative zero). ``hold``: the
        values at the ends, and a spline that comes to rest there (first and second derivative zero). ``periodic``: the
        last point is the first of the next period, and a spline is as smooth there as elsewhere.
    smooth_ends : bool
        Whether the first three pieces of a spline of ``error``, and the last three, are one polynomial, in place of
        natural ends: smooth functions are met as closely at the ends as elsewhere.
    """

    name: str
    x: Array
    y: Array
    interpolation: Interpolation = "quintic"
    outside: Outside = "error"
    smooth_ends: bool = field(default=False, kw_only=True)

    def __str__(self) -> str:
        return (
            f"{len(self.x)} points from {self.start:.6g} to {self.end:.6g}, {self.interpolation}, outside"
            f" {self.outside}"
        )

    @property
    def start(self) -> float:
        return float(self.x[0])

    @property
    def end(self) -> float:
        return float(self.x[-1])

    @property
    def period(self) -> float:
        """0 if the curve is not periodic."""
        return self.end - self.start if self.outside == "periodic" else 0.0

    @cached_property
    def breaks(self) -> Array:
        """Breaks between polynomials, (pieces + 1,)."""
        return np.unique(self.x)

    @cached_property
    def coefficients(self) -> Array:
        """Coefficients of each piece in powers of x - (start of the piece), lowest first: (pieces, degree + 1)."""
        if self.interpolation == "steps":
            return np.ascontiguousarray(self.y[:-1, np.newaxis])
        if self.interpolation == "linear":
            wide = np.diff(self.x) > 0.0
            low, rise = self.y[:-1][wide], np.diff(self.y)[wide]
            return np.stack([low, rise / np.diff(self.x)[wide]], axis=1)
        return _quintic(self.x, self.y, self.outside, smooth_ends=self.smooth_ends)

    @property
    def end_values(self) -> tuple[float, float]:
        """Values before the first and after the last point, if the curve holds the values of its ends."""
        return float(self.y[0]), float(self.y[-1])

    def kinks(self) -> list[tuple[float, int]]:
        """Return the points at which the curve is not smooth: (x, lowest derivative that jumps); 0 for the value.

        A periodic curve has the kinks of one period, with the start of the period. The ends of a curve of ``error`` are
        none: the curve is undefined beyond the ends. Derivatives of a spline jump from the third on, which methods do
        not notice.
        """
        if self.interpolation == "quintic":
            return []
        low, slope = self.coefficients[:, 0], self.coefficients[:, 1:].sum(axis=1)
        high = low + slope * np.diff(self.breaks)
        before, after = (high, slope), (low, slope)
        if self.outside == "periodic":
            positions = self.breaks[:-1]
            left, right = ([np.roll(part, 1) for part in before], list(after))
        else:
            positions = self.breaks
            first, last = float(self.y[0]), float(self.y[-1])
            left = [np.append(first, high), np.append(0.0, slope)]
            right = [np.append(low, last), np.append(slope, 0.0)]
            if self.outside == "error":
                positions, left, right = positions[1:-1], [part[1:-1] for part in left], [part[1:-1] for part in right]
        scale = np.max(np.abs(self.y)) or 1.0
        steepest = np.max(np.abs(slope), initial=0.0)
        jumps = np.abs(right[0] - left[0]) > 1e-12 * scale
        slope_jumps = np.abs(right[1] - left[1]) > 1e-12 * steepest
        return [
            (float(position), 0 if jump else 1)
            for position, jump, kink in zip(positions, jumps, slope_jumps, strict=True)
            if jump or kink
        ]

    def farthest(self) -> tuple[float, float]:
        """Return the place x and the value of a spline farthest outside the range of its points' values, between these
        points. A place within the range is returned if the spline stays there. Pieces are sampled at ninths."""
        share = np.arange(1, 9) / 9.0
        local = np.diff(self.breaks)[:, np.newaxis] * share
        value = np.polynomial.polynomial.polyval(local, self.coefficients.T[..., np.newaxis], tensor=False)
        beyond = np.maximum(value - np.max(self.y), np.min(self.y) - value)
        piece, number = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
        return float(self.breaks[piece] + local[piece, number]), float(value[piece, number])

    def __call__(self, x: ArrayLike, derivative: int = 0) -> NDArray[Any]:
        """Return the curve, or a derivative of the curve, at x (...), in the shape of x; NaN outside a curve of
        ``error``. Complex x is for complex-step differentiation."""
        x = np.asarray(x)
        if np.iscomplexobj(x):
            real: NDArray[Any] = self(x.real, derivative) + 1j * x.imag * self(x.real, derivative + 1)
            return real
        breaks, pieces = self.breaks, len(self.breaks) - 1
        start, end = breaks[0], breaks[-1]
        snapped = x + 8.0 * _EPSILON * np.abs(x)  # rounding before a break is the break
        if self.outside == "periodic":
            turns = np.floor((snapped - start) / (end - start)) * (end - start)
            x, snapped = x - turns, snapped - turns
        beyond = (snapped < start) | (snapped > end)
        piece = np.clip(np.searchsorted(breaks, snapped, side="right") - 1, 0, pieces - 1)
        inside = np.clip(x, start, end) if self.outside == "hold" else x
        local = inside - breaks[piece]
        value = np.zeros(np.shape(x))
        for power in range(self.coefficients.shape[1] - 1, derivative - 1, -1):
            factor = float(np.prod(np.arange(power - derivative + 1, power + 1)))
            value = value * local + factor * self.coefficients[piece, power]
        if self.outside == "hold":
            held = np.where(snapped < start, self.y[0], self.y[-1]) if derivative == 0 else 0.0
            value = np.where((snapped < start) | (snapped >= end), held, value)
        if self.outside == "error":
            margin = EDGE * (end - start)
            value = np.where(beyond & ((x < start - margin) | (x > end + margin)), np.nan, value)
        return value


@dataclass(frozen=True, eq=False)
class Pieces(Curve):
    """A curve given by polynomials between its points.

    Attributes
    ----------
    polynomials : (n - 1, degree + 1) coefficients in powers of x - (start of the piece), lowest first
    corners : as ``kinks`` returns them
    """

    polynomials: Array = field(kw_only=True)
    corners: tuple[tuple[float, int], ...] = field(default=(), kw_only=True)

    @property
    def breaks(self) -> Array:
        return self.x

    @property
    def coefficients(self) -> Array:
        return self.polynomials

    def kinks(self) -> list[tuple[float, int]]:
        """Return the points at which the curve is not smooth: (x, lowest derivative that jumps)."""
        return list(self.corners)


def _quintic(x: Array, y: Array, outside: Outside, *, smooth_ends: bool) -> Array:
    """Return the coefficients, (pieces, 6), lowest power first, of an interpolating quintic spline in powers of the
    distance from a piece's start; (1, 2) for two points of ``error``. ``outside`` and ``smooth_ends`` as of
    ``Curve``."""
    # slow to import, and needed only when deriving
    from scipy.interpolate import PPoly, make_interp_spline  # noqa: PLC0415

    ends: Any = "periodic"
    if outside == "hold":
        ends = ([(1, 0.0), (2, 0.0)], [(1, 0.0), (2, 0.0)])
    elif outside == "error" and smooth_ends:
        ends = None  # SciPy leaves out the breaks next to the ends
    elif outside == "error":
        ends = ([(3, 0.0), (4, 0.0)], [(3, 0.0), (4, 0.0)])
    if outside == "error" and len(x) == 2:
        return np.array([[y[0], (y[1] - y[0]) / (x[1] - x[0])]])
    if outside == "periodic":
        y = np.append(y[:-1], y[0])
    spline: Any = make_interp_spline(x, y, k=5, bc_type=ends)
    if ends is None:  # Taylor's at every break, also at breaks that the spline leaves out
        return np.stack([spline(x[:-1], power) / math.factorial(power) for power in range(6)], axis=1)
    pieces = PPoly.from_spline(spline)
    piece = np.searchsorted(pieces.x, x[:-1], side="right") - 1  # from_spline keeps empty pieces at the ends
    return np.ascontiguousarray(pieces.c[::-1, piece].T)


AnyCurve = Curve | Bump | Waves
