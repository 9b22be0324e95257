"""Linear models of mechanical systems: free coordinates, state space, modes, frequency responses; no mechanics
inside."""

__all__ = [
    "balancing",
    "campbell",
    "campbell_plot",
    "campbell_search",
    "control",
    "eigenvalue_loci",
    "floquet",
    "freedom",
    "linearization",
    "modes",
    "multiblade",
    "partials",
    "plots",
    "root_locus",
    "sampled_loop",
    "sampling",
    "spectra",
    "state_space",
]
