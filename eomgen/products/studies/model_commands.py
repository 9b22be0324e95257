"""``eomgen check``, ``savings`` and ``identify``: studies of the model of a scene, its closed forms, its costs and
its parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.files import make_folder
from eomgen.base.messages import counted, first_of
from eomgen.base.progress import terminal_bar
from eomgen.cli import INTERRUPTED
from eomgen.cli.options import (
    arguments_of,
    assignments,
    debug_option,
    derivable_stepper_options,
    in_units,
    initial_option,
    input_option,
    json_option,
    names_of,
    optional_folder,
    profile_option,
    scene_options,
    set_option,
)
from eomgen.cli.printing import building, console, print_json, print_table, say
from eomgen.cli.running import SCENE_OPTIONS, read_scene, say_notes
from eomgen.errors import NumericalError, Problem, UsageError

if TYPE_CHECKING:
    from eomgen.products.studies import CheckReport, FormReport, Identification
    from eomgen.products.studies.savings import Savings, VariantCost


def show(result: Any, table: Callable[[Any], None], as_json: bool, **more: Any) -> None:
    """Print a result: as JSON, with ``more`` items, or by a function that prints tables."""
    if as_json:
        print_json(result.to_dict() | more)
    else:
        table(result)


def say_written(folder: str | None, files: Sequence[Path]) -> None:
    """Say which files have been written to a folder."""
    if files:
        say(f"written to {Path(str(folder))}: {', '.join(file.name for file in files)}")


_of_check = arguments_of("eomgen.products.studies:check")


@click.command()
@_of_check("--states", type=int, metavar="N")
@_of_check("--seed", type=int, metavar="N")
@_of_check("--only", multiple=True, metavar="FORM")
@optional_folder("Write the data and draw the errors over the steps there.")
@scene_options
@json_option
@debug_option
def check(scene: str, folder: str | None, as_json: bool, **options: Any) -> int:
    """Check every closed form of a SCENE, as compiled, against finite differences, complex steps and second
    derivations.

    Exits with 6 when one fails.
    """
    from eomgen.pipeline.documents import load_scene  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.studies import check as checked  # noqa: PLC0415

    if folder is not None:
        make_folder(Path(folder))
    described = load_scene(scene, **{name: options.pop(name) for name in SCENE_OPTIONS})
    with terminal_bar(described.name) as progress:
        report = checked(described, progress=progress, **options)
    show(report, _print_report, as_json)
    if folder is not None:
        say(f"written: {', '.join(str(path) for path in report.write(folder))}")
    for form in report.failures:
        say(f"{form.name} {_why(form)}")
    if report.unchecked and not report.failures:
        return INTERRUPTED
    return 0 if report.passed else NumericalError.exit_code


def _why(form: FormReport) -> str:
    if form.worst is not None:
        return f"FAILS: {form.worst}"
    if form.verdict == "undecided":
        return "cannot be decided: another derivation, such as differences and complex steps, is not finite"
    return "was not checked: no state where it is finite"


def _print_report(report: CheckReport) -> None:
    """Print a table of all closed forms with their errors and verdicts, then remarks, notes, kinks and the summary."""
    header = ("closed form", "is", "differences", "at step", "slope", "complex step", "second", "derivation", "verdict")
    rows = []
    for form in report.forms:
        numbers = (form.agreement, form.step, form.slope, form.complex_step, form.second)
        formats = (".1e", ".1e", ".2f", ".1e", ".1e")
        texts = ("" if x is None else f"{x:{digits}}" for x, digits in zip(numbers, formats, strict=True))
        rows.append((form.name, form.meaning, *texts, form.second_name, form.verdict))
    title = f"{report.scene}: {counted(len(report.forms), 'closed form')} at {counted(len(report.states), 'state')}"
    print_table(title, header, rows, numeric=(2, 3, 4, 5, 6), whole=(8,), optional=(7, 1))
    for note in (*report.remarks, *report.notes):
        say(note)
    if report.corners:
        say(f"not smooth everywhere: {first_of(report.corners, 20)}")
    say(report.summary)


#: Columns of the table: cost, heading, factor and format.
_COLUMNS = (
    ("step_operations", "flops of a step's terms", 1.0, ".0f"),
    ("c_bytes", "C, kB", 1e-3, ".1f"),
    ("build_seconds", "build, s", 1.0, ".2g"),
    ("step_seconds", "step, us", 1e6, ".2g"),
    ("observed_seconds", "observed step, us", 1e6, ".2g"),
)

#: Costs that are measured times.
_TIMES = ("build_seconds", "step_seconds", "observed_seconds")

_of_savings = arguments_of("eomgen.products.studies.savings:savings")


@click.command()
@click.option("--method", default=None, help="Whose steps are timed; the scene's by default.")
@_of_savings("--rounds", type=int, metavar="N")
@_of_savings("--only", multiple=True, metavar="VARIANT")
@optional_folder("Write savings.csv and savings.json there.")
@scene_options
@json_option
@debug_option
def savings(scene: str, folder: str | None, as_json: bool, **options: Any) -> int:
    """Measure the costs of a SCENE as it is requested: operations, bytes of C, seconds to build, time per step.

    Against the same scene with the terms of a run alone, the terms of a step alone, all terms, all numbers tunable, a
    base that moves in all six ways, absolute coordinates, and all of that. Every variant is built in an empty cache, so
    this takes a while.
    """
    from eomgen.pipeline.documents import load_scene  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.studies.savings import savings as measured  # noqa: PLC0415

    described = load_scene(scene, **{name: options[name] for name in SCENE_OPTIONS})
    say_notes(described)
    with terminal_bar(f"variants of {described.name}") as progress:
        study = measured(scene, progress=progress, **options)
    show(study, _print_costs, as_json)
    if folder is not None:
        say(f"written: {', '.join(str(path) for path in study.write(folder))}")
    return INTERRUPTED if study.interrupted else 0


def _print_costs(study: Savings) -> None:
    title = f"{study.scene}, {study.method}, step {study.step:.6g} s: cost, and ratio to the scene as asked; quartiles"
    header = ("variant", *(name for _, heading, _, _ in _COLUMNS for name in (heading, "x")))
    rows = [(cost.name, *(text for column in _COLUMNS for text in _pair(study, cost, column))) for cost in study.costs]
    print_table(title, header, rows, numeric=tuple(range(1, len(header))))
    console().print()
    derived = [cost for cost in study.costs if cost.operations]
    header = ("term", *(cost.name for cost in derived))
    terms = [(term, *(cost.operations.get(term, "") for cost in derived)) for term in study.costs[0].operations]
    print_table("Additions and multiplications by term", header, terms, numeric=tuple(range(1, len(header))))
    if study.doubt:
        console().print(f"\n{study.doubt}", markup=False)
    for cost in study.costs:
        if cost.problem:
            console().print(f"\n{cost.name}: {cost.problem}", markup=False)


def _pair(study: Savings, cost: VariantCost, column: tuple[str, str, float, str]) -> tuple[str, str]:
    key, _, factor, form = column
    from eomgen.products.studies.savings import QUARTILES  # noqa: PLC0415

    value, ratio = getattr(cost, key), study.ratio(cost, key)
    told = "" if value is None else f"{value * factor:{form}}"
    if quartiles := getattr(cost, QUARTILES.get(key, ""), None):
        told = " to ".join(f"{end * factor:{form}}" for end in quartiles)
    return told, "" if ratio is None else f"{ratio:.2g}" if key in _TIMES else f"{ratio:.2f}"


_of_identify = arguments_of("eomgen.products.studies:identify")


@click.command()
@click.option("--data", multiple=True, required=True, metavar="FILE", help="CSV of a measured run; may be repeated.")
@click.option(
    "--parameters",
    "unknown",
    default=None,
    callback=names_of,
    metavar="NAME,NAME",
    help="Tunable parameters that are unknown.",
)
@_of_identify("--states", default=None, callback=names_of, metavar="NAME,NAME")
@click.option("--bounds", multiple=True, metavar="NAME=LOW:HIGH", help="Of an unknown; may be repeated.")
@click.option(
    "--deviation",
    "deviations",
    multiple=True,
    metavar="NAME=VALUE",
    help="Standard deviation of a column's noise; estimated if none is given. May be repeated.",
)
@click.option(
    "--output", "outputs", multiple=True, metavar="NAME", help="Columns compared; all by default. May be repeated."
)
@_of_identify("--missing", type=click.Choice(["refuse", "drop"]))
@_of_identify("--by", type=click.Choice(["run", "torque"]))
@_of_identify("--confidence", type=float, metavar="P")
@click.option("--t-start", type=float, default=None, metavar="S", help="Of the runs; the first time by default.")
@optional_folder("Folder for the table, residuals and figures.")
@derivable_stepper_options
@input_option
@set_option
@initial_option
@profile_option
@scene_options
@json_option
@debug_option
def identify(scene: str, folder: str | None, as_json: bool, **options: Any) -> int:
    """Find parameters and initial states of a SCENE that fit measured data best, and how certain they are.

    Writes identification.json, estimates.csv, residuals and figures of each run if --out is given.
    """
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.studies import identify as study  # noqa: PLC0415

    data, unknown = list(options.pop("data")), options.pop("unknown") or ()
    options["bounds"] = _bounds(options["bounds"])
    described = read_scene(scene, options)
    deviations = assignments("--deviation", options["deviations"])
    options["deviations"] = in_units("--deviation", deviations, described.outputs)
    profile = options.pop("profile")
    with building(described.name):
        model = pipeline.build_for_run(described, options["method"], profile=profile)
    options["values"] = options.pop("parameters")
    chosen = {name: value for name, value in options.items() if value not in (None, {}, [], ())}
    fit = study(model, data, unknown, **chosen)
    files = [] if folder is None else fit.save(folder) + fit.plot(folder)
    written = {"files": [file.name for file in files], "folder": str(folder)} if files else {}
    show(fit, _print_estimates, as_json, **written)
    say(fit.message)
    say_written(folder, files)
    return 0


def _print_estimates(fit: Identification) -> None:
    """Print tables of the estimates, the determined combinations of unknowns (if any), and the measured columns."""
    share = f"{100.0 * fit.confidence:.6g} %"
    header: tuple[str, ...] = ("unknown", "estimate", "unit", f"{share} from", "to", "start", "")
    names: tuple[str, ...] = ("name", "value", "unit", "low", "high", "start", "state")
    rows = [_texts(estimate, names) for estimate in fit.estimates]
    print_table(f"{fit.scene}: estimates", header, rows, numeric=(1, 3, 4, 5))
    if fit.combinations:
        header = ("determined combination", "estimate", f"{share} from", "to", "as")
        rows = [_texts(combination, ("text", "value", "low", "high", "form")) for combination in fit.combinations]
        print_table("combinations", header, rows, numeric=(1, 2, 3))
    header = ("column", "samples", f"deviation, {fit.noise}", "rms of residuals", "unit", "autocorrelation")
    names = ("name", "samples", "deviation", "rms", "unit", "autocorrelation")
    print_table("measured", header, [_texts(column, names, 4) for column in fit.columns], numeric=(1, 2, 3, 5))


def _texts(item: object, names: Iterable[str], digits: int = 6) -> tuple[str, ...]:
    """Return attributes as texts of a row, numbers with some digits."""
    values = (getattr(item, name) for name in names)
    return tuple(f"{value:.{digits}g}" if isinstance(value, float) else str(value) for value in values)


def _bounds(texts: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    result = {}
    for text in texts:
        name, equals, ends = text.partition("=")
        first, colon, last = ends.partition(":")
        try:
            if not (equals and colon and name.strip()):
                raise ValueError
            result[name.strip()] = (float(first or "-inf"), float(last or "inf"))
        except ValueError:
            fault = "a name and two numbers are needed [E0156]"
            raise UsageError(Problem(f"--bounds {text}", fault, "--bounds mass=0.5:2, --bounds mass=0:")) from None
    return result
