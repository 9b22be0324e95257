"""Equations of motion in separated form: M, h, b, Q, their partials, forward dynamics, energies."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["elimination", "energy", "partials", "separated"]
