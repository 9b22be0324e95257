"""``eomgen tradeoff``: time and error of all configurations of a scene, its front, and warnings of wrong runs."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.progress import terminal_bar
from eomgen.base.text import counted
from eomgen.cli.options import (
    arguments_of,
    assignments,
    debug_option,
    end_option,
    folder_option,
    in_units,
    input_option,
    json_option,
    names_of,
    scene_options,
    set_option,
)
from eomgen.cli.printing import print_json, print_table, say
from eomgen.cli.running import SCENE_OPTIONS, say_notes
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.products.studies import Point, Tradeoff

#: A measured order that is off its declared one by more than this is told.
_OFF = 0.15
#: So many of these are named.
_NAMED = 4

_option = arguments_of("eomgen.products.studies:tradeoff")


@click.command()
@scene_options
@folder_option
@click.option(
    "--output", "outputs", multiple=True, metavar="NAME",
    help="Whose error: an output, q, v, state (both; the default) or multipliers; the front is of the first.",
)  # fmt: skip  # a table
@_option("--measure", metavar="largest|rms|final")
@click.option(
    "--axes",
    default=None,
    callback=names_of,
    metavar="NAME,NAME",
    help="Varied axes: formulation, method, parameters, resolution, policy, arithmetic, profile, fidelity; by"
    " default all but fidelity.",
)
@_option("--methods", default=None, callback=names_of, metavar="NAME,NAME")
@click.option("--steps", default=None, metavar="S,S", help="Steps in s; each must divide the largest.")
@end_option
@_option("--budget", type=float, metavar="S")
@_option("--repeats", type=int, metavar="N")
@set_option
@input_option
@_option("--resume", is_flag=True)
@json_option
@debug_option
def tradeoff(scene: str, folder: str, as_json: bool, **options: Any) -> int:
    """Measure speed against accuracy of a SCENE: time and error of its methods, formulations, steps and settings.

    Writes tradeoff.json, tradeoff.csv and tradeoff.png; points are kept as they come, for --resume.
    """
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.studies import tradeoff as studied  # noqa: PLC0415

    reading = {name: options.pop(name) for name in SCENE_OPTIONS}
    described = pipeline.load_scene(scene, **reading)
    say_notes(described)
    parameters = in_units("--set", assignments("--set", options["parameters"]), described.parameters)
    inputs = in_units("--input", assignments("--input", options["inputs"]), described.inputs)
    with _bar(described.name) as progress:
        study = studied(
            scene,
            outputs=options["outputs"],
            measure=options["measure"],
            axes=options["axes"] or (),
            methods=options["methods"] or (),
            steps=_numbers(options["steps"]),
            t_end=options["t_end"],
            parameters=parameters or None,
            inputs=inputs or None,
            budget=options["budget"],
            repeats=options["repeats"],
            folder=folder,
            resume=options["resume"],
            progress=progress,
            announce=lambda stage: say(f"{described.name}: {stage}"),
            **reading,
        )
    files = study.save(folder)
    if as_json:
        print_json(study.to_dict())
    else:
        _print(study)
    for line in _remarks(study):
        say(line)
    say(f"written to {Path(folder)}: {', '.join(file.name for file in files)}")
    return 0


@contextlib.contextmanager
def _bar(name: str) -> Iterator[Callable[[int, int, str], None] | None]:
    with terminal_bar(name) as bar:
        yield None if bar is None else lambda done, total, _: bar(done, total)


def _numbers(text: str | None) -> list[float]:
    try:
        return [float(word) for word in (text or "").split(",") if word.strip()]
    except ValueError:
        raise UsageError(Problem(f"--steps {text}", "these are not numbers of seconds", "--steps 1e-3,5e-4")) from None


def _print(study: Tradeoff) -> None:
    from eomgen.products.studies import DEMANDS  # noqa: PLC0415

    rows: list[tuple[str, ...]] = []
    for demand in DEMANDS:
        best = study.best(demand)
        if best is None:
            rows.append((f"{demand:g}", "none meets it", "", "", "", "", ""))
            continue
        other = _second(study, demand, best)
        rows.append((f"{demand:g}", *_cells(study, best), *_next(other, best)))
    title = f"{study.scene}: {study.measure} error of {study.quantity}, {study.span[1] - study.span[0]:g} s"
    header = ("demand", "cheapest that meets it", "step or tolerance", "error", "time", "next method", "costs")
    print_table(title, header, rows, numeric=(0, 3, 4, 6), whole=(2,))


def _cells(study: Tradeoff, point: Point) -> tuple[str, str, str, str]:
    return (point.configuration.label, _resolution(point), f"{study.error(point):.1e}", _time(point.seconds))


def _next(other: Point | None, best: Point) -> tuple[str, str]:
    if other is None or not other.seconds or not best.seconds:
        return "", ""
    return other.configuration.label, f"{other.seconds / best.seconds:.3g} x"


def _second(study: Tradeoff, demand: float, best: Point) -> Point | None:
    """Return the cheapest point of another method that meets a demand."""
    name = best.configuration.method
    able = [p for p in study.usable if study.error(p) <= demand and p.configuration.method != name]
    return min(able, key=lambda p: p.seconds or 0.0, default=None)


def _resolution(point: Point) -> str:
    return f"{point.value:.4g}{' s' if point.kind == 'step' else ''}"


def _time(seconds: float | None) -> str:
    if seconds is None:
        return ""
    unit, size = next((u, s) for u, s in (("s", 1.0), ("ms", 1e-3), ("us", 0.0)) if seconds >= s)
    return f"{seconds / (size or 1e-6):.3g} {unit}"


def _remarks(study: Tradeoff) -> list[str]:
    """Return remarks below the table, a line each."""
    by, second = study.reference["by"], study.reference["held against"]
    result = [f"reference: {by}, known to {study.uncertainty:.1e} by {second}"]
    own = study.points[0] if study.points else None
    if own is not None and own.seconds is not None:
        better = study.best(study.error(own))
        faster = ""
        if better is not None and better.seconds and own.seconds > 1.1 * better.seconds:
            faster = f"; {better.label} is {own.seconds / better.seconds:.3g} x as fast at no more"
        result.append(f"the scene's own, {own.label}: error {study.error(own):.1e} in {_time(own.seconds)}{faster}")
    off = [s for s in study.slopes if abs(s.slope - s.declared) > _OFF]
    every = len(study.slopes)
    slopes = f"order as declared within {_OFF:g}: {every - len(off)} of {counted(every, 'configuration')}"
    for slope in off[:_NAMED]:
        slopes += f"; {slope.configuration.label} {slope.slope:.2f} (declared {slope.declared})"
    if len(off) > _NAMED:
        slopes += f"; and {len(off) - _NAMED} more, under slopes in tradeoff.json"
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
