"""Curves on the tape: tables as an operation of their own, bumps and roads as what they are made of."""

from __future__ import annotations

import math

from eomgen.scene.formula.piecewise import AnyCurve, Bump, Waves
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Tape


def curve_at(algebra: Algebra, curve: AnyCurve, argument: Scalar, derivative: int = 0) -> Scalar:
    """Return a curve, or a derivative of it, at an argument."""
    if isinstance(curve, Bump):
        return _bump(algebra, curve, argument, derivative)
    if isinstance(curve, Waves):
        return waves(algebra, curve, argument, derivative)
    return Scalar(algebra.tape, algebra.tape.curve(curve, derivative, argument.ref))


def waves(algebra: Algebra, curve: Waves, argument: Scalar, derivative: int = 0) -> Scalar:
    """Return a sum of harmonics as one loop over a table; derivatives are harmonics again, a quarter turn ahead each."""
    kernel = Tape()
    inner = Algebra(kernel)
    amplitude, frequency, phase = inner.block("element", 3)
    wave = amplitude * inner.call(Op.COS, frequency * inner.block("shared", 1)[0] + phase)
    rows = [(a * w**derivative, w, p + derivative * math.pi / 2) for a, w, p in curve.harmonics]
    loop = Map(
        kernel, len(rows), elements=tuple(zip(*rows, strict=True)), shared=(argument.ref,), sums=(wave.ref,),
        label=f"harmonics of {curve.name}",
    )  # fmt: skip
    return Scalar(algebra.tape, add_map(algebra.tape, loop).sums[0])


def _bump(algebra: Algebra, bump: Bump, argument: Scalar, derivative: int) -> Scalar:
    """Return a bump; a select keeps its polynomials apart, so that derivatives do not see beyond its ends.

    The select asks where the road is flat, so that an argument that is not a number gives none.
    """
    along = (argument - bump.position) * (1.0 / bump.length)
    off_it = algebra.call(Op.LT, along, algebra.zero) + algebra.call(Op.LE, algebra.one, along)
    rate = 2.0 * math.pi
    if derivative == 0:
        value = 0.5 * bump.height * (1.0 - algebra.call(Op.COS, rate * along))
    else:
        size = -0.5 * bump.height * (rate / bump.length) ** derivative
        value = size * algebra.call(Op.COS, rate * along + derivative * math.pi / 2)
    return algebra.select(off_it, algebra.zero, value)
