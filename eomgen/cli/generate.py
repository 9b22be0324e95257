"""``eomgen generate``: the self-contained folder of C code."""

from __future__ import annotations

from typing import Any

import click

from eomgen.cli.options import debug_option, folder_option, json_option, scene_options, terms_option
from eomgen.cli.printing import print_json, say
from eomgen.cli.running import say_notes
from eomgen.text import counted


@click.command()
@scene_options
@folder_option
@terms_option
@click.option(
    "--target", default="c", show_default=True, help="The language; others than C come with other distributions."
)
@click.option("--method", default=None, help="Whose stepper is written; the scene's by default.")
@json_option
@debug_option
def generate(
    scene: str,
    folder: str,
    terms: list[str] | None,
    method: str | None,
    target: str,
    as_json: bool,
    **reading: Any,
) -> None:
    """Write the model of a SCENE and its stepper as a folder of C that needs nothing but a C99 compiler.

    Numbers are doubles; compile with -DEOMGEN_REAL_FLOAT for floats. manifest.json has the command, and names and units
    of parameters, inputs, states and outputs.
    """
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # SymPy comes with it
    from eomgen.scene.scene import Scene  # noqa: PLC0415

    described = pipeline.load(scene, **reading)
    if isinstance(described, Scene):
        say_notes(described)
        if (described.simulation.method if method is None else method) == "auto":
            taken = pipeline.method_of(described, method)
            say(f"note: auto chooses a method before a run; C, which is written earlier, steps with {taken}")
    files = pipeline.generate(described, folder, terms, method, target=target)
    if as_json:
        print_json([str(file) for file in files])
    else:
        for file in files:
            click.echo(str(file))
    say(f"{counted(len(files), 'file')}; README.md there says how to compile them")
