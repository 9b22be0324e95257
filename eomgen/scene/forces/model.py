"""What pushes in a scene: springs between points and between angles, forces on bodies, efforts on joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from eomgen.scene.formula.nodes import ZERO, Formula, Vector


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
