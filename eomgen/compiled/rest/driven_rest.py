"""Rest relative to drives of constant rate: the velocities of the driven coordinates, and whether a state stays at
rest.

Laws of time enter the rows as Phi_t. A state is at rest relative to the drives if only driven coordinates move, B v =
-Phi_t with v constant, and if no force on the rest changes along this motion (a relative equilibrium; Marsden 1992,
chapter 4).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.messages import distinct, first_of
from eomgen.base.rounding import SUMMED, WRITTEN
from eomgen.compiled.rest.state_warnings import SceneMeasures, off_axis_hint
from eomgen.compiled.terms import Inputs
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.lie.product import update
from eomgen.solvers.regular_inertia import regular_inertia

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Fractions of a turn of the fastest drive at which rates and forces are looked at again.
_LATER = (0.11, 0.37, 1.0, 2.6)
_AS_IT_MOVES = 'at="initial", or solution.linearize(t) about the motion itself'


def law_rates(model: CompiledModel, measures: SceneMeasures, q: Array) -> Array:
    """Return the rates Phi_t of the constraint rows, (rows,), due to laws of time at q, without the law of the base.
    Rates are zero that the law's acceleration makes up over a way of rounding."""
    if not model.multipliers:
        return np.zeros(0)
    able, arguments, rest = _kinematic(model), _arguments(measures), np.zeros(model.nv)
    (rates,) = able.evaluate("constraint_velocity", q, rest, **arguments).values()
    (changes,) = able.evaluate("constraint_bias", q, rest, **arguments).values()
    length = measures.length(q)
    reach = np.array([1.0 if unit in ("1", "1/s") else length for unit in model.library.layout["row_units"]])
    # a rate that the law's acceleration reaches at once is rounding
    result: Array = np.where(rates**2 > SUMMED * reach * np.abs(changes), rates, 0.0)
    return result


def driven_velocity(model: CompiledModel, measures: SceneMeasures, q: Array) -> Array:
    """Return the velocity, (nv,), of coordinates driven by laws of time at q; zero without a rate at this time.

    The velocity is the least one on the rows: components of driven joints have the rates of the laws.

    Raises
    ------
    NumericalError
        Bodies have absolute coordinates, whose velocities at rest relative to drives are not constant.
    """
    rates = law_rates(model, measures, q)
    if not np.any(rates):
        return np.zeros(model.nv)
    if model.description.joints:
        fault = "bodies have absolute coordinates, in which rest relative to drives is a steady motion [E0039]"
        raise NumericalError(Problem("equilibrium", fault, 'model.steady_motion(), or coordinates = "joint"'))
    (B,) = model.evaluate("constraint_jacobian", q, **_arguments(measures)).values()
    extents = _extents(model, measures, q)
    v = extents * np.linalg.lstsq(B * extents, -rates, rcond=None)[0]
    result: Array = np.where(np.abs(v) > SUMMED * np.max(np.abs(v) / extents) * extents, v, 0.0)
    return result


def driven_components(model: CompiledModel, measures: SceneMeasures, q: Array) -> dict[str, float]:
    """Return the rates, by component of v without ``v.``, of components that a row drives alone at a rate not zero."""
    rates = law_rates(model, measures, q)
    if not np.any(rates):
        return {}
    (B,) = model.evaluate("constraint_jacobian", q, **_arguments(measures)).values()
    result: dict[str, float] = {}
    for rate, row in zip(rates.tolist(), B, strict=True):
        moving = np.flatnonzero(row)
        if rate and len(moving) == 1:
            k = int(moving[0])
            result[model.v_names[k].removeprefix("v.")] = -rate / float(row[k])
    return result


def where_driven(model: CompiledModel, measures: SceneMeasures, q: Array) -> Array:
    """Return q, (nq,), moved onto the holonomic rows at the measures' time by Newton's corrections, also over turns.
    Corrections end as soon as one does not reduce the largest violation, or after twelve."""
    if not model.functions.sizes["holonomic"]:
        return q
    arguments, extents = _arguments(measures), _extents(model, measures, q)

    def off(at: Array) -> Array:
        (violation,) = model.evaluate("constraint", at, **arguments).values()
        return np.asarray(violation, dtype=float)

    violation = off(q)
    for _ in range(12):
        (B,) = model.evaluate("constraint_jacobian", q, **arguments).values()
        step = extents * np.linalg.lstsq(B[: len(violation)] * extents, -violation, rcond=None)[0]
        nearer = _move(model, measures, q, step, 1.0)
        left = off(nearer)
        if not np.max(np.abs(left)) < np.max(np.abs(violation)):
            break
        q, violation = nearer, left
    return q


def check_rates(model: CompiledModel, measures: SceneMeasures, q: Array, v: Array) -> None:
    """Raise NumericalError if the drives that give velocities v (nv,) at q do not keep these later."""
    extents = _extents(model, measures, q)
    size = float(np.max(np.abs(v) / extents))
    for seconds in _later(size):
        later = SceneMeasures(model, measures.p, measures.t + seconds, measures.base)
        then = driven_velocity(model, later, _move(model, later, q, v, seconds))
        k = int(np.argmax(np.abs(then - v) / extents))
        if not abs(then[k] - v[k]) <= WRITTEN * size * extents[k]:
            before, after = distinct(float(v[k]), float(then[k]))
            unit = model.v_units[k]
            fault = (
                f"there is no rest relative to the drive of {drives(model, v)}, for {model.v_names[k]} changes along"
                f" it: {before} {unit} at t = {measures.t:.6g} s, {after} {unit} at t = {later.t:.6g} s [E0040]"
            )
            hint = f'a law of constant rate such as "w*t", a t at which its rate is zero, {_AS_IT_MOVES}'
            raise NumericalError(Problem("equilibrium", fault, hint))


def check_lasting(model: CompiledModel, measures: SceneMeasures, u: Inputs, q: Array, v: Array, z: Array) -> None:
    """Raise NumericalError if forces at a rest relative to drives, q, v, z, change as the drives move on with v. ``u``
    are the inputs; the accelerations at later times are compared with the state's own."""
    extents = _extents(model, measures, q)
    pace = float(np.max(np.abs(v) / extents))
    left = 2.0 * np.abs(_imbalance(model, measures, u, q, v, z))
    for seconds in _later(pace):
        later = SceneMeasures(model, measures.p, measures.t + seconds, measures.base)
        there = _move(model, later, q, v, seconds)
        excess = np.abs(_imbalance(model, later, u, there, v, z)) - left
        k = int(np.argmax(excess / extents))
        if excess[k] <= WRITTEN * pace**2 * extents[k]:
            continue
        unit = model.v_units[k].replace("/s", "/s^2")
        fault = (
            f"there is no rest relative to the drive of {drives(model, v)}, for forces change as it moves: at"
            f" t = {later.t:.6g} s {model.v_names[k]} would accelerate with {excess[k]:.3g} {unit} [E0041]"
        )
        hint = off_axis_hint(model, measures, q, v) or (
            "a scene that is symmetric about the driven axis (axes and masses), with gravity along the axis or none"
        )
        raise NumericalError(Problem("equilibrium", fault, f"{hint}; {_AS_IT_MOVES}"))


def drives(model: CompiledModel, v: Array) -> str:
    """Return the moving coordinates and their rates in words: ``spin at 300 rad/s``."""
    every = zip(model.v_names, v.tolist(), model.v_units, strict=True)
    return first_of([f"{name.removeprefix('v.')} at {value:.6g} {unit}" for name, value, unit in every if value], 3)


def _kinematic(model: CompiledModel) -> CompiledModel:
    """Return a model that has the rows' rates. Raises UsageError for a model without this function that cannot be built
    with it."""
    needed = ("constraint_velocity", "constraint_bias")
    able = model.having(needed)
    if missing := [name for name in needed if name not in able.functions]:
        fault = f"the terms {', '.join(missing)} are needed, and the model was built without them [E0042]"
        raise UsageError(
            Problem("equilibrium", fault, f"eomgen.build(scene, terms=[..., {', '.join(map(repr, missing))}])")
        )
    return able


def _imbalance(model: CompiledModel, measures: SceneMeasures, u: Inputs, q: Array, v: Array, z: Array) -> Array:
    """Return the accelerations, (nv,), that the forces cause at q, v, z and that constraint forces do not take up.
    Accelerations that the rows ask for along v are included."""
    rest, arguments = np.zeros(model.nv), _arguments(measures)
    lam = np.zeros(len(model.multipliers))
    (r,) = model.evaluate("residual", q, v, rest, z=z, multipliers=lam, u=u, **arguments).values()
    (B,) = model.evaluate("constraint_jacobian", q, **arguments).values()
    (asked,) = _kinematic(model).evaluate("constraint_bias", q, v, **arguments).values()
    M = regular_inertia(model.having(("mass",)).mass(q, parameters=measures.p), B, _extents(model, measures, q))
    L = np.linalg.cholesky(M)
    rows = np.linalg.solve(L, B.T).T
    of_forces = -np.linalg.solve(L, r)
    inverse = np.linalg.pinv(rows)
    result = of_forces - inverse @ (rows @ of_forces + asked)
    return np.asarray(np.linalg.solve(L.T, result), dtype=float)


def _move(model: CompiledModel, later: SceneMeasures, q: Array, v: Array, seconds: float) -> Array:
    return model.evaluator.follow_angles(update(model.factors, q, v * seconds), later.t, later.p, later.base)


def _later(pace: float) -> list[float]:
    return [share * 2.0 * np.pi / pace for share in _LATER]


def _extents(model: CompiledModel, measures: SceneMeasures, q: Array) -> Array:
    return np.where([unit == "rad/s" for unit in model.v_units], 1.0, measures.length(q))


def _arguments(measures: SceneMeasures) -> dict[str, Any]:
    return {"t": measures.t, "parameters": measures.p, "base": measures.base}


def held_base(model: CompiledModel, p: Array, t: ArrayLike) -> Array | None:
    """Return the state of the base, held in its pose at t, (..., 19); None for a base at rest."""
    if "base" not in model.functions:
        return None
    base = model.base(t, parameters=p)
    base[..., 7:] = 0.0
    return base
