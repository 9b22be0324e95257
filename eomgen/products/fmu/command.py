"""``eomgen fmu``: the command."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.cli.options import (
    arguments_of,
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

_of_fmu = arguments_of("eomgen.products.fmu.export:fmu")
#: Options that are arguments of the function under the same name.
_OPTIONS = (
    *("version", "types", "method", "inputs", "binary", "machines", "reference", "dae", "minimal", "arrays"),
    *("author", "model_version", "copyright", "license", "license_file", "description"),
)


@click.command()
@_of_fmu("-o", "--output", "--out", "file", metavar="FILE", callback=file_to_write)
@_of_fmu("--version", metavar="VERSION")
@click.option(
    "--type",
    "types",
    default="me,cs",
    show_default=True,
    metavar="TYPES",
    help="Model exchange, co-simulation, or one of both: ME, CS.",
)
@_of_fmu("--method")
@_of_fmu("--input", "inputs", multiple=True, metavar="NAME")
@_of_fmu("--binary/--no-binary")
@_of_fmu("--for", "machines", multiple=True, metavar="MACHINE")
@_of_fmu("--reference/--no-reference")
@_of_fmu("--dae", is_flag=True)
@_of_fmu("--minimal", is_flag=True)
@_of_fmu("--arrays", is_flag=True)
@_of_fmu("--author", metavar="TEXT")
@_of_fmu("--model-version", metavar="TEXT")
@_of_fmu("--copyright", metavar="TEXT")
@_of_fmu("--license", metavar="NAME")
@_of_fmu("--license-file", metavar="FILE")
@_of_fmu("--description", metavar="TEXT")
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
