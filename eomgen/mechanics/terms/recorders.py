"""Functions that record each term without time derivatives, and that return its blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.events import event_actions, event_impulse, events, samples
from eomgen.mechanics.terms.forward_dynamics import forward_blocks
from eomgen.mechanics.terms.frames import FRAME_RECORDERS
from eomgen.system.system import Block

Recorder = Callable[[Derivation], list[Block]]

_RECORDERS: Mapping[str, Recorder] = {
    "mass": Derivation.mass,
    "coupling": Derivation.coupling,
    "force": Derivation.force,
    "base_motion": Derivation.base_motion,
    "inverse_dynamics": Derivation.inverse_dynamics,
    "forward_dynamics": partial(forward_blocks, ordered=True),
    "residual": Derivation.residual,
    "partials": Derivation.partials,
    "internal_rate": Derivation.internal_rate,
    "internal_partials": Derivation.internal_partials,
    "constraint": Derivation.constraint,
    "constraint_velocity": Derivation.constraint_velocity,
    "constraint_bias": Derivation.constraint_bias,
    "constraint_jacobian": Derivation.constraint_jacobian,
    "constraint_size": Derivation.constraint_size,
    "velocity_partials": Derivation.velocity_partials,
    "poses": Derivation.poses,
    "twists": Derivation.twists,
    "accelerations": Derivation.accelerations,
    "jacobians": Derivation.jacobians,
    **FRAME_RECORDERS,
    "outputs": Derivation.outputs,
    "events": events,
    "event_actions": event_actions,
    "event_impulse": event_impulse,
    "samples": samples,
    "elastic": Derivation.elastic,
    "energy": Derivation.energy,
}


def recorder(name: str) -> Recorder:
    """Return the function that records a term."""
    if name in _RECORDERS:
        return _RECORDERS[name]
    from eomgen.mechanics.terms.further_recorders import FURTHER_RECORDERS  # noqa: PLC0415  # terms of few models

    return FURTHER_RECORDERS[name]


def differentiand_recorder(name: str) -> Recorder:
    """Return the function that records a term whose derivatives are recorded."""
    return forward_blocks if name == "forward_dynamics" else recorder(name)
