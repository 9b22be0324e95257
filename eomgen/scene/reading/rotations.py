"""Rotations of a scene: an axis and an angle, which may be a formula."""

from __future__ import annotations

from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula


@dataclass(frozen=True)
class Rotation:
    """Rotation by ``angle`` about a unit ``axis``; lists of these are intrinsic, in order."""

    axis: tuple[float, float, float]
    angle: Formula
