"""Internal states in runs: exact solutions, orders in q, v and z for every method, stiff states, constraints and long
trees."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import eomgen
from eomgen.integrators.families.register import method_named
from tests.oracles.stepper import integrate
from tests.oracles.system_equations import equations_of

ALPHA, RK4 = "generalized_alpha", "rk4"
#: What the steppers of scenes without constraints call.
STEPPED = ("forward_dynamics", "equations", "iteration", "internal_rate")


def orders(errors: list[np.ndarray]) -> np.ndarray:
    """Return the slopes between the last two of errors at halved steps."""
    return np.log2(errors[-2] / errors[-1])


# -- a position servo on R: PI controller, motor with a first-order lag ------------------------------------------------


def servo() -> eomgen.Scene:
    builder = eomgen.SceneBuilder("pi_motor", gravity=[0, 0, 0], terms=[*STEPPED, "outputs", "energy"])
    builder.parameter("lag", 0.02, unit="s", tunable=True).parameter("integral_gain", 40.0, tunable=True)
    builder.body("arm", 1.0, inertia=[1, 1, 1]).joint(
        "pin", "revolute", "base", "arm", axis=[0, 0, 1], damping=0.5, initial={"position": 0.3}
    )
    builder.state("integral", "1 - q.pin", unit="rad s")
    builder.state(
        "torque", "(60 * (1 - q.pin) + integral_gain * integral - 10 * v.pin - torque) / lag", initial=0.2, unit="N m"
    )
    return builder.effort("motor", "pin", "torque").output("error", formula="1 - q.pin - 0 * torque").build()


def servo_at(t: float, lag: float = 0.02, gain: float = 40.0) -> np.ndarray:
    """Return (q, v, integral, torque) of the linear system from q = 0.3, torque = 0.2."""
    A = np.array(
        [
            [0, 1, 0, 0, 0],
            [0, -0.5, 0, 1, 0],
            [-1, 0, 0, 0, 1],
            [-60 / lag, -10 / lag, gain / lag, -1 / lag, 60 / lag],
            [0] * 5,
        ]
    )
    return (expm(A * t) @ [0.3, 0.0, 0.0, 0.2, 1.0])[:4]


@pytest.fixture(scope="module")
def motor() -> eomgen.Model:
    return eomgen.build(servo())


def servo_end(solution: eomgen.Solution) -> np.ndarray:
    assert solution.success, solution.message
    return np.concatenate([solution.q[-1], solution.v[-1], solution.z[-1]])


@pytest.mark.parametrize(
    ("method", "rho_inf", "steps", "order", "tolerance"),
    [
        (ALPHA, 0.8, (500, 1000, 2000), 2.0, 0.1),
        (ALPHA, 0.0, (500, 1000, 2000), 2.0, 0.1),
        (RK4, None, (125, 250, 500), 4.0, 0.2),
    ],
)
def test_the_servo_is_that_of_linear_theory(
    motor: eomgen.Model, method: str, rho_inf: float | None, steps: tuple[int, ...], order: float, tolerance: float
) -> None:
    errors = [
        np.abs(servo_end(motor.simulate(0.5, 0.5 / count, method=method, rho_inf=rho_inf)) - servo_at(0.5))
        for count in steps
    ]
    assert np.all(np.abs(orders(errors) - order) <= tolerance), orders(errors)
    assert np.all(errors[-1] <= (1e-4 if order == 2.0 else 1e-9))


@pytest.mark.slow
def test_a_linear_step_takes_two_iterations_and_one_factorization(motor: eomgen.Model) -> None:
    stats = motor.simulate(0.5, 1e-3).stats
    assert stats["newton_iterations"] <= 2 * stats["steps"] and stats["factorizations"] == 1


@pytest.mark.parametrize("rho_inf", [0.0, 0.5, 0.8])
def test_states_much_faster_than_the_step_do_no_harm(motor: eomgen.Model, rho_inf: float) -> None:
    """A lag of 1e-6 s in steps of 1e-3 s: the torque starts 42 N m off, alternates, and dies as rho_inf**n."""
    run = motor.simulate(1.0, 1e-3, rho_inf=rho_inf, parameters={"lag": 1e-6})
    assert run.success and run.stats["halvings"] == 0
    off = np.abs(run.z[:, 1] - (60 * (1 - run.q[:, 0]) + 40 * run.z[:, 0] - 10 * run.v[:, 0]))
    n = np.arange(len(off) - 1)
    assert np.all(off[1:] <= 110.0 * max(rho_inf, 0.05) ** n * (1 + n) + 1e-2)
    exact = servo_at(1.0, lag=1e-6)
    assert np.allclose(servo_end(run), exact, atol=5e-2 if rho_inf else 2e-2)


@pytest.mark.slow
def test_trapezoidal_rule_is_that_of_states_too(motor: eomgen.Model) -> None:
    step, lag = 1e-3, 0.02
    A = np.array([[0, 1, 0, 0], [0, -0.5, 0, 1], [-1, 0, 0, 0], [-60 / lag, -10 / lag, 40 / lag, -1 / lag]])
    b = np.array([0, 0, 1, 60 / lag])
    x = np.array([0.3, 0.0, 0.0, 0.2])
    for _ in range(100):
        x = np.linalg.solve(np.eye(4) - 0.5 * step * A, (np.eye(4) + 0.5 * step * A) @ x + step * b)
    assert np.allclose(servo_end(motor.simulate(0.1, step, method="trapezoidal")), x, rtol=0, atol=1e-9)


def test_the_right_hand_side_for_other_solvers_has_states(motor: eomgen.Model) -> None:
    start = np.concatenate([motor.initial_q, motor.initial_v, motor.initial_z])
    run = solve_ivp(motor.rhs, (0.0, 0.5), start, method="DOP853", rtol=1e-11, atol=1e-12)
    assert np.allclose(run.y[:, -1], servo_at(0.5), atol=1e-9)
    assert motor.rhs(0.0, np.tile(start, (3, 1))).shape == (3, 4)


def test_initial_states_by_name_and_array(motor: eomgen.Model) -> None:
    for initial in (
        {"z": [0.1, -1.0]},
        {"z": {"integral": 0.1, "torque": -1.0}},
        {"integral": 0.1, "torque": -1.0, "pin": 0.3},
    ):
        assert np.array_equal(motor.simulate(0.0, initial=initial).z[0], [0.1, -1.0])
    for initial, text in (
        ({"z": [0.1]}, r"initial z: the shape is \(1,\), \(2,\) is needed"),
        ({"z": {"torq": 0.1}}, "there is no state 'torq'; try: torque"),
        ({"torq": 0.1}, "there is no joint or state 'torq'; try: torque"),
        ({"torque": float("nan")}, r"initial z: z.torque is nan, not a finite number"),
    ):
        with pytest.raises(eomgen.UsageError, match=text):
            motor.simulate(0.0, initial=initial)


def test_calls_take_z_and_broadcast(motor: eomgen.Model) -> None:
    z = np.array([[0.0, 0.2], [0.1, 1.0], [0.2, 2.0]])
    assert motor.states == ("integral", "torque") and motor.nz == 2 and motor.z_names == ["z.integral", "z.torque"]
    assert np.allclose(motor.forward_dynamics([0.3], [0.0])[..., 0], 0.2)
    assert np.allclose(motor.forward_dynamics([0.3], [0.0], z=z)[:, 0], z[:, 1])
    assert np.allclose(motor.forward_dynamics([0.3], [0.0], z={"torque": 7.0})[..., 0], 7.0)
    assert np.allclose(motor.internal_rates([[0.3]], [0.0], z)[:, 0], 0.7)
    assert motor.internal_rates(np.zeros((4, 1, 1)), [0.0], z).shape == (4, 3, 2)
    with pytest.raises(eomgen.UsageError, match=r"z: the shape is \(3,\), \(..., 2\) is needed"):
        motor.forward_dynamics([0.3], [0.0], z=[0.0, 1.0, 2.0])


# -- constraints -------------------------------------------------------------------------------------------------------


def crank(coordinates: str) -> eomgen.Scene:
    """Return a pendulum whose pin is a constraint in absolute coordinates, driven by a lagging torque that feels the
    angle."""
    builder = eomgen.SceneBuilder(f"lagging_pendulum_{coordinates}", coordinates=coordinates)
    builder.body("bob", 1.0, center_of_mass=[0, 0, -0.4], inertia=[0.02, 0.02, 0.01])
    builder.joint("pin", "revolute", "base", "bob", axis=[0, 1, 0], initial={"position": 0.4}).point(
        "end", "bob", [0, 0, -0.4]
    )
    builder.state("torque", "(3 * sin(2 * t) - 2 * q.pin - torque) / 0.08").state(
        "seen", "(position.end[0] - seen) / 0.05"
    )
    return builder.effort("drive", "pin", "torque - 0.3 * v.pin - seen").build()


@cache
def crank_at(t: float) -> np.ndarray:
    """Return (angle, rate, torque, seen)."""

    def rates(time: float, y: np.ndarray) -> list[float]:
        angle, rate, torque, seen = y
        x = -0.4 * np.sin(angle)
        moment = torque - 0.3 * rate - seen - 9.81 * 0.4 * np.sin(angle)
        return [rate, moment / (0.02 + 0.16), (3 * np.sin(2 * time) - 2 * angle - torque) / 0.08, (x - seen) / 0.05]

    return solve_ivp(rates, (0.0, t), [0.4, 0, 0, 0], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


@pytest.fixture(scope="module")
def pinned() -> eomgen.Model:
    return eomgen.build(crank("absolute"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "steps", "order", "tolerance"),
    [(ALPHA, (200, 400), 2.0, 0.1), ("rk4_partitioned", (100, 200), 4.0, 0.2), ("rattlie", (200, 400), 2.0, 0.1)],
)
def test_orders_with_constraints(
    pinned: eomgen.Model, method: str, steps: tuple[int, ...], order: float, tolerance: float
) -> None:
    exact, errors = crank_at(0.6), []
    for count in steps:
        run = pinned.simulate(0.6, 0.6 / count, method=method)
        assert run.success, run.message
        angle = 2.0 * np.arctan2(run.q[-1, 2], run.q[-1, 0])
        errors.append(np.abs(np.array([angle, run.v[-1, 1], *run.z[-1]]) - exact))
    assert np.all(np.abs(orders(errors) - order) <= tolerance), orders(errors)


@pytest.mark.slow
def test_a_pin_in_joint_coordinates_moves_the_same() -> None:
    run = eomgen.build(crank("joint")).simulate(0.8, 1e-3, method=RK4)
    assert np.allclose([run.q[-1, 0], run.v[-1, 0], *run.z[-1]], crank_at(0.8), atol=1e-9)


@pytest.mark.slow
def test_constrained_compiled_steps_are_those_of_the_slow_stepper(pinned: eomgen.Model) -> None:
    system = eomgen.derive(crank("absolute"))
    start = np.array(system.initial_q), np.array(system.initial_v)
    expected = integrate(equations_of(system), method_named(ALPHA), *start, 0.01, 5, z=np.array(system.initial_z))
    run = pinned.simulate(0.05, 0.01)
    for found, wanted in ((run.q, expected.q), (run.v, expected.v), (run.z, expected.z)):
        assert np.max(np.abs(found - wanted)) <= 1e-9


# -- long trees --------------------------------------------------------------------------------------------------------
