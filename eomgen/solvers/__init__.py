"""Static equilibria and consistent states, on a product of Lie groups; arrays only."""

__all__ = [
    "beams",
    "blocks",
    "bordered_newton",
    "consistency",
    "constraint_rows",
    "equilibrium_path",
    "equilibrium_search",
    "load_steps",
    "phi_functions",
    "quadrature",
    "redundancy",
    "regular_inertia",
    "rigid_beams",
    "sparse_rows",
    "statics",
    "tangent_stiffness",
]
