"""``eomgen animate``: an HTML animation of a scene or of a stored solution; parts of ``eomgen equilibrium`` and
``eomgen simulate`` with figures and tables."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.cli.options import debug_option, file_to_write, run_options, scene_options
from eomgen.cli.parts import AddedOption, RestPart, RunPart
from eomgen.cli.printing import number_list, print_table, say
from eomgen.cli.running import outcome_code, read_scene, run
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.compiled.rest.equilibrium import Equilibrium
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
    """Raise UsageError for a folder, or a table (.csv); the hint is the solution of a run in that folder."""
    folder = path if path.is_dir() else path.parent if path.suffix == ".csv" else None
    if folder is not None:
        fault = "this is a folder" if folder == path else "a table has no poses of bodies"
        kept = folder / "solution.npz"
        hint = f"{kept}" if kept.is_file() else "the scene, or the solution.npz of eomgen simulate"
        raise UsageError(Problem(str(path), f"{fault}, and a scene or a stored solution is needed [E0148]", hint))


def _stored(path: str) -> Solution:
    from eomgen.results.solution import Solution  # noqa: PLC0415

    context = click.get_current_context()
    option_names = [
        option.opts[0]
        for option in context.command.params
        if option.name not in ("scene", "path")
        and context.get_parameter_source(option.name or "") is not click.core.ParameterSource.DEFAULT
    ]
    if option_names:
        fault = f"{', '.join(option_names)} would change a run, and this one is stored [E0149]"
        raise UsageError(Problem(path, fault, "the scene in place of its solution, or no such option"))
    return Solution.load(path)


_FIGURES = (".png", ".svg", ".pdf")


class RestPicture(RestPart):
    """``--plot`` of ``eomgen equilibrium``, and displacements and section loads of beams at rest."""

    OPTIONS = (
        AddedOption(
            "--plot",
            "figure",
            behind="--out",
            default=None,
            metavar="FILE.png",
            callback=file_to_write,
            help="Draw the shape at rest, or the path.",
        ),
    )

    def __init__(self, options: Mapping[str, Any]) -> None:
        figure = options["figure"]
        if figure is not None and Path(figure).suffix not in _FIGURES:
            fault = "a figure is a .png, .svg or .pdf file [E0154]"
            raise UsageError(Problem(f"--plot {figure}", fault, "--plot rest.png"))
        self.files = [] if figure is None else [Path(figure)]

    def draw(self, model: Model, result: Equilibrium, arguments: Mapping[str, Any]) -> None:
        """Draw the shape at rest over the initial one, with supports and forces that are numbers, into the file of
        ``--plot``; none without the option."""
        if not self.files:
            return
        from eomgen.products.pictures.shapes import arrows, draw_rest  # noqa: PLC0415  # matplotlib comes with it
        from eomgen.scene.forces.forces import Force  # noqa: PLC0415

        forces = [item for item in getattr(model.scene, "elements", ()) if isinstance(item, Force)]
        p = model.parameter_array(arguments["parameters"])
        loads = arrows([item for item in forces if item.axes == "world"], model, p)
        draw_rest(model, result.q, result.t, p, self.files[0], initial=arguments["initial"], loads=loads)

    def data(self, model: Model, result: Equilibrium, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Return displacements and section loads of exact beams at rest under the key ``beams``; an empty mapping there
        for a model without such beams."""
        if not model.description.exact_beams:
            return {"beams": {}}
        import numpy as np  # noqa: PLC0415

        from eomgen.products.pictures.section_loads import beams_at_rest  # noqa: PLC0415

        p = model.parameter_array(arguments["parameters"])
        still = {"a": np.zeros(model.nv), "z": result.z, "multipliers": result.multipliers, "parameters": p}
        loads = model.section_loads(result.q, result.v, result.t, arguments["u"], **still)
        return {"beams": beams_at_rest(model, arguments["initial"], result.q, result.t, p, loads)}

    def show(self, data: Mapping[str, Any]) -> None:
        """Print a table of displacements and section loads of geometrically exact beams."""
        rows = []
        for name, beam in data["beams"].items():
            end, most = beam["end"], beam["largest_displacement"]
            rows += [
                (name, f"displacement at x = {end['x']:.4g} m", number_list(end["displacement"]), "m"),
                ("", f"rotation at x = {end['x']:.4g} m", number_list(end["rotation"]), "rad"),
                ("", f"largest displacement, at x = {most['x']:.4g} m", f"{most['size']:.6g}", "m"),
            ]
            for quantity, unit in (("moment", "N m"), ("force", "N")):
                for section in (beam["first_section"], beam["last_section"]):
                    where = f"section {quantity} at x = {section['x']:.4g} m"
                    rows.append(("", where, number_list(section[quantity]), unit))
                largest = beam[f"largest_{quantity}"]
                where = f"largest section {quantity}, at x = {largest['x']:.4g} m"
                rows.append(("", where, f"{largest['size']:.6g}", unit))
        if rows:
            print_table("beams, against the initial shape", ("beam", "", "value", "unit"), rows)


class SectionsOfRun(RunPart):
    """Figures and largest values of section loads along beams in ``eomgen simulate``."""

    def __init__(self, solution: Solution, model: Model | None = None) -> None:
        self.solution = solution
        self.beams = model is not None and bool(model.description.exact_beams)

    @cached_property
    def _largest(self) -> dict[str, dict[str, dict[str, float]]]:
        from eomgen.products.pictures.section_loads import largest_section_loads  # noqa: PLC0415

        return largest_section_loads(self.solution) if self.beams else {}

    def data(self) -> dict[str, Any]:
        """Return the largest section loads of each beam."""
        return {"section_loads": self._largest} if self._largest else {}

    def rows(self) -> list[tuple[str, str]]:
        """Return the largest section loads of each beam, in words."""
        rows: list[tuple[str, str]] = []
        for beam, largest in self._largest.items():
            for quantity, unit in (("moment", "N m"), ("force", "N")):
                load = largest[quantity]
                size = f"{load['size']:.6g} {unit} at x = {load['x']:.4g} m, t = {load['t']:.6g} s"
                rows.append((f"largest section {quantity} of {beam}", size))
        return rows

    @contextmanager
    def storage(self, folder: Path) -> Iterator[str | None]:
        """Store the loads that are drawn in a file of ``folder`` within the block, which gets its path, or None without
        beams; the file is removed at the end."""
        if not self.beams:
            yield None
            return
        from eomgen.products.pictures.section_loads import store_drawn_loads  # noqa: PLC0415

        loads = folder / f".loads.{os.urandom(8).hex()}.npz"
        try:
            store_drawn_loads(self.solution, loads)
            yield f"{loads}"
        finally:
            loads.unlink(missing_ok=True)

    def drawings(self, folder: Path, stored: str | None = None) -> list[Callable[[], list[Path]]]:
        """Return the functions that draw the section loads of beams into ``folder``, one or none; ``stored`` is the
        path of stored loads."""
        if stored is None and not self.beams:
            return []
        from eomgen.products.pictures.section_loads import section_drawing  # noqa: PLC0415

        return [section_drawing(self.solution, folder, stored)]
