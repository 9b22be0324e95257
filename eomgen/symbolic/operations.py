"""Operations of a tape: codes, values on constants, input symbols, operation counts, and elementary functions.

A new elementary function is a member of ``Op`` and a row of ``ELEMENTARY``: formulas, the tape, derivatives, Taylor
series, NumPy, SymPy, the tape engine and the generated C iterate over the rows. The generated C has a text ``eg_name``
for double and lanes, and takes ``namef`` and ``cname`` of the C library for float and complex.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum, auto
from operator import add
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass

#: An operation of a tape by number; the negative number is the negative of the value.
Ref = int


class Op(IntEnum):
    """Operation codes. ``LT``, ``LE`` give 1.0 or 0.0, NaN with a NaN; ``SELECT`` takes condition, then, otherwise."""

    CONST = auto()
    INPUT = auto()
    ADD = auto()
    SUB = auto()
    MUL = auto()
    DIV = auto()
    SQRT = auto()
    SIN = auto()
    COS = auto()
    TAN = auto()
    ASIN = auto()
    ACOS = auto()
    ATAN = auto()
    ATAN2 = auto()
    SINH = auto()
    COSH = auto()
    TANH = auto()
    EXP = auto()
    LOG = auto()
    POW = auto()
    ABS = auto()
    SIGN = auto()
    MIN = auto()
    MAX = auto()
    LT = auto()
    LE = auto()
    SELECT = auto()
    MAP = auto()  # operand a: number of the Map on this tape, operand b: number of the result
    CURVE = auto()  # operand a: argument, operand b: number of the curve and derivative on this tape


LEAVES = frozenset({Op.CONST, Op.INPUT})


class Elementary(NamedTuple):
    """An elementary function f, a row of ``ELEMENTARY``.

    The classes that record, Tape, JetAlgebra and Series, import this module, so rules take them without a type.

    Attributes
    ----------
    slope : records f'(x): of the Tape, x and f(x), which saves operations in some slopes
    jet : records the coefficients of f(x(t)): of the ``JetAlgebra``, the jet of x, and the coefficient of order 0
    series : records the recurrence of the Taylor coefficients of f(x(t)): of the ``Series`` and the term of x
    numpy : name in NumPy, if not the name in C
    parity : -1 for odd functions, 1 for even functions, else 0
    smooth : whether f has derivatives of all orders at every number
    rough : whether the slope of f is unbounded at the edge of the domain
    """

    slope: Callable[[Any, Ref, Ref], Ref]
    jet: Callable[[Any, Sequence[Ref], Ref], list[Ref]]
    series: Callable[[Any, Any], Any]
    numpy: str = ""
    parity: int = 0
    smooth: bool = False
    rough: bool = False


# -- rules longer than a line -----------------------------------------------------------------------------------------


def _square_from_one(tape: Any, x: Ref, sign: int) -> Any:
    """Record 1 + x^2, or 1 - x^2."""
    unit, square = tape.constant(1.0), tape.mul(x, x)
    return tape.add(unit, square) if sign > 0 else tape.sub(unit, square)


def _circular(part: int, hyperbolic: bool = False) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return the rules of jets and of series of the sine (``part`` 0) or the cosine (1)."""

    def pick(algebra: Any, x: Any, _: Ref = 0) -> Any:
        return algebra.sine_and_cosine(x, hyperbolic=hyperbolic)[part]

    return pick, pick


def _over_root(tape: Any, numerator: float, x: Ref) -> Any:
    """Record numerator / sqrt(1 - x^2)."""
    return tape.div(tape.constant(numerator), tape.call(Op.SQRT, _square_from_one(tape, x, -1)))


def _arc_jet(jets: Any, x: Sequence[Ref], value: Ref, *, falling: bool) -> Any:
    """Return the jet of asin x, or acos x if ``falling``: z' sqrt(1 - x^2) = x', or -x'; ``value`` is z at order 0."""
    low = x[:-1]
    square = jets.add(jets.constant(1.0, len(low)), jets.negative(jets.multiply(low, low)))
    rate = jets.slope_times(jets.rate(x), jets.sqrt(square, jets.tape.call(Op.SQRT, square[0])))
    return jets.integrate(value, jets.negative(rate) if falling else rate)


def _arc_series(series: Any, op: Op, x: Any) -> Any:
    """Return the term of asin x, or acos x: z' sqrt(1 - x^2) = x', or -x'."""
    root = series.sqrt(series.add(series.constant(1.0), series.negative(series.multiply(x, x))))
    return series.over(series.tape.call(op, x.value), x if op is Op.ASIN else series.negative(x), root)


def _atan_jet(jets: Any, x: Sequence[Ref], value: Ref) -> Any:
    """Return the jet of atan x: z' (1 + x^2) = x'; ``value`` is z at order 0."""
    low = x[:-1]
    square = jets.add(jets.constant(1.0, len(low)), jets.multiply(low, low))
    return jets.integrate(value, jets.divide(jets.rate(x), square))


def _atan_series(series: Any, x: Any) -> Any:
    square = series.add(series.constant(1.0), series.multiply(x, x))
    return series.over(series.tape.call(Op.ATAN, x.value), x, square)


ELEMENTARY: Mapping[Op, Elementary] = {
    Op.SIN: Elementary(lambda tape, x, _: tape.call(Op.COS, x), *_circular(0), parity=-1, smooth=True),
    Op.COS: Elementary(lambda tape, x, _: -tape.call(Op.SIN, x), *_circular(1), parity=1, smooth=True),
    Op.TAN: Elementary(
        slope=lambda tape, _, value: _square_from_one(tape, value, 1),
        jet=lambda jets, x, value: jets.tangent(x, value, 1.0),
        series=lambda series, x: series.tangent(x, Op.TAN),
        parity=-1,
    ),
    Op.ASIN: Elementary(
        slope=lambda tape, x, _: _over_root(tape, 1.0, x),
        jet=lambda jets, x, value: _arc_jet(jets, x, value, falling=False),
        series=lambda series, x: _arc_series(series, Op.ASIN, x),
        numpy="arcsin",
        parity=-1,
        rough=True,
    ),
    Op.ACOS: Elementary(
        slope=lambda tape, x, _: _over_root(tape, -1.0, x),
        jet=lambda jets, x, value: _arc_jet(jets, x, value, falling=True),
        series=lambda series, x: _arc_series(series, Op.ACOS, x),
        numpy="arccos",
        rough=True,
    ),
    Op.ATAN: Elementary(
        slope=lambda tape, x, _: tape.div(tape.constant(1.0), _square_from_one(tape, x, 1)),
        jet=_atan_jet,
        series=_atan_series,
        numpy="arctan",
        parity=-1,
        smooth=True,
    ),
    Op.SINH: Elementary(lambda tape, x, _: tape.call(Op.COSH, x), *_circular(0, True), parity=-1, smooth=True),
    Op.COSH: Elementary(lambda tape, x, _: tape.call(Op.SINH, x), *_circular(1, True), parity=1, smooth=True),
    Op.TANH: Elementary(
        slope=lambda tape, _, value: _square_from_one(tape, value, -1),
        jet=lambda jets, x, value: jets.tangent(x, value, -1.0),
        series=lambda series, x: series.tangent(x, Op.TANH),
        parity=-1,
        smooth=True,
    ),
    Op.EXP: Elementary(
        slope=lambda tape, x, value: value,
        jet=lambda jets, x, value: jets.exponential(x, value),
        series=lambda series, x: series.exponential(x),
        smooth=True,
    ),
    Op.LOG: Elementary(
        slope=lambda tape, x, _: tape.div(tape.constant(1.0), x),
        jet=lambda jets, x, value: jets.integrate(value, jets.divide(jets.rate(x), x[:-1])),
        series=lambda series, x: series.logarithm(x),
        rough=True,
    ),
    Op.SQRT: Elementary(
        slope=lambda tape, x, value: tape.root_slope(x, value),
        jet=lambda jets, x, value: jets.sqrt(x, value),
        series=lambda series, x: series.sqrt(x),
        rough=True,
    ),
}
#: Names in formulas, in C and in Python's ``math``.
NAMES: Mapping[Op, str] = {op: op.name.lower() for op in ELEMENTARY}
ODD = frozenset({op for op, row in ELEMENTARY.items() if row.parity < 0} | {Op.SIGN})
EVEN = frozenset({op for op, row in ELEMENTARY.items() if row.parity > 0} | {Op.ABS})
UNARY = frozenset({*ELEMENTARY, Op.ABS, Op.SIGN})

#: Values of functions of one constant.
FOLD: Mapping[Op, Callable[[float], float]] = {
    **{op: getattr(math, name) for op, name in NAMES.items()},
    Op.ABS: abs,
    Op.SIGN: lambda x: float((x > 0) - (x < 0)),
}
FOLD_TWO: dict[Op, Callable[[float, float], float]] = {
    Op.ATAN2: math.atan2,
    Op.MIN: min,
    Op.MAX: max,
    Op.LT: lambda x, y: float(x < y),
    Op.LE: lambda x, y: float(x <= y),
}


class CurveLike(Protocol):
    """A function of one number that is a table: polynomials between breaks (``formula.curves.Curve`` is one).

    A call with x and the order of a derivative returns values.

    Attributes
    ----------
    breaks : (pieces + 1,) array
    coefficients : (pieces, degree + 1) array
        In powers of x - (start of the piece), lowest first.
    outside : ``error``, ``hold`` or ``periodic``
    end_values : values before the first and after the last break, if held there
    """

    @property
    def name(self) -> str: ...
    @property
    def breaks(self) -> NDArray[np.float64]: ...
    @property
    def coefficients(self) -> NDArray[np.float64]: ...
    @property
    def outside(self) -> str: ...
    @property
    def end_values(self) -> tuple[float, float]: ...
    def kinks(self) -> Sequence[tuple[float, int]]: ...
    def __call__(self, x: Any, derivative: int = 0) -> Any: ...


@dataclass(frozen=True)
class InputSymbol:
    """An input node: component ``index`` of the named block (``q``, ``v``, ``t``, ``p``, ``u``, ``base``...)."""

    block: str
    index: int


@dataclass(frozen=True)
class Counts:
    """Exact numbers of operations. ``flops`` is additions plus multiplications, the figure the literature prints."""

    additions: int = 0
    multiplications: int = 0
    divisions: int = 0
    functions: int = 0
    selections: int = 0
    statements: int = 0

    @property
    def flops(self) -> int:
        return self.additions + self.multiplications

    @property
    def weight(self) -> int:
        """Approximate cost for comparisons: a division counts as 8 flops, a function as 20."""
        return self.flops + 8 * self.divisions + 20 * self.functions + self.selections

    def __add__(self, other: Counts) -> Counts:
        return Counts(*map(add, vars(self).values(), vars(other).values()))
