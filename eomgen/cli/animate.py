"""``eomgen animate``: an HTML animation of a scene or of a stored solution."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.cli.options import debug_option, file_to_write, run_options, scene_options
from eomgen.cli.printing import say
from eomgen.cli.running import outcome_code, read_scene, run
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.results.solution import Solution


@click.command()
@click.option("--out", "path", required=True, metavar="FILE.html", callback=file_to_write, help="Page to write.")
@run_options
@scene_options
@debug_option
def animate(scene: str, path: str, **options: Any) -> int:
    """Write the motion of a SCENE, or of a solution.npz instead, as one HTML page that needs no network.

    A run that fails or is interrupted is shown as far as it came; the exit code is then 6 or 130.
    """
    from eomgen.base.files import make_folder  # noqa: PLC0415
    from eomgen.results.animation import check_name  # noqa: PLC0415  # imported when the arguments are known to be fine

    target = check_name(Path(path))
    _check_scene(Path(scene))
    solution = _stored(scene) if scene.endswith(".npz") else run(read_scene(scene, options), options)[1]
    make_folder(target.parent)
    written = solution.animate(target)
    say(f"{solution.message}\nwritten to {written}, {written.stat().st_size / 1e6:.2g} MB: open it in a browser")
    return outcome_code(solution)


def _check_scene(path: Path) -> None:
    """Raise UsageError for a table or for a folder of a run, whose solution lies in the same place."""
    folder = path if path.is_dir() else path.parent if path.suffix == ".csv" else None
    if folder is not None:
        fault = "this is a folder" if folder == path else "a table has no poses of bodies"
        kept = folder / "solution.npz"
        hint = f"{kept}" if kept.is_file() else "the scene, or the solution.npz of eomgen simulate"
        raise UsageError(Problem(str(path), f"{fault}, and a scene or a stored solution is needed", hint))


def _stored(path: str) -> Solution:
    from eomgen.results.solution import Solution  # noqa: PLC0415

    context = click.get_current_context()
    given = [
        option.opts[0]
        for option in context.command.params
        if option.name not in ("scene", "path")
        and context.get_parameter_source(option.name or "") is not click.core.ParameterSource.DEFAULT
    ]
    if given:
        fault = f"{', '.join(given)} would change a run, and this one is stored"
        raise UsageError(Problem(path, fault, "the scene in place of its solution, or no such option"))
    return Solution.load(path)
