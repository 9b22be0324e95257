"""Static equilibria and consistent states, on a product of Lie groups; arrays only."""

__all__ = [
    "consistency",
    "constraint_rows",
    "damped_motion",
    "equilibrium_search",
    "newton_path",
    "redundancy",
    "statics",
]
