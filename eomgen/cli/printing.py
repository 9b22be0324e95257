"""Output: data to stdout as tables or JSON, messages to stderr."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from eomgen.text import json_text

_PLAIN_WIDTH = 120


class _Console(Console):
    """A console that leaves it to the caller what a closed pipe means."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def console(*, stderr: bool = False) -> Console:
    """Return a console; if stdout is no terminal, lines are 120 characters wide."""
    stream = sys.stderr if stderr else sys.stdout
    return _Console(stderr=stderr, width=None if stream.isatty() else _PLAIN_WIDTH, highlight=False, emoji=False)


@contextlib.contextmanager
def building(name: str) -> Iterator[None]:
    """Say that a model is being built, where stderr is a terminal."""
    with console(stderr=True).status(f"building {name}") if sys.stderr.isatty() else contextlib.nullcontext():
        yield


def print_table(
    title: str,
    header: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    numeric: Sequence[int] = (),
    whole: Sequence[int] = (),
) -> None:
    """Print a table to stdout; columns in ``numeric`` are aligned to the right, and neither these nor ``whole`` ones
    fold."""
    table = Table(
        title=title, title_justify="left", box=None, pad_edge=False, header_style="bold", show_header=any(header)
    )
    for index, name in enumerate(header):
        unfolded = index in numeric or index in whole
        table.add_column(name, justify="right" if index in numeric else "left", no_wrap=unfolded, overflow="fold")
    for row in rows:
        table.add_row(*(_escaped(cell) for cell in row))
    console().print(table)


def print_json(data: Any) -> None:
    """Print JSON to stdout; numbers that JSON does not have become null."""
    click.echo(json_text(data))


def counted(count: int, singular: str, plural: str = "") -> str:
    """Return a count with its noun: ``1 body``, ``2 bodies``."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


def say(text: str) -> None:
    """Print a line of talk to stderr."""
    click.echo(text, err=True)


def _escaped(cell: object) -> str:
    from rich.markup import escape  # noqa: PLC0415  # names are the user's text

    return escape(str(cell))
