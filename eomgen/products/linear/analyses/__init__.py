"""Analyses of a compiled model that give linear models, loci of eigenvalues, multipliers of periodic motions."""

__all__ = ["linearize", "parameter_sweeps", "periodic_motions", "road_excitation", "solutions"]
#: Open to the other parts of ``linear`` as well.
WITHIN = ["parameter_sweeps"]
