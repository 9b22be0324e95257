"""The rattleback against Newton's and Euler's equations of the stone about its centre of mass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.scene.load import load_toml
from tests.oracles.constrained import kkt
from tests.oracles.evaluation import Array, tape_evaluator

SCENE = Path(eomgen.__file__).parents[1] / "examples" / "rattleback" / "scene.toml"
SOLVED = ["constraint", "constraint_velocity", "constraint_jacobian", "constraint_bias", "constraint_size", "mass"]
SOLVED += ["residual", "energy"]
#: Kane and Levinson, Int. J. Non-Linear Mechanics 17 (1982) 175, in m and kg m^2.
INERTIA = np.array([[2e-4, -2e-5, 0], [-2e-5, 16e-4, 0], [0, 0, 17e-4]])
SQUARES, CENTER = np.array([0.2, 0.03, 0.02]) ** 2, np.array([0.0, 0.0, -0.01])


def _arm(up: Array, omega: Array) -> tuple[Array, Array]:
    """Return the contact from the centre of mass and the rate of this vector, both in body axes."""
    change = -np.cross(omega, up)
    reach = np.sqrt(up @ (SQUARES * up))
    rate = -SQUARES * change / reach + SQUARES * up * (up @ (SQUARES * change)) / reach**3
    return -SQUARES * up / reach - CENTER, rate


def _spin_up(up: Array, omega: Array, drag: float = 0.0) -> Array:
    """Return the angular acceleration of a stone that rolls, by Newton and Euler about the centre of mass."""
    r, rate = _arm(up, omega)
    # force = a + g up with a = -w' x r - w x r' - w x (w x r); I w' + w x I w = r x force - drag w
    known = -np.cross(omega, rate) - np.cross(omega, np.cross(omega, r)) + 9.81 * up
    matrix = INERTIA + (r @ r) * np.eye(3) - np.outer(r, r)
    return np.linalg.solve(matrix, np.cross(r, known) - np.cross(omega, INERTIA @ omega) - drag * omega)


def _velocity(up: Array, omega: Array) -> Array:
    """Return the twist of the stone's frame, whose origin is the centre of the ellipsoid."""
    r, _ = _arm(up, omega)
    return np.array([*omega, *(-np.cross(omega, r + CENTER))])


def _up(q: Array) -> Array:
    """Return the vertical in body axes."""
    w, x, y, z = q[:4]
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])


def test_angular_acceleration_in_any_pose(rng: np.random.Generator) -> None:
    scene = load_toml(SCENE.read_text(encoding="utf-8"))
    q = np.array([1.0, 0.2, -0.1, 0.3])
    q /= np.linalg.norm(q)
    up, omega = _up(q), rng.uniform(-3, 3, 3)
    height = np.sqrt(up @ (SQUARES * up))
    evaluate = tape_evaluator(derive(scene, SOLVED))
    position = np.atleast_2d(np.array([*q, 0.3, -0.2, height]))
    state = {"q": position, "v": np.atleast_2d(_velocity(up, omega)), "t": np.zeros((1, 1)), "p": np.zeros((1, 1))}
    solved = kkt(evaluate, state)
    assert np.abs(evaluate("constraint_velocity", solved)["w"]).max() <= 1e-15
    assert np.abs(evaluate("constraint", solved)["Phi"]).max() <= 1e-15
    assert solved["a"][0, :3] == pytest.approx(_spin_up(up, omega), rel=1e-10)


@pytest.mark.slow
def test_a_stone_turns_back_one_way_only() -> None:
    """Spun one way the stone rattles and turns back, as published; spun the other way it goes on; energy stays."""
    model = eomgen.build(SCENE, profile="quick")
    run = model.simulate()
    assert not any("corrected" in note for note in model.notes if "velocity" in note)
    forward = _velocity(_up(run.q[0]), np.array([0.0, 0.0, 5.0]))
    other = model.simulate(initial={"q": run.q[0], "v": forward})
    turned = run.t[np.argmax(run["spin"] > 1.0)]
    assert run["spin"][0] == pytest.approx(-5.0, abs=1e-6) and 2.0 < turned < 5.0
    assert run["spin"][run.t > 5.0].min() > 3.0 and other["spin"].min() > 1.0
    for each in (run, other):
        energy = each.energy["kinetic"] + each.energy["potential"]
        assert np.ptp(energy) <= 1e-4 * np.abs(energy).max()
        assert np.cos(each["tilt"]) == pytest.approx([_up(q)[2] for q in each.q], abs=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("drag", [0.0, 1e-4])
def test_the_motion_is_the_motion_by_newton_and_euler(drag: float) -> None:
    run = eomgen.build(SCENE, profile="quick").simulate(3.0, 2e-4, parameters={"drag": drag})
    own = solve_ivp(
        lambda _, s: np.concatenate([-np.cross(s[3:], s[:3]), _spin_up(s[:3], s[3:], drag)]),
        (0.0, 3.0),
        np.concatenate([_up(run.q[0]), run.v[0, :3]]),
        method="DOP853",
        rtol=1e-12,
        atol=1e-14,
        t_eval=run.t,
    )
    np.testing.assert_allclose(run.v[:, :3], own.y[3:].T, atol=2e-4)
    np.testing.assert_allclose([_up(q) for q in run.q], own.y[:3].T, atol=2e-5)
