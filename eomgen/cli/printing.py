"""Output: consoles, tables and JSON to stdout, messages to stderr."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import click
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from eomgen.base.json_text import json_text
from eomgen.base.progress import told_by

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
    from eomgen.base.message_codes import code_of  # noqa: PLC0415  # for a note only

    code = code_of(note, notes=True)
    say(f"note: {note}{code and f' [{code}]'}")


def print_table(
    title: str,
    header: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    numeric: Sequence[int] = (),
    whole: Sequence[int] = (),
) -> None:
    """Print a table to stdout; columns in ``numeric`` are aligned to the right, and columns in ``numeric`` or ``whole``
    do not fold."""
    table = Table(
        title=title, title_justify="left", box=None, pad_edge=False, header_style="bold", show_header=any(header)
    )
    for index, name in enumerate(header):
        unfolded = index in numeric or index in whole
        table.add_column(
            escape(name), justify="right" if index in numeric else "left", no_wrap=unfolded, overflow="fold"
        )
    for row in rows:
        table.add_row(*(escape(str(cell)) for cell in row))  # names are the user's text
    console().print(table)
