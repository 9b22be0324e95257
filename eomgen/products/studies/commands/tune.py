"""``eomgen tune``: the cheapest settings of a scene that meet a demand, or the best ones in a cycle of real time."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.files import check_writable
from eomgen.base.text import counted
from eomgen.cli.options import (
    arguments_of,
    assignments,
    debug_option,
    end_option,
    in_units,
    input_option,
    json_option,
    names_of,
    scene_options,
    set_option,
)
from eomgen.cli.printing import console, print_json, print_table, say
from eomgen.cli.running import SCENE_OPTIONS, say_notes
from eomgen.errors import NumericalError, Problem, UsageError

if TYPE_CHECKING:
    from eomgen.products.studies import RealTime, Tuned

_UNITS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
#: Rivals that are named.
_RIVALS = 5

_option = arguments_of("eomgen.products.studies:tune")
_NAMES: dict[str, Any] = {"default": None, "callback": names_of, "metavar": "NAME,NAME"}


@click.command()
@scene_options
@_option("--error", type=float, default=None, metavar="X")
@click.option(
    "--real-time", default=None, metavar="CYCLE",
    help="In place of --error: motion of this time, 1ms, is to be computed within it in 99.99 % of the cycles.",
)  # fmt: skip  # a table
@click.option("--iterations", type=int, default=None, metavar="N", help="With --real-time: most iterations of a step.")
@_option("--output", metavar="NAME")
@_option("--measure", metavar="largest|rms|final")
@click.option("--axes", help="Settings to vary, as of tradeoff; all by default.", **_NAMES)
@_option("--methods", **_NAMES)
@end_option
@_option("--budget", type=float, metavar="S")
@set_option
@input_option
@click.option("--out", "file", default=None, metavar="FILE.toml", help="Write the scene with the settings there.")
@json_option
@debug_option
def tune(scene: str, file: str | None, as_json: bool, **options: Any) -> int:
    """Find the cheapest method, step and settings of a SCENE that meet a demand on its error.

    Verified on runs with other initial states, parameters and inputs. Exits with 6 if one of these misses the
    demand.
    """
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.studies import Tuned  # noqa: PLC0415
    from eomgen.products.studies import tune as tuned  # noqa: PLC0415

    reading = {name: options.pop(name) for name in SCENE_OPTIONS}
    described = pipeline.load_scene(scene, **reading)
    say_notes(described)
    if file is not None and Path(file).suffix != ".toml":
        raise UsageError(Problem(f"--out {file}", "a scene is written as a .toml file", "--out tuned.toml"))
    if (options["error"] is None) == (options["real_time"] is None):
        raise UsageError(Problem("tune", "either --error is demanded or a cycle of --real-time", "--error 1e-4"))
    if file is not None:
        check_writable(Path(file))
    with _status(described.name) as progress:
        result = tuned(
            scene,
            options["error"],
            real_time=_seconds(options["real_time"]),
            iterations=options["iterations"],
            output=options["output"],
            measure=options["measure"],
            axes=options["axes"] or (),
            methods=options["methods"] or (),
            t_end=options["t_end"],
            parameters=in_units("--set", assignments("--set", options["parameters"]), described.parameters) or None,
            inputs=in_units("--input", assignments("--input", options["inputs"]), described.inputs) or None,
            budget=options["budget"],
            progress=progress,
            **reading,
        )
    if as_json:
        print_json(result.to_dict())
    elif isinstance(result, Tuned):
        _print(result)
    else:
        _print_real_time(result)
    say(result.why)
    if file is not None:
        say(f"written: {result.save(file)}")
    return 0 if not isinstance(result, Tuned) or result.met else NumericalError.exit_code


@contextlib.contextmanager
def _status(name: str) -> Iterator[Callable[[str], None] | None]:
    if not sys.stderr.isatty():
        yield None
        return
    with console(stderr=True).status(name) as status:
        yield lambda stage: status.update(f"{name}: {stage}")


def _seconds(text: str | None) -> float | None:
    """Return a cycle in seconds: ``1ms``, ``250us``, ``0.001``."""
    if text is None:
        return None
    unit = next((unit for unit in _UNITS if text.endswith(unit)), "")
    try:
        return float(text.removesuffix(unit)) * _UNITS.get(unit, 1.0)
    except ValueError:
        raise UsageError(Problem(f"--real-time {text}", "this is no time", "--real-time 1ms")) from None


def _print(tuned: Tuned) -> None:
    rows = [("cheapest", tuned.label)]
    rows.append(("error", f"{tuned.error:.2g} of {tuned.quantity}, {tuned.measure}; demanded {tuned.demand:g}"))
    rows.append(
        ("time", f"{1e3 * tuned.seconds:.4g} ms of stepping for {tuned.span:.4g} s of motion, {tuned.steps:.0f} steps")
    )
    rows.append(("", "outputs, energies and the error estimate apart, which simulate computes, too"))
    own, error, seconds = tuned.own
    if error < float("inf"):
        times = f"{seconds / tuned.seconds:.3g} x the time"
        rows.append(("the scene's own", f"{own}: error {error:.2g}, {times}"))
    rows.append(("one digit more", f"costs about {tuned.next_digit:.3g} x"))
    for rival in tuned.rivals[:_RIVALS]:
        how = "" if rival.measured else " (expected)"
        rows.append(
            ("next" if rival is tuned.rivals[0] else "", f"{rival.label}: {rival.seconds / tuned.seconds:.3g} x{how}")
        )
    for run in tuned.verified:
        fine = "met" if run.error <= tuned.demand else "MISSED"
        rows.append(("verified" if run is tuned.verified[0] else "", f"{run.what}: error {run.error:.2g}, {fine}"))
    rows += [("[simulation]" if n == 0 else "", f"{k} = {v!r}") for n, (k, v) in enumerate(tuned.simulation.items())]
    spent, runs = tuned.spent
    rows.append(
        ("spent", f"{spent:.3g} s for {counted(runs, 'run')} and verification, {tuned.built:.3g} s of building")
    )
    print_table(f"{tuned.scene}: {tuned.measure} error of {tuned.quantity} below {tuned.demand:g}", ("", ""), rows)


def _print_real_time(tuned: RealTime) -> None:
    header = ("configuration", "steps in a cycle", "99.99 % below, us", "error")
    rows = [(label, steps, f"{1e6 * late:.3g}", f"{error:.1e}") for label, steps, late, error in tuned.tried]
    rows.sort(key=lambda row: row[:2])
    print_table(f"{tuned.scene}: cycles of {1e6 * tuned.cycle:.6g} us", header, rows, numeric=(1, 2, 3))
