"""Upkeep of messages: ``python -m tests.messages`` numbers new messages, and renews the examples of codes.

A literal that ends with ``[E]`` or ``[W]`` gets the number behind the last one, also if the message of the last number
is gone, so no code is used twice.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

from eomgen.base.message_codes import CODE, EXAMPLES, PACKAGE, rows, sources, written_text
from tests.failures.catalogue import CHAPTERS
from tests.failures.errors_page import shown_entry

COMMAND = "python -m tests.messages"
LAST = Path(__file__).with_name("last_codes.json")
#: Characters of an example at most.
_LONGEST_EXAMPLE = 420
_NEW = re.compile(r" \[([EW])\](?=[\"']|; )")
_USED = re.compile(r"\[([EW])(\d{4})\]")
_ERRORS = ("Usage", "Description", "Model", "Toolchain", "Numerical", "File")
#: A call whose text needs a code; a file without one is not parsed.
_MESSAGE = re.compile(rf"\b(?:Problem|warn|(?:{'|'.join(_ERRORS)})\w{{5}})\s*\(")
#: Letters of a text at least; one with fewer is part of another.
_FEWEST = 6


def examples() -> str:
    """Return the examples of codes: entries of the catalogue of bad inputs with their answers, one for each code."""
    made: list[str] = []
    known: set[str] = set()
    for _, _, entries in CHAPTERS:
        for entry in entries:
            codes = re.findall(r" \[([EW]\d{4})\]$", entry.message, re.MULTILINE)
            fresh = [code for code in dict.fromkeys(codes) if code not in known]
            text = shown_entry(entry)
            if fresh and len(text) <= _LONGEST_EXAMPLE:
                known.update(fresh)
                made.append(f"= {','.join(fresh)} {entry.title}\n{text}\n")
    return "\n" + "\n".join(made)


def number_new(package: Path = PACKAGE) -> dict[str, int]:
    """Write the next codes at the ends of new messages, and return the last numbers."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}
    last: dict[str, int] = json.loads(LAST.read_text(encoding="utf-8"))
    for letter, number in _USED.findall("\n".join(texts.values())):
        last[letter] = max(last[letter], int(number))

    def numbered(found: re.Match[str]) -> str:
        last[found[1]] += 1
        return f" [{found[1]}{last[found[1]]:04d}]"

    for path, text in texts.items():
        if _NEW.search(text):
            path.write_text(_NEW.sub(numbered, text), encoding="utf-8")
    return last


def letters(text: str) -> int:
    """Return the number of letters of a text."""
    return sum(map(str.isalpha, text))


def unmarked(package: Path = PACKAGE) -> Iterator[str]:
    """Yield the places at which an error, a problem or a warning has a literal without a code."""
    for path in sorted(package.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)) if _MESSAGE.search(source) else ():
            name = getattr(node.func, "id", getattr(node.func, "attr", "")) if isinstance(node, ast.Call) else ""
            if not isinstance(node, ast.Call) or not (name in {"Problem", "warn"} or name[:-5] in _ERRORS):
                continue
            for given in node.args[int(name == "Problem") :][:1]:
                parts = [given.body, given.orelse] if isinstance(given, ast.IfExp) else [given]
                for written in map(written_text, parts):
                    if letters(written) >= _FEWEST and not CODE.search(written):
                        yield f"{path.relative_to(package)}:{node.lineno}: {written}"


def main() -> int:
    """Number new messages, and renew the examples."""
    LAST.write_text(json.dumps(number_new()) + "\n", encoding="utf-8")
    sources.cache_clear()
    rows.cache_clear()
    EXAMPLES.write_text(examples(), encoding="utf-8")
    return 0
