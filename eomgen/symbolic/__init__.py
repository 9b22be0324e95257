"""Kernels, the tape, and calculus on tapes. Knows no mechanics."""
