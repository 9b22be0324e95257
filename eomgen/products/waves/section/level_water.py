"""The requirement that gravity points along -z in scenes with water."""

from __future__ import annotations

import math

import numpy as np

from eomgen.base.arrays import Flags, Numbers
from eomgen.base.rounding import COMPUTED
from eomgen.formula.nodes import Vector
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.requirements import Row
from eomgen.scene.section import Reading


def _is_tilted(x: Numbers, y: Numbers, z: Numbers) -> Flags:
    return np.logical_or(np.greater(np.hypot(x, y), np.multiply(COMPUTED, np.abs(z))), np.greater(z, 0.0))


#: Rule for the components of gravity, m/s^2: the surface at rest is level, of constant z, with air above.
_LEVEL = Row(
    ("gravity",),
    _is_tilted,
    "water at rest is level in z and below the air, and gravity is [{0}, {1}, {2}] [E1800]",
    "gravity = [0, 0, -9.81], and z upwards",
)


def level_gravity(reading: Reading) -> tuple[Vector, float]:
    """Return gravity, as formulas, and the magnitude, m/s^2, and require a direction along -z in all runs."""
    # by a separate reader: problems, notes and requirements of the key follow when the base is read
    aside = reading.aside().values
    gravity = aside.vector("gravity", reading.document.gravity, PARAMETERS)
    reading.values.require("gravity", _LEVEL, gravity)
    return gravity, math.hypot(*map(aside.value, gravity))
