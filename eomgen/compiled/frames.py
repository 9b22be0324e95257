"""Jacobians of bodies and frames with their rates and drifts, in three references, and operational-space inertias.

Twists are angular first. Pinocchio has the linear part first: its J has our rows in the order 3, 4, 5, 0, 1, 2, and its
columns are in its own order of v. References and their names there: ``body`` (LOCAL), twist in the frame's own axes;
``local_world_aligned`` (LOCAL_WORLD_ALIGNED), world axes, linear part of the frame's origin; ``world`` (WORLD), world
axes, linear part of the point that is at the world's origin. Columns belong to the components of v, so they are
left-trivialised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.text import nearest, shown
from eomgen.compiled.arguments import check_place
from eomgen.compiled.terms import Extensible, Parameters
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.system.terms import REFERENCES

#: Names of the references in other tools.
_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(("local", "own", "frame"), "body"),
    **dict.fromkeys(("aligned", "world_aligned", "mixed"), "local_world_aligned"),
    **dict.fromkeys(("spatial", "inertial"), "world"),
}
#: Part of the largest eigenvalue of J M^-1 J^T below which a direction counts as one in which a frame cannot move.
_SINGULAR = 1e-12
#: Share of the largest singular value of B below which a row counts as one that repeats others.
_DEPENDENT = 1e-10


def jacobian(
    model: Extensible,
    frame: str,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    reference: str = "body",
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the Jacobian J of a body or a frame, (..., 6, nv), angular first.

    J v is the twist against the base, without the motion of the base; a wrench (moment, force) in the same reference
    adds J^T wrench to Q. The term is ``frame_jacobians`` (``_aligned``, ``_world``), compiled at the first call if the
    model was built without it.

    Parameters
    ----------
    reference : str
        ``body``: in the frame's own axes. ``local_world_aligned``: in world axes, the linear part of the frame's
        origin. ``world``: in world axes, the linear part of the point at the world's origin.

    Raises
    ------
    UsageError
        Names that are not there, frames that are no task frames, wrong shapes.
    """
    return _of(model, "frame_jacobians", frame, reference, q=q, t=t, parameters=parameters, base=base)


def jacobian_rate(
    model: Extensible,
    frame: str,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    reference: str = "body",
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return dJ/dt along v, (..., 6, nv); arguments as of ``jacobian``.

    On a moving base the base moves too. The term is ``frame_jacobian_rates`` (``_aligned``, ``_world``).
    """
    return _of(model, "frame_jacobian_rates", frame, reference, q=q, v=v, t=t, parameters=parameters, base=base)


def drift(
    model: Extensible,
    frame: str,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    reference: str = "body",
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return dJ/dt v, (..., 6), by a recursion that needs no matrix; arguments as of ``jacobian``.

    On a base at rest the rate of the twist is J a + drift. In ``local_world_aligned`` that is the angular acceleration
    and the acceleration of the origin. The term is ``frame_drifts`` (``_aligned``, ``_world``).
    """
    return _of(model, "frame_drifts", frame, reference, q=q, v=v, t=t, parameters=parameters, base=base)


def operational_inertia(
    model: Extensible,
    frame: str,
    q: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    rows: Sequence[int] = (0, 1, 2, 3, 4, 5),
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Array:
    """Return the operational-space inertia (J M^-1 J^T)^-1 of a body or a frame, (..., n, n).

    J is ``local_world_aligned``, so rows 0 to 2 turn about world axes and 3 to 5 move the origin along them; kg m^2 and
    kg. Khatib, IEEE J. Robotics and Automation 3 (1987) 43. The term is ``frame_mobilities``, J M^-1 J^T.

    If the scene has constraints, M^-1 is replaced by Z (Z^T M Z)^-1 Z^T, with Z a basis of the velocities that they
    leave (B Z = 0): the constraint-consistent inertia, by which a force at the frame changes its acceleration while the
    loops stay closed. Mistry and Righetti, Robotics: Science and Systems VII (2011), after Aghili, IEEE Trans.
    Robotics 21 (2005) 834. Its terms are ``mass``, ``constraint_jacobian`` and ``frame_jacobians_aligned``.

    Parameters
    ----------
    rows : sequence of int
        The directions of the task, all six by default.

    Raises
    ------
    NumericalError
        A direction in which the frame cannot move: J has not full row rank there, or constraints hold it.
    UsageError
        Names that are not there, frames that are no task frames, wrong shapes.
    """
    wanted = [int(row) for row in rows]
    if not wanted or len(set(wanted)) < len(wanted) or not set(wanted) <= set(range(6)):
        raise UsageError(Problem("rows", f"{shown(str(list(rows)))} are not rows of a twist", "rows=[3, 4, 5]"))
    given: dict[str, Any] = {"q": q, "t": t, "parameters": parameters, "base": base}
    held = bool(model.evaluator.multipliers)
    every = _held_mobility(model, frame, given) if held else _taken(model, "frame_mobilities", frame, **given)
    mobility = every[..., wanted, :][..., wanted]
    values = np.linalg.eigvalsh(mobility)
    if not np.all(values[..., 0] > _SINGULAR * values[..., -1]):
        by = ", for joints and constraints together" if held else ""
        fault = f"J M^-1 J^T of {frame} is singular: there is a direction in which it cannot move{by}"
        hint = "rows=[...] of the directions in which it can, or a configuration away from the singularity"
        raise NumericalError(Problem("operational_inertia", fault, hint))
    return np.asarray(np.linalg.inv(mobility), dtype=np.float64)


def _held_mobility(model: Extensible, frame: str, given: Mapping[str, Any]) -> Array:
    """Return J Z (Z^T M Z)^-1 Z^T J^T, (..., 6, 6).

    By the projector P = Z Z^T, which needs no basis of one size at all states: on the velocities that constraints
    leave, P M P + s (1 - P) is M, and any s does for the others.
    """
    able = model.having(("mass", "constraint_jacobian", "frame_jacobians_aligned"))
    M = able.evaluator.call("mass", **{name: given[name] for name in ("q", "parameters")})[0]
    B = able.evaluator.call("constraint_jacobian", **given)[0]
    J = _taken(able, "frame_jacobians_aligned", frame, **given)
    nv = M.shape[-1]
    P = np.eye(nv) - np.linalg.pinv(B, rcond=_DEPENDENT) @ B
    s = np.trace(M, axis1=-2, axis2=-1)[..., np.newaxis, np.newaxis] / nv
    free = np.linalg.solve(P @ M @ P + s * (np.eye(nv) - P), P @ np.swapaxes(J, -1, -2))
    mobility: Array = J @ P @ free
    return 0.5 * (mobility + np.swapaxes(mobility, -1, -2))


def _of(model: Extensible, term: str, frame: str, reference: str, **given: Any) -> Array:
    if reference not in REFERENCES:
        name = str(reference)
        hint = _meant_reference(name) or nearest(name, REFERENCES)
        raise UsageError(Problem("reference", f"there is no reference {shown(name)}", hint))
    return _taken(model, f"{term}{REFERENCES[reference][0]}", frame, **given)


def _meant_reference(name: str) -> str:
    """Return the reference with this name in other tools; empty if there is none."""
    return name.lower() if name.lower() in REFERENCES else _ELSEWHERE.get(name.lower(), "")


def _taken(model: Extensible, term: str, frame: str, **given: Any) -> Array:
    """Return the values of a term for one body or frame."""
    check_place(frame)
    if isinstance(given.get("t"), str):
        hint = f'reference="{_meant_reference(given["t"]) or "body"}"'
        raise UsageError(Problem("t", f"{shown(given['t'])} is no time: a reference goes by its name", hint))
    terms = model.evaluator
    if frame not in terms.frames and frame in (*terms.bodies, *terms.fixed_frames):
        fault = f"{frame} is no task frame, and the terms of frames give {', '.join(terms.frames)} only"
        raise UsageError(Problem("task_frames", fault, f'task_frames = [..., "{frame}"], or none for all'))
    if frame not in terms.frames:
        hint = f"{nearest(str(frame), terms.frames)}; for a point point_jacobian(body, r, q), or [frames] in the scene"
        raise UsageError(Problem("", f"there is no body or frame {shown(str(frame))}", hint))
    every = model.having((term,)).evaluator.call(term, **given)[0]
    result: Array = np.take(every, terms.frames.index(frame), axis=-2 if term.startswith("frame_drifts") else -3)
    return result
