"""Forces, springs, bushings and tyres of a Scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from eomgen.formula.nodes import ZERO, Formula, Vector
from eomgen.scene.joints.constraint_model import Frame


@dataclass(frozen=True)
class Spring:
    """Spring-damper along the line between two points: tension = stiffness (l - length) + damping l' + force.

    ``force`` is a formula of everything (an actuator in parallel), a tension: positive pulls the points together.
    Stiffness, damping and free length are formulas of parameters.
    """

    name: str
    first: str
    second: str
    stiffness: Formula
    damping: Formula
    length: Formula
    force: Formula = ZERO


@dataclass(frozen=True)
class TorsionSpring:
    """Torsional spring-damper between two angles, coordinates of joints (or one and its rest angle, ``second`` empty).

    Effort on ``first``: -(stiffness (q1 - q2 - rest) + damping (v1 - v2)), opposite on ``second``.
    """

    name: str
    first: str
    second: str
    stiffness: Formula
    damping: Formula
    rest: Formula
    first_index: int = 0
    second_index: int = 0


@dataclass(frozen=True)
class Force:
    """Force and torque on a body at a point, formulas of everything but accelerations, in world or body axes."""

    name: str
    body: str
    point: Vector  # body frame, formulas of parameters
    force: Vector
    torque: Vector
    axes: Literal["world", "body"] = "world"


@dataclass(frozen=True)
class Effort:
    """Generalized force on one component of a joint, a formula of everything but accelerations."""

    name: str
    joint: str
    effort: Formula
    index: int = 0


@dataclass(frozen=True)
class Bushing:
    """Spring and damper in six directions between two frames, angular first, in the axes of the first frame.

    Attributes
    ----------
    stiffness, damping : 6 rows of 6; the stiffness is symmetric
    rest : origin of the second frame in the first when the springs are slack, m
    rest_orientation : axes of the second frame in the first then, as columns, row by row
    preload : moment (N m) and force (N) on the second frame at rest
    """

    name: str
    first: Frame
    second: Frame
    stiffness: tuple[tuple[Formula, ...], ...]
    damping: tuple[tuple[Formula, ...], ...]
    rest: tuple[Formula, Formula, Formula]
    rest_orientation: tuple[tuple[float, float, float], ...]
    preload: tuple[Formula, ...]


@dataclass(frozen=True)
class Slip:
    """Forces of a tyre in the road's plane: load times stiffness times slip, bounded by friction times load.

    Attributes
    ----------
    axis : unit vector of the wheel's spin in the axes of its centre's body
    stiffness : longitudinal and lateral, per unit of slip and of load
    velocity : added in squares to the rolling speed, m/s
    """

    axis: tuple[float, float, float]
    stiffness: tuple[Formula, Formula]
    friction: Formula
    velocity: Formula


@dataclass(frozen=True)
class Tyre:
    """A point contact between a wheel and a road of given height; it lifts off where the road falls away.

    Attributes
    ----------
    center : point, the centre of the wheel
    road : height of the road in the world, formula of time, inputs and the centre's x and y
    road_rate : its rate from time and inputs; None where it follows from the formula
    moving_road : whether time or inputs move the road
    """

    name: str
    center: str
    radius: Formula
    stiffness: Formula
    damping: Formula
    onset: Formula
    road: Formula
    road_rate: Formula | None
    moving_road: bool
    slip: Slip | None = None
