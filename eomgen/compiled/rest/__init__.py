"""States of rest of a compiled model: equilibria, motions that drives prescribe, partials about a state, warnings."""

__all__ = [
    "driven_rest",
    "equilibrium",
    "loaded_statics",
    "sparse_partials",
    "state_warnings",
]
