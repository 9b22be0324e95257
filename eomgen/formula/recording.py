"""Recording of formulas on the tape; tables are one tape operation, bumps and harmonics are elementary operations.

Cosines and sines of constants to the last bit: they go into C, whose bytes are to be the same on every machine.

Sines and cosines of the C library differ in the last digit between its versions and between processors.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.base.products import import_target
from eomgen.errors import ModelError, Problem
from eomgen.formula.curves import AnyCurve, Bump, Waves
from eomgen.formula.nodes import Application, EntryQuantity, Formula, Number, Symbol
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import add_map
from eomgen.symbolic.operations import Op
from eomgen.symbolic.periodic import harmonic_sum
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Ref, Tape


def unit_circle(angle: float, quarter_turns: int = 0) -> tuple[float, float]:
    """Return cosine and sine of an angle in rad plus a number of quarter turns, each rounded once."""
    import mpmath  # noqa: PLC0415  # few scenes have roads

    with mpmath.workprec(192):
        cosine, sine = mpmath.cos_sin(mpmath.mpf(angle))
    for _ in range(quarter_turns % 4):
        cosine, sine = -sine, cosine
    return float(cosine), float(sine)


Resolver = Callable[[Symbol], Scalar]
#: Operators of scalars; all other operations of formulas are the tape's, by the same names.
_NAMES = {"add": "add", "sub": "sub", "mul": "mul", "div": "truediv", "neg": "neg"}
_OPERATORS: Mapping[str, Callable[..., Scalar]] = {name: getattr(operator, member) for name, member in _NAMES.items()}


def record(algebra: Algebra, formula: Formula, resolve: Resolver) -> Scalar:
    """Record a formula on the tape of ``algebra``, and return the scalar; ``resolve`` gives the scalar of each symbol.
    Depth is bounded by the reader of formulas.

    Raises
    ------
    ModelError
        An operation without a finite value in any state, as a division by a fixed parameter that is 0.
    """
    if isinstance(formula, Number):
        return algebra.scalar(formula.value)
    if isinstance(formula, Symbol):
        return resolve(formula)
    if isinstance(formula, Application):
        argument = record(algebra, formula.argument, resolve)
        try:
            return curve_at(algebra, formula.curve, argument, formula.derivative)
        except (ValueError, ArithmeticError):
            fault = f"the curve {formula.curve.name} has no value at {algebra.tape.value(argument.ref):.6g} [E0302]"
            raise ModelError(Problem("", fault, "an argument within its points")) from None
    if formula.label:
        with algebra.tape.block(f"definition {formula.label}"):
            value = record(algebra, replace(formula, label=""), resolve)
        algebra.tape.name(value.ref, f"{formula.label}_value")  # the C library has macros such as M_PI and SIZE_MAX
        return value
    if formula.name == "select":
        condition, *branches = formula.arguments
        taken = algebra.tape.value(record(algebra, condition, resolve).ref)
        if taken is not None:  # the other branch may well divide by zero: the condition prevents the division
            return record(algebra, branches[0 if taken != 0.0 else 1], resolve)
    arguments = [record(algebra, argument, resolve) for argument in formula.arguments]
    if isinstance(formula, EntryQuantity):
        recording: Any = import_target(formula.word.recording)
        result: Scalar = recording(algebra, formula.item, formula.name, formula.component, arguments)
        return result
    try:
        if formula.name in _OPERATORS:
            return _OPERATORS[formula.name](*arguments)
        if formula.name == "select":
            return algebra.select(*arguments)
        return algebra.call(Op[formula.name.upper()], *arguments)
    except (ValueError, ArithmeticError):
        numbers = (algebra.tape.value(argument.ref) for argument in arguments)
        values = ", ".join("..." if number is None else f"{number:.6g}" for number in numbers)
        fault = f"{formula.name}({values}) in a formula has no finite value for any state [E0301]"
        raise ModelError(
            Problem("", fault, "other values of the fixed parameters there, or tunable = true for them")
        ) from None


def curve_at(algebra: Algebra, curve: AnyCurve, argument: Scalar, derivative: int = 0) -> Scalar:
    """Return a curve, or a derivative of the curve, at an argument."""
    if isinstance(curve, Bump):
        return _bump(algebra, curve, argument, derivative)
    if isinstance(curve, Waves):
        return waves(algebra, curve, argument, derivative)
    return Scalar(algebra.tape, algebra.tape.curve(curve, derivative, argument.ref))


def waves(algebra: Algebra, curve: Waves, argument: Scalar, derivative: int = 0) -> Scalar:
    """Return a sum of harmonics, or a derivative, at an argument as a scalar, recorded as one loop over a table;
    derivatives are harmonics again, a quarter turn ahead each.

    Angle addition puts phases, and constants that the argument adds, into the two amplitudes of a harmonic. So roads
    with the same frequencies along the same argument (tracks of other seeds, wheels that follow, slopes) have the
    shared cosines and sines of their loops, which are joined when the C is made (``Map.join``).
    """
    along, scale, shift = _affine(algebra.tape, argument.ref)
    rows = []
    for amplitude, w, phase in curve.harmonics:
        cosine, sine = unit_circle(phase + w * shift, derivative)
        size = amplitude * w**derivative
        rows.append((size * cosine, w * abs(scale), math.copysign(size, -scale) * sine))
    loop = harmonic_sum([*zip(*rows, strict=True)], along, f"harmonics of {curve.name}")
    return Scalar(algebra.tape, add_map(algebra.tape, loop).sums[0])


def _affine(tape: Tape, ref: Ref) -> tuple[Ref, float, float]:
    """Return a node x, scale and shift for a reference to the tape that is scale x + shift, with constants as far as
    these are outermost."""
    scale, shift = 1.0, 0.0
    while True:
        node, sign = abs(ref), 1.0 if ref > 0 else -1.0
        op = tape.op[node]
        if op not in (Op.ADD, Op.SUB, Op.MUL):
            return node, sign * scale, shift
        first, second = tape.value(tape.a[node]), tape.value(tape.b[node])
        scale *= sign
        if op is Op.MUL and first is not None:
            scale, ref = scale * first, tape.b[node]
        elif op is not Op.MUL and first is not None:
            shift, ref = shift + scale * first, tape.b[node] if op is Op.ADD else -tape.b[node]
        elif op is not Op.MUL and second is not None:
            shift, ref = shift + scale * (second if op is Op.ADD else -second), tape.a[node]
        else:
            return node, scale, shift


def _bump(algebra: Algebra, bump: Bump, argument: Scalar, derivative: int) -> Scalar:
    """Return a bump, or a derivative, at an argument as a scalar; a select keeps the zero before and after the bump
    separate, so that derivatives do not see across the ends. The select asks whether the road is flat there, so that an
    argument that is not a number gives none."""
    along = (argument - bump.position) * (1.0 / bump.length)
    off_it = algebra.call(Op.LT, along, algebra.zero) + algebra.call(Op.LE, algebra.one, along)
    rate = 2.0 * math.pi
    if derivative == 0:
        value = 0.5 * bump.height * (1.0 - algebra.call(Op.COS, rate * along))
    else:
        size = -0.5 * bump.height * (rate / bump.length) ** derivative
        value = size * algebra.call(Op.COS, rate * along + derivative * math.pi / 2)
    return algebra.select(off_it, algebra.zero, value)


def law_and_rate(formula: Formula, known: Mapping[str, float]) -> Callable[[Array], tuple[Array, Array]]:
    """Return a function from times (n,), s, to values and rates, (n,) each, of a formula of time, by a complex step;
    ``known`` has the numbers of parameters. Operations without a value give NaN or infinity there."""
    tape = Tape()
    algebra = Algebra(tape)
    time = Scalar(tape, tape.input("t", 0))

    def resolve(symbol: Symbol) -> Scalar:
        return time if symbol.kind == "time" else algebra.scalar(known[symbol.name])

    law, step = record(algebra, formula, resolve), 1e-30

    def values(t: Array) -> tuple[Array, Array]:
        with np.errstate(all="ignore"):
            result = evaluate(tape, [law.ref], {"t": t[:, np.newaxis] + 1j * step})[:, 0]
        return result.real, result.imag / step

    return values
