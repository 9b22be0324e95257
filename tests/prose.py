"""Lint of the prose of pages, a part of ``make lint``: ``python -m tests.prose``.

The vocabulary is the glossary. A term of several words is written as there, with its blanks and hyphens
(generalized-alpha), and a word of the glossary with its letters (discretisation, factorization, centre). Pages with
other spellings are listed. Code, tables made from the schema, and names of other programs in the glossary's column are
not prose.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
GLOSSARY = (ROOT / "docs" / "glossary.md", ROOT / "docs" / "glossary_of_methods.md")
#: Made from docstrings or grammars, or a list of changes.
NOT_PROSE = ("mjcf.md",)
#: Parts of a page that are not prose: code, links' targets, comments, anchors.
_CODE = re.compile(r"^```.*?^```$|^(?: {4}).*$|`[^`\n]+`|\]\([^)\s]+\)|<!--.*?-->|<[^>\n]+>", re.DOTALL | re.MULTILINE)
#: Endings of words that are written with s or with z.
_ENDINGS = ("e", "ed", "es", "er", "ers", "ing", "ation", "ations")
#: Words with two spellings, of which the glossary has the first.
_TWO_SPELLINGS = {"centre": "center", "tyre": "tire", "behaviour": "behavior"}


def prose(text: str) -> str:
    """Return a page with everything that is not prose as blanks, so that lines keep their numbers."""
    return _CODE.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)


@cache
def terms() -> tuple[str, ...]:
    """Return the terms of the glossary, the first cell of each row."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in GLOSSARY)
    rows = re.findall(r"^\| ([^|]+?) \|", text, re.MULTILINE)
    return tuple(term for term in dict.fromkeys(rows) if term != "term" and not term.startswith("-"))


def separations() -> Mapping[str, str]:
    """Return other ways to separate the words of a term, each with the term."""
    ways: dict[str, str] = {}
    for term in terms():
        words = re.split(r"[ -]", term.lower())
        if len(words) == 2 and min(map(len, words)) > 1:
            ways |= {joined.join(words): term for joined in ("-", " ", "") if joined.join(words) != term.lower()}
    # a term of two words with a blank is hyphenated before a noun: static-equilibrium search
    return {way: term for way, term in ways.items() if not ("-" in way and " " in term)}


def spellings() -> Mapping[str, str]:
    """Return other spellings of words of the glossary, each with the word of the glossary."""
    words = {word for term in terms() for word in re.findall(r"[a-z]{4,}", term.lower())}
    found = {
        f"{stem}{'z' if letter == 's' else 's'}{ending}": f"{stem}{letter}{ending}"
        for word in words
        for stem, letter in re.findall(r"^(\w+i)([sz])(?:e|ed|ation|ing)$", word)
        for ending in _ENDINGS
    }
    return found | {other: word for word, other in _TWO_SPELLINGS.items()}


def pages() -> list[Path]:
    """Return the hand-written pages."""
    files = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").glob("*/README.md")]
    return sorted(file for file in files if file.name not in NOT_PROSE and "_build" not in file.parts)


@cache
def _deviations() -> tuple[Mapping[str, str], re.Pattern[str]]:
    """Return the word of the glossary for each other way to write it, and the pattern of all ways."""
    known = {**separations(), **spellings()}
    ways = "|".join(sorted(map(re.escape, known), key=len, reverse=True))
    return known, re.compile(rf"(?<![\w-])({ways})(?![\w-])", re.I)


def findings(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield line, written word and the word of the glossary for each deviation on a page."""
    known, pattern = _deviations()
    for number, line in enumerate(prose(text).splitlines(), start=1):
        for match in pattern.finditer(line):
            yield number, match[1], known[match[1].lower()]


def main() -> int:
    """Print all findings; return 1 if there are any."""
    lines = [
        f"{page.relative_to(ROOT)}:{number}: {written}; the glossary has: {term}\n"
        for page in pages()
        if page not in GLOSSARY
        for number, written, term in findings(page.read_text(encoding="utf-8"))
    ]
    sys.stdout.writelines(lines)
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main())
