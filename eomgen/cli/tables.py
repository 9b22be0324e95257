"""Tables on stdout."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.markup import escape
from rich.table import Table

from eomgen.cli.printing import console


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
        table.add_row(*(escape(str(cell)) for cell in row))  # names are the user's text
    console().print(table)
