"""Equilibrium start in generated C: the static equilibrium is found when the folder is made, not by the C."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from eomgen.errors import EomgenError
from eomgen.system.terms import PURPOSES

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.pipeline.model import Model
    from eomgen.system.system import Quantity

#: Parameters that are named with their values.
_LISTED = 12


def with_equilibrium_start(
    program: Program,
    build: Callable[[Sequence[str]], Model],
    parameters: Mapping[str, float | str] | None = None,
) -> Program:
    """Return a Program with the initial state of ``simulate`` at its parameters, documented in its README.

    Without an equilibrium the initial state is the joints' own; a RuntimeWarning and the README report it.

    Parameters
    ----------
    build : callable
        Builds the model in which the equilibrium is looked for, with the terms given.
    parameters : mapping
        Values of the program's parameters that are not the scene's own.
    """
    try:
        model = build(PURPOSES["equilibrium"])
        rest = model.equilibrium(parameters=parameters)
        q, v = rest.q, np.where(rest.v != 0.0, rest.v, model.initial_v)
        if model.multipliers:
            consistent = model.consistent(q, v, parameters=parameters)
            q, v = consistent.q, consistent.v
    except EomgenError as error:
        problem = error.problems[0]
        reason = f"{problem.where}: {problem.what}" if problem.where else problem.what
        start = (
            "The scene asks for a start at static equilibrium, which was not found when this code was made, so it"
            f" starts at the initial state of the joints. The reason: {reason}"
        )
        warnings.warn(f"{program.prefix}: {start}", RuntimeWarning, stacklevel=3)
        return replace(program, start=f"{start}.")
    left = f"below 1e{math.ceil(math.log10(rest.acceleration))}" if rest.acceleration else "zero"
    start = (
        f"It starts at static equilibrium, found when this code was made, {_at(program.parameters, program.inputs)}."
    )
    start += (
        f" The accelerations left unbalanced there, in m/s^2 or rad/s^2, are {left}; velocities are those of the"
        f" joints{' and of the drives' if np.any(rest.v) else ''}."
    )
    for note in rest.message.split("; ")[1:]:
        start += f" Note: {note}."
    if program.parameters or program.inputs:
        start += " Other values have their equilibrium elsewhere, and the C does not look for it."
    state = [tuple(map(float, values)) for values in (q, v, rest.z)]
    return replace(program, start=start, initial_q=state[0], initial_v=state[1], initial_z=state[2])


def _at(parameters: tuple[Quantity, ...], inputs: tuple[Quantity, ...]) -> str:
    """Return at which values the equilibrium was found."""
    listed = ", ".join(
        f"{item.name} = {item.value:.9g}{f' {item.unit}' if item.unit else ''}" for item in parameters[:_LISTED]
    )
    listed += f" and {len(parameters) - _LISTED} more" if len(parameters) > _LISTED else ""
    at = f"at the default parameters ({listed})" if listed else "for the scene as it is"
    return f"{at} and the inputs of the scene at t = 0" if inputs else at
