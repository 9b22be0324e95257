"""Internal states of a compiled model: their rates, and the partials that couple them to the mechanics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from eomgen.arrays import Array
from eomgen.compiled.terms import Inputs, Parameters, States, Terms


class InternalPartials(NamedTuple):
    """Partials of the residual in z, (..., nv, nz), and of zdot in q (left-trivialised), v and z, (..., nz, nv or
    nz)."""

    residual_z: Array
    rate_q: Array
    rate_v: Array
    rate_z: Array


class InternalStates:
    """The part of a model that is about its internal states z: an array, a mapping from names, or None for the initial
    values."""

    evaluator: Terms

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the internal states, in the order of z."""
        return self.evaluator.state_names

    def internal_rates(
        self,
        q: ArrayLike,
        v: ArrayLike,
        z: States = None,
        t: ArrayLike = 0.0,
        u: Inputs = None,
        *,
        parameters: Parameters = None,
        base: ArrayLike | None = None,
    ) -> Array:
        """Return zdot = f(q, v, z, t, u), (..., nz)."""
        if not self.states:
            q, v, p = (
                self.evaluator.configuration(q),
                self.evaluator.velocity("v", v),
                self.evaluator.parameters(parameters),
            )
            return np.zeros((*np.broadcast_shapes(q.shape[:-1], v.shape[:-1], p.shape[:-1], np.shape(t)), 0))
        return self.evaluator.call("internal_rate", q=q, v=v, z=z, t=t, u=u, parameters=parameters, base=base)[0]

    def internal_partials(
        self,
        q: ArrayLike,
        v: ArrayLike,
        z: States = None,
        t: ArrayLike = 0.0,
        u: Inputs = None,
        *,
        parameters: Parameters = None,
        base: ArrayLike | None = None,
    ) -> InternalPartials:
        """Return the exact partials that ``partials`` has no columns and rows for: those in z, and those of zdot."""
        given = {"q": q, "v": v, "z": z, "t": t, "u": u}
        return InternalPartials(*self.evaluator.call("internal_partials", **given, parameters=parameters, base=base))
