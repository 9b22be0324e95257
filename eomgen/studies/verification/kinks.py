"""Where differences notice that a function bends or jumps, and which formula does: remarks, not failures.

A derivative on one side is what complex steps and the closed form both give there, and these must agree.
"""

from __future__ import annotations

import numpy as np

from eomgen.studies.verification.claims.claim import Form
from eomgen.studies.verification.differences import Differences
from eomgen.studies.verification.engines import Array, Blocks, Engine, moved
from eomgen.studies.verification.roughness import Rough
from eomgen.studies.verification.tolerances import BARS, Sizes

#: Error bars above this part of a state's size: differences say nothing there.
NO_DIGITS = 1e-2
#: Directions of a state that are looked along for kinks.
_LOOKED_AT = 64
#: How near a kink is where differences have no digits because of it.
_CLOSE = 1e-8
#: Formulas that are named, of many at once.
_NAMED = 4


class Remarks:
    """What is remarked of a form, with the states that it is remarked at."""

    def __init__(self) -> None:
        self._states: dict[tuple[str, str], dict[str, None]] = {}

    def add(self, state: str, what: str, of: str = "") -> None:
        """Remark ``what`` at a state, of a formula if it is one's fault."""
        self._states.setdefault((what, of), {})[state] = None

    @property
    def texts(self) -> tuple[str, ...]:
        """One sentence for each thing and its states; of many formulas the first are named."""
        alike: dict[tuple[str, tuple[str, ...]], list[str]] = {}
        for (what, of), where in self._states.items():
            alike.setdefault((what, tuple(where)), []).append(of)
        texts = []
        for (what, states), formulas in alike.items():
            more = f" and {len(formulas) - _NAMED} more" if len(formulas) > _NAMED else ""
            named = f" ({', '.join(formulas[:_NAMED])}{more})" if formulas[0] else ""
            texts.append(f"{what} at {', '.join(states)}{named}")
        return tuple(texts)


def bends(
    form: Form, engine: Engine, rough: Rough, state: Blocks, names: tuple[str, ...], value: Array, finite: Array,
    found: Differences, sizes: Sizes, remarks: Remarks,
) -> Array:  # fmt: skip
    """Return the entries near which a formula bends or jumps (S, R, C), as far as differences notice, and remark what does."""
    with np.errstate(all="ignore"):
        off = np.abs(found.best - value) > BARS * found.bar + sizes.differences
    vague = finite & ~(found.bar <= NO_DIGITS * sizes.state)
    odd = off | vague | found.kink
    bent = np.zeros(value.shape, bool)
    if not odd.any() or form.directions is None:
        return bent
    rates = form.directions(state)
    count = max(rate.shape[-2] for rate in rates.values())
    for k in np.flatnonzero(odd.any(axis=(-2, -1))):
        here = {name: array[k] for name, array in state.items()}
        seen: dict[tuple[int, float], list[str]] = {}
        for row, column in np.argwhere(odd[k]):
            at = (k, row, column)
            step = float(found.step[at] if off[at] else found.kink_step[at] if found.kink[at] else _CLOSE)
            decided: list[str] = []
            for direction in [int(column)] if form.combine is None else range(count):
                if (direction, step) not in seen and len(seen) < _LOOKED_AT:
                    seen[direction, step] = _decided(rough, engine, here, rates, int(k), direction, step)
                decided += seen.get((direction, step), [])
            bent[at] = bool(decided)
            for what in decided:
                remarks.add(names[k], "not smooth", what)
        if (vague[k] & ~bent[k]).any():
            remarks.add(names[k], "differences have no digits")
    return bent


def _decided(
    rough: Rough, engine: Engine, here: Blocks, rates: Blocks, state: int, direction: int, step: float
) -> list[str]:
    """Return what is decided in another way a step before or behind a state."""
    along = {}
    for name, rate in rates.items():
        of_state = rate[state] if rate.ndim == 3 else rate
        along[name] = of_state[min(direction, len(of_state) - 1)]
    return rough.decisions([moved(engine, here, along, -step), here, moved(engine, here, along, step)])
