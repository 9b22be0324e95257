"""Waves of a scene: spectra, or waves one by one, as functions of place and time."""

__all__ = []
#: Open to the other parts of the product.
WITHIN = ["level_water"]
