"""``eomgen equilibrium``: static equilibrium of a scene, its stability, and undetermined coordinates."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.cli.options import (
    any_kind_option,
    debug_option,
    initial_option,
    input_option,
    json_option,
    profile_option,
    scene_options,
    set_option,
    time_option,
)
from eomgen.cli.paths import PathRequest
from eomgen.cli.printing import building, print_json, say
from eomgen.cli.running import read_scene
from eomgen.cli.tables import print_table
from eomgen.errors import Problem, UsageError
from eomgen.text import json_text

if TYPE_CHECKING:
    from eomgen.analysis.equilibrium import Equilibrium
    from eomgen.model import Model

_SHOWN = 40


@click.command()
@scene_options
@click.option(
    "--out", "path", default=None, metavar="FILE", help="Write the result to this .json file, a path also as .csv."
)
@click.option(
    "--path", "along", default=None, metavar="NAME=FROM:TO", help="Follow equilibria while a parameter goes to a value."
)
@click.option("--over", multiple=True, metavar="COLUMN", help="What a path is drawn over; may be repeated.")
@click.option("--plot", "figure", default=None, metavar="FILE.png", help="Draw the path.")
@click.option("--buckling", default=None, metavar="NAME[=AT]", help="Linear buckling loads about a preload.")
@time_option
@any_kind_option
@profile_option
@set_option
@initial_option
@input_option
@json_option
@debug_option
def equilibrium(scene: str, path: str | None, time: float, any_kind: bool, as_json: bool, **options: Any) -> int:
    """Find where a SCENE comes to rest near its initial state, its base held where it is at a time."""
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # imported when the arguments are known to be fine

    request = PathRequest.read(
        options.pop("along"), options.pop("over"), options.pop("figure"), options.pop("buckling"), path
    )
    if request is None and path is not None and Path(path).suffix != ".json":
        raise UsageError(Problem(f"--out {path}", "an equilibrium is written as a .json file", "--out rest.json"))
    described = read_scene(scene, options)
    with building(described.name):
        model = pipeline.build(described, real="double", profile=options.pop("profile"))
    if request is not None:
        return request.answer(model, options["initial"], options["parameters"], time, options["inputs"], as_json)
    result = model.equilibrium(options["initial"], options["parameters"], time, options["inputs"], any_kind=any_kind)
    data = _described(model, result)
    if path is not None:
        from eomgen.files import write_text  # noqa: PLC0415

        write_text(Path(path), json_text(data) + "\n")
    if as_json:
        print_json(data)
    else:
        rows = [
            (name, f"{value:.9g}", unit)
            for name, value, unit in zip(model.q_names, result.q, model.q_units, strict=True)
        ]
        rows += [
            (name, f"{value:.9g}", unit)
            for name, value, unit in zip(model.v_names, result.v, model.v_units, strict=True)
            if value
        ]
        rows += [
            (name, f"{value:.9g}", unit)
            for name, value, unit in zip(model.z_names, result.z, model.z_units, strict=True)
        ]
        print_table(f"{model.name} at rest", ("coordinate", "value", "unit"), rows[:_SHOWN], numeric=(1,))
        if len(rows) > _SHOWN:
            say(f"{len(rows) - _SHOWN} more with --json")
        say(
            "angular frequencies of small motions, rad/s:"
            f" {', '.join(f'{value:.5g}' for value in result.frequencies[:12])}"
        )
    say(result.message + (f"\nwritten to {path}" if path is not None else ""))
    return 0


def _described(model: Model, result: Equilibrium) -> dict[str, Any]:
    return {
        "scene": model.name,
        "t": result.t,
        "q": dict(zip(model.q_names, result.q.tolist(), strict=True)),
        "v": dict(zip(model.v_names, result.v.tolist(), strict=True)),
        "z": dict(zip(model.z_names, result.z.tolist(), strict=True)),
        "multipliers": dict(zip(model.multipliers, result.multipliers.tolist(), strict=True)),
        "residual": result.residual,
        "acceleration": result.acceleration,
        "iterations": result.iterations,
        "frequencies": result.frequencies.tolist(),
        "stable": result.stable,
        "undetermined": list(result.undetermined),
        "notes": list(result.notes),
        "message": result.message,
    }
