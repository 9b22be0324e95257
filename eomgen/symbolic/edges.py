"""Edges of domains: slopes of roots, powers and angles that are infinite while the slope of the operand is zero.

The chain rule of |v| = sqrt(v^2) at v = 0 is zero times infinity. Its derivative is taken as 0 there, the centre of
the generalized gradient of norms (Clarke, Optimization and Nonsmooth Analysis, 1983, section 2.2). The divisor is
selected before the division, so that derivatives of the slope are finite as well.

If one-sided slopes are infinite with equal signs, as of sign(v) sqrt(abs(v)), that is a choice as well. Other slopes
at edges are infinite in fact, as of sqrt(q) at q = 0, and stay infinite.
"""

from __future__ import annotations

from eomgen.symbolic.operations import Op, Ref
from eomgen.symbolic.tape import ONE, ZERO, Tape, flat_zero


def power_slope(tape: Tape, x: Ref, exponent: Ref) -> Ref:
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


def logarithm_of_base(tape: Tape, x: Ref) -> Ref:
    """Record log(x) as a factor of x^e, with 0 log(0) = 0."""
    return tape.call(Op.LOG, tape.select(tape.call(Op.ABS, x), x, ONE))
