"""Recorders of terms that most models have not: of long scenes, linear models, derivatives in parameters, beams."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise

from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.argument_derivatives import input_derivatives
from eomgen.mechanics.terms.centroidal import CENTROIDAL_RECORDERS, momenta
from eomgen.mechanics.terms.implicit_step import equations, iteration, jacobian_values, mass_values
from eomgen.mechanics.terms.linearization import (
    acceleration_partials,
    constraint_acceleration,
    joint_velocity_partials,
    linearization,
    output_parameter_partials,
    output_partials,
    parameter_partials,
    reaction_partials,
    second_partials,
)
from eomgen.mechanics.terms.regressor import regressor_blocks, regressor_parameters
from eomgen.system.system import Block


def section_loads(derivation: Derivation) -> list[Block]:
    """Return the blocks ``x``, ``strain``, ``load``, ``load_at_ends`` and ``load_on_halves`` of all elements of exact
    beams.

    x, m, is the middle of each element at rest. A load is exerted by the outer part of the beam on a section: moment, N
    m, then force, N, in the axes of the section. Elements transmit loads from node to node; loads on the halves of
    elements are a separate block.
    """
    beams = derivation.section_loads.beams
    rows = [row for beam in beams for row in derivation.section_loads.rows(beam.name)]
    middles = [derivation.algebra.scalar(0.5 * (start + end)) for beam in beams for start, end in pairwise(beam.places)]
    count = len(rows)
    strain = [value for row in rows for value in row[:6]]
    mean = [value for row in rows for value in row[6:12]]
    ends = [value for row in rows for value in row[12:]]
    halves = [value for beam in beams for row in derivation.section_loads.halves(beam.name) for value in row]
    where = f"of each element of {', '.join(beam.name for beam in beams)}"
    return [
        derivation.block("x", (count,), middles, f"place at rest of the middle {where}, m"),
        derivation.block("strain", (count, 6), strain, f"twist, curvature about y and z, stretch, shear {where}"),
        derivation.block("load", (count, 6), mean, f"mean moment and force of the sections {where}"),
        derivation.block("load_at_ends", (count, 2, 6), ends, f"load at the first and the last node {where}"),
        derivation.block("load_on_halves", (count, 2, 6), halves, f"distributed load, weight, inertia, halves {where}"),
    ]


FURTHER_RECORDERS: Mapping[str, Callable[[Derivation], list[Block]]] = {
    "mass_values": mass_values,
    "constraint_acceleration": constraint_acceleration,
    "equations": equations,
    "iteration": iteration,
    "jacobian_values": jacobian_values,
    **CENTROIDAL_RECORDERS,
    "section_loads": section_loads,
    "linearization": linearization,
    "acceleration_partials": acceleration_partials,
    "output_partials": output_partials,
    "parameter_partials": parameter_partials,
    "output_parameter_partials": output_parameter_partials,
    "input_derivatives": input_derivatives,
    "second_partials": second_partials,
    "reaction_partials": reaction_partials,
    "joint_velocities": joint_velocity_partials,
    "regressor": regressor_blocks,
    "regressor_parameters": regressor_parameters,
    "momenta": momenta,
}
