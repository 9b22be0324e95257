"""Upkeep of the catalogue of messages, ``eomgen/base/message_rows``: ``python -m tests.messages``.

The source gives the code of each message at the end of its literal. The catalogue repeats the texts by code for
``eomgen explain`` and the site: the line of a code is its number. The line of a message that is gone becomes empty, so
no code is used twice. A literal that ends with ``[E]`` or ``[W]`` gets the next number.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path

from eomgen.base.message_codes import FILES, FOLDER, Row, lines_of, rows
from tests.failures.catalogue import CHAPTERS
from tests.failures.errors_page import shown_entry
from tests.messages.texts import PACKAGE, Text, codes_of_tables, modules, texts

COMMAND = "python -m tests.messages"
#: Characters of an example at most.
_LONGEST_EXAMPLE = 420
#: Lines of one file: a file of a wheel is small.
_LINES = 850
#: Codes of kinds of errors, by exit code.
_GENERAL = [f"E{number:04d}" for number in range(1, 8)]
_USED = {letter: re.compile(rf"\[({letter}\d{{4}})\]").findall for letter in FILES}
_NEW = re.compile(r" \[([EW])\](?=[:,;]? ?[\"'])")


def room_of(module: str) -> str:
    """Return the room of a module: two names, three in products and scenes."""
    parts = module.split(".")[1:]
    return ".".join(parts[: 3 if parts[:1] in (["products"], ["scene"]) else 2]) or "eomgen"


def findings() -> list[str]:
    """Return the names of all checks of runs."""
    from eomgen.simulation.judgement.register import CHECKS

    return [check.name for check in CHECKS]


def renewed(known: Sequence[Row], found: Iterable[Text], kept: Iterable[str], checks: Sequence[str]) -> list[Row]:
    """Return the rows of the catalogue.

    Parameters
    ----------
    known : rows of the catalogue so far
    found : texts of the source
    kept : codes of rows that stay as they are
    checks : names of the checks of runs, whose rows are added behind
    """
    before, by_code = {row.code: row for row in known}, defaultdict[str, list[Text]](list)
    for text in found:
        by_code[text.code].append(text)
    made = {code: before[code] for code in kept if code in before}
    for code, same in by_code.items():
        if code in made:
            continue
        old = before.get(code)
        patterns, remedies = [text.pattern for text in same], {text.remedy for text in same}
        pattern = old.pattern if old is not None and old.pattern in patterns else max(patterns, key=len)
        kinds = "".join(
            dict.fromkeys([text.kind for text in same] + ([*old.kinds] if old and not same[0].kind else []))
        )
        default = "d" if same[0].module.startswith("eomgen.scene") else "u"
        remedy = remedies.pop() if len(remedies) == 1 else ""
        made[code] = Row(code, kinds or default, room_of(same[0].module), pattern, remedy)
    named = {row.pattern: row for row in known if row.kinds == "r"}
    last = max((int(code[1:]) for code in before if code[0] == "W"), default=0)
    for name in checks:
        last += name not in named
        row = named.get(name) or Row(f"W{last:04d}", "r", "simulation.judgement", name, "")
        made[row.code] = row
    return sorted(made.values(), key=lambda row: row.code)


def lines(made: Sequence[Row], letter: str) -> list[str]:
    """Return the lines of the codes with a letter; each room is written once for rows that follow one another."""
    by_number = {int(row.code[1:]): row for row in made if row.code[0] == letter}
    written, above = list[str](), ""
    for number in range(1, max(len_before(letter), *by_number) + 1):
        row = by_number.get(number)
        if row is None:
            written.append("")
            continue
        parts = (row.kinds, "" if row.room == above else row.room, row.pattern, row.remedy)
        written.append("\t".join(parts).replace("\n", "\\n").rstrip("\t"))
        above = row.room
    return written


def len_before(letter: str) -> int:
    """Return the number of lines so far, which never falls."""
    return len(lines_of(letter))


def present() -> list[Row]:
    """Return the rows of the present source."""
    return renewed(rows(), texts(), {*_GENERAL, *codes_of_tables()}, findings())


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


def number_new(package: Path = PACKAGE) -> None:
    """Write the next codes at the end of the literals of new messages."""
    sources = {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}
    last = {
        letter: max(
            len_before(letter), *(int(code[1:]) for text in sources.values() for code in _USED[letter](text)), 0
        )
        for letter in FILES
    }

    def numbered(found: re.Match[str]) -> str:
        last[found[1]] += 1
        return f" [{found[1]}{last[found[1]]:04d}]"

    for path, text in sources.items():
        if _NEW.search(text):
            path.write_text(_NEW.sub(numbered, text), encoding="utf-8")
    modules.cache_clear()


def main() -> int:
    """Number new messages, and write the catalogue."""
    number_new()
    made = present()
    for letter in FILES:
        written = lines(made, letter)
        for start in range(0, len(written), _LINES):
            file = FOLDER / f"{FILES[letter]}_{start // _LINES + 1}.txt"
            file.write_text("\n".join(written[start : start + _LINES]) + "\n", encoding="utf-8")
        print(f"{letter}: {sum(map(bool, written))} messages in {len(written)} lines")
    rows.cache_clear()
    (FOLDER / "examples.txt").write_text(examples(), encoding="utf-8")
    return 0
