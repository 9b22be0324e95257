"""``eomgen suspension``: kinematics and compliance of an axle."""

from __future__ import annotations

from typing import Any

import click

from eomgen.base.progress import waiting
from eomgen.cli.options import (
    arguments_of,
    assignments,
    completed_files,
    debug_option,
    json_option,
    optional_folder,
)
from eomgen.cli.printing import print_json, print_table, say

_of_suspension = arguments_of("eomgen.products.suspension.study:suspension")


@click.command()
@click.argument("file", metavar="AXLE", shell_complete=completed_files)
@click.option("--hub", "hubs", multiple=True, required=True, metavar="BODY", help="Carries a wheel; may be repeated.")
@_of_suspension("--steering", metavar="JOINT")
@_of_suspension("--radius", type=float, metavar="M")
@click.option(
    "--range",
    "ends",
    multiple=True,
    metavar="NAME=END",
    help="End of a range, SI units or with a unit; may be repeated.",
)
@_of_suspension("--rows", type=int, metavar="N")
@_of_suspension("--other-axle", type=float, metavar="M")
@_of_suspension("--height", type=float, metavar="M")
@_of_suspension("--brake-share", type=float, metavar="PART")
@click.option("--set", "changes", multiple=True, metavar="NAME=VALUE", help="Parameter of the axle; may be repeated.")
@optional_folder("Write tables, a figure and a page there.")
@json_option
@debug_option
def suspension(
    file: str, folder: str | None, as_json: bool, ends: tuple[str, ...], changes: tuple[str, ...], **options: Any
) -> int:
    """Measure kinematics and compliance of an AXLE, a scene file, on a rig that holds the body of the car."""
    from eomgen.products.suspension.study import suspension as measured  # noqa: PLC0415  # with fine arguments

    ranges, parameters = assignments("--range", ends), assignments("--set", changes)
    with waiting(f"{file}: states of rest"):
        result = measured(file, ranges=ranges, parameters=parameters, **options)
    if as_json:
        print_json(result.to_dict())
    else:
        rows = [(place, name, f"{value:.5g}", unit) for place, name, value, unit in result.characteristics]
        title = f"{result.name}: at the design position"
        print_table(title, ("range", "quantity", "value", "unit"), rows, numeric=(2,))
    if folder is not None:
        say(f"written: {', '.join(str(file) for file in result.save(folder))}")
    return 0
