"""Ocean waves of second order in Lagrangian form: particles, the surface that they make, what fixed points see."""

from __future__ import annotations

from eomgen.waves.pairs import WaveNumber, gravity_waves
from eomgen.waves.sea import Components, Motion, Sea, Surface

__all__ = ["Components", "Motion", "Sea", "Surface", "WaveNumber", "gravity_waves"]
