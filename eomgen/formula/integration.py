"""Second integrals over time of accelerations given as formulas, from rest at t = 0.

An acceleration is a sum of terms, each a formula without the time times a function of time. Integrals of constants,
sines and cosines are formulas. Integrals of curves through points are curves: a polynomial between two points has a
polynomial as integral, so that is exact. Any other function is replaced by polynomials of degree 7 (at Gauss-Legendre
nodes, in intervals that are halved until the polynomials fit), with an estimate of the error from values between the
nodes. Position, velocity and acceleration are derivatives of one formula, so they agree to rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import SUMMED
from eomgen.errors import DescriptionError
from eomgen.formula.curves import Curve, Pieces
from eomgen.formula.discontinuities import Breakpoint, affine, breakpoints
from eomgen.formula.evaluate import OTHER_VALUES, evaluate, evaluate_batch, symbols
from eomgen.formula.nodes import ZERO, Application, Formula, Number, Operation, Symbol
from eomgen.formula.prescribed_motion import constant
from eomgen.formula.substitution import product, substitute, total

_NODES = 8
_MOST_PIECES = 50_000
_HALVINGS = 40


class IntegrationError(DescriptionError):
    """An acceleration that cannot be integrated."""


@dataclass(frozen=True)
class SecondIntegral:
    """A second integral over time that is at rest in 0 at t = 0.

    Attributes
    ----------
    formula : of the displacement, m
    velocity, displacement : drift at the time ``end``: values of a record's integral there; of a periodic acceleration
        the motion without the oscillation; none of a constant
    end : last time of a record, else of the run
    correction : largest acceleration that was added against the drift
    error : estimate of the error of the displacement's rate by quadrature, from values between the nodes
    onward : acceleration that records hold after their last points, if the run goes on
    """

    formula: Formula
    velocity: float = 0.0
    displacement: float = 0.0
    end: float = 0.0
    correction: float = 0.0
    error: float = 0.0
    onward: float = 0.0

    def __add__(self, other: SecondIntegral) -> SecondIntegral:
        return SecondIntegral(
            total(self.formula, other.formula),
            self.velocity + other.velocity,
            self.displacement + other.displacement,
            max(self.end, other.end),
            self.correction + other.correction,
            self.error + other.error,
            self.onward + other.onward,
        )

    def scale(self, factor: Formula, value: float) -> SecondIntegral:
        """Return the integral times ``factor``, a formula of parameters whose value at the default parameters is
        ``value``."""
        size = abs(value)
        return SecondIntegral(
            product(factor, self.formula),
            value * self.velocity,
            value * self.displacement,
            self.end,
            size * self.correction,
            size * self.error,
            value * self.onward,
        )


@dataclass(frozen=True)
class Integration:
    """Second integrals of accelerations over time, from rest in 0 at t = 0, with the data of the scene that they need.

    Attributes
    ----------
    name : key of the acceleration
    parameters : value of each parameter, at the default if tunable
    tunable : names of the tunable parameters
    duration : of the run, s: up to there formulas are integrated by quadrature
    corrected : whether drift is removed: of a record by a straight line in its acceleration, so that it ends at rest at
        the place of its begin; of a periodic acceleration its mean and the mean of its velocity
    """

    name: str
    parameters: Mapping[str, float]
    tunable: frozenset[str]
    duration: float
    corrected: bool

    def integral(self, acceleration: Formula) -> SecondIntegral:
        """Return the second integral of an acceleration, a formula of time and parameters, as the sum over all terms.

        Raises
        ------
        IntegrationError
            A term that has no integral here.
        """
        result = SecondIntegral(ZERO)
        try:
            for factor, function in _terms(acceleration):
                known = self._fold(factor)
                if known != Number(0.0):
                    result += self._integrate_term(function).scale(known, self._value(known))
        except ArithmeticError as error:
            raise IntegrationError(f"at the default parameters, {error} [E0292]", OTHER_VALUES) from None
        return result

    def _fold(self, formula: Formula) -> Formula:
        """Return a formula with numbers in place of fixed parameters."""
        return substitute(formula, self._fixed_value)

    def _value(self, formula: Formula) -> float:
        """Return a formula of parameters at their defaults."""
        return evaluate(formula, lambda symbol: self.parameters[symbol.name])

    def _integrate_term(self, function: Formula) -> SecondIntegral:
        if isinstance(function, Number):
            return self._integrate_constant(function.value)
        line = self._line(function)
        if isinstance(function, Operation) and line is not None:
            return self._integrate_sine(function, *line)
        if isinstance(function, Application) and line is not None and isinstance(function.curve, Curve):
            slope, start = (part.value for part in line if isinstance(part, Number))
            if not function.derivative and slope > 0.0:
                return self._integrate_curve(function.curve, function.argument, slope, start)
        return self._by_quadrature(function)

    def _integrate_constant(self, value: float) -> SecondIntegral:
        if self.corrected:
            raise IntegrationError("a constant acceleration is all drift, and would be removed [E0293]", _KEEP)
        time = Symbol("time")
        return SecondIntegral(product(Number(0.5 * value), time * time), end=self.duration)

    def _line(self, function: Formula) -> tuple[Formula, Formula] | None:
        """Return a and b for a curve, a sine or a cosine whose argument is a t + b, as formulas of tunable parameters,
        for curves as numbers; None for other functions, other arguments and a = 0."""
        if isinstance(function, Application):
            line = affine(function.argument, self._fixed_value)
            return None if line is None or line[0] == 0.0 else (Number(line[0]), Number(line[1]))
        if not isinstance(function, Operation) or function.name not in ("sin", "cos"):
            return None
        argument = function.arguments[0]
        values = affine(argument, lambda symbol: self.parameters.get(symbol.name))
        if values is None or values[0] == 0.0:
            return None
        at_zero, at_one = (_at_time(argument, time, self._fixed_value) for time in (0.0, 1.0))
        return total(at_one, product(Number(-1.0), at_zero)), at_zero

    def _fixed_value(self, symbol: Symbol) -> float | None:
        """Return the number of a fixed parameter; None for the time and for tunable parameters."""
        known = symbol.kind == "parameter" and symbol.name not in self.tunable
        return self.parameters[symbol.name] if known else None

    def _integrate_sine(self, function: Operation, rate: Formula, phase: Formula) -> SecondIntegral:
        """Return the second integral of sin(rate t + phase), or of the cosine, from rest at t = 0; with a drift unless
        drift is removed."""
        sine = function.name == "sin"
        at_start = self._fold(Operation(function.name, (phase,)))
        oscillation = product(self._fold(Number(1.0) / (rate * rate)), at_start - function)
        cofunction = Operation("cos" if sine else "sin", (phase,))
        drift = self._fold(cofunction / (rate if sine else -rate))  # the velocity of the oscillation at t = 0, reversed
        if self.corrected or (isinstance(drift, Number) and drift.value == 0.0):
            return SecondIntegral(oscillation, end=self.duration)
        value, end = self._value(drift), self.duration
        return SecondIntegral(oscillation + product(drift, Symbol("time")), value, value * end, end)

    def _integrate_curve(
        self, curve: Curve, argument: Formula, slope: float, start: float, error: float = 0.0
    ) -> SecondIntegral:
        """Return the second integral of a curve at ``slope`` t + ``start``, which is ``argument``, from rest at t = 0;
        ``error`` is the estimate for the curve's own values. Raises IntegrationError for a curve without a value at t =
        0."""
        if curve.outside == "error" and not curve.start <= start < curve.end:
            fault = (
                f"{curve.name} has values from {curve.start:.6g} to {curve.end:.6g}, and its argument is {start:.6g}"
            )
            hint = 'outside = "hold" of the curve, or an argument within its points at t = 0, the start of the base'
            raise IntegrationError(f"{fault} at t = 0 [E0294]", hint)
        scale = 1.0 / (slope * slope)
        if curve.outside == "periodic":
            return self._integrate_periodic(curve, argument, slope, start)
        corrected = self.corrected and start < curve.end
        made, correction = _second_integral(curve, start, f"the integral of {curve.name}", corrected=corrected)
        last = curve.end if start < curve.end else start + slope * self.duration
        velocity, displacement = (0.0, 0.0) if corrected else (float(made(last, 1)) / slope, float(made(last)) * scale)
        formula = product(Number(scale), Application(made, argument))
        end = (last - start) / slope
        onward = curve.end_values[1] if curve.outside == "hold" and not corrected and end < self.duration else 0.0
        return SecondIntegral(formula, velocity, displacement, end, correction, error, onward)

    def _integrate_periodic(self, curve: Curve, argument: Formula, slope: float, start: float) -> SecondIntegral:
        oscillation, mean = _periodic_integral(curve, f"the integral of {curve.name}")
        scale, time = 1.0 / (slope * slope), Symbol("time")
        formula = product(Number(scale), Application(oscillation, argument) - Number(float(oscillation(start))))
        if self.corrected:
            return SecondIntegral(formula, end=self.duration, correction=abs(mean))
        drift = -float(oscillation(start, 1)) / slope
        end = self.duration
        moved = formula + product(Number(drift), time) + product(Number(0.5 * mean), time * time)
        return SecondIntegral(moved, drift + mean * end, drift * end + 0.5 * mean * end * end, end)

    def _by_quadrature(self, function: Formula) -> SecondIntegral:
        """Return the second integral of a function of time by polynomials that are fitted up to the end of the run.
        Raises IntegrationError for a function of tunable parameters, and as ``_fit``."""
        names = sorted({symbol.name for symbol in symbols(function)} & self.tunable)
        if names:
            fault = (
                f"the tunable parameter {names[0]} is within a function that is integrated when the scene is"
                f" read [E0295]"
            )
            hint = f"a factor {names[0]} of a function of t, a fixed parameter, or position, a formula of both"
            raise IntegrationError(fault, hint)

        def values(t: Array) -> Array:
            def value_of(symbol: Symbol) -> Array | float:
                return t if symbol.kind == "time" else self.parameters[symbol.name]

            return np.broadcast_to(evaluate_batch(function, value_of, along_motion=True), t.shape)

        corners = {time for point in breakpoints(function, self._fixed_value) for time in self._within(point)}
        made, error = _fit(
            f"{self.name} (to simulation.duration)", values, np.array([0.0, *sorted(corners), self.duration])
        )
        return self._integrate_curve(made, Symbol("time"), 1.0, 0.0, error)

    def _within(self, point: Breakpoint) -> Iterator[float]:
        """Yield the times of a breakpoint within the run."""
        times = [point.time]
        if point.period:
            first = math.ceil(-point.time / point.period)
            number = min(int(self.duration / point.period) + 2, _MOST_PIECES)
            times = [point.time + point.period * (first + turn) for turn in range(number)]
        yield from (time for time in times if 0.0 < time < self.duration)


_ONE = Number(1.0)
_KEEP = 'drift = "keep", or position for a motion that is meant'


def _at_time(formula: Formula, time: float, value_of: Callable[[Symbol], float | None]) -> Formula:
    return substitute(formula, lambda symbol: time if symbol.kind == "time" else value_of(symbol))


def _terms(formula: Formula) -> Iterator[tuple[Formula, Formula]]:
    """Yield the terms of a sum as pairs (factor without the time, function of the time); the function is 1 for a term
    without the time."""
    if constant(formula):
        yield formula, _ONE
        return
    if isinstance(formula, Operation):
        first, last = formula.arguments[0], formula.arguments[-1]
        if formula.name in ("add", "sub"):
            yield from _terms(first)
            yield from _times(Number(1.0 if formula.name == "add" else -1.0), last)
            return
        if formula.name == "neg":
            yield from _times(Number(-1.0), first)
            return
        if formula.name == "mul" and (constant(first) or constant(last)):
            yield from _times(first, last) if constant(first) else _times(last, first)
            return
        if formula.name == "div" and constant(last):
            yield from _times(Number(1.0) / last, first)
            return
    yield _ONE, formula


def _times(factor: Formula, formula: Formula) -> Iterator[tuple[Formula, Formula]]:
    for term, function in _terms(formula):
        yield product(factor, term), function


@dataclass(frozen=True)
class _RateCurve:
    """An acceleration as polynomials between ``breaks`` (n + 1,), with ``coefficients`` (n, degree + 1) in powers of
    the distance from the start of each piece, lowest first."""

    breaks: Array
    coefficients: Array

    @cached_property
    def integrals(self) -> tuple[Array, Array]:
        """Velocities and displacements at the breaks, from 0 at the first one."""
        h, powers = np.diff(self.breaks)[:, np.newaxis], np.arange(self.coefficients.shape[1])
        gained = np.sum(self.coefficients * h ** (powers + 1) / (powers + 1), axis=1)
        velocity = np.append(0.0, np.cumsum(gained))
        moved = np.sum(self.coefficients * h ** (powers + 2) / ((powers + 1) * (powers + 2)), axis=1)
        return velocity, np.append(0.0, np.cumsum(moved + velocity[:-1] * h[:, 0]))

    def displacement(self, velocity: Array, displacement: Array) -> Array:
        """Return the coefficients of the second integral with given values at the breaks."""
        powers = np.arange(self.coefficients.shape[1])
        double = self.coefficients / ((powers + 1) * (powers + 2))
        return np.column_stack([displacement[:-1], velocity[:-1], double])


def _second_integral(curve: Curve, start: float, name: str, *, corrected: bool) -> tuple[Curve, float]:
    """Return the second integral of a curve over the argument, named ``name``, from rest at ``start``, and the largest
    acceleration of the correction. ``corrected``: drift is removed, so that the end is at rest in 0."""
    rates = _RateCurve(curve.breaks, curve.coefficients)
    if curve.outside == "hold":
        rates = _extend_curve(curve, start, corrected=corrected)
    largest = 0.0
    if corrected:
        velocity, displacement = _from(rates, start)
        rates, largest = _straighten(rates, max(start, curve.start), velocity[-1], displacement[-1])
    velocity, displacement = _from(rates, start)
    if corrected:
        velocity[-1] = displacement[-1] = 0.0
    corners = [(position, order + 2) for position, order in curve.kinks()]
    if corrected:
        corners += [(float(curve.end), 2)]
    polynomials = rates.displacement(velocity, displacement)
    integral = Pieces(
        name, rates.breaks, displacement, "quintic", curve.outside, polynomials=polynomials, corners=tuple(corners)
    )
    return integral, largest


def _extend_curve(curve: Curve, start: float, *, corrected: bool) -> _RateCurve:
    """Return the polynomials of a curve that holds the end values, with a piece from ``start`` to the first point, if
    that is later, and a long piece after the last point unless ``corrected``."""
    first, last = curve.end_values
    breaks, coefficients = curve.breaks, curve.coefficients
    constants = np.zeros((1, coefficients.shape[1]))
    if start < curve.start:
        breaks, coefficients = np.append(start, breaks), np.vstack([constants, coefficients])
        coefficients[0, 0] = first
    if not corrected:
        breaks = np.append(breaks, max(curve.end, start) + 1e9)  # a piece that holds the last value
        coefficients = np.vstack([coefficients, constants])
        coefficients[-1, 0] = last
    return _RateCurve(breaks, coefficients)


def _from(rates: _RateCurve, start: float) -> tuple[Array, Array]:
    """Return velocities and displacements at the breaks, (n + 1,) each, for rest in 0 at the argument ``start``."""
    velocity, displacement = rates.integrals
    breaks = rates.breaks
    piece = int(np.clip(np.searchsorted(breaks, start, side="right") - 1, 0, len(breaks) - 2))
    local = start - breaks[piece]
    row = rates.displacement(velocity, displacement)[piece]
    at, rate = (
        float(np.polynomial.polynomial.polyval(local, part)) for part in (row, row[1:] * np.arange(1, len(row)))
    )
    return velocity - rate, displacement - at - rate * (breaks - start)


def _straighten(rates: _RateCurve, start: float, velocity: float, displacement: float) -> tuple[_RateCurve, float]:
    """Return an acceleration plus a straight line from ``start`` to the end, by which the velocity and the displacement
    at the end decrease by the given values, and the largest absolute value of the line."""
    end = float(rates.breaks[-1])
    length = end - start
    offset = 2.0 * velocity / length - 6.0 * displacement / length**2
    slope = 12.0 * displacement / length**3 - 6.0 * velocity / length**2
    breaks = np.unique(np.append(rates.breaks, start))
    source = np.searchsorted(rates.breaks, breaks[:-1], side="right") - 1
    shifts = breaks[:-1] - rates.breaks[source]
    coefficients = np.zeros((len(source), max(2, rates.coefficients.shape[1])))
    coefficients[:, : rates.coefficients.shape[1]] = rates.coefficients[source]
    for row in np.flatnonzero(shifts):
        moved = np.polynomial.Polynomial(coefficients[row])(np.polynomial.Polynomial([shifts[row], 1.0]))
        coefficients[row, : len(moved.coef)] = moved.coef
    covered = breaks[:-1] >= start
    coefficients[covered, 0] += offset + slope * (breaks[:-1] - start)[covered]
    coefficients[covered, 1] += slope
    return _RateCurve(breaks, coefficients), max(abs(offset), abs(offset + slope * length))


def _periodic_integral(curve: Curve, name: str) -> tuple[Curve, float]:
    """Return the periodic part of the second integral of a periodic curve, named ``name``, without the curve's mean and
    the mean velocity, and the mean of the curve."""
    velocity, _ = _RateCurve(curve.breaks, curve.coefficients).integrals
    mean = float(velocity[-1]) / curve.period
    coefficients = curve.coefficients.copy()
    coefficients[:, 0] -= mean
    rates = _RateCurve(curve.breaks, coefficients)
    velocity, displacement = rates.integrals
    speed = float(displacement[-1]) / curve.period
    velocity, displacement = velocity - speed, displacement - speed * (curve.breaks - curve.start)
    corners = tuple((position, order + 2) for position, order in curve.kinks())
    polynomials = rates.displacement(velocity, displacement)
    return Pieces(
        name, curve.breaks, displacement, "quintic", "periodic", polynomials=polynomials, corners=corners
    ), mean


def _fit(name: str, values: Callable[[Array], Array], breaks: Array) -> tuple[Pieces, float]:
    """Return polynomials of degree 7 through a function between ``breaks``, and an estimate of the error when these are
    integrated; ``values`` takes and returns arrays (n, m).

    Raises
    ------
    IntegrationError
        A function without a value, or one that needs too many polynomials.
    """
    legendre = np.polynomial.legendre
    nodes, weights = legendre.leggauss(_NODES)
    aside = np.append(0.5 * (nodes[1:] + nodes[:-1]), [-1.0, 1.0]) * (1.0 - 1e-9)  # breaks may be jumps
    # coefficients of Legendre polynomials by quadrature: the inverse of a matrix of powers loses 1e-12 of the values
    project = ((np.arange(_NODES) + 0.5) * legendre.legvander(nodes, _NODES - 1) * weights[:, np.newaxis]).T
    beside = legendre.legvander(aside, _NODES - 1) @ project
    # P_n(2 x - 1) in powers of x, integers
    powers = [[(-1.0) ** (n + k) * math.comb(n, k) * math.comb(n + k, k) for k in range(_NODES)] for n in range(_NODES)]
    low, high = breaks[:-1], breaks[1:]
    pieces: list[tuple[Array, Array, Array]] = []
    scale = error = 0.0
    for halving in range(_HALVINGS):
        middle, half = 0.5 * (low + high)[:, np.newaxis], 0.5 * (high - low)[:, np.newaxis]
        at, between = values(middle + half * nodes), values(middle + half * aside)
        missing = ~np.isfinite(at).all(axis=1)
        if missing.any():
            time = float(middle[np.flatnonzero(missing)[0], 0])
            fault = f"the acceleration has no value near t = {time:.6g} s [E0296]"
            raise IntegrationError(fault, "a formula that has one throughout the run")
        scale = max(scale, float(np.max(np.abs(at))))
        missed = np.max(np.abs(between - at @ beside.T), axis=1)
        done = (missed <= SUMMED * scale) | (halving == _HALVINGS - 1)
        error += float(np.sum((missed * (high - low))[done]))
        pieces.append((low[done], high[done], at[done] @ project.T @ powers))
        if sum(len(part[0]) for part in pieces) + 2 * np.count_nonzero(~done) > _MOST_PIECES:
            fault = f"its integral needs more than {_MOST_PIECES} polynomials up to t = {breaks[-1]:.6g} s [E0297]"
            raise IntegrationError(fault, "a curve through points, a smoother formula, or a shorter duration")
        low, high, middle = low[~done], high[~done], middle[~done, 0]
        low, high = np.append(low, middle), np.append(middle, high)
        if not len(low):
            break
    starts, _, rows = (np.concatenate([part[index] for part in pieces]) for index in range(3))
    order = np.argsort(starts)
    ends = np.append(starts[order], breaks[-1])
    polynomials = rows[order] / np.diff(ends)[:, np.newaxis] ** np.arange(_NODES)
    at_breaks = np.append(polynomials[:, 0], np.sum(rows[order][-1]))
    corners = tuple((float(time), 0) for time in breaks[1:-1])
    return Pieces(name, ends, at_breaks, "quintic", "error", polynomials=polynomials, corners=corners), error
