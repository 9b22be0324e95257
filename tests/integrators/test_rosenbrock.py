"""Rosenbrock steps of one factorization: formulas in dense NumPy, digits of a benchmark by prototypes, damped starts,
the same operations in every step. Orders on every group are in test_orders.py."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from tests.integrators.test_taylor import error, model, reference
from tests.models.shear_frame import RESPONSE, SCALE, shear_frame

Array = NDArray[np.float64]


def slopes(errors: list[float]) -> Array:
    return np.asarray(np.log2(np.array(errors[:-1]) / errors[1:]))


@cache
def frame(**parameters: float) -> eomgen.Model:
    return eomgen.build(shear_frame(**parameters))


#: Errors of the same formulas in prototypes, which were written apart from this code, by halves of a step of 0.04 s, to
#: two digits; the matrix of the corrected predictor is that of the start. That of tdg2 had forward dynamics at all
#: nodes: accelerations of the polynomial have an error of the same power of h.
PROTOTYPES = {
    "rosenbrock": (5.6e-2, 1.8e-2, 4.6e-3, 1.1e-3, 2.9e-4),
    "lsrt2": (3.3e-2, 8.5e-3, 2.2e-3, 5.5e-4, 1.4e-4),
    "corrected_predictor": (6.2e-2, 1.8e-2, 4.8e-3, 1.2e-3, 3.1e-4),
    "tdg1": (4.9e-3, 6.3e-4, 7.9e-5, 9.8e-6),
    "tdg2": (5.8e-6, 1.2e-7, 2.7e-9, 6.6e-11),
}


@pytest.mark.slow
@pytest.mark.parametrize("method", PROTOTYPES)
def test_digits_of_the_shear_frame_with_a_pendulum(method: str) -> None:
    errors, settings = [], {"matrix_every": 0} if method == "corrected_predictor" else {}
    for power in range(len(PROTOTYPES[method])):
        end = frame().simulate(10.0, 0.04 / 2**power, method=method, settings=settings, error_estimate=False)
        errors.append(float(np.abs((np.concatenate([end.q[-1], end.v[-1]]) - RESPONSE) / SCALE).max()))
    np.testing.assert_allclose(errors, PROTOTYPES[method], rtol=0.3 if method == "tdg2" else 0.05)


def stepped(made: eomgen.Model, step: float, count: int) -> Array:
    """Return (q, v) behind steps of the one-stage method, from the model's functions in dense NumPy."""
    q, v, h = made.initial_q.copy(), made.initial_v.copy(), step
    a = made.forward_dynamics(q, v, t=0.0)
    for k in range(count):
        t, still = k * h, np.zeros_like(v)
        K, C, M = made.partials(q, v, a, t=t)
        forces = made.inverse_dynamics(q, v, still, t=t) + made.inverse_dynamics(q, v, still, t=t + h)
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
def test_a_step_is_that_of_the_formula() -> None:
    made, end = frame(frequency=4.0), 5.0
    ours = made.simulate(end, end / 250, method="rosenbrock", error_estimate=False)
    found = np.concatenate([ours.q[-1], ours.v[-1]])
    np.testing.assert_allclose(found, stepped(made, end / 250, 250), rtol=0, atol=1e-11)


def oscillator(frequency: float, damping: float) -> eomgen.Scene:
    builder = eomgen.SceneBuilder("oscillator", gravity=[0, 0, 0]).body("mass", 1.0)
    stiffness = {"stiffness": frequency**2, "damping": 2.0 * damping * frequency}
    return builder.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], **stiffness).build()


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


#: Evaluations of forces in a step: at all nodes in each pass, of few passes twice behind the first, as M varies here.
FORCES = {"rosenbrock": 2, "lsrt2": 2, "tdg1": 2 * 3, "tdg1_star": 2 * 3, "tdg2": 3 * 4, "tdg2s": 3 * 3, "tdg3": 4 * 6}


@pytest.mark.slow_except("lsrt2", "tdg2")
@pytest.mark.parametrize("method", FORCES)
def test_every_step_is_the_same_operations(method: str) -> None:
    end = frame().simulate(2.0, 0.01, method=method, error_estimate=False)
    counted = [end.stats[name] for name in ("steps", "factorizations", "evaluations", "newton_iterations")]
    assert counted == [200, 200, 200 * FORCES[method], 0]
    assert end.stats.get("exchanges", 0) == 0


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
