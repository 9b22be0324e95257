"""``eomgen ensemble``: the command with options and tables."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.csv_tables import read_cells
from eomgen.base.messages import counted, shown
from eomgen.base.progress import terminal_bar
from eomgen.cli import INTERRUPTED
from eomgen.cli.options import arguments_of, debug_option, folder_option, json_option, run_options, scene_options
from eomgen.cli.printing import building, print_json, print_table, say
from eomgen.cli.running import read_scene
from eomgen.errors import FileError, NumericalError, Problem, UsageError
from eomgen.formula.units.parser import is_quantity

if TYPE_CHECKING:
    from eomgen.products.ensembles import Ensemble

_option = arguments_of("eomgen.products.ensembles.simulate_many:simulate_many")


@click.command()
@folder_option
@click.option(
    "--vary",
    multiple=True,
    metavar="NAME=DISTRIBUTION",
    help="mass=normal(1, 0.1), q.hinge=uniform(-5 deg, 5 deg), damper=linspace(0, 4, 9); may be repeated.",
)
@click.option("--table", default=None, metavar="FILE", help="CSV of the values of all samples, in place of --vary.")
@_option("--samples", type=int, metavar="N")
@_option("--design", metavar="NAME")
@_option("--seed", type=int, metavar="N")
@_option("--output", "columns", multiple=True, metavar="NAME")
@_option("--points", type=int, metavar="N")
@click.option("--keep", multiple=True, type=int, metavar="N", help="Write this sample's solution; may be repeated.")
@_option("--keep-as", metavar="KIND")
@click.option(
    "--workers",
    type=int,
    default=None,
    metavar="N",
    help="Threads, or processes of --on dask; one for each processor by default.",
)
@click.option(
    "--on",
    "cluster",
    default=None,
    metavar="CLUSTER",
    help="dask: processes of this machine; the address of a scheduler, tcp://host:8786, or its file.",
)
@_option("--device", metavar="NAME")
@_option("--resume", is_flag=True)
@click.option("--plots/--no-plots", default=True, show_default=True, help="Draw fan charts, results and rankings.")
@run_options
@scene_options
@json_option
@debug_option
def ensemble(scene: str, folder: str, plots: bool, as_json: bool, **options: Any) -> int:
    """Run many samples of a SCENE: statistics over time, extremes of each sample, and their sensitivities.

    Writes statistics.csv, samples.csv, failed.csv if samples failed, summary.json and plots. Ctrl-C keeps finished
    samples, for --resume.
    """
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # imported when the arguments are known to be fine

    words = ("samples", "design", "seed", "points", "keep", "keep_as", "workers", "cluster", "device", "resume")
    study_options = {name: options.pop(name) for name in words}
    columns, vary = options.pop("columns"), _read_variations(options.pop("vary"))
    table = None if (file := options.pop("table")) is None else _read_samples(Path(file))
    if not vary and table is None:
        fault = "nothing varies: all samples would be the same [E0652]"
        raise UsageError(Problem("--vary", fault, "--vary 'mass=normal(1, 0.1)', or --table FILE"))
    described = read_scene(scene, options)
    profile = options.pop("profile")
    with building(described.name):
        model = pipeline.build_for_run(described, options["method"], options.get("start"), profile)
    with terminal_bar(described.name) as progress:
        result = model.simulate_many(
            vary=vary or None,
            table=table,
            columns=columns or None,
            folder=folder,
            progress=progress,
            **study_options,
            **options,
        )
    files = result.save(folder)
    if plots:
        files += result.plot(folder)
    if as_json:
        print_json(result.to_dict() | {"files": [file.name for file in files], "folder": str(Path(folder))})
    else:
        _print(result)
    _say_failures(result)
    say(f"{result.message}\nwritten to {Path(folder)}: {', '.join(file.name for file in files)}")
    if plots and result.varied and not any(file.name == "sensitivity.png" for file in files):
        say(_why_unranked(result))
    if result.interrupted:
        return INTERRUPTED
    return NumericalError.exit_code if len(result.failed) == result.done else 0


def _say_failures(result: Ensemble) -> None:
    """Print the first three failed samples with their reasons, and the number of others."""
    named, others = result.failed[:3], len(result.failed[3:])
    for sample in named:
        values = ", ".join(f"{name} = {value:.6g}" for name, value in sample.values.items())
        say(f"sample {sample.number} failed ({values}): {sample.reason}")
    if others:
        say(f"{counted(others, 'more failed sample')}, in failed.csv")


def _why_unranked(result: Ensemble) -> str:
    """Return a sentence on the reason for which the ensemble has no figure of sensitivities."""
    try:
        result.sensitivity(f"{result.columns[0]}.max")
    except UsageError as error:
        return f"without sensitivity.png: {error.problems[0].what}; it takes {error.problems[0].hint}"
    return "without sensitivity.png: no result is drawn"


def _read_variations(texts: tuple[str, ...]) -> dict[str, str]:
    """Return the texts of distributions by name, from texts ``NAME=DISTRIBUTION``. Raises UsageError for another form,
    and for a name that varies twice."""
    result: dict[str, str] = {}
    for text in texts:
        name, equals, how = (part.strip() for part in text.partition("="))
        if not (name and equals and how):
            fault = "a name and a distribution are needed [E0653]"
            raise UsageError(Problem(f"--vary {text}", fault, "--vary 'mass=normal(1, 0.1)'"))
        if name in result:
            fault = f"{name} varies twice [E0654]"
            raise UsageError(Problem(f"--vary {text}", fault, "one distribution for each name"))
        result[name] = how
    return result


def _read_samples(path: Path) -> dict[str, list[float | str]]:
    """Return the columns of a CSV table with a row of names; words with units are unchanged. Raises FileError."""
    names, rows = read_cells(path)
    values = [
        [_cell(f"{where}, column {name}", word) for name, word in zip(names, cells, strict=True)]
        for where, cells in rows
    ]
    return {name: [row[k] for row in values] for k, name in enumerate(names)}


def _cell(where: str, word: str) -> float | str:
    """Return the number in a cell of a table, or the text of a number with a unit. Raises FileError for other
    texts."""
    try:
        return float(word)
    except ValueError:
        if is_quantity(word):
            return word
        fault = f"{shown(word)} is not a number [E0123]" if word else "a cell is empty [E0655]"
        raise FileError(Problem(where, fault, "numbers in the scene's units, or with units: 250 mm")) from None


def _print(result: Ensemble) -> None:
    """Print a table with a row for each column: mean, its error, deviation, extremes and quantiles at the end."""
    good = result.done - len(result.failed)
    if not good:
        return
    rows: list[tuple[str, ...]] = []
    random = result.design not in ("grid", "table", "saltelli")  # samples are drawn one by one
    for column in result.columns:
        low, high = result.envelope(column)
        deviation = result.deviation(column)[-1]
        of_column = [deviation, low[-1], *result.quantile(column, (0.05, 0.5, 0.95))[:, -1].tolist()]
        unit = result.units.get(column, "")
        error = result.error.columns.get(column, math.nan)
        told = "-" if math.isnan(error) else f"{error:.2g}"
        mean = f"{result.mean(column)[-1]:.5g}", f"{deviation / math.sqrt(good):.2g}" if random else "-"
        rows.append((column, unit if unit != "1" else "", *mean, *(f"{x:.5g}" for x in (*of_column, high[-1])), told))
    title = f"{result.scene}: {counted(good, 'sample')}, {result.design}, at t = {result.t[-1]:.9g} s"
    header = (
        *("column", "unit", "mean", "error of\nmean", "deviation"),
        *("smallest", "5 %", "median", "95 %", "largest", "error of\nsteps"),
    )
    print_table(title, header, rows, numeric=tuple(range(2, len(header))), optional=(5, 9, 3))
