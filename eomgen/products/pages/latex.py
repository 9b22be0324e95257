"""The equations of motion of a System as a LaTeX document: definitions with units, then M, h, b, Q and the constraints.

All terms are read from the tape together, so that an expression used several times has one name. Expressions that
do not fit a line are broken between summands, and long factors are given names.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import sympy
from sympy.core.alphabets import greeks

from eomgen.base.data import dataclass, replace
from eomgen.codegen.targets.c.templates import environment
from eomgen.compiled.coordinates import coordinate_units
from eomgen.pipeline.documents import as_document
from eomgen.pipeline.pipeline import derive
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.reading import block_to_sympy, input_symbol
from eomgen.system.description import Description
from eomgen.system.notebook import equation
from eomgen.system.system import BASE_LAYOUT, System

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene

#: Terms of a document: symbol in LaTeX, title.
TERMS: Mapping[str, tuple[str, str]] = {
    "mass": ("M", "Inertia matrix"),
    "coupling": ("h", "Nonlinear coupling vector: inertia terms quadratic in the velocities"),
    "base_motion": ("b", "Inertia terms of the moving base"),
    "force": ("Q", "Generalized force"),
    "internal_rate": ("f", r"Rates of the internal states, $\dot z = f$"),
    "constraint": (r"\Phi", r"Holonomic constraints, $\Phi = 0$"),
    "constraint_jacobian": ("B", r"Jacobian of the constraints: the derivative of the constraints along $w$ is $B w$"),
}
_MATRICES = ("mass", "constraint_jacobian")
_AXES = ("x", "y", "z")
_QUATERNION = ("w", "x", "y", "z")
#: Letters of the fields of the base struct.
_OF_BASE = {
    "quaternion": "p",
    "position": "x",
    "omega": r"\omega",
    "velocity": "v",
    "omega_dot": r"\dot{\omega}",
    "velocity_dot": r"\dot{v}",
}
_BASE_UNITS = {name: meaning.rpartition(", ")[2] for name, _, meaning in BASE_LAYOUT} | {"quaternion": ""}
_BASE = {
    f"base_{name}_{axis}": (name, axis, meaning.removesuffix(f", {_BASE_UNITS[name]}"))
    for name, size, meaning in BASE_LAYOUT
    for axis in (_QUATERNION if size == len(_QUATERNION) else _AXES)
}
_SPECIAL = str.maketrans(
    {
        **{letter: f"\\{letter}" for letter in "&%$#_{}"},
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "\\": r"\textbackslash{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
    }
)


@dataclass(frozen=True)
class DefinedSymbol:
    """A symbol of a document.

    Attributes
    ----------
    name : as in ``System.sympy`` and in JSON
    meaning, unit : text
    value : of a parameter, NaN if a build calculates it, and the start of an internal state; None if there is none
    """

    name: str
    meaning: str
    unit: str = ""
    value: float | None = None


@dataclass(frozen=True)
class SymbolicTerms:
    """Terms of a System as expressions of SymPy in the names of the definitions.

    Attributes
    ----------
    shared : named expressions in order of evaluation, in symbols and in earlier names
    terms : matrix of each term
    base : law of each component of the base's motion that the terms contain
    definitions : symbols by title of the table
    """

    shared: tuple[tuple[sympy.Symbol, sympy.Expr], ...]
    terms: Mapping[str, sympy.Matrix]
    base: tuple[tuple[sympy.Symbol, sympy.Expr], ...]
    definitions: Mapping[str, tuple[DefinedSymbol, ...]]

    def as_json(self) -> dict[str, Any]:
        """Return the equations as JSON types; expressions are texts in SymPy's words."""
        return {
            "definitions": {title: [vars(item) for item in items] for title, items in self.definitions.items()},
            "shared": [[symbol.name, str(value)] for symbol, value in self.shared],
            "base": [[symbol.name, str(value)] for symbol, value in self.base],
            "terms": {
                name: {
                    "symbol": TERMS[name][0].strip("\\"),
                    "shape": list(matrix.shape),
                    "entries": [list(map(str, row)) for row in matrix.tolist()],
                }
                for name, matrix in self.terms.items()
            },
        }


def with_symbols(scene: Scene, *, every: bool = False) -> tuple[System, Description]:
    """Return the System of a document, and the description.

    Parameters
    ----------
    scene : Scene
        Of any source.
    every : bool, optional
        Whether fixed parameters are symbols as well; a number that was calculated from them when the scene was read
        stays a number.
    """
    if every:
        scene = replace(scene, parameters=tuple(replace(item, tunable=True) for item in scene.parameters))
    document, front_end = as_document(scene)
    described = front_end.describe(document)
    system = derive(scene, list(TERMS))
    made = {name for item in scene.feedback for name in item.calibrated_parameters}  # a build calculates these gains
    return replace(
        system,
        parameters=tuple(replace(item, value=math.nan) if item.name in made else item for item in system.parameters),
    ), described


def equations(system: System, described: Description, *, width: int = 96) -> SymbolicTerms:
    """Return the terms of a System as expressions that fit lines.

    Parameters
    ----------
    system : System
        With terms of ``TERMS``.
    described : Description
        Units, values and meanings of the symbols.
    width : int, optional
        Characters of a line, about.

    Returns
    -------
    SymbolicTerms
    """
    blocks = {name: system.functions[name].outputs[0] for name in TERMS if name in system.functions}
    refs = [ref for block in blocks.values() for ref in block.refs]
    names = system.symbol_names | {InputSymbol("base", index): name for index, name in enumerate(_BASE)}
    moved = {symbol for symbol in system.tape.depends_on(refs) if symbol.block == "base"}
    laws = [ref for block in system.functions["base"].outputs for ref in block.refs] if moved else []
    places = sorted(symbol.index for symbol in moved)
    refs += [laws[index] for index in places]
    expressions = block_to_sympy(system.tape, refs, (len(refs),), names=names)
    intermediates, column = expressions if isinstance(expressions, tuple) else ([], expressions)
    shared, entries = _named_entries(intermediates, column, width)
    terms, first = {}, 0
    for name, block in blocks.items():
        rows, columns = (*block.shape, 1)[:2]
        terms[name] = sympy.Matrix(rows, columns, entries[first : first + rows * columns])
        first += rows * columns
    used = {symbol.name for value in (*entries, *(value for _, value in shared)) for symbol in value.free_symbols}
    used |= {names[InputSymbol("base", index)] for index in places}
    base = zip(
        (sympy.Symbol(names[InputSymbol("base", index)], real=True) for index in places), entries[first:], strict=True
    )
    return SymbolicTerms(tuple(shared), terms, tuple(base), _definitions(system, described, names, used))


def _named_entries(
    intermediates: Iterable[tuple[sympy.Symbol, sympy.Expr]], column: Iterable[sympy.Expr], width: int
) -> tuple[list[tuple[sympy.Symbol, sympy.Expr]], list[Any]]:
    """Return (symbol, expression) of named subexpressions, and the entries of ``column`` in these names, all within
    ``width``. ``intermediates`` are the shared subexpressions of the tape; very short ones are put in."""
    inlined: dict[sympy.Symbol, sympy.Expr] = {}
    naming = _Naming(width)
    for symbol, value in intermediates:
        expression = value.xreplace(inlined)
        # a name for cos(q) or -q is longer than the expression
        inlined[symbol] = expression if sympy.count_ops(expression) <= 1 else naming.symbol(expression)
    entries = [entry.xreplace(inlined) for entry in column]
    # multiplied out if that is shorter
    return naming.number([naming.fit(min(item, sympy.expand(item), key=sympy.count_ops)) for item in entries])


class _Naming:
    """Named expressions, each of which fits a line or is broken between summands.

    Parameters
    ----------
    width : of a line
    """

    def __init__(self, width: int) -> None:
        self.width = width
        self.made: dict[sympy.Expr, sympy.Symbol] = {}

    def symbol(self, expression: sympy.Expr) -> sympy.Symbol:
        """Return the symbol for an expression, the same for equal expressions; long factors get symbols, too."""
        value = self.fit(expression)
        if value not in self.made:
            self.made[value] = sympy.Dummy(real=True)
        return self.made[value]

    def fit(self, expression: sympy.Expr) -> sympy.Expr:
        """Return an expression whose summands fit a line each, with symbols for long factors."""
        if _length(expression) <= self.width:
            return expression
        if expression.is_Add:
            return expression.func(*(self.fit(term) for term in expression.args))
        return expression.func(*(self._part(part) for part in expression.args))

    def _part(self, argument: Any) -> Any:
        """Return an argument of an operation, by name if longer than a third of a line."""
        if hasattr(argument, "cond"):  # a branch of a piecewise expression
            return argument.func(self._part(argument.expr), argument.cond)
        return argument if argument.is_Atom or 3 * _length(argument) <= self.width else self.symbol(argument)

    def number(self, entries: Sequence[sympy.Expr]) -> tuple[list[tuple[sympy.Symbol, sympy.Expr]], list[Any]]:
        """Return the named expressions as ``w_1``, ``w_2``, ... in order of evaluation, and entries in these names."""
        final: dict[sympy.Symbol, sympy.Symbol] = {}
        shared = []
        for value, symbol in self.made.items():
            final[symbol] = sympy.Symbol(f"w_{len(final) + 1}", real=True)
            shared.append((final[symbol], value.xreplace(final)))
        return shared, [entry.xreplace(final) for entry in entries]


def _length(expression: sympy.Expr) -> int:
    """Return the number of characters of an expression, about as typeset."""
    return len(re.sub(r"[\s*]|(?<=\w)_", "", str(expression)))


# -- symbols -----------------------------------------------------------------------------------------------------------


def _definitions(
    system: System, described: Description, names: Mapping[InputSymbol, str], used: set[str]
) -> dict[str, tuple[DefinedSymbol, ...]]:
    """Return the symbols of a document by title of the table, empty tables left out. Components of the base and time
    are listed only if in ``used``; ``names`` are the names of the symbols."""

    def name_of(block: str, index: int) -> str:
        symbol = InputSymbol(block, index)
        return names.get(symbol) or str(input_symbol(symbol).name)

    def table_of(block: str, word: str, items: Sequence[Any], values: Sequence[float | None]) -> list[DefinedSymbol]:
        return [
            DefinedSymbol(name_of(block, index), item.description or f"{word} {item.name}", item.unit, value)
            for index, (item, value) in enumerate(zip(items, values, strict=True))
        ]

    q_units, v_units = coordinate_units(system.factors, described.coordinates)
    joints = {hinge.name: f"{hinge.type} joint {hinge.name}" for hinge in described.drawing.hinges}
    coordinates, velocities = [], []
    for factor in system.factors:
        owner = joints.get(factor.name, factor.name)
        of_q, of_v = _meanings(factor.group, factor.q_size, factor.v_size)
        for index, meaning in enumerate(of_q, factor.q_start):
            coordinates.append(DefinedSymbol(name_of("q", index), f"{meaning}, {owner}", q_units[index]))
        for index, meaning in enumerate(of_v, factor.v_start):
            velocities.append(DefinedSymbol(name_of("v", index), f"{meaning}, {owner}", v_units[index]))
    tables = {
        "Coordinates": coordinates,
        "Velocities": velocities,
        "Parameters": table_of("p", "parameter", system.parameters, [item.value for item in system.parameters]),
        "Inputs": table_of("u", "input", system.inputs, [None] * len(system.inputs)),
        "Internal states": table_of("z", "state", system.states, [item.value for item in system.states]),
        "Multipliers": [
            DefinedSymbol(f"lam_{index}", f"multiplier of {name}", "N m" if unit.startswith("1") else "N")
            for index, (name, unit) in enumerate(zip(system.multipliers, system.row_units, strict=True))
        ],
        "Motion of the base": [
            DefinedSymbol(name, f"{meaning}, {axis}", _BASE_UNITS[field])
            for name, (field, axis, meaning) in _BASE.items()
            if name in used
        ],
        "Time": [DefinedSymbol("t", "time", "s")] if "t" in used else [],
    }
    return {title: tuple(items) for title, items in tables.items() if items}


def _meanings(group: str, q_size: int, v_size: int) -> tuple[list[str], list[str]]:
    """Return in words the meaning of each coordinate and each velocity of a factor of this group."""
    if group == "R":
        parts = [""] if q_size == 1 else [f" {index}" for index in range(q_size)]
        return [f"coordinate{part}" for part in parts], [f"rate of the coordinate{part}" for part in parts]
    axes = "inertial axes" if group == "R3xSO3" else "body axes"
    q = [f"orientation, {part} of the quaternion" for part in _QUATERNION] + [
        f"position along {axis}" for axis in _AXES
    ]
    v = [f"angular velocity about {axis}, body axes" for axis in _AXES]
    v += [f"velocity along {axis}, {axes}" for axis in _AXES]
    return q[:q_size], v[:v_size]


def typeset_symbols(names: Iterable[str]) -> dict[str, str]:
    """Return names as LaTeX: words upright, letters and Greek letters as such, parts after an underscore as an index.

    Names that would look alike, ``theta2`` and ``theta_2``, are set letter by letter.
    """
    made = {name: _typeset(name) for name in names}
    counts = Counter(made.values())
    return {name: text if counts[text] == 1 else rf"\mathtt{{{_text(name)}}}" for name, text in made.items()}


def _typeset(name: str) -> str:
    if name in _BASE:
        field, axis, _ = _BASE[name]
        return f"{_OF_BASE[field]}_{{B,{axis}}}"
    if match := re.fullmatch(r"lam_(\d+)", name):
        return rf"\lambda_{{{int(match[1]) + 1}}}"
    greek = {*greeks} - {"omicron"}
    head, *below = [
        part if len(part) == 1 or part.isdigit() else f"\\{part}" if part in greek else rf"\mathrm{{{part}}}"
        for part in re.findall(r"[^\W\d_]+|\d+", name)
    ] or [_text(name)]
    return f"{head}_{{{_SPACE.join(below)}}}" if below else head


_SPACE = r"\,"


def _text(text: str) -> str:
    return text.translate(_SPECIAL)


# -- the document ------------------------------------------------------------------------------------------------------


def document(system: System, parts: SymbolicTerms, *, width: int = 96) -> str:
    """Return a whole document: the equation of motion, tables of symbols with units, named expressions, and terms.

    Parameters
    ----------
    system : System
        With terms of ``TERMS``.
    parts : SymbolicTerms
        The result of ``equations`` for this system: terms, named expressions and tables of symbols.
    width : int, optional
        Characters of a line, about.

    Returns
    -------
    str
        For any LaTeX with the packages amsmath, geometry and longtable.
    """
    tables = parts.definitions
    names = [item.name for items in tables.values() for item in items]
    typeset = typeset_symbols([*names, *(symbol.name for symbol, _ in parts.shared)])

    def latex(expression: Any) -> str:
        symbols = {symbol: typeset[symbol.name] for symbol in expression.free_symbols if symbol.name in typeset}
        return str(sympy.latex(expression, symbol_names=symbols, mul_symbol=_SPACE))

    facts = system.facts
    motion = equation(
        base=facts.moving_base,
        constraints=facts.constraints,
        states=bool(system.states),
        inputs=bool(system.inputs),
    )

    def rows_of(equations: Iterable[tuple[sympy.Symbol, sympy.Expr]]) -> list[str]:
        return [row for symbol, value in equations for row in _rows(latex(symbol), value, latex, width)]

    return (
        environment()
        .get_template("pages/equations.tex.jinja")
        .render(
            name=_text(system.name),
            description=_text(system.description),
            motion=motion,
            turns=any(factor.group != "R" for factor in system.factors),
            symmetric="mass" in parts.terms,
            tables=tables,
            typeset=typeset,
            text=_text,
            unit=_unit,
            number=lambda value: "" if value is None or math.isnan(value) else f"{value:.9g}",
            shared=rows_of(parts.shared),
            terms=[(TERMS[name][1], *_term(name, matrix, latex, width)) for name, matrix in parts.terms.items()],
            base=rows_of(parts.base),
        )
    )


def _unit(label: str) -> str:
    """Return a label such as ``kg m^2`` as LaTeX."""
    words = re.sub(r"[^\W\d_]+", r"\\mathrm{\g<0>}", label).replace("%", r"\%")
    return "" if not label else "$" + re.sub(r"\^(-?[0-9.]+)", r"^{\1}", words).replace(" ", _SPACE) + "$"


def _term(name: str, matrix: sympy.Matrix, latex: Callable[[Any], str], width: int) -> tuple[str, list[str]]:
    """Return the LaTeX of a term as one matrix, if this fits the line, or else, with an empty text, the lines of the
    equations for entries that are not zero. ``latex`` prints an expression; only the upper triangle of M is listed."""
    symbol, (rows, columns) = TERMS[name][0], matrix.shape
    lengths = [max(_length(entry) for entry in matrix[:, column]) for column in range(columns)]
    if sum(lengths) + 3 * columns <= width:
        body = " \\\\\n".join(" & ".join(map(latex, row)) for row in matrix.tolist())
        return f"\\[ {symbol} = \\begin{{bmatrix}}\n{body}\n\\end{{bmatrix}} \\]", []
    lines: list[str] = []
    for row, column in product(range(rows), range(columns)):
        if matrix[row, column] != 0 and (symbol != "M" or row <= column):
            index = f"{row + 1},{column + 1}" if name in _MATRICES else f"{row + 1}"
            lines += _rows(f"{symbol}_{{{index}}}", matrix[row, column], latex, width)
    return "", lines


def _rows(left: str, expression: Any, latex: Callable[[Any], str], width: int) -> Iterator[str]:
    """Yield the LaTeX lines of an equation ``left`` = expression, broken between summands at about ``width``."""
    summands = expression.as_ordered_terms() if expression.is_Add else [expression]
    line, length = f"{left} &= ", 0
    for index, summand in enumerate(summands):
        text, size = latex(summand), _length(summand)
        if index and length + size > width:
            yield line
            line, length = r"&\quad ", 0
        line += text if not index or text.startswith("-") else f" + {text}"
        length += size
    yield line
