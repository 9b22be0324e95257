"""Partials of a compiled model's equations and outputs in the tunable parameters, and the regressor of inertial
parameters: tau = Y pi + tau0, linear in inertial parameters, rotor inertias and friction.

t, q, v, a, z and the multipliers are held, and so are inputs that a controller or a caller drives; inputs that the
scene gives and the motion of the base follow their laws. Terms are compiled at the first call if the model was built
without them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults, names_of
from eomgen.compiled.arguments import check_name
from eomgen.compiled.terms import ExtensibleModel, Inputs, Parameters, States, Terms
from eomgen.errors import Problem, UsageError


class ParameterPartials(NamedTuple):
    """Partials in parameters, one column each; without rows if the scene has no internal states or constraints.

    Attributes
    ----------
    residual : (..., nv, parameters), of M a + h + b - Q + B^T lam
    rate : (..., nz, parameters), of zdot
    constraint : (..., holonomic, parameters), of Phi
    constraint_velocity : (..., rows, parameters), of B v + Phi_t, then of the rows at velocity level
    constraint_acceleration : (..., rows, parameters), of B a + g
    """

    residual: Array
    rate: Array
    constraint: Array
    constraint_velocity: Array
    constraint_acceleration: Array


#: Blocks of the term, in the order of ``ParameterPartials``.
_BLOCKS = ("Rp", "Fp", "Phip", "Zp", "Ap")


def parameter_partials(
    model: ExtensibleModel,
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
    of: Sequence[str] | None = None,
) -> ParameterPartials:
    """Return partials of the equations in tunable parameters, exact to rounding.

    q, v, a, z, the multipliers and inputs that the scene does not prescribe are held; prescribed inputs and the motion
    of the base change with the parameters by their laws, even if ``u`` or ``base`` gives their values. Without
    constraints ``residual`` is the partial of inverse dynamics, d tau / dp. The term is compiled at the first call if
    the model was built without it.

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
    of : sequence of str, optional
        Tunable parameters, all in the order of ``model.parameters`` if not given.

    Returns
    -------
    ParameterPartials
        ``residual`` (..., nv, n) of M a + h + b - Q + B^T lam, ``rate`` (..., nz, n) of zdot, ``constraint`` (...,
        holonomic rows, n) of Phi, ``constraint_velocity`` (..., rows, n) of B v + Phi_t, then of the rows at velocity
        level, and ``constraint_acceleration`` (..., rows, n) of B a + g, with a column for each of the n parameters in
        ``of``, per SI unit.

    Raises
    ------
    UsageError
        A parameter that is fixed in the code or unknown; a scene without tunable parameters.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> partials = model.parameter_partials([0.8, -0.3], [1.0, 0.5], [0.2, 0.1], of=["m2"])
    >>> partials.residual.round(4)
    array([[4.9627],
           [1.6629]])
    """
    chosen = _columns(model.evaluator, of)
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "base": base}
    evaluator = model.having(("parameter_partials",)).evaluator
    values = evaluator.call("parameter_partials", **arguments, multipliers=multipliers, parameters=parameters)
    result = dict(zip(evaluator.functions.output_names("parameter_partials"), values, strict=True))
    none = np.zeros((*values[0].shape[:-2], 0, values[0].shape[-1]))
    return ParameterPartials(*(result.get(name, none)[..., chosen] for name in _BLOCKS))


def output_parameter_partials(
    model: ExtensibleModel,
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
    of: Sequence[str] | None = None,
) -> dict[str, Array]:
    """Return partials of the scene's outputs in tunable parameters, with q, v, a, z and multipliers held.

    Inputs that the scene prescribes and the motion of the base change with the parameters by their laws, even if ``u``
    or ``base`` gives their values; further inputs are held. The term is compiled at the first call if the model was
    built without it.

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
        Multipliers of the constraints (..., rows); if not given zero, or computed with a if outputs need a and a is not
        given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    of : sequence of str, optional
        Tunable parameters, all in the order of ``model.parameters`` if not given.

    Returns
    -------
    dict
        Arrays by output: (..., parameters), or (..., size, parameters) for outputs of several components; empty if the
        scene has no outputs.

    Raises
    ------
    UsageError
        A parameter that is fixed in the code or unknown; a scene without tunable parameters; accelerations that outputs
        need and that are not given, unless the model was built with this term and the terms of forward dynamics, which
        then computes a.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.output_parameter_partials([0.8, -0.3], [0.0, 0.0])["energy"].round(4)
    array([-6.6448])
    """
    chosen = _columns(model.evaluator, of)
    outputs = model.evaluator.library.layout["outputs"]
    if not outputs:
        return NamedResults("output", {})
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "base": base}
    term = "output_parameter_partials"
    (values,) = model.having((term,)).evaluator.call(term, **arguments, multipliers=multipliers, parameters=parameters)
    result, start = NamedResults[Array]("output", {}), 0
    for item in outputs:
        rows = values[..., start : start + int(item["size"]), :][..., chosen]
        result[str(item["name"])] = rows[..., 0, :] if int(item["size"]) == 1 else rows
        start += int(item["size"])
    return result


def _columns(terms: Terms, of: Sequence[str] | None) -> list[int]:
    """Return the indices of tunable parameters by name, None: of all. Raises UsageError for unknown or fixed names."""
    if not terms.parameter_names:
        fault = "the scene has no tunable parameters, so there is nothing to differentiate in [E0270]"
        hint = "mass = { value = ..., tunable = true } in the scene's [parameters]"
        raise UsageError(Problem("parameter_partials", fault, hint))
    if of is None:
        return list(range(len(terms.parameter_names)))
    names = names_of("of", "parameters", of, terms.parameter_names[0])
    for name in names:
        check_name("parameter", name, terms.parameter_names, terms.fixed_parameters)
    return [terms.parameter_names.index(name) for name in names]


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
    model: ExtensibleModel,
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

    Columns are in the order of ``regressor_parameters``: mass, first moments and inertia of each moving body, always
    ten, in body axes about the origin of the body's frame; then rotor inertia, damping and levels of dry friction of
    each joint, of which coefficients that are 0 in the scene have no column. The remainder has springs, inputs and
    formulas; gravity is in Y. The term is compiled at the first call if the model was built without it.

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
    Regressor
        ``matrix`` Y (..., nv, parameters) and ``remainder`` (..., nv): tau = Y pi + remainder.

    Raises
    ------
    UsageError
        Absolute coordinates, or bodies that deform.

    Examples
    --------
    >>> model = eomgen.build("examples/robot_arm/scene.toml")
    >>> q = model.initial_q
    >>> Y, rest = model.regressor(q, np.zeros(7), np.ones(7))
    >>> pi = np.array(list(model.regressor_parameters().values()))
    >>> np.allclose(Y @ pi + rest, model.inverse_dynamics(q, np.zeros(7), np.ones(7)))
    True
    """
    made = _with(model, "regressor")
    values = made.call("regressor", q=q, v=v, a=a, t=t, u=u, z=z, parameters=parameters, base=base)
    return Regressor(*values)


def regressor_parameters(model: ExtensibleModel, *, parameters: Parameters = None) -> dict[str, Array]:
    """Return the parameters pi of the regressor.

    The term is compiled at the first call if the model was built without it.

    Parameters
    ----------
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    dict
        Arrays (...) by name, in the order of the columns, SI units.

    Raises
    ------
    UsageError
        Absolute coordinates, or bodies that deform.

    Examples
    --------
    >>> model = eomgen.build("examples/robot_arm/scene.toml")
    >>> list(model.regressor_parameters())[:4]
    ['link1.mass', 'link1.first_moment_x', 'link1.first_moment_y', 'link1.first_moment_z']
    """
    made = _with(model, "regressor_parameters")
    (values,) = made.call("regressor_parameters", q=made.initial_q, parameters=parameters)
    names = [item.name for item in made.description.linear_parameters]
    return NamedResults("parameter of the regressor", dict(zip(names, np.moveaxis(values, -1, 0), strict=True)))


def _with(model: ExtensibleModel, term: str) -> Terms:
    """Return the evaluator of a model with the term. Raises UsageError for bodies that deform or absolute
    coordinates."""
    evaluator = model.evaluator
    if not evaluator.description.linear_parameters:
        if evaluator.beams:
            fault = (
                f"the bodies {', '.join(sorted(evaluator.beams))} deform, and ten numbers do not give their"
                f" inertia [E0272]"
            )
            hint = 'a scene without beams, or parameter_partials(q, v, a, of=["..."]) in parameters of the scene'
        else:
            fault = (
                "in absolute coordinates q has positions of centres of mass, so coordinates change with the"
                " parameters [E0273]"
            )
            hint = 'joint coordinates: eomgen.load(path, coordinates="joint")'
        raise UsageError(Problem("regressor", fault, hint))
    return model.having((term,)).evaluator
