"""Recurrence of the Taylor coefficients in time of all operations on a tape, order by order.

Unlike ``jets``, which records every order, this records two functions: the values at order 0, and coefficient k from
lower coefficients. Nonlinear operations make products with inner sums, sum_{i=1}^{k-1} left_i right_{k-i}, of
coefficients of lower orders only; a driver computes all of them before coefficient k is asked for. The remaining
operations are linear and the same for every k. Functions of arguments linear in time, as regular waves, need no sum:
their coefficient k is a multiple of coefficient k - 1 of their slope. Recurrences: Griewank and Walther, Evaluating
Derivatives (2008), table 13.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from eomgen.symbolic.branches import choose, common_condition, note, plus, times, zero_unless
from eomgen.symbolic.edges import logarithm_of_base
from eomgen.symbolic.operations import ELEMENTARY, CurveLike, InputSymbol, Op
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape, quotient, record

#: Blocks that coefficient k depends on, besides the coefficients k given by the caller: inner sums, order 0 of
#: both factors of the products, values kept from order 0, coefficients k - 1 of slopes, and (k, 1/k, h/(k + 1), h) with
#: coefficient 1 of time, h.
SUMS, LEFT, RIGHT, KEPT, PREVIOUS, ORDER = "sums", "left", "right", "kept", "previous", "order"


class SeriesTerm(NamedTuple):
    """A quantity: the value at order 0 and the coefficient k, as references of the two functions."""

    value: Ref
    next: Ref


class Series:
    """Records the Taylor recurrences of operations as two functions: the values at order 0, and coefficient k.

    Attributes
    ----------
    tape : Tape
        Both functions are recorded here; coefficient k reads the blocks named in this module.
    left, right : lists of SeriesTerm
        Factors of the products, by number.
    kept : list of Ref
        Values of order 0 that coefficient k reads as components of ``KEPT``.
    previous : list of SeriesTerm
        Slopes; coefficient k reads the coefficients k - 1 of slopes as components of ``PREVIOUS``.
    time : Ref, optional
        Coefficient k of time, which has none beyond the first.
    """

    def __init__(self, tape: Tape, time: Ref | None = None) -> None:
        self.tape, self.time = tape, time
        self.left: list[SeriesTerm] = []
        self.right: list[SeriesTerm] = []
        self.kept: list[Ref] = []
        self.previous: list[SeriesTerm] = []
        self._slots: dict[Ref, Ref] = {}
        self._pairs: dict[tuple[bool, SeriesTerm], tuple[SeriesTerm, SeriesTerm]] = {}
        self.k, self.per_k, self.step = (tape.input(ORDER, index) for index in (0, 1, 3))

    # -- products ----------------------------------------------------------------------------------------------------

    def keep(self, value: Ref) -> Ref:
        """Return the reference by which coefficient k reads a value of order 0: an input of ``KEPT``, or the constant
        itself."""
        if self.tape.number(value) is not None:
            return value
        if value < 0:
            return -self.keep(-value)
        if value not in self._slots:
            self._slots[value] = self.tape.input(KEPT, len(self.kept))
            self.kept.append(value)
        return self._slots[value]

    def open_product(self) -> int:
        """Return the number of a product; ``close_product`` adds the factors later."""
        self.left.append(SeriesTerm(ZERO, ZERO))
        self.right.append(SeriesTerm(ZERO, ZERO))
        return len(self.left) - 1

    def close_product(self, number: int, left: SeriesTerm, right: SeriesTerm) -> None:
        self.left[number], self.right[number] = left, right

    def inner(self, number: int) -> Ref:
        """Return the inner sum of a product."""
        return self.tape.input(SUMS, number)

    def first(self, side: str, number: int, term: SeriesTerm) -> Ref:
        """Return the reference by which coefficient k reads the order 0 of a factor: a constant, or a place in row
        0."""
        return term.value if self.tape.number(term.value) is not None else self.tape.input(side, number)

    def rate_factor(self, term: SeriesTerm) -> SeriesTerm:
        """Return k x_k as a factor: the rate of x, shifted by one."""
        return SeriesTerm(ZERO, self.tape.mul(self.k, term.next))

    # -- quantities linear in time -----------------------------------------------------------------------------------

    def rate(self, x: SeriesTerm) -> Ref | None:
        """Return the reference by which coefficient k reads dx/dt if x is linear in time, else None."""
        return self._rate(x.next) if self.time is not None else None

    def _rate(self, ref: Ref) -> Ref | None:
        """Return the constant rate of a reference that is linear in time; None for other references."""
        tape = self.tape
        if ref < 0:
            rate = self._rate(-ref)
            return None if rate is None else -rate
        if ref == self.time:
            return ONE
        op = tape.op[ref]
        if op not in (Op.ADD, Op.SUB, Op.MUL):
            return None
        first, second = tape.operands(ref)
        if op is Op.MUL:
            factor, operand = (first, second) if self._is_steady(first) else (second, first)
            rate = self._rate(operand) if self._is_steady(factor) else None
            return None if rate is None else tape.mul(factor, rate)
        rates = self._rate(first), self._rate(second)
        if rates[0] is None or rates[1] is None:
            return None
        return tape.add(rates[0], rates[1] if op is Op.ADD else -rates[1])

    def _is_steady(self, ref: Ref) -> bool:
        symbol = self.tape.symbol(abs(ref))
        return self.tape.number(ref) is not None or (symbol is not None and symbol.block == KEPT)

    def _after(self, rate: Ref, slope: SeriesTerm) -> Ref:
        """Return coefficient k of z with z' = slope * rate, for a constant rate; the slope is appended to
        ``previous``."""
        before = self.tape.input(PREVIOUS, len(self.previous))
        self.previous.append(slope)
        return self.tape.mul(self.tape.mul(self.per_k, self.tape.mul(self.step, rate)), before)

    # -- linear operations ------------------------------------------------------------------------------------------

    def constant(self, value: float) -> SeriesTerm:
        return SeriesTerm(self.tape.constant(value), ZERO)

    def add(self, x: SeriesTerm, y: SeriesTerm) -> SeriesTerm:
        return SeriesTerm(self.tape.add(x.value, y.value), plus(self.tape, x.next, y.next))

    def negative(self, x: SeriesTerm) -> SeriesTerm:
        return SeriesTerm(*(ref if ref == ZERO else -ref for ref in x))

    def scale(self, factor: Ref, x: SeriesTerm) -> SeriesTerm:
        """Return a value that does not change in time, times x."""
        return SeriesTerm(
            self.tape.mul(factor, x.value), times(self.tape, self.keep(factor), x.next) if x.next != ZERO else ZERO
        )

    # -- nonlinear operations -----------------------------------------------------------------------------------------

    def multiply(self, x: SeriesTerm, y: SeriesTerm) -> SeriesTerm:
        if ZERO in (x.next, y.next):
            return self.scale(x.value, y) if x.next == ZERO else self.scale(y.value, x)
        tape, number = self.tape, self.open_product()
        self.close_product(number, x, y)
        rest = tape.mul(self.first(LEFT, number, x), y.next)
        if x == y:
            rest = tape.mul(tape.constant(2.0), rest)
        else:
            rest = tape.add(rest, tape.mul(self.first(RIGHT, number, y), x.next))
        change = tape.add(self.inner(number), rest)
        note(tape, change, common_condition(tape, (x.next, y.next)))
        return SeriesTerm(tape.mul(x.value, y.value), change)

    def divide(self, x: SeriesTerm, y: SeriesTerm) -> SeriesTerm:
        """Return the term of z = x / y, by z y = x."""
        tape = self.tape
        value, reciprocal = tape.div(x.value, y.value), self.keep(tape.div(ONE, y.value))
        if y.next == ZERO:
            return SeriesTerm(value, tape.mul(reciprocal, x.next))
        number = self.open_product()
        last = tape.add(self.inner(number), tape.mul(y.next, self.first(RIGHT, number, SeriesTerm(value, ZERO))))
        z = SeriesTerm(value, tape.mul(reciprocal, tape.sub(x.next, last)))
        self.close_product(number, y, z)
        return z

    def sqrt(self, x: SeriesTerm) -> SeriesTerm:
        """Return the term of z = sqrt(x), by z z = x."""
        tape = self.tape
        value = tape.call(Op.SQRT, x.value)
        half = self.keep(tape.root_slope(x.value, value))
        number = self.open_product()
        change = tape.mul(half, tape.sub(x.next, self.inner(number)))
        z = SeriesTerm(value, zero_unless(tape, common_condition(tape, [x.next]), change))
        self.close_product(number, z, z)
        return z

    def sine_and_cosine(self, x: SeriesTerm, *, hyperbolic: bool = False) -> tuple[SeriesTerm, SeriesTerm]:
        """Return the terms of sine s and cosine c of x, recorded once: s' = c x', c' = -s x', or + if hyperbolic."""
        if (hyperbolic, x) not in self._pairs:
            self._pairs[hyperbolic, x] = self._pair(x, hyperbolic)
        return self._pairs[hyperbolic, x]

    def _pair(self, x: SeriesTerm, hyperbolic: bool) -> tuple[SeriesTerm, SeriesTerm]:
        """Record the terms of sine and cosine of x, circular or hyperbolic, and return both."""
        ops = (Op.SINH, Op.COSH) if hyperbolic else (Op.SIN, Op.COS)
        values = [self.tape.call(op, x.value) for op in ops]
        if x.next == ZERO:
            return SeriesTerm(values[0], ZERO), SeriesTerm(values[1], ZERO)
        if (rate := self.rate(x)) is not None:
            first = len(self.previous)
            sine = SeriesTerm(values[0], self._after(rate, SeriesTerm(values[1], ZERO)))
            cosine = SeriesTerm(values[1], self._after(rate if hyperbolic else -rate, sine))
            self.previous[first] = cosine
            return sine, cosine
        numbers = (self.open_product(), self.open_product())
        rates = [
            self._from_derivative(number, x, SeriesTerm(partner, ZERO))
            for number, partner in zip(numbers, reversed(values), strict=True)
        ]
        sine = SeriesTerm(values[0], rates[0])
        cosine = SeriesTerm(values[1], rates[1] if hyperbolic else -rates[1])
        for number, partner in zip(numbers, (cosine, sine), strict=True):
            self.close_product(number, self.rate_factor(x), partner)
        return sine, cosine

    def from_slope(self, value: Ref, x: SeriesTerm, slope: SeriesTerm) -> SeriesTerm:
        """Return the term of z with z' = slope x', for a slope that does not depend on z; ``value`` is z at order 0."""
        if (rate := self.rate(x)) is not None:
            return SeriesTerm(value, self._after(rate, slope))
        number = self.open_product()
        z = SeriesTerm(value, self._from_derivative(number, x, slope))
        self.close_product(number, self.rate_factor(x), slope)
        return z

    def exponential(self, x: SeriesTerm) -> SeriesTerm:
        return self.exponential_of(self.tape.call(Op.EXP, x.value), x)

    def exponential_of(self, value: Ref, x: SeriesTerm) -> SeriesTerm:
        """Return the term of z with z' = z x'; ``value`` is z at order 0."""
        if (rate := self.rate(x)) is not None:
            z = SeriesTerm(value, self._after(rate, SeriesTerm(value, ZERO)))
            self.previous[-1] = z
            return z
        number = self.open_product()
        z = SeriesTerm(value, self._from_derivative(number, x, SeriesTerm(value, ZERO)))
        self.close_product(number, self.rate_factor(x), z)
        return z

    def tangent(self, x: SeriesTerm, op: Op) -> SeriesTerm:
        """Return the term of tan x or tanh x (``op``): z' = w x' with w = 1 + z^2, or 1 - z^2 if hyperbolic."""
        tape, sign = self.tape, ONE if op is Op.TAN else -ONE
        value = tape.call(op, x.value)
        slope_value = tape.add(ONE, tape.mul(sign, tape.mul(value, value)))
        number = self.open_product()
        z = SeriesTerm(value, self._from_derivative(number, x, SeriesTerm(slope_value, ZERO)))
        square = self.multiply(z, z)
        self.close_product(number, self.rate_factor(x), SeriesTerm(slope_value, tape.mul(sign, square.next)))
        return z

    def over(self, value: Ref, rate_of: SeriesTerm, w: SeriesTerm) -> SeriesTerm:
        """Return the term of z with z' w = x' (x is ``rate_of``), for a w that does not depend on z; ``value`` is z at
        order 0."""
        tape = self.tape
        reciprocal = self.keep(quotient(tape, ONE, w.value, w.value))
        if w.next == ZERO:
            return SeriesTerm(value, tape.mul(reciprocal, rate_of.next))
        number = self.open_product()
        change = tape.mul(reciprocal, tape.sub(rate_of.next, tape.mul(self.per_k, self.inner(number))))
        z = SeriesTerm(value, zero_unless(tape, common_condition(tape, [rate_of.next]), change))
        self.close_product(number, self.rate_factor(z), w)
        return z

    def angle(self, y: SeriesTerm, x: SeriesTerm) -> SeriesTerm:
        """Return the term of z = atan2(y, x), by z' (x^2 + y^2) = x y' - y x'."""
        tape = self.tape
        numerator = ZERO
        for rate, factor, sign in ((y, x, ONE), (x, y, -ONE)):
            if rate.next == ZERO:
                continue
            number = self.open_product()
            self.close_product(number, self.rate_factor(rate), factor)
            numerator = tape.add(numerator, tape.mul(sign, self._from_derivative(number, rate, factor)))
        square = self.add(self.multiply(x, x), self.multiply(y, y))
        return self.over(tape.call(Op.ATAN2, y.value, x.value), SeriesTerm(ZERO, numerator), square)

    def power(self, x: SeriesTerm, exponent: SeriesTerm) -> SeriesTerm:
        """Return the term of x^exponent = exp(exponent log x); the value at order 0 is computed by the power."""
        logarithm = self.multiply(exponent, self.over(logarithm_of_base(self.tape, x.value), x, x))
        return self.exponential_of(self.tape.call(Op.POW, x.value, exponent.value), logarithm)

    def logarithm(self, x: SeriesTerm) -> SeriesTerm:
        return self.over(self.tape.call(Op.LOG, x.value), x, x)

    def curve(self, curve: CurveLike, derivative: int, x: SeriesTerm) -> SeriesTerm:
        """Return the term of a derivative (0: the value) of a curve at x; constant from the degree of the polynomials
        on. The rate is the next derivative times the rate of x."""
        value = self.tape.curve(curve, derivative, x.value)
        if x.next == ZERO or derivative >= curve.coefficients.shape[1] - 1:
            return SeriesTerm(value, ZERO)
        return self.from_slope(value, x, self.curve(curve, derivative + 1, x))

    def chosen(self, op: Op, operands: Sequence[SeriesTerm]) -> SeriesTerm:
        """Return the term of an operation that is not smooth; coefficient k follows the branch taken at order 0."""
        tape = self.tape
        values = [term.value for term in operands]
        if op is Op.SELECT:
            branch = self.keep(values[0])
            return SeriesTerm(tape.select(*values), choose(tape, branch, operands[1].next, operands[2].next))
        value = tape.call(op, *values)
        if op is Op.ABS:
            return SeriesTerm(value, tape.mul(self.keep(tape.call(Op.SIGN, values[0])), operands[0].next))
        if op in (Op.MIN, Op.MAX):
            first = values if op is Op.MIN else values[::-1]
            branch = self.keep(tape.call(Op.LE, *first))
            return SeriesTerm(value, choose(tape, branch, operands[0].next, operands[1].next))
        return SeriesTerm(value, ZERO)

    def _from_derivative(self, number: int, x: SeriesTerm, slope: SeriesTerm) -> Ref:
        """Return coefficient k of z with z' = slope x', from product ``number`` of k x_k and the slope. The result
        contains only coefficients of the slope below k."""
        tape = self.tape
        last = tape.mul(x.next, self.first(RIGHT, number, slope))
        return tape.add(tape.mul(self.per_k, self.inner(number)), last)


def record_series(
    series: Series,
    source: Tape,
    outputs: Sequence[Ref],
    inputs: Mapping[InputSymbol, SeriesTerm],
    node_terms: dict[int, SeriesTerm],
) -> list[SeriesTerm]:
    """Record the recurrence of the outputs of a tape, and return the term of each output. ``inputs`` are the terms of
    inputs that vary in time; other inputs are constant. Maps must have been unrolled. ``node_terms`` holds the terms of
    nodes that were recorded before, and is completed in place."""

    def term(ref: Ref) -> SeriesTerm:
        return node_terms[abs(ref)] if ref > 0 else series.negative(node_terms[abs(ref)])

    for node in source.live(outputs):
        op = source.op[node]
        if node in node_terms:
            continue
        if op is Op.CONST:
            node_terms[node] = SeriesTerm(series.tape.copied_constant(source, node), ZERO)
        elif op is Op.INPUT:
            symbol = source.inputs[source.a[node]]
            node_terms[node] = inputs.get(symbol) or SeriesTerm(series.tape.input(symbol.block, symbol.index), ZERO)
        elif op is Op.CURVE:
            node_terms[node] = series.curve(*source.curves[source.b[node]], term(source.a[node]))
        else:
            node_terms[node] = record_term(series, op, [term(ref) for ref in source.operands(node)])
    return [term(ref) for ref in outputs]


#: Operations that a Series has a function of that name for.
_SIMPLE = {Op.ADD: "add", Op.MUL: "multiply", Op.DIV: "divide", Op.POW: "power", Op.ATAN2: "angle"}


def record_term(series: Series, op: Op, operands: Sequence[SeriesTerm]) -> SeriesTerm:
    """Record one operation that is neither a leaf nor a curve, and return the term; constant for constant operands."""
    tape, x = series.tape, operands[0]
    if all(operand.next == ZERO for operand in operands):
        return SeriesTerm(record(tape, op, [operand.value for operand in operands]), ZERO)
    recorded: SeriesTerm
    if op in ELEMENTARY:
        recorded = ELEMENTARY[op].series(series, x)
        return recorded
    if op in _SIMPLE:
        recorded = getattr(series, _SIMPLE[op])(*operands)
        return recorded
    if op is Op.SUB:
        return series.add(x, series.negative(operands[1]))
    return series.chosen(op, operands)
