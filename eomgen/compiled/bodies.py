"""Poses, twists and points of the bodies and frames of a compiled model, and their Jacobians with respect to v.

A frame by name (``[frames]`` of a scene, the fixed links of a URDF) stands wherever a body does. Terms that the model
was built without are compiled when they are first called for.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.compiled.arguments import check_name, check_place, components
from eomgen.compiled.terms import Evaluated, Extensible, Parameters
from eomgen.errors import Problem, UsageError
from eomgen.lie.numeric import quaternion_product, rotated
from eomgen.system.description import BASE, WORLD, FixedFrame

#: Terms that are compiled together if one of them is missing.
_TOGETHER = ("poses", "twists", "jacobians")


class PointMotion(NamedTuple):
    """Motion of a point in world axes, (..., 3) each: the velocity is None without v, the acceleration without a."""

    position: Array
    velocity: Array | None
    acceleration: Array | None = None


def pose(
    model: Extensible,
    body: str,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return quaternion (own to world axes) and position of a body or a frame, (..., 7)."""
    place = _placed(model, body, parameters)
    model = _having(model, place.body, "poses")
    result = _of(model, place.body, "poses", q=q, t=t, parameters=parameters, base=base)
    if place.fixed is None:
        return result
    turn = np.broadcast_to(np.array(place.fixed.quaternion), (*result.shape[:-1], 4))
    position = result[..., 4:] + rotated(result[..., :4], place.position)
    return np.concatenate([quaternion_product(result[..., :4], turn), position], axis=-1)


def twist(
    model: Extensible,
    body: str,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the inertial twist of a body or a frame in its own axes, angular first, (..., 6)."""
    place = _placed(model, body, parameters)
    model = _having(model, place.body, "twists")
    result = _of(model, place.body, "twists", q=q, v=v, t=t, parameters=parameters, base=base)
    if place.fixed is None:
        return result
    omega, velocity = result[..., :3], result[..., 3:] + np.cross(result[..., :3], place.position)
    back = np.array(place.fixed.orientation)
    return np.concatenate([omega @ back, velocity @ back], axis=-1)


@checked_call("point(body, r, q): r is a place in the body's axes, [0, 0, 0] for its origin")
def point(
    model: Extensible,
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
    """Return position, velocity and acceleration in world axes of the point at ``r`` (..., 3) in a body or a frame.

    The velocity needs ``v``; the acceleration needs ``v`` and ``a``.
    """
    body, r = _fixed_in(model, body, r, parameters)
    needed = ["poses"] if v is None else ["poses", "twists"] if a is None else ["poses", "twists", "accelerations"]
    model = _having(model, body, *needed)
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


def body_jacobian(model: Extensible, body: str, q: ArrayLike, *, parameters: Parameters = None) -> Array:
    """Return the Jacobian of a body or a frame in its own axes, angular first, (..., 6, nv).

    The inertial twist is ``body_jacobian(body, q) @ v`` plus the twist of the moving base at the body. Columns belong
    to the components of v, so they are left-trivialised.
    """
    place = _placed(model, body, parameters)
    model = _having(model, place.body, "jacobians")
    result = _of(model, place.body, "jacobians", q=q, parameters=parameters)
    if place.fixed is None:
        return result
    columns = np.swapaxes(result, -1, -2)
    angular, back = columns[..., :3], np.array(place.fixed.orientation)
    linear = columns[..., 3:] + np.cross(angular, place.position[..., np.newaxis, :])
    return np.swapaxes(np.concatenate([angular @ back, linear @ back], axis=-1), -1, -2)


@checked_call("point_jacobian(body, r, q): r is a place in the body's axes, [0, 0, 0] for its origin")
def point_jacobian(
    model: Extensible,
    body: str,
    r: ArrayLike,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the Jacobian of the point at ``r`` (..., 3) in a body or a frame, in world axes, (..., 3, nv).

    The point's velocity in world axes is ``point_jacobian(body, r, q, t) @ v`` plus the velocity of the moving base
    at the point; a force f on the point adds ``point_jacobian(...).T @ f`` to Q.
    """
    body, place = _fixed_in(model, body, r, parameters)
    model = _having(model, body, "poses", "jacobians")
    r = place[..., np.newaxis, :]
    turn = _of(model, body, "poses", q=q, t=t, parameters=parameters, base=base)[..., np.newaxis, :4]
    columns = np.swapaxes(body_jacobian(model, body, q, parameters=parameters), -1, -2)
    return np.swapaxes(rotated(turn, columns[..., 3:] + np.cross(columns[..., :3], r)), -1, -2)


def _having(model: Extensible, name: str, *terms: str) -> Extensible:
    """Return a model of the same scene that has some terms of bodies, one of which is named."""
    if all(term in model.evaluator.functions for term in terms):
        return model
    _check_name(model, name)
    return model.having(tuple(dict.fromkeys((*_TOGETHER, *terms))))


def _check_name(model: Evaluated, name: str) -> None:
    """Raise UsageError for a name of no body and no frame, unless it is the base or the world with frames on it."""
    frames = model.evaluator.fixed_frames
    if name not in (BASE, WORLD) or all(frame.body != name for frame in frames.values()):
        check_name("body", name, [*model.evaluator.bodies, *frames])


class _Placed(NamedTuple):
    """Carrying body of a point, and the point's position on it; ``fixed`` is None for a body itself."""

    body: str
    fixed: FixedFrame | None
    position: Array


def _placed(model: Evaluated, name: str, parameters: Parameters) -> _Placed:
    """Return the body that a name stands for, or the body that carries a frame, with the frame's position (..., 3)."""
    check_place(name)
    terms = model.evaluator
    frame = terms.fixed_frames.get(name)
    if frame is None:
        return _Placed(name, None, np.zeros(3))
    return _Placed(frame.body, frame, _rigid(model, name, frame.body, terms.place_of(frame, parameters)))


def _fixed_in(model: Evaluated, body: str, r: ArrayLike, parameters: Parameters) -> tuple[str, Array]:
    """Return the body that carries a point, and the point's coordinates in it."""
    check_place(body)
    at = components("r", r, 3)
    place = _placed(model, body, parameters)
    if place.fixed is not None:
        at = place.position + at @ np.array(place.fixed.orientation).T
    return place.body, _rigid(model, body, place.body, at)


def _rigid(model: Evaluated, name: str, body: str, position: Array) -> Array:
    """Return coordinates in a body's frame, once it is clear that they belong to a point that the frame carries."""
    if body in model.evaluator.beams and np.any(position != 0.0):
        fault = "the beam deforms, and the compiled model knows its shapes at the points of the scene only"
        raise UsageError(
            Problem(f"point of {name}", fault, "an entry of [points] with an output of it; r = 0 for the frame")
        )
    return position


def _of(model: Evaluated, body: str, term: str, **given: Any) -> Array:
    terms = model.evaluator
    _check_name(model, body)
    if body in (BASE, WORLD):
        return _of_base(model, body, term, **given)
    every = terms.call(term, **given)[0]
    result: Array = np.take(every, terms.bodies.index(body), axis=-3 if term == "jacobians" else -2)
    return result


def _of_base(model: Evaluated, name: str, term: str, **given: Any) -> Array:
    """Return the values of a term of bodies for the base or the world, which carry frames, too."""
    terms = model.evaluator
    batch = np.broadcast_shapes(terms.configuration(given["q"]).shape[:-1], np.shape(given.get("t", 0.0)))
    if term == "jacobians":
        return np.zeros((*batch, 6, terms.functions.sizes["v"]))
    if name == BASE and terms.moving_base:
        struct = terms.base_at(given.get("t", 0.0), given["parameters"], given.get("base"))
        result = struct[..., {"poses": slice(0, 7), "twists": slice(7, 13), "accelerations": slice(13, 19)}[term]]
        if term == "accelerations":
            turning = np.cross(struct[..., 7:10], struct[..., 10:13])
            result = np.concatenate([result[..., :3], result[..., 3:] + turning], axis=-1)
        return np.broadcast_to(result, (*np.broadcast_shapes(batch, result.shape[:-1]), result.shape[-1]))
    still = [1.0, *[0.0] * 6] if term == "poses" else [0.0] * 6
    return np.broadcast_to(np.array(still), (*batch, len(still)))
