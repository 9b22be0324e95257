"""Equations of motion as callables on NumPy arrays, and the states that a stepper makes of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from eomgen.lie.product import Factor

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Constraints:
    """Constraint equations as callables; ``holonomic`` rows come first.

    Attributes
    ----------
    position : (t, q) -> Phi
    rate : (t, q, v) -> w = (B v + Phi_t, rows at velocity level)
    bias : (t, q, v) -> g, the rate of w at vdot = 0
    jacobian : (t, q) -> B
    rate_partials : (t, q, v) -> Z, the left-trivialised derivative of w by q
    """

    holonomic: int
    position: Callable[[float, Array], Array]
    rate: Callable[[float, Array, Array], Array]
    bias: Callable[[float, Array, Array], Array]
    jacobian: Callable[[float, Array], Array]
    rate_partials: Callable[[float, Array, Array], Array]


@dataclass(frozen=True)
class InternalStates:
    """Equations of first order as callables, and how they and the mechanics act on each other.

    Attributes
    ----------
    rate : (t, q, v, z) -> zdot
    partials : (t, q, v, z) -> (Rz, Fq, Fv, Fz), derivatives of the residual by z, and of zdot by q (left-trivialised),
        v and z
    """

    rate: Callable[[float, Array, Array, Array], Array]
    partials: Callable[[float, Array, Array, Array], tuple[Array, Array, Array, Array]]


@dataclass(frozen=True)
class Equations:
    """Equations of motion as callables; inputs and base motion are functions of t inside them.

    Attributes
    ----------
    factors : sequence of Factor
    forward_dynamics : (t, q, v) -> vdot; unconstrained systems only
    residual : (t, q, v, vdot) -> r, zero along motions; implicit methods only. With constraints (t, q, v, vdot, lam) ->
        r
    partials : of the same arguments -> (K, C, M), the left-trivialised derivatives of r by q, v and vdot; implicit
        methods only
    constraints : Constraints, optional
    internal : InternalStates, optional; the mechanical callables then take z by its name
    followed : (t, q) -> q with what it counts over turns brought to where its poses are, optional
    """

    factors: Sequence[Factor]
    forward_dynamics: Callable[[float, Array, Array], Array] | None
    residual: Callable[..., Array] | None = None
    partials: Callable[..., tuple[Array, Array, Array]] | None = None
    constraints: Constraints | None = None
    internal: InternalStates | None = None
    followed: Callable[[float, Array], Array] | None = None

    def at(self, z: Array) -> Equations:
        """Return the mechanical equations with the internal states held."""
        if self.internal is None:
            return self
        held = {
            name: partial(call, z=z)
            for name in ("forward_dynamics", "residual", "partials")
            if (call := getattr(self, name)) is not None
        }
        return replace(self, **held, internal=None)  # type: ignore[arg-type]  # by name

    def rate(self, t: float, q: Array, v: Array, z: Array) -> Array:
        """Return zdot."""
        return np.zeros(0) if self.internal is None else self.internal.rate(t, q, v, z)


@dataclass(frozen=True)
class Trajectory:
    """States at the steps, the initial one first: t (n+1,), q (n+1, nq), v, vdot (n+1, nv), lam, z; Newton iterations
    in all."""

    t: Array
    q: Array
    v: Array
    vdot: Array
    lam: Array
    z: Array
    iterations: int = 0
