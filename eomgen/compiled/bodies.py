"""Poses, twists and points of the bodies and frames of a compiled model; their Jacobians with respect to v, with rates
and drifts, in three references; operational-space inertias.

A frame by name (``[frames]`` of a scene, the fixed links of a URDF) stands wherever a body does. Terms that the model
was built without are compiled when they are first called for.

Twists are angular first. Pinocchio has the linear part first: J there has the rows of eomgen in the order 3, 4, 5, 0,
1, 2, and columns in Pinocchio's order of v. References and their names there: ``body`` (LOCAL), twist in the frame's
own axes; ``local_world_aligned`` (LOCAL_WORLD_ALIGNED), world axes, linear part of the frame's origin; ``world``
(WORLD), world axes, linear part of the point that is at the world's origin. Columns belong to the components of v, so
they are left-trivialised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.base.messages import nearest, shown
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.compiled.arguments import check_name, check_place, components
from eomgen.compiled.terms import EvaluatedModel, ExtensibleModel, Parameters
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.lie.numeric import quaternion_product, rotated
from eomgen.system.description import BASE, WORLD, FixedFrame
from eomgen.system.terms import REFERENCES

#: Terms that are compiled together if one of these terms is missing.
_TOGETHER = ("poses", "twists", "jacobians")


class PointMotion(NamedTuple):
    """Motion of a point in world axes, (..., 3) each: the velocity is None without v, the acceleration without a."""

    position: Array
    velocity: Array | None
    acceleration: Array | None = None


def pose(
    model: ExtensibleModel,
    body: str,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the pose of a body or a frame in the world.

    Parameters
    ----------
    body : str
        Body or frame, by name.
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
    pose : (..., 7) ndarray
        Unit quaternion (w, x, y, z) from axes of the body to world axes, then the origin in the world, m.

    Raises
    ------
    UsageError
        No body and no frame has this name; a frame away from the origin of a body that deforms.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.pose("lower", [0.8, -0.3]).round(4)
    array([ 0.9689,  0.    , -0.2474,  0.    ,  0.3587,  0.    , -0.3284])
    """
    body_point = _body_point(model, body, parameters)
    model = _having(model, body_point.body, "poses")
    result = _body_term(model, body_point.body, "poses", q=q, t=t, parameters=parameters, base=base)
    if body_point.fixed is None:
        return result
    turn = np.broadcast_to(np.array(body_point.fixed.quaternion), (*result.shape[:-1], 4))
    position = result[..., 4:] + rotated(result[..., :4], body_point.position)
    return np.concatenate([quaternion_product(result[..., :4], turn), position], axis=-1)


def twist(
    model: ExtensibleModel,
    body: str,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the twist of a body or a frame against the world, in the axes of the body or frame.

    Parameters
    ----------
    body : str
        Body or frame, by name.
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
    twist : (..., 6) ndarray
        Angular velocity, rad/s, then velocity of the origin, m/s.

    Raises
    ------
    UsageError
        No body and no frame has this name; a frame away from the origin of a body that deforms.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.twist("lower", [0.8, -0.3], [1.0, 0.5], t=0.2).round(4)
    array([ 0.    , -1.5   ,  0.    ,  0.4958,  0.    , -0.0444])
    """
    body_point = _body_point(model, body, parameters)
    model = _having(model, body_point.body, "twists")
    result = _body_term(model, body_point.body, "twists", q=q, v=v, t=t, parameters=parameters, base=base)
    if body_point.fixed is None:
        return result
    omega, velocity = result[..., :3], result[..., 3:] + np.cross(result[..., :3], body_point.position)
    back = np.array(body_point.fixed.orientation)
    return np.concatenate([omega @ back, velocity @ back], axis=-1)


@checked_call("point(body, r, q): r is a place in the body's axes, [0, 0, 0] for its origin")
def point(
    model: ExtensibleModel,
    body: str,
    r: ArrayLike,
    q: ArrayLike,
    v: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    *,
    a: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> PointMotion:
    """Return position, velocity and acceleration of a point of a body or a frame, in world axes.

    Parameters
    ----------
    body : str
        Body or frame, by name.
    r : array_like
        Position of the point (..., 3) in the axes of the body or frame, from the origin of the body or frame, m.
    q : array_like
        Configuration (..., nq).
    v : array_like, optional
        Velocity (..., nv), left-trivialised.
    t : array_like, optional
        Time (...), s.
    a : array_like, optional
        Acceleration (..., nv).
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    PointMotion
        ``position``, m, ``velocity``, m/s, and ``acceleration``, m/s^2, (..., 3) each, with the motion of the base. The
        velocity is None without ``v``, the acceleration without ``v`` or without ``a``.

    Raises
    ------
    UsageError
        No body and no frame has this name; a point away from the origin of a body that deforms.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v = [0.8, -0.3], [1.0, 0.5]
    >>> motion = model.point("lower", [0, 0, -0.4], q, v)
    >>> motion.position.round(4), motion.velocity.round(4)
    (array([ 0.5504,  0.    , -0.6794]), array([1.0749, 0.    , 0.6463]))
    """
    body, r = _fixed_in(model, body, r, parameters)
    needed = ["poses"] if v is None else ["poses", "twists"] if a is None else ["poses", "twists", "accelerations"]
    model = _having(model, body, *needed)
    state: dict[str, Any] = {"q": q, "t": t, "parameters": parameters, "base": base}
    pose = _body_term(model, body, "poses", **state)
    turn = pose[..., :4]
    position = pose[..., 4:] + rotated(turn, r)
    if v is None:
        return PointMotion(position, None)
    twist = _body_term(model, body, "twists", v=v, **state)
    omega = twist[..., :3]
    velocity = rotated(turn, twist[..., 3:] + np.cross(omega, r))
    if a is None:
        return PointMotion(position, velocity)
    rate = _body_term(model, body, "accelerations", v=v, a=a, **state)
    relative = np.cross(rate[..., :3], r) + np.cross(omega, np.cross(omega, r))
    return PointMotion(position, velocity, rotated(turn, rate[..., 3:] + relative))


def body_jacobian(model: ExtensibleModel, body: str, q: ArrayLike, *, parameters: Parameters = None) -> Array:
    """Return the Jacobian of a body or a frame in the axes of the body or frame.

    The inertial twist is ``body_jacobian(body, q) @ v`` plus the twist of the moving base at the body; in absolute
    coordinates only a body fixed to the base has this addition.

    Parameters
    ----------
    body : str
        Body or frame, by name.
    q : array_like
        Configuration (..., nq).
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    J : (..., 6, nv) ndarray
        Rows: angular, then linear of the origin; columns: components of v, left-trivialised.

    Raises
    ------
    UsageError
        No body and no frame has this name; a frame away from the origin of a body that deforms.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.body_jacobian("lower", [0.8, -0.3]).shape
    (6, 2)
    """
    body_point = _body_point(model, body, parameters)
    model = _having(model, body_point.body, "jacobians")
    result = _body_term(model, body_point.body, "jacobians", q=q, parameters=parameters)
    if body_point.fixed is None:
        return result
    columns = np.swapaxes(result, -1, -2)
    angular, back = columns[..., :3], np.array(body_point.fixed.orientation)
    linear = columns[..., 3:] + np.cross(angular, body_point.position[..., np.newaxis, :])
    return np.swapaxes(np.concatenate([angular @ back, linear @ back], axis=-1), -1, -2)


@checked_call("point_jacobian(body, r, q): r is a place in the body's axes, [0, 0, 0] for its origin")
def point_jacobian(
    model: ExtensibleModel,
    body: str,
    r: ArrayLike,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the Jacobian of a point of a body or a frame, in world axes.

    The point's velocity in world axes is ``point_jacobian(body, r, q, t) @ v`` plus the velocity of the moving base
    at the point (in absolute coordinates only on a body fixed to the base); a force f on the point, in world axes, adds
    ``point_jacobian(...).T @ f`` to Q.

    Parameters
    ----------
    body : str
        Body or frame, by name.
    r : array_like
        Position of the point (..., 3) in the axes of the body or frame, from the origin of the body or frame, m.
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

    Raises
    ------
    UsageError
        No body and no frame has this name; a point away from the origin of a body that deforms.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v = [0.8, -0.3], [1.0, 0.5]
    >>> J = model.point_jacobian("lower", [0, 0, -0.4], q)
    >>> (J @ v).round(4)
    array([0.8749, 0.    , 0.6463])
    """
    body, position_in_body = _fixed_in(model, body, r, parameters)
    model = _having(model, body, "poses", "jacobians")
    r = position_in_body[..., np.newaxis, :]
    turn = _body_term(model, body, "poses", q=q, t=t, parameters=parameters, base=base)[..., np.newaxis, :4]
    columns = np.swapaxes(body_jacobian(model, body, q, parameters=parameters), -1, -2)
    return np.swapaxes(rotated(turn, columns[..., 3:] + np.cross(columns[..., :3], r)), -1, -2)


def _having(model: ExtensibleModel, name: str, *terms: str) -> ExtensibleModel:
    """Return the model if it has all of ``terms``, else a model of the same scene with the terms of bodies compiled.
    Raises UsageError if no body or frame has the ``name``."""
    if all(term in model.evaluator.functions for term in terms):
        return model
    _check_name(model, name)
    return model.having(tuple(dict.fromkeys((*_TOGETHER, *terms))))


def _check_name(model: EvaluatedModel, name: str) -> None:
    """Raise UsageError if a name belongs to no body and no frame; base and world count if frames are fixed there."""
    frames = model.evaluator.fixed_frames
    if name not in (BASE, WORLD) or all(frame.body != name for frame in frames.values()):
        check_name("body", name, [*model.evaluator.bodies, *frames])


class _BodyPoint(NamedTuple):
    """A carrying body, the frame or None for the body itself, and the frame's origin in body axes, (..., 3), m."""

    body: str
    fixed: FixedFrame | None
    position: Array


def _body_point(model: EvaluatedModel, name: str, parameters: Parameters) -> _BodyPoint:
    """Return the body and the place on it that the name of a body or frame stands for. Raises UsageError for a frame
    away from the origin of a body that deforms."""
    check_place(name)
    terms = model.evaluator
    frame = terms.fixed_frames.get(name)
    if frame is None:
        return _BodyPoint(name, None, np.zeros(3))
    return _BodyPoint(frame.body, frame, _rigid(model, name, frame.body, terms.place_of(frame, parameters)))


def _fixed_in(model: EvaluatedModel, body: str, r: ArrayLike, parameters: Parameters) -> tuple[str, Array]:
    """Return the body that carries the body or frame ``body``, and a point r (..., 3) of it in axes of the carrying
    body, m. Raises UsageError for a point away from the origin of a body that deforms."""
    check_place(body)
    at = components("r", r, 3)
    body_point = _body_point(model, body, parameters)
    if body_point.fixed is not None:
        at = body_point.position + at @ np.array(body_point.fixed.orientation).T
    return body_point.body, _rigid(model, body, body_point.body, at)


def _rigid(model: EvaluatedModel, name: str, body: str, position: Array) -> Array:
    """Return ``position`` (..., 3) unchanged; raise UsageError if the body deforms and the position is not its origin.
    ``name`` is the body or frame in the message."""
    if body in model.evaluator.beams and np.any(position != 0.0):
        fault = "the beam deforms, and the compiled model knows its shapes at the points of the scene only [E0250]"
        raise UsageError(
            Problem(f"point of {name}", fault, "an entry of [points] with an output of it; r = 0 for the frame")
        )
    return position


def _body_term(model: EvaluatedModel, body: str, term: str, **state: Any) -> Array:
    terms = model.evaluator
    _check_name(model, body)
    if body in (BASE, WORLD):
        return _base_term(model, body, term, **state)
    every = terms.call(term, **state)[0]
    result: Array = np.take(every, terms.bodies.index(body), axis=-3 if term == "jacobians" else -2)
    return result


def _base_term(model: EvaluatedModel, name: str, term: str, **state: Any) -> Array:
    """Return the values of ``poses``, ``twists``, ``accelerations`` or ``jacobians`` for the base or the world. For the
    moving base these are parts of the base state, for the world and a base at rest the identity pose and zeros."""
    terms = model.evaluator
    batch = np.broadcast_shapes(terms.configuration(state["q"]).shape[:-1], np.shape(state.get("t", 0.0)))
    if term == "jacobians":
        return np.zeros((*batch, 6, terms.functions.sizes["v"]))
    if name == BASE and terms.moving_base:
        struct = terms.base_at(state.get("t", 0.0), state["parameters"], state.get("base"))
        result = struct[..., {"poses": slice(0, 7), "twists": slice(7, 13), "accelerations": slice(13, 19)}[term]]
        if term == "accelerations":
            turning = np.cross(struct[..., 7:10], struct[..., 10:13])
            result = np.concatenate([result[..., :3], result[..., 3:] + turning], axis=-1)
        return np.broadcast_to(result, (*np.broadcast_shapes(batch, result.shape[:-1]), result.shape[-1]))
    still = [1.0, *[0.0] * 6] if term == "poses" else [0.0] * 6
    return np.broadcast_to(np.array(still), (*batch, len(still)))


#: Names of the references in other tools.
_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(("local", "own", "frame"), "body"),
    **dict.fromkeys(("aligned", "world_aligned", "mixed"), "local_world_aligned"),
    **dict.fromkeys(("spatial", "inertial"), "world"),
}


def jacobian(
    model: ExtensibleModel,
    frame: str,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    reference: str = "body",
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the Jacobian J of a body or a frame against the base.

    J v is the twist against the base, without the motion of the base; of a moving body in absolute coordinates, against
    the world. A wrench (moment, force) in the same reference adds J^T wrench to Q. The term is ``frame_jacobians``
    (``_aligned``, ``_world``), compiled at the first call if the model was built without the term.

    Parameters
    ----------
    frame : str
        A body or frame in ``model.frames``: the scene's ``task_frames``, or all if the scene has none.
    q : array_like
        Configuration (..., nq).
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    reference : str
        ``body``: in the frame's own axes. ``local_world_aligned``: in world axes, the linear part of the frame's
        origin. ``world``: in world axes, the linear part of the point at the world's origin.

    Returns
    -------
    J : (..., 6, nv) ndarray
        Rows: angular, then linear; columns: components of v, left-trivialised.

    Raises
    ------
    UsageError
        Names that are not there, frames that are not task frames, wrong shapes.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.jacobian("lower", [0.8, -0.3], reference="local_world_aligned").round(4)[3:]
    array([[0.3484, 0.    ],
           [0.    , 0.    ],
           [0.3587, 0.    ]])
    """
    return _frame_term(model, "frame_jacobians", frame, reference, q=q, t=t, parameters=parameters, base=base)


def jacobian_rate(
    model: ExtensibleModel,
    frame: str,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    reference: str = "body",
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the time derivative of ``jacobian`` along v, dJ/dt.

    The motion of the base is included, by the twist in ``base``: turning in ``local_world_aligned``, turning and travel
    in ``world``; J in ``body`` or in absolute coordinates does not depend on the base. The term is
    ``frame_jacobian_rates`` (``_aligned``, ``_world``).

    Parameters
    ----------
    frame : str
        A body or frame in ``model.frames``: the scene's ``task_frames``, or all if the scene has none.
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    reference : str, optional
        ``body``: in the frame's own axes. ``local_world_aligned``: in world axes, the linear part of the frame's
        origin. ``world``: in world axes, the linear part of the point at the world's origin.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    (..., 6, nv) ndarray
        Rows: angular, then linear; columns: components of v, left-trivialised.

    Raises
    ------
    UsageError
        Names that are not there, frames that are not task frames, wrong shapes.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.jacobian_rate("lower", [0.8, -0.3], [1.0, 0.5]).shape
    (6, 2)
    """
    return _frame_term(model, "frame_jacobian_rates", frame, reference, q=q, v=v, t=t, parameters=parameters, base=base)


def drift(
    model: ExtensibleModel,
    frame: str,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    reference: str = "body",
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return dJ/dt v, the part of the rate of a twist that does not depend on accelerations, by a recursion without
    matrices.

    J a + drift is the rate of J v, the twist against the base as of ``jacobian``: on a base at rest in
    ``local_world_aligned`` the angular acceleration and the acceleration of the origin, else the rate of the twist's
    components. Of the motion of a base, drift contains the turning in ``local_world_aligned``, turning and travel in
    ``world``, and no part in ``body`` or in absolute coordinates; never the acceleration. The term is ``frame_drifts``
    (``_aligned``, ``_world``).

    Parameters
    ----------
    frame : str
        A body or frame in ``model.frames``: the scene's ``task_frames``, or all if the scene has none.
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    reference : str, optional
        ``body``: in the frame's own axes. ``local_world_aligned``: in world axes, the linear part of the frame's
        origin. ``world``: in world axes, the linear part of the point at the world's origin.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.

    Returns
    -------
    (..., 6) ndarray
        Angular, rad/s^2, then linear, m/s^2, in the axes of ``reference``.

    Raises
    ------
    UsageError
        Names that are not there, frames that are not task frames, wrong shapes.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v = [0.8, -0.3], [1.0, 0.5]
    >>> rate = model.jacobian_rate("lower", q, v)
    >>> np.allclose(model.drift("lower", q, v), rate @ v)
    True
    """
    return _frame_term(model, "frame_drifts", frame, reference, q=q, v=v, t=t, parameters=parameters, base=base)


def operational_inertia(
    model: ExtensibleModel,
    frame: str,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    rows: Sequence[int] = (0, 1, 2, 3, 4, 5),
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the operational-space inertia (J M^-1 J^T)^-1 of a body or a frame.

    J is ``local_world_aligned``, so rows 0 to 2 turn about world axes and 3 to 5 move the origin along these axes; kg
    m^2 and kg. Khatib, IEEE J. Robotics and Automation 3 (1987) 43. The term is ``frame_mobilities``, J M^-1 J^T.

    If the scene has constraints, M^-1 is replaced by Z (Z^T M Z)^-1 Z^T, with Z a basis of the velocities that the
    constraints allow (B Z = 0): the constraint-consistent inertia, by which a force at the frame changes the frame's
    acceleration while the loops stay closed. Mistry and Righetti, Robotics: Science and Systems VII (2011), after
    Aghili, IEEE Trans. Robotics 21 (2005) 834. The terms are ``mass``, ``constraint_jacobian`` and
    ``frame_jacobians_aligned``.

    Parameters
    ----------
    frame : str
        A body or frame in ``model.frames``: the scene's ``task_frames``, or all if the scene has none.
    q : array_like
        Configuration (..., nq).
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    rows : sequence of int
        The directions of the task, all six by default; a frame that cannot move in all six directions needs fewer.

    Returns
    -------
    (..., n, n) ndarray
        Symmetric, n being the number of ``rows``, in the order of ``rows``.

    Raises
    ------
    NumericalError
        A direction among ``rows`` in which the frame cannot move, at one of the states: J has not full row rank there,
        or constraints hold the frame.
    UsageError
        Names that are not there, frames that are not task frames, wrong shapes; ``rows`` that are empty, repeated or
        not 0 to 5.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.operational_inertia("lower", [0.8, -0.3], rows=[1, 3]).round(3)
    array([[ 0.096, -0.329],
           [-0.329,  3.296]])
    """
    row_numbers = [int(row) for row in rows]
    if not row_numbers or len(set(row_numbers)) < len(row_numbers) or not set(row_numbers) <= set(range(6)):
        raise UsageError(Problem("rows", f"{shown(str(list(rows)))} are not rows of a twist [E0251]", "rows=[3, 4, 5]"))
    state: dict[str, Any] = {"q": q, "t": t, "parameters": parameters, "base": base}
    constrained = bool(model.evaluator.multipliers)
    every = _held_mobility(model, frame, state) if constrained else _term_of(model, "frame_mobilities", frame, **state)
    mobility = every[..., row_numbers, :][..., row_numbers]
    values = np.linalg.eigvalsh(mobility)
    if not np.all(values[..., 0] > SUMMED * values[..., -1]):
        by = ", for joints and constraints together" if constrained else ""
        fault = f"J M^-1 J^T of {frame} is singular: there is a direction in which it cannot move{by} [E0252]"
        hint = "rows=[...] of the directions in which it can, or a configuration away from the singularity"
        raise NumericalError(Problem("operational_inertia", fault, hint))
    return np.asarray(np.linalg.inv(mobility), dtype=np.float64)


def _held_mobility(model: ExtensibleModel, frame: str, state: Mapping[str, Any]) -> Array:
    """Return the mobility of a frame under constraints, J Z (Z^T M Z)^-1 Z^T J^T, (..., 6, 6), at ``state``.
    By the projector P = Z Z^T, which needs no basis of one size at all states: P M P + s (1 - P) equals M on the
    velocities that constraints leave, and the result does not depend on s > 0."""
    able = model.having(("mass", "constraint_jacobian", "frame_jacobians_aligned"))
    M = able.evaluator.call("mass", **{name: state[name] for name in ("q", "parameters")})[0]
    B = able.evaluator.call("constraint_jacobian", **state)[0]
    J = _term_of(able, "frame_jacobians_aligned", frame, **state)
    nv = M.shape[-1]
    P = np.eye(nv) - np.linalg.pinv(B, rcond=COMPUTED) @ B
    s = np.trace(M, axis1=-2, axis2=-1)[..., np.newaxis, np.newaxis] / nv
    free = np.linalg.solve(P @ M @ P + s * (np.eye(nv) - P), P @ np.swapaxes(J, -1, -2))
    mobility: Array = J @ P @ free
    return 0.5 * (mobility + np.swapaxes(mobility, -1, -2))


def _frame_term(model: ExtensibleModel, term: str, frame: str, reference: str, **state: Any) -> Array:
    if reference not in REFERENCES:
        name = str(reference)
        hint = _meant_reference(name) or nearest(name, REFERENCES)
        raise UsageError(Problem("reference", f"there is no reference {shown(name)} [E0253]", hint))
    return _term_of(model, f"{term}{REFERENCES[reference][0]}", frame, **state)


def _meant_reference(name: str) -> str:
    """Return the reference with this name in other tools; empty if there is none."""
    return name.lower() if name.lower() in REFERENCES else _ELSEWHERE.get(name.lower(), "")


def _term_of(model: ExtensibleModel, term: str, frame: str, **state: Any) -> Array:
    """Return the values of a term of frames for one body or frame, at ``state``; compiles the term if
    missing. Raises UsageError for unknown names, and for frames that are not task frames of the scene."""
    check_place(frame)
    if isinstance(state.get("t"), str):
        hint = f'reference="{_meant_reference(state["t"]) or "body"}"'
        raise UsageError(Problem("t", f"{shown(state['t'])} is not a time: a reference goes by its name [E0254]", hint))
    terms = model.evaluator
    if frame not in terms.frames and frame in (*terms.bodies, *terms.fixed_frames):
        fault = f"{frame} is not a task frame, and the terms of frames give {', '.join(terms.frames)} only [E0255]"
        raise UsageError(Problem("task_frames", fault, f'task_frames = [..., "{frame}"], or none for all'))
    if frame not in terms.frames:
        hint = f"{nearest(str(frame), terms.frames)}; for a point point_jacobian(body, r, q), or [frames] in the scene"
        raise UsageError(Problem("", f"there is no body or frame {shown(str(frame))} [E0256]", hint))
    every = model.having((term,)).evaluator.call(term, **state)[0]
    result: Array = np.take(every, terms.frames.index(frame), axis=-2 if term.startswith("frame_drifts") else -3)
    return result
