"""Slender hulls in water: section, doubtful values, and the law of loads."""

__all__ = []
#: Open to the other parts of ``products.waves`` as well.
WITHIN = ["section"]
