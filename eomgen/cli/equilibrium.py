"""``eomgen equilibrium``: static equilibrium of a scene, its stability, and undetermined coordinates; with
``--path`` and ``--buckling`` load paths by arc length, and linear buckling loads.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.json_text import json_text
from eomgen.base.products import fault_of_absent, object_of
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
from eomgen.cli.printing import building, number_list, print_json, print_table, say
from eomgen.cli.running import read_scene
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.analysis.equilibrium import Equilibrium
    from eomgen.pipeline.model import Model


_FIGURES = (".png", ".svg", ".pdf")


_SHOWN = 40
#: Maximum number of listed multipliers.
_ROWS = 12


@click.command()
@click.option(
    "--out",
    "path",
    default=None,
    metavar="FILE",
    callback=file_to_write,
    help="Write the result to this .json file, a path also as .csv.",
)
@click.option(
    "--path", "along", default=None, metavar="NAME=FROM:TO", help="Follow equilibria while a parameter goes to a value."
)
@click.option("--over", multiple=True, metavar="COLUMN", help="Column to draw the parameter over; may be repeated.")
@click.option(
    "--plot",
    "figure",
    default=None,
    metavar="FILE.png",
    callback=file_to_write,
    help="Draw the shape at rest, or the path.",
)
@click.option("--all", "whole", is_flag=True, help="Print every coordinate, also of beams' nodes.")
@click.option("--buckling", default=None, metavar="NAME[=AT]", help="Linear buckling loads about a preload.")
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

    figure = options.pop("figure")
    request = _request(options.pop("along"), options.pop("over"), figure, options.pop("buckling"), path)
    if request is None and path is not None and Path(path).suffix != ".json":
        raise UsageError(Problem(f"--out {path}", "an equilibrium is written as a .json file", "--out rest.json"))
    drawing = _drawing(figure) if figure is not None and request is None else None
    described = read_scene(scene, options)
    with building(described.name):
        model = pipeline.build(described, real="double", profile=options.pop("profile"))
    for file in (path, figure):
        if file is not None:
            make_folder(Path(file).parent)
    given = options["initial"], options["parameters"], time, options["inputs"]
    if request is not None:
        return int(request.answer(model, *given, as_json))
    with waiting(f"{model.name}: equilibrium"):
        result = model.equilibrium(*given, any_kind=any_kind)
    p = model.parameter_array(options["parameters"])
    data = _described(model, result, p, options["inputs"], options["initial"])
    files = [] if drawing is None else [drawing(model, result, p, options["initial"], Path(figure))]
    if path is not None:
        write_text(Path(path), json_text(data) + "\n")
    if as_json:
        print_json(data)
    else:
        _print(model, result, data, whole=whole)
    for file in files:
        path = str(file) if path is None else f"{path}, {file}"
    say(result.message + (f"\nwritten to {path}" if path is not None else ""))
    return 0


def _print(model: Model, result: Equilibrium, data: Mapping[str, Any], *, whole: bool) -> None:
    hidden = _print_coordinates(model, result, whole=whole)
    outputs = [(name, values, data["units"][name]) for name, values in data["outputs"].items()]
    if outputs:
        cells = [(name, number_list(values), unit) for name, values, unit in outputs]
        print_table("outputs", ("output", "value", "unit"), cells)
    if data["beams"]:
        object_of("eomgen.pictures", "printed_beams")(data["beams"])
    if hidden:
        say(f"{hidden} coordinates of nodes of beams are left out; --all shows them")
    forces = [(name, f"{value:.9g}") for name, value in data["multipliers"].items() if ": no " not in name]
    if forces:
        print_table("multipliers of constraints", ("row", "value"), forces[:_ROWS], numeric=(1,))
    if len(forces) > _ROWS:
        say(f"{len(forces) - _ROWS} more with --json")
    frequencies = ", ".join(f"{value:.5g}" for value in result.frequencies[:12])
    say(f"angular frequencies of small motions, rad/s: {frequencies}")


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
    most = len(rows) if whole else _SHOWN
    if rows:
        print_table(f"{model.name} at rest", ("coordinate", "value", "unit"), rows[:most], numeric=(1,))
    if len(rows) > most:
        say(f"{len(rows) - most} more with --all")
    return kept.count(False)


def _request(
    along: str | None, over: tuple[str, ...], figure: str | None, buckling: str | None, out: str | None
) -> Any:
    """Return the request of a load path or of buckling loads; None for an equilibrium alone. Raises UsageError for
    options that do not fit together, and if statics are not installed."""
    if along is None:
        if over:
            raise UsageError(Problem("--over", "it belongs to a path", "--path load=0:10"))
        if buckling is not None and figure:
            fault = "it belongs to a path, or to an equilibrium alone"
            raise UsageError(Problem("--plot", fault, "--path load=0:10"))
    if figure is not None and Path(figure).suffix not in _FIGURES:
        raise UsageError(Problem(f"--plot {figure}", "a figure is a .png, .svg or .pdf file", "--plot rest.png"))
    if along is None and buckling is None:
        return None
    request = object_of("eomgen.statics", "path")
    if request is None:
        given = f"--path {along}" if along is not None else f"--buckling {buckling}"
        raise UsageError(Problem(given, *(fault_of_absent("equilibrium_path") or ())))
    return request.read(along, over, figure, buckling, out)


def _drawing(figure: str) -> Callable[..., Path]:
    """Return the function that draws the shape at rest. Raises UsageError if pictures are not installed."""
    drawing: Callable[..., Path] | None = object_of("eomgen.pictures", "rest")
    if drawing is None:
        raise UsageError(Problem(f"--plot {figure}", *(fault_of_absent("animate") or ())))
    return drawing


def _described(model: Model, result: Equilibrium, parameters: Any, inputs: Any, initial: Any) -> dict[str, Any]:
    import numpy as np  # noqa: PLC0415

    still = {"a": np.zeros(model.nv), "z": result.z, "multipliers": result.multipliers, "parameters": parameters}
    outputs = model.outputs(result.q, result.v, t=result.t, u=inputs, **still)
    beams, at_rest = {}, object_of("eomgen.pictures", "beams_at_rest")
    if model.description.exact_beams and at_rest:
        loads = model.section_loads(result.q, result.v, result.t, inputs, **still)
        beams = at_rest(model, initial, result.q, result.t, parameters, loads)
    return {
        "scene": model.name,
        "t": result.t,
        "q": dict(zip(model.q_names, result.q.tolist(), strict=True)),
        "v": dict(zip(model.v_names, result.v.tolist(), strict=True)),
        "z": dict(zip(model.z_names, result.z.tolist(), strict=True)),
        "multipliers": dict(zip(model.multipliers, result.multipliers.tolist(), strict=True)),
        "outputs": {name: values.tolist() for name, values in outputs.items()},
        "units": {item.name: item.unit for item in model.description.outputs},
        "beams": beams,
        "residual": result.residual,
        "acceleration": result.acceleration,
        "iterations": result.iterations,
        "frequencies": result.frequencies.tolist(),
        "stable": result.stable,
        "undetermined": list(result.undetermined),
        "notes": list(result.notes),
        "message": result.message,
    }
