"""Whether a run starts with a joint beyond its limits, at the parameters and initial values of the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from eomgen.scene.formula.evaluate import evaluate
from eomgen.scene.formula.nodes import Formula
from eomgen.scene.joints.limit_warnings import beyond_limits

if TYPE_CHECKING:
    from eomgen.compiled.model import Model


def starts_beyond_limits(model: Model, q: NDArray[np.float64], p: NDArray[np.float64]) -> list[str]:
    """Return one sentence for each coordinate beyond a limit; of joints between absolute bodies where q has their angles."""
    values = {item.name: item.value for item in model.scene.parameters} | dict(zip(model.parameters, p.tolist(), strict=True))
    places = _places(model)

    def value(formula: Formula) -> float:
        return evaluate(formula, lambda symbol: values[symbol.name])

    stopped = [joint for joint in model.scene.joints if joint.stops and joint.name in places]
    return [note for joint in stopped for note in beyond_limits(joint, q[places[joint.name]].tolist(), value)]


def _places(model: Model) -> dict[str, slice]:
    """Return where the coordinates of joints are in q."""
    if model.scene.coordinates != "absolute":
        return {factor.name: factor.q for factor in model.factors}
    angles = {name: model.nq - len(model.angles) + number for number, name in enumerate(model.angles)}
    places = {}
    for joint in model.scene.joints:
        own = [place for name, place in angles.items() if name.partition(".")[0] == joint.name]
        if own:
            places[joint.name] = slice(own[0], own[-1] + 1)
    return places
