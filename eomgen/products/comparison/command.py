"""``eomgen compare``: two descriptions of one machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from eomgen.base.messages import counted
from eomgen.base.progress import waiting
from eomgen.cli.options import arguments_of, completed_files, debug_option, json_option, reading_options
from eomgen.cli.printing import print_json, print_table, say, say_note
from eomgen.errors import ModelError

_of_compare = arguments_of("eomgen.products.comparison.compare:compare")


@click.command()
@click.argument("first", metavar="A", shell_complete=completed_files)
@click.argument("second", metavar="[B]", required=False, default=None, shell_complete=completed_files)
@_of_compare("--with", "reader", type=click.Choice(["mujoco", "pinocchio"]))
@_of_compare("--tolerance", type=float, metavar="X")
@_of_compare("--states", type=int, metavar="N")
@_of_compare("--seed", type=int, metavar="N")
@reading_options(without=("limits", "friction"))
@json_option
@debug_option
def compare(first: str, second: str | None, as_json: bool, **options: Any) -> int:
    """Compare two descriptions A and B of one machine, or one and the reading of another program: scene, URDF, MJCF.

    Exits with 4 if the descriptions differ.
    """
    from eomgen.products.comparison.compare import compare as compared  # noqa: PLC0415  # with fine arguments

    with waiting(" and ".join(Path(file).name for file in (first, second) if file)):
        result = compared(first, second, **options)
    if as_json:
        print_json(result.to_dict())
    else:
        for note in result.notes:
            say_note(note)
        rows = [
            (item.element, item.quantity, *item.texts, item.unit, " ".join(filter(None, item.places)))
            for item in result.differences
        ]
        if rows:
            header = ("element", "quantity", "first", "second", "unit", "places")
            print_table(f"{' and '.join(result.names)}: {counted(len(rows), 'difference')}", header, rows, whole=(0, 1))
        say(result.summary)
    return 0 if result.equal else ModelError.exit_code
