"""Shape functions of a deformation: the family that the scene chooses, normalised."""

from __future__ import annotations

from eomgen.mechanics.shape_functions import modal, polynomials
from eomgen.mechanics.shape_functions.elements import elements
from eomgen.mechanics.shape_functions.families import Family
from eomgen.mechanics.shape_functions.normalisation import normalised
from eomgen.scene.bodies.beam import Beam, Deformation, Ends


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
