"""Waves in formulas: their words, values in NumPy, and recording on the tape."""

__all__ = []
#: Open to the other parts of ``products.waves`` as well.
WITHIN = ["fields", "recording"]
