"""The names of the terms that a scene can ask for, and the ones that others have for them."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.text import nearest

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
    "constraint_size",
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
    "joint_velocities",
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

#: What the field and its programs call a term, in lower case, and its name here.
_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(("inertia", "inertia_matrix", "mass_matrix", "joint_space_inertia", "m", "crba"), "mass"),
    **dict.fromkeys(("h", "bias", "nle", "centrifugal", "gyroscopic", "coriolis_vector", "nonlinear"), "coupling"),
    **dict.fromkeys(("q", "gravity", "forcing", "generalized_force", "applied_force"), "force"),
    **dict.fromkeys(("tau", "torque", "efforts", "rnea", "inverse"), "inverse_dynamics"),
    **dict.fromkeys(("vdot", "aba", "forward", "qdd"), "forward_dynamics"),
    **dict.fromkeys(("kinetic", "potential", "energies", "kinetic_energy", "potential_energy", "lagrangian"), "energy"),
    **dict.fromkeys(("derivatives", "gradients", "tangent"), "partials"),
    **dict.fromkeys(("stiffness", "damping", "linear"), "linearization"),
    **dict.fromkeys(("kinematics", "forward_kinematics", "positions", "frames"), "poses"),
    **dict.fromkeys(("velocity", "velocities"), "twists"),
    **dict.fromkeys(("phi", "constraints", "loops"), "constraint"),
    **dict.fromkeys(("g_q", "phi_q", "lambda", "multipliers"), "constraint_jacobian"),
    "b": "base_motion",
}


def meant_term(name: str) -> str:
    """Return the term that a name stands for elsewhere; empty where there is none."""
    return _ELSEWHERE.get(name.lower(), "")


def nearest_term(name: str) -> str:
    """Return a hint for a name that is no term: the term that it stands for elsewhere, else those whose names are closest."""
    if meant := meant_term(name):
        return meant
    plain = [term for term in TERMS if "rates" not in term]  # the others are near to what they are derivatives of
    return nearest(name, TERMS if "rate" in name else plain)
