"""The regressor of a compiled model: tau = Y pi + tau0, linear in inertial parameters, rotor inertias and friction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import ByName
from eomgen.compiled.terms import Extensible, Inputs, Parameters, States, Terms
from eomgen.errors import Problem, UsageError


class Regressor(NamedTuple):
    """Inverse dynamics is ``matrix @ pi + remainder``, pi being the values of ``regressor_parameters``.

    Attributes
    ----------
    matrix : (..., nv, parameters)
    remainder : (..., nv), part of tau due to springs, inputs and formulas, N or N m
    """

    matrix: Array
    remainder: Array


def regressor(
    model: Extensible,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Regressor:
    """Return the regressor Y of inverse dynamics, and the remainder of tau.

    Columns are in the order of ``regressor_parameters``: of each body that moves its mass, first moments and inertia
    about the origin of its frame, in its axes; rotor inertia, damping and levels of dry friction of joints that have
    them.

    Raises
    ------
    UsageError
        Absolute coordinates, or bodies that deform.
    """
    made = _with(model, "regressor")
    values = made.call("regressor", q=q, v=v, a=a, t=t, u=u, z=z, parameters=parameters, base=base)
    return Regressor(*values)


def regressor_parameters(model: Extensible, *, parameters: Parameters = None) -> dict[str, Array]:
    """Return the parameters of the regressor by name, (...) each, in the order of its columns, in SI units.

    Raises
    ------
    UsageError
        As of ``regressor``.
    """
    made = _with(model, "regressor_parameters")
    (values,) = made.call("regressor_parameters", q=made.initial_q, parameters=parameters)
    names = [item.name for item in made.description.linear_parameters]
    return ByName("parameter of the regressor", dict(zip(names, np.moveaxis(values, -1, 0), strict=True)))


def _with(model: Extensible, term: str) -> Terms:
    """Return the terms with one more term compiled. Raises UsageError if the equations are not linear in these
    parameters."""
    evaluator = model.evaluator
    if not evaluator.description.linear_parameters:
        if evaluator.beams:
            fault = f"the bodies {', '.join(sorted(evaluator.beams))} deform, and ten numbers do not tell their inertia"
            hint = 'a scene without beams, or parameter_partials(q, v, a, of=["..."]) in parameters of the scene'
        else:
            fault = (
                "in absolute coordinates q has positions of centres of mass, so coordinates change with the parameters"
            )
            hint = 'joint coordinates: eomgen.load(path, coordinates="joint")'
        raise UsageError(Problem("regressor", fault, hint))
    return model.having((term,)).evaluator
