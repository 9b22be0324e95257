"""Stationary random processes: covariances with their spectra, and their expansions in standard normal variables."""

__all__ = []
#: Open to the other parts of ``products.reliability`` as well.
WITHIN = ["coherence", "covariance", "karhunen_loeve"]
