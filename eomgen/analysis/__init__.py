"""Analyses of a compiled model about one state: equilibria, steady motions, linear models, root loci."""

__all__ = [
    "base_parameters",
    "bending",
    "buckling",
    "campbell",
    "definiteness",
    "driven_rest",
    "eigenvalue_loci",
    "equilibrium",
    "linearize",
    "loaded_statics",
    "road_excitation",
    "root_locus",
    "sparse_partials",
    "state_warnings",
    "steady_motion",
]
