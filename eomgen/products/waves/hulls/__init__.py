"""Slender hulls in water: their section, their doubtful values, and the law of their loads."""

__all__ = []
#: Open to the other parts of ``products.waves`` as well.
WITHIN = ["section"]
