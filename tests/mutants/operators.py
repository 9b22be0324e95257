"""Changes of a Python source that a test should notice, one at a time.

The operators are the usual ones of mutation testing (DeMillo, Lipton, Sayward, "Hints on test data selection", 1978):
comparison, arithmetic, constant, boolean, removed statement, swapped arguments, return value. Docstrings, texts,
exceptions' arguments, annotations, decorators, sizes of drawings and ``strict=`` are left alone.
"""

from __future__ import annotations

import ast
import bisect
import itertools
from dataclasses import dataclass

COMPARISONS: dict[type[ast.cmpop], tuple[str, tuple[str, ...]]] = {
    ast.Lt: ("<", (">=", "<=")),
    ast.LtE: ("<=", (">", "<")),
    ast.Gt: (">", ("<=", ">=")),
    ast.GtE: (">=", ("<", ">")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.In: ("in", ("not in",)),
    ast.NotIn: ("not in", ("in",)),
    ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
}
ARITHMETIC: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
}
OPERATORS = (
    *("comparison", "arithmetic", "constant", "boolean"),
    *("removed statement", "swapped arguments", "return value"),
)
#: Calls that only make a text, and calls whose first arguments are types.
TEXTS = ("Error", "Problem", "Warning", "warn", "echo", "print")
TYPED = ("isinstance", "issubclass", "cast", "TypeVar", "field")
#: Functions that give the same for arguments in either order, or nearly so.
SYMMETRIC = (
    *("max", "min", "maximum", "minimum", "hypot", "plus", "dot", "add", "mul"),
    *("isclose", "allclose", "array_equal"),
)
#: Keyword arguments that only style a drawing.
STYLES = ("alpha", "color", "dpi", "figsize", "fontsize", "labelsize", "linewidth", "lw", "markersize", "pad", "zorder")
#: Keyword arguments that only assert what holds: ``zip(..., strict=True)`` never fails in right code.
ASSERTED = ("strict",)
#: Floats below are tolerances, which a factor of 1.5 would hardly change.
SMALL = 1e-4
PRINTED = ("__repr__", "__str__", "_repr_html_", "_repr_latex_")


@dataclass(frozen=True)
class Mutant:
    """One change: bytes ``start`` to ``end`` of a file become ``new``.

    ``function`` is the qualified name of the innermost function around it, empty at the level of module or class.
    """

    file: str
    line: int
    function: str
    operator: str
    start: int
    end: int
    old: str
    new: str

    def applied(self, source: bytes) -> bytes:
        """Return the changed source, which has the same number of lines."""
        missing = "\n" * (self.old.count("\n") - self.new.count("\n"))
        return source[: self.start] + self.new.encode() + missing.encode() + source[self.end :]


def line_starts(source: bytes) -> list[int]:
    """Return the place in bytes of the start of each line."""
    return [0, *itertools.accumulate(map(len, source.splitlines(keepends=True)))]


def mutants_of(source: bytes, file: str) -> list[Mutant]:
    """Return all mutants of a file in the order of its text; ``file`` is kept as its name."""
    walk = _Walk(source, file)
    walk.visit(ast.parse(source))
    return sorted(walk.found, key=lambda mutant: (mutant.start, mutant.end, mutant.operator, mutant.new))


class _Walk(ast.NodeVisitor):
    def __init__(self, source: bytes, file: str) -> None:
        self.source, self.file = source, file
        self.found: list[Mutant] = []
        self.names: list[str] = []
        self.functions: list[tuple[str, ast.expr | None]] = []
        self.starts = line_starts(source)

    def _span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        ends = (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)
        start, end = (self.starts[line - 1] + column for line, column in ends)
        return start, end

    def _text(self, node: ast.expr | ast.stmt) -> str:
        start, end = self._span(node)
        return self.source[start:end].decode()

    def _add(self, operator: str, start: int, end: int, new: str) -> None:
        function = self.functions[-1][0] if self.functions else ""
        line = bisect.bisect_right(self.starts, start)
        old = self.source[start:end].decode()
        self.found.append(Mutant(self.file, line, function, operator, start, end, old, new))

    def _between(self, operator: str, left: ast.expr, right: ast.expr, old: str, new: str) -> None:
        """Change the sign between two operands; a gap with a comment is left alone."""
        start, end = self._span(left)[1], self._span(right)[0]
        gap = self.source[start:end]
        if b"#" not in gap and old.encode() in gap:
            at = start + gap.index(old.encode())
            self._add(operator, at, at + len(old.encode()), new)

    # statements

    def _function(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        if node.name in PRINTED:
            return
        self.names.append(node.name)
        self.functions.append((".".join(self.names), node.returns))
        for default in (*node.args.defaults, *(value for value in node.args.kw_defaults if value is not None)):
            self.visit(default)
        for statement in node.body:
            self.visit(statement)
        self.functions.pop()
        self.names.pop()

    visit_FunctionDef = visit_AsyncFunctionDef = _function

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.names.append(node.name)
        for statement in node.body:
            self.visit(statement)
        self.names.pop()

    def visit_If(self, node: ast.If) -> None:
        if ast.unparse(node.test) not in ("TYPE_CHECKING", "__name__ == '__main__'"):
            self.generic_visit(node)

    def visit_Import(self, node: ast.Import) -> None:
        """Leave imports alone."""

    def visit_Assign(self, node: ast.Assign) -> None:
        names = [target.id for target in node.targets if isinstance(target, ast.Name)]
        if any(name.startswith("__") for name in names):
            return
        if not names and not any(isinstance(target, ast.Tuple) for target in node.targets):
            self._removed(node)
        self.visit(node.value)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def _removed(self, node: ast.stmt) -> None:
        if self.functions:
            self._add("removed statement", *self._span(node), "pass")

    visit_Raise = visit_Continue = visit_Break = visit_Delete = _removed

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._removed(node)
        if type(node.op) in ARITHMETIC and not _is_text(node.value):
            old, new = ARITHMETIC[type(node.op)]
            self._between("arithmetic", node.target, node.value, f"{old}=", f"{new}=")
        self.visit(node.value)

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            if not _named(node.value).endswith(TEXTS):
                self._removed(node)
            self.visit(node.value)

    def visit_Assert(self, node: ast.Assert) -> None:
        """Leave assertions for the reader and the type checker alone."""

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is None or (isinstance(node.value, ast.Constant) and node.value.value is None):
            return
        returns = self.functions[-1][1] if self.functions else None
        annotation = "" if returns is None else ast.unparse(returns)
        if annotation == "bool":
            self._add("return value", *self._span(node.value), f"not ({self._text(node.value)})")
        elif "str" not in annotation:
            self._add("return value", *self._span(node.value), "None")
        self.visit(node.value)

    # expressions

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = [node.left, *node.comparators]
        for number, comparison in enumerate(node.ops):
            old, others = COMPARISONS[type(comparison)]
            for new in others:
                self._between("comparison", operands[number], operands[number + 1], old, new)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if type(node.op) in ARITHMETIC and not (_is_text(node.left) or _is_text(node.right)):
            self._between("arithmetic", node.left, node.right, *ARITHMETIC[type(node.op)])
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in zip(node.values, node.values[1:], strict=False):
            self._between("boolean", left, right, old, new)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.Not):
            self._add("boolean", *self._span(node), f"bool({self._text(node.operand)})")
        elif isinstance(node.op, ast.USub):
            start, _ = self._span(node)
            self._add("arithmetic", start, start + 1, "+")
        self.visit(node.operand)

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool):
            self._add("boolean", *self._span(node), str(not value))
        elif isinstance(value, int):
            self._add("constant", *self._span(node), str(value + 1))
        elif isinstance(value, float):
            factor = 1000.0 if abs(value) < SMALL else 1.5
            self._add("constant", *self._span(node), repr(factor * value if value else 1.0))

    def visit_Call(self, node: ast.Call) -> None:
        name = _named(node)
        if name.endswith(TEXTS):
            return
        first = node.args[:2]
        if (
            len(first) == 2
            and name not in (*TYPED, *SYMMETRIC)
            and not any(isinstance(one, ast.Starred) for one in first)
        ):
            left, right = (self._text(one) for one in first)
            start, end = self._span(first[0])[0], self._span(first[1])[1]
            gap = self.source[self._span(first[0])[1] : self._span(first[1])[0]].decode()
            if left != right and "#" not in gap:
                self._add("swapped arguments", start, end, f"{right}{gap}{left}")
        self.visit(node.func)
        for argument in node.args:
            self.visit(argument)
        for keyword in node.keywords:
            if keyword.arg not in (*STYLES, *ASSERTED):
                self.visit(keyword.value)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Leave texts alone."""


def _named(call: ast.Call) -> str:
    return ast.unparse(call.func).rpartition(".")[2]


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str | bytes))
