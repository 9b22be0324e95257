"""Figures of a machine's shapes: undeformed, at rest, buckled or along modes, with lines and equal axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.figures import new_figure, save_figure
from eomgen.compiled.initial_state import initial_state
from eomgen.formula.evaluate import evaluate
from eomgen.lie import numeric
from eomgen.lie.product import difference, update
from eomgen.products.pictures.beam_curves import frames_along, stations
from eomgen.results.poses import poses_and_scenery
from eomgen.system.description import BASE, WORLD

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.scene.forces.forces import Force

#: Largest displacement in a figure, relative to the size of the figure.
_SHOWN = 0.1
#: Colours of the initial shape, of the shape at rest, and of forces.
_THIN, _THICK, _LOAD = "#999999", "#0B62C4", "#C8102E"
#: Colour of roads under tyres.
_ROAD = "#6b7280"
#: Colour of shapes without a colour of their own.
_BODY = "#8fb4de"
_AXES = "xyz"


@dataclass(frozen=True)
class Arrow:
    """A force on a body: place in the frame of the body, m, and direction in world axes, N."""

    body: str
    position: Sequence[float]
    force: Sequence[float]


def arrows(loads: Sequence[Force], model: CompiledModel, p: Array) -> list[Arrow]:
    """Return arrows of forces in world axes that depend on parameters p (np,) only; forces that depend on motion or
    time are left out."""
    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    result = []
    for load in loads:
        try:
            point, force = (
                [evaluate(entry, lambda symbol: values[symbol.name]) for entry in vector]
                for vector in (load.point, load.force)
            )
        except (ArithmeticError, KeyError):
            continue
        result.append(Arrow(load.body, point, force))
    return result


def draw_rest(
    model: CompiledModel,
    q: Array,
    t: float,
    p: Array,
    path: Path,
    *,
    initial: Mapping[str, Any] | None = None,
    loads: Sequence[Arrow] = (),
) -> Path:
    """Draw a configuration q (nq,) thick over the initial one thin, with supports and ``loads``, into a figure, and
    return its path.

    Small displacements are enlarged, and the figure says by how much. Lengths are in m.

    Parameters
    ----------
    initial : values of the initial shape that differ from the scene's

    Raises
    ------
    FileError
        The figure cannot be written.
    """
    reference = initial_state(model, initial, p).q
    lines = _MachineLines(model, t, p, np.stack([reference, q]))
    factor = _enlargement(lines)
    if factor > 1.0:
        change = difference(model.factors, reference, q)
        lines = _MachineLines(model, t, p, np.stack([reference, update(model.factors, reference, factor * change)]))
    planes = _planes(lines)
    figure = new_figure((6.5 * len(planes), 5.0))
    enlarged = f"displacements {factor:.4g} times" if factor > 1.0 else "displacements to scale"
    figure.suptitle(f"{model.name} at rest, {enlarged}", fontsize=11)
    axes = np.atleast_1d(figure.subplots(1, len(planes)))
    for axis, plane in zip(axes, planes, strict=True):
        _draw(axis, lines, 0, plane, color=_THIN, linewidth=1.0, label="initial shape")
        _draw(axis, lines, 1, plane, color=_THICK, linewidth=2.4, label="at rest")
        _supports(axis, lines, plane)
        _arrows(axis, lines, loads, plane)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8, frameon=False)
    return save_figure(figure, path)


def draw_modes(
    model: CompiledModel, q: Array, t: float, p: Array, shapes: Array, titles: Sequence[str], path: Path
) -> Path:
    """Draw up to 6 motions (``shapes``, (nv, n)) about a configuration q (nq,), the largest displacement a tenth of the
    machine, under their titles, into a figure, and return its path.

    Raises
    ------
    FileError
        The figure cannot be written.
    """
    count = min(len(titles), 6)
    moved = [update(model.factors, q, sign * shapes[:, k]) for k in range(count) for sign in (1e-4, 0.0)]
    small = _MachineLines(model, t, p, np.stack(moved))
    configurations, angular = [q], [unit == "rad/s" for unit in model.v_units]
    for k in range(count):
        size = float(np.max(np.linalg.norm(small.places[2 * k] - small.places[2 * k + 1], axis=1), initial=0.0))
        scale = 1e-4 * _SHOWN * small.size / size if size > 0.0 else 0.0
        turns = np.max(np.abs(shapes[angular, k]), initial=0.0)
        scale = min(scale, 1.0 / turns) if turns > 0.0 else scale
        configurations += [update(model.factors, q, sign * scale * shapes[:, k]) for sign in (1.0, -1.0)]
    lines = _MachineLines(model, t, p, np.stack(configurations))
    columns = min(count, 3)
    figure = new_figure((5.2 * columns, 4.0 * -(-count // columns)))
    figure.suptitle(f"{model.name}: mode shapes, in the plane of each that shows most", fontsize=11)
    axes = np.atleast_1d(figure.subplots(-(-count // columns), columns)).ravel()
    for axis in axes[count:]:
        axis.remove()
    for k, axis in enumerate(axes[:count]):
        move = np.abs(lines.places[2 * k + 1] - lines.places[0])
        shown = np.sum(move, axis=0) + np.ptp(lines.places[0], axis=0)
        plane = max(combinations(range(3), 2), key=lambda pair: float(np.sum(shown[list(pair)])))
        _draw(axis, lines, 0, plane, color=_THIN, linewidth=1.0)
        _draw(axis, lines, 2 * k + 2, plane, color=_THICK, linewidth=1.0, alpha=0.35)
        _draw(axis, lines, 2 * k + 1, plane, color=_THICK, linewidth=2.2)
        _supports(axis, lines, plane)
        axis.set_title(titles[k], fontsize=9)
    return save_figure(figure, path)


class _MachineLines:
    """Lines of a machine in the world at some configurations (n, nq): axes of beams, and ties from bodies to their
    joints and springs; also roads and shapes."""

    def __init__(self, model: CompiledModel, t: float, p: Array, q: Array) -> None:
        """Collect beams, shapes, roads and lines of bodies at configurations (n, nq), with places in the world."""
        seen = poses_and_scenery(model, np.full(len(q), t), q, p)
        self.seen, self.count = seen, len(q)
        self.lines: list[Array] = []  # (n, points, 3) each
        of_beams = {node for beam in seen.scenery.get("beams", ()) for node in beam["nodes"]}
        for beam in seen.scenery.get("beams", ()):
            self.lines.append(frames_along(seen.poses, beam["nodes"])[..., 4:])
        curved = {axis["name"] for axis in seen.scenery.get("axes", ())}
        for axis in seen.scenery.get("axes", ()):
            self.lines.append(stations(axis, seen.poses[axis["name"]], q)[..., 4:])
        #: Places of roads at rest in the world, (places, 3).
        self.roads = [np.array(road["places"]) for road in seen.scenery.get("roads", ()) if "places" in road]
        #: Parts of the shapes of the scene with their vertices in the world, (n, vertices, 3).
        shapes = seen.scenery.get("shapes", ())
        self.solids = [(part, self.all_at(part["body"], part["vertices"])) for part in shapes]
        shaped = {part["body"] for part, _ in self.solids if part["whole"]}
        for body in seen.scenery["bodies"]:
            if body["name"] not in of_beams | curved | shaped:
                self.lines += [
                    np.stack([self.at(body["name"], end) for end in (body["hub"], tie)], axis=1)
                    for tie in body["links"]
                ]
        if not self.lines and not self.solids:
            self.lines = [self.at(name, [0.0, 0.0, 0.0])[:, np.newaxis] for name in model.bodies]
        #: All corners of all lines, (n, points, 3).
        self.places = np.concatenate([*self.lines, *(places for _, places in self.solids)], axis=1)
        first = self.places[0]
        self.size = float(np.max(np.ptp(first, axis=0), initial=0.0)) or 1.0

    def all_at(self, body: str, positions: Sequence[Sequence[float]]) -> Array:
        """Return places of a body in the world, (n, places, 3), m; ``positions`` are in the body's frame. A body
        without a pose counts as the world."""
        pose = self.seen.poses.get(body)
        if pose is None or body == WORLD:
            return np.tile(np.array(positions), (self.count, 1, 1))
        turned: Array = np.einsum("nij,kj->nki", numeric.rotation_matrix(pose[:, :4]), np.array(positions))
        return turned + pose[:, np.newaxis, 4:]

    def at(self, body: str, position: Sequence[float]) -> Array:
        """Return a place of a body in the world, (n, 3), m."""
        return self.all_at(body, [position])[:, 0]

    def supports(self) -> Array:
        """Return the places of supports in the world, m, (n, places, 3), at all n configurations.

        Supports are joints on the base and the world, and ends there of rods, the visible links of constraints. Free
        joints are left out.
        """
        joints = [item for item in self.seen.scenery["joints"] if item["parent"] in (BASE, WORLD)]
        result = [self.at(item["parent"], item["position"]) for item in joints if item["type"] != "free"]
        result += [
            self.at(end["body"], end["position"])
            for rod in self.seen.scenery["rods"]
            for end in rod["ends"]
            if end["body"] in (BASE, WORLD)
        ]
        return np.stack(result, axis=1) if result else np.zeros((self.count, 0, 3))


def _enlargement(lines: _MachineLines) -> float:
    """Return the magnification of displacements from the first to the second configuration: 1 if they are visible or
    zero, else 1, 2 or 5 times a power of ten."""
    moved = float(np.max(np.linalg.norm(lines.places[1] - lines.places[0], axis=1), initial=0.0))
    if not 0.0 < moved < 0.03 * lines.size:
        return 1.0
    wanted = _SHOWN * lines.size / moved
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted))


def _planes(lines: _MachineLines) -> list[tuple[int, int]]:
    """Return the planes to draw, as pairs of axis numbers: the plane of a planar machine, else (x, z) and (x, y)."""
    extents = np.ptp(lines.places.reshape(-1, 3), axis=0)
    shown = [(0, 2), (0, 1), (1, 2)]
    size = float(extents.max()) or 1.0
    flat = [plane for plane in shown if extents[3 - sum(plane)] < 1e-6 * size]
    return flat[:1] or shown[:2]


def _draw(axis: Any, lines: _MachineLines, row: int, plane: Sequence[int], label: str = "", **style: Any) -> None:
    """Draw a machine at the configuration with index ``row``, projected onto a plane (two axis numbers), with
    matplotlib's ``style`` and a label for a legend."""
    along = 3 - sum(plane)
    thin = style["color"] == _THIN
    at_rest = [bool(np.all(places == places[0])) for _, places in lines.solids]  # surfaces, drawn once and below others
    order = sorted(range(len(at_rest)), key=lambda k: (not at_rest[k], _nearness(lines.solids[k][1][row], along)))
    for k in order:
        part, places = lines.solids[k]
        if thin or not at_rest[k]:
            _fill(axis, part, places[row], plane, thin=thin and not at_rest[k], alpha=style.get("alpha", 1.0))
    if label and not lines.lines:
        axis.plot([], [], label=label, **style)
    for number, line in enumerate(lines.lines):
        x, y = line[row][:, plane[0]], line[row][:, plane[1]]
        axis.plot(x, y, label=label if number == 0 else "", solid_capstyle="round", **style)
    for road in lines.roads if style["color"] == _THIN and 2 in plane else ():
        axis.plot(road[:, plane[0]], road[:, plane[1]], color=_ROAD, linewidth=1.0)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel(f"{_AXES[plane[0]]}, m")
    axis.set_ylabel(f"{_AXES[plane[1]]}, m")
    axis.grid(True, color="#e5e5e5", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.margins(0.08)


def _nearness(places: Array, along: int) -> float:
    """Return the mean nearness of places to the viewer of a plane, who sees x to the right and z up from negative y."""
    return float(np.mean(places[:, along])) * (-1.0 if along == 1 else 1.0)


def _fill(axis: Any, part: Mapping[str, Any], places: Array, plane: Sequence[int], *, thin: bool, alpha: float) -> None:
    """Draw a part of a shape with vertices ``places`` (vertices, 3), as seen along the normal of the plane, nearest
    faces last; ``thin`` as a pale shadow."""
    from matplotlib.collections import PolyCollection  # noqa: PLC0415  # with the first figure

    along = 3 - sum(plane)
    faces = sorted(part["faces"], key=lambda face: _nearness(places[face], along))
    normals = [np.cross(places[face[1]] - places[face[0]], places[face[2]] - places[face[1]]) for face in faces]
    facing = [abs(normal[along]) / (float(np.linalg.norm(normal)) or 1.0) for normal in normals]
    rgb = np.array([int((part["color"] or _BODY)[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    colors = [_THIN if thin else tuple(rgb * (0.6 + 0.4 * light)) for light in facing]
    opacity = (0.15 if thin else 1.0) * alpha * part["opacity"]
    polygons = [places[face][:, list(plane)] for face in faces]
    edges = "none" if opacity < 1.0 else "face"
    axis.add_collection(PolyCollection(polygons, facecolors=colors, edgecolors=edges, linewidths=0.3, alpha=opacity))
    axis.plot(*places[:, list(plane)].T, alpha=0.0, linewidth=0.0)  # so that the axes reach the shape


def _supports(axis: Any, lines: _MachineLines, plane: Sequence[int]) -> None:
    places = lines.supports()[0]
    if len(places):
        axis.plot(places[:, plane[0]], places[:, plane[1]], "^", color="#222222", markersize=8, label="supports")


def _arrows(axis: Any, lines: _MachineLines, loads: Sequence[Arrow], plane: Sequence[int]) -> None:
    """Draw forces as arrows with lengths in proportion to the forces, the largest an eighth of the picture."""
    largest = max((float(np.linalg.norm(load.force)) for load in loads), default=0.0)
    for load in loads:
        head = lines.at(load.body, load.position)[-1][list(plane)]
        along = np.array(load.force)[list(plane)] / largest if largest > 0.0 else np.zeros(2)
        if np.linalg.norm(along) < 1e-3:
            continue
        tail = head - 0.125 * lines.size * along
        axis.annotate("", xy=head, xytext=tail, arrowprops={"arrowstyle": "-|>", "color": _LOAD, "linewidth": 1.6})
        axis.plot(*tail, alpha=0.0)  # so that the axes reach the arrow
        size = float(np.linalg.norm(load.force))
        axis.annotate(f"{size:.4g} N", xy=tail, color=_LOAD, fontsize=8, ha="center", va="bottom")
