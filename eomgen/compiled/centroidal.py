"""Centre of mass and centroidal momentum of a compiled model.

All in world axes, of all bodies that move against the base; momenta angular first (Pinocchio's are linear first: its Ag
has our rows in the order 3, 4, 5, 0, 1, 2). Matrices map velocities against the base, columns belong to the components
of v. Terms are compiled at the first call if the model was built without them.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.compiled.terms import Extensible, Parameters


def center_of_mass(
    model: Extensible,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the centre of mass in the world, (..., 3), m."""
    return _called(model, "center_of_mass", q=q, t=t, parameters=parameters, base=base)[0]


def total_mass(model: Extensible, *, parameters: Parameters = None) -> Array:
    """Return the mass of all that moves against the base, (...), kg."""
    q = model.evaluator.initial_q
    mass: Array = _called(model, "center_of_mass", q=q, parameters=parameters)[1][..., 0]
    return mass


def center_of_mass_jacobian(
    model: Extensible,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return J, (..., 3, nv): the velocity of the centre of mass against the base is J v."""
    return _called(model, "center_of_mass_jacobian", q=q, t=t, parameters=parameters, base=base)[0]


def center_of_mass_drift(
    model: Extensible,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return dJ/dt v, (..., 3): on a base at rest the centre of mass accelerates with J a + dJ/dt v."""
    return _called(model, "center_of_mass_drift", q=q, v=v, t=t, parameters=parameters, base=base)[0]


def centroidal_momentum(
    model: Extensible,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the centroidal momentum matrix A, (..., 6, nv): A v is the momentum about the centre of mass.

    Orin, Goswami and Lee, Autonomous Robots 35 (2013) 161.
    """
    return _called(model, "centroidal_momentum", q=q, t=t, parameters=parameters, base=base)[0]


def centroidal_momentum_rate(
    model: Extensible,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return dA/dt along v, (..., 6, nv)."""
    return _called(model, "centroidal_momentum_rate", q=q, v=v, t=t, parameters=parameters, base=base)[0]


def centroidal_drift(
    model: Extensible,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return dA/dt v, (..., 6): on a base at rest the momentum changes with A a + dA/dt v."""
    return _called(model, "centroidal_drift", q=q, v=v, t=t, parameters=parameters, base=base)[0]


def _called(model: Extensible, term: str, **given: Any) -> tuple[Array, ...]:
    return model.having((term,)).evaluator.call(term, **given)
