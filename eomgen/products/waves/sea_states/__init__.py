"""Spectra of seas, their components, and realisations by seed: shared by waves by particles and scenes."""

__all__ = []
#: Open to the other parts of ``products.waves`` as well.
WITHIN = ["components", "nonlinearity", "spectra"]
