"""Results of a sea: particles at one time, the surface that they make, and the waves that pairs make of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Motion:
    """Particles at one time.

    Attributes
    ----------
    position, velocity, acceleration : (points, 3) arrays in m, m/s, m/s^2
        z upwards from the mean level of the water at rest.
    pressure : (points,) array, m^2/s^2
        Relative to the air's, divided by the density.
    """

    position: Array
    velocity: Array
    acceleration: Array
    pressure: Array


@dataclass(frozen=True)
class Surface:
    """The surface at labels, at one time.

    Attributes
    ----------
    position : (points, 3) array, m
    slope : (points, 2) array
        Of the elevation along x and y; infinite if the surface is upright.
    curvature : (points,) array, 1/m
        Mean curvature, half the sum of the principal curvatures, negative at crests.
    jacobian : (points,) array
        Of the map from labels to x and y; negative if the surface is folded over.
    """

    position: Array
    slope: Array
    curvature: Array
    jacobian: Array


@dataclass(frozen=True)
class BoundWaves:
    """Contributions of pairs of components at the surface, as complex amplitudes at the label 0 and one time.

    Attributes
    ----------
    members : for each group of pairs (i, sign of i, j, sign of j)
        Components and signs of the sums of wave vectors; the arrays below have the groups concatenated.
    potential, rate : of the velocity potential of second order, m^2/s, and the rate of this potential
    x, y : displacements along the plane, m
    drift : (2,) array, m
        Displacement of all particles by drift.
    """

    members: tuple[tuple[NDArray[np.int64], int, NDArray[np.int64], int], ...]
    potential: Complex
    rate: Complex
    x: Complex
    y: Complex
    drift: Array
