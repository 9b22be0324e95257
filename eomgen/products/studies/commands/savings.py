"""``eomgen savings``: costs of a scene with the functions that it needs, against variants with more functions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.cli.options import arguments_of, debug_option, json_option, scene_options
from eomgen.cli.printing import building, console, print_json, print_table, say
from eomgen.cli.running import say_notes, say_stand_in

if TYPE_CHECKING:
    from eomgen.products.studies.savings import Cost, Savings

#: Columns of the table: the cost, its heading, and by how much and in which format it is printed.
_COLUMNS = (
    ("step_operations", "flops of a step's terms", 1.0, ".0f"),
    ("c_bytes", "C, kB", 1e-3, ".1f"),
    ("build_seconds", "build, s", 1.0, ".2f"),
    ("step_seconds", "step, us", 1e6, ".3f"),
    ("observed_seconds", "observed step, us", 1e6, ".3f"),
)

_option = arguments_of("eomgen.products.studies.savings:savings")


@click.command()
@scene_options
@click.option("--method", default=None, help="Whose steps are timed; the scene's by default.")
@_option("--rounds", type=int, metavar="N")
@_option("--only", multiple=True, metavar="VARIANT")
@click.option("--out", "folder", default=None, metavar="DIR", help="Write savings.csv and savings.json there.")
@json_option
@debug_option
def savings(
    scene: str,
    method: str | None,
    rounds: int,
    only: tuple[str, ...],
    folder: str | None,
    as_json: bool,
    **reading: Any,
) -> None:
    """Measure the costs of a SCENE as it is requested: operations, bytes of C, seconds to build, time per step.

    Against the same scene with the terms of a run alone, the terms of a step alone, all terms, all numbers tunable, a
    base that moves in all six ways, absolute coordinates, and all of that. Every variant is built in an empty cache, so
    this takes a while.
    """
    from eomgen.base.files import make_folder  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.pipeline.pipeline import load_scene  # noqa: PLC0415
    from eomgen.products.studies.savings import savings as measured  # noqa: PLC0415

    if folder is not None:
        make_folder(Path(folder))
    described = load_scene(scene, **reading)
    say_notes(described)
    say_stand_in(described, method, "steps are timed with")
    with building(f"variants of {scene}") as progress:
        study = measured(scene, method=method, rounds=rounds, only=only, progress=progress, **reading)
    if as_json:
        print_json(study.to_dict())
    else:
        _print(study)
    if folder is not None:
        say(f"written: {', '.join(str(path) for path in study.write(folder))}")


def _print(study: Savings) -> None:
    title = f"{study.scene}, {study.method}, step {study.step:.6g} s: cost, and its ratio to that as asked"
    header = ("variant", *(name for _, heading, _, _ in _COLUMNS for name in (heading, "x")))
    rows = [(cost.name, *(text for column in _COLUMNS for text in _pair(study, cost, column))) for cost in study.costs]
    print_table(title, header, rows, numeric=tuple(range(1, len(header))), whole=(0,))
    console().print()
    names = [cost.name for cost in study.costs if cost.operations]
    of_terms = [
        (
            term,
            *("" if (count := cost.operations.get(term)) is None else count for cost in study.costs if cost.operations),
        )
        for term in study.costs[0].operations
    ]
    print_table(
        "Additions and multiplications by term", ("term", *names), of_terms, numeric=tuple(range(1, len(names) + 1))
    )
    for cost in study.costs:
        if cost.problem:
            console().print(f"\n{cost.name}: {cost.problem}", markup=False)


def _pair(study: Savings, cost: Cost, column: tuple[str, str, float, str]) -> tuple[str, str]:
    key, _, factor, form = column
    value, ratio = getattr(cost, key), study.ratio(cost, key)
    return ("" if value is None else f"{value * factor:{form}}", "" if ratio is None else f"{ratio:.2f}")
