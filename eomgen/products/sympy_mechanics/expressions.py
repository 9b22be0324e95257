"""Expressions of SymPy on a tape: coordinates, speeds, rates, inputs and parameters by name; subexpressions once."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import reduce
from typing import Any

import sympy
from sympy.core.function import AppliedUndef
from sympy.logic.boolalg import BooleanAtom
from sympy.physics.biomechanics import CharacteristicCurveFunction
from sympy.physics.mechanics import dynamicsymbols

from eomgen.base.messages import NAME_LENGTH, shown
from eomgen.errors import DescriptionError, Problem
from eomgen.symbolic.operations import NAMES, Op
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar

_FUNCTIONS: Mapping[type[Any], Op] = {
    **{getattr(sympy, name): op for op, name in NAMES.items() if name != "sqrt"},  # which is a Pow
    sympy.Abs: Op.ABS,
    sympy.sign: Op.SIGN,
}
_PAIRS: Mapping[type[Any], Op] = {sympy.atan2: Op.ATAN2, sympy.Min: Op.MIN, sympy.Max: Op.MAX}
#: Comparisons, and whether the operands change places.
_COMPARISONS: Mapping[type[Any], tuple[Op, bool]] = {
    sympy.StrictLessThan: (Op.LT, False),
    sympy.LessThan: (Op.LE, False),
    sympy.StrictGreaterThan: (Op.LT, True),
    sympy.GreaterThan: (Op.LE, True),
}


#: Functions as formulas of other ones.
_REWRITTEN: Mapping[type[Any], type[Any]] = {
    **{sympy.sec: sympy.cos, sympy.csc: sympy.sin, sympy.cot: sympy.tan, sympy.sinc: sympy.sin},
    **{sympy.sech: sympy.cosh, sympy.csch: sympy.sinh, sympy.coth: sympy.tanh},
}
#: All that has a counterpart.
_KINDS = (
    *(sympy.Number, sympy.NumberSymbol, sympy.Add, sympy.Mul, sympy.Pow, sympy.UnevaluatedExpr),
    *(sympy.Piecewise, sympy.Heaviside, CharacteristicCurveFunction, BooleanAtom),
    *(sympy.And, sympy.Or, sympy.Not, sympy.Eq, sympy.Ne, *_FUNCTIONS, *_PAIRS, *_COMPARISONS, *_REWRITTEN),
)


def basic(value: Any) -> Any:
    """Return an expression of SymPy unchanged, and a number as such an expression; no text is read."""
    return value if isinstance(value, sympy.Basic) else sympy.Number(value)


def name_of(symbol: Any) -> str:
    """Return a legal name for a symbol or function of SymPy: ASCII letters, digits, underscores, Greek letters in
    words. Names begin with a letter, and leave room for an ending."""
    text = str(symbol.func) if isinstance(symbol, AppliedUndef) else str(symbol.name)
    if not text.isascii():
        text = "".join(map(_latin, unicodedata.normalize("NFKD", text)))
    kept = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in text).strip("_")
    return (kept if kept[:1].isalpha() else f"s_{kept}")[: NAME_LENGTH - 4]


def _latin(letter: str) -> str:
    """Return SymPy's name of a Greek letter, an empty text for an accent, and other letters unchanged."""
    words = unicodedata.name(letter, "").split()
    if words[:1] == ["GREEK"] and words[2:3] == ["LETTER"]:
        name = words[3].replace("LAMDA", "LAMBDA")
        return name.capitalize() if words[1] == "CAPITAL" else name.lower()
    return "" if unicodedata.combining(letter) else letter


class Expressions:
    """Records expressions of SymPy on a tape: a call returns the Scalar of an expression, each subexpression once.

    Parameters
    ----------
    algebra : Algebra
    name : str
        Of the system, for messages.
    known : mapping
        Scalars of coordinates, speeds and rates, by expression.
    absent : set of str
        Names of parameters and inputs without an effect, which any number may stand for.
    """

    def __init__(
        self, algebra: Algebra, name: str, known: Mapping[Any, Scalar], absent: frozenset[str] = frozenset()
    ) -> None:
        self.absent = absent
        self.algebra, self.name = algebra, name
        self.known: dict[Any, Scalar] = dict(known)
        #: Symbols met on the way, by name, in the order of the blocks ``p`` and ``u``.
        self.parameters: dict[str, Any] = {}
        self.inputs: dict[str, Any] = {}
        self.time = dynamicsymbols._t

    def declare(self, expressions: Iterable[Any]) -> None:
        """Declare free symbols of expressions as parameters, and functions of time as inputs, in alphabetical order.
        Raises DescriptionError for two symbols of one name, and functions of other arguments."""
        symbols: set[Any] = set()
        functions: set[Any] = set()
        for expression in map(basic, expressions):
            symbols |= expression.atoms(sympy.Symbol)
            functions |= expression.atoms(AppliedUndef)
        places = {"p": self.parameters, "u": self.inputs}
        for block, items in (("p", symbols - {self.time}), ("u", functions)):
            for item in sorted(items - self.known.keys(), key=str):
                if block == "u" and item.args != (self.time,):
                    raise self._refused(f"the function {item}", "a formula, or a function of the time alone")
                name = name_of(item)
                if name in self.absent:
                    self.known[item] = self.algebra.one
                    continue
                if name in self.parameters or name in self.inputs:
                    fault = f"two symbols have the name {shown(name)} [E1146]"
                    raise DescriptionError(Problem(self.name, fault, "other names of the symbols"))
                places[block][name] = item
        for block, names in places.items():
            self.known |= dict(zip(names.values(), self.algebra.block(block, len(names)), strict=True))
        self.known[self.time] = self.algebra.block("t", 1)[0]

    def __call__(self, expression: Any) -> Scalar:
        """Return the Scalar of an expression on the tape, without recursion. Raises DescriptionError for functions,
        rates or numbers that the tape cannot hold."""
        root = basic(expression)
        pending = [root]
        while pending:
            node = pending[-1]
            if node in self.known:
                pending.pop()
                continue
            self._check(node)
            operands = self._operands(node)
            missing = [operand for operand in operands if operand not in self.known]
            if missing:
                pending += missing
                continue
            self.known[node] = self._recorded(node, [self.known[operand] for operand in operands])
            pending.pop()
        return self.known[root]

    def _check(self, node: Any) -> None:
        """Raise DescriptionError for a node without a counterpart."""
        if isinstance(node, sympy.Derivative):
            raise self._refused(f"the rate {node}", "rates of coordinates alone; a further input for the rate")
        if isinstance(node, sympy.Number | sympy.NumberSymbol) and not math.isfinite(float(node)):
            raise self._refused(f"the number {shown(str(node))}", "a finite number")
        if not isinstance(node, _KINDS):
            known = ", ".join(sorted(NAMES.values()))
            raise self._refused(f"the function {type(node).__name__}", f"one of {known}, Piecewise")

    def _operands(self, node: Any) -> Sequence[Any]:
        if isinstance(node, CharacteristicCurveFunction):
            return [node.doit(deep=False)]
        if (substitute := _REWRITTEN.get(type(node))) is not None:
            return [node.rewrite(substitute)]
        if isinstance(node, sympy.Pow) and isinstance(node.exp, sympy.Rational) and abs(node.exp.p) < 1000:
            return [node.base]
        if isinstance(node, sympy.Piecewise):
            return [part for pair in node.args for part in pair.args if part not in (sympy.true, sympy.false)]
        operands: Sequence[Any] = node.args
        return operands

    def _recorded(self, node: Any, operands: Sequence[Scalar]) -> Scalar:
        """Return the Scalar of a node of an expression; comparisons are 1 or 0. `operands` are the Scalars of
        ``_operands(node)``, which may differ from the node's arguments. The cases of a Piecewise are read from
        ``known``; without a last case DescriptionError is raised."""
        algebra, kind = self.algebra, type(node)
        if isinstance(node, (CharacteristicCurveFunction, sympy.UnevaluatedExpr, *_REWRITTEN)):
            return operands[0]
        if isinstance(node, BooleanAtom):
            return algebra.one if node else algebra.zero
        if isinstance(node, sympy.Number | sympy.NumberSymbol):
            return algebra.scalar(float(node))
        if kind is sympy.Add:
            return reduce(lambda x, y: x + y, operands)
        if kind is sympy.Mul:
            return reduce(lambda x, y: x * y, operands)
        if isinstance(node, sympy.Pow):
            return self._power(node, operands)
        if kind in _FUNCTIONS:
            return algebra.call(_FUNCTIONS[kind], operands[0])
        if kind in _PAIRS:
            return reduce(lambda x, y: algebra.call(_PAIRS[kind], x, y), operands)
        if kind in _COMPARISONS:
            op, swapped = _COMPARISONS[kind]
            first, second = reversed(operands) if swapped else operands
            return algebra.call(op, first, second)
        if kind is sympy.Not:
            return algebra.one - operands[0]
        if kind in (sympy.And, sympy.Or):
            return reduce(lambda x, y: algebra.call(Op.MIN if kind is sympy.And else Op.MAX, x, y), operands)
        if kind in (sympy.Eq, sympy.Ne):
            below, above = (algebra.call(Op.LE, x, y) for x, y in (operands, operands[::-1]))
            return below * above if kind is sympy.Eq else algebra.one - below * above
        if isinstance(node, sympy.Heaviside):
            x, at_zero = operands
            below = algebra.select(algebra.call(Op.LT, x, algebra.zero), algebra.zero, at_zero)
            return algebra.select(algebra.call(Op.LT, algebra.zero, x), algebra.one, below)
        return self._pieces(node)

    def _power(self, node: Any, operands: Sequence[Scalar]) -> Scalar:
        algebra, base = self.algebra, operands[0]
        if len(operands) == 2:
            return algebra.call(Op.POW, base, operands[1])
        exponent = node.exp
        whole, half = int(abs(exponent)), abs(exponent) % 1
        if half not in (0, sympy.Rational(1, 2)):
            return algebra.call(Op.POW, base, algebra.scalar(float(exponent)))
        result = Scalar(algebra.tape, algebra.tape.power(base.ref, whole)) if whole else algebra.one
        if half:
            result = result * algebra.call(Op.SQRT, base)
        return algebra.one / result if exponent < 0 else result

    def _pieces(self, node: Any) -> Scalar:
        result: Scalar | None = None
        for value, condition in reversed([pair.args for pair in node.args]):
            if condition is sympy.true or result is None:
                if condition is not sympy.true:
                    raise self._refused("a Piecewise without a last case", "a last case with the condition True")
                result = self.known[value]
            else:
                result = self.algebra.select(self.known[condition], self.known[value], result)
        return result if result is not None else self.algebra.zero

    def matrix(self, matrix: Any) -> Matrix:
        """Return a matrix (3, 3) of expressions on the tape."""
        return self.algebra.matrix([[self(entry) for entry in row] for row in matrix.tolist()])

    def _refused(self, fault: str, remedy: str) -> DescriptionError:
        return DescriptionError(Problem(self.name, f"{fault} has no counterpart [E1147]", remedy))


Record = Callable[[Any], Scalar]
