"""What a picture of a scene shows, as plain data: solids, links between joints, points, springs, and which way is up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import NumericalError, Problem
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula, Number, Symbol
from eomgen.results.solids import equivalent_solid
from eomgen.scene.bodies.model import BASE, WORLD
from eomgen.scene.scene import Scene

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


class Seen(NamedTuple):
    """What a picture of a run needs: pose of each body (nt, 7), and what ``scenery.scenery`` says of the scene."""

    poses: Mapping[str, Array]
    scenery: Mapping[str, Any]


#: Rows that are evaluated at once.
BATCH = 8192


def seen(model: CompiledModel, t: Array, q: Array, p: Array) -> Seen:
    """Return the poses of all bodies, and of the base where it moves, with what else a picture shows."""
    parts = [slice(start, start + BATCH) for start in range(0, len(t), BATCH)]
    pose = np.concatenate([model.evaluate("poses", q[part], t=t[part], parameters=p)["pose"] for part in parts])
    poses = {name: pose[:, index] for index, name in enumerate(model.bodies)}
    if "base" in model.functions:
        poses[BASE] = np.concatenate([model.base(t[part], parameters=p)[:, :7] for part in parts])
    return Seen(poses, scenery(model.scene, dict(zip(model.parameters, p.tolist(), strict=True))))


def scenery(scene: Scene, parameters: Mapping[str, float]) -> dict[str, Any]:
    """Return what is to be seen of a scene at these values of its tunable parameters, as JSON types.

    Positions are in the frames of the bodies that are named beside them; ``base`` and ``world`` count as bodies. ``links`` are
    the places of a body that its drawing ties to its frame: joints, ends of springs, constraints.

    Raises
    ------
    NumericalError
        A mass or a place that has no finite value at these parameters.
    """
    values = {item.name: parameters.get(item.name, item.value) for item in scene.parameters}

    def number(where: str, formula: Formula) -> float:
        def value_of(symbol: Symbol) -> float:
            return values[symbol.name]

        try:
            return evaluate(formula, value_of)
        except ArithmeticError as error:
            raise NumericalError(Problem(where, f"cannot be drawn: {error}", "other parameters")) from None

    def place(where: str, formulas: Sequence[Formula]) -> list[float]:
        return [number(where, formula) for formula in formulas]

    points: dict[str, dict[str, Any]] = {
        item.name: {"body": item.body, "position": place(f"points.{item.name}", item.position)} for item in scene.points
    }  # fmt: skip
    links: dict[str, list[list[float]]] = {name: [] for name in (WORLD, BASE, *(body.name for body in scene.bodies))}
    joints = []
    for joint in scene.joints:
        position = place(f"joints.{joint.name}.position", joint.position)
        turns, slides = joint.kind.drawn
        joints.append(
            {"name": joint.name, "type": joint.type, "parent": joint.parent, "child": joint.child, "position": position,
             "axis": list(joint.axis), "turns": turns, "slides": slides}
        )  # fmt: skip
        if joint.kind.group != "SE3":
            links[joint.parent].append(position)
    rods = []
    for constraint in scene.constraints:
        where = f"constraints.{constraint.name}"
        ends: list[dict[str, Any]] = [
            {"body": frame.body, "position": place(where, frame.position)} for frame in (constraint.first, constraint.second)
        ]
        for end in ends:
            links[end["body"]].append(end["position"])
        if constraint.kind.rod:
            rods.append({"name": constraint.name, "ends": ends})
    springs = [
        {"name": item.name, "first": item.first, "second": item.second, "elastic": item.stiffness != Number(0.0)}
        for item in scene.springs
    ]
    tyres = [
        {"name": item.name, "center": item.center, "radius": number(f"tyres.{item.name}.radius", item.radius)}
        for item in scene.tyres
    ]
    shown = _shown(scene)
    for name in dict.fromkeys([*shown, *(end for item in scene.springs for end in (item.first, item.second))]):
        links[points[name]["body"]].append(points[name]["position"])
    carried = {joint.child: joint.kind.group for joint in scene.joints}
    bodies = []
    for body in scene.bodies:
        xx, yy, zz, xy, xz, yz = place(f"bodies.{body.name}.inertia", body.inertia)
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        center = np.array(place(f"bodies.{body.name}.center_of_mass", body.center_of_mass))
        solid = equivalent_solid(number(f"bodies.{body.name}.mass", body.mass), center, tensor)
        hub = center.tolist() if carried[body.name] == "SE3" else [0.0, 0.0, 0.0]
        places = [hub, *links[body.name]] if solid["kind"] == "none" else [center.tolist(), *links[body.name]]
        ties = [place for place in places if place != hub]
        bodies.append({"name": body.name, "solid": solid, "hub": hub, "links": ties})
    return {
        "description": scene.description,
        "gravity": place("gravity", scene.gravity),
        "bodies": bodies,
        "joints": joints,
        "points": [{"name": name, **item, "trace": name in shown} for name, item in points.items()],
        "springs": springs,
        "rods": rods,
        "tyres": tyres,
    }


def _shown(scene: Scene) -> list[str]:
    """Return the points whose positions are outputs, in the order of the outputs: a picture traces them."""
    names = [
        formula.name
        for output in scene.outputs
        for formula in output.values
        if isinstance(formula, Symbol) and formula.kind == "position"
    ]
    return list(dict.fromkeys(names))
