"""``eomgen identify``: unknown parameters and initial states of a scene from measured runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

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
    profile_option,
    scene_options,
    set_option,
)
from eomgen.cli.printing import building, print_json, print_table, say
from eomgen.cli.running import read_scene
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.products.studies import Identification
    from eomgen.scene.scene import Scene

_option = arguments_of("eomgen.products.studies:identify")


@click.command()
@scene_options
@click.option("--data", multiple=True, required=True, metavar="FILE", help="CSV of a measured run; may be repeated.")
@click.option(
    "--parameters",
    "unknown",
    default=None,
    callback=names_of,
    metavar="NAME,NAME",
    help="Tunable parameters that are unknown.",
)
@_option("--states", default=None, callback=names_of, metavar="NAME,NAME")
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
@_option("--missing", type=click.Choice(["refuse", "drop"]))
@_option("--by", type=click.Choice(["run", "torque"]))
@_option("--confidence", type=float, metavar="P")
@click.option("--t-start", type=float, default=None, metavar="S", help="Of the runs; the first time by default.")
@click.option("--out", "folder", default=None, metavar="DIR", help="Folder for the table, residuals and figures.")
@derivable_stepper_options
@input_option
@set_option
@initial_option
@profile_option
@json_option
@debug_option
def identify(scene: str, folder: str | None, as_json: bool, **options: Any) -> int:
    """Find parameters of a SCENE with which its runs fit measured ones best, and how certain they are.

    Writes identification.json, estimates.csv, residuals and figures of each run if --out is given.
    """
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.studies import identify as study  # noqa: PLC0415

    own = {name: options.pop(name) for name in ("data", "missing", "confidence", "t_start", "by")}
    unknown, states, outputs = (list(options.pop(name) or ()) for name in ("unknown", "states", "outputs"))
    bounds, deviations = _bounds(options.pop("bounds")), options.pop("deviations")
    described = read_scene(scene, options)
    sigma = _deviations(described, deviations)
    profile = options.pop("profile")
    with building(described.name):
        model = pipeline.built_for_run(described, options["method"], profile=profile)
    values = options.pop("parameters")
    given = {name: value for name, value in options.items() if value not in (None, {}, [], ())}
    fit = study(
        model,
        list(own.pop("data")),
        unknown,
        states=states,
        values=values,
        bounds=bounds or None,
        deviations=sigma,
        outputs=outputs or None,
        **own,
        **given,
    )
    files = [] if folder is None else fit.save(folder) + fit.plot(folder)
    if as_json:
        written = {"files": [file.name for file in files], "folder": str(folder)} if files else {}
        print_json(fit.to_dict() | written)
    else:
        _print(fit)
    say(fit.message)
    if files:
        say(f"written to {folder}: {', '.join(file.name for file in files)}")
    return 0


def _print(fit: Identification) -> None:
    share = f"{100.0 * fit.confidence:.6g} %"
    print_table(
        f"{fit.scene}: estimates",
        ("unknown", "estimate", "unit", f"{share} from", "to", "start", ""),
        [
            (one.name, f"{one.value:.6g}", one.unit, *_interval(one.low, one.high), f"{one.start:.6g}", one.state)
            for one in fit.estimates
        ],
        numeric=(1, 3, 4, 5),
    )
    if fit.combinations:
        print_table(
            "combinations",
            ("determined combination", "estimate", f"{share} from", "to", "as"),
            [(one.text, f"{one.value:.6g}", *_interval(one.low, one.high), one.form) for one in fit.combinations],
            numeric=(1, 2, 3),
        )
    print_table(
        "measured",
        ("column", "samples", f"deviation, {fit.noise}", "rms of residuals", "unit", "autocorrelation"),
        [
            (one.name, one.samples, f"{one.deviation:.4g}", f"{one.rms:.4g}", one.unit, f"{one.autocorrelation:.2f}")
            for one in fit.columns
        ],
        numeric=(1, 2, 3, 5),
    )


def _interval(low: float, high: float) -> tuple[str, str]:
    return f"{low:.6g}", f"{high:.6g}"


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
            fault = "a name and two numbers are needed"
            raise UsageError(Problem(f"--bounds {text}", fault, "--bounds mass=0.5:2, --bounds mass=0:")) from None
    return result


def _deviations(scene: Scene, texts: tuple[str, ...]) -> dict[str, float] | None:
    if not texts:
        return None
    return in_units("--deviation", assignments("--deviation", texts), scene.outputs)
