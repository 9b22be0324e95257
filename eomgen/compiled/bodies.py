"""Poses, twists and points of the bodies of a compiled model, and their Jacobians with respect to v."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from eomgen.arrays import Array
from eomgen.compiled.arguments import check_name, components
from eomgen.compiled.coordinates import rotated
from eomgen.compiled.terms import Evaluated, Parameters
from eomgen.errors import Problem, UsageError


class PointMotion(NamedTuple):
    """Motion of a point in world axes, (..., 3) each: the velocity is None without v, the acceleration without a."""

    position: Array
    velocity: Array | None
    acceleration: Array | None = None


def pose(
    model: Evaluated,
    body: str,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return quaternion (body to world axes) and position of a body's frame, (..., 7)."""
    return _of(model, body, "poses", q=q, t=t, parameters=parameters, base=base)


def twist(
    model: Evaluated,
    body: str,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the inertial twist of a body's frame in body axes, angular first, (..., 6)."""
    return _of(model, body, "twists", q=q, v=v, t=t, parameters=parameters, base=base)


def point(
    model: Evaluated,
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
    """Return position, velocity and acceleration in world axes of the point at ``r`` (..., 3) in a body's frame.

    The velocity needs ``v``; the acceleration needs ``v``, ``a``, and a model built with the term
    ``accelerations``.
    """
    r = _fixed_in(model, body, r)
    given: dict[str, Any] = {"q": q, "t": t, "parameters": parameters, "base": base}
    pose = _of(model, body, "poses", **given)
    turn = pose[..., :4]
    position = pose[..., 4:] + rotated(turn, r)
    if v is None:
        return PointMotion(position, None)
    twist = _of(model, body, "twists", v=v, **given)
    omega = twist[..., :3]
    velocity = rotated(turn, twist[..., 3:] + np.cross(omega, r))
    if a is None:
        return PointMotion(position, velocity)
    rate = _of(model, body, "accelerations", v=v, a=a, **given)
    relative = np.cross(rate[..., :3], r) + np.cross(omega, np.cross(omega, r))
    return PointMotion(position, velocity, rotated(turn, rate[..., 3:] + relative))


def body_jacobian(model: Evaluated, body: str, q: ArrayLike, *, parameters: Parameters = None) -> Array:
    """Return the Jacobian of a body's frame in body axes, angular first, (..., 6, nv).

    The inertial twist is ``body_jacobian(body, q) @ v``, plus that of the moving base carried along. Columns belong
    to the components of v, so they are left-trivialised. The model must have been built with the term
    ``jacobians``.
    """
    return _of(model, body, "jacobians", q=q, parameters=parameters)


def point_jacobian(
    model: Evaluated,
    body: str,
    r: ArrayLike,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the Jacobian of the point at ``r`` (..., 3) in a body's frame, in world axes, (..., 3, nv).

    The point's velocity in world axes is ``point_jacobian(body, r, q, t) @ v``, plus what the moving base gives to
    it where it is; a force f on the point adds ``point_jacobian(...).T @ f`` to Q. The model must have been built
    with the terms ``poses`` and ``jacobians``.
    """
    r = _fixed_in(model, body, r)[..., np.newaxis, :]
    turn = _of(model, body, "poses", q=q, t=t, parameters=parameters, base=base)[..., np.newaxis, :4]
    columns = np.swapaxes(body_jacobian(model, body, q, parameters=parameters), -1, -2)
    return np.swapaxes(rotated(turn, columns[..., 3:] + np.cross(columns[..., :3], r)), -1, -2)


def _fixed_in(model: Evaluated, body: str, r: ArrayLike) -> Array:
    """Return coordinates in a body's frame, once it is clear that they belong to a point that the frame carries."""
    place = components("r", r, 3)
    if body in model.evaluator.beams and np.any(place != 0.0):
        what = "the beam deforms, and the compiled model knows its shapes at the points of the scene only"
        raise UsageError(
            Problem(f"point of {body}", what, "an entry of [points] with an output of it; r = 0 for the frame")
        )
    return place


def _of(model: Evaluated, body: str, term: str, **given: Any) -> Array:
    check_name("body", body, model.evaluator.bodies)
    every = model.evaluator.call(term, **given)[0]
    found: Array = np.take(every, model.evaluator.bodies.index(body), axis=-3 if term == "jacobians" else -2)
    return found
