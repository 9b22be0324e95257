"""``eomgen equilibrium``: static equilibrium of a scene, its stability, and undetermined coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.json_text import json_text
from eomgen.base.progress import waiting
from eomgen.cli.options import (
    any_kind_option,
    debug_option,
    file_to_write,
    initial_option,
    input_option,
    json_option,
    profile_option,
    scene_options,
    set_option,
    time_option,
)
from eomgen.cli.parts import RestPart, parts_of, with_parts
from eomgen.cli.printing import building, number_list, print_json, print_table, say
from eomgen.cli.running import read_scene
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.compiled.rest.equilibrium import Equilibrium
    from eomgen.pipeline.model import Model


@with_parts
@click.command()
@click.option(
    "--out",
    "path",
    default=None,
    metavar="FILE",
    callback=file_to_write,
    help="Write the result to this .json file, a path also as .csv.",
)
@click.option("--all", "whole", is_flag=True, help="Print every coordinate, also of beams' nodes.")
@time_option
@any_kind_option
@profile_option
@set_option
@initial_option
@input_option
@scene_options
@json_option
@debug_option
def equilibrium(
    scene: str, path: str | None, time: float, any_kind: bool, whole: bool, as_json: bool, **options: Any
) -> int:
    """Find the equilibrium of a SCENE near the initial state, with the base held in the position at a time."""
    from eomgen.base.files import make_folder, write_text  # noqa: PLC0415  # imported with fine arguments
    from eomgen.pipeline import pipeline  # noqa: PLC0415

    parts: list[RestPart] = [part({**options, "path": path}) for part in parts_of("equilibrium")]
    asked = next((part for part in parts if part.answers), None)
    if asked is None and path is not None and Path(path).suffix != ".json":
        raise UsageError(
            Problem(f"--out {path}", "an equilibrium is written as a .json file [E0157]", "--out rest.json")
        )
    described = read_scene(scene, options)
    with building(described.name):
        model = pipeline.build(described, real="double", profile=options["profile"])
    files = [*([] if path is None else [path]), *(f"{file}" for part in parts for file in part.files)]
    for file in files:
        make_folder(Path(file).parent)
    arguments = {"initial": options["initial"], "parameters": options["parameters"], "t": time, "u": options["inputs"]}
    if asked is not None:
        return asked.answer(model, arguments, as_json)
    with waiting(f"{model.name}: equilibrium"):
        result = model.equilibrium(**arguments, any_kind=any_kind)
    data = _describe(model, result, arguments, parts)
    for part in parts:
        part.draw(model, result, arguments)
    if path is not None:
        write_text(Path(path), json_text(data) + "\n")
    if as_json:
        print_json(data)
    else:
        _print(model, result, data, parts, whole=whole)
    say(result.message + (f"\nwritten to {', '.join(files)}" if files else ""))
    return 0


def _print(
    model: Model, result: Equilibrium, data: Mapping[str, Any], parts: Sequence[RestPart], *, whole: bool
) -> None:
    """Print coordinates, outputs, multipliers and frequencies of an equilibrium."""
    hidden = _print_coordinates(model, result, whole=whole)
    outputs = [(name, values, data["units"][name]) for name, values in data["outputs"].items()]
    if outputs:
        cells = [(name, number_list(values), unit) for name, values, unit in outputs]
        print_table("outputs", ("output", "value", "unit"), cells)
    for part in parts:
        part.show(data)
    if hidden:
        say(f"{hidden} coordinates of nodes of beams are left out; --all shows them")
    forces = [(name, f"{value:.9g}") for name, value in data["multipliers"].items() if ": no " not in name]
    _print_first("multipliers of constraints", ("row", "value"), forces, whole=whole)
    frequencies = ", ".join(f"{value:.5g}" for value in result.frequencies[:12])
    say(f"angular frequencies of small motions, rad/s, negative of growing ones: {frequencies}")


def _print_coordinates(model: Model, result: Equilibrium, *, whole: bool) -> int:
    """Print coordinates, velocities other than zero and states; return the number of hidden coordinates of nodes."""
    nodes = set() if whole else {node for beam in model.description.exact_beams for node in beam}
    kept = [name.partition(".")[2].partition("[")[0] not in nodes for name in model.q_names]
    rows = [
        (name, f"{value:.9g}", unit)
        for name, value, unit, shown in zip(model.q_names, result.q, model.q_units, kept, strict=True)
        if shown
    ]
    speeds = zip(model.v_names, result.v, model.v_units, strict=True)
    rows += [(name, f"{value:.9g}", unit) for name, value, unit in speeds if value]
    states = zip(model.z_names, result.z, model.z_units, strict=True)
    rows += [(name, f"{value:.9g}", unit) for name, value, unit in states]
    _print_first(f"{model.name} at rest", ("coordinate", "value", "unit"), rows, whole=whole)
    return kept.count(False)


def _print_first(title: str, header: Sequence[str], rows: Sequence[Sequence[str]], *, whole: bool) -> None:
    """Print a table of the first 40 rows, or of the ``whole``, if there are rows."""
    most = len(rows) if whole else 40
    if rows:
        print_table(title, header, rows[:most], numeric=(1,))
    if len(rows) > most:
        say(f"{len(rows) - most} more with --all")


def _describe(model: Model, rest: Equilibrium, options: Mapping[str, Any], parts: Sequence[RestPart]) -> dict[str, Any]:
    """Return an equilibrium as JSON types: state, outputs, stability and notes, with the entries that ``parts`` add."""
    import numpy as np  # noqa: PLC0415

    p = model.parameter_array(options["parameters"])
    still = {"a": np.zeros(model.nv), "z": rest.z, "multipliers": rest.multipliers, "parameters": p}
    outputs = model.outputs(rest.q, rest.v, t=rest.t, u=options["u"], **still)
    added = [entry for part in parts for entry in part.data(model, rest, options).items()]
    return {
        "scene": model.name,
        "t": rest.t,
        "q": dict(zip(model.q_names, rest.q.tolist(), strict=True)),
        "v": dict(zip(model.v_names, rest.v.tolist(), strict=True)),
        "z": dict(zip(model.z_names, rest.z.tolist(), strict=True)),
        "multipliers": dict(zip(model.multipliers, rest.multipliers.tolist(), strict=True)),
        "outputs": {name: values.tolist() for name, values in outputs.items()},
        "units": {item.name: item.unit for item in model.description.outputs},
        **dict(added),
        "residual": rest.residual,
        "acceleration": rest.acceleration,
        "iterations": rest.iterations,
        "frequencies": rest.frequencies.tolist(),
        "stable": rest.stable,
        "undetermined": list(rest.undetermined),
        "notes": list(rest.notes),
        "message": rest.message,
    }
