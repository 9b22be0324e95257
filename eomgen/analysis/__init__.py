"""Analyses of a compiled model about one state: equilibria."""

__all__ = [
    "base_parameters",
    "driven_rest",
    "equilibrium",
    "loaded_statics",
    "sparse_partials",
    "state_warnings",
]
