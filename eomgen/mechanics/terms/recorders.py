"""Table of the functions that record each term without time derivatives, and that return its blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.terms.centroidal import CENTROIDAL_RECORDERS
from eomgen.mechanics.terms.events import event_actions, event_impulse, events
from eomgen.mechanics.terms.forward_dynamics import forward_blocks
from eomgen.mechanics.terms.frames import FRAME_RECORDERS
from eomgen.mechanics.terms.implicit_step import equations, iteration, jacobian_values
from eomgen.mechanics.terms.linearization import (
    acceleration_partials,
    joint_velocity_partials,
    linearization,
    output_partials,
)
from eomgen.mechanics.terms.momenta import momenta
from eomgen.mechanics.terms.parameters import output_parameter_partials, parameter_partials
from eomgen.mechanics.terms.regressor import regressor_blocks, regressor_parameters
from eomgen.mechanics.terms.samples import samples
from eomgen.mechanics.terms.second_partials import second_partials
from eomgen.mechanics.terms.section_loads import section_loads
from eomgen.system.system import Block

RECORDERS: Mapping[str, Callable[[Derivation], list[Block]]] = {
    "mass": Derivation.mass,
    "coupling": Derivation.coupling,
    "force": Derivation.force,
    "base_motion": Derivation.base_motion,
    "inverse_dynamics": Derivation.inverse_dynamics,
    "forward_dynamics": forward_blocks,
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
    "equations": equations,
    "iteration": iteration,
    "jacobian_values": jacobian_values,
    "poses": Derivation.poses,
    "twists": Derivation.twists,
    "accelerations": Derivation.accelerations,
    "jacobians": Derivation.jacobians,
    **FRAME_RECORDERS,
    **CENTROIDAL_RECORDERS,
    "outputs": Derivation.outputs,
    "events": events,
    "event_actions": event_actions,
    "event_impulse": event_impulse,
    "samples": samples,
    "elastic": Derivation.elastic,
    "section_loads": section_loads,
    "linearization": linearization,
    "acceleration_partials": acceleration_partials,
    "output_partials": output_partials,
    "parameter_partials": parameter_partials,
    "output_parameter_partials": output_parameter_partials,
    "second_partials": second_partials,
    "joint_velocities": joint_velocity_partials,
    "regressor": regressor_blocks,
    "regressor_parameters": regressor_parameters,
    "energy": Derivation.energy,
    "momenta": momenta,
}
