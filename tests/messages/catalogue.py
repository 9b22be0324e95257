"""Upkeep of messages: ``python -m tests.messages`` numbers new messages, and renews the examples of codes.

A literal that ends with ``[E]`` or ``[W]`` gets the number behind the last one, also if the message of the last number
is gone, so no code is used twice.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from eomgen.base.message_codes import EXAMPLES, PACKAGE, rows, sources
from tests.failures.catalogue import CHAPTERS
from tests.failures.errors_page import shown_entry

COMMAND = "python -m tests.messages"
LAST = Path(__file__).with_name("last_codes.json")
#: Characters of an example at most.
_LONGEST_EXAMPLE = 420
_NEW = re.compile(r" \[([EW])\](?=[\"']|; )")
_USED = re.compile(r"\[([EW])(\d{4})\]")


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


def main() -> int:
    """Number new messages, and renew the examples."""
    LAST.write_text(json.dumps(number_new()) + "\n", encoding="utf-8")
    sources.cache_clear()
    rows.cache_clear()
    EXAMPLES.write_text(examples(), encoding="utf-8")
    return 0
