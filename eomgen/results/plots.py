"""Plots of a solution over time: coordinates, velocities, outputs and energies, as PNG or on the axes of a caller."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.figures import axes_of_caller, axis_label, new_figure, place_panels, pyplot_figure, save_figure
from eomgen.base.messages import listed, nearest, shown
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.errors import Problem, UsageError
from eomgen.lie import numeric
from eomgen.lie.groups import SO3
from eomgen.results.recorded import RecordedSolution
from eomgen.system.description import component_names

if TYPE_CHECKING:
    from eomgen.results.events import Events

#: Panels in one figure, points of one curve: above these numbers curves cannot be distinguished.
_PANELS, _POINTS = 24, 4000
#: Kinds of curves that a run draws into files.
_DRAWN = ("coordinates", "velocities", "states", "outputs", "energy")
#: Words of the name of a curve: of an included file, of an output, of a component.
_WORDS = re.compile(r"[_ \[]")
#: Quantities by unit, as far as the unit alone determines the quantity; coordinates of joints and bodies say more.
_QUANTITIES = {
    "rad": "angle", "deg": "angle", "m": "length", "mm": "length", "rad/s": "angular velocity", "m/s": "velocity",
    "rad/s^2": "angular acceleration", "m/s^2": "acceleration", "N": "force", "N m": "torque", "J": "energy",
    "W": "power",
}  # fmt: skip  # a table
_COORDINATES = {"m": "position", "1": "quaternion"}
#: Components of the pose or the twist of a beam's node; only names of such components have numbers after a dot.
_NODE = re.compile(r"[qv]\.(\w+)\.(\d+)\[[0-6]\]")
#: Copies of a state whose samples arrive with a delay; see ``scene/signals/sampling.py``.
_COPY = re.compile(r"(.+)_sampled(?:_\d+)?")
#: Kinds of curves by the letters of their columns; curves of these names come first.
_LETTERS = {"q": "coordinates", "v": "velocities", "a": "accelerations", "z": "states", "u": "inputs"}
#: Colours of clearly different hue; the later three are dashed as well, for colour-blind eyes and grey paper.
_COLOURS = ("#0B62C4", "#F08C00", "#1A9850", "#C8102E", "#E052C8", "#222222")
#: Curves in one panel.
_CURVES = len(_COLOURS)
#: Rotation, rad, below which rotation vectors are drawn in place of quaternions, and above which an angle is one of a
#: wheel or a rotor.
_TURNED = 3.0
#: Powers in legends.
_POWERS = {"power": "power of forces", "base_power": "power that moves base and drives"}


@dataclass(frozen=True)
class PlottedCurve:
    """One component over time.

    Attributes
    ----------
    name, unit, values : of the column, values (nt,)
    quantity : physical quantity, such as ``position``; empty if the unit says enough
    output, description : name and description of the output to which the component belongs; empty for others
    """

    name: str
    unit: str
    values: Array
    quantity: str = ""
    output: str = ""
    description: str = ""


def draw(solution: RecordedSolution, folder: Path) -> list[Path]:
    """Draw ``coordinates.png``, ``velocities.png``; ``states.png``, ``outputs.png``, ``energy.png`` if there are any.

    Raises
    ------
    FileError
        A figure cannot be written.
    """
    return [file for drawing in drawings(solution, folder) for file in drawing()]


def drawings(solution: RecordedSolution, folder: Path) -> list[Callable[[], list[Path]]]:
    """Return the calls of ``draw``, each of which draws one file."""
    kinds = {kind: curves for kind, curves in _by_kind(solution).items() if kind in _DRAWN and curves}
    return [partial(_draw, solution, folder, kind, curves) for kind, curves in kinds.items()]


def _draw(solution: RecordedSolution, folder: Path, kind: str, curves: list[PlottedCurve]) -> list[Path]:
    """Draw the curves of a kind (``coordinates``, ``states`` ...) in the file of the kind, and return its path in a
    list. Poses of beam nodes and small rotations are drawn as displacements and rotation vectors; curves beyond the
    largest number of panels are left out."""
    if kind == "coordinates":
        curves = _rotations(_nodes_as_displacements(curves))
    elif kind == "velocities":
        curves = [curve for part in _by_nodes(curves) for curve in part]
    elif kind == "states":
        curves = _without_copies(curves)
    panels = _panels(curves)
    hidden = sum(len(panel) for panel in panels[_PANELS:])
    heading = f"{solution.metadata.get('scene', '')}: {kind}"
    heading += f" (the first {len(curves) - hidden} of {len(curves)})" if hidden else ""
    figure = _figure(solution, panels[:_PANELS], None, heading + _marks(solution.events))
    return [save_figure(figure, folder / f"{kind}.png", "another folder, or --no-plots")]


def draw_over(solution: RecordedSolution, folder: Path, over: str) -> list[Path]:
    """Draw ``outputs_over.png``: the outputs, or else the coordinates, over another column.

    Raises
    ------
    UsageError
        No column of that name, or several.
    FileError
        The figure cannot be written.
    """
    abscissa = only_curve(solution, over, "--over")
    panels = _panels(_curves_over(solution, (), abscissa))
    figure = _figure(solution, panels[:_PANELS], abscissa, _heading(solution, abscissa))
    return [save_figure(figure, folder / "outputs_over.png", "another folder, or --no-plots")]


def draw_chosen(solution: RecordedSolution, names: Sequence[str], over: str | None, folder: Path) -> Path:
    """Draw curves over time, or over another column, in one file that is named after the columns.

    Parameters
    ----------
    names : of columns or kinds of columns; without any the outputs, or else the coordinates
    over : column of the abscissa; None for the time

    Raises
    ------
    UsageError
        A name that is none of a curve, several for ``over``, or more panels than a figure has.
    FileError
        The figure cannot be written.
    """
    abscissa = None if over is None else only_curve(solution, over, "--over")
    figure = _figure(solution, _chosen_panels(solution, names, abscissa), abscissa, _heading(solution, abscissa))
    words = [*(names or ["outputs"]), *([] if over is None else ["over", over])]
    file = re.sub(r"[^A-Za-z0-9.-]+", "_", "_".join(words))[:80].strip("_.")
    return save_figure(figure, folder / f"{file}.png")


def _figure(
    solution: RecordedSolution, panels: Sequence[Sequence[PlottedCurve]], abscissa: PlottedCurve | None, heading: str
) -> Any:
    """Return a figure of panels for a file, over time or over the curve `abscissa`, with a heading."""
    figure = new_figure(_size(len(panels)), placed=True)
    axes = _subplots(figure, len(panels))
    _fill(axes, solution, panels, abscissa)
    place_panels(figure, axes, _columns(len(panels)), 2.3, heading)
    return figure


def _heading(solution: RecordedSolution, abscissa: PlottedCurve | None) -> str:
    """Return the name of the scene, with marked events or the abscissa, as the heading of a figure."""
    title = f"{solution.metadata.get('scene', '')}"
    return title + (_marks(solution.events) if abscissa is None else f": over {abscissa.name}")


def _chosen_panels(
    solution: RecordedSolution, names: Sequence[str], abscissa: PlottedCurve | None
) -> list[list[PlottedCurve]]:
    """Return the panels of the curves that names mean, without the abscissa. Raises UsageError if no curve is left, and
    for too many panels."""
    curves = _curves_over(solution, names, abscissa)
    panels = _panels(curves)
    if len(panels) > _PANELS:
        fault = f"{len(curves)} curves need {len(panels)} panels, and a figure has {_PANELS} [E1270]"
        raise UsageError(Problem("plot", fault, f"fewer names: one of {listed(_by_kind(solution))}, or of components"))
    return panels


def _curves_over(solution: RecordedSolution, names: Sequence[str], abscissa: PlottedCurve | None) -> list[PlottedCurve]:
    """Return the curves that names mean, to be drawn over an abscissa, or over time for None. Raises UsageError without
    curves."""
    curves = [curve for curve in chosen_curves(solution, names) if not abscissa or curve.name != abscissa.name]
    if not curves:
        fault = f"no column is left to draw over {abscissa.name if abscissa else 't'} [E1269]"
        raise UsageError(Problem("plot", fault, "another name"))
    return curves


def _nodes_as_displacements(curves: Sequence[PlottedCurve]) -> list[PlottedCurve]:
    """Replace the poses of beam nodes by displacements (m) and rotation vectors (rad) since the start, in world axes,
    for the middle and the last node of each beam."""
    kept, *nodes = _by_nodes(curves)
    for node in nodes:
        poses = np.stack([curve.values for curve in node], axis=1)
        moved = (poses - poses[0])[:, 4:]
        name = node[0].name.removeprefix("q.").partition("[")[0]
        kept += [
            *_vector(name, "m", moved, "displacement"),
            *_vector(name, "rad", _rotation_vectors(poses[:, :4]), "rotation"),
        ]
    return kept


def _rotation_vectors(quaternions: Array) -> Array:
    """Return the rotation vectors since the first of quaternions (nt, 4), (nt, 3)."""
    turned = numeric.compose(SO3, quaternions, numeric.inverse(SO3, quaternions[:1]))
    turned[turned[:, 0] < 0.0] *= -1.0
    return numeric.log(SO3, turned)


def _vector(name: str, unit: str, values: Array, quantity: str) -> list[PlottedCurve]:
    """Return curves of the components of a vector since the start, (nt, 3)."""
    columns = zip("xyz", values.T, strict=True)
    return [PlottedCurve(f"{name} {axis}", unit, column, f"{quantity} since the start") for axis, column in columns]


def _rotations(curves: Sequence[PlottedCurve]) -> list[PlottedCurve]:
    """Return curves with rotation vectors since the start, rad, in the axes of the joint, in place of quaternions that
    turn by less than half a turn; longer rotation vectors jump."""
    quaternions: dict[str, list[PlottedCurve]] = {}
    for curve in curves:
        if curve.quantity == _COORDINATES["1"]:
            quaternions.setdefault(curve.name.partition("[")[0], []).append(curve)
    replaced: dict[int, list[PlottedCurve]] = {}  # by identity: a net of 10 000 knots has 70 000 curves
    for name, parts in quaternions.items():
        if len(parts) != len("wxyz"):
            continue
        vectors = _rotation_vectors(np.stack([part.values for part in parts], axis=1))
        steps = np.diff(vectors, axis=0)
        if max(np.linalg.norm(part, axis=1).max(initial=0.0) for part in (vectors, steps)) < _TURNED:
            replaced |= {id(part): [] for part in parts}
            replaced[id(parts[0])] = _vector(name, "rad", vectors, "rotation")
    return [drawn for curve in curves for drawn in replaced.get(id(curve), [curve])]


def _without_copies(curves: Sequence[PlottedCurve]) -> list[PlottedCurve]:
    """Return curves without the sampled copies from which delayed states take their values."""
    names = {curve.name for curve in curves}
    copies = ((curve, _COPY.fullmatch(curve.name)) for curve in curves)
    return [curve for curve, copy in copies if copy is None or copy[1] not in names]


def _by_nodes(curves: Sequence[PlottedCurve]) -> list[list[PlottedCurve]]:
    """Return first the curves of all quantities other than beam nodes, then the curves of each beam's middle and last
    node."""
    nodes: dict[str, dict[int, list[PlottedCurve]]] = {}
    parts: list[list[PlottedCurve]] = [[]]
    for curve in curves:
        node = _NODE.fullmatch(curve.name)
        if node is None:
            parts[0].append(curve)
        else:
            nodes.setdefault(node[1], {}).setdefault(int(node[2]), []).append(curve)
    for by_number in nodes.values():
        parts += [by_number[number] for number in sorted({max(by_number), (max(by_number) + 1) // 2})]
    return parts


def plot(solution: RecordedSolution, names: Sequence[str], axes: object = None, over: str | None = None) -> list[Any]:
    """Draw curves of a solution on new axes of pyplot or on a caller's, and return the axes; see ``Solution.plot``."""
    abscissa = None if over is None else only_curve(solution, over, "plot over")
    if axes is not None:
        panels = _panels(_curves_over(solution, names, abscissa))
        caller_axes = axes_of_caller("plot", axes, [listed(curve.name for curve in panel) for panel in panels])
        _fill(caller_axes, solution, panels, abscissa, beside=False)
        return caller_axes
    panels = _chosen_panels(solution, names, abscissa)
    figure = pyplot_figure(_size(len(panels)))
    drawn = _subplots(figure, len(panels))
    _fill(drawn, solution, panels, abscissa)
    if abscissa is None and (marks := _marks(solution.events)):
        figure.suptitle(marks.removeprefix("; "), fontsize=11)
    return drawn


def chosen_curves(solution: RecordedSolution, names: Sequence[str], asked_by: str = "plot") -> list[PlottedCurve]:
    """Return the curves that names mean; without names the outputs, or else the coordinates.

    ``asked_by`` begins messages.
    """
    kinds = {kind: curves for kind, curves in _by_kind(solution).items() if curves}
    if not names:
        return kinds.get("outputs") or kinds.get("coordinates") or []
    chosen: list[PlottedCurve] = []
    for name in names:
        matching = kinds.get(name) or [
            curve
            for curves in kinds.values()
            for curve in curves
            if name in (curve.name, f"output.{curve.name}", f"input.{curve.name}")
            or (curve.output and name in (curve.output, f"output.{curve.output}"))
            or curve.name.startswith(f"{name}[")
        ]
        matching = matching or kinds.get(_LETTERS.get(name, ""), [])
        if not matching:
            raise _no_curve(name, kinds, asked_by)
        chosen += matching
    return list({id(curve): curve for curve in chosen}.values())


def _no_curve(name: str, kinds: Mapping[str, Sequence[PlottedCurve]], asked_by: str) -> UsageError:
    """Return the error for a name without a curve, with the nearest known names; `asked_by` names the call."""
    curves, output = [curve for group in kinds.values() for curve in group], str(name).partition("[")[0]
    known = [*kinds, *dict.fromkeys(curve.output or curve.name for curve in curves)]
    of_output = " or ".join(curve.name for curve in curves if curve.output == output)
    fault = f"the solution has no curve {shown(name)} [E1271]"
    return UsageError(Problem(asked_by, fault, of_output or nearest(str(name), known)))


def rows_from(t: Array, start: float | None, asked_by: str) -> NDArray[np.bool_]:
    """Return the mask (nt,) of rows from a time on; of all rows without a time. Raises UsageError for no time in s."""
    if not (start is None or isinstance(start, int | float | np.number)):
        fault = f"a time in s is needed, not {shown(start)} [E1272]"
        raise UsageError(Problem(f"{asked_by}: start", fault, "start=5.0"))
    return np.asarray(t >= (-np.inf if start is None else float(start)))


def only_curve(solution: RecordedSolution, name: str, asked_by: str) -> PlottedCurve:
    """Return the one curve that a name means, energies without an offset.

    Raises
    ------
    UsageError
        No curve of that name, or several.
    """
    if not isinstance(name, str):
        fault = f"the name of one column is needed, not {shown(name)} [E1273]"
        raise UsageError(Problem(asked_by, fault, f'solution.{asked_by}("tip[2]"), and a call for each column'))
    curves = chosen_curves(solution, [name], asked_by)
    if len(curves) != 1:
        fault = f"{ascii(name)[:64]} are {len(curves)} columns, and {asked_by} takes one [E1274]"
        raise UsageError(Problem(asked_by, fault, f"one of {listed([curve.name for curve in curves][:6])}"))
    known = solution.energy.get(curves[0].name) if not curves[0].output else None
    return curves[0] if known is None else replace(curves[0], values=known, quantity="")


def _by_kind(solution: RecordedSolution) -> dict[str, list[PlottedCurve]]:
    """Return all curves of a solution by kind: coordinates, velocities, accelerations, states, inputs, outputs and
    energy."""
    names, units = solution.metadata.get("names", {}), solution.metadata.get("units", {})
    of_columns = solution.units()
    accelerated = [of_columns.get(name, "") for name in names.get("a", [])]
    return {
        "coordinates": _curves(solution.q, names.get("q", []), units.get("q", []), _COORDINATES),
        "velocities": _curves(solution.v, names.get("v", []), units.get("v", [])),
        "accelerations": _curves(solution.a, names.get("a", []), accelerated),
        "states": _curves(solution.z, names.get("z", []), units.get("z", [])),
        "inputs": [
            PlottedCurve(name, of_columns.get(f"input.{name}", ""), values) for name, values in solution.inputs.items()
        ],
        "outputs": _outputs(solution, units.get("outputs", {})),
        "energy": _energies(solution),
    }


def _curves(
    table: Array, names: Sequence[str], units: Sequence[str], quantities: Mapping[str, str] | None = None
) -> list[PlottedCurve]:
    known = quantities or {}
    columns = zip(names, units, table.T, strict=True)
    return [PlottedCurve(name, unit, values, known.get(unit, "")) for name, unit, values in columns]


def _energies(solution: RecordedSolution) -> list[PlottedCurve]:
    """Return curves of energies and of powers that are not zero; energies as changes from the start if a large constant
    part would make them look flat."""
    powers = [
        PlottedCurve(text, "W", solution.energy[name])
        for name, text in _POWERS.items()
        if np.any(solution.energy.get(name, 0.0))
    ]
    energies = {name: values for name, values in solution.energy.items() if "power" not in name}
    if not any(map(len, energies.values())):
        return powers
    table = np.stack(list(energies.values()))
    change, size = np.ptp(table, axis=1).max(initial=0.0), max(np.abs(table).max(initial=0.0), np.ptp(table))
    if 1e-9 * size < change < 0.2 * size:
        changed = "change of energy from the start"
        return [PlottedCurve(name, "J", part - part[0], changed) for name, part in energies.items()] + powers
    return [PlottedCurve(name, "J", values) for name, values in energies.items()] + powers


def _outputs(solution: RecordedSolution, units: dict[str, str]) -> list[PlottedCurve]:
    """Return a curve for each component of the outputs of a solution."""
    meaning = solution.metadata.get("outputs", {})
    curves = []
    for name, array in solution.outputs.items():
        table = array[:, np.newaxis] if array.ndim == 1 else array
        labels = component_names("", name, table.shape[1])
        told = meaning.get(name, {})
        words = told.get("quantity", ""), name, told.get("description", "")
        unit, columns = units.get(name, ""), zip(labels, table.T, strict=True)
        curves += [PlottedCurve(label, unit, column, *words) for label, column in columns]
    return curves


def _panels(curves: Sequence[PlottedCurve]) -> list[list[PlottedCurve]]:
    """Group curves by unit and quantity, then by the first words of their names, in as few panels as the limit of
    curves per panel allows; groups that fit into a panel, as all curves of one output, are not cut."""
    alike: dict[tuple[str, str], list[PlottedCurve]] = {}
    for curve in _with_small_changes(curves):
        alike.setdefault((curve.unit, curve.quantity or _QUANTITIES.get(curve.unit, "")), []).append(curve)
    return [panel for group in alike.values() for panel in _pack(group)]


def _pack(curves: Sequence[PlottedCurve], words: int = 1) -> list[list[PlottedCurve]]:
    """Return panels of curves with the same unit; curves whose names have the same first words are together, if they
    fit. `words` is the number of first words that are compared; larger families are divided by one word more."""
    families: dict[tuple[str, ...], list[PlottedCurve]] = {}
    for curve in curves:
        families.setdefault(tuple(_WORDS.split(curve.name)[:words]), []).append(curve)
    panels: list[list[PlottedCurve]] = []
    fitting: list[list[PlottedCurve]] = []
    for family in families.values():
        if len(family) <= _CURVES:
            fitting.append(family)
        else:
            panels += _pack(family, words + 1)
    total = sum(map(len, fitting))
    even = -(-total // max(1, -(-total // _CURVES)))
    filled = [_fill_panels(fitting, limit) for limit in range(even, _CURVES + 1)]
    return min(filled, key=len, default=[]) + panels  # the first, so the most even, of equally many panels


def _fill_panels(families: Sequence[list[PlottedCurve]], limit: int) -> list[list[PlottedCurve]]:
    """Return families in panels, in order, with up to ``limit`` curves or one larger family in each."""
    panels: list[list[PlottedCurve]] = []
    for family in families:
        if panels and len(panels[-1]) + len(family) <= limit:
            panels[-1] = panels[-1] + family
        else:
            panels.append(family)
    return panels


def _with_small_changes(curves: Sequence[PlottedCurve]) -> list[PlottedCurve]:
    """Return curves in which positions that hardly change, compared with others, are changes from the start, and angles
    that hardly change, as of hinges next to wheels that roll, have a quantity of their own."""
    result = list(curves)
    for unit, quantity in (("m", "position"), ("rad", "")):
        changes = {
            number: float(np.ptp(curve.values))
            for number, curve in enumerate(curves)
            if curve.unit == unit and curve.quantity == quantity and len(curve.values)
        }
        large = max(changes.values(), default=0.0)
        # as heights of a car that drives away
        small = [number for number, change in changes.items() if change < large / 30.0]
        if not any(changes[number] > SUMMED for number in small) or (unit == "rad" and large < _TURNED):
            continue
        for number in small:
            curve, first = curves[number], 0.0 if unit == "rad" else curves[number].values[0]
            named = "small angle" if unit == "rad" else "change of position from the start"
            result[number] = replace(curve, values=curve.values - first, quantity=named)
    return result


def _size(panels: int) -> tuple[float, float]:
    """Return the width and the height of a figure with the given number of panels, inches."""
    columns = _columns(panels)
    return 9.0 if columns == 1 else 15.0, 0.6 + 2.9 * -(-panels // columns)


def _columns(panels: int) -> int:
    return 1 if panels <= 3 else 2


def _subplots(figure: Any, panels: int) -> list[Any]:
    """Return the axes of a new grid in a figure, one for each panel; they share the horizontal axis, which is labelled
    under the lowest panel of each column."""
    columns = _columns(panels)
    axes = list(np.atleast_1d(figure.subplots(-(-panels // columns), columns, sharex=True, squeeze=False)).ravel())
    for axis in axes[panels:]:
        axis.set_visible(False)
    for axis in axes[: max(0, panels - columns)]:
        axis.tick_params(labelbottom=False)
    for axis in axes[max(0, panels - columns) : panels]:
        axis.tick_params(labelbottom=True)
    return axes[:panels]


def _fill(
    axes: Sequence[Any],
    solution: RecordedSolution,
    panels: Sequence[Sequence[PlottedCurve]],
    abscissa: PlottedCurve | None = None,
    *,
    beside: bool = True,
) -> None:
    """Draw panels on axes, one panel on each, with legends next to the axes or, if a caller made the room, within.

    Parameters
    ----------
    abscissa : curve over which the panels are drawn; None for the time, with lines at events
    """
    label = "time, s"
    if abscissa is not None:
        words = f": {abscissa.description}" if abscissa.description else ""
        label = axis_label(f"{abscissa.name}{words}", abscissa.unit)
    for axis, panel in zip(axes, panels, strict=True):
        _panel(axis, solution.t if abscissa is None else abscissa.values, panel, beside=beside)
        for time in _marked_times(solution.events) if abscissa is None else ():
            axis.axvline(time, color="#888888", linewidth=0.7, linestyle=":", zorder=0.5)
        if axis.xaxis.get_tick_params()["labelbottom"]:
            axis.set_xlabel(label)
    for figure in {axis.figure for axis in axes}:
        figure.align_ylabels([axis for axis in axes if axis.figure is figure])


def _marks(events: Events) -> str:
    """Return the part of the title on the lines that mark events."""
    return f"; dotted: {listed(dict.fromkeys(events.names))}" if len(_marked_times(events)) else ""


def _marked_times(events: Events) -> Array:
    """Return the times of events that are drawn; none if the events are too many to be distinguished."""
    # more lines would be a surface
    return np.empty(0) if len(events) > 200 else np.unique(events.t)


def _turns(values: Array) -> int:
    """Return the number of turning points of a curve."""
    changes = np.diff(values)
    signs = np.sign(changes[changes != 0.0])
    return int(np.count_nonzero(signs[1:] != signs[:-1]))


def _panel(axis: Any, t: Array, panel: Sequence[PlottedCurve], *, beside: bool = True) -> None:
    """Draw the curves of a panel over t (nt,) on one axis, with labels, limits and a legend at the right, or within the
    panel if a caller made the axis."""
    outputs = {curve.output: curve.description for curve in panel}
    alone = len(outputs) == 1
    size = max((float(np.ptp(curve.values)) for curve in panel if len(curve.values)), default=0.0)
    for number, (curve, colour) in enumerate(zip(panel, _COLOURS, strict=False)):
        meant = "" if alone or (curve.name.endswith("]") and not curve.name.endswith("[0]")) else curve.description
        hidden = _equal(curve, panel[:number], size)
        words = (f"{curve.name}: {meant}" if meant else curve.name) + (f" (equal to {hidden})" if hidden else "")
        label = textwrap.fill(words, 34)
        style = "--" if number >= _CURVES // 2 else "-"
        # a curve of many turns would hide others as a block
        look = {"linewidth": 0.5, "zorder": 1.9} if _turns(curve.values) > 150 else {"linewidth": 1.3}
        axis.plot(*_thin(t, curve.values), label=label, color=colour, linestyle=style, **look)
    axis.set_ylabel(_label(panel, alone))
    if alone and panel[0].description:
        axis.set_title(panel[0].description, fontsize=10, loc="left")
    axis.grid(True, color="#dddddd", linewidth=0.6)
    axis.margins(x=0.0)
    low, high = axis.get_ylim()
    # the drift of energies by the method is drawn flat, too
    least = max(SUMMED, (1e-4 if panel[0].unit == "J" else COMPUTED) * max(abs(low), abs(high)))
    if high - low < least:
        axis.set_ylim(0.5 * (low + high - least), 0.5 * (low + high + least))
    axis.ticklabel_format(axis="y", style="sci", scilimits=(-4, 5), useOffset=False)
    legend: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0)} if beside else {"loc": "best"}
    axis.legend(**legend, borderaxespad=0.0 if beside else 0.5, frameon=not beside, fontsize=9)


def _equal(curve: PlottedCurve, drawn: Sequence[PlottedCurve], size: float) -> str:
    """Return the name of a drawn curve that is equal to this curve within the width of a line; empty if there is none,
    or if the curve is flat.

    Parameters
    ----------
    size : height of the panel in its unit
    """
    ptp = float(np.ptp(curve.values)) if len(curve.values) else 0.0
    line = 2e-3  # width of a line as a part of the height of a panel
    if ptp <= line * size:
        return ""
    return next((old.name for old in drawn if float(np.max(np.abs(old.values - curve.values))) <= line * ptp), "")


def _label(panel: Sequence[PlottedCurve], alone: bool) -> str:
    """Return the quantity of a panel, drawn above the unit: the known quantity, else the name if the panel has one
    curve."""
    first = panel[0]
    named = (first.output or (first.name if len(panel) == 1 else "")) if alone else ""
    quantity = first.quantity or named or _QUANTITIES.get(first.unit, "") or "value"
    return axis_label(quantity, first.unit)


def _thin(t: Array, values: Array) -> tuple[Array, Array]:
    """Return times and values of fewer points that look the same: the smallest and the largest value of every bin. All
    points if they are few; every n-th point if t does not increase."""
    if len(t) <= 2 * _POINTS:
        return t, values
    size = -(-len(t) // _POINTS)
    if np.any(np.diff(t) < 0.0):  # over another quantity than the time
        return t[::size], values[::size]
    whole = len(t) // size * size
    bins = values[:whole].reshape(-1, size)
    ends = np.stack([bins.argmin(axis=1), bins.argmax(axis=1)], axis=1)
    chosen = (np.sort(ends, axis=1) + np.arange(len(bins))[:, np.newaxis] * size).ravel()
    chosen = np.unique(np.concatenate([[0], chosen, [len(t) - 1]]))
    return t[chosen], values[chosen]
