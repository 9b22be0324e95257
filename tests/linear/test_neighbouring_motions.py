"""Linear models about moving references against differences of motions: groups, constraints, internal states, a moving
base."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.compiled.coordinates import with_unit_quaternions
from eomgen.lie.product import difference, update
from eomgen.products.linear.linearization import Linearization
from tests.mechanics.test_linearization import drone

Array = np.ndarray


def disc() -> eomgen.Scene:
    """Return a disc that rolls on the ground: three velocities are free, five coordinates."""
    builder = eomgen.SceneBuilder("disc")
    builder.body("disc", 2.0, inertia=[0.02, 0.02, 0.04])
    upright = {"orientation": [math.cos(0.6), math.sin(0.6), 0, 0], "position": [0, 0, 0.2 * math.sin(1.2)]}
    builder.joint("flight", "free", "base", "disc", initial=upright)
    builder.constraint(
        "rolling", "rolling", {"body": "base", "axis": [0, 0, 1]}, {"body": "disc", "axis": [0, 0, 1]}, radius=0.2
    )
    return builder.build()


def flow(model: eomgen.Model, start: Array, times: Array) -> Array:
    """Return states [q, v, z] at times, integrated to near machine precision."""

    def rate(t: float, y: Array) -> Array:
        return model.rhs(t, y)

    found = solve_ivp(rate, (0.0, times[-1]), start, method="DOP853", rtol=1e-13, atol=1e-13, t_eval=times)
    assert found.success
    return found.y.T


def neighbour(model: eomgen.Model, lin: Linearization, start: Array, change: Array) -> Array:
    """Return the state near ``start`` with a change of x, y, z, brought onto the constraints in the dependent
    components."""
    nq, nv = model.nq, model.nv
    nx, ny = len(lin.free.coordinates), len(lin.free.velocities)
    x, y, z = change[:nx], change[nx : nx + ny], change[nx + ny :]
    eta = lin.free.R @ x
    v = start[nq : nq + nv] + lin.free.S @ y + lin.free.T @ x
    dependent = [k for k in range(nv) if k not in lin.free.coordinates]
    held = [k for k in range(nv) if k not in lin.free.velocities]
    for _ in range(8 if model.multipliers else 0):
        q = update(model.factors, start[:nq], eta)
        phi = model.evaluate("constraint", q)["Phi"]
        eta[dependent] -= np.linalg.solve(model.evaluate("constraint_jacobian", q)["B"][: len(phi), dependent], phi)
    q = update(model.factors, start[:nq], eta)
    for _ in range(2 if model.multipliers else 0):
        w, B = model.evaluate("constraint_velocity", q, v)["w"], model.evaluate("constraint_jacobian", q)["B"]
        v[held] -= np.linalg.solve(B[:, held], w)
    return np.concatenate([q, v, start[nq + nv :] + z])


def apart(model: eomgen.Model, lin: Linearization, first: Array, second: Array) -> Array:
    """Return x, y, z of what leads from one state to another."""
    nq, nv = model.nq, model.nv
    before, after = (with_unit_quaternions(model.factors, state[:nq]) for state in (first, second))
    eta = difference(model.factors, before, after)
    change = second[nq:] - first[nq:]
    return np.concatenate([eta[list(lin.free.coordinates)], change[:nv][list(lin.free.velocities)], change[nv:]])


def at(model: eomgen.Model, row: Array, t: float, independent: tuple[str, ...]) -> Linearization:
    q, v, z = np.split(row, [model.nq, model.nq + model.nv])
    return model.linearize(with_unit_quaternions(model.factors, q), v, t=t, z=z, independent=independent)


def start_of(model: eomgen.Model, rng: np.random.Generator) -> Array:
    v = rng.uniform(-1.5, 1.5, model.nv)
    q = update(model.factors, model.initial_q, rng.uniform(-0.5, 0.5, model.nv))
    if model.multipliers:
        consistent = model.consistent(q, v)
        q, v = consistent.q, consistent.v
    return np.concatenate([q, v, rng.uniform(0.5, 1.0, model.nz)])


SCENES: dict[str, Callable[[], eomgen.Scene]] = {
    "drone on a cord": lambda: drone(looped=True),
    "rolling disc": disc,
}


@pytest.mark.slow
@pytest.mark.long_cases("drone on a cord")
@pytest.mark.parametrize("name", ["drone on a cord", "rolling disc"])
def test_neighbouring_motions(name: str, rng: np.random.Generator) -> None:
    model = eomgen.build(SCENES[name](), profile="instant")
    start = start_of(model, rng)
    first = at(model, start, 0.0, ())
    independent = first.coordinates
    size = len(first.state_space().A)
    times = np.linspace(0.0, 0.04, 3)
    reference = flow(model, start, times)

    # the transition matrix of the linear model, by RK4 along the reference
    grid = np.linspace(0.0, times[-1], 41)
    rows = flow(model, start, grid)
    matrices = []
    for t, row in zip(grid, rows, strict=True):
        linear = at(model, row, float(t), independent)
        assert linear.free.coordinates == first.free.coordinates
        assert linear.free.velocities == first.free.velocities
        matrices.append(linear.state_space().A)
    transition, step = np.eye(size), grid[2]
    for k in range(0, 40, 2):
        k1 = matrices[k] @ transition
        k2 = matrices[k + 1] @ (transition + 0.5 * step * k1)
        k3 = matrices[k + 1] @ (transition + 0.5 * step * k2)
        k4 = matrices[k + 2] @ (transition + step * k3)
        transition = transition + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)

    found = np.empty((size, size))
    for direction in range(size):
        ends = []
        for sign in (1.0, -1.0):
            moved = neighbour(model, first, start, sign * 1e-5 * np.eye(size)[direction])
            ends.append(apart(model, first, reference[-1], flow(model, moved, times)[-1]))
        found[:, direction] = (ends[0] - ends[1]) / 2e-5
    scale = np.max(np.abs(found), axis=0)
    assert np.max(np.abs(found - transition) / scale) <= 1e-6
    assert np.max(np.abs(found - np.eye(size))) > 1e-2


def driven_arm() -> eomgen.Scene:
    """Return two links whose first is turned by a driver, with an input at the elbow; outputs of power and of
    acceleration."""
    builder = eomgen.SceneBuilder("arm").input("push").input("gust", "0.2 * cos(t)")
    for name, parent, place in (("upper", "base", [0, 0, 0]), ("lower", "upper", [0, 0, -0.5])):
        builder.body(name, 1.5, center_of_mass=[0.02, 0, -0.3], inertia=[0.03, 0.03, 0.01])
        builder.joint(f"to_{name}", "revolute", parent, name, axis=[0, 1, 0], position=place)
    builder.effort("push", "to_lower", "push * cos(q.to_lower) + gust")
    builder.point("tip", "lower", [0, 0, -0.5])
    frame = {"axis": [0, 1, 0], "x_axis": [1, 0, 0]}
    first, second = {"body": "base", **frame}, {"body": "upper", **frame}
    builder.constraint("drive", "revolute", first, second, drive="0.4 * sin(2 * t) + 0.3 * t")
    builder.output("power", formula="energy.base_power + 0.3 * energy.kinetic")
    return builder.output("felt", formula=["acceleration.tip[0]", "acceleration.tip[2]"]).build()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drone on a cord", "driven arm"])
def test_outputs_of_neighbouring_states(name: str, rng: np.random.Generator) -> None:
    """Accelerations and multipliers in outputs are those of the dynamics, in each state and for each input."""
    described = driven_arm() if name == "driven arm" else SCENES[name]()
    model = eomgen.build(described, profile="instant")
    start = start_of(model, rng)
    lin = at(model, start, 0.0, ())
    space = lin.state_space()

    def outputs(state: Array, u: Array) -> Array:
        q, v, z = np.split(state, [model.nq, model.nq + model.nv])
        values = model.outputs(with_unit_quaternions(model.factors, q), v, z=z, u=u)
        return np.concatenate([np.atleast_1d(values[name]) for name in values])

    size, h = len(space.A), 1e-5
    u = lin.reference.u
    by_state = [
        (outputs(neighbour(model, lin, start, h * d), u) - outputs(neighbour(model, lin, start, -h * d), u)) / (2.0 * h)
        for d in np.eye(size)
    ]
    np.testing.assert_allclose(space.C, np.transpose(by_state), rtol=0, atol=3e-7 * np.max(np.abs(by_state)))
    by_input = np.transpose(
        [(outputs(start, u + h * d) - outputs(start, u - h * d)) / (2.0 * h) for d in np.eye(model.nu)]
    )
    driven = [model.inputs.index(name) for name in space.inputs]
    given = [model.inputs.index(name) for name in space.disturbances if name in model.inputs]
    np.testing.assert_allclose(space.D, by_input[:, driven], rtol=0, atol=1e-7 * np.max(np.abs(by_input)))
    np.testing.assert_allclose(
        space.F[:, : len(given)], by_input[:, given], rtol=0, atol=1e-7 * np.max(np.abs(by_input))
    )
    assert np.max(np.abs(by_input)) > 0.1
    if name == "driven arm":
        assert np.max(np.abs(lin.partials.Ylam)) > 0.1
