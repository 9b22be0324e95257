"""Checks of all closed forms of a scene by differences, complex steps and second derivations."""

__all__ = []
#: Open to the other parts of ``studies`` as well.
WITHIN = ["check", "report"]
