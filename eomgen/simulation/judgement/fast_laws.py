"""Laws of time that vary faster than the steps of a run: inputs, and forces that depend on t.

A run sees them at its steps alone. One that oscillates at a multiple of the steps' frequency looks like a constant, to
runs with half the step as well, so no comparison of runs tells it. Here they are evaluated between the steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.errors import UsageError
from eomgen.results.finding import Finding
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import States

#: Steps at most that are looked into.
_MOST = 200
#: Place within a step, in steps: no small multiple of this is whole, so no oscillation hides from it.
_BETWEEN = 0.382
#: Deviation from the interpolation over the steps, over the standard deviation, both in quadratic mean, from which on
#: a law is not resolved by the steps: a sine with 2.2 steps to a period has it.
_UNSEEN = 0.8
#: Deviations below this part of the largest value are rounding.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class _Law:
    """A function of time: at the beginning of steps and at the end, and between as it is and as the steps show it,
    (steps,) each."""

    name: str
    unit: str
    ends: Array
    between: Array
    shown: Array

    @property
    def range(self) -> float:
        return float(np.ptp([*self.ends.ravel(), *self.between]))

    @property
    def off(self) -> float:
        """The largest deviation from the interpolation over the steps."""
        return float(np.max(np.abs(self.between - self.shown)))

    @property
    def unseen(self) -> bool:
        every = np.concatenate([self.ends.ravel(), self.between])
        if not np.all(np.isfinite(every)) or self.off <= _ROUNDING * float(np.max(np.abs(every))):
            return False
        deviation = float(np.sqrt(np.mean((self.between - self.shown) ** 2)))
        return deviation > _UNSEEN * float(np.std(every))


def fast_laws(run: Run, nodes: Array, ends: Array, states: States, parameters: Array) -> Finding | None:
    """Return a finding on laws of time that vary faster than steps resolve; None if there are none.

    Parameters
    ----------
    nodes : times in a step at which inputs are handed to the stepper, in steps, from 0 to 1
    ends : (n,) s, further ends of steps, at which forces jump or bend
    states : at the rows
    parameters : (np,), or (rows, np), at the rows
    """
    try:
        known = [law for law in (*_inputs(run, nodes, ends, states), *_forces(run, ends, states, parameters)) if law]
    except UsageError:  # a function of the caller that has no value between steps
        return None
    laws = [law for law in known if law.unseen]
    if not laws:
        return None
    law, step = max(laws, key=lambda one: one.off / one.range), run.settings["step"]
    more = f" (and {len(laws) - 1} more)" if len(laws) > 1 else ""
    size = f"up to {law.off:.3g} {law.unit} off the line through them, and varies by {law.range:.3g} {law.unit} in all"
    text = f"{law.name}{more} varies faster than the steps resolve: between them it is {size}"
    hint = f"a step much smaller than {step:.3g} s, 20 or more to a period, or its means over the steps"
    return Finding(value=law.off / law.range, text=text, hint=hint)


def _chosen(times: Array, step: float, last: float, ends: Array) -> NDArray[np.int_]:
    """Return places of some of the times at which whole steps begin in which no part ends."""
    most = 20 * _MOST
    candidates = np.unique(np.linspace(0, len(times) - 1, min(len(times), most)).astype(int))
    times = times[candidates]
    within = times + step <= last + 1e-9 * step
    slack = 1e-9 * step
    before, after = np.searchsorted(ends, times + slack), np.searchsorted(ends, times + step - slack)
    places = candidates[np.flatnonzero(within & (before == after))]
    some: NDArray[np.int_] = places[np.unique(np.linspace(0, len(places) - 1, min(len(places), _MOST)).astype(int))]
    return some


def _inputs(run: Run, nodes: Array, ends: Array, states: States) -> list[_Law]:
    model, step, last = run.model, run.settings["step"], float(states.t[-1])
    seen_at_nodes = run.takes_rows and run.method.inputs == "sampled"
    columns = [
        k
        for k, name in enumerate(model.inputs)
        if (seen_at_nodes and (not run.method.chooses_steps or name in run.signals.given))
        or not (run.method.chooses_steps or run.method.inputs == "series")
    ]
    columns = [k for k in columns if not isinstance(run.signals.given.get(model.inputs[k]), float)]
    if not columns:
        return []
    every: Array = run.grid.start + step * np.arange(round((last - run.grid.start) / step), dtype=float)
    begins: Array = every[_chosen(every, step, last, ends)]
    if not len(begins):
        return []
    shares = nodes if seen_at_nodes else np.array([0.0, 1.0])

    def rows(times: Array) -> Array:
        return run.signals.rows(times) if run.takes_rows else model.input_values(times, parameters=run.parameters)

    at_nodes = np.array([rows(begins + share * step) for share in shares])
    between = rows(begins + _BETWEEN * step)
    k = int(np.searchsorted(shares, _BETWEEN))
    part = (_BETWEEN - shares[k - 1]) / (shares[k] - shares[k - 1])
    shown = (1.0 - part) * at_nodes[k - 1] + part * at_nodes[k]
    units = model.input_units
    return [
        _Law(f"the input {name}", units.get(name, ""), at_nodes[:, :, j], between[:, j], shown[:, j])
        for j, name in ((k, model.inputs[k]) for k in columns)
    ]


def _forces(run: Run, ends: Array, states: States, parameters: Array) -> list[_Law]:
    """Return the forces of motions at rest in acceleration, with all held but the time."""
    model, method, step = run.model, run.method, run.settings["step"]
    if method.chooses_steps or method.inputs == "series" or "inverse_dynamics" not in model.functions:
        return []
    takes = next(item["inputs"] for item in model.library.layout["functions"] if item["name"] == "inverse_dynamics")
    if "t" not in takes:  # motions of the base that are too fast are refused
        return []
    places = _chosen(states.t[:-1], step, float(states.t[-1]), ends)
    if not len(places):
        return []
    t, q, v, z = states.t[places], states.q[places], states.v[places], states.z[places]
    p = parameters if parameters.ndim == 1 else parameters[places]
    u = None
    if model.nu:
        u = run.signals.rows(t) if run.takes_rows else model.input_values(t, parameters=p)

    def forces(share: float) -> Array:
        return model.inverse_dynamics(q, v, np.zeros_like(v), t + share * step, u, z=z, parameters=p)

    first, between, last = (forces(share) for share in (0.0, _BETWEEN, 1.0))
    shown = (1.0 - _BETWEEN) * first + _BETWEEN * last
    kinds = {"rad/s": "N m", "m/s": "N"}
    return [
        _Law(
            f"the force along {name.removeprefix('v.')}, which depends on t,",
            kinds.get(unit, ""),
            np.array([first[:, j], last[:, j]]),
            between[:, j],
            shown[:, j],
        )
        for j, (name, unit) in enumerate(zip(model.v_names, model.v_units, strict=True))
    ]
