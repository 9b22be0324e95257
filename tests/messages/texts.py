"""Messages in the source: literals with a code at their end, ``the key is missing [E0312]``.

A literal that ends with ``[E]`` or ``[W]`` is a new message, which ``python -m tests.messages`` numbers.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "eomgen"
#: A code in a literal; a new message has no number yet.
CODE = re.compile(r" ?\[([EW](?:\d{4})?)\]")
#: Codes in tables, of messages of other libraries.
_CODE_ALONE = re.compile(r"[EW]\d{4}")
#: Letters of the kinds of errors by the beginning of the class.
_ERRORS = {
    "Usage": "u", "Description": "d", "Model": "m", "Toolchain": "t", "Numerical": "n", "File": "f",
}  # fmt: skip  # a table
#: Characters of a remedy: a shorter one is a value, a longer one belongs to one case.
_REMEDY = range(6, 61)
Literal = ast.Constant | ast.JoinedStr


class Text(NamedTuple):
    """A literal with a code: code, module, line, text with ``{}`` for values, remedy and letter of the kind; the last
    two are empty if they stand elsewhere."""

    code: str
    module: str
    line: int
    pattern: str
    remedy: str
    kind: str


class Module:
    """A parsed module with the parent of each node."""

    def __init__(self, name: str, source: str) -> None:
        self.name = name
        self.tree = ast.parse(source)
        self.parent = {child: node for node in ast.walk(self.tree) for child in ast.iter_child_nodes(node)}

    def literals(self) -> Iterator[Literal]:
        """Yield the literals; parts of an f-string and docstrings are none."""
        for node in ast.walk(self.tree):
            within = isinstance(self.parent.get(node), ast.JoinedStr | ast.Expr)
            if not within and isinstance(node, Literal) and (isinstance(node, ast.JoinedStr) or _is_text(node)):
                yield node

    def texts(self) -> Iterator[Text]:
        """Yield the literals with codes."""
        for node in self.literals():
            written = written_text(node)
            if codes := CODE.findall(written):
                call, remedy = self._call(node)
                yield Text(
                    codes[-1], self.name, node.lineno, pattern(written), _remedy(remedy), self._kind(call, codes[-1])
                )

    def tables(self) -> Iterator[str]:
        """Yield the codes that stand alone."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Constant) and _is_text(node) and _CODE_ALONE.fullmatch(str(node.value)):
                yield str(node.value)

    def _call(self, node: ast.AST) -> tuple[ast.AST | None, ast.expr | None]:
        """Return the call or tuple that takes a text, directly or by a name, and the remedy that it takes."""
        child, parent = node, self.parent.get(node)
        while isinstance(parent, ast.IfExp | ast.BoolOp | ast.NamedExpr | ast.BinOp):
            child, parent = parent, self.parent.get(parent)
        if isinstance(parent, ast.Assign) and isinstance(parent.targets[0], ast.Name):
            return self._user(parent, parent.targets[0].id)
        given = parent.args if isinstance(parent, ast.Call) else parent.elts if isinstance(parent, ast.Tuple) else []
        place = next((place for place, one in enumerate(given) if one is child), len(given))
        words = parent.keywords if isinstance(parent, ast.Call) else []
        return parent, next(iter([*given[place + 1 :], *(word.value for word in words if word.arg == "hint")]), None)

    def _user(self, assignment: ast.AST, name: str) -> tuple[ast.AST | None, ast.expr | None]:
        """Return the first call behind an assignment that takes the name, and the argument behind it."""
        scope = assignment
        while not isinstance(scope, ast.FunctionDef | ast.Module):
            scope = self.parent[scope]
        for call in ast.walk(scope):
            if isinstance(call, ast.Call) and call.lineno > getattr(assignment, "lineno", 0):
                for place, given in enumerate(call.args):
                    if isinstance(given, ast.Name) and given.id == name:
                        return call, next(iter(call.args[place + 1 :]), None)
        return None, None

    def _kind(self, node: ast.AST | None, code: str) -> str:
        """Return the letter of a note, or of the error around a call; empty if the error is made elsewhere."""
        while isinstance(node, ast.expr):
            name = called(node.func) if isinstance(node, ast.Call) else ""
            if letter := next((letter for start, letter in _ERRORS.items() if name == f"{start}Error"), ""):
                return letter
            node = self.parent.get(node)
        return "w" if code[0] == "W" else ""


def called(node: ast.expr) -> str:
    """Return the name of a function that is called."""
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def _is_text(node: ast.Constant) -> bool:
    return isinstance(node.value, str)


def written_text(node: ast.expr) -> str:
    """Return the text of a literal with ``{}`` for values; empty for another expression."""
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
    return str(node.value) if isinstance(node, ast.Constant) and _is_text(node) else ""


def pattern(written: str) -> str:
    """Return the text of a message without its code and with ``{}`` for values."""
    text = re.sub(r"\{[^{}]*\}", "{}", CODE.sub("", written).strip())
    return re.sub(r"(\{\})+", "{}", text).replace("\t", " ").replace("\n", "\\n")


def _remedy(node: ast.expr | None) -> str:
    text = "" if node is None else pattern(written_text(node))
    return text if len(text) in _REMEDY and letters(text) >= _REMEDY.start else ""


@cache
def modules(package: Path = PACKAGE) -> list[Module]:
    """Return all modules; readers of robots come last, since they share messages with the core."""
    made = [
        Module(
            ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__"),
            path.read_text(encoding="utf-8"),
        )
        for path in sorted(package.rglob("*.py"))
    ]
    return sorted(made, key=lambda module: module.name.startswith("eomgen.products.robots"))


def texts(package: Path = PACKAGE) -> list[Text]:
    """Return all literals with codes."""
    return [text for module in modules(package) for text in module.texts()]


def codes_of_tables(package: Path = PACKAGE) -> set[str]:
    """Return the codes that stand alone, in tables."""
    return {code for module in modules(package) for code in module.tables()}


def letters(text: str) -> int:
    """Return the number of letters of a text."""
    return sum(map(str.isalpha, text))


def unmarked(package: Path = PACKAGE) -> Iterable[str]:
    """Yield the places at which an error, a problem or a warning has a literal without a code."""
    for module in modules(package):
        for node in ast.walk(module.tree):
            name = called(node.func) if isinstance(node, ast.Call) else ""
            if not isinstance(node, ast.Call) or not (name in {"Problem", "warn"} or name[:-5] in _ERRORS):
                continue
            for given in node.args[int(name == "Problem") :][:1]:
                parts = [given.body, given.orelse] if isinstance(given, ast.IfExp) else [given]
                for written in map(written_text, parts):
                    if letters(written) >= _REMEDY.start and not CODE.search(written):
                        yield f"{module.name}:{node.lineno}: {written}"
