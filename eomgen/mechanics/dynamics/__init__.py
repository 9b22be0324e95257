"""Equations of motion in separated form: M, h, b, Q, their partials, forward dynamics, energies."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = [
    "articulated_bodies",
    "beam_matrices",
    "cancellation",
    "centroidal",
    "elimination",
    "energy",
    "extended_system",
    "partials",
    "reference_efforts",
    "regressor",
    "separated",
]
