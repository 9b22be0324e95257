"""Waves of a scene: spectra, or waves one by one, as functions of place and time."""

__all__ = []
