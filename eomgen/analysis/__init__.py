"""Analyses of a compiled model about one state: equilibria, steady motions, linear models, root loci."""

__all__ = [
    "bending",
    "campbell",
    "definiteness",
    "equilibrium",
    "linearize",
    "operating_point",
    "road_excitation",
    "root_locus",
    "steady_motion",
]
