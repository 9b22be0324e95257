"""Linear models of mechanical systems: free coordinates, state space, modes, frequency responses; no mechanics
inside."""

__all__ = [
    "augmentation",
    "balancing",
    "campbell",
    "campbell_search",
    "freedom",
    "linearization",
    "modes",
    "partials",
    "plots",
    "root_locus",
    "sampled_loop",
    "sampling",
    "state_space",
]
