"""``eomgen fmu``: the command."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.cli.options import (
    assignments,
    check_assigned,
    debug_option,
    file_to_write,
    in_units,
    initial_option,
    json_option,
    scene_options,
    set_option,
)
from eomgen.cli.printing import building, print_json, say
from eomgen.cli.running import say_notes, stand_in
from eomgen.scene.sources.register import takes

if TYPE_CHECKING:
    from eomgen.products.fmu.export import FmuFiles

#: Options that are arguments of the function under the same name.
_OPTIONS = (
    *("version", "types", "method", "inputs", "binary", "machines", "reference", "dae", "minimal", "arrays"),
    *("author", "model_version", "copyright", "license", "license_file", "description"),
)


@click.command()
@click.option(
    "-o",
    "--output",
    "--out",
    "file",
    default=None,
    metavar="FILE",
    callback=file_to_write,
    help="The file; NAME.fmu by default.",
)
@click.option("--version", default="3", show_default=True, metavar="VERSION", help="Of FMI: 2 or 3, as 2.0 or 3.0.")
@click.option(
    "--type",
    "types",
    default="me,cs",
    show_default=True,
    metavar="TYPES",
    help="Model exchange, co-simulation, or one of both: ME, CS.",
)
@click.option("--method", default=None, help="Whose stepper co-simulation has; the scene's by default.")
@click.option(
    "--input",
    "inputs",
    multiple=True,
    metavar="NAME",
    help="An input with a formula in the scene that importers may set; may be repeated.",
)
@click.option("--binary/--no-binary", default=True, show_default=True, help="Compile this machine's library.")
@click.option(
    "--for",
    "machines",
    multiple=True,
    metavar="MACHINE",
    help="Add the library of another machine, made by zig: x86_64-windows, aarch64-linux ...; may be repeated.",
)
@click.option("--reference/--no-reference", default=None, help="Add the motion of simulate; as --binary by default.")
@click.option(
    "--dae", is_flag=True, help="Importers may solve for accelerations and multipliers: FMI-LS-DAE, 1.0.0-alpha.1."
)
@click.option("--minimal", is_flag=True, help="States of model exchange are independent coordinates; for loops.")
@click.option("--arrays", is_flag=True, help="Vectors are arrays, one variable each (FMI 3.0).")
@click.option("--author", default="", metavar="TEXT", help="Of the model, for the model description.")
@click.option("--model-version", default="", metavar="TEXT", help="Of the model, for the model description.")
@click.option("--copyright", default="", metavar="TEXT", help="Of the model, for the model description.")
@click.option("--license", default="", metavar="NAME", help="Of the model: MIT, proprietary ...")
@click.option("--license-file", default=None, metavar="FILE", help="Text of the model's licence.")
@click.option("--description", default="", metavar="TEXT", help="Of the model; the scene's by default.")
@set_option
@initial_option
@scene_options
@json_option
@debug_option
def fmu(
    scene: str, file: str | None, parameters: Sequence[str], initial: Sequence[str], as_json: bool, **options: Any
) -> None:
    """Write the model of a SCENE for other simulation tools, as an FMU: sources, and this machine's library.

    Co-simulation steps with the scene's method and gives the bits of eomgen simulate --profile reproducible. In model
    exchange the importer integrates positions, velocities and internal states; scenes with loops are brought back onto
    the constraints at completed steps. --set NAME=VALUE makes values the start values of parameters,
    --initial NAME=VALUE of states and joints.
    """
    from eomgen.pipeline import documents  # noqa: PLC0415  # imports SymPy
    from eomgen.products.fmu import export  # noqa: PLC0415

    export_options = {name: options.pop(name) for name in _OPTIONS}
    described = documents.load_scene(scene, **options)
    values: Mapping[str, float | str] = assignments("--set", parameters)
    starts = assignments("--initial", initial)
    say_notes(described)
    check_assigned(described, values, {}, robot=takes(Path(scene), "tunable"))
    values = in_units("--set", values, described.parameters)
    with building(described.name):
        make = partial(export.fmu_files, described, parameters=values or None, initial=starts or None, **export_options)
        path, files = export.written(file, make)
    if as_json:
        print_json(_facts(path, files))
    else:
        click.echo(str(path))
    for doubt in files.interface.doubts:
        say(f"of steps in co-simulation: {doubt}")
    steps = stand_in(described, export_options["method"])
    say(f"{path.stat().st_size} bytes{steps}; documentation/index.html there says how to compile and use the sources")


def _facts(path: Path, made: FmuFiles) -> dict[str, Any]:
    """Return facts on an archive: interface, counts of variables, libraries."""
    interface = made.interface
    kinds = {"inputs": "input", "outputs": "output", "parameters": "parameter"}
    rows = interface.program.method.get("events", {}).get("rows", ())
    return {
        "file": str(path),
        "bytes": path.stat().st_size,
        "version": interface.version,
        "types": list(interface.options.types),
        "identifier": interface.identifier,
        "token": interface.token,
        "states": len(interface.states),
        **{name: len(interface.of(kind)) for name, kind in kinds.items()},
        "event_indicators": len(rows) if interface.exchange else 0,
        "variables": len(interface.variables),
        "binaries": [name for name in sorted(made.files) if name.startswith("binaries/")],
        "check": f"fmpy validate {shlex.quote(str(path))}",  # another program checks an FMU
    }
