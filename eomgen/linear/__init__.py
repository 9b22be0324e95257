"""Linear models of mechanical systems: free coordinates, state space, modes, frequency responses. Knows no mechanics."""

__all__ = ["freedom", "linearization", "modes", "partials", "root_locus"]
