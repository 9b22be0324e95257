"""Formulations of a scene with one initial state: joint coordinates, and absolute coordinates on SE(3) or on R^3 x
SO(3); and scenes of less fidelity, with fewer beam modes, order 1, no stiffening, or beams as rigid bodies.

Errors of runs of less fidelity are against the scene described, so omissions count as errors.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.errors import EomgenError, NumericalError, Problem
from eomgen.formula.nodes import Number, Symbol
from eomgen.lie import numeric
from eomgen.lie.groups import SO3
from eomgen.lie.product import update
from eomgen.pipeline import documents
from eomgen.pipeline.model import Model
from eomgen.products.studies.work_precision.axes import reason
from eomgen.scene.scene import Scene
from eomgen.system.description import Description


def same_start(
    model: Model, q: Array, v: Array, target: Model, t: float, parameters: Mapping[str, float] | None
) -> dict[str, Any]:
    """Return the initial state (``q``, ``v``) of another formulation with the poses and twists of the bodies of
    ``model``.

    The configuration is found by Gauss-Newton steps from the initial one of `target`.

    Parameters
    ----------
    model, target : the scene's own model, and the model of the other formulation
    q, v : (nq,), (nv,), consistent, of ``model``
    t, parameters : time, s, and tunable parameters by name

    Raises
    ------
    NumericalError
        The other formulation has no such state.
    """
    bodies = [name for name in model.bodies if name in target.bodies]
    poses = {name: model.pose(name, q, t, parameters=parameters) for name in bodies}
    here = np.array(target.initial_q, dtype=float)
    for _ in range(50):
        apart = np.concatenate([_apart(target.pose(n, here, t, parameters=parameters), poses[n]) for n in bodies])
        change = np.linalg.lstsq(_per_velocity(target, bodies, here, t, parameters)[0], apart, rcond=None)[0]
        here = update(target.factors, here, change)
        if np.abs(change).max() < SUMMED:
            break
    apart = np.concatenate([_apart(target.pose(n, here, t, parameters=parameters), poses[n]) for n in bodies])
    size = 1.0 + max(float(np.abs(pose[4:]).max()) for pose in poses.values())
    if np.abs(apart).max() > COMPUTED * size:
        off = np.abs(apart).max()
        fault = (
            f"{target.name} cannot begin at the start of the scene's own formulation: bodies are off by"
            f" {off:.2g} [E1134]"
        )
        raise NumericalError(Problem("formulation", fault, "the scene's own formulation"))
    columns, rest = _per_velocity(target, bodies, here, t, parameters)
    twists = np.concatenate([model.twist(name, q, v, t, parameters=parameters) for name in bodies])
    return {"q": here, "v": np.linalg.lstsq(columns, twists - rest, rcond=None)[0]}


def _per_velocity(
    model: Model, bodies: list[str], q: Array, t: float, parameters: Mapping[str, float] | None
) -> tuple[Array, Array]:
    """Return the twists of the bodies per velocity component, (6 n, nv), and at rest, (6 n,)."""
    rest, *moved = (
        np.concatenate([model.twist(name, q, v, t, parameters=parameters) for name in bodies])
        for v in np.vstack([np.zeros(model.nv), np.eye(model.nv)])
    )
    return np.stack([column - rest for column in moved], axis=1), rest


def _apart(here: Array, there: Array) -> Array:
    """Return the small rotation (rad) and translation (m) in body axes that lead from one pose to another, (6,)."""
    back = here[:4] * [1.0, -1.0, -1.0, -1.0]
    turn = numeric.difference(SO3, here[:4], there[:4])
    return np.concatenate([turn, numeric.rotated(back, there[4:] - here[4:])])


#: Kinds of symbols for a coordinate of a beam, or for a rate of a coordinate.
_COORDINATES = ("q", "v", "a")
#: New places of the coordinates of beams, by beam and index; None for coordinates left out.
_Moved = Mapping[tuple[str, int], int | None]


def simplify(scene: Scene) -> Iterator[tuple[str, Scene]]:
    """Yield (description, scene) of less fidelity: fewer beam modes, order 1, no stiffening, rigid beams. None for a
    scene without beams."""
    beams = {body.name: body.beam for body in scene.bodies if body.beam is not None}
    modal = [item.modes for beam in beams.values() for item in beam.deformations if not item.nodal]
    most = max(modal, default=1)
    for count in sorted({most - 1, most // 2, 1} - {0, most}, reverse=True):
        yield f"at most {count} mode{'s' * (count > 1)}", _with_modes(scene, count)
    if any(beam.order > 1 for beam in beams.values()):
        yield "order 1", _with_beams(scene, order=1)
    if any(beam.stiffening for beam in beams.values()):
        yield "no stiffening", _with_beams(scene, stiffening=False)
    if beams:
        yield "rigid", _rigid(scene)


def _with_beams(scene: Scene, **changes: Any) -> Scene:
    bodies = tuple(
        body if body.beam is None else replace(body, beam=replace(body.beam, **changes)) for body in scene.bodies
    )
    return replace(scene, bodies=bodies)


def _with_modes(scene: Scene, most: int) -> Scene:
    """Return a scene whose beams have at most `most` modes of each deformation. Coordinates left out are zero in
    formulas."""
    moved: dict[tuple[str, int], int | None] = {}
    bodies = []
    for body in scene.bodies:
        if body.beam is None:
            bodies.append(body)
            continue
        kept, before, now = [], 0, 0
        for item in body.beam.deformations:
            count = item.modes if item.nodal else min(item.modes, most)
            for index in range(item.modes):
                moved[body.name, before + index] = now + index if index < count else None
            before, now = before + item.modes, now + count
            position, velocity = item.initial_position[:count], item.initial_velocity[:count]
            kept.append(replace(item, modes=count, initial_position=position, initial_velocity=velocity))
        bodies.append(replace(body, beam=replace(body.beam, deformations=tuple(kept))))
    return replace(_renumber_coordinates(scene, moved), bodies=tuple(bodies))


def _rigid(scene: Scene) -> Scene:
    moved = {(body.name, k): None for body in scene.bodies if body.beam for k in range(body.beam.size)}
    bodies = tuple(replace(body, beam=None) for body in scene.bodies)
    return replace(_renumber_coordinates(scene, moved), bodies=bodies)


def _renumber_coordinates(scene: Scene, moved: _Moved) -> Scene:
    """Return a scene whose formulas have the coordinates of beams at new places. `moved` maps (beam, index) to the new
    index; None makes the coordinate zero."""

    def change(value: Any) -> Any:
        if not isinstance(value, Symbol):
            return NotImplemented
        coordinate = (value.name, value.index)
        if value.kind not in _COORDINATES or coordinate not in moved:
            return value
        index = moved[coordinate]
        return Number(0.0) if index is None else replace(value, index=index)

    names = ("elements", "outputs", "inputs", "states", "controllers", "events")
    return replace(scene, **{name: rebuild(getattr(scene, name), change) for name in names})


def rebuild(value: Any, change: Callable[[Any], Any]) -> Any:
    """Return nested data of a scene with changed parts; the same object without changes.

    Parameters
    ----------
    change : returns a part, changed or not, or NotImplemented for a part whose own parts are looked at
    """
    changed = change(value)
    if changed is not NotImplemented:
        return changed
    if isinstance(value, tuple):
        parts = [rebuild(part, change) for part in value]
        if all(new is old for new, old in zip(parts, value, strict=True)):
            return value
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if isinstance(value, Mapping):
        made = {key: rebuild(part, change) for key, part in value.items()}
        return made if any(made[key] is not value[key] for key in value) else value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value) if field.init}
        new = {name: rebuild(part, change) for name, part in fields.items()}
        return replace(value, **new) if any(new[name] is not fields[name] for name in fields) else value
    return value


JOINT = "joint"
#: Groups of absolute bodies, beginning with the default group.
GROUPS = ("SE3", "R3xSO3")


@dataclass(frozen=True)
class Formulations:
    """Formulations of a scene.

    Attributes
    ----------
    scenes : by name, the scene's own first
    refused : reasons for missing formulations, by name
    simplified : names of formulations of less fidelity
    """

    scenes: Mapping[str, Any]
    refused: Mapping[str, str]
    simplified: tuple[str, ...] = ()

    @property
    def own(self) -> str:
        """The name of the scene's own formulation."""
        return next(iter(self.scenes))

    @cached_property
    def description(self) -> Description:
        """Facts of the scene's own formulation."""
        document, front_end = documents.as_document(self.scenes[self.own])
        return front_end.describe(document)


def formulations(described: Any, options: Mapping[str, Any], *, others: bool, fidelity: bool = False) -> Formulations:
    """Return the formulations of a source of ``eomgen.load``: joint coordinates, absolute ones on each group,
    simplified ones.

    A finished Scene keeps the coordinates, which are chosen when the scene is read; other documents have one
    formulation.

    Parameters
    ----------
    described : path, mapping, Scene or document
    options : of ``eomgen.load``
    others : whether formulations besides the scene's own are wanted
    fidelity : whether formulations of less fidelity are also wanted

    Raises
    ------
    EomgenError
        As of ``eomgen.load``, for the unchanged scene.
    """
    from_text = isinstance(described, str | os.PathLike | Mapping)
    own_scene = documents.load_scene(described, **options) if from_text else documents.as_document(described)[0]
    if not isinstance(own_scene, Scene):
        return Formulations({"as given": own_scene}, {})
    result, refused = {_name_of(own_scene): own_scene}, {}
    for coordinates in ("joint", "absolute") if others else ():
        if coordinates != own_scene.coordinates and not from_text:
            continue
        try:
            scene = own_scene
            if coordinates != own_scene.coordinates:
                scene = documents.load_scene(described, **{**options, "coordinates": coordinates})
        except EomgenError as error:
            refused[coordinates] = reason(error)
            continue
        for changed in [scene] if coordinates == "joint" else [_on_group(scene, group) for group in GROUPS]:
            result.setdefault(_name_of(changed), changed)
    less = {f"{_name_of(own_scene)}, {change}": scene for change, scene in simplify(own_scene)} if fidelity else {}
    return Formulations({**result, **less}, refused, tuple(less))


def _on_group(scene: Scene, group: str) -> Scene:
    """Return an absolute scene all of whose bodies move on one group."""
    groups = {body.name: group for body in scene.bodies}
    return scene if _groups(scene) == {group} else replace(scene, groups=groups)


def _groups(scene: Scene) -> set[str]:
    return {scene.groups.get(body.name, GROUPS[0]) for body in scene.bodies}


def _name_of(scene: Scene) -> str:
    if scene.coordinates == "joint":
        return JOINT
    groups = _groups(scene)
    return next(iter(groups)) if len(groups) == 1 else "absolute, mixed groups"
