"""Edges of domains: slopes of roots, powers and angles that are infinite while the slope of the operand is zero.

The chain rule of |v| = sqrt(v^2) at v = 0 is zero times infinity. Its derivative is taken as 0 there, the centre of
the generalized gradient of norms (Clarke, Optimization and Nonsmooth Analysis, 1983, section 2.2). The divisor is
selected before the division, so that derivatives of the slope are finite as well.

If one-sided slopes are infinite with equal signs, as of sign(v) sqrt(abs(v)), that is a choice as well. Other slopes
at edges are infinite in fact, as of sqrt(q) at q = 0, and stay infinite.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from eomgen.symbolic.operations import Op, Ref

ZERO, ONE = 1, 2
#: Operations that may vanish in the first power of their operand.
_FIRST_ORDER = frozenset({Op.ABS, Op.MAX, Op.MIN, Op.SQRT})


class TapeInterface(Protocol):
    """Interface of ``tape.Tape``, whose module imports this one."""

    @property
    def op(self) -> Sequence[Op]: ...
    @property
    def a(self) -> Sequence[int]: ...
    @property
    def b(self) -> Sequence[int]: ...
    @property
    def c(self) -> Sequence[int]: ...
    def value(self, ref: Ref, /) -> float | None: ...
    def operands(self, node: int, /) -> tuple[int, ...]: ...
    def add(self, x: Ref, y: Ref, /) -> Ref: ...
    def sub(self, x: Ref, y: Ref, /) -> Ref: ...
    def mul(self, x: Ref, y: Ref, /) -> Ref: ...
    def div(self, x: Ref, y: Ref, /) -> Ref: ...
    def call(self, op: Op, x: Ref, y: Ref = 0, /) -> Ref: ...
    def select(self, condition: Ref, then: Ref, otherwise: Ref, /) -> Ref: ...


def flat_zero(tape: TapeInterface, x: Ref) -> Ref | None:
    """Return the reference of a number that is zero only if x and all first derivatives of x are zero; None if none is
    known. Squares, absolute values, max(0, y) and min(0, y), which are 0 beyond the edge, and sums, products and roots
    of such numbers have one by their structure. The number is never negative."""
    node = abs(x)
    op, a, b = tape.op[node], tape.a[node], tape.b[node]
    if op in (Op.ADD, Op.SUB):
        return _flat_sum(tape, node)
    if op is Op.MUL:
        return _flat_product(tape, node)
    if op is Op.ABS or (op is Op.MAX and ZERO in (a, b)):
        return node
    if op is Op.MIN and ZERO in (a, b):
        return -node
    if op in (Op.DIV, Op.POW):
        return flat_zero(tape, a)
    if op is Op.SQRT:
        return node if flat_zero(tape, a) == a else flat_zero(tape, a)
    if op is Op.SELECT:
        branches = [ZERO if ref == ZERO else flat_zero(tape, ref) for ref in (b, tape.c[node])]
        if branches == [None, None]:
            return None
        then, otherwise = (ONE if ref is None else ref for ref in branches)
        return tape.select(a, then, otherwise)
    return None


def _flat_product(tape: TapeInterface, node: Ref) -> Ref | None:
    """Return the result of ``flat_zero`` for a product node."""
    a, b = tape.a[node], tape.b[node]
    if a == b:  # a root of a fourth power has second derivatives, which a selected slope would not have
        return node if tape.op[a] in _FIRST_ORDER or flat_zero(tape, a) is None else None
    second = flat_zero(tape, b)
    if tape.op[a] is Op.CONST:
        return node if second == b and tape.value(a) is not None else second
    first = flat_zero(tape, a)
    if first is None or second is None:
        return second if first is None else first
    return node if (first, second) == (a, b) else tape.mul(first, second)


def _flat_sum(tape: TapeInterface, node: Ref) -> Ref | None:
    """Return the result of ``flat_zero`` for a sum or difference; None if it is None for one of the terms. Iterative,
    since sums may have many terms."""
    terms, pending, positive = list[Ref](), [node], True
    while pending:
        ref = pending.pop()
        if tape.op[abs(ref)] in (Op.ADD, Op.SUB):
            first, second = tape.operands(abs(ref))
            second = -second if tape.op[abs(ref)] is Op.SUB else second
            pending += [second, first] if ref > 0 else [-second, -first]
            continue
        flat = flat_zero(tape, ref)
        if flat is None:
            return None
        positive = positive and flat == ref
        terms.append(flat)
    if positive:
        return node
    total = ZERO
    for term in terms:
        total = tape.add(total, term)
    return total


def quotient(tape: TapeInterface, numerator: Ref, divisor: Ref, x: Ref) -> Ref:
    """Record numerator / divisor; 0 if ``flat_zero`` of x is known and 0, and infinite or not a number at other zeros.
    The divisor must be 0 only with x."""
    flat = flat_zero(tape, x)
    if flat is None:
        return tape.div(numerator, divisor)
    regular = tape.call(Op.LT, ZERO, flat)
    return tape.select(regular, tape.div(numerator, tape.select(regular, divisor, ONE)), ZERO)


def power_slope(tape: TapeInterface, x: Ref, exponent: Ref) -> Ref:
    """Record d(x^e)/dx = e x^(e - 1).

    It is 0 at a flat zero of x if e may be below 1, and at x = 0 if a variable exponent is 0: x^(e - 1) may be
    infinite there.
    """
    number, below = tape.value(exponent), tape.sub(exponent, ONE)
    if number is None:
        x = tape.select(tape.call(Op.ABS, exponent), x, tape.select(tape.call(Op.ABS, x), x, ONE))
    flat = flat_zero(tape, x) if number is None or 0.0 < number < 1.0 else None
    if flat is None:
        return tape.mul(exponent, tape.call(Op.POW, x, below))
    regular = tape.call(Op.LT, ZERO, flat)
    power = tape.call(Op.POW, tape.select(regular, x, ONE), below)
    return tape.select(regular, tape.mul(exponent, power), ZERO)


def logarithm_of_base(tape: TapeInterface, x: Ref) -> Ref:
    """Record log(x) as a factor of x^e, with 0 log(0) = 0."""
    return tape.call(Op.LOG, tape.select(tape.call(Op.ABS, x), x, ONE))
