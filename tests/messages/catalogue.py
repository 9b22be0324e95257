"""Upkeep of messages: ``python -m tests.messages`` numbers new messages, and renews the examples of codes.

The answers of the examples are the answers of today: read the differences before they are committed.

A literal that ends with ``[E]`` or ``[W]`` gets the number behind the last one, also if the message of the last number
is gone, so no code is used twice.
"""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Callable
from pathlib import Path

from eomgen.base.message_codes import EXAMPLES, PACKAGE, rows, sources
from tests.failures.catalogue import CHAPTERS
from tests.failures.failure import Failure, shown_entry

COMMAND = "python -m tests.messages"
LAST = Path(__file__).with_name("last_codes.json")
#: Characters of an example at most.
_LONGEST_EXAMPLE = 420
_NEW = re.compile(r" \[([EW])\](?=[\"']|; )")
_LAST_OF_LINE = re.compile(r" \[([EW]\d{4})\]$", re.MULTILINE)
_USED = re.compile(r"\[([EW])(\d{4})\]")


def examples(answer: Callable[[Failure], str] = lambda entry: entry.answer) -> str:
    """Return the examples of codes: entries of the catalogue of bad inputs with their answers, one for each code.

    Raises
    ------
    ValueError
        If an entry without a message is no example, since it has no new code or is too long.
    """
    made: list[str] = []
    known: set[str] = set()
    for entry in (entry for _, _, entries in CHAPTERS for entry in entries):
        told = answer(entry)
        fresh = [code for code in dict.fromkeys(_LAST_OF_LINE.findall(told)) if code not in known]
        text = shown_entry(entry, told)
        if fresh and len(text) <= _LONGEST_EXAMPLE:
            known.update(fresh)
            made.append(f"= {','.join(fresh)} {entry.title}\n{text}\n")
        elif not entry.message:
            raise ValueError(f"{entry.title} is no example, write its message into the entry: {told}")
    return "\n" + "\n".join(made)


def answer_of_today(entry: Failure) -> str:
    """Return the message of an entry, or else the answer of its command."""
    if entry.message:
        return entry.message
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        entry.lay_out(folder)
        return entry.told(folder)[2].removesuffix("\n").replace(str(folder), "{folder}")


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


def main() -> int:
    """Number new messages, and renew the examples."""
    LAST.write_text(json.dumps(number_new()) + "\n", encoding="utf-8")
    sources.cache_clear()
    rows.cache_clear()
    EXAMPLES.write_text(examples(answer_of_today), encoding="utf-8")
    return 0
