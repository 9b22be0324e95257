"""Static equilibria and consistent states, on a product of Lie groups; arrays only."""

__all__ = [
    "consistency",
    "constraint_rows",
    "equilibrium_search",
    "redundancy",
    "statics",
]
