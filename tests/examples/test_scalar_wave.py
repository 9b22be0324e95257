"""The bar of examples/scalar_wave: its matrices by hand, its waves against exact ones and published figures, its C."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.integrators.families.register import method_named
from eomgen.integrators.stepper_data import method_data
from eomgen.symbolic.evaluate import evaluate
from tests.models.scalar_wave import bar

Array = NDArray[np.float64]
ELEMENTS = 200
#: Linear solves -> error of the pulse at 1.5 s in the energy norm, by methods written in NumPy.
TRAPEZOIDAL = {300: 3.86e-1, 600: 1.05e-1, 1200: 2.65e-2, 2400: 6.63e-3, 4800: 1.66e-3}
HALF_DAMPED = {300: 5.17e-1, 600: 1.55e-1, 1200: 3.96e-2, 2400: 9.94e-3, 4800: 2.49e-3}
TWO_STAGES = {300: 6.15e-1, 600: 1.98e-1, 1200: 5.12e-2, 2400: 1.29e-2, 4800: 3.22e-3}
#: The same of the discontinuous Galerkin methods, of which two digits are known.
FIRST_DEGREE = {300: 4.0e-1, 600: 1.1e-1, 1200: 1.8e-2, 2400: 2.4e-3, 4800: 3.0e-4}
SECOND_DEGREE = {300: 5.8e-1, 600: 1.6e-1, 1200: 1.0e-2, 2400: 2.4e-4, 4800: 4.2e-6}
PULSES: dict[tuple[str, int], dict[int, float]] = {
    ("trapezoidal", 1): TRAPEZOIDAL,
    ("rosenbrock", 1): TRAPEZOIDAL,
    ("generalized_alpha", 1): HALF_DAMPED,
    ("lsrt2", 2): TWO_STAGES,
    ("tdg1", 4): FIRST_DEGREE,
    ("tdg2", 12): SECOND_DEGREE,
}
#: Method -> overshoot, mean error and total variation of the shock at a step of two elements, as before.
SHOCKS = {
    "trapezoidal": (0.3480, 0.1065, 30.54),
    "rosenbrock": (0.3480, 0.1065, 30.54),
    "generalized_alpha": (0.2713, 0.0818, 11.48),
    "lsrt2": (0.2664, 0.0638, 13.01),
    "tdg1": (0.160, 0.0240, 6.0),
    "tdg2": (0.269, 0.0415, 15.2),
}


def matrices(elements: int, mass: str, *, free_end: bool) -> tuple[Array, Array]:
    """Return M and K of a bar with EA = m = L = 1, element by element."""
    M, K = np.zeros((2, elements + 1, elements + 1))
    share = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0 if mass == "consistent" else np.eye(2) / 2.0
    for k in range(elements):
        place = np.ix_((k, k + 1), (k, k + 1))
        M[place] += share / elements
        K[place] += np.array([[1.0, -1.0], [-1.0, 1.0]]) * elements
    kept = slice(1, elements + free_end)
    return M[kept, kept], K[kept, kept]


def hill(elements: int) -> Array:
    x = np.arange(1, elements) / elements
    return np.exp(-((x - 0.4) ** 2) / (2.0 * 0.03**2))


def options(method: str) -> dict[str, Any]:
    return {"method": method, "error_estimate": False, **({"rho_inf": 0.5} if method == "generalized_alpha" else {})}


@cache
def pulse() -> eomgen.Model:
    return eomgen.build(bar.Bar("pulse", tuple(hill(ELEMENTS).tolist())))


@cache
def shock() -> eomgen.Model:
    return eomgen.build(bar.Bar("shock", (0.0,) * ELEMENTS, "lumped", free_end=True))


@cache
def exact_end() -> tuple[Array, Array, Array, Array]:
    """Return M, K, q and v of the pulse at 1.5 s from the modes of its matrices."""
    M, K = matrices(ELEMENTS, "consistent", free_end=False)
    squares, modes = eigh(K, M)
    omega = np.sqrt(squares)
    start = modes.T @ M @ hill(ELEMENTS)
    return M, K, modes @ (start * np.cos(1.5 * omega)), modes @ (-omega * start * np.sin(1.5 * omega))


@pytest.mark.slow_except("consistent-True")
@pytest.mark.parametrize("free_end", [False, True])
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_its_terms_are_those_of_its_elements(mass: str, free_end: bool, rng: np.random.Generator) -> None:
    n = 7
    terms = ["mass", "partials", "iteration", "residual", "forward_dynamics", "energy"]
    one = bar.Bar("small", (0.0,) * n, mass, free_end)
    model = eomgen.build(one, terms, profile="quick")
    EA, m, L, pull = 3.0, 2.0, 1.5, 0.7 if free_end else 0.0
    values = {"axial_stiffness": EA, "mass_per_length": m, "length": L} | ({"traction": pull} if free_end else {})
    M, K = matrices(one.elements, mass, free_end=free_end)
    M, K, load = M * m * L, K * EA / L, np.append(np.zeros(n - 1), pull)
    q, v, a = rng.normal(size=(3, n))
    np.testing.assert_allclose(model.mass(q, parameters=values), M, atol=1e-15)
    for found, matrix in zip(model.partials(q, v, a, parameters=values), (K, np.zeros((n, n)), M), strict=True):
        np.testing.assert_allclose(found, matrix, atol=1e-13)
    np.testing.assert_allclose(
        model.forward_dynamics(q, v, parameters=values), np.linalg.solve(M, load - K @ q), rtol=1e-10
    )
    energy = model.energy(q, v, parameters=values)
    assert energy["kinetic"] == pytest.approx(0.5 * v @ M @ v)
    assert energy["potential"] == pytest.approx(0.5 * q @ K @ q - load @ q)
    system = eomgen.derive(one)
    blocks = {"p": np.array(list(values.values())), "q": q, "v": v, "a": a}
    residual = evaluate(system.tape, system.functions["residual"].refs, blocks)
    np.testing.assert_allclose(residual, M @ a + K @ q - load, atol=1e-12)
    assert {"mass", "partials"}.isdisjoint(system.functions)
    for name, matrix in (("K", K), ("M", M)):
        assert sorted(system.patterns[name]) == sorted(zip(*np.nonzero(matrix), strict=True))


def error_of_pulse(method: str, steps: int) -> float:
    """Return the error at 1.5 s in the energy norm, relative."""
    M, K, q, v = exact_end()
    run = pulse().simulate(1.5, 1.5 / steps, record_every=steps, **options(method))
    assert run.success, run.message
    dq, dv, start = run.q[-1] - q, run.v[-1] - v, hill(ELEMENTS)
    return float(np.sqrt((dq @ K @ dq + dv @ M @ dv) / (start @ K @ start)))


@pytest.mark.long_except_every(3)
@pytest.mark.slow
@pytest.mark.long_cases("trapezoidal")
@pytest.mark.parametrize("key", PULSES, ids=lambda key: key[0])
def test_a_pulse_has_the_errors_of_methods_written_by_hand(key: tuple[str, int]) -> None:
    (method, solves), expected = key, PULSES[key]
    found = {number: error_of_pulse(method, number // solves) for number in expected}
    assert found == pytest.approx(expected, rel=0.05 if method.startswith("tdg") else 0.01)


@pytest.mark.slow
def test_small_steps_of_third_degree_meet_their_threshold() -> None:
    assert error_of_pulse("tdg3", 240) < 3e-7


@pytest.mark.long_except_every(2)
@pytest.mark.slow
@pytest.mark.long_cases("trapezoidal")
@pytest.mark.parametrize("method", SHOCKS)
def test_a_shock_overshoots_as_by_methods_written_by_hand(method: str) -> None:
    run = shock().simulate(8.0, 2.0 / ELEMENTS, **options(method))
    assert run.success, run.message
    middle, place = run.v[:, ELEMENTS // 2 - 1], np.mod(run.t, 4.0)
    exact = np.where((place > 0.5) & (place < 1.5), 1.0, np.where((place > 2.5) & (place < 3.5), -1.0, 0.0))
    late = middle[run.t >= 4.0 - 1e-9]
    found = np.abs(middle).max() - 1.0, np.abs(middle - exact).mean(), np.abs(np.diff(late)).sum()
    assert found == pytest.approx(SHOCKS[method], rel=0.01)


@pytest.mark.slow
@pytest.mark.long_cases("consistent-generalized_alpha", "lumped-rosenbrock")
@pytest.mark.parametrize(("mass", "method"), [("consistent", "generalized_alpha"), ("lumped", "rosenbrock")])
def test_the_statements_of_its_c_do_not_grow_with_its_elements(mass: str, method: str) -> None:
    def statements(elements: int) -> int:
        system = bar.derive(bar.Bar("bar", (0.0,) * elements, mass, free_end=True), None)
        files = generate_files(to_program(system, method_data(method_named(method), system, 1e-3)))
        return sum(text.count(";") for text in files.values())

    assert statements(2000) == statements(1000) < statements(20)
