"""Initial states on the constraints: sentences on the changes of a start by the constraints, and the consistent states
of many samples at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import distinct
from eomgen.solvers.beams import STRAINED
from eomgen.solvers.consistency import Assembly, Chosen, ConsistentStates, ConstrainedSamples, consistent_states
from eomgen.system.terms import PURPOSES

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

__all__ = ["ConsistentStates", "consistent_samples"]


def consistent_samples(model: CompiledModel, q: Array, v: Array, t: float, parameters: Array) -> ConsistentStates:
    """Return the states nearest to guesses that meet the constraints, as ``model.consistent`` does one by one.

    Last digits may differ from the result of ``model.consistent``. Samples that are not met have to be examined by
    ``model.consistent``, which says why; so have all samples at parameters at which rows that were left out have to be
    checked.

    Parameters
    ----------
    q, v : (n, nq), (n, nv)
    t : s
    parameters : (n, np)
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
    result = consistent_states(system, q, v)
    return result._replace(q=model.evaluator.followed(result.q, t, parameters))


#: Beginning of the sentence.
CORRECTED = "corrected onto the constraints: "
#: Parts of the machine, of 1 rad, or of the largest velocity of the unit, from which on a change is reported; how many
#: are listed.
_TOLD, _LISTED = 1e-6, 6


def tells_strain(sentence: str) -> bool:
    """Return whether a sentence on a start is about beams that a loop strains."""
    return STRAINED in sentence


def corrected_start(
    consistent: Assembly,
    guess: tuple[Array, Array],
    names: tuple[Sequence[str], Sequence[str]],
    units: tuple[Sequence[str], Sequence[str]],
) -> list[str]:
    """Return one sentence on the largest changes from a guess to a consistent state; none if changes are small.

    Parameters
    ----------
    guess, names, units : of q and of v
    """
    changed = []
    held = (consistent.violations, {**consistent.violations, **consistent.rate_violations})
    for before, after, labels, measured, off in zip(
        guess, (consistent.q, consistent.v), names, units, held, strict=True
    ):
        largest = np.maximum(np.abs(before), np.abs(after))[: len(measured)]  # references of turns have no name
        arms = [consistent.extent if unit == "rad/s" else 1.0 for unit in measured]  # of turns that move parts by m/s
        fastest = float(np.max(largest * arms, initial=0.0))
        for k, (name, unit) in enumerate(zip(labels, measured, strict=True)):
            size = consistent.extent if unit == "m" else 1.0
            if unit in ("m/s", "rad/s"):
                size = fastest / arms[k] if arms[k] else 0.0
            elif unit.endswith("/s"):
                size = max(largest[index] for index, other in enumerate(measured) if other == unit)
            share = abs(after[k] - before[k]) / size if off and size else 0.0
            if share > _TOLD:
                first, second = distinct(before[k] + 0.0, after[k] + 0.0)
                changed.append((share, f"{name} {first} -> {second}{'' if unit in ('', '1') else f' {unit}'}"))
    changed.sort(key=lambda change: -change[0])
    more = f" and {len(changed) - _LISTED} more" if len(changed) > _LISTED else ""
    return [f"{CORRECTED}{', '.join(text for _, text in changed[:_LISTED])}{more}"] if changed else []
