"""Reactions: the wrench that a joint or a constraint transmits, about a point and in the axes of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from eomgen.system.description import WORLD, Point


@dataclass(frozen=True)
class Reaction:
    """Force and moment that a joint's parent exerts on its child, or a constraint's first body on its second.

    Attributes
    ----------
    section, of : the joint or constraint
    point : about which the moment is taken; None for the origin of the child's frame, or of the second frame
    axes : body whose axes the components are in, ``base`` or ``world``
    """

    name: str
    section: Literal["joints", "constraints"]
    of: str
    point: Point | None = None
    axes: str = WORLD
