"""Steps of one factorization: formulas of oscillators, exact balances of energy, stiff driven motions."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from tests.integrators.galerkin_in_numpy import SCHEMES, stepped
from tests.integrators.test_rosenbrock import slopes

Array = NDArray[np.float64]
METHODS = ("rosenbrock", "lsrt2", "corrected_predictor", "tdg1", "tdg1_star", "tdg2", "tdg2s", "tdg3")


@cache
def oscillator() -> eomgen.Model:
    builder = eomgen.SceneBuilder("oscillator", gravity=[0, 0, 0])
    builder.parameter("k", 1.0, tunable=True).parameter("c", 0.0, tunable=True).body("mass", 1.0)
    builder.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], stiffness="k", damping="c")
    return eomgen.build(builder.build(), profile="quick")


def by_formula(method: str, A: Array) -> Array:
    """Return the matrix of a step of y' = A y, of length 1: (1 + (1 - 2 gamma) A)/(1 - gamma A)^2, of which one stage
    has a factor less, and the correction of a prediction nothing left; or the passes."""
    one, gamma = np.eye(2), 1.0 - np.sqrt(0.5) if method == "lsrt2" else 0.5
    inverse = np.linalg.inv(one - gamma * A)
    if method == "lsrt2":
        return inverse @ inverse @ (one + (1.0 - 2.0 * gamma) * A)
    if method in SCHEMES:
        passes = [stepped(SCHEMES[method], lambda t, y: A @ y, lambda t, y: A, 0.0, start, 1.0) for start in one]
        return np.array(passes).T
    return inverse @ (one + gamma * A)


@pytest.mark.slow_except("lsrt2")
@pytest.mark.parametrize("method", METHODS)
def test_steps_of_an_oscillator_are_those_of_the_formulas(method: str) -> None:
    for damping in (0.0, 0.3, 1.5, 1e3):
        A = np.array([[0.0, 1.0], [-1.0, -2.0 * damping]])
        for step in (1e-3, 0.1, 1.0, 30.0, 1e6):
            options = {"method": method, "parameters": {"c": 2.0 * damping}, "error_estimate": False}
            ends = [oscillator().simulate(step, step, initial={"q": [q], "v": [v]}, **options) for q, v in np.eye(2)]
            found = np.array([[end.q[-1, 0] for end in ends], [end.v[-1, 0] for end in ends]])
            np.testing.assert_allclose(found, by_formula(method, step * A), rtol=1e-7, atol=1e-9)


@cache
def machine(size: int) -> tuple[eomgen.Model, Array, Array]:
    """Return slides on slides with springs and dampers between all of them, and K and C; stiffnesses of 8 decades."""
    rng = np.random.default_rng(3)
    basis, _ = np.linalg.qr(rng.normal(size=(size, size)))
    K = basis @ np.diag(np.geomspace(1e-8, 1.0, size)) @ basis.T
    some = rng.normal(size=(size, size - 2))
    C = 0.1 * some @ some.T / size
    builder, last = eomgen.SceneBuilder("machine", gravity=[0, 0, 0]), "base"
    for k in range(size):
        axis = rng.normal(size=3)
        start = {"position": float(rng.normal()), "velocity": float(rng.normal())}
        builder.body(f"m{k}", float(rng.uniform(0.5, 2.0)))
        builder.joint(f"x{k}", "prismatic", last, f"m{k}", axis=list(axis / np.linalg.norm(axis)), initial=start)
        terms = [f"({float(-K[k, j])!r}) * q.x{j} + ({float(-C[k, j])!r}) * v.x{j}" for j in range(size)]
        for first in range(0, size, 10):  # a formula has 50 levels at most
            builder.effort(f"f{k}_{first}", f"x{k}", " + ".join(terms[first : first + 10]))
        last = f"m{k}"
    return eomgen.build(builder.build(), profile="quick", method="rosenbrock"), K, C


@pytest.mark.slow_except("1.0-1e-10-8-200", "1000.0-1e-09-8-200")
@pytest.mark.long_cases("1000.0-1e-09-50-2000")
@pytest.mark.parametrize(
    ("h_omega", "bar", "size", "steps"),
    [(1e-3, 1e-14, 8, 200), (1.0, 1e-10, 8, 200), (1e3, 1e-9, 8, 200), (1e6, 1e-6, 8, 200), (1e3, 1e-9, 50, 2000)],
)
def test_the_balance_of_energy_of_a_linear_step_is_exact(h_omega: float, bar: float, size: int, steps: int) -> None:
    """E' - E = -h w^T C w with the mean velocity w, for damping that is not proportional; E never grows."""
    made, K, C = machine(size)
    still = np.zeros(size)
    M = np.array([made.inverse_dynamics(still, still, row) for row in np.eye(size)]) - made.inverse_dynamics(
        still, still, still
    )
    fastest = float(np.sqrt(np.max(np.linalg.eigvals(np.linalg.solve(M, K)).real)))
    step = h_omega / fastest
    run = made.simulate(steps * step, step, method="rosenbrock", error_estimate=False)
    energy = 0.5 * (((run.v @ M) * run.v).sum(axis=1) + ((run.q @ K) * run.q).sum(axis=1))
    mean = 0.5 * (run.v[1:] + run.v[:-1])
    lost = step * ((mean @ C) * mean).sum(axis=1)
    assert np.max(np.abs(np.diff(energy) + lost) / energy[:-1]) <= bar
    assert np.all(np.diff(energy) <= bar * energy[:-1])


@pytest.mark.slow
@pytest.mark.parametrize(("damping", "bar"), [(0.0, 1e-11), (1.0, 1e-8)])
def test_a_stiff_driven_motion_is_met_in_positions_and_to_order_2_in_velocities(damping: float, bar: float) -> None:
    """q'' + 2 zeta omega q' + omega^2 q with the force of q = sin t, omega = 1e6."""
    c, rail = 2e6 * damping, {"axis": [1, 0, 0], "stiffness": 1e12, "initial": {"velocity": 1.0}}
    scene = (
        eomgen.SceneBuilder("forced", gravity=[0, 0, 0]).body("mass", 1.0)
        .joint("rail", "prismatic", "base", "mass", damping=c, **rail)
        .effort("known", "rail", f"(1e12 - 1) * sin(t) + {c!r} * cos(t)").build()
    )  # fmt: skip  # a chain of calls
    made, errors = eomgen.build(scene, profile="quick"), []
    for count in (20, 40, 80):
        end = made.simulate(2.0, 2.0 / count, method="rosenbrock", error_estimate=False)
        errors.append(float(np.abs(end.v[:, 0] - np.cos(end.t)).max()))
        assert np.abs(end.q[:, 0] - np.sin(end.t)).max() < bar
    assert slopes(errors) == pytest.approx(2.0, abs=0.1)
