"""How the state that a run starts from follows from parameters: static equilibrium, and corrections onto constraints.

Rest solves r(q, v = 0, a = 0, z, lam, p) = 0, F(q, z, p) = 0 and Phi(q, p) = 0, so by the implicit function theorem

    [ K   R_z  B^T ] [ dq   ]     [ R_p   ]
    [ F_q F_z  0   ] [ dz   ] = - [ F_p   ] dp
    [ B   0    0   ] [ dlam ]     [ Phi_p ]

A state that does not meet the constraints is moved onto them by Newton's steps q o exp(-c), M c = B^T sigma, B c = Phi,
and velocities by one, M c = B^T sigma, B c = w: M and B change with the start of a step, so if c is finite,

    M dc - B^T dsigma = dB^T sigma - dM c,   B dc = dPhi - dB c.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.initial_state import InitialState
from eomgen.errors import Problem, UsageError
from eomgen.lie import product
from eomgen.products.derivatives.equations import Equations, Partials
from eomgen.simulation.stepping.states import Prescribed, States

#: Steps onto constraints, and parts of the largest one below which later ones change no derivative.
_STEPS, _LAST = 50, 1e-13
#: Singular values of the equations of rest, below this part of the largest: rest is undetermined along them.
_UNDETERMINED = 1e-10
#: Corrections of a state above this part of its numbers are finite: second derivatives would have to follow them.
FINITE = 1e-10


@dataclass(frozen=True)
class Rest:
    """Static equilibrium made linear.

    Attributes
    ----------
    values : input blocks there
    matrix : partials of forces, rates of z and constraints in q, z and multipliers
    slopes : (nv + nz + holonomic, parameters), of q (left-trivialised), z and multipliers
    """

    values: dict[str, Array]
    matrix: Array
    slopes: Array


def at_rest(equations: Equations, state: InitialState, t: Array, given: Prescribed, du: Array | None) -> Rest:
    """Return the partials of a rest in the parameters.

    Parameters
    ----------
    t : (1,) s; inputs that are ``given`` there change by ``du`` along their directions

    Raises
    ------
    UsageError
        Rest is undetermined along some component.
    """
    nv, nz, nh, nl = equations.nv, equations.nz, equations.holonomic, equations.nl
    still = InitialState(state.q, np.zeros(nv), state.z)
    values = _values(equations, still, t, given, du)
    moves = nl and np.any(equations.of("constraint_velocity", values)["w"])
    if moves or equations.model.evaluator.moving_base:
        fault = "the scene starts at static equilibrium beside moving drives, which has no derivatives here"
        raise UsageError(Problem("start", fault, "initial = model.equilibrium().initial, for a start that is held"))
    if nl:
        (r,) = equations.of("residual", values).values()
        B = equations.of("constraint_jacobian", values)["B"][0]
        values["lam"] = -np.linalg.lstsq(B.T, r[0], rcond=None)[0][np.newaxis]
    result = equations.partials(values)
    matrix = _rest_matrix(equations, result)
    M = result.Ja[0, :nv]
    scale = np.concatenate([1.0 / np.sqrt(np.diagonal(M)), np.ones(nz + nh)])
    scaled = scale[:, np.newaxis] * matrix * scale
    scaled /= np.max(np.abs(scaled), axis=1, keepdims=True).clip(np.finfo(float).tiny)
    sizes, directions = np.linalg.svd(scaled)[1:]
    if nl > nh or sizes[-1] <= _UNDETERMINED * sizes[0]:
        name = equations.model.v_names[int(np.argmax(np.abs(directions[-1, :nv])))].removeprefix("v.")
        fault = f"the scene starts at static equilibrium, which no force determines along {name}"
        hint = f"a spring at {name}; or initial = model.equilibrium().initial, for a start that is held"
        raise UsageError(Problem("start", fault, hint))
    return Rest(values, matrix, rest_slopes(equations, result))


def rest_slopes(equations: Equations, found: Partials) -> Array:
    """Return the partials of a rest in the parameters, (nv + nz + holonomic, parameters), from the partials of e."""
    size = equations.nv + equations.nz + equations.holonomic
    slopes: Array = -np.linalg.solve(_rest_matrix(equations, found), found.P[0, :size])
    return slopes


def _rest_matrix(equations: Equations, found: Partials) -> NDArray[Any]:
    """Return the partials of forces, rates of z and constraints in q, z and multipliers; without rates of constraints,
    whose multipliers would leave rest to the way there."""
    nh = equations.holonomic
    matrix: NDArray[Any] = np.concatenate([found.Jq[0], found.Jz[0], found.Jlam[0, :, :nh]], axis=1)
    return matrix[: equations.nv + equations.nz + nh]


def moved_positions(
    equations: Equations, asked: InitialState, t: Array, given: Prescribed, dq: Array, dp: Array
) -> Array:
    """Return the changes of positions after steps onto the constraints, given changes dq (nv, n) of requested ones.

    Parameters
    ----------
    dp : (parameters, n)
    """
    nh, factors = equations.holonomic, equations.model.factors
    q, largest = asked.q, 0.0
    for _ in range(_STEPS):
        state = InitialState(q, np.zeros(equations.nv), asked.z)
        values = _values(equations, state, t, given)
        partials = equations.partials(values)
        B = equations.of("constraint_jacobian", values)["B"][0, :nh]
        rows = slice(equations.nv + equations.nz, equations.nv + equations.nz + nh)
        off = equations.of("constraint", values)["Phi"][0, :nh]
        change = B @ dq + partials.P[0, rows] @ dp
        c, dc = _correction(equations, values, partials.Ja[0, : equations.nv], B, (off, change), (dq, dp))
        size = float(np.max(np.abs(c), initial=0.0))
        largest = max(largest, size)
        if size <= _LAST * max(largest, 1.0):
            break
        turns = c * [unit == "rad/s" for unit in equations.model.v_units]
        k = int(np.argmax(np.abs(turns)))
        if (turn := abs(turns[k])) > 1.0:  # steps turn by 1 rad at most
            dc, c = (dc - np.outer(c, dc[k] * np.sign(turns[k])) / turn) / turn, c / turn
        dq = product.transport(factors, -c) @ dq - product.tangent(factors, -c) @ dc
        q = product.update(factors, q, -c)
    return dq


def moved_velocities(
    equations: Equations, state: InitialState, t: Array, given: Prescribed, dq: Array, dv: Array, dp: Array
) -> Array:
    """Return the changes of velocities after the step onto the constraints, given changes dv (nv, n) of requested ones.

    Parameters
    ----------
    state : its positions on the constraints, its velocities as asked for
    """
    nv, nl = equations.nv, equations.nl
    values = _values(equations, state, t, given)
    partials = equations.partials(values)
    rows = slice(nv + equations.nz + equations.holonomic, None)
    B = partials.Jv[0, rows]
    w = equations.of("constraint_velocity", values)["w"][0, :nl]
    change = partials.Jq[0, rows] @ dq + B @ dv + partials.P[0, rows] @ dp
    _, dc = _correction(equations, values, partials.Ja[0, :nv], B, (w, change), (dq, dp))
    moved: Array = dv - dc
    return moved


def _correction(
    equations: Equations,
    values: dict[str, Array],
    M: Array,
    B: Array,
    off: tuple[Array, Array],
    along: tuple[Array, Array],
) -> tuple[Array, Array]:
    """Return c with M c = B^T sigma, B c = off, and its changes; ``off``: with its changes; ``along``: dq, dp."""
    nv, count = len(M), len(B)
    matrix = np.block([[M, -B.T], [B, np.zeros((count, count))]])
    solution = np.linalg.solve(matrix, np.concatenate([np.zeros(nv), off[0]]))
    c, sigma = solution[:nv], solution[nv:]
    still = {**values, "v": np.zeros((1, nv)), "a": np.zeros((1, nv)), "lam": np.zeros((1, equations.nl))}
    pushed = {**still, "a": c[np.newaxis], "lam": np.zeros((1, equations.nl))}
    pushed["lam"][0, :count] = -sigma
    forces = _difference(equations.partials(pushed), equations.partials(still), along)[:nv]
    moving = {**still, "v": c[np.newaxis]}
    first = nv + equations.nz + equations.holonomic
    rates = _difference(equations.partials(moving), equations.partials(still), along)[first : first + count]
    right = np.concatenate([-forces, off[1] - rates])
    changes = np.linalg.solve(matrix, right)
    return c, changes[:nv]


def _difference(one: Partials, other: Partials, along: tuple[Array, Array]) -> Array:
    """Return changes of e at one state minus changes at another, along dq and dp."""
    result: Array = (one.Jq[0] - other.Jq[0]) @ along[0] + (one.P[0] - other.P[0]) @ along[1]
    return result


def _values(
    equations: Equations, state: InitialState, t: Array, given: Prescribed, du: Array | None = None
) -> dict[str, Array]:
    a, lam = np.zeros((1, equations.nv)), np.zeros((1, equations.nl))
    return equations.values(States(t, state.q[np.newaxis], state.v[np.newaxis], a, lam, state.z[np.newaxis]), given, du)
