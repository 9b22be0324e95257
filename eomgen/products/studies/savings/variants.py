"""Variants of a scene that ask for more: the same motion, of equations that are fit for others as well."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Node, Number, Operation, Symbol
from eomgen.scene.bodies.model import Base
from eomgen.scene.reading.rotations import Rotation
from eomgen.scene.scene import Scene
from eomgen.system.signals import Parameter
from eomgen.system.terms import CLOSED_MATRICES, TERMS

#: Amplitude of a base that could move in all ways, m and rad: no number of the motion depends on it.
TREMBLING = 1e-100


@dataclass(frozen=True)
class Variant:
    """A scene that asks for more, or for less.

    Attributes
    ----------
    name, what : its name, and its description
    terms : None: by default
    start : of runs, if it has only the functions that these call
    problem : reason for which the scene cannot be made, if it is None
    """

    name: str
    what: str
    scene: Scene | None
    terms: tuple[str, ...] | None = None
    start: str = ""
    problem: str = ""


def variants(scene: Scene, of_step: tuple[str, ...], absolute: Scene | str | None) -> tuple[Variant, ...]:
    """Return the scene as it is asked, with less, with more of one kind each, and with all of these.

    Parameters
    ----------
    of_step : terms that a step of the method calls
    absolute : the scene in absolute coordinates, or why it has none; None if they are its own
    """
    made = [
        Variant("as asked", "the scene as it is", scene),
        Variant(
            "a run",
            "only the functions that a run calls, as eomgen simulate builds it",
            scene,
            start=scene.simulation.start,
        ),
        Variant("terms of a step", "only the terms that the stepper calls", scene, of_step),
        Variant("all terms", "every term that the scene can have, with two time derivatives", scene, ALL_TERMS),
    ]
    everything = absolute if isinstance(absolute, Scene) else scene
    for name, (description, change) in _CHANGES.items():
        made.append(Variant(name, description, _named(change(scene), name)))
        everything = change(everything)
    description = "absolute coordinates, joints as constraints"
    if isinstance(absolute, Scene):
        made.append(Variant("absolute", description, absolute))
    elif absolute is not None:
        made.append(Variant("absolute", description, None, problem=absolute))
    whole = _named(everything, "everything")
    return (*made, Variant("everything", "all of that together, as far as it can be", whole, ALL_TERMS))


#: Every term with at most two time derivatives, each once; second derivations for checks are left out.
ALL_TERMS = tuple(
    name
    for name, term in TERMS.items()
    if term.order <= 2 and not name.endswith(("_1", "_closed")) and term.source not in CLOSED_MATRICES
)


def _named(scene: Scene, name: str) -> Scene:
    """Return a scene whose content says that it is a variant: caches must not take it for the scene."""
    return replace(scene, content=scene.content + b"\0" + name.encode())


def _tunable(scene: Scene) -> Scene:
    """Return the scene with all numbers tunable that bodies, joints, force elements and gravity have, except zeros."""
    along = _along_beams(scene)
    parameters = [replace(item, tunable=item.tunable or item.name not in along) for item in scene.parameters]

    def fresh(number: Number) -> Formula:
        if number.value == 0.0:
            return number
        name = f"number_{len(parameters)}"
        parameters.append(Parameter(name, number.value, tunable=True))
        return Symbol("parameter", name)

    bodies = tuple(
        replace(
            body,
            mass=_over(body.mass, fresh),
            center_of_mass=_over(body.center_of_mass, fresh),
            inertia=_over(body.inertia, fresh),
        )
        if body.beam is None
        else body
        for body in scene.bodies
    )
    beams = {body.name for body in scene.bodies if body.beam is not None}
    kept = ("mimic", "pitch")  # ratios of coordinates are constants of the tree
    joints = tuple(
        joint
        if joint.parent in beams
        else replace(
            joint,
            **{item.name: _over(getattr(joint, item.name), fresh) for item in fields(joint) if item.name not in kept},
        )
        for joint in scene.joints
    )
    elements = scene.elements if beams else tuple(_over(element, fresh) for element in scene.elements)
    gravity = _over(scene.gravity, fresh)
    return replace(
        scene, parameters=tuple(parameters), bodies=bodies, joints=joints, elements=elements, gravity=gravity
    )


def _along_beams(scene: Scene) -> set[str]:
    """Return the parameters of scenes with beams that define places or beams: they stay fixed."""
    beams = {body.name: body.beam for body in scene.bodies if body.beam is not None}
    if not beams:
        return set()
    result: set[str] = set()

    def note(formula: Formula) -> Formula:
        result.update(symbol.name for symbol in symbols(formula) if symbol.kind == "parameter")
        return formula

    for joint in scene.joints:
        if joint.parent in beams:
            _each(joint, note)
    for holder in (*scene.points, *scene.elements, *scene.constraints, *beams.values()):
        _each(holder, note)
    return result


def _over(value: Any, change: Callable[[Number], Formula]) -> Any:
    """Return a value with its fields that are plain numbers of formulas changed; other formulas stay."""
    if isinstance(value, Number):
        return change(value)
    if isinstance(value, Node):
        return value
    if isinstance(value, tuple):
        return tuple(_over(item, change) for item in value)
    if is_dataclass(value) and not isinstance(value, type):
        changed = {item.name: _over(getattr(value, item.name), change) for item in fields(value) if item.init}
        return replace(value, **changed)
    return value


def _each(value: Any, note: Callable[[Formula], Formula]) -> None:
    """Call a function with all formulas within a value."""
    if isinstance(value, Node):
        note(value)  # type: ignore[arg-type]  # every node is a formula
    elif isinstance(value, tuple):
        for item in value:
            _each(item, note)
    elif is_dataclass(value) and not isinstance(value, type):
        for item in fields(value):
            _each(getattr(value, item.name), note)


def _moving_base(scene: Scene) -> Scene:
    """Return the scene with a base that trembles in all six ways, besides its own law."""
    own = scene.base or Base()
    time = Symbol("time")
    x, y, z = (Operation("add", (formula, _tremor(time, k + 1.0))) for k, formula in enumerate(own.position))
    rotations = tuple(
        Rotation(axis, _tremor(time, 4.0 + k))
        for k, axis in enumerate(((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    )
    return replace(scene, base=Base((x, y, z), (*own.rotations, *rotations)))


def _tremor(time: Formula, frequency: float) -> Formula:
    return Operation("mul", (Number(TREMBLING), Operation("sin", (Operation("mul", (Number(frequency), time)),))))


_CHANGES: Mapping[str, tuple[str, Callable[[Scene], Scene]]] = {
    "tunable": ("all numbers of bodies, joints, forces and gravity tunable", _tunable),
    "moving base": ("a base that moves in all six ways, by 1e-100", _moving_base),
}
