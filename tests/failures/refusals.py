"""Texts by which the code refuses or ends a run, read from its syntax trees, and which of them a test reads.

A text is what a ``Problem`` or an error of eomgen's is made with, the text of a ``Status`` and the reason of a
``Need``. It is followed through names, conditions, sums, tables and functions of the same file. A test reads it where
one of its strings holds four words of it in a row that no other text has, or the text has no such words.
"""

from __future__ import annotations

import ast
import itertools
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import eomgen

ROOT = Path(__file__).parents[2]
#: Words in a row by which a text is known.
RUN = 4
#: Where the text is, by what is called: its place among the arguments, and its name.
_TEXTS: Mapping[str, tuple[int, str]] = {
    "Problem": (1, "what"),
    "Status": (2, "text"),
    "SystemRequirement": (2, "reason"),
}
_ERRORS = frozenset(name for name in eomgen.__all__ if name.endswith("Error"))
_DEEPEST = 6

#: A text: its constant parts, between what is filled in.
Parts = tuple[str, ...]


@dataclass(frozen=True)
class Refusal:
    """A text and where it is made."""

    place: str
    parts: Parts

    @property
    def text(self) -> str:
        return "#".join(self.parts)

    @property
    def runs(self) -> frozenset[str]:
        """Words in a row; all words of a part where it has fewer."""
        return frozenset(run for part in self.parts for run in runs(part))


def words(text: str) -> list[str]:
    """Return the words of a text, or of a pattern of one, without the code at its end."""
    return re.findall(r"[\w'^/]+", re.sub(r"\\[dSsw][+*]?|\[[EW]\d{4}\]", " # ", text))


def runs(text: str) -> Iterator[str]:
    """Yield all words in a row."""
    found = words(text)
    for first in range(len(found) - RUN + 1):
        yield " ".join(found[first : first + RUN])


def unread(refusals: Sequence[Refusal], tested: Collection[str]) -> list[Refusal]:
    """Return the refusals that no test reads, by all words in a row of the texts of tests."""
    common = Counter(run for text in {refusal.parts for refusal in refusals} for run in Refusal("", text).runs)
    found = []
    for refusal in refusals:
        own = {run for run in refusal.runs if common[run] == 1} or refusal.runs
        if own and not any(run in tested for run in own):
            found.append(refusal)
    return found


def texts_of_tests(files: Collection[Path]) -> frozenset[str]:
    """Return all words in a row of all strings of files, docstrings aside."""
    found: set[str] = set()
    for file in files:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        said = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in said:
                found.update(runs(node.value))
    return frozenset(found)


def refusals_in(file: Path) -> list[Refusal]:
    """Return the refusals of a file."""
    return refusals_of(file.read_text(encoding="utf-8"), str(file.relative_to(ROOT)))


def refusals_of(source: str, name: str) -> list[Refusal]:
    """Return the refusals of a source text."""
    walk = _Walk(ast.parse(source))
    found = [
        Refusal(f"{name}:{call.lineno}", parts)
        for call, scopes in walk.calls
        for argument in _said(call)
        for parts in walk.texts(argument, scopes, _DEEPEST)
    ]
    return list(dict.fromkeys(refusal for refusal in found if refusal.runs))


def _said(call: ast.Call) -> list[ast.expr]:
    name = _name(call.func)
    if name in _ERRORS:
        return call.args[:1]
    if name not in _TEXTS:
        return []
    place, keyword = _TEXTS[name]
    return [*call.args[place : place + 1], *(entry.value for entry in call.keywords if entry.arg == keyword)]


def _name(of: ast.expr) -> str:
    return of.id if isinstance(of, ast.Name) else of.attr if isinstance(of, ast.Attribute) else ""


class _Walk(ast.NodeVisitor):
    """The calls of a file, with the functions that each is in, innermost first."""

    def __init__(self, tree: ast.Module) -> None:
        self.calls: list[tuple[ast.Call, tuple[ast.AST, ...]]] = []
        self._scopes: tuple[ast.AST, ...] = (tree,)
        self._functions = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
        self.visit(tree)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        outer, self._scopes = self._scopes, (node, *self._scopes)
        self.generic_visit(node)
        self._scopes = outer

    def visit_Call(self, node: ast.Call) -> None:
        self.calls.append((node, self._scopes))
        self.generic_visit(node)

    def texts(self, node: ast.expr, scopes: tuple[ast.AST, ...], depth: int) -> list[Parts]:
        """Return all that an expression may say; nothing where it is said elsewhere."""
        if depth == 0:
            return []
        if isinstance(node, ast.Constant):
            return [tuple(re.split(r"\{[^}]*\}", node.value))] if isinstance(node.value, str) else []
        if isinstance(node, ast.JoinedStr):
            return self._joined(node, scopes, depth)
        if isinstance(node, ast.IfExp | ast.BoolOp):
            several = [node.body, node.orelse] if isinstance(node, ast.IfExp) else node.values
            return [text for part in several for text in self.texts(part, scopes, depth)]
        if isinstance(node, ast.BinOp):
            sides = [self.texts(side, scopes, depth) or [("",)] for side in (node.left, node.right)]
            return [left + right for left, right in itertools.product(*sides)]
        if isinstance(node, ast.Name):
            return [text for value in _values(node.id, scopes) for text in self.texts(value, scopes, depth - 1)]
        if isinstance(node, ast.Subscript):
            table = [value for value in _values(_name(node.value), scopes) if isinstance(value, ast.Dict)]
            return [text for row in table for value in row.values for text in self.texts(value, scopes, depth - 1)]
        if isinstance(node, ast.Call):
            return self._returned(node, scopes, depth)
        return []

    def _joined(self, node: ast.JoinedStr, scopes: tuple[ast.AST, ...], depth: int) -> list[Parts]:
        several: list[Parts] = [("",)]
        for part in node.values:
            if isinstance(part, ast.Constant):
                several = [(*text[:-1], text[-1] + str(part.value)) for text in several]
            elif isinstance(part, ast.FormattedValue):
                filled = self.texts(part.value, scopes, depth - 1) if _holds_words(part.value) else []
                several = [(*text, *more, "") for text in several for more in filled or [()]]
        return several

    def _returned(self, node: ast.Call, scopes: tuple[ast.AST, ...], depth: int) -> list[Parts]:
        if isinstance(node.func, ast.Attribute) and node.func.attr == "format":
            return self.texts(node.func.value, scopes, depth)
        function = self._functions.get(_name(node.func))
        if function is None or function in scopes:
            return []
        returned = [entry.value for entry in ast.walk(function) if isinstance(entry, ast.Return) and entry.value]
        return [text for value in returned for text in self.texts(value, (function, *scopes), depth - 1)]


def _holds_words(node: ast.expr) -> bool:
    """Return whether what is filled in may hold words of its own that are no name: a condition or a text."""
    return isinstance(node, ast.IfExp | ast.Name | ast.Subscript)


def _values(name: str, scopes: tuple[ast.AST, ...]) -> list[ast.expr]:
    """Return what a name is set to in the innermost scope that sets it."""
    for scope in scopes:
        found: list[ast.expr] = []
        for node in ast.walk(scope):
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            for target in targets:
                found += _assigned(name, target, getattr(node, "value", None))
        if found:
            return found
    return []


def _assigned(name: str, target: ast.AST | None, value: ast.expr | None) -> list[ast.expr]:
    if value is None:
        return []
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
        pairs = zip(target.elts, value.elts, strict=True)
        return [entry for inner, of in pairs for entry in _assigned(name, inner, of)]
    if isinstance(target, ast.Tuple) and isinstance(value, ast.IfExp):
        return [*_assigned(name, target, value.body), *_assigned(name, target, value.orelse)]
    return [value] if isinstance(target, ast.Name) and target.id == name else []
