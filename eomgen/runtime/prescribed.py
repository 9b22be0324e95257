"""What the scene of a compiled model prescribes over time: the motion of its base, its inputs, and where they jump."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.build.library import Library
from eomgen.errors import UsageError
from eomgen.runtime.arguments import numbers
from eomgen.runtime.terms import Parameters, Terms

Array = NDArray[np.float64]


class Prescribed:
    """The part of a model that is about time alone; what is given here can be handed in otherwise at every call."""

    library: Library
    _terms: Terms

    def base(self, t: ArrayLike = 0.0, *, parameters: Parameters = None) -> Array:
        """Return the prescribed state of the base at t, (..., 19).

        Quaternion (4) and position (3) in the world; omega, velocity, and the time derivatives of their components, in base
        axes (3 each). An array of this kind can be handed in as ``base`` in place of the scene's law.
        """
        p = self._terms.parameters(parameters)
        if "base" not in self._terms.functions:
            rest = np.zeros((*np.broadcast_shapes(numbers("t", t).shape, p.shape[:-1]), self._terms.functions.sizes["base"]))
            rest[..., 0] = 1.0
            return rest
        return self._terms.functions("base", {"t": numbers("t", t), "p": p})[0]

    def input_values(self, t: ArrayLike = 0.0, *, parameters: Parameters = None) -> Array:
        """Return the inputs that the scene's formulas give at t, (..., nu); 0 where there is none."""
        return self._terms.formula_inputs({"t": numbers("t", t), "p": self._terms.parameters(parameters)})

    def discontinuity_times(self, start: float, end: float, *, order: int = 2) -> Array:
        """Return the times from start to end, (n,), at which a derivative of forces up to an order is known to jump.

        0: forces themselves, 1: their rates, 2: their second derivatives. The steppers end their steps there by themselves; for
        solvers of others these are the times between which the motion is smooth.
        """
        if end < start:
            raise UsageError(f"the end {end:.9g} s lies before the start {start:.9g} s", "a later end")
        found: set[float] = set()
        for item in self.library.layout["discontinuities"]:
            time, period = float(item["time"]), float(item["period"])
            if item["order"] > order:
                continue
            if period == 0.0:
                found |= {time} if start <= time <= end else set()
                continue
            first = math.ceil((start - time) / period)
            found |= {time + k * period for k in range(first, math.floor((end - time) / period) + 1)}
        return np.array(sorted(found)) + 0.0  # no minus zero
