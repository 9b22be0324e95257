"""Formulas and curves of a scene, recorded on the tape."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["curves", "formulas"]
