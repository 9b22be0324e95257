"""Static equilibria and consistent states, on a product of Lie groups; arrays only."""

__all__ = [
    "bordered_newton",
    "consistency",
    "constraint_rows",
    "equilibrium_path",
    "equilibrium_search",
    "load_steps",
    "redundancy",
    "statics",
]
