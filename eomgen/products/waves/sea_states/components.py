"""Sinusoidal components of a sea."""

from __future__ import annotations

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass

STANDARD_GRAVITY = 9.81


@checked_calls("Components(vectors, amplitude, phase)")
@dataclass(frozen=True)
class Components:
    """Sinusoidal components A cos(kx x + ky y - w t + phase).

    Attributes
    ----------
    vectors : (n, 2) array
        Wave vectors in rad/m, in the direction in which the waves run.
    amplitude : (n,) array, m
    phase : (n,) array, rad
    """

    vectors: Array
    amplitude: Array
    phase: Array
