"""``eomgen simulate``: run, save and plot, and report the outcome."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.json_text import json_text
from eomgen.base.messages import counted, nearest, shown
from eomgen.cli.options import arguments_of, debug_option, folder_option, json_option, run_options, scene_options
from eomgen.cli.parts import RunPart, parts_of, with_parts
from eomgen.cli.printing import print_json, print_table, say, say_note
from eomgen.cli.running import outcome_code, read_scene, run
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.base.drawing_process import DrawingProcess, Drawings
    from eomgen.pipeline.model import Model
    from eomgen.results.events import Events
    from eomgen.results.solution import Solution
    from eomgen.simulation.timing import StepTimes

_option = arguments_of("eomgen.simulation.simulate:simulate")


@with_parts
@click.command()
@folder_option
@run_options
@_option("--checkpoint", default=None, metavar="FILE")
@_option("--checkpoint-every", type=int, default=None, metavar="N")
@click.option("--resume", default=None, metavar="FILE", help="Go on from a checkpoint, to the same bits.")
@click.option("--timing", is_flag=True, help="Repeat the run step by step: median, late and longest time of a step.")
@click.option("--plots/--no-plots", default=True, show_default=True, help="Draw the solution.")
@click.option("--over", default=None, metavar="COLUMN", help="Draw outputs over this column as well as over time.")
@scene_options
@json_option
@debug_option
def simulate(
    scene: str, folder: str, plots: bool, over: str | None, timing: bool, as_json: bool, **options: Any
) -> int:
    """Integrate a SCENE and write solution.npz, solution.csv, summary.json and plots; with --timing step_times.csv.

    Ctrl-C, and a run that fails, leave the partial result; the exit code is then 130 or 6.
    """
    from eomgen.base.drawing_process import drawing_process  # noqa: PLC0415
    from eomgen.base.files import make_folder  # noqa: PLC0415  # imported when the arguments are fine

    with drawing_process(_drawings_of_stored) if plots else nullcontext() as copy:
        from eomgen.pipeline.front_end import file_kinds  # noqa: PLC0415  # while the copy imports matplotlib

        for kind in file_kinds():
            code = kind.simulate(scene, folder, {**options, "timing": timing, "over": over}, plots, as_json)
            if code is not None:
                return code
        described = read_scene(scene, options)
        if over is not None and "." not in over:  # columns of the motion are known after the run
            _check_output(over, [output.name for output in described.outputs])
        target = make_folder(Path(folder))
        model, solution = run(described, options, once=not timing)
        times = _time_steps(model, solution, options["inputs"]) if timing and solution.success else None
        parts: list[RunPart] = [part(solution, model) for part in parts_of("simulate")]
        drawings = {"folder": f"{target}", "over": over} if plots else None
        files = _write_run(solution, target, times, drawings, parts, copy)
    if as_json:
        summary = _summary(solution, model, files)
        for part in parts:
            summary |= part.data()
        print_json(summary | ({"timing": times.summary()} if times is not None else {}))
    else:
        _print(solution, model, options["inputs"], times, parts)
    for note in dict.fromkeys(solution.metadata["notes"]):
        if note not in solution.message and note not in described.notes:  # these are printed when the scene is read
            say_note(note)
    say(f"{solution.message}\nwritten to {target}: {', '.join(file.name for file in files)}")
    return outcome_code(solution)


def _check_output(column: str, known: Sequence[str]) -> None:
    """Raise UsageError for a column of no output."""
    name = column.partition("[")[0]
    if name not in known:
        raise UsageError(Problem(f"--over {column}", f"there is no output {shown(name)} [E0204]", nearest(name, known)))


def _time_steps(model: Model, solution: Solution, inputs: dict[str, float]) -> StepTimes:
    from eomgen.simulation.timing import step_times  # noqa: PLC0415

    return step_times(model, solution, inputs or None)


def _write_run(
    solution: Solution,
    folder: Path,
    times: StepTimes | None,
    order: dict[str, Any] | None,
    parts: Sequence[RunPart],
    copy: DrawingProcess | None,
) -> list[Path]:
    """Write solution, tables, figures and summary of a run in a folder, and return the files.

    Parameters
    ----------
    times : of the steps, None: not measured
    order : ``folder`` and ``over`` of the figures; None for a run without figures
    parts : of products, with further figures
    copy : of this process, which draws; if there is none, and if the copy fails, the figures are drawn here
    """
    from eomgen.base.files import write_text  # noqa: PLC0415

    table = folder / "solution.csv"
    with _meanwhile(solution, table) as written:
        files = [solution.save(folder / "solution.npz")]
        with _drawing(order, parts, copy):
            files.append(table if written() else solution.save(table))
            files += _tables(solution, folder, times)
            names = None if copy is None else copy.files()
    if names is not None:
        files += [folder / name for name in names]
    elif order is not None:
        files += [file for drawing in _drawings(solution, order, parts) for file in drawing()]
    files.append(folder / "summary.json")
    write_text(files[-1], json_text(_outcome(solution, files)) + "\n")
    return files


def _meanwhile(solution: Solution, table: Path) -> AbstractContextManager[Callable[[], bool]]:
    """Return a context in which a copy of this process writes a long table; the given function waits, and returns
    success. A short table is left to the caller: the function returns False."""
    if solution.q.size + 2 * solution.v.size < 200_000:  # a copy of the process takes longer than the text
        return nullcontext(lambda: False)
    from eomgen.base.drawing_process import in_copy  # noqa: PLC0415

    solution.columns()  # evaluated once, for both
    return in_copy(partial(solution.save, table))


@contextmanager
def _drawing(order: dict[str, Any] | None, parts: Sequence[RunPart], copy: DrawingProcess | None) -> Iterator[None]:
    """Let the copy of this process draw the figures of ``order`` during a context, with the data of ``parts`` in files.
    Without a copy or an order the context does not draw."""
    if order is None or copy is None:
        yield
        return
    with ExitStack() as stack:
        stored = [stack.enter_context(part.storage(Path(order["folder"]))) for part in parts]
        copy.order({**order, "stored": stored})
        yield


def _tables(solution: Solution, folder: Path, times: StepTimes | None) -> list[Path]:
    """Write the tables of events and times of a run, and return the files."""
    files = []
    if solution.events.counts:
        files.append(solution.events.write(folder / "events.csv", solution.metadata["names"]))
    return files if times is None else [*files, times.write(folder / "step_times.csv")]


def _drawings_of_stored() -> Drawings:
    """Import the readers of solutions, and return a function from an order to calls that draw a stored run."""
    from eomgen.results.solution import Solution  # noqa: PLC0415

    def drawings(order: Mapping[str, Any]) -> list[Callable[[], list[Path]]]:
        solution = Solution.load(Path(order["folder"]) / "solution.npz")
        return _drawings(solution, order, [part(solution) for part in parts_of("simulate")])

    return drawings


def _drawings(solution: Solution, order: Mapping[str, Any], parts: Sequence[RunPart]) -> list[Callable[[], list[Path]]]:
    """Return calls that draw the files of a run: in a folder, over a column, and figures of the parts."""
    from eomgen.results.plots import draw_over, drawings  # noqa: PLC0415  # matplotlib comes with it

    folder, over = Path(order["folder"]), order["over"]
    calls = drawings(solution, folder)
    calls += [partial(draw_over, solution, folder, over)] if over is not None else []
    stored = order.get("stored", [None] * len(parts))
    return calls + [call for part, file in zip(parts, stored, strict=True) for call in part.drawings(folder, file)]


def _outcome(solution: Solution, files: list[Path]) -> dict[str, Any]:
    return {
        "success": solution.success,
        "message": solution.message,
        "findings": [finding.to_dict() | {"code": finding.code} for finding in solution.findings],
        "stats": dict(solution.stats),
        **solution.metadata,
        "error": solution.error.summary(),
        "rows": len(solution.t),
        "files": [file.name for file in files],
    }


def _summary(solution: Solution, model: Model, files: list[Path]) -> dict[str, Any]:
    final = {name: float(column[-1]) for name, column in solution.columns().items()}
    return {**_outcome(solution, files), "folder": str(files[0].parent), "final": final, "degrees_of_freedom": model.nv}


def _print(
    solution: Solution,
    model: Model,
    inputs: dict[str, float],
    times: StepTimes | None,
    parts: Sequence[RunPart],
) -> None:
    """Print the table of a run."""
    rows = [
        *_rows_of_run(solution),
        *_rows_of_values(solution, model, inputs),
        *_rows_of_steps(solution, times),
        *_rows_of_accuracy(solution),
        *(row for part in parts for row in part.rows()),
        ("energy balance", str(solution.metadata["energy_balance"])),
        *_rows_at_end(solution, model),
    ]
    print_table(model.name, ("", ""), rows)


def _rows_of_run(solution: Solution) -> list[tuple[str, str]]:
    """Return the method, start, end and events of a run."""
    from eomgen.system.description import CORRECTED, LOST  # noqa: PLC0415  # NumPy comes with it

    settings = solution.metadata["settings"]
    method = f"{solution.metadata['method']}, step {settings['step']:.6g} s"
    keys = [key for key in ("rho_inf", "alpha_m", "alpha_f", "beta", "gamma", "tolerance", "order") if key in settings]
    method += "".join(f", {key} {settings[key]:.4g}" for key in keys)
    rows: list[tuple[str, str]] = [("method", method), ("start", solution.metadata["start"])]
    rows += [("", sentence) for sentence in solution.metadata["corrections"] if sentence.code in (CORRECTED, LOST)]
    rows.append(("end", f"t = {solution.t[-1]:.9g} s, {counted(len(solution.t), 'row')}"))
    if solution.events.counts:
        rows += [(f"event {name}", _times(solution.events, name)) for name in solution.events.counts]
    return rows


def _rows_of_values(solution: Solution, model: Model, inputs: dict[str, float]) -> list[tuple[str, str]]:
    """Return the parameters with other values than in the scene, and constant inputs."""
    scene = model.scene
    units = {item.name: item.unit for item in (*scene.parameters, *scene.inputs)}
    rows = [
        (f"parameter {name}", f"{_with_unit(value, units[name])}, in the scene {model.parameters[name]:.9g}")
        for name, value in solution.metadata["parameters"].items()
        if value != model.parameters[name]
    ]
    return rows + [(f"input {name}", f"{_with_unit(value, units[name])}, constant") for name, value in inputs.items()]


def _rows_of_steps(solution: Solution, times: StepTimes | None) -> list[tuple[str, str]]:
    """Return the numbers of steps and iterations, and the time of computation."""
    stats = solution.stats
    rows: list[tuple[str, str]] = []
    by_tolerance = stats.get("own_steps") or stats.get("expansions")
    if by_tolerance or stats.get("steps"):
        rows.append(("steps", f"{by_tolerance} of its own" if by_tolerance else str(stats["steps"])))
    labels = {
        "newton_iterations": "Newton iterations",
        "factorizations": "factorizations",
        "halvings": "halved steps",
        "rejections": "steps taken anew",
    }
    rows += [(label, str(stats[key])) for key, label in labels.items() if stats.get(key)]
    rows.append(("time of computation", f"{stats['wall_time']:.3g} s"))
    return rows if times is None else [*rows, ("time of a step", str(times))]


def _rows_of_accuracy(solution: Solution) -> list[tuple[str, str]]:
    """Return the total energy and the estimated error of a run."""
    rows: list[tuple[str, str]] = []
    total, error = solution.energy.get("total"), solution.error
    if total is not None:
        rows.append(("total energy", f"{total[0]:.9g} J at the start, {total[-1]:.9g} J at the end"))
    rows.append(("estimated error", str(error.largest or error)))
    if error.available:
        rows.append(("", error.evidence))
    if error.largest_output is not None and not error.largest_output.share <= error.relative:
        rows.append(("", str(error.largest_output)))
    if error.unresolved:
        rows.append(("not in it", error.unresolved))
    return rows


def _rows_at_end(solution: Solution, model: Model) -> list[tuple[str, str]]:
    """Return coordinates and outputs at the end, without coordinates of nodes of beams."""
    import numpy as np  # noqa: PLC0415

    nodes = {node for beam in model.description.exact_beams for node in beam}
    ends = zip(model.q_names, solution.metadata["units"]["q"], solution.q[-1], strict=True)
    shown = [entry for entry in ends if entry[0].partition(".")[2].partition("[")[0] not in nodes]
    rows = [(f"{name} at the end", _with_unit(value, unit)) for name, unit, value in shown[:12]]
    if len(shown) > 12:
        rows.append(("...", f"{len(shown) - 12} more in solution.csv"))
    if len(shown) < model.nq:
        rows.append(("nodes of beams", f"{model.nq - len(shown)} coordinates in solution.csv"))
    for name, values in solution.outputs.items():
        numbers = ", ".join(f"{value:.9g}" for value in np.atleast_1d(values[-1]))
        unit = solution.metadata["units"]["outputs"].get(name, "")
        rows.append((f"output {name} at the end", f"{numbers}{'' if unit in ('', '1') else ' ' + unit}"))
    return rows


def _times(events: Events, name: str) -> str:
    """Return the number of times that an event came, and the times, in words."""
    count, times = events.counts[name], events[name].t
    if not len(times):
        return counted(count, "time")
    last = "" if len(times) == 1 else f", the last at t = {times[-1]:.9g} s"
    return f"{counted(count, 'time')}, {'the first at ' if last else ''}t = {times[0]:.9g} s{last}"


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.9g}{'' if unit in ('', '1') else ' ' + unit}"
