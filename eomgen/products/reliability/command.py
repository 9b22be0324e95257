"""``eomgen random``: the distribution of an output under the random processes of a scene, and the output of ``eomgen
info`` on these processes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.messages import distinct_texts
from eomgen.cli.info import InfoPart
from eomgen.cli.options import (
    arguments_of,
    debug_option,
    derivable_stepper_options,
    end_option,
    folder_option,
    initial_option,
    input_option,
    json_option,
    profile_option,
    scene_options,
    set_option,
)
from eomgen.cli.printing import building, console, print_json, print_table, say
from eomgen.cli.running import read_scene

if TYPE_CHECKING:
    from eomgen.products.reliability.vibration import RandomVibration
    from eomgen.system.signals import Input


#: Results of methods in tables, in order.
_SHOWN = (
    "first_order",
    "second_order",
    "projected",
    "hermite",
    "form",
    "quadratic",
    "corrected",
    "importance_sampling",
    "monte_carlo",
)

_option = arguments_of("eomgen.products.reliability.vibration:random_vibration")


@click.command()
@folder_option
@click.option("--output", required=True, metavar="NAME", help="An output, or a component of it: tip[0].")
@_option("--threshold", "thresholds", multiple=True, type=float, metavar="Y")
@_option("--points/--no-points", default=True, show_default=True)
@_option("--projected", type=float, default=None, metavar="SHARE")
@_option("--whole/--no-whole", default=True, show_default=True)
@_option("--monte-carlo", "samples", type=int, metavar="N")
@_option("--tail-samples", type=int, metavar="N")
@_option("--hermite", "pairs", type=int, metavar="N")
@_option("--covariance-at", "times", multiple=True, type=float, metavar="T")
@_option("--level", "levels", multiple=True, type=float, metavar="Y")
@_option("--seed", type=int, metavar="N")
@click.option("--plots/--no-plots", default=True, show_default=True, help="Draw distribution, covariance and modes.")
@end_option
@derivable_stepper_options
@set_option
@initial_option
@input_option
@profile_option
@scene_options
@json_option
@debug_option
def random(scene: str, folder: str, plots: bool, as_json: bool, **options: Any) -> int:
    """Find the distribution of an output of a SCENE with random processes at the end of a run.

    Writes random.json, distribution.csv, autocovariance.csv and plots.
    """
    from eomgen.pipeline import pipeline  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.products.reliability.vibration import random_vibration  # noqa: PLC0415

    words = ("output", "points", "projected", "whole", "samples", "tail_samples", "pairs", "times", "levels", "seed")
    study_options = {name: options.pop(name) for name in words}
    thresholds = options.pop("thresholds") or None
    described = read_scene(scene, options)
    profile = options.pop("profile")
    with building(described.name):
        model = pipeline.build_for_run(described, options["method"], profile=profile)
    end, step = options.pop("t_end"), options.pop("step")
    chosen = {name: value for name, value in options.items() if value not in (None, {}, [], ())}
    study = random_vibration(
        model, study_options.pop("output"), end, step, thresholds=thresholds, **study_options, **chosen
    )
    files = study.save(folder) + (study.plot(folder) if plots else [])
    if as_json:
        print_json(study.to_dict() | {"files": [file.name for file in files], "folder": str(folder)})
    else:
        _print(study)
    say(f"{study.message}\nwritten to {folder}: {', '.join(file.name for file in files)}")
    return 0


def _print(study: RandomVibration) -> None:
    """Print moments, processes, probabilities and costs of a study."""
    rows = [(_words(name), *(f"{value:.6g}" for value in values)) for name, values in study.moments.items()]
    moments = ("by", "mean", "standard deviation", "skewness", "excess kurtosis")
    title = f"{study.scene}: {study.output}{f' in {study.unit}' if study.unit else ''} at t = {study.t:.6g} s"
    print_table(title, moments, rows, numeric=(1, 2, 3, 4))
    kept = [
        (process.name, _words(process.kind), f"{process.variables}", f"{100.0 * process.captured:.4g}")
        for process in study.processes
    ]
    title = "; ".join(["random processes", *study.truncation])
    title = title.replace("its variance", f"the variance of {study.output}")
    print_table(title, ("process", "kind", "variables", "% of its variance"), kept, numeric=(2, 3))
    _print_probabilities(study)
    if study.autocovariance:
        _print_covariance(study)
    if study.first_passage:
        _print_passage(study)
    costs = [(_words(name), *map(str, vars(cost).values())) for name, cost in study.costs.items()]
    heads = ("for", "runs", "adjoint runs", "tangents")
    print_table("solutions of the equations of motion", heads, costs, numeric=(1, 2, 3))


def _words(name: str) -> str:
    return name.replace("_", " ")


def _print_probabilities(study: RandomVibration) -> None:
    names = [name for name in _SHOWN if name in study.distributions]
    table, texts = [], distinct_texts(study.thresholds.tolist())
    for k in range(len(texts)):
        cells = []
        upper = study.distributions[names[min(1, len(names) - 1)]].below[k] > 0.5
        for name in names:
            distribution = study.distributions[name]
            value = float(distribution.above[k] if upper else distribution.below[k])
            cells.append("-" if math.isnan(value) else f"{value:.4g}")
        table.append((texts[k], ">" if upper else "<=", *cells))
    heads = ("threshold", "y is", *map(_words, names))
    print_table("probabilities", heads, table, numeric=(0, *range(2, len(heads))))


def _print_covariance(study: RandomVibration) -> None:
    order = sorted(range(len(study.times)), key=lambda k: float(study.times[k]))
    columns = [study.times, *study.autocovariance.values()]
    covariances = [tuple(f"{values[k]:.6g}" for values in columns) for k in order]
    heads = ("at t in s", *map(_words, study.autocovariance))
    title = f"covariance with the output at t = {study.t:.6g} s"
    print_table(title, heads, covariances, numeric=tuple(range(len(heads))))


def _print_passage(study: RandomVibration) -> None:
    levels, methods = distinct_texts(list(study.first_passage)), ("crossing_rate", "monte_carlo")
    passage = [
        (text, *(f"{values[name]:.4g}" if name in values else "-" for name in methods))
        for text, values in zip(levels, study.first_passage.values(), strict=True)
    ]
    print_table("first passage from below", ("level", "rate of crossings", "monte carlo"), passage, numeric=(0, 1, 2))


def described_processes(inputs: Sequence[Input]) -> list[dict[str, Any]]:
    """Return the random processes among inputs as plain data, for ``eomgen info``: name, type, window, variables,
    eigenvalues, cumulative shares of the variance ("captured"), and relations to other processes."""
    return [
        {
            "name": item.name,
            "type": process.kind,
            "window": list(process.window),
            "over": "distance" if process.speed else "time",
            "seed": process.seed,
            "follows": process.follows,
            "correlation": dict(process.correlation),
            "coherent_with": list(process.coherent_with),
            "standard_deviation": process.standard_deviation,
            "variables": list(process.variables),
            "eigenvalues": list(process.eigenvalues),
            "captured": list(process.captured),
        }
        for item in inputs
        if (process := item.series) is not None
    ]


def print_processes(processes: list[dict[str, Any]]) -> None:
    """Print a table of random processes as of ``described_processes``, and how the first modes capture the variance of
    processes with their own covariance. Without processes there is no output."""
    if not processes:
        return
    out = console()
    out.print()
    rows = [
        (
            item["name"],
            _kind(item),
            f"{item['window'][0]:.6g} to {item['window'][1]:.6g} {'m' if item['over'] == 'distance' else 's'}",
            f"{item['standard_deviation']:.6g}",
            _runs(item["variables"]),
            f"{100.0 * item['captured'][-1]:.6g} %",
        )
        for item in processes
    ]
    header = ("name", "type", "window", "standard deviation", "variables", "variance captured")
    print_table("Random processes", header, rows, numeric=(3, 5))
    if any(item["captured"][-1] < 1.0 for item in processes):
        out.print(
            "Variances are of the processes: an output may lose another share: see eomgen ensemble, or eomgen random",
            markup=False,
        )
    for item in processes:
        if item["follows"] or item["correlation"] or item["coherent_with"]:
            continue
        count = len(item["captured"])
        shown = sorted({1, 2, 3, *(count * k // 8 for k in range(1, 8)), count} & set(range(1, count + 1)))
        parts = ", ".join(f"{k}: {100.0 * item['captured'][k - 1]:.4g} %" for k in shown)
        out.print(f"Variance of {item['name']} in its first modes, {parts}", markup=False)


def _kind(item: dict[str, Any]) -> str:
    """Return the type of a random process in words, or its relation to others, such as "follows force"; `item` is as of
    ``described_processes``."""
    if item["follows"]:
        return f"follows {item['follows']}"
    if item["coherent_with"]:
        return f"coherent with {', '.join(item['coherent_with'])}"
    others = ", ".join(f"{value:.6g} with {name}" for name, value in item["correlation"].items())
    return f"correlated, {others}" if others else str(item["type"])


def _runs(variables: list[str]) -> str:
    """Return ``force_z1 to force_z21`` for the variables of each process."""
    runs = [list(names) for _, names in groupby(variables, key=lambda name: name.rstrip("0123456789"))]
    return ", ".join(f"{names[0]} to {names[-1]}" if len(names) > 1 else names[0] for names in runs)


PROCESSES = InfoPart(
    lambda scene: {"random": described_processes(scene.inputs)},
    lambda data: print_processes(data["random"]),
    lambda data: (name for item in data["random"] for name in item["variables"]),
)
