"""Places of codes in the texts of messages: a code stands at the end of a whole fault, and a text has one code."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator

from eomgen.base.message_codes import CODE, written_text

#: A code in the middle of a text; a remedy may follow, as "; try: ..." or as "; ...".
_MIDDLE = re.compile(r"\[[EW]\d{4}\](?!$|; )")
_ERRORS = ("Usage", "Description", "Model", "Toolchain", "Numerical", "File")
#: A call whose text needs a code; a file without one has no such text.
_MESSAGE = re.compile(rf"\b(?:Problem|warn|(?:{'|'.join(_ERRORS)})\w{{5}})\s*\(")
#: Letters of a text at least; one with fewer is part of another.
_FEWEST = 6
_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
#: Values that may be the text of a message; a call makes a new text of its own.
_TEXTS = (ast.Constant, ast.JoinedStr, ast.IfExp, ast.BinOp, ast.Name)


def unmarked(source: str, nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Yield line and text of each error, problem or warning that has a literal without a code, in the nodes of a
    source."""
    for node in nodes if _MESSAGE.search(source) else ():
        name = getattr(node.func, "id", getattr(node.func, "attr", "")) if isinstance(node, ast.Call) else ""
        if not isinstance(node, ast.Call) or not (name in {"Problem", "warn"} or name[:-5] in _ERRORS):
            continue
        for given in node.args[int(name == "Problem") :][:1]:
            parts = [given.body, given.orelse] if isinstance(given, ast.IfExp) else [given]
            for written in map(written_text, parts):
                if letters(written) >= _FEWEST and not CODE.search(written):
                    yield f"{node.lineno}: {written}"


def misplaced_codes(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Yield line and text of each literal that continues behind a code, and of each text with two codes, in the nodes
    of a source.

    Names that hold a text with a code are followed from statement to statement: no text is added to such a name, and a
    literal around such a name adds no more than a place before it and a remedy behind it.
    """
    for scope in nodes:
        if isinstance(scope, (ast.Module, *_SCOPES)):
            coded: set[str] = set()
            for statement in scope.body:
                yield from (f"{line}: {text}" for line, text in _misplaced(statement, coded))


def _misplaced(node: ast.AST, coded: set[str]) -> Iterator[tuple[int, str]]:
    if isinstance(node, _SCOPES) or _is_docstring(node):
        return
    if isinstance(node, ast.JoinedStr | ast.Constant):
        yield from _faults_of_literal(node, coded)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add) and _has_code(node.left, coded):
        yield node.lineno, ast.unparse(node)
    for part in node.values if isinstance(node, ast.JoinedStr) else ast.iter_child_nodes(node):
        if not (isinstance(node, ast.JoinedStr) and isinstance(part, ast.Constant)):  # a part of the literal
            yield from _misplaced(part, coded)
    if isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add):
        adds_to_entry = isinstance(node.target, ast.Subscript) and written_text(node.value) != ""
        if adds_to_entry or (isinstance(node.target, ast.Name) and node.target.id in coded):
            yield node.lineno, ast.unparse(node)
    if isinstance(node, ast.Assign | ast.NamedExpr):
        _follow_names(node, coded)


def _faults_of_literal(node: ast.JoinedStr | ast.Constant, coded: set[str]) -> Iterator[tuple[int, str]]:
    text = written_text(node)
    if _MIDDLE.search(text) or len(CODE.findall(text)) > 1:
        yield node.lineno, text
    parts = node.values if isinstance(node, ast.JoinedStr) else []
    for place, part in enumerate(parts):
        if isinstance(part, ast.FormattedValue) and _has_code(part.value, coded):
            rest = written_text(ast.JoinedStr(values=parts[place + 1 :]))
            if CODE.search(text) or (rest and not rest.startswith(("; ", ", or "))):
                yield node.lineno, text


def letters(text: str) -> int:
    """Return the number of letters of a text."""
    return sum(map(str.isalpha, text))


def _is_docstring(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _has_code(node: ast.AST, coded: set[str]) -> bool:
    """Return whether an expression has a literal with a code, or a name that holds one."""
    return any(
        CODE.search(written_text(part)) if isinstance(part, ast.Constant) else getattr(part, "id", None) in coded
        for part in ast.walk(node)
    )


def _follow_names(node: ast.Assign | ast.NamedExpr, coded: set[str]) -> None:
    """Note the names that hold a text with a code from now on, and those that hold another value."""
    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
    pairs = [(target, node.value)]
    if isinstance(target, ast.Tuple):
        values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value] * len(target.elts)
        pairs = list(zip(target.elts, values, strict=False))
    for name, value in pairs:
        if isinstance(name, ast.Name):
            holds = isinstance(value, _TEXTS) and _has_code(value, coded)
            (coded.add if holds else coded.discard)(name.id)
