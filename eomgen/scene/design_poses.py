"""Poses of bodies at the design position, in which every joint is at zero, and placements given in another frame.

Rotations are constant, and origins are formulas of parameters. An origin is kept as a sum of formulas with constant
factors, so that lengths that two bodies share cancel: a joint given in the world next to another joint does not depend
on the way from the world to both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Protocol, TypeVar

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.errors import DescriptionError
from eomgen.formula.nodes import ONE, ZERO, Formula, Number, Operation, Vector
from eomgen.scene.rotations import rows, snapped_rotation
from eomgen.system.description import BASE, WORLD

Axes = tuple[tuple[float, float, float], ...]
#: A formula as a sum: factor of each formula, and of ``ONE`` for the constant.
Sum = dict[Formula, float]
#: Signs of the arguments of operations that are sums.
_SIGNS = {"add": (1.0, 1.0), "sub": (1.0, -1.0), "neg": (-1.0,)}


class FramePlacement(NamedTuple):
    """Place of a frame: of a body that a joint carries, of a point's frame.

    Attributes
    ----------
    frame : body, ``base`` or ``world`` in whose axes the placement is given
    position : (3,) m, formulas of parameters
    axes : (3, 3) constant, own axes to the axes of ``frame``, row by row
    """

    frame: str
    position: Vector
    axes: Axes


class DesignPose(NamedTuple):
    """Pose of a body at the design position, in the base: axes (3, 3), body axes to base axes, and origin, m."""

    axes: Array
    origin: tuple[Sum, Sum, Sum]


class DesignPlace(NamedTuple):
    """A place in two frames, at the default parameters.

    Attributes
    ----------
    name : section and name of the entry: ``joints.crank_pin``, ``constraints.rocker_pin.first``
    body : body in whose frame the model has the place; the parent of a joint
    position : (3,) m, in that frame
    world : (3,) m, in the frame of the base
    """

    name: str
    body: str
    position: tuple[float, ...]
    world: tuple[float, ...]


class _Placed(Protocol):
    """An item with a place on a body."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def body(self) -> str: ...
    @property
    def position(self) -> Vector: ...


Key = TypeVar("Key")
Placed = TypeVar("Placed", bound=_Placed)


def attach(item: Placed, at: Callable[[Key, str, Vector], tuple[str, Vector]], key: Key) -> Placed:
    """Return an item with the body and the position that a function gives for its key, body and position."""
    body, position = at(key, item.body, item.position)
    return replace(item, body=body, position=position)


class UnknownPoseError(DescriptionError):
    """A pose that does not follow from the placements."""


@dataclass(eq=False)
class DesignPoses:
    """Poses of the bodies of a scene with every joint at zero.

    Parameters
    ----------
    placements : mapping
        Placement of each body that a joint carries.
    beams : collection of str
        Geometrically exact beams, on which places are counted along the axis.
    base_moves : bool
        Whether the base has a pose in the world that differs from the world frame.
    """

    placements: Mapping[str, FramePlacement]
    beams: Collection[str] = ()
    base_moves: bool = False

    def __post_init__(self) -> None:
        self._poses: dict[str, DesignPose] = {BASE: DesignPose(np.eye(3), ({}, {}, {}))}

    def pose(self, body: str) -> DesignPose:
        """Return the pose of a body in the base: axes (3, 3) and origin, formulas in m.

        Raises
        ------
        UnknownPoseError
            If a geometrically exact beam carries the body, if the placements refer to one another in a circle, if no
            joint carries the body, or for the world while the base has a pose in the world.
        """
        if body == WORLD and self.base_moves:
            raise UnknownPoseError("the base has a place of its own in the world", f'in = "{BASE}"')
        path = [BASE if body == WORLD else body]
        while path[-1] not in self._poses:
            path.append(self._reference(path))
        for name, frame in zip(path[-2::-1], path[:0:-1], strict=True):
            placement, carrier = self.placements[name], self._poses[frame]
            origin = _sums(carrier.axes, placement.position)
            x, y, z = (_plus(a, b) for a, b in zip(carrier.origin, origin, strict=True))
            self._poses[name] = DesignPose(carrier.axes @ np.array(placement.axes), (x, y, z))
        return self._poses[path[0]]

    def _reference(self, path: Sequence[str]) -> str:
        """Return the frame in which the last body of a path is placed, "base" for the world; ``path`` has the bodies
        from the wanted one towards the base. Raises UnknownPoseError if the body has no placement, or the path becomes
        a circle."""
        body = path[-1]
        if body in self.beams:
            fault = f"places on the geometrically exact beam {body} are counted along its axis"
            raise UnknownPoseError(fault, "the place on the beam or in the body itself, without in")
        if body not in self.placements:
            raise UnknownPoseError(f"no joint places the body {body}", "")
        frame = self.placements[body].frame
        if frame == WORLD and self.base_moves:
            raise UnknownPoseError("the base has a place of its own in the world", f'in = "{BASE}"')
        frame = BASE if frame == WORLD else frame
        if frame in path:
            circle = ", ".join([*path[path.index(frame) :], frame])
            hint = f'in = "{BASE}" for one of them'
            raise UnknownPoseError(f"these bodies are placed in one another: {circle}", hint)
        return frame

    def placement_in(self, placement: FramePlacement, body: str) -> FramePlacement:
        """Return a placement with the same pose, given in the frame of ``body``, with every joint at zero. Raises
        UnknownPoseError if the pose of one of both frames does not follow from the placements."""
        if body == WORLD and self.base_moves:
            if placement.frame == WORLD:
                return placement
            fault = "the base has a place of its own in the world"
            raise UnknownPoseError(fault, f'in = "{WORLD}", or body = "{BASE}"')
        frame, carrier = self.pose(placement.frame), self.pose(body)
        offset = tuple(
            _plus(_plus(a, b), base, -1.0)
            for a, b, base in zip(frame.origin, _sums(frame.axes, placement.position), carrier.origin, strict=True)
        )
        x, y, z = (_formula(_combine(zip(carrier.axes[:, index].tolist(), offset, strict=True))) for index in range(3))
        axes = snapped_rotation(carrier.axes.T @ frame.axes @ np.array(placement.axes))
        return FramePlacement(body, (x, y, z), rows(axes))

    def way(self, first: tuple[str, Vector], second: tuple[str, Vector]) -> Vector:
        """Return the vector from a place to another with every joint at zero, m, in the axes of the base, as formulas
        of parameters. Both places are pairs of body and position on this body. Raises UnknownPoseError."""
        origins = []
        for body, position in (first, second):
            pose = self.pose(body)
            origins.append([_plus(*pair) for pair in zip(pose.origin, _sums(pose.axes, position), strict=True)])
        x, y, z = (_formula(_plus(end, start, -1.0)) for start, end in zip(*origins, strict=True))
        return x, y, z

    def in_base(self, body: str, position: Vector) -> Vector:
        """Return the place in the base of a place on a body, m, formulas of parameters."""
        return self.placement_in(FramePlacement(body, position, rows(np.eye(3))), BASE).position


def size_of(way: Vector) -> Formula:
    """Return the Euclidean length of a vector of three formulas, as a formula."""
    parts = [part for part in way if part != ZERO]
    if all(isinstance(part, Number) for part in parts):
        return Number(math.hypot(*(part.value for part in parts if isinstance(part, Number))))
    if len(parts) == 1:
        return Operation("abs", (parts[0],))
    squares = [part * part for part in parts]
    return Operation("sqrt", (sum(squares[1:], squares[0]),))


def _sums(axes: Array, position: Sequence[Formula]) -> tuple[Sum, Sum, Sum]:
    """Return a vector of formulas, turned by constant axes."""
    entries = [_sum(item) for item in position]
    x, y, z = (_combine(zip(row, entries, strict=True)) for row in axes.tolist())
    return x, y, z


def _sum(formula: Formula) -> Sum:
    """Return a formula as a linear combination: the constant factor of each formula, and of ``ONE`` for the constant.
    Differences, and products and quotients with numbers, are split; any other formula has the factor 1."""
    if isinstance(formula, Number):
        return {ONE: formula.value}
    if isinstance(formula, Operation) and formula.name in _SIGNS:
        signs = zip(_SIGNS[formula.name], formula.arguments, strict=True)
        return _combine((sign, _sum(part)) for sign, part in signs)
    if isinstance(formula, Operation) and formula.name in ("mul", "div"):
        first, second = formula.arguments
        if isinstance(second, Number) and (formula.name == "mul" or second.value != 0.0):
            return _combine([(second.value if formula.name == "mul" else 1.0 / second.value, _sum(first))])
        if isinstance(first, Number) and formula.name == "mul":
            return _combine([(first.value, _sum(second))])
    return {formula: 1.0}


def _combine(parts: Iterable[tuple[float, Sum]]) -> Sum:
    """Return the linear combination of sums with the given factors; sums are mappings from formulas to constant
    factors."""
    result: Sum = {}
    for factor, part in parts:
        if factor != 0.0:
            result = _plus(result, part, factor)
    return result


def _plus(a: Sum, b: Sum, factor: float = 1.0) -> Sum:
    """Return the sum ``a + factor * b`` of two linear combinations, without formulas whose total factor is only
    rounding."""
    result = dict(a)
    for formula, weight in b.items():
        first, second = a.get(formula, 0.0), factor * weight
        total = first + second
        if abs(total) <= 1e-14 * (abs(first) + abs(second)):
            result.pop(formula, None)
        else:
            result[formula] = total
    return result


def _formula(total: Sum) -> Formula:
    """Return a linear combination, a mapping from formulas to constant factors, as one formula, with the constant at
    the end."""
    result: Formula | None = None
    for formula, weight in total.items():
        if formula == ONE:
            continue
        term = formula if abs(weight) == 1.0 else Number(abs(weight)) * formula
        if result is None:
            result = term if weight > 0.0 else -term
        else:
            result = result + term if weight > 0.0 else result - term
    number = total.get(ONE, 0.0)
    if result is None:
        return ZERO if number == 0.0 else Number(number)
    return result if number == 0.0 else result + number
