"""The NumPy steppers have their order on every group, against closed forms, a published state and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from eomgen.errors import NumericalError
from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.integrators.families.runge_kutta import RUNGE_KUTTA_MUNTHE_KAAS_4
from eomgen.lie.product import Factor
from tests.integrators.stepper_models import formula_inputs, heavy_top, rotation, skew, tied_body
from tests.oracles.stepper import Equations, initial_algorithmic_rates, integrate

METHODS = [GeneralizedAlpha(0.9), GeneralizedAlpha(0.0), GeneralizedAlpha(1.0), RUNGE_KUTTA_MUNTHE_KAAS_4]
SPATIAL = GeneralizedAlpha(0.9, variant="spatial")


def label(method):
    if not isinstance(method, GeneralizedAlpha):
        return "rkmk4"
    return "spatial" if method.variant == "spatial" else f"alpha-{method.rho_inf}"


def slope(steps, errors):
    return -np.polyfit(np.log(steps), np.log(errors), 1)[0]


def solution(rates, duration, start):
    """Return the end of an independent integration, rotations as matrices."""
    return solve_ivp(rates, (0.0, duration), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


def check_order(equations, method, q, v, duration, exact, counts):
    """``exact`` maps (q, v) at the end to an error."""
    errors = []
    for count in counts:
        end = integrate(equations, method, q, v, duration / count, count)
        errors.append(exact(end.q[-1], end.v[-1]))
    tolerance = 0.1 if method.order == 2 else 0.2
    assert slope(counts, errors) == pytest.approx(method.order, abs=tolerance), errors


@pytest.mark.slow_except("rkmk4")
@pytest.mark.parametrize("method", METHODS, ids=label)
def test_order_on_the_oscillator(method):
    frequency = 3.0
    equations = Equations(
        [Factor("R", "x", 0, 1, 0, 1)],
        lambda t, q, v: -(frequency**2) * q,
        lambda t, q, v, a: a + frequency**2 * q,
        lambda t, q, v, a: (frequency**2 * np.eye(1), np.zeros((1, 1)), np.eye(1)),
    )

    def error(q, v):
        return abs(q[0] - np.cos(frequency)) + abs(v[0] + frequency * np.sin(frequency)) / frequency

    check_order(equations, method, np.array([1.0]), np.array([0.0]), 1.0, error, [40, 80, 160])


def free_body():
    J = np.diag([1.0, 2.0, 3.0])

    def residual(t, q, v, a):
        return J @ a + np.cross(v, J @ v)

    return Equations(
        [Factor("SO3", "body", 0, 4, 0, 3)],
        lambda t, q, v: np.linalg.solve(J, -np.cross(v, J @ v)),
        residual,
        lambda t, q, v, a: (np.zeros((3, 3)), skew(v) @ J - skew(J @ v), J),
    )


@pytest.mark.long_except_every(4)
@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS, ids=label)
def test_order_on_a_fast_free_body(method):
    # momentum in space is known exactly; the attitude through SciPy, on components of the rotation matrix
    equations, omega = free_body(), np.array([20.0, 35.0, -15.0])
    J, duration = np.diag([1.0, 2.0, 3.0]), 0.2

    def rates(t, y):
        return np.concatenate([(y[:9].reshape(3, 3) @ skew(y[9:])).ravel(), equations.forward_dynamics(t, None, y[9:])])

    end = solution(rates, duration, np.concatenate([np.eye(3).ravel(), omega]))

    def error(q, v):
        R = rotation(q)
        return np.linalg.norm(R - end[:9].reshape(3, 3)) + np.linalg.norm(R @ J @ v - J @ omega) / 100.0

    counts = [80, 160, 320] if method.order == 4 else [400, 800]
    check_order(equations, method, np.array([1.0, 0, 0, 0]), omega, duration, error, counts)


@pytest.mark.long
def test_spatial_momentum_of_a_free_body_by_the_spatial_variant():
    # attitude and rates of a body that tumbles have a large third-order term besides: the plain variant is better there
    omega, J, errors = np.array([20.0, 35.0, -15.0]), np.diag([1.0, 2.0, 3.0]), []
    for count in (400, 800):
        end = integrate(free_body(), SPATIAL, np.array([1.0, 0, 0, 0]), omega, 0.2 / count, count)
        errors.append(np.linalg.norm(rotation(end.q[-1]) @ J @ end.v[-1] - J @ omega))
    assert slope([400, 800], errors) == pytest.approx(2.0, abs=0.2)


@pytest.mark.long_except_every(3)
@pytest.mark.slow
@pytest.mark.parametrize("method", [METHODS[0], METHODS[3], SPATIAL], ids=label)
def test_order_on_the_fast_heavy_top(method):
    model = heavy_top()

    def rates(t, y):
        x, omega = y[:9].reshape(3, 3), y[9:]
        gravity = np.cross([0.0, 1.0, 0.0], x.T @ [0.0, 0.0, -9.81 * 15.0])
        J = np.array([15.234375, 0.46875, 15.234375])
        return np.concatenate([(x @ skew(omega)).ravel(), (gravity - np.cross(omega, J * omega)) / J])

    end = solution(rates, 0.1, np.concatenate([np.eye(3).ravel(), model.v]))

    def error(q, v):
        return np.linalg.norm(rotation(q) - end[:9].reshape(3, 3)) + np.linalg.norm(v - end[9:]) / 150.0

    check_order(
        model.equations, method, model.q, model.v, 0.1, error, [100, 200, 400] if method.order == 4 else [200, 400]
    )


@pytest.mark.slow
@pytest.mark.long_cases("alpha-0.0", "alpha-0.9", "alpha-1.0", "rkmk4", "spatial")
@pytest.mark.parametrize("method", [*METHODS, SPATIAL], ids=label)
def test_order_on_a_body_on_se3_with_a_slider(method):
    model = tied_body()

    def rates(t, y):
        R, x, s = y[:9].reshape(3, 3), y[9:12], y[12]
        v = y[13:]
        J, k, u = np.array([1.0, 2.0, 3.0]), 40.0, formula_inputs(t)
        force = -k * (x - np.array([s, 0, 0]))
        omega_dot = -np.cross(v[:3], J * v[:3]) / J
        U_dot = R.T @ force / 2.0 - np.cross(v[:3], v[3:6])
        s_ddot = (k * (x[0] - s) - 0.3 * v[6] + u[0] + 0.25 * u[1]) / 0.5
        return np.concatenate([(R @ skew(v[:3])).ravel(), R @ v[3:6], [v[6]], omega_dot, U_dot, [s_ddot]])

    start = np.concatenate([rotation(model.q[:4]).ravel(), model.q[4:], model.v])
    end = solution(rates, 0.5, start)

    def error(q, v):
        return np.linalg.norm(np.concatenate([rotation(q[:4]).ravel(), q[4:], v]) - end)

    check_order(
        model.equations, method, model.q, model.v, 0.5, error, [50, 100, 200] if method.order == 4 else [100, 200, 400]
    )


@pytest.mark.long_except_every(2)
@pytest.mark.slow
@pytest.mark.parametrize("method", [METHODS[0], METHODS[3], SPATIAL], ids=label)
def test_order_on_a_body_on_r3xso3(method):
    # a body held by a spring at the point X of it; v = (omega in body axes, x_dot in space)
    J, mass, X, k = np.diag([1.0, 2.0, 3.0]), 2.0, np.array([0.3, -0.2, 0.5]), 40.0

    def acceleration(R, x, v):
        force = -k * (x + R @ X)
        return np.concatenate([np.linalg.solve(J, np.cross(X, R.T @ force) - np.cross(v[:3], J @ v[:3])), force / mass])

    def forward_dynamics(t, q, v):
        return acceleration(rotation(q[:4]), q[4:], v)

    M = np.block([[J, np.zeros((3, 3))], [np.zeros((3, 3)), mass * np.eye(3)]])

    def partials(t, q, v, a):
        R = rotation(q[:4])
        f = R.T @ (-k * (q[4:] + R @ X))
        K = np.block(
            [[-skew(X) @ skew(f) - k * skew(X) @ skew(X), k * skew(X) @ R.T], [-k * R @ skew(X), k * np.eye(3)]]
        )
        C = np.zeros((6, 6))
        C[:3, :3] = skew(v[:3]) @ J - skew(J @ v[:3])
        return K, C, M

    equations = Equations(
        [Factor("R3xSO3", "body", 0, 7, 0, 6)],
        forward_dynamics,
        lambda t, q, v, a: M @ (a - forward_dynamics(t, q, v)),
        partials,
    )

    def rates(t, y):
        R, x, v = y[:9].reshape(3, 3), y[9:12], y[12:]
        return np.concatenate([(R @ skew(v[:3])).ravel(), v[3:], acceleration(R, x, v)])

    q, v = np.array([0.5, -0.5, 0.5, 0.5, 0.1, 0.2, -0.3]), np.array([2.0, -3.0, 1.0, 0.5, -0.2, 0.3])
    end = solution(rates, 0.5, np.concatenate([rotation(q[:4]).ravel(), q[4:], v]))

    def error(q, v):
        return np.linalg.norm(np.concatenate([rotation(q[:4]).ravel(), q[4:], v]) - end)

    check_order(equations, method, q, v, 0.5, error, [50, 100, 200])
    steps = 50
    if method.order == 2:  # exact partials: Newton converges quadratically, in three iterations or fewer
        assert integrate(equations, method, q, v, 0.5 / steps, steps).iterations <= 3 * steps


def test_algorithmic_acceleration_starts_with_the_right_derivative():
    # x'' = -4 x + cos 5t, so x''' = -4 v - 5 sin 5t
    method = GeneralizedAlpha(0.5)
    equations = Equations([Factor("R", "x", 0, 1, 0, 1)], lambda t, q, v: -4.0 * q + np.cos(5.0 * t))
    q, v, t = np.array([0.7]), np.array([-1.3]), 0.4
    errors = []
    for step in (1e-2, 5e-3):
        a = initial_algorithmic_rates(equations, method, t, q, v, step)[0]
        vddot = (a - equations.forward_dynamics(t, q, v)) / (float(method.alpha_m - method.alpha_f) * step)
        errors.append(abs(vddot[0] - (-4.0 * v[0] - 5.0 * np.sin(5.0 * t))))
    assert errors[0] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_times_are_multiples_of_the_step():
    model = heavy_top((0.0, 1.0, 0.0))
    times = integrate(model.equations, RUNGE_KUTTA_MUNTHE_KAAS_4, model.q, model.v, 0.1, 30, t=2.0).t
    assert np.array_equal(times, 2.0 + 0.1 * np.arange(31))


def test_a_step_that_does_not_converge_is_an_error():
    equations = Equations(
        [Factor("R", "x", 0, 1, 0, 1)],
        lambda t, q, v: np.zeros(1),
        lambda t, q, v, a: np.array([1.0 + q[0] ** 2]),
        lambda t, q, v, a: (np.array([[2.0 * q[0] + 0.1]]), np.zeros((1, 1)), np.zeros((1, 1))),
    )
    with pytest.raises(NumericalError, match=r"t = 0\.1: Newton's iteration did not converge; try: a smaller step"):
        integrate(equations, GeneralizedAlpha(0.9), np.array([0.3]), np.array([0.0]), 0.1, 3)
