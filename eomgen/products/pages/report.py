"""Reports: one HTML page with scene, counts, runs, findings, plots, modes, checks, a comparison of runs, and the
animation."""

from __future__ import annotations

import html
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
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.products.pictures.animation import animation_page, base64_text, check_name, page_of
from eomgen.simulation.simulate import simulate

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.results.solution import Solution

#: Curves of a chart, and charts of a run at most.
_CURVES, _CHARTS = 6, 24
#: Heads of names of columns that the title of a chart says already.
_HEAD = re.compile(r"^(output|input|energy)\.")
#: Rows of a table of values and of functions.
_LISTED = 60
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
    charts = _Charts()
    first = runs[0].solution
    title = str(first.metadata.get("scene", "scene"))
    described = "" if model is None else model.description.description
    parts = [f'<h1>{_text(title)}</h1>\n<p class="soft">{_text(described)}</p>']
    parts += [] if model is None else [_scene(model, text), _counts(model)]
    parts.append(_runs(runs))
    parts += [_comparison(runs, charts)] if len(runs) > 1 else []
    parts += [_plots(run, charts, single=len(runs) == 1) for run in runs]
    parts += [] if model is None else [_modes(model)]
    if checks is not None:
        verdicts = _table(("closed form", "verdict"), [(form.name, form.verdict) for form in checks.forms])
        parts.append(_section("Checks", f"<p>{_text(checks.summary)}</p>", verdicts))
    parts += [_animation(runs)] if animation else []
    data = {"name": f"{title}: report", "charts": charts.data}
    version = str(first.metadata.get("version", ""))
    return page_of("pages/report.html", _PARTS, data, version, content="\n".join(part for part in parts if part))


class _Charts:
    """Charts of a report: data, and canvases."""

    def __init__(self) -> None:
        self.data: list[dict[str, Any]] = []

    def add(self, title: str, unit: str, across: str, curves: Iterable[tuple[str, Array, Array]]) -> str:
        """Add a chart of curves, each name, abscissa (n,) and values (n,), and return the HTML of the canvas.
        ``across`` is the label of the abscissa; at most 3000 rows are kept."""
        number = f"chart{len(self.data) + 1}"
        packed = []
        for name, x, y in curves:
            rows = np.unique(np.linspace(0, len(x) - 1, min(len(x), 3000)).round().astype(int))
            packed.append(
                {"name": name, **{k: base64_text(part[rows].astype("<f4")) for k, part in (("x", x), ("y", y))}}
            )
        self.data.append({"id": number, "title": title, "unit": unit, "across": across, "curves": packed})
        label = html.escape(f"{title} over {across}")
        return f'<canvas id="{number}" role="img" aria-label="{label}"></canvas>'


def _text(text: object) -> str:
    return html.escape(str(text))


def _section(title: str, *parts: str) -> str:
    inside = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{_text(title)}</h2>\n{inside}\n</section>" if inside else ""


def _table(headings: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a table of plain texts; empty without rows."""
    if not rows:
        return ""
    head = "".join(f"<th>{_text(heading)}</th>" for heading in headings)
    head = f"<thead><tr>{head}</tr></thead>" if any(headings) else ""
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows[:_LISTED])
    more = f'<p class="soft">and {len(rows) - _LISTED} more</p>' if len(rows) > _LISTED else ""
    return f'<div class="wide"><table>{head}<tbody>{body}</tbody></table></div>{more}'


def _cell(content: object) -> str:
    """Return a cell of a table; long texts keep a width on narrow pages, whose tables scroll."""
    text = _text(content)
    return f'<td class="text">{text}</td>' if len(text) > 24 else f"<td>{text}</td>"


def _scene(model: CompiledModel, text: str) -> str:
    described = model.description
    parameters = [
        (item.name, f"{item.value:.6g}", item.unit, "tunable" if item.tunable else "fixed", item.description)
        for item in described.parameters
        if not item.standard_normal
    ]
    source = f"<details><summary>The scene file</summary><pre>{_text(text)}</pre></details>" if text else ""
    notes = "".join(f"<p>note: {_text(note)}</p>" for note in dict.fromkeys(model.notes))
    return _section("Scene", source, _table(("parameter", "value", "unit", "", "meaning"), parameters), notes)


def _counts(model: CompiledModel) -> str:
    """Return the section with the sizes of a model and the operations of the functions."""
    layout, sizes = model.library.layout, model.functions.sizes
    facts = [
        ("bodies", len(model.bodies)),
        ("coordinates q", sizes["q"]),
        ("velocities v", sizes["v"]),
        ("constraint equations", len(model.multipliers)),
        ("degrees of freedom", sizes["v"] - len(model.multipliers)),
        ("inputs", sizes["u"]),
        ("internal states", sizes["z"]),
        ("tunable parameters", sizes["p"]),
        ("outputs", ", ".join(item["name"] for item in layout["outputs"]) or "none"),
    ]
    functions = [
        (item["name"], item["description"], *(item["counts"].get(kind, 0) for kind in _OPERATIONS))
        for item in layout["functions"]
    ]
    headings = ("function", "result", *_OPERATIONS)
    return _section(
        "Counts", _table(("", ""), facts), "<h3>Operations of the compiled functions</h3>", _table(headings, functions)
    )


_OPERATIONS = ("additions", "multiplications", "divisions", "functions")


def _runs(runs: Sequence[ReportedRun]) -> str:
    """Return the sections on runs: settings, outcome, statistics and findings."""
    parts = []
    for run in runs:
        solution, data = run.solution, run.solution.metadata
        settings = ", ".join(f"{name} {value:.6g}" for name, value in data.get("settings", {}).items())
        rows = [
            ("outcome", solution.message),
            ("method", f"{data.get('method', '')}: {settings}"),
            ("from, to", f"t = {solution.t[0]:.9g} s to {solution.t[-1]:.9g} s, {len(solution.t)} rows"),
            ("start", data.get("start", "")),
            ("estimated error", solution.error.largest or solution.error),
            ("energy balance", data.get("energy_balance", "")),
            ("inputs", ", ".join(f"{name} = {value}" for name, value in data.get("inputs", {}).items())),
            ("events", ", ".join(f"{name}: {count}" for name, count in solution.events.counts.items())),
            ("profile of the compiler", data.get("profile", "")),
        ]
        statistics = dict(solution.stats)
        rows.append(("time of computation", f"{statistics.pop('wall_time', 0.0):.3g} s"))
        counted = {key: value for key, value in sorted(statistics.items()) if isinstance(value, int | float)}
        # a run in a file has its numbers in the order of their names
        for key in sorted(counted, key=lambda key: isinstance(counted[key], float)):
            rows.append((key.replace("_", " "), f"{counted[key]:.6g}"))
        findings = "".join(
            f'<p class="{_text(item.severity)}">{_text(item.severity)}: {_text(item)}</p>' for item in solution.findings
        )
        heading = f"<h3>{_text(run.name)}</h3>" if len(runs) > 1 else ""
        shown = [(name, value) for name, value in rows if str(value)]
        told = findings or "<p>no findings</p>"
        parts.append(f"{heading}{_table(('', ''), shown)}<h3>Findings</h3>{told}")
    return _section("Runs" if len(runs) > 1 else "Run", *parts)


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


def _plots(run: ReportedRun, charts: _Charts, *, single: bool) -> str:
    """Return the HTML section with the charts of a run: curves of one kind and one unit, ``_CURVES`` in each. The
    charts are added to ``charts``; ``single``: the report has one run."""
    solution = run.solution
    groups: dict[tuple[str, str], list[tuple[str, Array, Array]]] = {}
    for name, (values, unit) in _columns_of(solution).items():
        groups.setdefault((_kind(name, solution), unit), []).append((name, solution.t, values))
    order = list(_KINDS.values())
    parts = [
        (kind, unit, curves[first : first + _CURVES])
        for (kind, unit), curves in sorted(groups.items(), key=lambda group: order.index(group[0][0]))
        for first in range(0, len(curves), _CURVES)
    ]
    canvases = []
    for kind, unit, curves in parts[:_CHARTS]:
        title = "power" if (kind, unit) == ("energy", "W") else kind
        canvases.append(charts.add(title, unit, "t, s", [(_HEAD.sub("", name), t, x) for name, t, x in curves]))
    left = sum(len(curves) for _, _, curves in parts[_CHARTS:])
    more = f'<p class="soft">{left} further columns are not drawn: solution.csv has all columns.</p>' if left else ""
    hint = '<p class="soft screen">Drag over a part of a plot to enlarge the part, double-click to see all again.</p>'
    heading = "Plots" if single else f"Plots of {run.name}"
    return _section(heading, hint, f'<div class="charts">{"".join(canvases)}</div>', more)


def _comparison(runs: Sequence[ReportedRun], charts: _Charts) -> str:
    """Return the HTML section with settings that differ, differences and charts of common columns."""
    settings = [_settings(run.solution) for run in runs]
    names = dict.fromkeys(chain(*settings))
    rows_of_settings = [(name, *(by_name.get(name, "") for by_name in settings)) for name in names]
    differing = [row for row in rows_of_settings if len({*row[1:]}) > 1]
    columns = [_columns_of(run.solution) for run in runs]
    shared = [name for name in columns[0] if all(name in by_name for by_name in columns)]
    first = runs[0].solution
    canvases, rows = [], []
    outputs = [name for name in shared if _kind(name, first) in ("outputs", "energy")] or shared
    for name in outputs[:_CHARTS]:
        curves = [(run.name, run.solution.t, by_name[name][0]) for run, by_name in zip(runs, columns, strict=True)]
        canvases.append(charts.add(name, columns[0][name][1], "t, s", curves))
    for name in shared:
        values, unit = columns[0][name]
        others = zip(runs[1:], columns[1:], strict=True)
        differences = [_difference(first.t, values, run.solution.t, by_name[name][0]) for run, by_name in others]
        rows.append([name, unit, *chain(*differences)])
    headings = [(f"largest difference, {run.name}", "at t, s", f"at the end, {run.name}") for run in runs[1:]]
    return _section(
        "Comparison",
        "<h3>Settings that differ</h3>",
        _table(("", *(run.name for run in runs)), differing) or "<p>none</p>",
        f"<h3>Differences from {_text(runs[0].name)}</h3>",
        _table(["column", "unit", *chain(*headings)], rows),
        f'<div class="charts">{"".join(canvases)}</div>',
    )


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


def _modes(model: Any) -> str:
    """Return the HTML section with modes about the scene's operating point, or the reason why there are none."""
    try:
        linear: Any = model.linearize()
        modes = linear.modes()
    except EomgenError as error:
        return _section("Modes", f"<p>There is no linear model: {_text(error)}</p>")
    rows = []
    for number in range(min(len(modes), 24)):
        shape = np.abs(modes.shapes[:, number])
        most = [modes.coordinates[k] for k in np.argsort(-shape)[:3] if shape[k] > 0.05]
        value = modes.eigenvalues[number]
        rows.append(
            (
                number + 1,
                f"{modes.frequency[number]:.6g}",
                f"{modes.damping_ratio[number] + 0.0:.4g}",
                f"{value.real:.6g} {'+' if value.imag >= 0 else '-'} {abs(value.imag):.6g}\u00a0i",
                ", ".join(most),
            )
        )
    headings = ("mode", "undamped frequency, Hz", "damping ratio", "eigenvalue, 1/s", "largest coordinates")
    about = f"{repr(linear).strip('<>').partition(':')[0]}: {modes.stability}"
    return _section("Modes", f"<p>{_text(about)}</p>", _table(headings, rows))


def _animation(runs: Sequence[ReportedRun]) -> str:
    """Return the HTML section with the animations of the runs, or a sentence on failed or too large ones."""
    parts = []
    size = 0
    for run in runs:
        try:
            page = animation_page(run.solution)
        except EomgenError as error:
            parts.append(f"<p>{_text(run.name)}: {_text(error)}</p>")
            continue
        size += len(page.encode())
        if size > 6_000_000:
            parts.append(
                f"<p>{_text(run.name)}: left out, as the report would be too large; eomgen animate writes a page.</p>"
            )
            continue
        heading = f"<h3>{_text(run.name)}</h3>" if len(runs) > 1 else ""
        inside = html.escape(page)
        parts.append(
            f'{heading}<iframe title="animation" sandbox="allow-scripts" loading="lazy" srcdoc="{inside}"></iframe>'
        )
    return _section("Animation", *parts)
