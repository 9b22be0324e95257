"""Implicit steps of Hamiltonian systems that are not separable: against closed forms, and what they keep."""

from __future__ import annotations

import json
import math
import signal
import time
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj, roots_legendre

import eomgen
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.products.fields.hamiltonian import model as hamiltonian_model
from eomgen.products.fields.hamiltonian.methods import gauss_collocation
from tests.hamiltonian.systems import OSCILLATOR, system
from tests.hamiltonian.test_hamiltonian import HENON_HEILES
from tests.models import library
from tests.models.toml_text import toml_text

#: q = a cn(w t, a^2/w^2) with w^2 = 2 H, a^2 = 2 H - 1 from p = 0.
PRODUCT = system(
    "product",
    "(p_q**2 + 1)*(q**2 + 1)/2",
    coordinates={"q": {"initial": [1.5, 0.0]}},
    simulation={"duration": 3.0, "step": 0.1},
)
#: A charge in an even magnetic field and a quadrupole: linear, and not separable.
CHARGE = system(
    "charge",
    "((p_x + B*y/2)**2 + (p_y - B*x/2)**2)/2 + E*(x**2 - y**2)/2",
    parameters={"B": 3.0, "E": 0.8},
    coordinates={"x": {"initial": [0.4, 0.1]}, "y": {"initial": [-0.2, 0.3]}},
)
#: A double pendulum of unit masses and lengths in its canonical momenta.
PENDULUM = system(
    "double_pendulum",
    ("(p_a**2 + 2*p_b**2 - 2*p_a*p_b*cos(a - b))/(2*(1 + sin(a - b)**2)) - g*(2*cos(a) + cos(b))"),
    parameters={"g": 9.81},
    coordinates={"a": {"initial": [1.2, 0.0]}, "b": {"initial": [0.4, 0.0]}},
)
IMPLICIT = {"implicit_midpoint": 2, "gauss4": 4, "gauss6": 6, "gauss8": 8, "suzuki4": 4, "yoshida6": 6, "kahan_li8": 8}


@cache
def model(name: str) -> Any:
    made = {"product": PRODUCT, "charge": CHARGE, "pendulum": PENDULUM, "henon_heiles": HENON_HEILES}
    return eomgen.build(made[name], profile="quick")


def _end(run: Any) -> Array:
    assert run.success, run.message
    return np.concatenate([run.q[-1], run.p[-1]])


@pytest.mark.parametrize("method", IMPLICIT)
def test_motions_have_the_order_of_the_method_against_an_elliptic_function(method: str) -> None:
    t_end, energy = 1.6, (1 + 1.5**2) / 2
    w = math.sqrt(2 * energy)
    _, cn, _, _ = ellipj(w * t_end, 1.5**2 / w**2)
    order, errors = IMPLICIT[method], []
    for steps in {2: (40, 80), 4: (20, 40), 6: (16, 32), 8: (16, 32)}[order]:
        run = model("product").simulate(t_end, t_end / steps, method=method, error_estimate=False)
        errors.append(abs(_end(run)[0] - 1.5 * cn))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.35)
    assert errors[1] > 1e-14


@pytest.mark.parametrize("stages", [1, 2, 3, 4, 5, 6])
def test_collocation_is_symplectic_and_integrates_polynomials(stages: int) -> None:
    A, b = np.reshape(gauss_collocation(stages)[0], (stages, stages)), np.array(gauss_collocation(stages)[1])
    np.testing.assert_allclose(b[:, None] * A + (b[:, None] * A).T, np.outer(b, b), atol=2e-16)
    c = (1 + roots_legendre(stages)[0]) / 2
    for k in range(stages):
        np.testing.assert_allclose(A @ c**k, c ** (k + 1) / (k + 1), atol=1e-15)
    for k in range(2 * stages):
        assert b @ c**k == pytest.approx(1 / (k + 1), rel=1e-14)


@pytest.mark.parametrize("step", [0.01, 0.3, 3.0, 300.0])
def test_steps_of_any_size_solve_their_equations(step: float) -> None:
    """The motion of a charge is linear: a step of the midpoint rule is the Cayley transform of its matrix."""
    compiled = model("charge")
    start = np.array([0.4, -0.2, 0.1, 0.3])
    rows = np.eye(4)
    by_q, by_p = compiled.hessian_product(
        *(np.tile(x, (4, 1)) for x in (start[:2], start[2:])), rows[:, :2], rows[:, 2:]
    )
    half = step / 2 * np.hstack([by_p, -by_q]).T
    exact = np.linalg.matrix_power(np.linalg.solve(np.eye(4) - half, np.eye(4) + half), 5) @ start
    run = compiled.simulate(5 * step, step, method="implicit_midpoint")
    np.testing.assert_allclose(_end(run), exact, atol=2e-14 * max(1.0, step))
    assert (run.stats["products"] > 0) == (step > 1)


def test_newton_takes_what_iteration_does_not() -> None:
    """Where steps are too long to iterate, each still solves z1 - z0 = h J dH((z0 + z1)/2)."""
    initial = {"a": 0.3, "b": -0.1}
    run = model("pendulum").simulate(24.0, 0.4, method="implicit_midpoint", initial=initial, error_estimate=False)
    assert run.success and run.stats["products"] > 0
    middle = [(x[1:] + x[:-1]) / 2 for x in (run.q, run.p)]
    dq, dp = model("pendulum").gradient(*middle)
    np.testing.assert_allclose(np.diff(run.q, axis=0), 0.4 * dp, atol=2e-13)
    np.testing.assert_allclose(np.diff(run.p, axis=0), -0.4 * dq, atol=2e-13)


@pytest.mark.parametrize(
    ("name", "method", "step"),
    [
        ("pendulum", "implicit_midpoint", 0.4),
        ("pendulum", "gauss6", 0.1),
        ("pendulum", "suzuki4", 0.3),
        ("henon_heiles", "omf4", 0.25),
    ],
)
def test_steps_are_symplectic_and_symmetric(name: str, method: str, step: float) -> None:
    """J = M^T J M for the derivative M of a map, by central differences."""
    compiled = model(name)
    start = np.array([0.5, -0.3, 0.6, 0.2])

    def moved(state: Array, h: float = step) -> Array:
        initial = {"q": state[:2], "p": state[2:]}
        return _end(compiled.simulate(4 * h, h, method=method, initial=initial, error_estimate=False))

    width = 1e-4  # of central differences of fourth order
    near = [moved(start + width * e) - moved(start - width * e) for e in np.eye(4)]
    far = [moved(start + 2 * width * e) - moved(start - 2 * width * e) for e in np.eye(4)]
    columns = [(8 * one - two) / (12 * width) for one, two in zip(near, far, strict=True)]
    derivative = np.stack(columns, axis=1)
    form = np.kron([[0, 1], [-1, 0]], np.eye(2))
    np.testing.assert_allclose(derivative.T @ form @ derivative, form, atol=3e-9)
    np.testing.assert_allclose(moved(moved(start), -step), start, atol=2e-13)


def test_a_double_pendulum_moves_as_the_scene_does() -> None:
    """Against the Lagrangian of a scene by another stepper: angles are those from the vertical."""
    bob = {"mass": 1.0, "center_of_mass": [1, 0, 0], "inertia": [0, 0, 0]}
    starts = {"shoulder": math.pi / 2 - 1.2, "elbow": 0.8}
    changes: Any = {f"joints__{name}__initial": {"position": start} for name, start in starts.items()}
    changes |= {f"joints__{name}__damping": 0 for name in starts} | dict.fromkeys(("inputs", "efforts"))
    scene = library.scene("arm", bodies={"upper": bob, "fore": bob}, **changes)
    lagrangian: Any = eomgen.build(scene, method="rk45", profile="quick")
    other = lagrangian.simulate(2.0, 0.01, tolerance=1e-12, error_estimate=False)
    run = model("pendulum").simulate(2.0, 0.01, method="gauss8")
    np.testing.assert_allclose(run.q[-1], math.pi / 2 - np.cumsum(other.q[-1]), atol=2e-9)
    assert run.error_estimate.relative < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "step", "steps", "bound"), [("implicit_midpoint", 0.02, 2e5, 1.3e-4), ("gauss4", 0.05, 2e5, 1e-5)]
)
def test_energy_errors_are_bounded_over_many_steps(method: str, step: float, steps: float, bound: float) -> None:
    initial = {"a": 0.6, "b": -0.3}
    run = model("pendulum").simulate(
        steps * step, step, method=method, initial=initial, record_every=100, compensated=True, error_estimate=False
    )
    error = np.abs(run.energy["total"] / run.energy["total"][0] - 1)
    assert 0.5 * bound < error.max() < bound
    assert error[len(error) // 2 :].max() < 1.5 * error[: len(error) // 2].max()


@pytest.mark.slow
def test_a_run_is_interrupted_within_a_row_and_keeps_the_state_there() -> None:
    oscillator: Any = eomgen.build(OSCILLATOR, profile="quick")

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    began = time.process_time()
    try:
        run: Any = oscillator.simulate(1e9, 1e-3, method="leapfrog", record_every=10**12)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert time.process_time() - began < 1.0
    assert run.interrupted and not run.success and run.message.startswith("interrupted at t = ")
    assert len(run.t) == 2 and run.t[-1] == run.stats["steps"] * 1e-3 > 0
    assert str(run.error_estimate) == "not known: the run did not reach its end"
    steps = int(run.stats["steps"])
    shorter: Any = oscillator.simulate(run.t[-1], 1e-3, method="leapfrog", record_every=steps, error_estimate=False)
    np.testing.assert_allclose(run.q[-1], shorter.q[-1], atol=1e-12)
    np.testing.assert_allclose(run.p[-1], shorter.p[-1], atol=1e-12)


def test_the_command_line_keeps_what_was_done_and_ends_with_130(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "oscillator.toml"
    file.write_text(toml_text(OSCILLATOR))
    looks = iter(range(10))

    def clock() -> float:
        if next(looks) == 5:  # between two calls of C, in the first row
            raise KeyboardInterrupt
        return time.monotonic()

    monkeypatch.setattr(hamiltonian_model, "time", SimpleNamespace(perf_counter=clock))
    options = ["--t-end", "1e5", "--step", "1e-3", "--record-every", "100000000", "--no-plots", "--json"]
    assert main(["simulate", str(file), "--out", str(tmp_path / "out"), *options]) == 130
    summary = json.loads(capsys.readouterr().out)
    assert summary["rows"] == 2 and summary["message"].startswith("interrupted at t = 0.")
    assert summary["final"]["t"] == summary["stats"]["steps"] * 1e-3 > 0
    assert summary["final"]["x"] == pytest.approx(math.cos(summary["final"]["t"]), abs=1e-9)
