"""``eomgen live``: a page in which a scene runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from eomgen.cli.options import debug_option, run_options, scene_options
from eomgen.cli.printing import say
from eomgen.cli.running import outcome_code, read_scene, run


@click.command()
@click.option("--out", "path", required=True, metavar="FILE.html", help="Page to write.")
@run_options
@scene_options
@debug_option
def live(scene: str, path: str, **options: Any) -> int:
    """Write a page in which the model of a SCENE runs: one HTML file that needs no server.

    Parameters, inputs and initial values have sliders; outputs and energies are plotted while the motion plays. The
    digits are equal to a run with --profile reproducible, which is the profile of the run whose error the page states.
    """
    from eomgen.base.files import make_folder  # noqa: PLC0415
    from eomgen.products.pages.live import live as written  # noqa: PLC0415  # imported with fine arguments
    from eomgen.results.animation import check_name  # noqa: PLC0415

    target = check_name(Path(path))
    make_folder(target.parent)
    if click.get_current_context().get_parameter_source("profile") is ParameterSource.DEFAULT:
        options["profile"] = "reproducible"
    model, solution = run(read_scene(scene, options), options)
    page = written(model, target, solution=solution)
    say(f"{solution.message}\nwritten to {page}, {page.stat().st_size / 1e3:.0f} kB: a page for a browser")
    return outcome_code(solution)
