"""Whether a run starts with a joint beyond its limits, at the parameters and initial values of the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from eomgen.scene.evaluate import evaluate
from eomgen.scene.formula_nodes import Formula
from eomgen.scene.limit_notes import beyond_limits

if TYPE_CHECKING:
    from eomgen.runtime.model import Model


def starts_beyond_limits(model: Model, q: NDArray[np.float64], p: NDArray[np.float64]) -> list[str]:
    """Return one sentence for each coordinate beyond a limit; of absolute bodies, whose joints have no coordinates, none."""
    if model.scene.coordinates == "absolute":
        return []
    values = {item.name: item.value for item in model.scene.parameters} | dict(zip(model.parameters, p.tolist(), strict=True))
    places = {factor.name: factor.q for factor in model.factors}

    def value(formula: Formula) -> float:
        return evaluate(formula, lambda symbol: values[symbol.name])

    stopped = [joint for joint in model.scene.joints if joint.stops and joint.name in places]
    return [note for joint in stopped for note in beyond_limits(joint, q[places[joint.name]].tolist(), value)]
