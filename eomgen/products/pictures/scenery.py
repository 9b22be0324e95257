"""Scenery of a picture as plain data: links between joints, points, springs, the vertical, and for each body the
homogeneous solid of equal mass, centre and inertia; with the poses of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import NumericalError, Problem
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula, Symbol
from eomgen.products.pictures.beam_curves import EQUAL, axes_of, drawn_beams
from eomgen.products.pictures.roads import heights_of, roads_of, surfaces_of
from eomgen.products.pictures.solids import drawn_shape
from eomgen.system.description import BASE, WORLD, Description, Drawing, Line

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


#: Thinnest solid that is drawn, as part of the longest side.
THINNEST = 0.02


def equivalent_solid(mass: float, center: Array, inertia: Array) -> dict[str, Any]:
    """Return kind, sizes (m), centre and axes of the solid with this mass and inertia (3, 3) about the centre of mass.

    ``sphere`` with its radius, ``cylinder`` with radius and height along its z axis, or ``box`` with three sides, if
    all principal moments are equal, two of the moments, or none; ``point`` for a mass without inertia; ``none`` without
    mass. The rows of ``axes`` are the solid's axes in the body.
    """

    def solid(kind: str, size: Sequence[float] = (), columns: Array | None = None) -> dict[str, Any]:
        axes = np.eye(3) if columns is None else columns.T.copy()
        if np.linalg.det(axes) < 0.0:  # left-handed
            axes[1] = -axes[1]
        return {"kind": kind, "size": list(map(float, size)), "center": center.tolist(), "axes": axes.tolist()}

    if not mass > 0.0:
        return solid("none")
    moments, vectors = np.linalg.eigh(inertia)
    largest = moments[-1]
    if not largest > 0.0:
        return solid("point")
    low, high = moments[1] - moments[0] <= EQUAL * largest, moments[2] - moments[1] <= EQUAL * largest
    if low and high:
        return solid("sphere", [np.sqrt(2.5 * largest / mass)])
    if low or high:
        along, across = (0, 2) if high else (2, 0)
        radius = np.sqrt(max(2.0 * moments[along] / mass, 0.0))
        height = np.sqrt(max(12.0 * moments[across] / mass - 3.0 * radius**2, 0.0))
        size = np.maximum([radius, height], THINNEST * max(radius, height))
        return solid("cylinder", size, vectors[:, [(along + 1) % 3, (along + 2) % 3, along]])
    sides = np.sqrt(np.maximum(6.0 * (moments.sum() - 2.0 * moments) / mass, 0.0))
    return solid("box", np.maximum(sides, THINNEST * sides.max()), vectors)


def scenery_at_poses(
    model: CompiledModel,
    poses: Mapping[str, Array],
    t: Array,
    p: Array,
    inputs: Callable[[Array], Mapping[str, Array]] | None,
) -> dict[str, Any]:
    """Return all elements of a picture of a run but the poses, with roads and surfaces around the bodies, as JSON
    types.

    Parameters
    ----------
    poses : of bodies at the times t (nt,), (nt, 7)
    p : (np,) parameters
    inputs : returns the values of inputs by name at times; None without inputs
    """
    parameters = dict(zip(model.parameters, p.tolist(), strict=True))
    seen = scenery(model.description, parameters)
    values = model.description.values(parameters)
    if roads := roads_of(model.description.drawing, poses, t, values, lambda: inputs(t) if inputs else {}):
        seen["roads"] = roads
        seen.setdefault("ground", [0.0, 0.0, min(height for road in roads for height in heights_of(road))])
    for surface in surfaces_of(model.description.drawing, poses, values):
        seen["shapes"] = [*seen.get("shapes", ()), surface]
        if surface["body"] not in poses and surface["faces"]:
            lowest = min(surface["vertices"][corner][2] for face in surface["faces"] for corner in face)
            seen.setdefault("ground", [0.0, 0.0, lowest])
    axes = axes_of(model)
    return {**seen, "axes": axes} if axes else seen


def scenery(description: Description, parameters: Mapping[str, float]) -> dict[str, Any]:
    """Return the scenery at these values of the tunable parameters, as JSON types.

    Positions are in the frames of the bodies whose names are given with the positions; ``base`` and ``world`` count as
    bodies. ``links`` are the places of a body that the body's drawing ties to its frame: joints, ends of springs,
    constraints; none of a massless body in a scene with shapes.

    Raises
    ------
    NumericalError
        A mass or a place that has no finite value at these parameters.
    """
    values, drawing = description.values(parameters), description.drawing

    def vector(where: str, formulas: Sequence[Formula]) -> list[float]:
        try:
            return [evaluate(formula, lambda symbol: values[symbol.name]) for formula in formulas]
        except ArithmeticError as error:
            raise NumericalError(Problem(where, f"cannot be drawn: {error} [E1285]", "other parameters")) from None

    points: dict[str, dict[str, Any]] = {
        item.name: {"body": item.body, "position": vector(f"points.{item.name}", item.position)}
        for item in drawing.points
    }
    links: dict[str, list[list[float]]] = {
        name: [] for name in (WORLD, BASE, *(solid.name for solid in drawing.solids))
    }
    joints = _joints(drawing, vector, links)
    rods = []
    for link in drawing.links:
        ends: list[dict[str, Any]] = [
            {"body": end.body, "position": vector(f"constraints.{link.name}", end.position)}
            for end in (link.first, link.second)
        ]
        for end in ends:
            links[end["body"]].append(end["position"])
        if link.visible:
            rods.append({"name": link.name, "ends": ends})
    tyres = [
        {"name": item.name, "center": item.center, "radius": vector(f"tyres.{item.name}.radius", [item.radius])[0]}
        for item in drawing.wheels
    ]
    shown = _shown(description)
    for name in dict.fromkeys([*shown, *(end for item in drawing.lines for end in (item.first, item.second))]):
        links[points[name]["body"]].append(points[name]["position"])
    bodies, nodes = _bodies_and_nodes(description, vector, links)
    if _has_shapes(description):
        _unmark_joints_of_massless(joints, bodies, drawing)
    shapes = _shapes(drawing, vector, {body["name"]: body["solid"]["center"] for body in bodies})
    ground = vector("ground", drawing.ground)
    lengths = [sum(beam.lengths) for beam in description.element_stiffness]  # of exact beams at rest, m
    return {
        "description": description.description,
        "gravity": vector("gravity", description.gravity),
        "bodies": bodies,
        "joints": joints,
        "points": [{"name": name, **point, "trace": name in shown} for name, point in points.items()],
        "springs": [_line(item, vector) for item in drawing.lines],
        "rods": rods,
        "tyres": tyres,
        **({"shapes": shapes} if shapes else {}),
        **({"ground": ground} if ground else {}),
        **({"beams": drawn_beams(description.exact_beams, nodes, lengths)} if nodes else {}),
    }


def _bodies_and_nodes(
    description: Description, vector: Evaluated, links: Mapping[str, Sequence[list[float]]]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the bodies with their solids and links, and mass and inertia of the nodes of geometrically exact beams."""
    bodies: list[dict[str, Any]] = []
    nodes = []
    exact = set(chain.from_iterable(description.exact_beams))
    shaped = _has_shapes(description)
    for item in description.drawing.solids:
        xx, yy, zz, xy, xz, yz = vector(f"bodies.{item.name}.inertia", item.inertia)
        (mass,) = vector(f"bodies.{item.name}.mass", [item.mass])
        if item.name in exact:
            nodes.append({"name": item.name, "mass": mass, "inertia": [xx, yy, zz]})
        center = vector(f"bodies.{item.name}.center_of_mass", item.center_of_mass)
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        solid = equivalent_solid(mass, np.array(center), inertia)
        hub = center if item.hub == "center" else [0.0, 0.0, 0.0]
        ties = links[item.name] if solid["kind"] == "none" else [center, *links[item.name]]
        if solid["kind"] == "none" and shaped:
            ties = []
        bodies.append({"name": item.name, "solid": solid, "hub": hub, "links": [tie for tie in ties if tie != hub]})
    return bodies, nodes


def _joints(drawing: Drawing, vector: Evaluated, links: Mapping[str, list[list[float]]]) -> list[dict[str, Any]]:
    """Return the joints; places of joints that are drawn tied to the frames of bodies are added to ``links``."""
    joints = []
    for hinge in drawing.hinges:
        position = vector(f"joints.{hinge.name}.position", hinge.position)
        told = {key: getattr(hinge, key) for key in ("name", "type", "parent", "child", "turns", "slides")}
        joints.append({**told, "position": position, "axis": list(hinge.axis)})
        if hinge.tied:
            links[hinge.parent].append(position)
    return joints


def _unmark_joints_of_massless(
    joints: list[dict[str, Any]], bodies: Sequence[Mapping[str, Any]], drawing: Drawing
) -> None:
    """Set ``unmarked`` for joints of massless bodies that have no shape, in a scene with shapes."""
    massless = {body["name"] for body in bodies if body["solid"]["kind"] == "none"}
    bare = massless - {shape.body for shape in drawing.shapes}
    for joint in joints:
        if {joint["parent"], joint["child"]} & bare:
            joint["unmarked"] = True


def _has_shapes(description: Description) -> bool:
    """Return whether the scene has shapes of its own: next to these, lines for a massless body, as for an include's
    base, would look like parts of the machine."""
    return any(not shape.implied for shape in description.drawing.shapes)


#: From a place for messages and formulas of parameters to values.
Evaluated = Callable[[str, Sequence[Formula]], list[float]]


def _shapes(drawing: Drawing, vector: Evaluated, centers: Mapping[str, Sequence[float]]) -> list[dict[str, Any]]:
    """Return the parts of all shapes as JSON types; ``whole`` is whether a part is drawn in place of its body. Raises
    NumericalError for a size that is not above 0.

    Parameters
    ----------
    vector : evaluates formulas of parameters, given a place for messages
    centers : (3,) centre of mass of each body in the body, m
    """
    result = []
    for shape in drawing.shapes:
        where = f"shapes.{shape.name}"
        sizes, position = vector(where, shape.sizes), vector(f"{where}.position", shape.position)
        if not all(size > 0.0 or (size < 0.0 and shape.kind == "mesh") for size in sizes):
            fault = f"cannot be drawn: a size is {min(sizes):.6g} [E1286]"
            raise NumericalError(Problem(where, fault, "other parameters"))
        away = float(np.linalg.norm(np.subtract(position, centers.get(shape.body, position))))
        # a wheel that a tyre implies is drawn in place of its body if the centre of mass is near its own, and an
        # ellipsoid if it holds the centre of mass
        near = max(sizes) if shape.kind == "ellipsoid" else 0.05 * sizes[0]
        whole = not shape.implied or away <= near
        result += [{**part, "whole": whole} for part in drawn_shape(shape, sizes, position)]
    return result


def _line(line: Line, vector: Evaluated) -> dict[str, Any]:
    """Return the data of a force between two points; a bent line also with the names of the points on its path, and its
    obstacles. ``vector`` evaluates formulas."""
    where = f"tendons.{line.name}"
    obstacles = [
        {
            **{key: getattr(item, key) for key in ("after", "cylinder", "inside", "body", "side")},
            "position": vector(where, item.position),
            "axes": [list(row) for row in item.axes],
            "radius": vector(where, [item.radius])[0],
        }
        for item in line.obstacles
    ]
    straight = {"name": line.name, "first": line.first, "second": line.second, "elastic": line.elastic}
    return straight | ({"path": list(line.path), "obstacles": obstacles} if line.path else {})


def _shown(description: Description) -> list[str]:
    """Return the points whose positions are outputs, in the order of the outputs: a picture traces these points."""
    values = chain.from_iterable(output.values for output in description.outputs)
    return list(dict.fromkeys(f.name for f in values if isinstance(f, Symbol) and f.kind == "position"))
