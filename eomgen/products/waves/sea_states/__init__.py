"""Spectra of seas, their components, and realisations by seed: shared by waves by particles and scenes."""

__all__ = ["bound_waves", "components", "numbers", "spectra", "steepness"]
