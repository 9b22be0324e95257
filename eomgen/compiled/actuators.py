"""Inverse dynamics with chosen actuators, through loops: efforts, multipliers, and internal efforts.

    M a + h + b - Q + B^T lam = S tau

For a motion that meets the constraints, P = I - B^+ B projects out the constraint forces: P S tau = P r with r = M a +
h + b - Q. With as many actuators as degrees of freedom tau is unique; with more it is the least in norm, and the null
space of P S holds internal efforts, which change no motion; with fewer there is none but for special motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED, SUMMED, WRITTEN
from eomgen.compiled.arguments import check_name
from eomgen.compiled.terms import ExtensibleModel, Parameters, States
from eomgen.errors import NumericalError, Problem, UsageError


@dataclass(frozen=True, repr=False)
class ActuatorEfforts:
    """Efforts of actuators for a motion.

    Attributes
    ----------
    names : of the actuators
    efforts : (..., n), N m or N: unique, or the least in norm
    multipliers : (..., rows), of the constraints, with these efforts
    null_space : (..., n, k), orthonormal columns: efforts along the columns change no motion, only multipliers; k is 0
        if the efforts are unique
    """

    names: tuple[str, ...]
    efforts: Array
    multipliers: Array
    null_space: Array

    def __repr__(self) -> str:
        states = self.efforts.shape[:-1]
        if states:
            listed = f"{', '.join(self.names)} at {' x '.join(map(str, states))} states"
        else:
            listed = ", ".join(f"{name} {effort:.6g}" for name, effort in zip(self.names, self.efforts, strict=True))
        return f"<ActuatorEfforts: {listed}; {'unique' if self.unique else 'the least of many'}>"

    @property
    def unique(self) -> bool:
        """Whether no other efforts give the motion."""
        return not self.null_space.shape[-1]

    @property
    def internal(self) -> tuple[str, ...]:
        """The null space in words, a text for each column, at the first state of a batch: ``left 0.707, right -0.707``.

        Empty if the efforts are unique; actuators that take no part in an internal effort are left out.
        """
        first = self.null_space[(0,) * (self.null_space.ndim - 2)]
        result = []
        for column in first.T:
            largest = np.abs(column).max()
            pairs = zip(self.names, column, strict=True)
            result.append(", ".join(f"{name} {part:.3g}" for name, part in pairs if abs(part) > WRITTEN * largest))
        return tuple(result)


def actuator_efforts(
    model: ExtensibleModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    actuators: Sequence[str] | None = None,
    t: float = 0.0,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    tolerance: float = 1e-6,
) -> ActuatorEfforts:
    """Return the efforts that chosen actuators need for a motion, with or without closed loops.

    Missing terms are compiled once.

    Parameters
    ----------
    q, v, a : array_like
        Configuration (..., nq), left-trivialised velocity and acceleration (..., nv).
    t : array_like, optional
        Time (...), s.
    z, parameters : mapping or array_like, optional
        Internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    actuators : sequence of str
        Joints of one coordinate, or components such as ``ball[0]`` and ``slider``, that carry one actuator each, as in
        ``model.v_names`` without ``v.``; by default the inputs of the scene that the scene does not prescribe, each
        with the generalized force of the input. Prescribed inputs keep the prescribed values, all others are zero.
    tolerance : float, optional
        Residual of the constraints at the accelerations, as a share of the summands, up to which accelerations are
        taken: up to ``1e-6`` as given; with a larger tolerance, such as ``1e-2`` for states of an implicit run, the
        nearest accelerations in the metric of the inertia matrix that meet the constraints are taken in their place.

    Returns
    -------
    ActuatorEfforts
        ``names`` of the n actuators; ``efforts`` (..., n) in N m or N, of inputs in the unit of the input, the least in
        norm if several give the motion; ``multipliers`` (..., rows) of the constraints with these efforts;
        ``null_space`` (..., n, k), with k = 0 if the efforts are unique.

    Raises
    ------
    UsageError
        Names that are not there; no actuators; forces that are not linear in the inputs; accelerations that do not meet
        the constraints within the tolerance.
    NumericalError
        The actuators cannot produce the motion; names the remaining force. In some states of a batch more internal
        efforts exist than in others.

    Examples
    --------
    >>> model = eomgen.build("examples/robot_arm/scene.toml")
    >>> model.actuator_efforts(model.initial_q, np.zeros(7), np.zeros(7)).efforts.round(2)[1:4]
    array([-16.52,  -0.28,  19.13])
    """
    able = model.having(("residual", "force", "constraint_jacobian", "constraint_bias", "inverse_dynamics"))
    terms = able.evaluator
    arguments: dict[str, Any] = {"q": q, "v": v, "t": t, "z": z, "parameters": parameters, "base": base}
    names, S, still = _columns(able, actuators, arguments)
    nv, rows = terms.functions.sizes["v"], len(terms.multipliers)
    if rows:
        B = terms.call("constraint_jacobian", **arguments)[0]
        a = terms.velocity("a", a)
        missed = _missed_accelerations(terms, B, a, terms.call("constraint_bias", **arguments)[0], tolerance)
        inverse = np.linalg.pinv(B, rcond=COMPUTED)
        if tolerance > WRITTEN:
            M = model.having(("mass",)).evaluator.call("mass", **arguments)[0]
            along = np.linalg.solve(M, np.swapaxes(B, -1, -2))  # by forces of constraints alone
            a = a - (along @ np.linalg.pinv(B @ along, rcond=COMPUTED) @ missed[..., np.newaxis])[..., 0]
    (r,) = terms.call("inverse_dynamics", **{**arguments, "u": still}, a=a)
    (at_rest,) = terms.call("inverse_dynamics", **{**arguments, "u": still}, a=np.zeros(terms.functions.sizes["v"]))
    batch = np.broadcast_shapes(r.shape[:-1], S.shape[:-2])
    r, S = np.broadcast_to(r, (*batch, nv)), np.broadcast_to(S, (*batch, nv, len(names)))
    if not rows:
        B, inverse = np.zeros((*batch, rows, nv)), np.zeros((*batch, nv, 0))
    P = np.eye(nv) - inverse @ B
    A, target = P @ S, (P @ r[..., np.newaxis])[..., 0]
    efforts = (np.linalg.pinv(A, rcond=COMPUTED) @ target[..., np.newaxis])[..., 0]
    needed = (S @ efforts[..., np.newaxis])[..., 0] - r
    # In free motion inertia and the other forces, of this size, cancel down to round-off.
    summands = np.linalg.norm(r - at_rest, axis=-1) + np.linalg.norm(at_rest, axis=-1)
    allowed = COMPUTED * np.linalg.norm(target, axis=-1) + SUMMED * summands
    _check_left_over(terms.v_names, names, (P @ needed[..., np.newaxis])[..., 0], allowed)
    multipliers = (np.swapaxes(inverse, -1, -2) @ needed[..., np.newaxis])[..., 0]
    return ActuatorEfforts(names, efforts, multipliers, _null_space(A))


def _columns(
    model: ExtensibleModel, actuators: Sequence[str] | None, state: dict[str, Any]
) -> tuple[tuple[str, ...], Array, dict[str, float]]:
    """Return names of actuators, generalized forces per unit effort of each, (..., nv, n) or (nv, n), and driven inputs
    at 0. Without ``actuators`` the columns belong to the inputs that a caller drives, by differences of Q at ``state``,
    arguments of the term ``force``. Raises UsageError for unknown joints, forces not linear in an input, and no
    actuators."""
    terms = model.evaluator
    driven = terms.description.driven
    still = dict.fromkeys(driven, 0.0)
    if actuators is not None:
        names = (actuators,) if isinstance(actuators, str) else tuple(actuators)
        velocity_names = [name.removeprefix("v.") for name in terms.v_names]
        for name in names:
            check_name("actuator", name.removeprefix("v."), velocity_names)
        places = [velocity_names.index(name.removeprefix("v.")) for name in names]
        columns = np.eye(terms.functions.sizes["v"])[:, places]
    else:
        names = tuple(driven)
        base = terms.call("force", **state, u=still)[0]
        ones = [terms.call("force", **state, u={**still, name: 1.0})[0] - base for name in names]
        twos = [terms.call("force", **state, u={**still, name: 2.0})[0] - base for name in names]
        for name, single, double in zip(names, ones, twos, strict=True):
            if np.any(np.abs(double - 2.0 * single) > 1e-9 * (np.abs(double).max() + np.abs(base).max() + 1e-300)):
                fault = f"the generalized forces are not linear in the input {name}, so it is not an actuator [E0224]"
                raise UsageError(Problem("actuators", fault, "actuators=[...], joints by their names"))
        columns = np.stack(ones, axis=-1) if names else np.zeros((terms.functions.sizes["v"], 0))
    if not names:
        fault = "there are no actuators: the scene has no inputs that a caller drives [E0223]"
        raise UsageError(Problem("actuators", fault, "actuators=[...], joints by their names"))
    return names, columns, still


def _missed_accelerations(terms: Any, B: Array, a: Array, bias: Array, tolerance: float) -> Array:
    """Return the residuals B a + bias of the constraints at accelerations, (..., rows). Raises UsageError if a residual
    is above the share ``tolerance`` of its summands; names the row."""
    missed: Array = (B @ a[..., np.newaxis])[..., 0] + bias
    size = (np.abs(B) @ np.abs(a)[..., np.newaxis])[..., 0] + np.abs(bias)
    share = np.abs(missed) - tolerance * (size + size.max(axis=-1, keepdims=True))
    if np.any(share > 0.0):
        row = int(np.argmax(share.max(axis=tuple(range(share.ndim - 1)))))
        off = float(np.abs(missed[..., row]).max())
        fault = (
            f"the accelerations do not meet the constraint {terms.multipliers[row]}: its row is off by"
            f" {off:.3g} [E0225]"
        )
        hint = "tolerance=1e-2 for accelerations of an implicit run, or a with B a = -g, where g is constraint_bias"
        raise UsageError(Problem("a", fault, hint))
    return missed


def _check_left_over(v_names: Sequence[str], names: Sequence[str], left: Array, allowed: Array) -> None:
    if np.any(np.linalg.norm(left, axis=-1) > allowed):
        most = int(np.argmax(np.abs(left).max(axis=tuple(range(left.ndim - 1)))))
        fault = (
            f"the actuators {', '.join(names)} cannot give this motion: {float(np.abs(left[..., most]).max()):.3g}"
            f" remains along {v_names[most]} [E0226]"
        )
        raise NumericalError(Problem("actuator_efforts", fault, "more actuators, or a motion that these can give"))


def _null_space(A: Array) -> Array:
    """Return an orthonormal basis of the null space of A (..., m, n), as columns (..., n, k). Raises NumericalError if
    the rank differs between the states of a batch."""
    _, values, rows = np.linalg.svd(A)
    scale = values.max(axis=-1, keepdims=True) if values.shape[-1] else values
    ranks = np.sum(values > COMPUTED * scale, axis=-1)
    rank = int(np.max(ranks)) if ranks.size else 0
    if np.any(ranks != rank):
        fault = (
            "in some of these states actuators lose their effect, and there are more internal efforts than in"
            " others [E0227]"
        )
        raise NumericalError(Problem("actuator_efforts", fault, "these states one by one"))
    result: Array = np.swapaxes(rows[..., rank:, :], -1, -2)
    return result
