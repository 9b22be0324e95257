"""Answers of the command line with their codes."""

from __future__ import annotations

import re

from eomgen.base.message_codes import code_of

#: A line with a problem, a note or a warning, in three parts: kind, text, and remedy.
_LINE = re.compile(r"(?:([a-z/]+ error|note|warning): (?!\d+ problems)|  \d+\. )(.*)")
#: File, line and key of a problem, or the option or argument that it is about.
_PLACE = re.compile(r"(?:'[^']*'|[^ :'\"]+(?::\d+)?(?: \([^)]*\))?|eomgen [\w ]+|--?[\w-]+[^:']*): ")


def code_of_line(line: str) -> str:
    """Return the code of a line of an answer; empty for a line without a problem, a note or a warning."""
    found = _LINE.fullmatch(line)
    if found is None:
        return ""
    notes, what = found[1] in ("note", "warning"), found[2]
    if notes:
        return code_of(what, notes=True)
    what = what.partition("; try: ")[0]
    place = _PLACE.match(what)
    return code_of(what[place.end() :] if place else what) or code_of(what)


def with_codes(answer: str) -> str:
    """Return an answer whose lines have their codes."""
    lines = ((line, code_of_line(line)) for line in answer.splitlines())
    return "\n".join(f"{line} [{code}]" if code else line for line, code in lines)


def plain(answer: str) -> str:
    """Return an answer without its codes."""
    return re.sub(r" \[[EW]\d{4}\]$", "", answer, flags=re.MULTILINE)
