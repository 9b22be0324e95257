"""Reports: one HTML page with scene, counts, runs, findings, plots, modes, checks, a comparison of runs, and the
animation."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.base.data import dataclass
from eomgen.base.files import write_text
from eomgen.codegen.targets.c.templates import environment
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.products.pages.live import CURVES
from eomgen.products.pictures.animation import animation_page, base64_text, check_name, page_of
from eomgen.simulation.simulate import simulate

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.results.solution import Solution

#: Charts of a run at most.
_CHARTS = 24
#: Heads of names of columns that the title of a chart says already.
_HEAD = re.compile(r"^(output|input|energy)\.")
#: Kinds of curves, in order, by the first word of the names of their columns.
_KINDS = {
    "output": "outputs", "q": "coordinates", "v": "velocities", "z": "internal states", "input": "inputs",
    "energy": "energy",
}  # fmt: skip  # a table
_PARTS = {"style": "pages/report.css", "curves": "pages/curves.js", "report": "pages/report.js"}


class ChecksOfForms(Protocol):
    """Checks of closed forms: a ``CheckReport``, whose ``forms`` have ``name`` and ``verdict``."""

    @property
    def summary(self) -> str: ...
    @property
    def forms(self) -> Sequence[Any]: ...


@dataclass(frozen=True)
class ReportedRun:
    """A run of a report, with the name there."""

    name: str
    solution: Solution


@checked_call('model.report("report.html")')
def report(
    model: CompiledModel,
    path: str | Path,
    solutions: Solution | Sequence[Solution] | None = None,
    *,
    checks: ChecksOfForms | None = None,
) -> Path:
    """Write a report on a model and runs: one HTML file for a browser, which can be printed.

    Parameters
    ----------
    path : path
        File to write, ``.html``.
    solutions : Solution or sequence of Solution, optional
        Runs; several are compared with one another. By default one run with the scene's values.
    checks : CheckReport, optional
        Checks of the closed forms of the scene, of ``eomgen.studies.check(scene)``.

    Returns
    -------
    Path
        The written file.

    Raises
    ------
    UsageError
        A name that ends otherwise than in ``.html``.
    FileError
        The file cannot be written.

    Examples
    --------
    >>> model = eomgen.build("examples/four_bar/scene.toml")
    >>> model.report("four_bar_report.html").name
    'four_bar_report.html'
    """
    target = check_name(Path(path))
    solutions = simulate(model) if solutions is None else solutions
    results = solutions if isinstance(solutions, Sequence) else [solutions]
    runs = [
        ReportedRun("run" if len(results) == 1 else f"run {number}", solution)
        for number, solution in enumerate(results, 1)
    ]
    write_text(target, report_page(runs, model, checks=checks))
    return target


def report_page(
    runs: Sequence[ReportedRun],
    model: CompiledModel | None,
    *,
    text: str = "",
    checks: ChecksOfForms | None = None,
    animation: bool = True,
) -> str:
    """Return the text of a report.

    Parameters
    ----------
    runs : at least one
    model : of the runs; without a model, as for runs from files, there are no counts, modes and checks
    text : of the scene's file
    """
    if not runs:
        raise UsageError(Problem("report", "a report needs a run [E0960]", "a scene, or a folder with a solution.npz"))
    first, charts = runs[0].solution, list[dict[str, Any]]()
    title = str(first.metadata.get("scene", "scene"))
    content = (
        environment()
        .get_template("pages/report_content.html.jinja")
        .render(
            title=title,
            text=text,
            model=model,
            modes=None if model is None else _modes(model),
            runs=runs,
            comparison=_comparison(runs, charts) if len(runs) > 1 else None,
            plots=[(run, *_plots(run.solution, charts)) for run in runs],
            checks=checks,
            verdicts=[] if checks is None else [(form.name, form.verdict) for form in checks.forms],
            animations=_animations(runs) if animation else [],
        )
    )
    data = {"name": f"{title}: report", "charts": charts}
    return page_of("pages/report.html", _PARTS, data, str(first.metadata.get("version", "")), content=content)


def _add_chart(
    charts: list[dict[str, Any]], title: str, unit: str, curves: Iterable[tuple[str, Array, Array]]
) -> dict[str, Any]:
    """Add a chart of curves over time, each name, times (n,) and values (n,), and return it; at most 3000 rows are
    kept."""
    packed = []
    for name, *columns in curves:
        rows = np.unique(np.linspace(0, len(columns[0]) - 1, min(len(columns[0]), 3000)).round().astype(int))
        x, y = (base64_text(column[rows].astype("<f4")) for column in columns)
        packed.append({"name": name, "x": x, "y": y})
    chart = {"id": f"chart{len(charts) + 1}", "title": title, "unit": unit, "across": "t, s", "curves": packed}
    charts.append(chart)
    return chart


#: Columns of a run by name, with units.
Columns = dict[str, tuple[Array, str]]


def _columns_of(solution: Solution) -> Columns:
    """Return the columns that reports draw, (values, unit) by name, in the order of the solution's columns:
    coordinates, velocities, internal states, inputs, outputs and energies. Time, accelerations, multipliers and empty
    columns are left out.
    """
    units = {name: "" if unit == "1" else unit for name, unit in solution.units().items()}
    left_out = {"t", *solution.metadata.get("names", {}).get("multipliers", ())}
    return {
        name: (values, units.get(name, ""))
        for name, values in solution.columns().items()
        if name not in left_out and not name.startswith("a.") and len(values)
    }


def _kind(name: str, solution: Solution) -> str:
    head = "output" if name.partition("[")[0] in solution.outputs else name.partition(".")[0]
    return _KINDS.get(head, "outputs")


def _plots(solution: Solution, charts: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], int]:
    """Return the charts of a run, up to six curves of one kind and one unit in each, and the number of columns that are
    not drawn. The charts are added to ``charts``."""
    groups: dict[tuple[str, str], list[tuple[str, Array, Array]]] = {}
    for name, (values, unit) in _columns_of(solution).items():
        groups.setdefault((_kind(name, solution), unit), []).append((name, solution.t, values))
    order = list(_KINDS.values())
    parts = [
        (kind, unit, curves[first : first + CURVES])
        for (kind, unit), curves in sorted(groups.items(), key=lambda group: order.index(group[0][0]))
        for first in range(0, len(curves), CURVES)
    ]
    drawn = []
    for kind, unit, curves in parts[:_CHARTS]:
        title = "power" if (kind, unit) == ("energy", "W") else kind
        drawn.append(_add_chart(charts, title, unit, [(_HEAD.sub("", name), t, x) for name, t, x in curves]))
    return drawn, sum(len(curves) for _, _, curves in parts[_CHARTS:])


def _comparison(runs: Sequence[ReportedRun], charts: list[dict[str, Any]]) -> dict[str, Any]:
    """Return settings that differ, and differences and charts of common columns."""
    settings = [_settings(run.solution) for run in runs]
    rows_of_settings = [
        (name, *(by_name.get(name, "") for by_name in settings)) for name in dict.fromkeys(chain(*settings))
    ]
    columns = [_columns_of(run.solution) for run in runs]
    shared = [name for name in columns[0] if all(name in by_name for by_name in columns)]
    first = runs[0].solution
    drawn, rows = [], []
    outputs = [name for name in shared if _kind(name, first) in ("outputs", "energy")] or shared
    for name in outputs[:_CHARTS]:
        curves = [(run.name, run.solution.t, by_name[name][0]) for run, by_name in zip(runs, columns, strict=True)]
        drawn.append(_add_chart(charts, name, columns[0][name][1], curves))
    for name in shared:
        values, unit = columns[0][name]
        others = zip(runs[1:], columns[1:], strict=True)
        differences = [_difference(first.t, values, run.solution.t, by_name[name][0]) for run, by_name in others]
        rows.append([name, unit, *chain(*differences)])
    headings = [(f"largest difference, {run.name}", "at t, s", f"at the end, {run.name}") for run in runs[1:]]
    return {
        "settings": [row for row in rows_of_settings if len({*row[1:]}) > 1],
        "headings": ["column", "unit", *chain(*headings)],
        "differences": rows,
        "charts": drawn,
    }


def _settings(solution: Solution) -> dict[str, str]:
    data: Mapping[str, Any] = solution.metadata
    result = {"scene": str(data.get("scene", "")), "method": str(data.get("method", ""))}
    for group in ("settings", "parameters", "inputs"):
        result |= {
            f"{group[:-1]} {name}": f"{value:.9g}" if isinstance(value, int | float) else str(value)
            for name, value in data.get(group, {}).items()
        }
    return result | {"end, s": f"{solution.t[-1]:.9g}", "profile": str(data.get("profile", ""))}


def _difference(t: Array, values: Array, other_t: Array, other_values: Array) -> tuple[str, str, str]:
    """Return as texts the largest difference of two runs over common times, the time, and the last difference."""
    last = min(t[-1], other_t[-1])
    rows = np.flatnonzero((t <= last) & (t >= max(t[0], other_t[0])))
    if not len(rows):
        return "no common time", "", ""
    gap = np.interp(t[rows], other_t, other_values) - values[rows]
    worst = int(np.argmax(np.abs(gap)))
    return f"{abs(gap[worst]):.3g}", f"{t[rows[worst]]:.6g}", f"{gap[-1]:.3g}"


def _modes(model: Any) -> tuple[str, list[tuple[str, ...]]]:
    """Return a sentence on the modes about the scene's operating point, and a row for each; no row, with the reason, if
    there are none."""
    try:
        linear: Any = model.linearize()
        modes = linear.modes()
    except EomgenError as error:
        return f"There is no linear model: {error}", []
    rows = list[tuple[str, ...]]()
    for number in range(min(len(modes), 24)):
        shape = np.abs(modes.shapes[:, number])
        most = [modes.coordinates[k] for k in np.argsort(-shape)[:3] if shape[k] > 0.05]
        value = modes.eigenvalues[number]
        rows.append(
            (
                f"{number + 1}",
                f"{modes.frequency[number]:.6g}",
                f"{modes.damping_ratio[number] + 0.0:.4g}",
                f"{value.real:.6g} {'+' if value.imag >= 0 else '-'} {abs(value.imag):.6g}\u00a0i",
                ", ".join(most),
            )
        )
    return f"{repr(linear).strip('<>').partition(':')[0]}: {modes.stability}", rows


def _animations(runs: Sequence[ReportedRun]) -> list[tuple[ReportedRun, str, str]]:
    """Return each run with the page of its animation, or with the reason for which it has none."""
    result, size = list[tuple[ReportedRun, str, str]](), 0
    for run in runs:
        try:
            page, fault = animation_page(run.solution), ""
        except EomgenError as error:
            page, fault = "", str(error)
        size += len(page.encode())
        if size > 6_000_000:
            fault = "left out, as the report would be too large; eomgen animate writes a page."
        result.append((run, page, fault))
    return result
