"""Displacements, strains and section loads of geometrically exact beams: at rest, along the axis at instants, over
time, the largest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import fields, replace
from eomgen.base.figures import axes_of_caller, axis_label, new_figure, pyplot_figure, save_figure
from eomgen.base.files import read_arrays, write_arrays
from eomgen.base.messages import listed, nearest, shown
from eomgen.base.rounding import COMPUTED
from eomgen.compiled.beams import SectionLoads
from eomgen.compiled.coordinates import StateArrays
from eomgen.compiled.initial_state import initial_state
from eomgen.errors import Problem, UsageError
from eomgen.lie import numeric
from eomgen.lie.groups import SO3
from eomgen.results.poses import poses_and_scenery
from eomgen.results.recorded import RecordedSolution

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


#: By quantity: components and unit of the quantity.
_QUANTITIES: Mapping[str, tuple[tuple[str, str, str], str]] = {
    "moment": (("torque", "bending moment about y", "bending moment about z"), "N m"),
    "force": (("axial force", "shear force along y", "shear force along z"), "N"),
    "curvature": (("twist", "curvature about y", "curvature about z"), "1/m"),
    "strain": (("stretch", "shear along y", "shear along z"), "1"),
}
_LOADS = ("moment", "force")


class ModelWithSections(Protocol):
    """The model of a run: see ``Solution.model``."""

    def section_loads(self, state: StateArrays, multipliers: Array) -> Mapping[str, SectionLoads]: ...


class LoadedSolution(RecordedSolution, Protocol):
    """Interface of a ``Solution`` with section loads."""

    @property
    def model(self) -> ModelWithSections | None: ...

    @property
    def section_loads(self) -> Mapping[str, SectionLoads]: ...


def plot_sections(
    solution: LoadedSolution,
    beam: str = "",
    *quantities: str,
    at: ArrayLike | None = None,
    axes: object = None,
) -> list[Any]:
    """Draw strains or loads along a geometrically exact beam.

    Parameters
    ----------
    beam : str
        Name of the beam; may be left out if the scene has a single beam.
    *quantities : str
        ``moment``, ``force``, ``curvature``, ``strain``; moment and force if none is given.
    at : times, s
        Curves along the axis at the rows nearest to these times; without times one map over time and axis for each
        component that differs from zero.
    axes : matplotlib Axes, or several
        Axes to draw on, one for each panel; a new figure of pyplot if none are given.

    Returns
    -------
    list of matplotlib Axes
        One for each panel.

    Raises
    ------
    UsageError
        A name that is none of a beam or of a quantity; times outside the solution; another number of axes than of
        panels.
    """
    for quantity in quantities:
        if quantity not in _QUANTITIES:
            fault = f"sections have no {shown(quantity)} [E1287]"
            raise UsageError(Problem("plot_sections", fault, nearest(str(quantity), _QUANTITIES)))
    rows = _rows_at(solution, at) if at is not None else _thinned(solution.t)
    name, loads = _loads(solution, beam, rows)
    panels = [(quantity, index) for quantity in quantities or _LOADS for index in _present(loads, quantity)]
    if axes is None:
        figure = pyplot_figure((9.0, 0.6 + 2.6 * len(panels)))
        figure.suptitle(f"{solution.metadata.get('scene', '')}: {name}", fontsize=11)
        drawn = list(np.atleast_1d(figure.subplots(len(panels), 1, sharex=True)))
    else:
        drawn = axes_of_caller("plot_sections", axes, [_QUANTITIES[name][0][index] for name, index in panels])
    for number, (axis, (quantity, index)) in enumerate(zip(drawn, panels, strict=True)):
        if at is not None:
            _along(axis, loads, quantity, index, solution.t[rows], legend=number == 0)
        else:
            _over_time(axis, loads, quantity, index, solution.t[rows])
    drawn[-1].set_xlabel("x at rest, m" if at is not None else "time, s")
    return drawn


def drawn_loads(solution: LoadedSolution) -> Mapping[str, SectionLoads]:
    """Return by beam the loads that ``draw_sections`` draws: at some rows, without strains."""
    loads = _by_beam(solution, _thinned(solution.t))
    return {
        beam: replace(load, strain=load.strain[:, :0], curvature=load.curvature[:, :0]) for beam, load in loads.items()
    }


def store_drawn_loads(solution: LoadedSolution, path: Path) -> None:
    """Write ``drawn_loads`` to a file, for a process that has no model. Raises FileError."""
    loads = drawn_loads(solution)
    arrays = {f"{beam}.{field}": array for beam, load in loads.items() for field, array in load.named().items()}
    write_arrays(path, arrays, {"beams": list(loads)})


def stored_drawn_loads(path: Path) -> Mapping[str, SectionLoads]:
    """Return the content of a file of ``store_drawn_loads``. Raises FileError."""
    arrays, metadata = read_arrays(path)
    names = [field.name for field in fields(SectionLoads)]
    return {beam: SectionLoads(**{name: arrays[f"{beam}.{name}"] for name in names}) for beam in metadata["beams"]}


def draw_sections(solution: RecordedSolution, drawn: Mapping[str, SectionLoads], folder: Path) -> list[Path]:
    """Draw for each beam ``sections_NAME.png``: moments and forces along the axis at instants, and over time.

    Parameters
    ----------
    drawn : loads of ``drawn_loads``

    Raises
    ------
    FileError
        A figure cannot be written.
    """
    files, rows = [], _thinned(solution.t)
    for name, loads in drawn.items():
        panels = [(quantity, index) for quantity in _LOADS for index in _present(loads, quantity)]
        width, height = 15.0, 0.6 + 2.6 * len(panels)
        figure = new_figure((width, height), placed=True)  # panels of one size need no measured texts
        title = f"{solution.metadata.get('scene', '')}: sections of the beam {name}"
        figure.suptitle(title, fontsize=11, y=1 - 0.1 / height)
        axes = figure.subplots(len(panels), 2, sharex="col", squeeze=False)
        # inches for numbers and a label at the left, below and above
        edges = {"left": 0.95 / width, "right": 1.0 - 0.285 / width, "bottom": 0.55 / height}
        figure.subplots_adjust(**edges, top=1.0 - 0.5 / height, wspace=0.14, hspace=0.13)
        instants = np.unique(np.linspace(0, len(rows) - 1, 6).astype(int))
        at_instants = _loads_at_rows(loads, instants)
        for number, ((left, right), (quantity, index)) in enumerate(zip(axes, panels, strict=True)):
            _along(left, at_instants, quantity, index, solution.t[rows][instants], legend=number == 0)
            _over_time(right, loads, quantity, index, solution.t[rows])
        axes[-1][0].set_xlabel("x at rest, m")
        axes[-1][1].set_xlabel("time, s")
        files.append(save_figure(figure, folder / f"sections_{name}.png", "another folder, or --no-plots"))
    return files


def section_drawing(solution: LoadedSolution, folder: Path, stored: str | None = None) -> Callable[[], list[Path]]:
    """Return the function that draws the figures of ``draw_sections`` into ``folder`` and returns their paths;
    ``stored`` is a file of ``store_drawn_loads``, without which the loads are evaluated now."""
    loads = stored_drawn_loads(Path(stored)) if stored is not None else drawn_loads(solution)
    return partial(draw_sections, solution, loads, folder)


def _rows_at(solution: LoadedSolution, at: ArrayLike) -> Array:
    """Return the indices of the rows nearest to the times ``at``, s. Raises UsageError for no times, or times
    outside the solution."""
    times, t = np.atleast_1d(np.asarray(at, dtype=float)), solution.t
    if not len(times):
        hint = "times in s, or no at for a map over time"
        raise UsageError(Problem("plot_sections: at", "there are no times [E1288]", hint))
    slack = COMPUTED * (t[-1] - t[0])
    outside = times[~((times >= t[0] - slack) & (times <= t[-1] + slack))]
    if len(outside):
        fault = f"t = {outside[0]:.6g} s is outside the solution, which goes from {t[0]:.6g} s to {t[-1]:.6g} s [E1289]"
        raise UsageError(Problem("plot_sections: at", fault, "times within it"))
    rows: Array = np.abs(t[:, np.newaxis] - times).argmin(axis=0)
    return rows


def _thinned(t: Array) -> Array:
    """Return the indices of the rows of a map over time."""
    return np.unique(np.linspace(0, len(t) - 1, min(len(t), 400)).astype(int))


def _loads(solution: LoadedSolution, beam: str, rows: Array) -> tuple[str, SectionLoads]:
    """Return the name of a beam (empty: the only one) and its loads at some rows, evaluated there alone if possible.
    Raises UsageError for an unknown name, or several beams and no name."""
    result = _by_beam(solution, rows)
    if not beam and len(result) > 1:
        fault = f"the scene has {len(result)} geometrically exact beams [E1290]"
        raise UsageError(Problem("plot_sections", fault, f"the name of one: {listed(result)}"))
    name = beam or next(iter(result))
    if name not in result:
        raise UsageError(Problem("plot_sections", f"there is no beam {shown(name)} [E1291]", nearest(name, result)))
    return name, result[name]


def _by_beam(solution: LoadedSolution, rows: Array) -> Mapping[str, SectionLoads]:
    if "section_loads" not in vars(solution) and solution.model is not None:
        return solution.model.section_loads(rows_of(solution, rows), solution.multipliers[rows])
    return {name: _loads_at_rows(loads, rows) for name, loads in solution.section_loads.items()}


def rows_of(solution: LoadedSolution, rows: Array | slice) -> StateArrays:
    """Return the states at some rows."""
    return StateArrays(*(getattr(solution, name)[rows] for name in ("t", "q", "v", "a", "z")))


def _loads_at_rows(loads: SectionLoads, rows: Array) -> SectionLoads:
    return SectionLoads(**{name: part if name == "x" else part[rows] for name, part in loads.named().items()})


def _present(loads: SectionLoads, quantity: str) -> list[int]:
    """Return the components that differ from zero; the first component if none differs."""
    size = np.max(np.abs(getattr(loads, quantity)), axis=(0, 1))
    return np.flatnonzero(size > COMPUTED * np.max(size)).tolist() or [0]


def _along(axis: Any, loads: SectionLoads, quantity: str, index: int, t: Array, *, legend: bool) -> None:
    """Draw component ``index`` of a quantity over x, a curve for each row at times t: loads linear in each element,
    strains constant."""
    from matplotlib import colormaps  # noqa: PLC0415  # slow to import, and only drawing needs it

    nodes = loads.nodes
    x = np.stack([nodes[:-1], nodes[1:]], axis=1).ravel()
    colours = colormaps["viridis"](np.linspace(0.0, 0.9, len(t)))
    for row, (time, colour) in enumerate(zip(t, colours, strict=True)):
        if quantity in _LOADS:
            values = getattr(loads, f"{quantity}_at_ends")[row, :, :, index].ravel()
        else:
            values = np.repeat(getattr(loads, quantity)[row, :, index], 2)
        axis.plot(x, values, color=colour, linewidth=1.3, label=f"t = {time:.4g} s")
    names, unit = _QUANTITIES[quantity]
    axis.set_ylabel(axis_label(names[index], unit))
    axis.grid(True, color="#dddddd", linewidth=0.6)
    axis.margins(x=0.0)
    axis.ticklabel_format(axis="y", style="sci", scilimits=(-4, 5), useOffset=False)
    if legend:
        axis.legend(loc="best", fontsize=8, frameon=False)


def _over_time(axis: Any, loads: SectionLoads, quantity: str, index: int, t: Array) -> None:
    """Draw a component as a map over time and x."""
    values = getattr(loads, quantity)[..., index]
    size = float(np.max(np.abs(values))) or 1.0
    borders = np.concatenate([t[:1], 0.5 * (t[1:] + t[:-1]), t[-1:]])
    drawn = axis.pcolormesh(borders, loads.nodes, values.T, cmap="RdBu_r", vmin=-size, vmax=size, rasterized=True)
    axis.set_ylabel("x at rest, m")
    names, unit = _QUANTITIES[quantity]
    axis.figure.colorbar(drawn, ax=axis, label=axis_label(names[index], unit), pad=0.01)


#: Numbers that are held at once.
_NUMBERS = 4_000_000


def largest_section_loads(solution: LoadedSolution) -> dict[str, dict[str, dict[str, float]]]:
    """Return by beam, and by ``moment`` (N m) and ``force`` (N), a mapping of the largest ``size``, its place ``x``, m,
    and its time ``t``, s; empty without a model. Looked at are the recorded rows, and both ends of each element."""
    model = solution.model
    if model is None:
        return {}
    result: dict[str, dict[str, dict[str, float]]] = {}
    rows = max(1, _NUMBERS // (2 * max(1, solution.q.shape[1])))
    for start in range(0, len(solution.t), rows):
        part = slice(start, start + rows)
        t = solution.t[part]
        for beam, loads in model.section_loads(rows_of(solution, part), solution.multipliers[part]).items():
            for name in _LOADS:
                row, largest = _largest(loads.nodes, getattr(loads, f"{name}_at_ends"))
                if largest["size"] > result.setdefault(beam, {}).get(name, {"size": -1.0})["size"]:
                    result[beam][name] = {**largest, "t": float(t[row])}
    return result


def _largest(nodes: Array, ends: Array) -> tuple[int, dict[str, float]]:
    """Return the row of the largest moment or force at the ends of elements, (..., n, 2, 3), with its ``size`` and
    place ``x``, m."""
    sizes = np.nan_to_num(np.linalg.norm(ends, axis=-1), nan=-1.0, posinf=-1.0)
    index = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
    return int(index[0]), {"size": float(sizes[index]), "x": float(nodes[index[-2] + index[-1]])}


def beams_at_rest(
    model: CompiledModel,
    initial: Mapping[str, Any] | None,
    q: Array,
    t: float,
    p: Array,
    loads: Mapping[str, SectionLoads],
) -> dict[str, dict[str, Any]]:
    """Return by beam, as JSON types, displacements, rotations and section loads, with the largest displacement, moment
    and force.

    Parameters
    ----------
    initial : values of the initial shape that differ from the scene's
    q : (nq,), the shape at rest
    p : (np,) parameters
    loads : at rest

    Returns
    -------
    mapping
        ``x`` of the nodes, m; ``displacement``, m, and ``rotation``, a vector in rad, in world axes, (nodes, 3);
        ``moment``, N m, and ``force``, N, at both ends of each element, (n, 2, 3), in section axes; ``end``,
        ``first_section``, ``last_section``, ``largest_displacement``, ``largest_moment``, ``largest_force``
    """
    start = initial_state(model, initial, p).q
    seen = poses_and_scenery(model, np.full(2, t), np.stack([start, q]), p)
    result = {}
    for nodes in model.description.exact_beams:
        of_beam = loads[nodes[0]]
        poses, x = np.stack([seen.poses[node] for node in nodes], axis=1), of_beam.nodes
        moved = poses[1, :, 4:] - poses[0, :, 4:]
        relative = numeric.compose(SO3, poses[1, :, :4], numeric.inverse(SO3, poses[0, :, :4]))
        relative[relative[:, 0] < 0.0] *= -1.0
        turned = numeric.log(SO3, relative)
        sizes = np.linalg.norm(moved, axis=1)
        most = int(np.argmax(sizes))
        entry: dict[str, Any] = {
            "x": x.tolist(),
            "displacement": moved.tolist(),
            "rotation": turned.tolist(),
            "end": {"x": float(x[-1]), "displacement": moved[-1].tolist(), "rotation": turned[-1].tolist()},
            "largest_displacement": {"x": float(x[most]), "size": float(sizes[most])},
            "first_section": {"x": float(x[0])},
            "last_section": {"x": float(x[-1])},
        }
        for quantity, ends in (("moment", of_beam.moment_at_ends), ("force", of_beam.force_at_ends)):
            entry[quantity] = ends.tolist()
            entry[f"largest_{quantity}"] = _largest(x, ends)[1]
            entry["first_section"][quantity] = ends[0, 0].tolist()
            entry["last_section"][quantity] = ends[-1, 1].tolist()
        result[nodes[0]] = entry
    return result
