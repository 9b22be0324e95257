"""Results of rows that are no runs: probabilities, frequencies, loads, rates at a state; each by public calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

import eomgen

Array = NDArray[np.float64]


def probability(
    model: eomgen.Model,
    method: str,
    below: Sequence[float] = (),
    above: Sequence[float] = (),
    **options: Any,
) -> Mapping[str, Array]:
    """Return the probability that the output ``g`` is below or above one of the thresholds, by a method."""
    study = eomgen.random_vibration(model, "g", thresholds=[*below, *above], **options)
    found = study.distributions[method]
    parts = [*found.below[: len(below)], *found.above[len(below) :]]
    return {"probability": np.array([[sum(parts)]])}


def rates(
    model: eomgen.Model, q: Sequence[float] | None = None, v: Sequence[float] | None = None
) -> Mapping[str, Array]:
    """Return the accelerations of all joints, ``rates``, and the outputs at a state, by default the initial one."""
    place, speed = (
        np.asarray(first if given is None else given, float)
        for given, first in ((q, model.initial_q), (v, model.initial_v))
    )
    both = model.rhs(0.0, np.concatenate([place, speed, model.initial_z]))
    found = {name: np.reshape(value, (1, -1)) for name, value in model.outputs(place, speed).items()}
    return found | {"rates": both[None, model.nq : model.nq + model.nv]}


def frequencies(
    model: eomgen.Model,
    count: int,
    parameters: Mapping[str, float] | None = None,
) -> Mapping[str, Array]:
    """Return the lowest undamped frequencies, Hz, about rest or about rest on a part that turns."""
    found = model.linearize(parameters=parameters).modes().undamped_frequency
    return {"frequencies": np.sort(found)[None, :count]}


def flutter(model: eomgen.Model, parameter: str, low: float, high: float) -> Mapping[str, Array]:
    """Return the load at which the two lowest angular frequencies meet, and that frequency."""

    def squares(load: float) -> Array:
        found = -(model.linearize(parameters={parameter: load}).modes().eigenvalues ** 2)
        return np.asarray(found[np.argsort(found.real)][:2])

    load = optimize.brentq(lambda x: float((np.diff(squares(x))[0] ** 2).real), low, high, xtol=1e-12)
    return {"load": np.array([[load]]), "frequency": np.array([[np.sqrt(squares(load).real.mean())]])}


#: Results by the names that rows of ``runs*.toml`` give.
QUANTITIES: Mapping[str, Callable[..., Mapping[str, Array]]] = {
    "probability": probability,
    "rates": rates,
    "frequencies": frequencies,
    "flutter": flutter,
}
