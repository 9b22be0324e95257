"""``eomgen tradeoff``, ``tune`` and ``extremes``: studies of runs of a scene, of their speed, accuracy and limits."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.files import make_folder
from eomgen.base.messages import counted, listed
from eomgen.base.progress import duration, terminal_bar
from eomgen.cli.options import (
    arguments_of,
    assignments,
    debug_option,
    end_option,
    file_to_write,
    folder_option,
    in_units,
    input_option,
    json_option,
    names_of,
    optional_folder,
    scene_options,
    set_option,
)
from eomgen.cli.printing import print_table, say
from eomgen.cli.running import SCENE_OPTIONS, say_notes
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.products.studies.defaults import NAMED
from eomgen.products.studies.model_commands import say_written, show

if TYPE_CHECKING:
    from eomgen.products.studies import Extremes, Point, Tradeoff, Tuned
    from eomgen.scene.scene import Scene


#: Options with names that commas separate.
_NAMES: dict[str, Any] = {"default": "", "callback": names_of, "metavar": "NAME,NAME"}
_of_tradeoff = arguments_of("eomgen.products.studies:tradeoff")


@click.command()
@folder_option
@click.option(
    "--output", "outputs", multiple=True, metavar="NAME",
    help="Whose error: an output, q, v, state (both; the default) or multipliers; the front is of the first.",
)  # fmt: skip  # a table
@_of_tradeoff("--measure", metavar="largest|rms|final")
@click.option(
    "--axes",
    help="Varied axes: formulation, method, parameters, resolution, policy, arithmetic, profile, fidelity; by"
    " default all but fidelity.",
    **_NAMES,
)
@_of_tradeoff("--methods", **_NAMES)
@click.option("--steps", default=None, metavar="S,S", help="Steps in s; each must divide the largest.")
@end_option
@_of_tradeoff("--budget", type=float, metavar="S")
@_of_tradeoff("--repeats", type=int, metavar="N")
@set_option
@input_option
@_of_tradeoff("--resume", is_flag=True)
@scene_options
@json_option
@debug_option
def tradeoff(scene: str, folder: str, as_json: bool, **options: Any) -> int:
    """Measure speed against accuracy of a SCENE: time and error of its methods, formulations, steps and settings.

    Writes tradeoff.json, tradeoff.csv and tradeoff.png; points are kept as they come, for --resume.
    """
    from eomgen.pipeline import documents  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.studies import tradeoff as studied  # noqa: PLC0415

    described = documents.load_scene(scene, **{name: options[name] for name in SCENE_OPTIONS})
    say_notes(described)
    _read_changes(options, described)
    options["steps"] = _numbers(options["steps"])
    with terminal_bar(described.name) as bar:
        study = studied(
            scene,
            folder=folder,
            progress=bar,
            announce=lambda plan: bar.announce(f"{described.name}: {plan}"),
            **options,
        )
    files = study.save(folder)
    show(study, _print_tradeoff, as_json)
    for line in _remarks(study):
        say(line)
    say_written(folder, files)
    return 0


def _read_changes(options: dict[str, Any], scene: Scene) -> None:
    """Turn the texts of ``--set`` and ``--input`` into numbers."""
    for option, name, known in (("--set", "parameters", scene.parameters), ("--input", "inputs", scene.inputs)):
        options[name] = in_units(option, assignments(option, options[name]), known) or None


def _numbers(text: str | None) -> list[float]:
    try:
        return [float(word) for word in (text or "").split(",") if word.strip()]
    except ValueError:
        fault = "these are not numbers of seconds [E1102]"
        raise UsageError(Problem(f"--steps {text}", fault, "--steps 1e-3,5e-4")) from None


def _print_tradeoff(study: Tradeoff) -> None:
    """Print a table with the cheapest configuration for each demand, its error and time, and the next best method."""
    from eomgen.products.studies import DEMANDS  # noqa: PLC0415
    from eomgen.products.studies.work_precision.result import short_duration  # noqa: PLC0415

    rows: list[tuple[str, ...]] = []
    for demand in DEMANDS:
        best = study.best(demand)
        if best is None:
            rows.append((f"{demand:g}", "none meets it", "", "", "", "", ""))
            continue
        resolution = f"{best.value:.4g}{' s' if best.kind == 'step' else ''}"
        numbers = (resolution, f"{study.error(best):.1e}", short_duration(best.seconds or 0.0))
        rows.append((f"{demand:g}", best.configuration.label, *numbers, *_second(study, demand, best)))
    title = f"{study.scene}: {study.measure} error of {study.quantity}, {study.span[1] - study.span[0]:g} s"
    header = ("demand", "cheapest that meets it", "step or tolerance", "error", "time", "next method", "costs")
    print_table(title, header, rows, numeric=(0, 3, 4, 6), whole=(2,), optional=(5,))


def _second(study: Tradeoff, demand: float, best: Point) -> tuple[str, str]:
    """Return the label of the cheapest configuration of another method that meets a demand, and the ratio of the times.
    Both are texts; both are empty if there is none."""
    name = best.configuration.method
    able = [p for p in study.usable if study.error(p) <= demand and p.configuration.method != name]
    fastest = min(able, key=lambda p: p.seconds or 0.0, default=None)
    if fastest is None or not fastest.seconds or not best.seconds:
        return "", ""
    return fastest.configuration.label, f"{fastest.seconds / best.seconds:.3g} x"


def _remarks(study: Tradeoff) -> list[str]:
    """Return sentences on reference, own settings, orders, wrong and failed runs, omissions and costs of a study."""
    from eomgen.products.studies.work_precision.result import OFF, short_duration  # noqa: PLC0415

    by, second = study.reference["by"], study.reference["held against"]
    result = [f"reference: {by}, known to {study.uncertainty:.1e} by {second}"]
    usual = study.points[0] if study.points else None
    if usual is not None and usual.seconds is not None:
        better = study.best(study.error(usual))
        faster = ""
        if better is not None and better.seconds and usual.seconds > 1.1 * better.seconds:
            faster = f"; {better.label} is {usual.seconds / better.seconds:.3g} x as fast at no more"
        result.append(
            f"the scene's own, {usual.label}: error {study.error(usual):.1e} in {short_duration(usual.seconds)}{faster}"
        )
    off = [slope for slope in study.slopes if slope.is_off]
    every = len(study.slopes)
    slopes = f"order as declared within {OFF:g}: {every - len(off)} of {counted(every, 'configuration')}"
    for slope in off[:NAMED]:
        slopes += f"; {slope.configuration.label} {slope.slope:.2f} (declared {slope.declared})"
    if len(off) > NAMED:
        slopes += f"; and {len(off) - NAMED} more, under slopes in tradeoff.json"
    result.append(slopes)
    if study.wrong:
        said = len(study.wrong) - len(study.silent)
        result.append(f"wrong by more than 10 %: {counted(len(study.wrong), 'run')}, of which {said} said something")
    if study.failures:
        result.append(f"did not reach the end: {counted(len(study.failures), 'run')}")
    if study.left_out:
        left_out = f"left out: {counted(len(study.left_out), 'configuration')}, with reasons in tradeoff.json"
        late = len(study.not_built)
        result.append(f"{left_out}; {late} for want of time: --resume goes on with them" if late else left_out)
    built = sum(study.compiled.values())
    machine = f"{study.machine['processor']}, {study.machine['compiler']}"
    result.append(
        f"{counted(len(study.points), 'run')} in {study.seconds:.0f} s, {built:.0f} s of it building; {machine}"
    )
    return result


_of_tune = arguments_of("eomgen.products.studies:tune")


@click.command()
@_of_tune("--error", type=float, default=None, metavar="X")
@_of_tune("--output", metavar="NAME")
@_of_tune("--measure", metavar="largest|rms|final")
@click.option("--axes", help="Settings to vary, as of tradeoff without profile; all but fidelity by default.", **_NAMES)
@_of_tune("--methods", **_NAMES)
@end_option
@_of_tune("--budget", type=float, metavar="S")
@set_option
@input_option
@click.option(
    "--out",
    "file",
    default=None,
    metavar="FILE.toml",
    callback=file_to_write,
    help="Write the scene with the settings there.",
)
@scene_options
@json_option
@debug_option
def tune(scene: str, file: str | None, as_json: bool, **options: Any) -> int:
    """Find the cheapest method, step and settings of a SCENE that meet a demand on its error.

    Verified on runs with other initial states, parameters and inputs. Exits with 6 if one of these misses the
    demand.
    """
    from eomgen.pipeline import documents  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.studies import tune as tuned  # noqa: PLC0415

    described = documents.load_scene(scene, **{name: options[name] for name in SCENE_OPTIONS})
    say_notes(described)
    if file is not None and Path(file).suffix != ".toml":
        raise UsageError(Problem(f"--out {file}", "a scene is written as a .toml file [E1103]", "--out tuned.toml"))
    _read_changes(options, described)
    with terminal_bar(described.name) as bar:
        bar.announce(f"{described.name}: up to {duration(options['budget'])} of runs, and builds")
        result = tuned(scene, progress=bar.stage, **options)
    show(result, _print_tuned, as_json)
    say(result.why)
    if file is not None:
        make_folder(Path(file).parent)
        say(f"written: {result.save(file)}")
    return 0 if result.met else NumericalError.exit_code


def _print_tuned(tuned: Tuned) -> None:
    """Print a table with the cheapest configuration, its rivals, the runs that verify the error, and the settings."""
    rows = [
        ("cheapest", tuned.label),
        ("error", f"{tuned.error:.2g} of {tuned.quantity}, {tuned.measure}; demanded {tuned.demand:g}"),
        ("time", f"{1e3 * tuned.seconds:.4g} ms of stepping for {tuned.span:.4g} s of motion, {tuned.steps:.0f} steps"),
        ("", "without outputs, energies and the error estimate, which simulate computes, too"),
    ]
    settings, error, seconds = tuned.own
    if error < float("inf"):
        told = f"{settings}: error {error:.2g}, {seconds / tuned.seconds:.3g} x the time"
        rows.append(("the scene's own", told))
    rows.append(("one digit more", f"costs about {tuned.next_digit:.3g} x"))
    for rival in tuned.rivals[:NAMED]:
        how = "" if rival.measured else " (expected)"
        rows.append(
            ("next" if rival is tuned.rivals[0] else "", f"{rival.label}: {rival.seconds / tuned.seconds:.3g} x{how}")
        )
    if tuned.said:
        rows.append(("its run says", tuned.said))
    for run in tuned.verified:
        fine = "met" if run.error <= tuned.demand else "MISSED"
        rows.append(("verified" if run is tuned.verified[0] else "", f"{run.what}: error {run.error:.2g}, {fine}"))
    rows += [("[simulation]" if n == 0 else "", f"{k} = {v!r}") for n, (k, v) in enumerate(tuned.simulation.items())]
    spent, runs = tuned.spent
    rows.append(
        ("spent", f"{spent:.3g} s for {counted(runs, 'run')} and verification, {tuned.built:.3g} s of building")
    )
    print_table(f"{tuned.scene}: {tuned.measure} error of {tuned.quantity} below {tuned.demand:g}", ("", ""), rows)


_of_extremes = arguments_of("eomgen.products.studies:extremes")


@click.command()
@optional_folder("Folder for table, JSON and picture.")
@click.option("--ladders", help="step, stiffness, length, ...; all by default.", **_NAMES)
@click.option("--methods", help="In place of all methods that suit the scene.", **_NAMES)
@click.option("--cell", "cells", multiple=True, metavar="LADDER:VALUE[:METHOD]", help="This cell alone; repeatable.")
@_of_extremes("--budget", type=float, metavar="S")
@_of_extremes("--limit", type=float, metavar="S")
@_of_extremes("--resume", is_flag=True)
@scene_options
@json_option
@debug_option
def extremes(scene: str, folder: str | None, as_json: bool, **options: Any) -> int:
    """Run a SCENE under extreme conditions: steps, stiffness, spins, units, ...; report the verdict of each run.

    Every cell holds, is coarse, says that it is doubtful, stops or is refused with a message, or fails: a hang, a
    crash, a number that is not finite, or a wrong answer called success. The exit code is 6 if one fails.
    """
    from eomgen.products.studies import extremes as studied  # noqa: PLC0415  # imported when the arguments are known to be fine

    with terminal_bar(Path(scene).stem) as progress:
        result = studied(scene, folder=folder, progress=progress, **options)
    files = [] if folder is None else result.save(folder)
    show(result, _print_cells if options["cells"] else _print_map, as_json)
    for why in dict.fromkeys(result.left_out.values()):
        names = [name for name, reason in result.left_out.items() if reason == why]
        say(f"left out: {listed(names) if len(names) <= 2 * NAMED else counted(len(names), 'cell')}: {why}")
    say_written(folder, files)
    for cell in result.fails:
        wrong = "" if cell.error is None else f" is wrong by {100.0 * cell.error:.2g} % of its motion"
        said = f", and says: {cell.said}" if cell.said else ""
        say(f"fails: {cell.name}{wrong}{said}; {result.command(cell)}")
    return NumericalError.exit_code if result.fails else 0


def _print_map(result: Extremes) -> None:
    from eomgen.products.studies import LADDERS, VERDICTS  # noqa: PLC0415

    rows = []
    for ladder in LADDERS:
        for method in dict.fromkeys(cell.method for cell in result.of(ladder.name)):
            cells = [cell for cell in result.of(ladder.name) if cell.method == method]
            counts = [sum(cell.verdict == name for cell in cells) for name in VERDICTS]
            rows.append((ladder.scales, method, *(str(count or "") for count in counts)))
    title = f"{result.scene}: {counted(len(result.cells), 'cell')} in {result.seconds:.0f} s"
    print_table(title, ("ladder", "method", *VERDICTS), rows, numeric=tuple(range(2, 2 + len(VERDICTS))))


def _print_cells(result: Extremes) -> None:
    rows = [
        (cell.name, cell.verdict, "" if cell.error is None else f"{cell.error:.2g}", cell.said, cell.reference)
        for cell in result.cells
    ]
    print_table(f"{result.scene}: cells", ("cell", "verdict", "error", "it says", "held against"), rows, numeric=(2,))
