"""Hamiltonian systems: equations on the tape, C, compiled models, motions."""

__all__ = ["code", "derivation", "methods", "model", "plots", "solution"]
