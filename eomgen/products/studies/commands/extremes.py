"""``eomgen extremes``: a scene along ladders of extreme conditions, with a verdict for every cell."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.progress import terminal_bar
from eomgen.base.text import counted, listed
from eomgen.cli.options import arguments_of, debug_option, json_option, names_of, scene_options
from eomgen.cli.printing import print_json, print_table, say
from eomgen.cli.running import SCENE_OPTIONS
from eomgen.errors import NumericalError, Problem, UsageError

if TYPE_CHECKING:
    from eomgen.products.studies import Cell, Extremes

#: Cells and ladders that are left out for one reason are named up to so many.
_NAMED = 8

_option = arguments_of("eomgen.products.studies:extremes")
_names = partial(click.option, default=None, callback=names_of, metavar="NAME,NAME")


@click.command()
@scene_options
@click.option("--out", "folder", default=None, metavar="DIR", help="Folder for table, JSON and picture.")
@_names("--ladders", help="step, stiffness, length, ...; all by default.")
@_names("--methods", help="In place of all methods that suit the scene.")
@click.option("--cell", "cells", multiple=True, metavar="LADDER:VALUE[:METHOD]", help="This cell alone; repeatable.")
@_option("--budget", type=float, metavar="S")
@_option("--limit", type=float, metavar="S")
@_option("--resume", is_flag=True)
@json_option
@debug_option
def extremes(scene: str, folder: str | None, as_json: bool, **options: Any) -> int:
    """Run a SCENE under extreme conditions: steps, stiffness, spins, units, ...; report the verdict of each run.

    Every cell holds, is coarse, says that it is doubtful, stops or is refused with a message, or fails: a hang, a
    crash, a number that is not finite, or a wrong answer called success. The exit code is 6 if one fails.
    """
    from eomgen.products.studies import extremes as studied  # noqa: PLC0415  # imported when the arguments are known to be fine

    reading = {name: options.pop(name) for name in SCENE_OPTIONS}
    if folder is not None and not folder.strip():
        raise UsageError(Problem("--out", "the name of the folder is empty", "--out . for this folder"))
    for name in ("budget", "limit"):
        if not options[name] > 0.0:
            fault = f"{options[name]:g} is no positive number of seconds"
            raise UsageError(Problem(f"--{name}", fault, f"--{name} 60"))
    with _bar(Path(scene).stem) as progress:
        result = studied(
            scene,
            ladders=options["ladders"] or (),
            methods=options["methods"] or (),
            cells=options["cells"],
            budget=options["budget"],
            limit=options["limit"],
            folder=folder,
            resume=options["resume"],
            progress=progress,
            **reading,
        )
    files = [] if folder is None else result.save(folder)
    if as_json:
        print_json(result.to_dict())
    elif options["cells"]:
        _print_cells(result)
    else:
        _print_map(result)
    for why in dict.fromkeys(result.left_out.values()):
        names = [name for name, reason in result.left_out.items() if reason == why]
        say(f"left out: {listed(names) if len(names) <= _NAMED else counted(len(names), 'cell')}: {why}")
    if files:
        say(f"written to {folder}: {', '.join(file.name for file in files)}")
    for cell in result.fails:
        said = f", and says: {cell.said}" if cell.said else ""
        say(f"fails: {_what(cell)}{said}; {result.command(cell)}")
    return NumericalError.exit_code if result.fails else 0


def _print_map(result: Extremes) -> None:
    from eomgen.products.studies import LADDERS, VERDICTS  # noqa: PLC0415

    rows = []
    for ladder in LADDERS:
        for method in dict.fromkeys(cell.method for cell in result.of(ladder.name)):
            cells = [cell for cell in result.of(ladder.name) if cell.method == method]
            counts = [sum(cell.verdict == name for cell in cells) for name in VERDICTS]
            rows.append((ladder.scales, method, *(str(count or "") for count in counts)))
    title = f"{result.scene}: {counted(len(result.cells), 'cell')} in {result.seconds:.0f} s"
    print_table(title, ("ladder", "method", *VERDICTS), rows, numeric=tuple(range(2, 2 + len(VERDICTS))))


def _print_cells(result: Extremes) -> None:
    rows = [
        (cell.name, cell.verdict, "" if cell.error is None else f"{cell.error:.2g}", cell.said, cell.reference)
        for cell in result.cells
    ]
    print_table(f"{result.scene}: cells", ("cell", "verdict", "error", "it says", "held against"), rows, numeric=(2,))


def _what(cell: Cell) -> str:
    return f"{cell.name}" if cell.error is None else f"{cell.name} is wrong by {100.0 * cell.error:.2g} % of its motion"


@contextlib.contextmanager
def _bar(name: str) -> Iterator[Callable[[int, int, str], None] | None]:
    with terminal_bar(name) as bar:
        if bar is not None:
            yield lambda done, total, _: bar(done, total)
            return
        yield _lines if not sys.stderr.isatty() else None


def _lines(done: int, total: int, cell: str) -> None:
    """Report every tenth of the cells, if there is no terminal for a bar."""
    if total and done and done % max(1, total // 10) == 0:
        say(f"{done} of {total} cells; now {cell}")
