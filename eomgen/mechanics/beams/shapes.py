"""The shape functions of a deformation: the family that a scene asks for, in its normalisation."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from eomgen.mechanics.beams import modal, polynomials
from eomgen.mechanics.beams.elements import elements
from eomgen.mechanics.beams.families import Family, Scaled
from eomgen.mechanics.beams.quadrature import Grid
from eomgen.scene.beam import Beam, Deformation, Ends

_SAMPLES = 2001


def shapes(deformation: Deformation, beam: Beam) -> Family:
    """Return the shape functions of a deformation, of s = (x - start) / length."""
    family, ends = _natural(deformation, beam)
    if deformation.normalisation == "mean_square":
        grid = Grid([family])
        return Scaled(family, 1.0 / np.sqrt(family.values(grid.places) ** 2 @ grid.weights))
    if deformation.normalisation == "unit":
        return Scaled(family, 1.0 / _greatest(family, ends))
    return family


def _natural(deformation: Deformation, beam: Beam) -> tuple[Family, Ends]:
    kind, size = deformation.kind, deformation.modes
    if deformation.shapes == "polynomial":
        return polynomials.family(kind, deformation.ends, size), deformation.ends
    if deformation.shapes == "finite_elements":
        return elements(deformation, beam), deformation.ends
    if kind.startswith("bending") and deformation.shapes != "pinned_pinned":
        return modal.BendingModes(deformation.shapes, size), deformation.shapes
    return modal.waves(deformation.shapes, size), deformation.shapes


def _greatest(family: Family, ends: Ends) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return (n,) values at a free second end, else the greatest magnitude of each function with the sign it first has."""
    if ends != "pinned_pinned":
        return family.values(np.array([1.0]))[:, 0]
    places = np.linspace(0.0, 1.0, _SAMPLES)
    samples = family.values(places)
    found = []
    for number, row in enumerate(samples):
        middle = int(np.argmax(np.abs(row)))
        around = (places[middle - 1], places[middle + 1])

        def below(s: float, number: int = number) -> float:
            return -abs(float(family.values(np.array([s]))[number, 0]))

        best = minimize_scalar(below, bounds=around, method="bounded", options={"xatol": 1e-9})
        found.append(np.copysign(-best.fun, row[1]))
    return np.array(found)
