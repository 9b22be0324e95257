"""Jets: truncated Taylor expansions in time of all values of a tape, recorded on the same tape.

A jet is the list of normalised coefficients x_k = x^(k) / k!. Recurrences: Griewank and Walther, Evaluating Derivatives
(2008), table 13.2. Input symbols own their jets: see ``configuration``.

If a function is not smooth, the branch taken at order 0 is followed (as in ``partials``). The recurrences of SQRT,
LOG, POW, ASIN, ACOS and ATAN2 have denominators that vanish at their singular points; norms that are 0 stay 0, see
``edges``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from eomgen.base.data import replace
from eomgen.symbolic.branches import choose, guarded_product, plus, times
from eomgen.symbolic.calculus.loops import map_jets
from eomgen.symbolic.external import Call, add_call
from eomgen.symbolic.operations import ELEMENTARY, CurveLike, InputSymbol, Op
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape, flat_zero, quotient, record

Jet = Sequence[Ref]


def jets(
    tape: Tape, outputs: Sequence[Ref], input_jets: Mapping[Ref | InputSymbol, Jet], order: int
) -> list[list[Ref]]:
    """Return the Taylor coefficients of outputs, given the coefficients of independent quantities.

    Parameters
    ----------
    input_jets : mapping from InputSymbol, or reference of a node, to [x_0, x_1, ...]
        Normalised coefficients, of which the first ``order`` + 1 are used; coefficients beyond the list are zero, and
        all other inputs are constant in time.
    order : int
        Highest power of time.

    Returns
    -------
    list of [c_0, ..., c_order]
        One per output; c_0 is the output unless inputs were substituted.
    """
    algebra = JetAlgebra(tape)
    seeds: dict[int, list[Ref]] = {}
    for key, input_jet in input_jets.items():
        ref = tape.input(key.block, key.index) if isinstance(key, InputSymbol) else key
        seeds[abs(ref)] = [tape.mul(ONE if ref > 0 else -ONE, coefficient(input_jet, k)) for k in range(order + 1)]
    node_jets: dict[int, list[Ref]] = {}
    of_maps: dict[int, list[list[Ref]]] = {}

    def jet(ref: Ref) -> list[Ref]:
        coefficients = node_jets[abs(ref)]
        return coefficients if ref > 0 else algebra.negative(coefficients)

    for node in tape.live(outputs):
        op = tape.op[node]
        if node in seeds:
            node_jets[node] = seeds[node]
        elif op in (Op.CONST, Op.INPUT):
            node_jets[node] = [node] + [ZERO] * order
        elif op is Op.MAP:
            number = tape.a[node]
            if number not in of_maps:
                called = tape.maps[number]
                if isinstance(called, Call):
                    of_maps[number] = algebra.call(called, [jet(ref) for ref in called.operands])
                else:
                    of_maps[number] = map_jets(tape, number, jet, order, jets)
            node_jets[node] = of_maps[number][tape.b[node]]
        elif op is Op.CURVE:
            curve, derivative = tape.curves[tape.b[node]]
            node_jets[node] = algebra.curve(curve, derivative, jet(tape.a[node]))
        else:
            operands = [jet(ref) for ref in tape.operands(node)]
            value = record(tape, op, [operand[0] for operand in operands])
            node_jets[node] = (
                algebra.apply(op, value, operands) if any(map(_varies, operands)) else [value] + [ZERO] * order
            )
    return [jet(ref) for ref in outputs]


def taylor_coefficients(tape: Tape, derivatives: Sequence[Ref]) -> list[Ref]:
    """Return the jet [x, x', x''/2, ...] of a quantity from the time derivatives [x, x', x'', ...]."""
    return [tape.mul(tape.constant(1.0 / math.factorial(k)), ref) for k, ref in enumerate(derivatives)]


def time_derivatives(tape: Tape, jet: Jet) -> list[Ref]:
    """Return the time derivatives [x, x', x'', ...] of a quantity from its jet."""
    return [tape.mul(tape.constant(float(math.factorial(k))), ref) for k, ref in enumerate(jet)]


def coefficient(jet: Jet, k: int) -> Ref:
    """Return coefficient k of a jet, 0 beyond the end."""
    return jet[k] if k < len(jet) else ZERO


class JetAlgebra:
    """Operations on jets, lists of Taylor coefficients of equal length, recorded on one tape."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self._sine_cosine: dict[tuple[bool, tuple[Ref, ...]], tuple[list[Ref], list[Ref]]] = {}

    def apply(self, op: Op, value: Ref, operands: Sequence[list[Ref]]) -> list[Ref]:
        """Return the jet of an operation from the jets of the operands. ``value`` is the reference of the result at
        order 0. Functions that are not smooth follow the branch taken at order 0."""
        tape, x = self.tape, operands[0]
        if op in ELEMENTARY:
            return ELEMENTARY[op].jet(self, x, value)
        match op:
            case Op.ADD:
                return self.add(x, operands[1])
            case Op.SUB:
                return self.add(x, self.negative(operands[1]))
            case Op.MUL:
                return self.multiply(x, operands[1])
            case Op.DIV:
                return self.divide(x, operands[1])
            case Op.ATAN2:
                return self.integrate(value, self._angle_rate(x, operands[1]))
            case Op.POW:
                return self._power(x, operands[1], value)
            case Op.ABS:
                return [value, *self.scale(tape.call(Op.SIGN, x[0]), x[1:])]
            case Op.MIN | Op.MAX | Op.SELECT:
                condition, (then, otherwise) = x[0], operands[-2:]
                if op is not Op.SELECT:
                    first, last = (then, otherwise) if op is Op.MIN else (otherwise, then)
                    condition = tape.call(Op.LE, first[0], last[0])
                pairs = zip(then[1:], otherwise[1:], strict=True)
                return [value, *(choose(tape, condition, p, q) for p, q in pairs)]
            case _:  # SIGN, LT and LE are flat
                return [value] + [ZERO] * (len(x) - 1)

    def curve(self, curve: CurveLike, derivative: int, x: Jet) -> list[Ref]:
        """Return the jet of a derivative (0: the value) of a curve at the jet x, of equal length. c' is the jet of the
        next derivative, one coefficient shorter, times x'."""
        value = self.tape.curve(curve, derivative, x[0])
        if not _varies(x):
            return [value] + [ZERO] * (len(x) - 1)
        return self.integrate(value, self.multiply(self.curve(curve, derivative + 1, x[:-1]), self.rate(x)))

    def call(self, call: Call, x: Sequence[Jet]) -> list[list[Ref]]:
        """Return the jets of all results if an external function is called with operands whose jets are ``x``. The
        rates of the results are slopes, one coefficient shorter, times rates of the operands."""
        values = add_call(self.tape, replace(call, operands=tuple(jet[0] for jet in x)))
        moving = [index for index, jet in enumerate(x) if _varies(jet)]
        if not moving:
            return [[value, *[ZERO] * (len(x[0]) - 1 if x else 0)] for value in values]
        derivative, columns = call.derivative(self.tape, moving)
        slopes = self.call(derivative, [jet[:-1] for jet in x])
        rates = {column: self.rate(x[column]) for column in columns}
        results = []
        for index, value in enumerate(values):
            total: list[Ref] = [ZERO] * (len(x[0]) - 1)
            for slope, column in zip(slopes[index * len(columns) :], columns, strict=False):
                total = self.add(total, self.multiply(slope, rates[column]))
            results.append(self.integrate(value, total))
        return results

    def scale(self, factor: Ref, x: Jet) -> list[Ref]:
        return [times(self.tape, factor, ref) for ref in x]

    def negative(self, x: Jet) -> list[Ref]:
        return self.scale(-ONE, x)

    def add(self, x: Jet, y: Jet) -> list[Ref]:
        return [plus(self.tape, p, q) for p, q in zip(x, y, strict=True)]

    def multiply(self, x: Jet, y: Jet) -> list[Ref]:
        """Return the product of two jets (Cauchy product), of the length of the jets."""
        if list(x) == list(y):
            return [self._square(x, k) for k in range(len(x))]
        return [self._convolution(x, y, k, 0, k) for k in range(len(x))]

    def divide(self, x: Jet, y: Jet) -> list[Ref]:
        """Return the quotient of two jets, one division and one product per coefficient."""
        if not y:
            return []
        reciprocal, z = self.tape.div(ONE, y[0]), [self.tape.div(x[0], y[0])]
        for k in range(1, len(x)):
            z.append(self.tape.mul(reciprocal, self.tape.sub(x[k], self._convolution(y, z, k, 1, k))))
        return z

    def slope_times(self, x: Jet, y: Jet) -> list[Ref]:
        """Return the jet of x / y, for a rate x and a number y that is zero at the edge of a domain. Coefficients are 0
        if a choice sets the rate to zero, and if y and the rates of y are zero."""
        if not y:
            return []
        reciprocal, z = quotient(self.tape, ONE, y[0], y[0]), list[Ref]()
        for k in range(len(x)):
            rest = plus(self.tape, x[k], -self._convolution(y, z, k, 1, k)) if k else x[k]
            z.append(guarded_product(self.tape, reciprocal, rest))
        return z

    def rate(self, x: Jet) -> list[Ref]:
        """Return the jet of dx/dt, one coefficient shorter."""
        return [times(self.tape, self.tape.constant(float(k)), x[k]) for k in range(1, len(x))]

    def integrate(self, start: Ref, rate: Jet) -> list[Ref]:
        """Return the jet that starts at ``start`` and has the given rate, one coefficient longer."""
        return [start, *(times(self.tape, self.tape.constant(1.0 / (k + 1)), ref) for k, ref in enumerate(rate))]

    def _convolution(self, x: Jet, y: Jet, k: int, first: int, last: int) -> Ref:
        total = ZERO
        for i in range(first, last + 1):
            total = plus(self.tape, total, times(self.tape, x[i], y[k - i]))
        return total

    def _square(self, x: Jet, k: int, first: int = 0) -> Ref:
        """Return the sum of x_i x_{k-i} for i = first .. k - first, each product once."""
        total = ZERO
        for i in range(first, (k + 1) // 2):
            total = plus(self.tape, total, times(self.tape, x[i], x[k - i]))
        total = times(self.tape, self.tape.constant(2.0), total)
        return total if k % 2 or k // 2 < first else plus(self.tape, total, times(self.tape, x[k // 2], x[k // 2]))

    def constant(self, value: float, length: int) -> list[Ref]:
        """Return the jet of a constant."""
        return [self.tape.constant(value)] + [ZERO] * (length - 1)

    def sqrt(self, x: Jet, value: Ref) -> list[Ref]:
        """Return the jet of z with z z = x; ``value`` is z at order 0. At x = 0 further coefficients are zero if x is
        constant, or if ``flat_zero(x)`` is 0 and ``value`` is not a length; else infinite or NaN in general."""
        if not x:
            return []
        z = [value]
        half = self.tape.root_slope(x[0], value) if _varies(x) else ZERO
        for k in range(1, len(x)):
            z.append(guarded_product(self.tape, half, plus(self.tape, x[k], -self._square(z, k, 1))))
        return z

    def sine_and_cosine(self, x: Jet, *, hyperbolic: bool = False) -> tuple[list[Ref], list[Ref]]:
        """Return the jets of sine and cosine of x, circular or hyperbolic, recorded together once."""
        key = (hyperbolic, tuple(x))
        if key not in self._sine_cosine:
            ops, sign = ((Op.SINH, Op.COSH), 1.0) if hyperbolic else ((Op.SIN, Op.COS), -1.0)
            sine, cosine = ([self.tape.call(op, x[0])] for op in ops)
            slope = [ZERO, *self.rate(x)]
            for k in range(1, len(x)):
                s, c = self._convolution(slope, cosine, k, 1, k), self._convolution(slope, sine, k, 1, k)
                sine.append(self.tape.mul(self.tape.constant(1.0 / k), s))
                cosine.append(self.tape.mul(self.tape.constant(sign / k), c))
            self._sine_cosine[key] = (sine, cosine)
        return self._sine_cosine[key]

    def exponential(self, x: Jet, value: Ref) -> list[Ref]:
        """Return the jet of z with z' = z x', given z at order 0."""
        return self._by_slope(x, value, lambda z: z[-1])

    def tangent(self, x: Jet, value: Ref, square: float) -> list[Ref]:
        """Return the jet of z with z' = (1 + square z^2) x'; ``value`` is z at order 0, ``square`` 1 for tan and -1 for
        tanh."""

        def slope(z: Jet) -> Ref:
            squares = self.tape.mul(self.tape.constant(square), self._square(z, len(z) - 1))
            return self.tape.add(squares, ONE if len(z) == 1 else ZERO)

        return self._by_slope(x, value, slope)

    def _by_slope(self, x: Jet, value: Ref, slope: Callable[[Jet], Ref]) -> list[Ref]:
        """Return the jet of z with z' = w x'; ``value`` is z at order 0. ``slope`` returns the next coefficient of w
        from the coefficients of z that are known."""
        rate, z, w = [ZERO, *self.rate(x)], [value], list[Ref]()
        for k in range(1, len(x)):
            w.append(slope(z))
            z.append(self.tape.mul(self.tape.constant(1.0 / k), self._convolution(rate, w, k, 1, k)))
        return z

    def _angle_rate(self, y: Jet, x: Jet) -> list[Ref]:
        """Return the jet of d/dt atan2(y, x) = (x y' - y x') / (x^2 + y^2)."""
        low_y, low_x = y[:-1], x[:-1]
        moment = self.add(self.multiply(low_x, self.rate(y)), self.negative(self.multiply(low_y, self.rate(x))))
        square = self.add(self.multiply(low_x, low_x), self.multiply(low_y, low_y))
        return self.slope_times(moment, square)

    def _power(self, x: Jet, exponent: Jet, value: Ref) -> list[Ref]:
        """Return the jet of z = x^exponent; ``value`` is z at order 0. Higher coefficients are 0 if x and its rates are
        zero (``flat_zero``)."""
        tape, number = self.tape, None if _varies(exponent) else self.tape.value(exponent[0])
        flat = flat_zero(tape, x[0]) if number is None or number < len(x) - 1 else None
        if flat is None:
            return self._powers(x, exponent, value)
        regular = tape.call(Op.LT, ZERO, flat)
        z = self._powers([tape.select(regular, x[0], ONE), *x[1:]], exponent, value)
        return [value, *(choose(tape, regular, ref, ZERO) for ref in z[1:])]

    def _powers(self, x: Jet, exponent: Jet, value: Ref) -> list[Ref]:
        """Return the jet of z = x^e: z' = e x^(e - 1) x' + z log(x) e', without a quotient of z and x.

        Factors of x^(e - 1) that are 0, as of e = 0, and of log(x), as z at x = 0, count before the infinite factor.
        """
        if len(x) < 2:
            return [value]
        tape, e = self.tape, exponent[0]
        nonzero = [tape.select(tape.call(Op.ABS, x[0]), x[0], ONE), *x[1:]]
        base = x if tape.value(e) is not None else [tape.select(tape.call(Op.ABS, e), x[0], ONE), *x[1:]]
        below = [tape.sub(e, ONE), *exponent[1:-1]]
        powers = self._powers(base[:-1], below, tape.call(Op.POW, base[0], below[0]))
        rate = self.multiply(self.multiply(exponent[:-1], powers), self.rate(x))
        if _varies(exponent):
            logarithm = self.integrate(
                tape.call(Op.LOG, nonzero[0]), self.divide(self.rate(nonzero[:-1]), nonzero[:-2])
            )
            same = self._powers(x[:-1], exponent[:-1], value)
            rate = self.add(rate, self.multiply(self.multiply(same, logarithm), self.rate(exponent)))
        return self.integrate(value, rate)


def _varies(x: Jet) -> bool:
    return any(ref != ZERO for ref in x[1:])
