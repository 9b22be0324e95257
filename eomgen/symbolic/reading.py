"""References of a tape as SymPy or LaTeX expressions, in full when small, else with named intermediates.

Expressions are not simplified or reordered beyond SymPy's constructors: they show the computation as it is.
Notebooks show shorter forms.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from eomgen.symbolic.evaluate import ARITHMETIC, Arithmetic, run
from eomgen.symbolic.external import Call
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import LEAVES, NAMES, InputSymbol, Op
from eomgen.symbolic.tape import Ref, Tape

if TYPE_CHECKING:
    import sympy

    Named = tuple[list[tuple[sympy.Symbol, sympy.Expr]], sympy.Matrix]


def block_to_sympy(
    tape: Tape,
    refs: Sequence[Ref],
    shape: Sequence[int],
    *,
    named: bool | None = None,
    names: Mapping[InputSymbol, str] | None = None,
) -> sympy.Matrix | Named:
    """Return a block of references as SymPy.

    Parameters
    ----------
    refs : sequence of Ref
        Row by row.
    shape : () or (rows,) or (rows, columns)
        One number gives a 1 x 1 matrix, a vector a column.
    named : bool, optional
        True for named intermediates, False for the whole expressions; by default whole up to 200 operations. Maps are
        unrolled for reading.
    names : mapping, optional
        Of inputs, different for different inputs; see ``input_symbol`` for inputs without a name here.

    Returns
    -------
    Matrix, or (list of (Symbol, expression), Matrix)
        The list is in order of evaluation: each expression uses input symbols and earlier names ``w_0``, ``w_1``...

    Raises
    ------
    ValueError
        When the shape has more than two axes or does not hold as many entries as there are references.
    """
    import sympy  # noqa: PLC0415  # imported only for expressions in SymPy

    rows, columns = (*shape, 1, 1)[:2]
    if len(shape) > 2 or rows * columns != len(refs):
        raise ValueError(
            f"{len(refs)} references do not fill a block of shape {tuple(shape)}; it has to be (), (rows,) or (rows,"
            " columns)"
        )
    if any(tape.op[node] is Op.MAP for node in tape.live(refs)):
        source, tape = tape, Tape()
        refs = splice(tape, source, refs, {}, unrolled=True)
    live = tape.live(refs)
    if named is None:
        named = sum(tape.op[node] not in LEAVES for node in live) > 200
    worth = _worth_naming(tape, refs, live) if named else set[int]()
    intermediates: list[tuple[sympy.Symbol, sympy.Expr]] = []

    def symbol_of(symbol: InputSymbol) -> sympy.Symbol:
        name = (names or {}).get(symbol)
        return input_symbol(symbol) if name is None else sympy.Symbol(name, real=True)

    def visit(node: int, expression: Any) -> Any:
        if node not in worth or expression.is_Atom:
            return expression
        intermediates.append((sympy.Symbol(f"w_{len(intermediates)}", real=True), expression))
        return intermediates[-1][0]

    def call_results(call: Call, operands: Sequence[Any]) -> list[Any]:
        orders = "".join(f"_{len(columns)}" for columns in call.columns)
        stem = f"{call.label.replace(' ', '_')}{orders}"
        return [sympy.Function(f"{stem}_{index}")(*operands) for index in range(call.size)]

    arithmetic = Arithmetic(_sympy_rules(), _number, call=call_results)
    matrix = sympy.Matrix(rows, columns, run(tape, refs, symbol_of, arithmetic, visit))
    return (intermediates, matrix) if named else matrix


def to_latex(
    tape: Tape,
    refs: Sequence[Ref],
    shape: Sequence[int],
    *,
    name: str = "",
    named: bool | None = None,
    names: Mapping[InputSymbol, str] | None = None,
    shortest: bool = False,
) -> str:
    """Return a block as display LaTeX: ``name = matrix``, after the intermediates in ``aligned``. ``shape``, ``named``
    and ``names`` are as of ``block_to_sympy``. ``shortest`` multiplies products out in the entries of a block given
    whole, if the result is shorter."""
    import sympy  # noqa: PLC0415  # as in block_to_sympy

    block = block_to_sympy(tape, refs, shape, named=named, names=names)
    intermediates, matrix = block if isinstance(block, tuple) else ([], block)
    if shortest and not intermediates:
        matrix = matrix.applyfunc(lambda entry: min(entry, sympy.expand(entry), key=sympy.count_ops))
    symbols = set().union(matrix.free_symbols, *(value.free_symbols for _, value in intermediates))
    typeset = {symbol: text for symbol in symbols if (text := _latex_name(symbol.name))}
    expression = sympy.latex(matrix if len(shape) else matrix[0, 0], symbol_names=typeset)
    if not intermediates:
        return f"{name} = {expression}" if name else expression
    lines = [f"{sympy.latex(symbol)} &= {sympy.latex(value, symbol_names=typeset)}" for symbol, value in intermediates]
    lines.append(f"{name} &= {expression}" if name else f"& {expression}")
    return "\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}"


def _latex_name(name: str) -> str:
    r"""Return a name such as ``q_theta2`` as LaTeX, ``q_{\theta_{2}}``. Empty if no part after an underscore ends in
    digits, since SymPy sets such names as wanted."""
    import sympy  # noqa: PLC0415  # as in block_to_sympy

    head, *below = name.split("_")
    if not any(re.fullmatch(r"[A-Za-z]+\d+", part) for part in below) or not all((head, *below)):
        return ""
    parts = " ".join(sympy.latex(sympy.Symbol(part)) for part in below)
    return f"{sympy.latex(sympy.Symbol(head))}_{{{parts}}}"


def input_symbol(symbol: InputSymbol) -> sympy.Symbol:
    """Return the real SymPy symbol of an input: ``q0``, ``v1``, ``t``; ``p_0`` for parameters and longer names."""
    import sympy  # noqa: PLC0415  # as in block_to_sympy

    if symbol.block == "t":
        name = "t"
    elif len(symbol.block) == 1 and symbol.block != "p":
        name = f"{symbol.block}{symbol.index}"
    else:
        name = f"{symbol.block}_{symbol.index}"
    return sympy.Symbol(name, real=True)


def _worth_naming(tape: Tape, refs: Sequence[Ref], live: Sequence[int]) -> set[int]:
    """Return the nodes among ``live`` that are used more than once, or whose expression has more than 40
    operations."""
    uses = Counter(abs(ref) for ref in refs)
    for node in live:
        uses.update(abs(ref) for ref in tape.operands(node))
    worth: set[int] = set()
    size: dict[int, int] = {}
    for node in live:
        if tape.op[node] in LEAVES:
            size[node] = 0
            continue
        size[node] = 1 + sum(size[abs(ref)] for ref in tape.operands(node))
        if uses[node] > 1 or size[node] > 40:
            worth.add(node)
            size[node] = 0
    return worth


def _number(value: float) -> sympy.Expr:
    """Return integers, halves, quarters and eighths as exact rationals; other doubles unchanged."""
    import sympy  # noqa: PLC0415  # as in block_to_sympy

    exact = (8.0 * value).is_integer() and abs(value) < 1e15
    return sympy.Rational(int(8.0 * value), 8) if exact else sympy.Float(value)


def _sympy_rules() -> dict[Op, Callable[..., Any]]:
    """Return the SymPy function of each operation."""
    import sympy  # noqa: PLC0415  # as in block_to_sympy

    def indicator(condition: Any) -> Any:
        return sympy.Piecewise((1, condition), (0, True))

    def select(condition: Any, then: Any, otherwise: Any) -> Any:
        comparison = (
            isinstance(condition, sympy.Piecewise) and condition.args[0][0] == 1 and condition.args[1] == (0, True)
        )
        return sympy.Piecewise(
            (then, condition.args[0][1] if comparison else sympy.Ne(condition, 0)), (otherwise, True)
        )

    return {
        **ARITHMETIC,
        **{op: getattr(sympy, name) for op, name in NAMES.items()},
        Op.ATAN2: sympy.atan2,
        Op.POW: sympy.Pow,
        Op.ABS: sympy.Abs,
        Op.SIGN: sympy.sign,
        Op.MIN: sympy.Min,
        Op.MAX: sympy.Max,
        Op.LT: lambda x, y: indicator(x < y),
        Op.LE: lambda x, y: indicator(x <= y),
        Op.SELECT: select,
        Op.CURVE: lambda x, curve, derivative: sympy.Function(
            f"{curve.name}_{derivative}" if derivative else curve.name
        )(x),
    }
