"""Linear models of mechanical systems: free coordinates, state space, modes, frequency responses. Knows no mechanics."""
