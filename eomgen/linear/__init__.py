"""Linear models of mechanical systems: free coordinates, state space, modes, frequency responses; independent of mechanics."""

__all__ = ["freedom", "linearization", "modes", "partials", "root_locus"]
