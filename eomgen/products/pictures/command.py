"""``eomgen animate``: an HTML animation of a scene or of a stored solution; figures and tables for ``equilibrium``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.cli.options import debug_option, file_to_write, run_options, scene_options
from eomgen.cli.printing import number_list, print_table, say
from eomgen.cli.running import outcome_code, read_scene, run
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.analysis.equilibrium import Equilibrium
    from eomgen.pipeline.model import Model
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
    from eomgen.products.pictures.animation import check_name  # noqa: PLC0415  # imported when the arguments are known to be fine

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


def draw_rest_with_loads(model: Model, result: Equilibrium, parameters: Any, initial: Any, path: Path) -> Path:
    """Draw the shape at rest over the initial one, with supports and forces that are numbers."""
    from eomgen.products.pictures.shapes import arrows, draw_rest  # noqa: PLC0415  # matplotlib comes with it
    from eomgen.scene.forces.forces import Force  # noqa: PLC0415

    forces = [item for item in getattr(model.scene, "elements", ()) if isinstance(item, Force)]
    loads = arrows([item for item in forces if item.axes == "world"], model, parameters)
    return draw_rest(model, result.q, result.t, parameters, path, initial=initial, loads=loads)


def print_beams(beams: Mapping[str, Mapping[str, Any]]) -> None:
    """Print displacements and section loads of geometrically exact beams."""
    rows = []
    for name, beam in beams.items():
        end, most = beam["end"], beam["largest_displacement"]
        rows += [
            (name, f"displacement at x = {end['x']:.4g} m", number_list(end["displacement"]), "m"),
            ("", f"rotation at x = {end['x']:.4g} m", number_list(end["rotation"]), "rad"),
            ("", f"largest displacement, at x = {most['x']:.4g} m", f"{most['size']:.6g}", "m"),
        ]
        for quantity, unit in (("moment", "N m"), ("force", "N")):
            for section in (beam["first_section"], beam["last_section"]):
                rows.append(
                    ("", f"section {quantity} at x = {section['x']:.4g} m", number_list(section[quantity]), unit)
                )
            largest = beam[f"largest_{quantity}"]
            where = f"largest section {quantity}, at x = {largest['x']:.4g} m"
            rows.append(("", where, f"{largest['size']:.6g}", unit))
    print_table("beams, against the initial shape", ("beam", "", "value", "unit"), rows)
