"""Operations of a tape: codes, parities, values on constants, input symbols, operation counts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum, auto
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass


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


ODD = frozenset({Op.SIN, Op.TAN, Op.ASIN, Op.ATAN, Op.SINH, Op.TANH, Op.SIGN})
EVEN = frozenset({Op.COS, Op.COSH, Op.ABS})
#: Functions of one number by name in mathematics, which libraries share.
ELEMENTARY: Mapping[Op, str] = {
    Op[name.upper()]: name
    for name in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")
}
UNARY = frozenset({*ELEMENTARY, Op.ABS, Op.SIGN})
LEAVES = frozenset({Op.CONST, Op.INPUT})

FOLD: dict[Op, Callable[[float], float]] = {
    **{op: getattr(math, name) for op, name in ELEMENTARY.items()},
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

    Attributes
    ----------
    breaks : (pieces + 1,) array
    coefficients : (pieces, degree + 1) array
        In powers of x - (start of the piece), lowest first.
    outside : ``error``, ``hold`` or ``periodic``
    held : values before the first and after the last break, if held there.
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
    def held(self) -> tuple[float, float]: ...
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
        return Counts(
            self.additions + other.additions,
            self.multiplications + other.multiplications,
            self.divisions + other.divisions,
            self.functions + other.functions,
            self.selections + other.selections,
            self.statements + other.statements,
        )
