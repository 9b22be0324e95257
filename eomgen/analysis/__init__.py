"""Analyses of a compiled model about one state: equilibria, steady motions, linear models, root loci."""

__all__ = [
    "base_parameters",
    "bending",
    "buckling",
    "campbell",
    "definiteness",
    "eigenvalue_loci",
    "equilibrium",
    "equilibrium_path",
    "linearize",
    "path_following",
    "road_excitation",
    "root_locus",
    "state_warnings",
    "steady_motion",
]
