"""``eomgen simulate``: run, save, draw, and say how it went."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from eomgen.cli.options import assignments, debug_option, folder_option, in_units, json_option, scene_options
from eomgen.cli.printing import console, counted, finite, print_json, print_table, say
from eomgen.errors import NumericalError, Problem, UsageError

if TYPE_CHECKING:
    from eomgen.runtime.model import Model
    from eomgen.runtime.solution import Solution

_INTERRUPTED = 130


@click.command()
@scene_options
@folder_option
@click.option("--t-end", type=float, default=None, metavar="S", help="End of the run; the scene's by default.")
@click.option("--step", type=float, default=None, metavar="S", help="Step size; the scene's by default.")
@click.option("--method", default=None, help="generalized_alpha, hht, rk4, rk4_partitioned ...; the scene's by default.")
@click.option("--rho-inf", type=float, default=None, help="Spectral radius of generalized-alpha at infinite frequency, 0 to 1.")
@click.option("--alpha", type=float, default=None, help="Numerical damping of hht (0 to 1/3), wbz or newmark (0 to 1).")
@click.option("--beta", type=float, default=None, help="Of newmark; 1/4 by default.")
@click.option("--gamma", type=float, default=None, help="Of newmark; 1/2 by default, above it order 1.")
@click.option("--record-every", type=int, default=None, metavar="N", help="Steps between recorded rows.")
@click.option("--set", "parameters", multiple=True, metavar="NAME=VALUE", help="A tunable parameter; may be repeated.")
@click.option("--input", "inputs", multiple=True, metavar="NAME=VALUE", help="A constant input; may be repeated.")
@click.option("--checkpoint", default=None, metavar="FILE", help="Keep what is needed to go on with the run in this file.")
@click.option("--checkpoint-every", type=int, default=None, metavar="N", help="Steps between checkpoints; else one a minute.")
@click.option("--resume", default=None, metavar="FILE", help="Go on from a checkpoint, to the same bits.")
@click.option("--plots/--no-plots", default=True, show_default=True, help="Draw the solution.")
@json_option
@debug_option
def simulate(
    scene: str,
    strict: bool,
    root: str,
    lock: tuple[str, ...],
    coordinates: Literal["joint", "absolute"] | None,
    folder: str,
    t_end: float | None,
    step: float | None,
    method: str | None,
    rho_inf: float | None,
    alpha: float | None,
    beta: float | None,
    gamma: float | None,
    record_every: int | None,
    parameters: tuple[str, ...],
    inputs: tuple[str, ...],
    checkpoint: str | None,
    checkpoint_every: int | None,
    resume: str | None,
    plots: bool,
    as_json: bool,
) -> int:
    """Integrate a SCENE and write solution.npz, solution.csv, summary.json and plots.

    Ctrl-C, and a run that fails, leave the partial result; the exit code is then 130 or 6.
    """
    from eomgen import pipeline  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.runtime.files import make_folder  # noqa: PLC0415

    changes, signals = assignments("--set", parameters), assignments("--input", inputs)
    described = pipeline.load(scene, strict=strict, root=root, lock=lock, coordinates=coordinates)
    chosen, constants = in_units("--set", changes, described.parameters), in_units("--input", signals, described.inputs)
    target = make_folder(Path(folder))
    own = {"rho_inf": rho_inf, "alpha": alpha, "beta": beta, "gamma": gamma, "record_every": record_every, "step": step}
    if resume is not None:
        method = _method_of(resume, {**own, "method": method})
    with console(stderr=True).status(f"building {described.name}") if sys.stderr.isatty() else contextlib.nullcontext():
        model = pipeline.build(described, method=method)
    with _progress(described.name) as progress:
        shared: dict[str, Any] = {"parameters": chosen, "inputs": constants, "progress": progress}
        shared |= {"checkpoint": checkpoint, "checkpoint_every": checkpoint_every}
        if resume is None:
            solution = model.simulate(t_end, method=method, **own, **shared)
        else:
            solution = model.resume(resume, t_end, **shared)
    files = _write(solution, target, plots)
    summary = _summary(solution, model, files)
    if as_json:
        print_json(summary)
    else:
        _print(solution, model, constants)
    say(f"{solution.message}\nwritten to {target}: {', '.join(file.name for file in files)}")
    return 0 if solution.success else _INTERRUPTED if solution.interrupted else NumericalError.exit_code


def _method_of(file: str, given: dict[str, Any]) -> str:
    """Return the method of a checkpoint's run. Raises UsageError for options that the run has settled."""
    from eomgen.runtime.checkpoint import Checkpoint  # noqa: PLC0415

    settled = [f"--{name.replace('_', '-')}" for name, value in given.items() if value is not None]
    if settled:
        what = "the run that goes on has its method, step and rows settled"
        raise UsageError(Problem(", ".join(settled), what, "--resume without them; --t-end may be later"))
    return str(Checkpoint.load(Path(file)).run["method"])


@contextlib.contextmanager
def _progress(title: str) -> Iterator[Callable[[int, int], None] | None]:
    """Show a progress bar on stderr where that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn  # noqa: PLC0415  # only for a terminal

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>5.1f} %"), TimeRemainingColumn())
    with Progress(*columns, console=console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _write(solution: Solution, folder: Path, plots: bool) -> list[Path]:
    import json  # noqa: PLC0415

    from eomgen.runtime.files import write_text  # noqa: PLC0415

    files = [solution.save(folder / "solution.npz"), solution.save(folder / "solution.csv")]
    if plots:
        from eomgen.runtime.plots import draw  # noqa: PLC0415  # matplotlib comes with it

        files += draw(solution, folder)
    summary = folder / "summary.json"
    files.append(summary)
    write_text(summary, json.dumps(finite(_outcome(solution, files)), indent=2) + "\n")
    return files


def _outcome(solution: Solution, files: list[Path]) -> dict[str, Any]:
    return {
        "success": solution.success,
        "message": solution.message,
        "stats": dict(solution.stats),
        **solution.metadata,
        "rows": len(solution.t),
        "files": [file.name for file in files],
    }


def _summary(solution: Solution, model: Model, files: list[Path]) -> dict[str, Any]:
    final = {name: float(column[-1]) for name, column in solution.columns().items()}
    return {**_outcome(solution, files), "folder": str(files[0].parent), "final": final, "degrees_of_freedom": model.nv}


def _print(solution: Solution, model: Model, inputs: dict[str, float]) -> None:
    stats = solution.stats
    settings = solution.metadata["settings"]
    method = f"{solution.metadata['method']}, step {settings['step']:.6g} s"
    own = [key for key in ("rho_inf", "alpha_m", "alpha_f", "beta", "gamma") if key in settings]
    method += "".join(f", {key} {settings[key]:.4g}" for key in own)
    end = f"t = {solution.t[-1]:.9g} s, {counted(len(solution.t), 'row')}"
    rows: list[tuple[str, str]] = [("method", method), ("end", end)]
    units = {item.name: item.unit for item in model.scene.parameters} | {item.name: item.unit for item in model.scene.inputs}
    for name, value in solution.metadata["parameters"].items():
        if value != model.parameters[name]:
            rows.append((f"parameter {name}", f"{_with_unit(value, units[name])}, in the scene {model.parameters[name]:.9g}"))
    rows += [(f"input {name}", f"{_with_unit(value, units[name])}, constant") for name, value in inputs.items()]
    for key, label in (
        ("steps", "steps"),
        ("newton_iterations", "Newton iterations"),
        ("factorizations", "factorizations"),
        ("halvings", "halved steps"),
    ):
        if stats.get(key):
            rows.append((label, str(stats[key])))
    rows.append(("time of computation", f"{stats['wall_time']:.3g} s"))
    total = solution.energy.get("total")
    if total is not None:
        rows.append(("total energy", f"{total[0]:.9g} J at the start, {total[-1]:.9g} J at the end"))
    for name, unit, value in list(zip(model.q_names, solution.metadata["units"]["q"], solution.q[-1], strict=True))[:12]:
        rows.append((f"{name} at the end", _with_unit(value, unit)))
    if model.nq > 12:
        rows.append(("...", f"{model.nq - 12} more in solution.csv"))
    print_table(model.name, ("", ""), rows)


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.9g}{'' if unit in ('', '1') else ' ' + unit}"
