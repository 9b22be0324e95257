"""The terms that a model needs for its linear models, and for the states that they are about."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def terms_needed(model: CompiledModel) -> list[str]:
    """Return the terms from which linear models and the states they are about are made."""
    terms = ["mass", "residual", "partials", "linearization", "poses"]
    if model.multipliers:
        terms += ["constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian", "constraint_size"]
        terms += ["velocity_partials", "acceleration_partials"]
    if model.scene.coordinates == "absolute":
        terms += ["joint_velocities"]
    if not model.multipliers:
        terms += ["forward_dynamics"]
    if model.nz:
        terms += ["internal_rate", "internal_partials"]
    return terms + (["output_partials"] if model.library.layout["outputs"] else [])
