"""Derivatives in branches that are not taken are zero, also if values or slopes there are infinite or not numbers.

The derivative of a choice is a choice of derivatives, so no rule multiplies by an untaken branch. Products of a
derivative that a choice has set to zero and an infinite slope, as in sqrt(max(0, q)) below 0 and in adjoints within a
branch, are selected again: zero times infinity never reaches a result. ``Tape.conditions`` has, for such derivatives,
a number that is not zero only if the derivative may differ from zero.
"""

from __future__ import annotations

from collections.abc import Iterable

from eomgen.symbolic.operations import ELEMENTARY, LEAVES, Op
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape

#: Operations that give finite values of finite operands.
_BOUNDED = frozenset(
    {Op.ADD, Op.SUB, Op.MUL, Op.ATAN2, Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE, Op.SELECT}
    | {op for op, row in ELEMENTARY.items() if row.smooth} - {Op.EXP, Op.SINH, Op.COSH}
)


def choose(tape: Tape, condition: Ref, then: Ref, otherwise: Ref) -> Ref:
    """Record the choice between two derivatives: ``then`` if the condition is not zero, else ``otherwise``. If a branch
    is zero, a number that is zero in this case is noted in ``tape.conditions`` for the result."""
    result = tape.select(condition, then, otherwise)
    if ZERO in (then, otherwise) or tape.conditions:
        holds = _truth(tape, condition) if then != ZERO else ZERO
        fails = tape.select(_truth(tape, condition), ZERO, ONE) if otherwise != ZERO else ZERO
        holds, fails = (
            _both(tape, case, tape.conditions.get(abs(branch), ONE))
            for case, branch in ((holds, then), (fails, otherwise))
        )
        note(tape, result, _either(tape, holds, fails))
    return result


def times(tape: Tape, factor: Ref, derivative: Ref) -> Ref:
    """Record factor times derivative, and note that the product is zero if one of both is zero by a choice."""
    product = tape.mul(factor, derivative)
    known = tape.conditions
    if known and (abs(factor) in known or abs(derivative) in known):
        note(tape, product, _both(tape, *(known.get(abs(ref), ONE) for ref in (factor, derivative))))
    return product


def plus(tape: Tape, x: Ref, y: Ref) -> Ref:
    """Record a sum of two derivatives, and note that the sum is zero if both are zero by a choice."""
    total = tape.add(x, y)
    known = tape.conditions
    if known and abs(x) in known and abs(y) in known:
        note(tape, total, _either(tape, known[abs(x)], known[abs(y)]))
    return total


def guarded_product(tape: Tape, slope: Ref, derivative: Ref) -> Ref:
    """Record slope times derivative, 0 if the derivative is zero by a choice, even for an infinite or NaN slope."""
    condition = tape.conditions.get(abs(derivative))
    if condition is None:
        return times(tape, slope, derivative)
    node, sign = abs(derivative), derivative > 0
    if tape.op[node] is Op.SELECT and ZERO in (tape.b[node], tape.c[node]):
        branches = (tape.b[node], tape.c[node])
        then, otherwise = (guarded_product(tape, slope, ref if sign or ref == ZERO else -ref) for ref in branches)
        return choose(tape, tape.a[node], then, otherwise)
    return choose(tape, condition, tape.mul(slope, derivative), ZERO)


def common_condition(tape: Tape, derivatives: Iterable[Ref]) -> Ref | None:
    """Return the reference of a number that is not zero in all cases in which one of the derivatives is not zero. None
    if a derivative has no known condition; ``ZERO`` if all derivatives are structural zeros."""
    total = ZERO
    for ref in derivatives:
        if abs(ref) != ZERO:
            total = _either(tape, total, tape.conditions.get(abs(ref), ONE))
    return None if total == ONE else total


def zero_unless(tape: Tape, condition: Ref | None, derivative: Ref) -> Ref:
    """Record the derivative, zero unless a condition holds; without a condition the derivative itself."""
    return derivative if condition is None else choose(tape, condition, derivative, ZERO)


def may_be_unbounded(tape: Tape, slope: Ref, derivative: Ref) -> bool:
    """Return whether a slope may be infinite or not a number while a derivative is zero by a choice. False for a
    derivative without a noted condition. ``tape.unbounded`` is completed up to the last node."""
    if abs(derivative) not in tape.conditions:
        return False
    known = tape.unbounded
    for node in range(len(known), len(tape.op)):
        op = tape.op[node]
        known.append(op not in LEAVES and (op not in _BOUNDED or any(known[abs(ref)] for ref in tape.operands(node))))
    return bool(known[abs(slope)])


def note(tape: Tape, ref: Ref, condition: Ref | None) -> None:
    """Note in ``tape.conditions`` that a derivative is zero if the number ``condition`` is zero. Without a condition,
    for the condition 1, and for leaves no entry is made; an earlier entry stays."""
    if condition not in (ONE, None) and tape.op[abs(ref)] not in LEAVES:
        tape.conditions.setdefault(abs(ref), condition)


def _truth(tape: Tape, condition: Ref) -> Ref:
    """Return the reference of a number that is 1 if the condition is not zero, else 0."""
    if condition > 0 and tape.op[condition] in (Op.LT, Op.LE):
        return condition
    return tape.call(Op.LT, ZERO, tape.call(Op.ABS, condition))


def _both(tape: Tape, first: Ref, second: Ref) -> Ref:
    if first == second or ONE in (first, second) or ZERO in (first, second):
        return first if second == ONE or first == ZERO else second
    return tape.select(first, second, ZERO)


def _either(tape: Tape, first: Ref, second: Ref) -> Ref:
    if first == second or ZERO in (first, second):
        return second if first == ZERO else first
    if second == tape.select(first, ZERO, ONE) or first == tape.select(second, ZERO, ONE) or ONE in (first, second):
        return ONE
    return tape.call(Op.MAX, first, second)
