"""The consistent states of many samples at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.initial_state import kept_components
from eomgen.solvers.consistency import (
    Chosen,
    ConsistentStates,
    ConstrainedSamples,
    consistent_states,
)
from eomgen.system.description import WrittenStart
from eomgen.system.terms import PURPOSES

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

__all__ = ["ConsistentStates", "consistent_samples"]


def consistent_samples(
    model: CompiledModel, q: Array, v: Array, t: float, parameters: Array, starts: Sequence[WrittenStart] = ()
) -> ConsistentStates:
    """Return for each sample the state nearest to the guess that meets the constraints, as ``model.consistent`` does
    one by one, with a mask of the samples that are met.

    Last digits may differ. Samples that are not met have to be examined by ``model.consistent``, which says why; so
    have all samples at parameters at which rows that were left out have to be checked. No sample is met in models with
    elastic bodies, or without the terms of assembly.

    Parameters
    ----------
    q, v : (n, nq), (n, nv) guesses
    t : time, s
    parameters : (n, np)
    starts : written parts of the guesses, which are kept as far as constraints allow
    """
    if model.description.exact_beams or model.library.layout["slopes"]:  # joints turn before beams deform
        return ConsistentStates(q, v, np.zeros(len(q), dtype=bool))
    needed = PURPOSES["initial_assembly"]
    able = model.having(needed)
    if any(name not in able.functions for name in needed):
        return ConsistentStates(q, v, np.zeros(len(q), dtype=bool))
    holonomic = model.functions.sizes["holonomic"]
    rows = len(model.multipliers)

    def at(name: str, chosen: Chosen, **state: Array) -> Array:
        return next(iter(able.evaluate(name, t=t, parameters=parameters[chosen], **state).values()))

    def sizes(q: Array, chosen: Chosen) -> tuple[Array, Array]:
        result = able.evaluate("constraint_size", q, t=t, parameters=parameters[chosen])
        values = np.concatenate(list(result.values()), axis=-1)
        return values[:, :rows], values[:, rows:]

    system = ConstrainedSamples(
        factors=model.factors,
        lengths=np.array([unit not in ("1", "1/s") for unit in model.library.layout["row_units"]], dtype=bool),
        angular=np.array([unit == "rad/s" for unit in model.v_units], dtype=bool),
        holonomic=holonomic,
        constraint=lambda q, chosen: at("constraint", chosen, q=q) if holonomic else np.zeros((len(q), 0)),
        velocity=lambda q, v, chosen: at("constraint_velocity", chosen, q=q, v=v),
        jacobian=lambda q, chosen: at("constraint_jacobian", chosen, q=q),
        mass=lambda q, chosen: able.mass(q, parameters=parameters[chosen]),
        sizes=sizes,
    )
    result = consistent_states(system, q, v, kept_components(model.factors, starts))
    return result._replace(q=model.evaluator.follow_angles(result.q, t, parameters))
