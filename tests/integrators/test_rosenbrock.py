"""Rosenbrock steps of one factorization: orders on every group, closed forms of oscillators, digits of a benchmark,
starts, jumps, singular masses, and the same operations in every step."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from tests.integrators.test_taylor import error, model, reference
from tests.models.cache import shared_cache
from tests.models.shear_frame import RESPONSE, SCALE, shear_frame

__all__ = ["shared_cache"]

Array = NDArray[np.float64]
METHODS = ("rosenbrock", "lsrt2")
GAMMA = {"rosenbrock": 0.5, "lsrt2": 1.0 - np.sqrt(0.5)}


def slopes(errors: list[float]) -> Array:
    return np.asarray(np.log2(np.array(errors[:-1]) / errors[1:]))


@cache
def frame(**parameters: float) -> eomgen.Model:
    return eomgen.build(shear_frame(**parameters))


def error_of_frame(method: str, step: float) -> float:
    end = frame().simulate(10.0, step, method=method, record_every=100_000, error_estimate=False)
    return float(np.abs((np.concatenate([end.q[-1], end.v[-1]]) - RESPONSE) / SCALE).max())


#: Errors of the same formulas in a prototype, which was written apart from this code; two digits.
PROTOTYPE = {
    "rosenbrock": (5.6e-2, 1.8e-2, 4.6e-3, 1.1e-3, 2.9e-4),
    "lsrt2": (3.3e-2, 8.5e-3, 2.2e-3, 5.5e-4, 1.4e-4),
}


@pytest.mark.slow_except("lsrt2")
@pytest.mark.parametrize("method", METHODS)
def test_digits_of_the_shear_frame_with_a_pendulum(method: str) -> None:
    errors = [error_of_frame(method, step) for step in (0.04, 0.02, 0.01, 0.005, 0.0025)]
    np.testing.assert_allclose(errors, PROTOTYPE[method], rtol=0.05)


def stepped(made: eomgen.Model, step: float, count: int, *, exact: bool, end_force: bool) -> Array:
    """Return (q, v) behind steps of the one-stage method, from the model's functions in dense NumPy."""
    q, v, h = made.initial_q.copy(), made.initial_v.copy(), step
    a = made.forward_dynamics(q, v, t=0.0)
    for k in range(count):
        t, still = k * h, np.zeros_like(v)
        K, C, M = made.partials(q, v, a if exact else still, t=t)
        forces = made.inverse_dynamics(q, v, still, t=t) + made.inverse_dynamics(
            q, v, still, t=t + h if end_force else t
        )
        change = np.linalg.solve(M + h / 2 * C + h * h / 4 * K, -forces / 2 - h / 2 * K @ v)
        q, v, a = q + h * v + h * h / 2 * change, v + h * change, change
    return np.concatenate([q, v])


@cache
def strong_end() -> Array:
    """Return q and v of the frame under strong shaking at 5 s."""
    exact = frame(frequency=4.0).simulate(5.0, 1e-2, method="taylor", tolerance=1e-13, record_every=500)
    return np.concatenate([exact.q[-1], exact.v[-1]])


def error_of_strong(end: Array) -> float:
    return float(np.abs((end - strong_end()) / SCALE).max())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("exactly", "end_force", "orders"),
    [(True, True, (1.95, 2.05)), (False, True, (0.0, 1.3)), (True, False, (0.9, 1.1))],
    ids=["whole", "no K of accelerations", "forces of the start"],
)
def test_a_step_is_that_of_the_formula_and_its_order_hangs_on_each_part(
    exactly: bool, end_force: bool, orders: tuple[float, float]
) -> None:
    """In dense NumPy: the same motion; without K's part by accelerations, or with forces of the start, order 1."""
    made, end = frame(frequency=4.0), 5.0
    if exactly and end_force:
        ours = made.simulate(end, end / 250, method="rosenbrock", error_estimate=False)
        same = stepped(made, end / 250, 250, exact=True, end_force=True)
        np.testing.assert_allclose(np.concatenate([ours.q[-1], ours.v[-1]]), same, rtol=0, atol=1e-11)
    errors = [
        error_of_strong(stepped(made, end / count, count, exact=exactly, end_force=end_force))
        for count in (500, 1000, 2000)
    ]
    assert all(orders[0] <= slope <= orders[1] for slope in slopes(errors))


def in_two_stages(made: eomgen.Model, step: float, count: int, *, exact: bool, kept: bool) -> Array:
    """Return (q, v) behind steps of LSRT2 as a Rosenbrock method of first order, from the model's functions.

    Parameters
    ----------
    exact : whether the Jacobian has K's part by accelerations
    kept : whether the Jacobian is that of the start, in all steps
    """
    nv, gamma, h, y = made.nv, GAMMA["lsrt2"], step, np.concatenate([made.initial_q, made.initial_v])

    def rate(t: float, y: Array) -> Array:
        return np.concatenate([y[nv:], made.forward_dynamics(y[:nv], y[nv:], t=t)])

    def jacobian(t: float, y: Array) -> Array:
        a = rate(t, y)[nv:] if exact else np.zeros(nv)
        K, C, M = made.partials(y[:nv], y[nv:], a, t=t)
        return np.block([[np.zeros((nv, nv)), np.eye(nv)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])

    J = jacobian(0.0, y)
    for number in range(count):
        t = number * h
        J = J if kept else jacobian(t, y)
        matrix = np.eye(2 * nv) - gamma * h * J
        first = np.linalg.solve(matrix, rate(t, y))
        second = np.linalg.solve(matrix, rate(t + h / 2, y + h / 2 * first) - gamma * h * J @ first)
        y = y + h * second
    return y


@pytest.mark.slow
@pytest.mark.parametrize(("exact", "kept"), [(False, False), (True, True)], ids=["no K of accelerations", "kept"])
def test_two_stages_keep_their_order_with_any_matrix(exact: bool, kept: bool) -> None:
    """The textbook's formulas, of which the generated step differs by what a W-method allows: M of the middle of the
    step, and accelerations of the step before in K."""
    made, counts = frame(frequency=4.0), (500, 1000, 2000)
    errors = [error_of_strong(in_two_stages(made, 5.0 / count, count, exact=exact, kept=kept)) for count in counts]
    assert slopes(errors) == pytest.approx(2.0, abs=0.05)


def oscillator(frequency: float, damping: float) -> eomgen.Scene:
    builder = eomgen.SceneBuilder("oscillator", gravity=[0, 0, 0]).body("mass", 1.0)
    stiffness = {"stiffness": frequency**2, "damping": 2.0 * damping * frequency}
    return builder.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], **stiffness).build()


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.0, 0.3, 1.5, 1e3])
@pytest.mark.parametrize("method", METHODS)
def test_steps_of_an_oscillator_are_the_stability_function_of_its_matrix(method: str, damping: float) -> None:
    """R(z) = (1 + (1 - 2 gamma) z)/(1 - gamma z)^2, of which the one-stage method has one factor less; from h omega of
    1e-3 to 1e6."""
    gamma, made = GAMMA[method], eomgen.build(oscillator(1.0, damping))
    for step in (1e-3, 0.1, 1.0, 30.0, 1e6):
        A = step * np.array([[0.0, 1.0], [-1.0, -2.0 * damping]])
        one, inverse = np.eye(2), np.linalg.inv(np.eye(2) - gamma * A)
        wanted = (
            inverse @ (one + gamma * A) if method == "rosenbrock" else inverse @ inverse @ (one + (1 - 2 * gamma) * A)
        )
        found = np.empty((2, 2))
        for column, (q, v) in enumerate(one):
            end = made.simulate(step, step, method=method, initial={"q": [q], "v": [v]}, error_estimate=False)
            found[:, column] = end.q[-1, 0], end.v[-1, 0]
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)
        assert np.abs(np.linalg.eigvals(found)).max() <= 1.0 + 1e-9


@pytest.mark.slow
def test_stiff_forces_of_a_known_motion_leave_no_error_in_positions() -> None:
    """q'' + omega^2 q with the force of q = sin t, omega = 1e6, h = 0.1: forces at the ends of steps make the limit
    K q = F exact, those of their starts leave 0.1 of it."""
    scene = (
        eomgen.SceneBuilder("forced", gravity=[0, 0, 0]).body("mass", 1.0)
        .joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], stiffness=1e12, initial={"velocity": 1.0})
        .effort("known", "rail", "(1e12 - 1) * sin(t)").build()
    )  # fmt: skip  # a chain of calls
    end = eomgen.build(scene).simulate(2.0, 0.1, method="rosenbrock", error_estimate=False)
    assert np.abs(end.q[:, 0] - np.sin(end.t)).max() < 1e-11
    assert np.abs(end.v[:, 0] - np.cos(end.t)).max() < 2e-3


@pytest.mark.slow
def test_a_damped_start_takes_off_what_steps_cannot_follow() -> None:
    """Amplitude left of a mode with h omega = 1e4: 16/(h omega)^4 per pair of Euler's halves, nothing of it without."""
    made = eomgen.build(oscillator(1e4, 0.0))
    runs = [
        made.simulate(20.0, 1.0, method="rosenbrock", initial={"q": [1.0]}, settings={"damped_start": on})
        for on in (0, 1)
    ]
    assert abs(runs[0].q[-1, 0]) == pytest.approx(1.0, abs=1e-3)
    assert np.abs(runs[1].q[1:, 0]).max() < 1e-7
    assert (runs[0].stats["factorizations"], runs[1].stats["factorizations"]) == (20, 21)


@pytest.mark.slow
def test_a_damped_start_keeps_the_order() -> None:
    made, exact = model("pendulum"), reference("pendulum", 0.8)
    errors = [
        error(made, made.simulate(0.8, 0.8 / count, method="rosenbrock", settings={"damped_start": 1}), exact)
        for count in (80, 160, 320)
    ]
    assert slopes(errors) == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow_cases("rosenbrock")
@pytest.mark.parametrize("method", METHODS)
def test_every_step_is_the_same_operations(method: str) -> None:
    end = frame().simulate(2.0, 0.01, method=method, error_estimate=False)
    assert {name: end.stats[name] for name in ("steps", "factorizations", "evaluations", "newton_iterations")} == {
        "steps": 200,
        "factorizations": 200,
        "evaluations": 400,
        "newton_iterations": 0,
    }
    assert end.stats["exchanges"] == 0


@pytest.mark.slow
def test_growth_at_the_pole_of_the_step_stops_the_run() -> None:
    """M + (h/2)^2 K = 0: a force that pushes away with 4/h^2."""
    scene = (
        eomgen.SceneBuilder("pushed_away", gravity=[0, 0, 0]).body("mass", 1.0)
        .joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], initial={"position": 0.1})
        .effort("away", "rail", "256 * q.rail").build()
    )  # fmt: skip  # a chain of calls
    end = eomgen.build(scene).simulate(1.0, 0.125, method="rosenbrock", error_estimate=False)
    assert not end.success and len(end.t) == 1
    assert "the matrix of a step is singular" in end.message


@pytest.mark.slow
def test_terms_apart_from_the_method_are_added_to_a_model() -> None:
    model = eomgen.build(shear_frame(), method="rosenbrock", profile="quick")
    assert model.sparsity("inverse_dynamics", of=["a"]).shape == (model.nv, model.nv)
