"""Messages by code, read from the source: texts, kinds, rooms and remedies, for explanations and searches.

The code of a message stands at the end of its literal, ``"the key is missing [E0312]"``. A search parses the modules
whose text contains its words.
"""

from __future__ import annotations

import ast
import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).parents[1]
EXAMPLES = Path(__file__).with_name("message_examples.txt")
#: A code in a literal.
CODE = re.compile(r" ?\[([EW]\d{4})\]")
#: Kinds of messages by letter; the first seven are errors in the order of exit codes.
KINDS = {
    "i": "internal error",
    "u": "usage error",
    "d": "description error",
    "m": "model error",
    "t": "toolchain error",
    "n": "numerical error",
    "f": "input/output error",
    "w": "note or warning",
    "r": "finding of a run",
}
#: Classes of errors, and reports, which become a ``DescriptionError``.
_ERROR = re.compile(r"\b(Usage|Description|Model|Toolchain|Numerical|File)Error\(|\breport\.add|\.refuse\(")
#: A remedy after a text: a shorter one is a value, a longer one belongs to one case.
_REMEDY = r',\s*(?:hint=)?f?"([^"\\\n]{6,60})(?<! \[[EW]\d{4}\])"'
Literal = ast.Constant | ast.JoinedStr


class MessageRow(NamedTuple):
    """A message of the source.

    Attributes
    ----------
    code : str
        Such as ``E0312``.
    kinds : str
        Keys of ``KINDS``; empty if it does not follow from the source.
    room : str
        Module of the source without ``eomgen``; modules of one file are one room.
    pattern : str
        Text with ``{}`` for values; the name of a finding.
    remedy : str
        Pattern of the remedy; empty if it depends on the case.
    """

    code: str
    kinds: str
    room: str
    pattern: str
    remedy: str


#: Codes of kinds of errors, for messages without a code.
_GENERAL = [
    MessageRow(f"E{number:04d}", kind, "errors", f"{KINDS[kind]}{' without a code' * (number > 1)}", "")
    for number, kind in enumerate("iudmtnf", 1)
]


@cache
def sources(package: Path = PACKAGE) -> dict[str, str]:
    """Return the text of each module with messages by the module's name without ``eomgen``; modules of products come
    last."""
    made = {}
    for path in sorted(package.rglob("*.py"), key=lambda path: ("products" in path.parts, path)):
        text = path.read_text(encoding="utf-8")
        if CODE.search(text):
            made[".".join(path.relative_to(package).with_suffix("").parts).removesuffix(".__init__")] = text
    return made


def codes(package: Path = PACKAGE) -> list[str]:
    """Return all codes in the source, errors first."""
    return sorted({code for text in sources(package).values() for code in CODE.findall(text)})


@cache
def rows(*words: str, package: Path = PACKAGE) -> tuple[MessageRow, ...]:
    """Return the messages in modules whose name or text contains all words, one row for each code in their order,
    errors first, and the general codes of kinds of errors."""
    places = dict[str, list[MessageRow]]()
    for module, text in sources(package).items():
        whole = f"{module} {text}".lower() if words else ""
        if all(word.lower() in whole for word in words):
            for row in messages(module, text):
                places.setdefault(row.code, []).append(row)
    by_code = {code: _one_row(same) for code, same in places.items()} | {row.code: row for row in _GENERAL}
    return tuple(by_code[code] for code in sorted(by_code))


def search(words: Sequence[str]) -> Iterator[MessageRow]:
    """Yield the messages that contain all words, in small or capital letters."""
    for row in rows(*words):
        text = " ".join(row).lower()
        if all(word.lower() in text for word in words):
            yield row


def code_of_finding(name: str) -> str:
    """Return the code of a check of runs by name; empty for a check of another distribution."""
    return next((row.code for row in rows(f'"{name} [w') if row.kinds == "r" and row.pattern == name), "")


def _one_row(same: Sequence[MessageRow]) -> MessageRow:
    """Return one row for a message that stands at several places: the shortest text with some words, all kinds, and the
    remedy if all places have the same."""
    kinds = "".join(dict.fromkeys("".join(row.kinds for row in same)))
    remedies = {row.remedy for row in same}
    shortest = min((row.pattern for row in same), key=lambda text: (sum(map(str.isalpha, text)) < 12, len(text)))
    return same[0]._replace(kinds=kinds, pattern=shortest, remedy=remedies.pop() if len(remedies) == 1 else "")


def messages(module: str, source: str) -> Iterator[MessageRow]:
    """Yield the messages with codes in the source of a module, in the order of lines; kind and remedy follow from the
    statement around each literal."""
    lines = source.splitlines()
    coded = [number for number, line in enumerate(lines, 1) if CODE.search(line)]
    usual = {"cli": "Usage", "scene": "Description"}.get(module.partition(".")[0], "")
    every = {error[1] or "Description" for error in _ERROR.finditer(source)}
    usual = every.pop() if len(every) == 1 else usual
    for literal, statement, end in _literals(ast.parse(source), coded):
        written, at = written_text(literal), literal.end_lineno or 0
        target = statement.targets[0] if isinstance(statement, ast.Assign) else None
        after = lines[at - 1].encode()[literal.end_col_offset :].decode() + "\n" + "\n".join(lines[at:end])
        used = re.search(rf"\b{target.id}\s*[,)].*", after, re.DOTALL) if isinstance(target, ast.Name) else None
        remedy = re.match(_REMEDY, after) or (used and re.match(r"\w+" + _REMEDY, used[0]))
        code = CODE.findall(written)[-1]
        if code[0] == "W":
            first = literal.lineno - 1
            before = lines[first][: literal.col_offset].strip() or lines[first - 1]
            kind = "r" if before.endswith("Check(") else "w"
        else:
            error = _ERROR.search("\n".join(lines[statement.lineno - 1 : end]))
            kind = (error[1] or "Description" if error else usual)[:1].lower()
        yield MessageRow(code, kind, module, pattern(written), pattern(remedy[1]) if remedy else "")


def _literals(
    node: ast.AST, coded: Sequence[int], statement: ast.stmt | None = None, end: int = 0
) -> Iterator[tuple[Literal, ast.stmt, int]]:
    """Yield each literal with a code below a node, with statement and last line of the function around. ``coded`` are
    the lines with codes, in order; ``statement`` and ``end`` are these of the node."""
    if isinstance(node, ast.stmt):
        statement, end = node, end or node.end_lineno or 0
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        end = node.end_lineno or 0
    if isinstance(node, Literal) and statement is not None and CODE.search(written_text(node)):
        yield node, statement, end
    elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):  # a docstring
        for child in ast.iter_child_nodes(node):
            first, last = getattr(child, "lineno", 0), getattr(child, "end_lineno", coded[-1])
            if bisect_left(coded, first) < bisect_right(coded, last):
                yield from _literals(child, coded, statement, end)


def written_text(node: ast.expr) -> str:
    """Return the text of a literal with ``{}`` for values; empty for another expression."""
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
    return str(node.value) if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def pattern(written: str) -> str:
    """Return the text of a message without its code and with ``{}`` for values."""
    text = re.sub(r"\{[^{}]*\}", "{}", CODE.sub("", written).strip())
    return re.sub(r"(\{\})+", "{}", text)
