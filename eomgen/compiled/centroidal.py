"""Centre of mass and centroidal momentum of a compiled model.

All in world axes, of all bodies that move against the base; momenta angular first (Pinocchio's are linear first: its Ag
has our rows in the order 3, 4, 5, 0, 1, 2). Matrices map velocities against the base, columns belong to the components
of v. Terms are compiled at the first call if the model was built without them.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.compiled.terms import ExtensibleModel, Parameters


def center_of_mass(
    model: ExtensibleModel,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the centre of mass of all bodies that move against the base; without any mass, the base's origin.

    The term is compiled at the first call if the model was built without it.

    Parameters
    ----------
    q : array_like
        Configuration (..., nq).
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    (..., 3) ndarray
        Position in the world, m.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.center_of_mass([0.8, -0.3]).round(4)
    array([ 0.4306,  0.    , -0.46  ])
    """
    return _call(model, "center_of_mass", q=q, t=t, parameters=parameters, base=base)[0]


def total_mass(model: ExtensibleModel, *, parameters: Parameters = None) -> Array:
    """Return the mass of all bodies that move against the base.

    Parameters
    ----------
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    (...) ndarray
        Mass, kg.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> float(model.total_mass())
    1.6
    >>> float(model.total_mass(parameters={"m2": 1.0}))
    2.0
    """
    q = model.evaluator.initial_q
    mass: Array = _call(model, "center_of_mass", q=q, parameters=parameters)[1][..., 0]
    return mass


def center_of_mass_jacobian(
    model: ExtensibleModel,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the Jacobian J of the centre of mass: the velocity of the centre against the base is J v.

    In absolute coordinates J v is the velocity against the world. The term is compiled at the first call if the model
    was built without it.

    Parameters
    ----------
    q : array_like
        Configuration (..., nq).
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    J : (..., 3, nv) ndarray
        Rows: world axes; columns: components of v, left-trivialised.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.center_of_mass_jacobian([0.8, -0.3]).round(4)
    array([[0.48  , 0.1316],
           [0.    , 0.    ],
           [0.4306, 0.0719]])
    """
    return _call(model, "center_of_mass_jacobian", q=q, t=t, parameters=parameters, base=base)[0]


def center_of_mass_drift(
    model: ExtensibleModel,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return dJ/dt v of the centre of mass: the rate of J v is J a + dJ/dt v, the acceleration on a base at rest.

    J is ``center_of_mass_jacobian``. On a turning base dJ/dt v contains omega x (J v), and no further term of the
    base's motion; in absolute coordinates all is relative to the world, without this term. Compiled at the first call
    if the model was built without the term.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    (..., 3) ndarray
        World axes, m/s^2.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.center_of_mass_drift([0.8, -0.3], [1.0, 0.5]).round(4)
    array([-0.5205,  0.    ,  0.6445])
    """
    return _call(model, "center_of_mass_drift", q=q, v=v, t=t, parameters=parameters, base=base)[0]


def centroidal_momentum(
    model: ExtensibleModel,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the centroidal momentum matrix A: A v is the momentum about the centre of mass, relative to the base.

    The momentum is of all bodies that move against the base, without the momentum of rotor inertias and of added masses
    of water; in absolute coordinates A v is relative to the world. Compiled at the first call if the model was built
    without the term. Orin, Goswami and Lee, Autonomous Robots 35 (2013) 161.

    Parameters
    ----------
    q : array_like
        Configuration (..., nq).
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    A : (..., 6, nv) ndarray
        Rows: angular momentum (N m s for A v), then linear momentum (N s), world axes; columns: components of v.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.centroidal_momentum([0.8, -0.3]).round(4)[[1, 3, 5]]
    array([[-0.06  , -0.06  ],
           [ 0.768 ,  0.2106],
           [ 0.6889,  0.1151]])
    """
    return _call(model, "centroidal_momentum", q=q, t=t, parameters=parameters, base=base)[0]


def centroidal_momentum_rate(
    model: ExtensibleModel,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the time derivative of the centroidal momentum matrix along v and the motion of the base, dA/dt.

    The term is compiled at the first call if the model was built without it.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    (..., 6, nv) ndarray
        Rows: of angular momentum, then of linear momentum, world axes; columns: components of v.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.centroidal_momentum_rate([0.8, -0.3], [1.0, 0.5]).shape
    (6, 2)
    """
    return _call(model, "centroidal_momentum_rate", q=q, v=v, t=t, parameters=parameters, base=base)[0]


def centroidal_drift(
    model: ExtensibleModel,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return dA/dt v: the rate of the centroidal momentum A v is A a + dA/dt v.

    A is ``centroidal_momentum``. On a turning base dA/dt v contains omega x each part of A v, and no further term of
    the base's motion; in absolute coordinates all is relative to the world, without this term. Compiled at the first
    call if the model was built without the term.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    (..., 6) ndarray
        World axes: angular, N m, then linear, N.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v = [0.8, -0.3], [1.0, 0.5]
    >>> rate = model.centroidal_momentum_rate(q, v)
    >>> np.allclose(model.centroidal_drift(q, v), rate @ v)
    True
    """
    return _call(model, "centroidal_drift", q=q, v=v, t=t, parameters=parameters, base=base)[0]


def _call(model: ExtensibleModel, term: str, **state: Any) -> tuple[Array, ...]:
    return model.having((term,)).evaluator.call(term, **state)
