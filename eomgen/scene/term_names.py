"""The names of the terms that a scene can ask for."""

from __future__ import annotations

#: Highest time derivative of inverse dynamics that can be asked for.
HIGHEST_RATE = 8
#: Matrices of the closed form, each a term with its time derivatives.
CLOSED_MATRICES = ("system_jacobian", "adjoints", "joint_brackets", "link_brackets", "coriolis", "coriolis_skew")
#: Names of all terms.
TERMS = (
    "mass",
    "coupling",
    "force",
    "base_motion",
    "inverse_dynamics",
    "forward_dynamics",
    "residual",
    "partials",
    "internal_rate",
    "internal_partials",
    "constraint",
    "constraint_velocity",
    "constraint_bias",
    "constraint_jacobian",
    "velocity_partials",
    "equations",
    "iteration",
    "jacobian_values",
    "poses",
    "twists",
    "accelerations",
    "jacobians",
    "outputs",
    "elastic",
    "linearization",
    "acceleration_partials",
    "output_partials",
    "energy",
    *("rates" if order == 2 else f"rates_{order}" for order in range(1, HIGHEST_RATE + 1)),
    *(f"{block}_rates{suffix}" for block in ("mass", "coupling", "force", "base_motion") for suffix in ("_1", "")),
    "rates_closed",
    "mass_rates_closed",
    *(f"{name}{suffix}" for name in CLOSED_MATRICES for suffix in ("", "_rates_1", "_rates")),
    "forward_rates_1",
    "forward_rates",
)
