"""``eomgen explain``: pattern, remedy and example of a message by its code, and a search of the catalogue."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence, Set
from functools import cache
from operator import itemgetter
from pathlib import Path

import click

from eomgen.base.message_codes import EXAMPLES, KINDS, MessageRow, code_of_finding, codes, rows, search
from eomgen.base.messages import counted, shown
from eomgen.cli.options import debug_option, json_option
from eomgen.cli.printing import print_json, say
from eomgen.errors import Problem, UsageError

_PAGES = Path(__file__).with_name("message_pages.toml")
_CAUSES = Path(__file__).with_name("message_causes.toml")
_CODE = re.compile(r"\[?([EW]\d{4})\]?", re.IGNORECASE)
#: The place of a problem of a scene file, such as ``(joints.shoulder.axis)``.
_PLACE = re.compile(r" \(([a-z]\w*(?:\.\w+|\[\d+\])*)\): ")


@cache
def _every_page() -> Mapping[str, Mapping[str, str]]:
    data: dict[str, dict[str, str]] = tomllib.loads(_PAGES.read_text(encoding="utf-8"))
    return data


def pages() -> Mapping[str, str]:
    """Return the page of the documentation by the prefix of a module's dotted name."""
    return _every_page()["rooms"]


def pages_of_sections() -> Mapping[str, str]:
    """Return the page by section of scene files, ``joints``, or section and key of an entry, ``inputs.table``."""
    return _every_page()["sections"]


def pages_of_codes() -> Mapping[str, str]:
    """Return the page of single codes."""
    return _every_page()["codes"]


@cache
def own_causes() -> Mapping[str, Mapping[str, str]]:
    """Return cause and page of the documentation by code, of the most frequent messages."""
    data: dict[str, dict[str, str]] = tomllib.loads(_CAUSES.read_text(encoding="utf-8"))
    return data


def topic_name(room: str) -> str:
    """Return the longest prefix of a module's dotted name with a page of the documentation, else ``errors``."""
    parts = room.split(".")
    names = (".".join(parts[:count]) for count in range(len(parts), 0, -1))
    return next((name for name in names if name in pages()), "errors")


@cache
def examples() -> Mapping[str, tuple[str, str]]:
    """Return title and text of the example output of each code that has an example, read from a file once."""
    text = EXAMPLES.read_text(encoding="utf-8")
    made: dict[str, tuple[str, str]] = {}
    for entry in text.split("\n= ")[1:]:
        heading, _, lines = entry.partition("\n")
        codes, _, title = heading.partition(" ")
        made |= {code: (title, lines.rstrip("\n")) for code in codes.split(",")}
    return made


def shown_pattern(pattern: str) -> str:
    """Return a pattern with three dots for each value, and for values that follow one another."""
    return re.sub(r"\{\}(?:\.?\{\})*", "...", pattern)


def _page_of_example(code: str) -> str:
    """Return the page of the section in which the example of a code is; empty without one."""
    _, example = examples().get(code, ("", ""))
    places = (_PLACE.search(line) for line in example.splitlines() if line.endswith(f"[{code}]"))
    for section, *keys in (match[1].split(".") for match in places if match):
        names = (*(f"{section}.{key}" for key in keys), section)
        return next((pages_of_sections()[name] for name in names if name in pages_of_sections()), "")
    return ""


def page_of(row: MessageRow) -> str:
    """Return the page of a message, from the folder docs: by the code, by the example, or by the room."""
    example = "" if topic_name(row.room) in _every_page()["subjects"] else _page_of_example(row.code)
    return pages_of_codes().get(row.code) or example or pages()[topic_name(row.room)]


def explanation(row: MessageRow) -> dict[str, str]:
    """Return the parts of an explanation by their titles.

    Parameters
    ----------
    row : MessageRow
        Of the catalogue.

    Returns
    -------
    dict
        ``code``, ``kind``, ``message``, ``cause``, ``remedy``, ``limits`` of a check, ``page``, ``example`` and
        ``title`` of the example; a message may have no cause or remedy that holds for all its cases, no limits and no
        example, and then these are empty.
    """
    entry = own_causes().get(row.code, {"cause": "", "page": page_of(row)})
    title, example = examples().get(row.code, ("", ""))
    exits = [f"exit code {exit_code}" for exit_code, letter in enumerate("iudmtnf", 1) if letter in row.kinds]
    kinds = [KINDS[letter] for letter in row.kinds]
    return {
        "code": row.code,
        "kind": ", ".join([*kinds, *exits]) or "error",
        "message": shown_pattern(row.pattern),
        "cause": entry["cause"],
        "remedy": shown_pattern(row.remedy),
        "limits": _limits(row),
        "page": f"docs/{entry['page']}",
        "title": title,
        "example": example,
    }


def _limits(row: MessageRow) -> str:
    """Return the limits of a check of a run as text; empty for other messages."""
    if "r" not in row.kinds:
        return ""
    from eomgen.simulation.judgement.register import BY_NAME  # noqa: PLC0415  # of few messages

    return "; ".join(map(str, BY_NAME[row.pattern].limits if row.pattern in BY_NAME else ()))


def _format(parts: Mapping[str, str]) -> str:
    lines = [f"{parts['code']}: {parts['kind']}", ""]
    lines += [f"{name:8} {parts[name]}" for name in ("message", "cause", "remedy", "limits") if parts[name]]
    lines.append(f"see      {parts['page']}")
    if parts["example"]:
        lines += ["", f"{parts['title']}:", "", *(f"    {line}".rstrip() for line in parts["example"].splitlines())]
    return "\n".join(lines)


def _alike(words: Set[str]) -> list[MessageRow]:
    """Return in a list the longest message whose fixed words all occur in ``words``; empty if none fits."""
    within = [(len(phrase), row) for row in rows() if (phrase := set(row.pattern.split()) - {"{}"}) and phrase <= words]
    return [max(within, key=itemgetter(0))[1]] if within else []


def rows_of(words: Sequence[str]) -> list[MessageRow]:
    """Return the rows for a code, a finding's name, a message in full, or words to search for.

    Raises
    ------
    UsageError
        There is no such code, or no message contains the words.
    """
    text = " ".join(words)
    code = _CODE.fullmatch(text) or re.search(r"\[([EW]\d{4})\]$", text)
    named = code[1].upper() if code else code_of_finding(text)
    chosen = [row for row in rows(named) if row.code == named] if named else list(search(text.split()))
    if code and not chosen:
        raise UsageError(
            Problem("eomgen explain", f"this version has no message {named} [E0158]", "eomgen explain mass, a search")
        )
    if not chosen:
        chosen = _alike(set(text.split()))
    if not chosen:
        fault = f"no message contains {shown(text)} [E0159]"
        raise UsageError(Problem("eomgen explain", fault, "fewer words, or a code, E0008"))
    return chosen


def _overview() -> str:
    """Return the numbers of codes, and the uses of the verb."""
    errors, notes = ([code for code in codes() if code[0] == letter] for letter in "EW")
    return (
        f"{counted(len(errors), 'error')}, {errors[0]} to {errors[-1]}, and"
        f" {counted(len(notes), 'note')}, {notes[0]} to {notes[-1]}.\n\n"
        "  eomgen explain E0008            message, remedy and example of a code\n"
        "  eomgen explain mass negative    messages that contain these words"
    )


@click.command()
@click.argument("words", metavar="[CODE|WORDS]...", nargs=-1)
@json_option
@debug_option
def explain(words: tuple[str, ...], as_json: bool) -> None:
    """Explain a message by its CODE: its pattern, remedy, page of the documentation, and an example with its output.

    Without a code: a search for messages that contain all WORDS. A message in full is recognised by its text.
    """
    if not words:
        click.echo(_overview())
        return
    chosen = rows_of(words)
    if as_json:
        print_json([explanation(row) for row in chosen])
    elif len(chosen) == 1:
        click.echo(_format(explanation(chosen[0])))
    else:
        click.echo("\n".join(f"{row.code}  {shown_pattern(row.pattern)}" for row in chosen[:40]))
        if left := chosen[40:]:
            say(f"and {len(left)} more: more words match fewer")
