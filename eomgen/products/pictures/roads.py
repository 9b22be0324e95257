"""Roads under tyres and contact surfaces in pictures: a road's profile along the path of each wheel, or around the
wheel over time if time or inputs move the road, and a surface's heights around the path of a body."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.formula.evaluate import evaluate_batch, symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.lie.numeric import rotated
from eomgen.products.pictures.solids import faces_of_grid
from eomgen.system.description import Drawing, Wheel

#: Length of a road beyond the path of its wheel by the radius, and of a surface beyond the path of a body by its size.
_BEYOND = 4.0
#: Places of a moving road around the centre of the wheel along x, by the radius.
_AROUND = np.linspace(-2.5, 2.5, 21)
_DIGITS = 6


def roads_of(
    drawing: Drawing,
    poses: Mapping[str, Array],
    t: Array,
    values: Mapping[str, float],
    inputs: Callable[[], Mapping[str, Array]],
) -> list[dict[str, Any]]:
    """Return the roads under tyres as JSON types; flat roads of parameters alone are the ground, and left out.

    A road at rest has ``places`` (n, 3) in the world. A moving one has ``heights`` (m, k), at ``times`` (m,), at
    ``along`` (k,), m, the distances from the centre of the wheel along the x axis of the world. Roads with heights that
    are not finite are left out.

    Parameters
    ----------
    drawing : wheels and points of the scene
    poses : of bodies at the times t (nt,), (nt, 7)
    values : of parameters
    inputs : callable
        Values of inputs at these times, (nt,) each.
    """
    points = {point.name: point for point in drawing.points}
    result = []
    for wheel in drawing.wheels:
        kinds = {symbol.kind for symbol in symbols(wheel.road)}
        if kinds <= {"parameter"} or points[wheel.center].body not in poses:
            continue
        numbers = _Numbers(values, inputs if "input" in kinds else dict)
        pose = poses[points[wheel.center].body]
        center = rotated(pose[:, :4], numbers.vector(points[wheel.center].position)) + pose[:, 4:]
        radius = numbers.of(wheel.radius)
        moving = bool(kinds & {"time", "input"})
        road = _moving(wheel, center, t, radius, numbers) if moving else _at_rest(wheel, center, radius, numbers)
        if all(np.isfinite(heights_of(road))):
            shared = {"name": wheel.name, "center": wheel.center, "width": 0.9 * radius}
            result.append({**shared, **road})
    return result


_GROUND = "#c2bcae"


def surfaces_of(drawing: Drawing, poses: Mapping[str, Array], values: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return the surfaces of contacts around the path of the body on each, as shapes of ``scenery.scenery``; a surface
    that moves is shown at t = 0 and zero inputs.

    Parameters
    ----------
    poses : of bodies over time, (nt, 7)
    values : of parameters
    """
    result = []
    for surface in drawing.contact_surfaces:
        numbers = _Numbers(values, dict)
        origin, axes = numbers.vector(surface.position), np.array(surface.axes)
        pose = poses[surface.rider]
        centers = rotated(pose[:, :4], numbers.vector(surface.center)) + pose[:, 4:]
        if (carrier := poses.get(surface.body)) is not None:
            centers = rotated(carrier[:, :4] * [1.0, -1.0, -1.0, -1.0], centers - carrier[:, 4:])
        path = (centers - origin) @ axes
        beyond = _BEYOND * numbers.of(surface.size)
        low, high = path[:, :2].min(axis=0) - beyond, path[:, :2].max(axis=0) + beyond
        cell = float(np.max(high - low)) / 48  # along the longer side
        x, y = (np.linspace(low[k], high[k], int(np.ceil((high[k] - low[k]) / cell)) + 1) for k in range(2))
        grid = np.meshgrid(x, y, indexing="ij")

        def value_of(symbol: Symbol, grid: Sequence[Array] = grid) -> ArrayLike:
            return grid[symbol.index] if symbol.kind == "local" else values.get(symbol.name, 0.0)

        z = np.broadcast_to(evaluate_batch(surface.height, value_of), grid[0].shape)
        faces = [face for face in faces_of_grid(*z.shape).tolist() if np.all(np.isfinite(z.flat[face]))]
        local = np.column_stack([grid[0].flat, grid[1].flat, np.where(np.isfinite(z), z, 0.0).flat])
        shape = {
            "name": surface.name,
            "body": surface.body,
            "origin": origin.tolist(),
            "color": _GROUND,
            "own": False,
            "opacity": 1.0,
            "vertices": np.round(origin + local @ axes.T, _DIGITS).tolist(),
            "faces": faces,
            "closed": False,
            "whole": False,
        }
        result.append(shape)
    return result


def heights_of(road: Mapping[str, Any]) -> list[float]:
    """Return all heights of a road, m."""
    if "places" in road:
        return [point[2] for point in road["places"]]
    return [height for row in road["heights"] for height in row]


class _Numbers:
    """Values of formulas of parameters, and heights of roads, which may also depend on inputs, times and places."""

    def __init__(self, values: Mapping[str, float], inputs: Callable[[], Mapping[str, Array]]) -> None:
        self.values, self.inputs = values, inputs()

    def of(self, formula: Formula) -> float:
        return float(evaluate_batch(formula, lambda symbol: self.values[symbol.name]))

    def vector(self, formulas: Sequence[Formula]) -> Array:
        return np.array([self.of(formula) for formula in formulas])

    def heights(self, wheel: Wheel, x: Array, y: Array, t: Array, rows: Sequence[int] | None = None) -> Array:
        """Return heights, m, of a road at places x, y and times t that broadcast; NaN for quantities without a value
        here. ``rows`` are the indices of the times among the values of inputs."""

        def value_of(symbol: Symbol) -> ArrayLike:
            match symbol.kind:
                case "position":
                    return (x, y)[symbol.index]
                case "time":
                    return t
                case "input":
                    return self.inputs[symbol.name][rows, np.newaxis] if symbol.name in self.inputs else np.nan
            return self.values.get(symbol.name, np.nan)

        shape = np.broadcast_shapes(x.shape, t.shape)
        return np.broadcast_to(evaluate_batch(wheel.road, value_of, along_motion=True), shape)


def _at_rest(wheel: Wheel, center: Array, radius: float, numbers: _Numbers) -> dict[str, Any]:
    """Return ``places`` of a road along the path of a wheel's centre (nt, 3), and beyond both ends of the path."""
    path = center[:, :2]
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    length, beyond = float(np.sum(steps)), _BEYOND * radius
    apart = max(0.125 * radius, (length + 2.0 * beyond) / 1500)
    kept = [0]
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    for row in range(1, len(path)):
        if travelled[row] - travelled[kept[-1]] >= radius:
            kept.append(row)
    kept[1:] = [*kept[1:-1], len(path) - 1] if len(kept) > 1 else []
    ends = path[kept]
    first, last = (ends[1] - ends[0], ends[-1] - ends[-2]) if len(ends) > 1 else (np.array([1.0, 0.0]),) * 2
    before = ends[0] - beyond * first / np.linalg.norm(first)
    corners = np.stack([before, *ends, ends[-1] + beyond * last / np.linalg.norm(last)])
    places = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    along = np.linspace(0.0, places[-1], max(2, int(np.ceil(places[-1] / apart)) + 1))
    x, y = (np.interp(along, places, corners[:, k]) for k in range(2))
    z = numbers.heights(wheel, x, y, np.zeros(1))
    return {"places": np.round(np.column_stack([x, y, z]), _DIGITS).tolist()}


def _moving(wheel: Wheel, center: Array, t: Array, radius: float, numbers: _Numbers) -> dict[str, Any]:
    """Return ``times``, ``along`` and ``heights`` of a road around the centre of a wheel (nt, 3), at up to 600 of the
    times t (nt,)."""
    rows = np.unique(np.linspace(0, len(t) - 1, min(len(t), 600)).round().astype(int))
    along = radius * _AROUND
    x = center[rows, 0, np.newaxis] + along
    y = np.broadcast_to(center[rows, 1, np.newaxis], x.shape)
    heights = numbers.heights(wheel, x, y, t[rows, np.newaxis], rows.tolist())
    if not any(symbol.kind == "position" for symbol in symbols(wheel.road)):
        along, heights = along[[0, -1]], heights[:, [0, -1]]
    rounded = np.round(heights, _DIGITS).tolist()
    return {"times": t[rows].tolist(), "along": np.round(along, _DIGITS).tolist(), "heights": rounded}
