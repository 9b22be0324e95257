"""Hamiltonian systems: equations on the tape, C, compiled models, motions."""

__all__ = []
#: Open to the other parts of ``products.fields`` as well.
WITHIN = ["code", "methods", "model", "solution"]
