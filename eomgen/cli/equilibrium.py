"""``eomgen equilibrium``: static equilibrium of a scene, its stability, and undetermined coordinates."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.cli.options import debug_option, json_option, scene_options
from eomgen.cli.printing import building, finite, print_json, print_table, say
from eomgen.cli.running import read_scene

if TYPE_CHECKING:
    from eomgen.analysis.equilibrium import Equilibrium
    from eomgen.model import Model

_SHOWN = 40


@click.command()
@scene_options
@click.option("--out", "path", default=None, metavar="FILE.json", help="Write the result to this file, too.")
@click.option(
    "--t", "time", type=float, default=0.0, show_default=True, metavar="S", help="Time of inputs and of the base."
)
@click.option("--any-kind", is_flag=True, help="An unstable equilibrium will do: the nearest.")
@click.option("--set", "parameters", multiple=True, metavar="NAME=VALUE", help="A tunable parameter; may be repeated.")
@click.option(
    "--initial", multiple=True, metavar="NAME=VALUE", help="Where a state or a joint starts; may be repeated."
)
@click.option("--input", "inputs", multiple=True, metavar="NAME=VALUE", help="A constant input; may be repeated.")
@json_option
@debug_option
def equilibrium(scene: str, path: str | None, time: float, any_kind: bool, as_json: bool, **options: Any) -> int:
    """Find where a SCENE comes to rest near its initial state, its base held where it is at a time."""
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # imported when the arguments are known to be fine

    described = read_scene(scene, options)
    with building(described.name):
        model = pipeline.build(described)
    found = model.equilibrium(options["initial"], options["parameters"], time, options["inputs"], any_kind=any_kind)
    data = _described(model, found)
    if path is not None:
        from eomgen.files import write_text  # noqa: PLC0415

        write_text(Path(path), json.dumps(finite(data), indent=2) + "\n")
    if as_json:
        print_json(data)
    else:
        rows = [
            (name, f"{value:.9g}", unit)
            for name, value, unit in zip(model.q_names, found.q, model.q_units, strict=True)
        ]
        rows += [
            (name, f"{value:.9g}", unit)
            for name, value, unit in zip(model.z_names, found.z, model.z_units, strict=True)
        ]
        print_table(f"{model.name} at rest", ("coordinate", "value", "unit"), rows[:_SHOWN], numeric=(1,))
        if len(rows) > _SHOWN:
            say(f"{len(rows) - _SHOWN} more with --json")
        say(
            "angular frequencies of small motions, rad/s:"
            f" {', '.join(f'{value:.5g}' for value in found.frequencies[:12])}"
        )
    say(found.message + (f"\nwritten to {path}" if path is not None else ""))
    return 0


def _described(model: Model, found: Equilibrium) -> dict[str, Any]:
    return {
        "scene": model.name,
        "t": found.t,
        "q": dict(zip(model.q_names, found.q.tolist(), strict=True)),
        "z": dict(zip(model.z_names, found.z.tolist(), strict=True)),
        "multipliers": dict(zip(model.multipliers, found.multipliers.tolist(), strict=True)),
        "residual": found.residual,
        "acceleration": found.acceleration,
        "iterations": found.iterations,
        "frequencies": found.frequencies.tolist(),
        "stable": found.stable,
        "undetermined": list(found.undetermined),
        "notes": list(found.notes),
        "message": found.message,
    }
