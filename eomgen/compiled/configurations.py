"""Configurations of a compiled model as elements of its group: steps along velocities, differences, neutral, random.

Velocities are left-trivialised, as everywhere: ``integrate(q, dq)`` is q exp(dq~); partials in q are along such dq.
A free joint's position changes in the body's own axes. Pinocchio's ``integrate`` and ``difference`` are the same maps,
with its own order of numbers.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.compiled.arguments import components
from eomgen.compiled.terms import EvaluatedModel, Parameters
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import evaluate
from eomgen.lie import product
from eomgen.lie.groups import group_named

#: How far random coordinates without limits go, by unit.
_REACH = {"rad": math.pi, "m": 1.0}


def integrate(
    model: EvaluatedModel, q: ArrayLike, dq: ArrayLike, t: float = 0.0, *, parameters: Parameters = None
) -> Array:
    """Return q exp(dq~): the configuration after an increment.

    Quaternions are scaled back to unit length without a change of sign. Angles that are counted over turns, after the
    poses in q, follow.

    Parameters
    ----------
    q, dq : array_like
        Configuration (..., nq) and left-trivialised increment (..., nv): velocity times time, rad and m.
    t : float, optional
        Time of the result, s, for angles that are counted over turns.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    (..., nq) ndarray
        Configuration with quaternions of unit length.

    Raises
    ------
    UsageError
        Wrong shapes, or quaternions that are not of unit length.

    Warns
    -----
    RuntimeWarning
        A third argument other than 0 if the model counts no angles over turns: the argument is a time, not a step.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.integrate([0.8, -0.3], [0.1, 0.2]).round(3)
    array([ 0.9, -0.1])
    """
    terms = model.evaluator
    if not terms.angles and np.any(t):
        warning = "integrate takes no step: its third argument is t, on which nothing depends here"
        warnings.warn(f"{warning}; try: integrate(q, v * dt) if a step is meant [W0020]", RuntimeWarning, stacklevel=3)
    start, step = terms.configuration(q), terms.velocity("dq", dq)
    shape = np.broadcast_shapes(start.shape[:-1], step.shape[:-1])
    start, step = np.broadcast_to(start, (*shape, start.shape[-1])), np.broadcast_to(step, (*shape, step.shape[-1]))
    return terms.follow_angles(product.update(terms.factors, start, step), t, terms.parameters(parameters))


def difference(model: EvaluatedModel, first: ArrayLike, second: ArrayLike) -> Array:
    """Return the left-trivialised increment between two configurations.

    ``integrate(first, dq)`` is ``second`` up to signs of quaternions. Rotations between quaternions turn by pi at most;
    angles of joints of one coordinate are subtracted as numbers, over turns as well.

    Parameters
    ----------
    first, second : array_like
        Configurations (..., nq).

    Returns
    -------
    dq : (..., nv) ndarray
        Left-trivialised, body axes of ``first``: angles in rad, lengths in m.

    Raises
    ------
    UsageError
        Wrong shapes, or quaternions that are not of unit length.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.difference([0.8, -0.3], [0.9, -0.1]).round(3)
    array([0.1, 0.2])
    """
    terms = model.evaluator
    return product.difference(terms.factors, terms.configuration(first), terms.configuration(second))


def neutral(model: EvaluatedModel) -> Array:
    """Return the configuration in which every joint is at zero: unit quaternions (1, 0, 0, 0), else zeros.

    Constraints are not regarded: closed loops may be open, in absolute coordinates the centre of mass of every body is
    at the world's origin, and all nodes of geometrically exact beams are at one place. ``model.initial_q`` meets the
    constraints.

    Returns
    -------
    q : (nq,) ndarray
        Configuration with quaternions (w, x, y, z).

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.neutral()
    array([0., 0.])
    """
    q = np.zeros(model.evaluator.functions.sizes["q"])
    for factor in model.evaluator.factors:
        q[factor.q] = group_named(factor.group, factor.v_size).identity
    return q


def random(
    model: EvaluatedModel,
    size: int | Sequence[int] = (),
    *,
    generator: np.random.Generator | int | None = None,
    parameters: Parameters = None,
) -> Array:
    """Return random configurations.

    Orientations are uniform; coordinates are uniform within the limits of their joints, on sides without a limit up to
    -pi or pi rad, or -1 or 1 m, of a limit further out by pi rad or 1 m from it, and elastic coordinates in small
    deformations. Constraints are not regarded: ``model.consistent`` finds the nearest configuration that meets the
    constraints.

    Parameters
    ----------
    parameters : mapping or array_like, optional
        Tunable parameters (np,), SI units, on which limits may depend; defaults of the scene if not given.
    size : int or sequence of int
        Leading axes of the result; one configuration (nq,) by default.
    generator : numpy.random.Generator, or a seed
        A new generator, seeded by the system, by default.

    Returns
    -------
    q : (..., nq) ndarray
        Configurations with quaternions (w, x, y, z) of unit length; rad and m.

    Raises
    ------
    UsageError
        A size or a generator that cannot be taken, or several sets of parameters.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.random(3, generator=1).shape
    (3, 2)
    """
    terms = model.evaluator
    try:
        shape = (size,) if isinstance(size, int) else tuple(int(number) for number in size)
        source = np.random.default_rng(generator)
        q = np.zeros((*shape, terms.functions.sizes["q"]))
    except (TypeError, ValueError) as error:
        raise UsageError(Problem("random", str(error), "random(100, generator=1)")) from None
    lower, upper = _ranges(model, parameters)
    q[...] = lower + (upper - lower) * source.random(q.shape)
    for factor in terms.factors:
        if factor.group != "R":
            drawn = source.normal(size=(*shape, 4))
            part = slice(factor.q_start, factor.q_start + 4)
            q[..., part] = drawn / np.linalg.norm(drawn, axis=-1, keepdims=True)
    return terms.follow_angles(components("q", q, q.shape[-1]), 0.0, terms.parameters(parameters))


def _ranges(model: EvaluatedModel, parameters: Parameters) -> tuple[Array, Array]:
    """Return the lowest and highest number of each component of q for random draws, (nq,) each, by limits of joints."""
    terms = model.evaluator
    described = terms.description
    reach = np.array([_REACH.get(unit, 1.0) for unit in terms.q_units], dtype=float)
    by_name = {item.name: item for item in described.coordinates}
    for factor in terms.factors:
        if factor.name in by_name and by_name[factor.name].reach:
            reach[factor.q] = by_name[factor.name].reach
    lower, upper = np.full((2, len(reach)), np.nan)
    values = described.values(dict(zip(terms.parameter_names, terms.one_set(parameters).tolist(), strict=True)))
    for limit in described.limits:
        if limit.coordinate in terms.q_names:
            index = terms.q_names.index(limit.coordinate)
            for side, bound in ((lower, limit.lower), (upper, limit.upper)):
                if bound is not None:
                    side[index] = evaluate(bound, lambda symbol: values[symbol.name])
    lowest = np.where(np.isnan(lower), np.where(upper <= -reach, upper, 0.0) - reach, lower)
    return lowest, np.where(np.isnan(upper), np.where(lower >= reach, lower, 0.0) + reach, upper)
