"""Spectra of seas, their components, and realisations by seed: what waves by particles and scenes share."""

__all__ = ["bound_waves", "components", "numbers", "spectra", "steepness"]
