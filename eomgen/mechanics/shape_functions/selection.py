"""Shape functions of a deformation: the family that the scene chooses, normalised."""

from __future__ import annotations

import mpmath
import numpy as np

from eomgen.mechanics.shape_functions import modal, polynomials
from eomgen.mechanics.shape_functions.elements import elements
from eomgen.mechanics.shape_functions.families import Family, Scaled
from eomgen.mechanics.shape_functions.fixed_point import BITS, ONE, WORKING, array, unfixed
from eomgen.mechanics.shape_functions.quadrature import Grid
from eomgen.scene.bodies.beam import Beam, Deformation, Ends, Normalisation

_SAMPLES = 40  # for each function: enough to see its greatest wave


def normalised(family: Family, ends: Ends, normalisation: Normalisation) -> Family:
    """Return shape functions scaled: ``natural`` ones as they are, ``unit`` ones to a greatest value of 1, others to a
    mean square of 1."""
    if normalisation == "natural":
        return family
    with mpmath.workprec(WORKING):
        if normalisation == "unit":
            return Scaled(family, array(1 / unfixed(greatest) for greatest in _greatest(family, ends)))
        grid = Grid([family])
        squares = [grid.integral(f, f) for f in family.values(grid.positions)[0]]
        return Scaled(family, array(1 / mpmath.sqrt(unfixed(square)) for square in squares))


def _greatest(family: Family, ends: Ends) -> list[int]:
    """Return values at a free second end, else the largest magnitude of each function with its first sign."""
    if ends != "pinned_pinned":
        return [int(value) for value in family.values(np.array([ONE], dtype=object))[0][:, 0]]
    count = _SAMPLES * family.size
    positions = np.array([(number << BITS) // count for number in range(count + 1)], dtype=object)
    extremes = []
    for number, row in enumerate(family.values(positions)[0]):
        s = np.array([positions[int(np.argmax(np.abs(row)))]], dtype=object)
        greatest = 0
        for _ in range(9):  # Newton's iteration for f' = 0; at a kink between elements it does not converge
            value, slope, curvature = (int(part[number, 0]) for part in family.values(s))
            greatest = max(greatest, abs(value))
            step = (slope << BITS) // curvature if curvature else 0
            s = s - (step if abs(step) * count < ONE else 0)
        extremes.append(greatest if row[1] > 0 else -greatest)
    return extremes


def shapes(deformation: Deformation, beam: Beam) -> Family:
    """Return the shape functions of a deformation, of s = (x - start) / length."""
    return normalised(*_natural(deformation, beam), deformation.normalisation)


def _natural(deformation: Deformation, beam: Beam) -> tuple[Family, Ends]:
    kind, size = deformation.kind, deformation.modes
    if deformation.shapes == "polynomial":
        return polynomials.family(kind, deformation.ends, size), deformation.ends
    if deformation.shapes == "finite_elements":
        return elements(deformation, beam), deformation.ends
    return modal.modes(kind.startswith("bending"), deformation.shapes, size), deformation.shapes
