"""``eomgen live``: a page in which a scene runs; ``eomgen report``: a page on scenes and runs; ``eomgen latex``: the
equations of a scene as a document."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from eomgen.base.json_text import json_text
from eomgen.base.messages import counted
from eomgen.base.progress import terminal_bar
from eomgen.cli.options import (
    completed_files,
    debug_option,
    file_to_write,
    json_option,
    optional_folder,
    run_options,
    scene_options,
)
from eomgen.cli.printing import say
from eomgen.cli.running import outcome_code, read_scene, run, say_notes
from eomgen.errors import Problem, UsageError


@click.command()
@click.option("--out", "path", required=True, metavar="FILE.html", callback=file_to_write, help="Page to write.")
@run_options
@scene_options
@debug_option
def live(scene: str, path: str, **options: Any) -> int:
    """Write a page in which the model of a SCENE runs: one HTML file that needs no server.

    Parameters, inputs and initial values have sliders; outputs and energies are plotted while the motion plays. The
    digits are equal to a run with --profile reproducible; --profile is of the run whose error the page states.
    """
    from eomgen.base.files import make_folder  # noqa: PLC0415
    from eomgen.products.pages.live import live as written  # noqa: PLC0415  # imported with fine arguments
    from eomgen.products.pictures.animation import check_name  # noqa: PLC0415

    target = check_name(Path(path))
    model, solution = run(read_scene(scene, options), options)
    say(f"{solution.message}\nthe model is compiled for browsers, in up to a minute the first time")
    make_folder(target.parent)
    page = written(model, target, solution=solution)
    say(f"written to {page}, {page.stat().st_size / 1e3:.0f} kB: a page for a browser")
    return outcome_code(solution)


#: A page takes the steps of this profile.
next(option for option in live.params if option.name == "profile").default = "reproducible"


@click.command()
@click.argument("sources", nargs=-1, required=True, metavar="SCENE|DIR...", shell_complete=completed_files)
@click.option("--out", "path", required=True, metavar="FILE.html", callback=file_to_write, help="Page to write.")
@click.option("--check", "checks", is_flag=True, help="Check all closed forms of the scene, as eomgen check.")
@click.option("--animation/--no-animation", default=True, show_default=True, help="Show the motion.")
@debug_option
def report(sources: tuple[str, ...], path: str, checks: bool, animation: bool) -> int:
    """Write a report on a SCENE, which is run, or on runs of eomgen simulate: folders or solution.npz files.

    Several runs are compared side by side. A folder may hold folders of runs. The page can be printed.
    """
    from eomgen.base.files import make_folder, read_file, write_text  # noqa: PLC0415  # imported with fine arguments
    from eomgen.pipeline import documents, pipeline  # noqa: PLC0415
    from eomgen.products.pages.report import ReportedRun, report_page  # noqa: PLC0415
    from eomgen.products.pictures.animation import check_name  # noqa: PLC0415
    from eomgen.results.solution import Solution  # noqa: PLC0415

    target = check_name(Path(path))
    runs, model, text = [], None, ""
    for source in sources:
        files = _stored_runs(Path(source))
        if files:
            runs += [ReportedRun(_name_of(file), Solution.load(file)) for file in files]
            continue
        scene = documents.load_scene(source)
        say_notes(scene)
        model, text = pipeline.build(scene), read_file(Path(source)).decode("utf-8-sig")
        with terminal_bar(scene.name) as progress:
            runs.append(ReportedRun(scene.name, model.simulate(progress=progress)))
    outcome = None
    if checks and model is None:
        fault = "closed forms are checked of scenes, and runs alone are given [E0957]"
        raise UsageError(Problem("--check", fault, "the scene"))
    if checks and model is not None:
        from eomgen.products.studies import check  # noqa: PLC0415  # on request

        outcome = check(model.scene)
    page = report_page(runs, model, text=text, checks=outcome, animation=animation)
    make_folder(target.parent)
    write_text(target, page)
    say(f"written to {target}, {len(page.encode()) / 1e3:.0f} kB: a page for a browser")
    return max(outcome_code(run.solution) for run in runs)


def _stored_runs(path: Path) -> list[Path]:
    """Return the files ``solution.npz`` of a file, a folder or the folders in a folder; empty for a scene file. Raises
    UsageError for a folder without runs."""
    if path.suffix == ".npz":
        return [path]
    if not path.is_dir():
        return []
    run_file = path / "solution.npz"
    files = [run_file] if run_file.is_file() else sorted(path.glob("*/solution.npz"))
    if not files:
        fault = "the folder holds no solution.npz, nor do folders in this folder [E0958]"
        raise UsageError(Problem(str(path), fault, f"eomgen simulate SCENE --out {path}"))
    return files


def _name_of(file: Path) -> str:
    return file.resolve().parent.name if file.name == "solution.npz" else file.stem


@click.command()
@optional_folder("Folder for NAME.tex, NAME of the scene; by default the document is printed.")
@click.option("--symbols", is_flag=True, help="Keep fixed parameters as symbols, too; tunable ones always are.")
@scene_options
@json_option
@debug_option
def latex(scene: str, folder: str | None, symbols: bool, as_json: bool, **reading: Any) -> None:
    """Write the equations of motion of a SCENE as a LaTeX document.

    The document defines coordinates, velocities, parameters and inputs with units, and lists M, h, b, Q, constraints
    in these symbols. Long expressions have names. With --json: the same as texts for SymPy.
    """
    from eomgen.base.files import make_folder, write_text  # noqa: PLC0415  # imported with fine arguments
    from eomgen.pipeline import documents  # noqa: PLC0415
    from eomgen.products.pages.latex import document, equations, with_symbols  # noqa: PLC0415

    described = documents.load_scene(scene, **reading)
    say_notes(described)
    system, facts = with_symbols(described, every=symbols)
    parts = equations(system, facts)
    text = json_text(parts.as_json()) if as_json else document(system, parts)
    if folder is None:
        click.echo(text)
        return
    path = make_folder(Path(folder)) / f"{system.name}.{'json' if as_json else 'tex'}"
    write_text(path, text if text.endswith("\n") else f"{text}\n")
    say(
        f"written to {path}, {counted(len(parts.shared), 'named expression')}: for pdflatex, with amsmath and longtable"
    )
