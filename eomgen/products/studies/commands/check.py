"""``eomgen check``: every closed form of a scene against differences, complex steps and second derivations."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.text import counted
from eomgen.cli.options import arguments_of, debug_option, json_option, scene_options
from eomgen.cli.printing import building, print_json, print_table, say
from eomgen.errors import NumericalError

if TYPE_CHECKING:
    from eomgen.products.studies import CheckReport, FormReport


#: Largest number of non-smooth functions that are named.
_NAMED = 20

_option = arguments_of("eomgen.products.studies:check")


@click.command()
@scene_options
@_option("--states", type=int, metavar="N")
@_option("--seed", type=int, metavar="N")
@_option("--only", multiple=True, metavar="FORM")
@click.option(
    "--out", "folder", default=None, metavar="DIR", help="Write the data and draw the errors over the steps there."
)
@json_option
@debug_option
def check(
    scene: str, states: int, seed: int, only: tuple[str, ...], folder: str | None, as_json: bool, **reading: Any
) -> int:
    """Check every closed form of a SCENE, as compiled, against finite differences, complex steps and second
    derivations.

    Exits with 6 when one fails.
    """
    from eomgen.pipeline.pipeline import load_scene  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.studies import check as checked  # noqa: PLC0415
    from eomgen.products.studies.verification.report import make  # noqa: PLC0415

    if folder is not None:
        make(Path(folder))
    described = load_scene(scene, **reading)
    with building(described.name):
        report = checked(described, states=states, seed=seed, only=only)
    if as_json:
        print_json(report.to_dict())
    else:
        _print(report)
    if folder is not None:
        say(f"written: {', '.join(str(path) for path in report.write(folder))}")
    for form in report.failures:
        say(f"{form.name} {_why(form)}")
    return 0 if report.passed else NumericalError.exit_code


def _why(form: FormReport) -> str:
    if form.worst is not None:
        return f"FAILS: {form.worst}"
    return (
        "cannot be decided: neither differences nor complex steps are finite"
        if form.verdict == "undecided"
        else ("was not checked: no state where it is finite")
    )


def _print(report: CheckReport) -> None:
    header = ("closed form", "is", "differences", "at step", "slope", "complex step", "second", "derivation", "verdict")
    rows = [
        (
            form.name,
            form.meaning,
            _short(form.agreement),
            _short(form.step),
            "" if form.slope is None else f"{form.slope:.2f}",
            _short(form.complex_step),
            _short(form.second),
            form.second_name,
            form.verdict,
        )
        for form in report.forms
    ]
    title = f"{report.scene}: {counted(len(report.forms), 'closed form')} at {counted(len(report.states), 'state')}"
    print_table(title, header, rows, numeric=(2, 3, 4, 5, 6), whole=(0, 8))
    for note in (*report.remarks, *report.notes):
        say(note)
    if report.corners:
        more = len(report.corners) - _NAMED
        say(f"not smooth everywhere: {', '.join(report.corners[:_NAMED])}{f' and {more} more' if more > 0 else ''}")
    say(report.summary)


def _short(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"
