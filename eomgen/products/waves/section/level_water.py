"""The requirement that gravity points along -z in scenes with water."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from eomgen.base.arrays import Flags, Numbers
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.formula.nodes import Vector
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.section import Reading


@dataclass(frozen=True)
class LevelWater:
    """Rule for the three components of gravity, m/s^2, in scenes with water: the surface at rest is level, of constant
    z, with air above."""

    stage: ClassVar[int] = 1

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        x, y, z = numbers
        return np.logical_or(np.greater(np.hypot(x, y), np.multiply(COMPUTED, np.abs(z))), np.greater(z, 0.0))

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        x, y, z = numbers
        fault = f"water at rest is level in z and below the air, and gravity is [{x:.6g}, {y:.6g}, {z:.6g}] [E1800]"
        return fault, f"gravity = [0, 0, {-math.hypot(x, y, z):.6g}], and z upwards"


def level_gravity(reading: Reading) -> tuple[Vector, float]:
    """Return gravity, as formulas, and the magnitude, m/s^2, and require a direction along -z in all runs."""
    # by a separate reader: problems, notes and requirements of the key follow when the base is read
    aside = reading.aside().values
    gravity = aside.vector("gravity", reading.document.gravity, PARAMETERS)
    reading.values.require("gravity", LevelWater(), gravity)
    return gravity, math.hypot(*map(aside.value, gravity))
