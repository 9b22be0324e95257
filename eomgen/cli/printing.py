"""Output: consoles, tables and JSON to stdout, messages to stderr."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from textwrap import wrap
from typing import Any

import click
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from eomgen.base.json_text import json_text
from eomgen.base.progress import told_by
from eomgen.errors import Message

_PLAIN_WIDTH = 120


class _Console(Console):
    """A console that leaves the handling of a closed pipe to the caller."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def console(*, stderr: bool = False) -> Console:
    """Return a console; if stdout is not a terminal, lines are 120 characters wide."""
    stream = sys.stderr if stderr else sys.stdout
    return _Console(stderr=stderr, width=None if stream.isatty() else _PLAIN_WIDTH, highlight=False, emoji=False)


@contextlib.contextmanager
def building(name: str) -> Iterator[Callable[[str], None]]:
    """Say that a model is being built, if stderr is a terminal; the callback takes the name of the variant being
    built."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    with (
        console(stderr=True).status(f"building {name}") as status,
        told_by(lambda progress: status.update(f"building {name}: {progress}")),
    ):
        yield lambda variant: status.update(f"building {name}: {variant}")


def print_json(data: Any) -> None:
    """Print JSON to stdout; numbers that JSON does not have become null."""
    click.echo(json_text(data))


def say(text: str) -> None:
    """Print a line of talk to stderr."""
    click.echo(text, err=True)


def say_note(note: str) -> None:
    """Print a note with its code to stderr."""
    say(f"note: {Message(note).line}")


def print_table(
    title: str,
    header: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    numeric: Sequence[int] = (),
    whole: Sequence[int] = (),
    optional: Sequence[int] = (),
) -> None:
    """Print a table to stdout.

    A table that is too wide for the terminal folds names and titles, and leaves out optional columns. No number is cut:
    a table of many numbers has lines longer than the terminal.

    Parameters
    ----------
    numeric : columns of numbers, aligned to the right, which do not fold
    whole : columns of words that do not fold
    optional : columns that a narrow terminal leaves out, the first of these first
    """
    cells = [[str(cell) for cell in row] for row in rows]
    widest = [max((cell_len(row[index]) for row in cells), default=0) for index in range(len(header))]
    out, unfolded = console(), {*numeric, *whole}
    fits = sum(map(max, widest, map(cell_len, header))) + _GAP * (len(header) - 1) <= out.width
    titles = [
        _fold(name, widest[index]) if index in unfolded and not fits else [name] for index, name in enumerate(header)
    ]
    least = [
        max(widest[index], *map(cell_len, titles[index]))
        if index in unfolded
        else max(min(widest[index], _NAME), *map(cell_len, name.split(" ")))
        for index, name in enumerate(header)
    ]
    kept = list(range(len(header)))
    for index in optional:
        if _GAP * (len(kept) - 1) + sum(least[index] for index in kept) > out.width:
            kept.remove(index)
    if title:  # a title of the table itself folds at the width of the columns
        out.print(Text(title, style="table.title"))
    table = Table(box=None, pad_edge=False, header_style="bold", show_header=any(header))
    for index in kept:
        table.add_column(
            escape("\n".join(titles[index])),
            justify="right" if index in numeric else "left",
            no_wrap=index in unfolded,
            overflow="fold",
            min_width=least[index],
        )
    for row in cells:
        table.add_row(*(escape(row[index]) for index in kept))  # names are the user's text
    width = _GAP * (len(kept) - 1) + sum(least[index] for index in kept)
    if width > out.width:
        table.width = width
    out.print(table, soft_wrap=width > out.width, crop=False)


#: Characters between columns, and of a column of names at least, before other columns are left out.
_GAP, _NAME = 2, 12


def _fold(title: str, width: int) -> list[str]:
    """Return a title in lines of at most ``width`` characters; longer words have a line each."""
    return wrap(title, max(1, width), break_long_words=False, break_on_hyphens=False) or [""]


def number_list(values: float | Sequence[float]) -> str:
    """Return numbers as a list in a text, with rounding errors of the largest number as 0."""
    entries = [values] if isinstance(values, float | int) else list(values)
    size = max((abs(value) for value in entries), default=0.0)
    return ", ".join(f"{0.0 if abs(value) < 1e-12 * size else value:.6g}" for value in entries)
