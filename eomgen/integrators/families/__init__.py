"""Families of integration methods: what each says of itself, and the register of all; order conditions are checked at start."""

__all__ = ["register"]
#: Open to the other parts of ``integrators`` as well.
WITHIN = ["family"]
