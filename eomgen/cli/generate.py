"""``eomgen generate``: the self-contained folder of C code."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from eomgen.base.messages import counted
from eomgen.cli.options import (
    assignments,
    check_assigned,
    debug_option,
    folder_option,
    in_units,
    json_option,
    scene_options,
    set_option,
    terms_option,
)
from eomgen.cli.printing import print_json, say
from eomgen.cli.running import say_notes, say_stand_in
from eomgen.scene.sources.register import all_options, source_of


@click.command()
@folder_option
@terms_option
@click.option(
    "--target", default="c", show_default=True, help="The language; others than C come with other distributions."
)
@click.option("--method", default=None, help="Whose stepper is written; the scene's by default.")
@click.option(
    "--real",
    type=click.Choice(["double", "float"]),
    default=None,
    help="Number type of the compile command in README.md and manifest.json; the scene's by default.",
)
@click.option(
    "--only",
    type=click.Choice(["controller"]),
    default=None,
    help="Write the controller of the scene without the machine: signals in, commands out.",
)
@click.option(
    "--uniform",
    is_flag=True,
    help="Write all functions and steps with one signature, too, which a program can call for every model.",
)
@set_option
@scene_options
@json_option
@debug_option
def generate(
    scene: str,
    folder: str,
    terms: list[str] | None,
    method: str | None,
    target: str,
    real: str | None,
    only: str | None,
    uniform: bool,
    parameters: Sequence[str],
    as_json: bool,
    **reading: Any,
) -> None:
    """Write the model of a SCENE and its stepper as a folder of C that needs only a C99 compiler.

    The files serve all number types: eomgen_real is double without a macro, float with -DEOMGEN_REAL_FLOAT; functions
    without the stepper also take -DEOMGEN_REAL_COMPLEX (complex steps) and -DEOMGEN_REAL_LANES (several states at once,
    -DEG_LANES=4, 8 or 16). --set NAME=VALUE makes values the defaults of the C. manifest.json has the command that
    compiles the folder, and names and units of parameters, inputs, states and outputs.
    """
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # SymPy comes with it
    from eomgen.scene.scene import Scene  # noqa: PLC0415

    described = pipeline.load(scene, **reading)
    values: Mapping[str, float | str] = assignments("--set", parameters)
    if isinstance(described, Scene):
        say_notes(described)
        check_assigned(described, values, {}, robot=source_of(Path(scene)) is all_options()["actuated"][0])
        values = in_units("--set", values, described.parameters)
        if only is None:
            say_stand_in(described, method, "C, which is written earlier, steps with")
    files = pipeline.generate(
        described, folder, terms, method, target=target, real=real, parameters=values, only=only, uniform=uniform
    )
    if as_json:
        print_json([str(file) for file in files])
    else:
        for file in files:
            click.echo(str(file))
    say(f"{counted(len(files), 'file')}; README.md there says how to compile them")
