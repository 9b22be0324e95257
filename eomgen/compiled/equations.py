"""Equations of motion of a compiled model, term by term: M a + h + b + B^T lam = Q, zdot = f(q, v, z, t, u).

With their partials, energies and outputs; warnings if the elimination of M loses digits.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.compiled.terms import EvaluatedModel, Inputs, Parameters, States, check_derivatives
from eomgen.errors import NumericalError
from eomgen.system.cancellation import LOST, cancellation, digits_kept, relative_error
from eomgen.system.sparsity import unpacked_places
from eomgen.system.terms import NONZEROS

#: States of a batch that are looked at.
_STATES = 4


def check_digits(model: EvaluatedModel, q: ArrayLike, p: Array, accelerations: Array) -> None:
    """Warn of accelerations that lose digits at parameters other than the defaults, once for each set of these.

    How M is eliminated is chosen by the defaults when a model is built. Only the first states of a batch are examined.

    Parameters
    ----------
    q, p, accelerations : (..., nq) configurations, (..., np) parameters, (..., nv) accelerations found there

    Raises
    ------
    NumericalError
        Accelerations that are not finite since all digits are lost.
    """
    evaluator = model.evaluator
    if "mass" not in evaluator.functions or "p" not in evaluator.functions.inputs("mass"):
        return  # no parameter is in M
    p = p.reshape(-1, p.shape[-1])[:_STATES]
    known, key = evaluator.digits_lost, p.tobytes()
    if key not in known:
        if len(known) >= 1000:
            known.clear()
        known[key] = 0.0 if np.array_equal(p, evaluator.parameters(None)[np.newaxis]) else _loss(model, q, p)
        if known[key] > LOST:
            fault = f"forward_dynamics: at these parameters {digits_kept(known[key])}"
            warnings.warn(f"{fault}; try: {_hint(model)} [W0024]", RuntimeWarning, stacklevel=4)
    if known[key] > LOST and not np.all(np.isfinite(accelerations)):
        fault = "forward_dynamics: accelerations are not finite at these parameters, since light or short links carry"
        raise NumericalError(
            f"{fault} heavy or long ones: M loses all digits when it is eliminated [E0258]", _hint(model)
        )


def _loss(model: EvaluatedModel, q: ArrayLike, p: Array) -> float:
    """Return the relative error of accelerations by cancellation in M, the largest of the first states; 1 for an
    infinite M. q (..., nq) and p (..., np) are configurations and parameters."""
    evaluator = model.evaluator
    q = evaluator.configuration(q)
    q = q.reshape(-1, q.shape[-1])[:_STATES]
    count = max(len(q), len(p))
    q, p = (rows if len(rows) == count else np.repeat(rows[:1], count, axis=0) for rows in (q, p))
    M = evaluator.call("mass", q=q, parameters=p)[0]
    joints = [factor.v for factor in evaluator.factors]
    ratio = float(np.max(cancellation(M, joints), initial=1.0))
    articulated = bool(evaluator.functions.library.layout["facts"]["ill_scaled"])
    return relative_error(ratio, articulated=articulated) if np.isfinite(ratio) else 1.0


def _hint(model: EvaluatedModel) -> str:
    if model.evaluator.functions.library.layout["facts"]["ill_scaled"]:
        return "links that differ less"
    return "these parameters as defaults of the scene, or links that differ less"


#: Results of the function ``energy``, in order: J, J, W, W.
ENERGIES = ("kinetic", "potential", "power", "base_power")


class InternalPartials(NamedTuple):
    """Partials of the residual in z, (..., nv, nz), and of zdot in q (left-trivialised), v, z, (..., nz, nv or nz)."""

    residual_z: Array
    rate_q: Array
    rate_v: Array
    rate_z: Array


def mass(model: EvaluatedModel, q: ArrayLike, *, parameters: Parameters = None) -> Array:
    """Return the inertia matrix M(q).

    Parameters
    ----------
    q : array_like
        Configuration (..., nq).
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    M : (..., nv, nv) ndarray
        Symmetric; kg m^2 between angles, kg between lengths.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.mass([0.8, -0.3]).round(4)
    array([[0.7253, 0.2106],
           [0.2106, 0.096 ]])
    >>> model.mass(np.zeros((100, 2))).shape
    (100, 2, 2)
    """
    return model.evaluator.call("mass", q=q, parameters=parameters)[0]


def coupling(model: EvaluatedModel, q: ArrayLike, v: ArrayLike, *, parameters: Parameters = None) -> Array:
    """Return the nonlinear coupling vector h(q, v): inertia terms quadratic in v, base at rest.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    h : (..., nv) ndarray
        N m along angles, N along lengths.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.coupling([0.8, -0.3], [1.0, 0.5]).round(4)
    array([ 0.0443, -0.0355])
    """
    return model.evaluator.call("coupling", q=q, v=v, parameters=parameters)[0]


def force(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the generalized force Q: gravity, springs, dampers, actuators, formulas; without forces of constraints.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    Q : (..., nv) ndarray
        N m along angles, N along lengths.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> model.force([0.0, 0.01], [0.0, 0.0]).round(3)
    array([ 160., -160.])
    >>> model.force([0.0, 0.01], [0.0, 0.0], 2.0, {"road": 0.005}).round(3)
    array([ 960., -160.])
    """
    return model.evaluator.call("force", q=q, v=v, t=t, u=u, z=z, parameters=parameters, base=base)[0]


def base_motion(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the base-motion terms b: inertia terms that vanish when the base is at rest.

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
    b : (..., nv) ndarray
        N m along angles, N along lengths; zeros if the scene's base is at rest, and in absolute coordinates, whose
        velocities are relative to the world.

    Raises
    ------
    UsageError
        ``base`` for a scene whose base is at rest, or with a component that the base's law keeps at zero.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.base_motion([0.8, -0.3], [1.0, 0.5], t=0.2).round(4)
    array([-0.6205, -0.1729])
    """
    terms = model.evaluator
    if terms.carried:
        return terms.call("base_motion", q=q, v=v, t=t, parameters=parameters, base=base)[0]
    return terms.zeros("v", t, base, parameters, q=q, v=v)


def inverse_dynamics(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the generalized forces that a motion needs, tau = M a + h + b - Q.

    Forces of constraints are not included: with closed loops ``actuator_efforts`` shares tau out.

    Parameters
    ----------
    q, v, a : array_like
        Configuration (..., nq), left-trivialised velocity and acceleration (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    tau : (..., nv) ndarray
        N m along angles, N along lengths.

    Warns
    -----
    RuntimeWarning
        Accelerations that the constraints do not allow, in one of the first 16 calls of a model with a single state;
        batches are not checked.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v, a = [0.8, -0.3], [1.0, 0.5], [0.2, 0.1]
    >>> model.inverse_dynamics(q, v, a, t=0.2).round(4)
    array([6.3485, 0.9721])
    """
    tau = model.evaluator.call("inverse_dynamics", q=q, v=v, a=a, t=t, u=u, z=z, parameters=parameters, base=base)[0]
    if model.evaluator.motions_to_check and np.ndim(tau) == 1:
        model.evaluator.motions_to_check -= 1
        _warn_of_broken_loop(model, q, v, a, {"t": t, "parameters": parameters, "base": base})
    return tau


def _warn_of_broken_loop(
    model: EvaluatedModel, q: ArrayLike, v: ArrayLike, a: ArrayLike, arguments: Mapping[str, Any]
) -> None:
    """Warn if accelerations a at q, v do not meet the constraints at t, parameters and base of ``arguments``; no check
    if a is None."""
    if a is None:
        return
    call = model.evaluator.call
    B, g = call("constraint_jacobian", q=q, **arguments)[0], call("constraint_bias", q=q, v=v, **arguments)[0]
    acceleration = model.evaluator.velocity("a", a)
    off = np.abs(B @ acceleration + g)
    sizes = np.abs(B) @ np.abs(acceleration) + np.abs(g)
    broken = off > WRITTEN * np.maximum(sizes, 1.0)
    if np.any(broken):
        worst = model.evaluator.multipliers[int(np.argmax(off * broken))]
        sentence = (
            f"inverse_dynamics: these accelerations do not meet the constraints ({worst} is off by {off.max():.3g})"
        )
        why = "and tau holds no forces of constraints"
        hint = "a of forward_dynamics or of a motion, and actuator_efforts(q, v, a) for efforts in closed loops"
        warnings.warn(f"{sentence}, {why}; try: {hint} [W0025]", RuntimeWarning, stacklevel=4)


def bias(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return h + b - Q: inverse dynamics of a = 0, Pinocchio's ``nonLinearEffects`` with all forces.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    bias : (..., nv) ndarray
        N m along angles, N along lengths.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v = [0.8, -0.3], [1.0, 0.5]
    >>> model.bias(q, v, t=0.2).round(4)
    array([6.1824, 0.9204])
    """
    rest = np.zeros(model.evaluator.functions.sizes["v"])
    call = model.evaluator.call
    return call("inverse_dynamics", q=q, v=v, a=rest, t=t, u=u, z=z, parameters=parameters, base=base)[0]


def forward_dynamics(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the acceleration vdot = M^-1 (Q - h - b); with constraints the solution of ``constrained_dynamics``.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    vdot : (..., nv) ndarray
        Left-trivialised; rad/s^2 of angles, m/s^2 of lengths. Not finite, without an error, for a motion that moves no
        mass at the scene's own parameters.

    Raises
    ------
    NumericalError
        Accelerations that are not finite at ``parameters`` with which all digits are lost; with constraints, rows that
        depend on each other at one of the states, or an allowed motion without inertia, unless rounding hides this:
        then accelerations are large or arbitrary numbers.

    Warns
    -----
    RuntimeWarning
        ``parameters`` with which accelerations lose digits, once for each set; not with constraints.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v = [0.8, -0.3], [1.0, 0.5]
    >>> model.forward_dynamics(q, v, t=0.2).round(4)
    array([-15.8228,  25.1307])
    """
    if parameters is None or model.evaluator.multipliers:
        return accelerations(model, q, v, t, u, z=z, parameters=parameters, base=base)
    p = model.evaluator.parameters(parameters)
    result = accelerations(model, q, v, t, u, z=z, parameters=p, base=base)
    check_digits(model, q, p, result)
    return result


def accelerations(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the acceleration vdot, (..., nv), as ``forward_dynamics`` does, without a look at lost digits."""
    if model.evaluator.multipliers:
        return constrained_dynamics(model, q, v, t, u, z=z, parameters=parameters, base=base)[0]
    return model.evaluator.call("forward_dynamics", q=q, v=v, t=t, u=u, z=z, parameters=parameters, base=base)[0]


def constrained_dynamics(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Return accelerations and multipliers: M vdot + h + b + B^T lam = Q with B vdot = -g.

    g is the term ``constraint_bias``. Constraints are met by the accelerations; q and v that violate the constraints
    are neither refused nor corrected.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    vdot : (..., nv) ndarray
        Accelerations, rad/s^2 and m/s^2.
    lam : (..., rows) ndarray
        Multipliers, in the order of ``model.multipliers``; the constraints add -B^T lam to Q.

    Raises
    ------
    NumericalError
        At one of the states the matrix of the equations is exactly singular: rows depend on each other, or an allowed
        motion has no inertia. If rounding hides this, results are large or arbitrary numbers, without an error.
    UsageError
        A scene without constraints, or a model that was built without the terms of constraints.

    Examples
    --------
    >>> model = eomgen.build("examples/four_bar/scene.toml")
    >>> vdot, lam = model.constrained_dynamics(model.initial_q, model.initial_v)
    >>> vdot.shape, lam.shape
    ((3,), (2,))
    """
    return model.evaluator.accelerations(q=q, v=v, t=t, u=u, z=z, parameters=parameters, base=base)


def partials(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> tuple[Array, Array, Array]:
    """Return the partials K, C, M of the residual in q (left-trivialised), v and a, exact to rounding.

    The residual is M a + h + b - Q, plus B^T lam if there are constraints. The term is ``partials``, which scenes with
    many coordinates have only if ``terms`` of ``build`` names the term.

    Parameters
    ----------
    q, v, a : array_like
        Configuration (..., nq), left-trivialised velocity and acceleration (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    multipliers : array_like, optional
        Multipliers of the constraints (..., rows); zero if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    K, C, M : (..., nv, nv) ndarray
        Rows belong to the equations, columns to the increments of q, to v and to a.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v, a = [0.8, -0.3], [1.0, 0.5], [0.2, 0.1]
    >>> K, C, M = model.partials(q, v, a)
    >>> K.round(4)
    array([[6.5509, 1.671 ],
           [1.7966, 1.9183]])
    """
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "base": base}
    K, C, M = model.evaluator.call("partials", **arguments, multipliers=multipliers, parameters=parameters)
    return K, C, M


def has_residual_partials(model: EvaluatedModel) -> bool:
    """Return whether ``residual_partials`` gives whole matrices: by the term of the matrices, or by nonzeros of a small
    scene."""
    functions = model.evaluator.functions
    if functions.for_runs("partials"):
        return True
    patterns = functions.library.layout["patterns"]
    known = {"M", "K"} <= patterns.keys() and not ("X" in patterns and unpacked_places(patterns["X"]).size)
    return "iteration" in functions and known and functions.sizes["v"] <= 200


def residual_partials(
    model: EvaluatedModel,
    q: Array,
    v: Array,
    a: Array,
    t: float,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
) -> tuple[Array, Array, Array]:
    """Return K, C, M as ``partials`` does, at one state, (nv, nv) each. Models for runs have no term ``partials``; then
    the matrices are filled from the nonzeros of the term ``iteration``."""
    arguments: dict[str, Any] = {"t": t, "u": u, "z": z, "multipliers": multipliers, "parameters": parameters}
    functions = model.evaluator.functions
    if functions.for_runs("partials") or "iteration" not in functions:
        return partials(model, q, v, a, **arguments)
    entries = evaluate(model, "iteration", q, v, a, **arguments)
    whole: dict[str, Array] = {name: np.zeros((len(v), len(v))) for name in "KCM"}
    for name in whole.keys() & entries.keys():
        places = unpacked_places(functions.library.layout["patterns"][name])
        np.add.at(whole[name], (places[0], places[1]), entries[name])
    return whole["K"], whole["C"], whole["M"]


class Nonzeros(NamedTuple):
    """Nonzeros of a matrix in each of several states.

    Attributes
    ----------
    rows, columns : (count,)
    values : (states, count)
    """

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: Array

    def apply(self, vectors: Array, size: int) -> Array:
        """Return the products, (states, size), with a vector of each state, (states, columns)."""
        return _sums(self.rows, self.values * vectors[:, self.columns], size)

    def transpose(self) -> Nonzeros:
        """Return the nonzeros of the transposed matrix."""
        return Nonzeros(self.columns, self.rows, self.values)

    def magnitudes(self) -> Nonzeros:
        """Return the absolute values."""
        return self._replace(values=np.abs(self.values))

    def block(self, part: slice) -> Array:
        """Return the square block of these rows and columns, (states, size, size)."""
        size = part.stop - part.start
        row, column = self.rows - part.start, self.columns - part.start
        within = (row >= 0) & (row < size) & (column >= 0) & (column < size)
        flat = _sums(size * row[within] + column[within], self.values[:, within], size * size)
        return flat.reshape(-1, size, size)


def free_directions(model: EvaluatedModel, q: ArrayLike, t: float, p: Array) -> Array:
    """Return an orthonormal basis of the velocities that the constraints leave at a configuration, (nv, m).

    Parameters
    ----------
    q, p : (nq,), (np,)
    t : s
    """
    functions = model.evaluator.functions
    if not functions.sizes["lam"] or "constraint_jacobian" not in functions:
        return np.eye(functions.sizes["v"])
    blocks = evaluate(model, "constraint_jacobian", q, t=t, parameters=p)
    _, sizes, directions = np.linalg.svd(np.atleast_2d(next(iter(blocks.values()))))
    return np.asarray(directions[int(np.sum(sizes > COMPUTED * sizes.max(initial=0.0))) :].T)


def _sums(places: NDArray[np.int64], values: Array, size: int) -> Array:
    """Return the sums of values, (states, count), at equal places, (states, size)."""
    return np.array([np.bincount(places, row, size) for row in values]).reshape(-1, size)


def nonzeros(
    model: EvaluatedModel, whole: str, q: Array, t: ArrayLike = 0.0, *, parameters: Parameters = None
) -> Nonzeros | None:
    """Return the nonzeros of M or B in several states, or all entries of small systems; None without such a term.

    Parameters
    ----------
    whole : ``mass`` or ``constraint_jacobian``, a key of ``system.terms.NONZEROS``
    q, t : (states, nq), (states,) in s
    """
    functions = model.evaluator.functions
    term = next((name for name in (whole, NONZEROS[whole]) if name in functions.names), None)
    if term is None:
        return None
    ((name, values),) = evaluate(model, term, q, t=t, parameters=parameters).items()
    shape = values.shape[1:]
    places = np.indices(shape) if term == whole else unpacked_places(functions.library.layout["patterns"][name])
    rows, columns = places.reshape(2, -1)
    return Nonzeros(rows, columns, np.broadcast_to(values.reshape(len(values), -1), (len(q), len(rows))))


def evaluate(
    model: EvaluatedModel,
    term: str,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    **rates: ArrayLike,
) -> dict[str, Array]:
    """Return the outputs of a term of the model.

    Accelerations are computed by forward dynamics, as far as the model was built with the terms for this, if the term
    needs ``a`` and none are given; then so are multipliers that are not given.

    Parameters
    ----------
    term : str
        One of ``model.terms`` that takes no weights (``..._hessian`` and ``second_partials`` do).
    q, v, a : array_like
        Configuration (..., nq), left-trivialised velocity and acceleration (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    multipliers : array_like, optional
        Multipliers of the constraints (..., rows); zero if neither given nor computed with the accelerations.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    **rates : array_like
        Time derivatives that some terms take, as in ``rates``: of a j, s, a_higher (j and s the first and second), of u
        u_dot, u_ddot, u_higher, and of the base's twist base_rates.

    Returns
    -------
    dict
        Arrays by the names of the C code; leading axes are the broadcast leading axes of the arguments that the term
        depends on.

    Raises
    ------
    UsageError
        A term that the model was built without, arguments that the term needs and that are not given, wrong shapes.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> sorted(model.evaluate("inverse_dynamics", [0.8, -0.3], [1.0, 0.5], [0.2, 0.1]))
    ['tau']
    """
    check_derivatives(rates)
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "base": base, **rates}
    values = model.evaluator.call(term, **arguments, multipliers=multipliers, parameters=parameters)
    return dict(zip(model.evaluator.functions.output_names(term), values, strict=True))


def energy(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> dict[str, Array]:
    """Return energies and powers relative to inertial space.

    Accelerations are computed by forward dynamics if the power of a moving base needs accelerations and the caller
    gives none; then so are multipliers that are not given.

    Parameters
    ----------
    q, v, a : array_like
        Configuration (..., nq), left-trivialised velocity and acceleration (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    multipliers : array_like, optional
        Multipliers of the constraints (..., rows); zero if neither given nor computed with the accelerations:
        ``base_power`` is then without the forces of constraints, also of prescribed motions.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    dict
        ``kinetic`` (with rotor inertias), ``potential`` (with gravity from the world's origin) and the sum ``total`` in
        J, ``power`` of all non-conservative forces and ``base_power`` of the reaction at a moving base and of
        prescribed motions in W; each (...).

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v = [0.8, -0.3], [1.0, 0.5]
    >>> energy = model.energy(q, v)
    >>> float((energy["total"] - energy["kinetic"] - energy["potential"]).round(12))
    0.0
    """
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "base": base}
    return _energies(model.evaluator.call("energy", **arguments, multipliers=multipliers, parameters=parameters)[0])


def _energies(values: Array) -> dict[str, Array]:
    result = {name: values[..., index] for index, name in enumerate(ENERGIES)}
    with np.errstate(invalid="ignore"):  # of infinite energies
        return NamedResults("energy", {**result, "total": result["kinetic"] + result["potential"]})


def outputs(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> dict[str, Array]:
    """Return the scene's outputs at a state.

    Accelerations and multipliers that outputs need and that are not given are computed by forward dynamics.

    Parameters
    ----------
    q, v, a : array_like
        Configuration (..., nq), left-trivialised velocity and acceleration (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    multipliers : array_like, optional
        Multipliers of the constraints (..., rows); of forward dynamics at the state if not given, even if ``a`` is
        given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    dict
        Arrays by name, in the units of the outputs: (...) for one component, (..., size) for several; empty if the
        scene has no outputs.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v = [0.8, -0.3], [1.0, 0.5]
    >>> model.outputs(q, v)["angles"]
    array([0.8, 0.5])
    """
    if not model.evaluator.library.layout["outputs"]:
        model.evaluator.parameters(parameters)
        return NamedResults("output", {})
    arguments: dict[str, Any] = {"q": q, "v": v, "t": t, "u": u, "z": z, "parameters": parameters, "base": base}
    if multipliers is None and "lam" in model.evaluator.functions.inputs("outputs"):
        multipliers = model.evaluator.accelerations(**arguments)[1]
    return _outputs(model, model.evaluator.call("outputs", **arguments, a=a, multipliers=multipliers)[0])


def _outputs(model: EvaluatedModel, values: Array) -> dict[str, Array]:
    result, start = NamedResults[Array]("output", {}), 0
    for item in model.evaluator.library.layout["outputs"]:
        size = int(item["size"])
        result[str(item["name"])] = values[..., start] if size == 1 else values[..., start : start + size]
        start += size
    return result


def motion_values(model: EvaluatedModel, name: str, values: Mapping[str, Array]) -> dict[str, Array]:
    """Return ``outputs`` or ``energy`` by name at states of a run, as the functions of these names, without checks.

    Parameters
    ----------
    name : ``outputs`` or ``energy``
    values : mapping
        Blocks ``q``, ``v``, ``a``, ``lam``, ``z``, ``t``, ``p``, and ``u`` and ``base`` if there are any, each
        (n, size), t (n,), p also (np,).
    """
    if name == "outputs" and not model.evaluator.library.layout["outputs"]:
        return NamedResults("output", {})
    result = model.evaluator.functions(name, values)[0]
    return _outputs(model, result) if name == "outputs" else _energies(result)


def internal_rates(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    z: States = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the rates of the internal states, zdot = f(q, v, z, t, u).

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    z, u, parameters : mapping or array_like, optional
        Internal states (..., nz), inputs (..., nu) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    t : array_like, optional
        Time (...), s.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    zdot : (..., nz) ndarray
        In the order of ``model.states``, in the units of the states per second; zeros for sampled states, which change
        at samples only.

    Examples
    --------
    >>> model = eomgen.build("examples/pi_servo/scene.toml")
    >>> model.states
    ('position_integral', 'torque_filtered')
    >>> model.internal_rates([0.0, 0.0], [0.0, 0.0]).shape
    (2,)
    """
    if not model.evaluator.state_names:
        return model.evaluator.zeros("z", t, base, parameters, q=q, v=v)
    return model.evaluator.call("internal_rate", q=q, v=v, z=z, t=t, u=u, parameters=parameters, base=base)[0]


def internal_partials(
    model: EvaluatedModel,
    q: ArrayLike,
    v: ArrayLike,
    z: States = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> InternalPartials:
    """Return the partials that involve internal states: of the residual in z, and of zdot in q, v and z.

    The residual is M a + h + b - Q. Inputs and the state of the base are held. Rows of zdot of sampled states are zero.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    z, u, parameters : mapping or array_like, optional
        Internal states (..., nz), inputs (..., nu) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    t : array_like, optional
        Time (...), s.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    InternalPartials
        ``residual_z`` (..., nv, nz), ``rate_q`` (left-trivialised) and ``rate_v`` (..., nz, nv), ``rate_z`` (..., nz,
        nz).

    Raises
    ------
    UsageError
        A scene without internal states, or a model that was built without the term ``internal_partials``.

    Examples
    --------
    >>> model = eomgen.build("examples/pi_servo/scene.toml")
    >>> partials = model.internal_partials([0.0, 0.0], [0.0, 0.0])
    >>> partials.rate_q.shape, partials.rate_z.shape
    ((2, 2), (2, 2))
    """
    arguments = {"q": q, "v": v, "z": z, "t": t, "u": u}
    return InternalPartials(*model.evaluator.call("internal_partials", **arguments, parameters=parameters, base=base))
