"""Operations of steps with first derivatives, and inputs within steps, on arrays."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.lie import numeric, product
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor
from eomgen.products.derivatives.jump_run import JumpRun
from eomgen.products.derivatives.linear_operations import LinearOperations, Moved, add
from eomgen.products.derivatives.linear_run import LinearRun
from eomgen.simulation.stepping.inputs import InputSignals

FACTORS = [Factor("R", "a", 0, 1, 0, 1), Factor("SO3", "b", 1, 4, 1, 3), Factor("SE3", "c", 5, 7, 4, 6)]
TINY = 1e-30


def operations() -> LinearOperations:
    made = object.__new__(LinearOperations)
    made.factors, made.nv, made.count, made._turns = FACTORS, 10, 3, True
    return made


def rate(theta: Array, v: Array) -> Array:
    """Return v + [theta, v]/2 + [theta, [theta, v]]/12."""
    ad = product.bracket_matrix(FACTORS, theta)
    once = ad @ v[..., None]
    return v + (0.5 * once + ad @ once / 12.0)[..., 0]


def cotangent(theta: Array, x: Array) -> Array:
    result = x.astype(complex)
    for factor in FACTORS[1:]:
        inverse = numeric.tangent_inverse(group_named(factor.group, factor.v_size), theta[:, factor.v])
        result[:, factor.v] = (np.swapaxes(inverse, 1, 2) @ x[:, factor.v, None])[..., 0]
    return result


@pytest.mark.parametrize(("name", "function"), [("increment_rate", rate), ("cotangent", cotangent)])
def test_functions_of_increments_have_the_derivatives_of_complex_steps(
    name: str, function: Any, rng: np.random.Generator
) -> None:
    theta, x, A, B = (rng.normal(size=(3, *shape)) for shape in ((10,), (10,), (10, 4), (10, 4)))
    found = getattr(operations(), name)(Moved(theta, {"y": A}), Moved(x, {"y": B, "z": 1.0}))
    np.testing.assert_allclose(found.value, function(theta.astype(complex), x.astype(complex)).real, rtol=1e-12)
    along = [function(theta + 1j * TINY * A[..., k], x + 1j * TINY * B[..., k]).imag / TINY for k in range(4)]
    np.testing.assert_allclose(found.along["y"], np.stack(along, axis=-1), rtol=1e-10, atol=1e-12)
    by_x = [function(theta.astype(complex), x + 1j * TINY * e).imag / TINY for e in np.eye(10)]
    np.testing.assert_allclose(found.along["z"], np.stack(by_x, axis=-1), rtol=1e-10, atol=1e-12)


def test_sums_of_multiples_of_the_unit_matrix_and_of_matrices(rng: np.random.Generator) -> None:
    M, N = rng.normal(size=(2, 3, 4, 4))
    value = np.zeros((3, 4))
    one, other = Moved(value, {"q": 1.0, "v": N}), Moved(value, {"q": N, "p": 2.0})
    found, I = add((0.5, one), (M, other), (3.0, one)), np.eye(4)  # noqa: E741  # the unit matrix
    np.testing.assert_allclose(found["q"], 3.5 * I + M @ N, rtol=1e-14)
    np.testing.assert_allclose(found["v"], 3.5 * N, rtol=1e-14)
    np.testing.assert_allclose(found["p"], 2.0 * M, rtol=1e-14)
    assert add((0.5, one), (2.0, one))["q"] == 2.5
    part = Moved(rng.normal(size=(3, 4)), {"q": N}).part(1, 2)
    np.testing.assert_array_equal(part.along["q"], N[:, 1:3])


def run_with(signals: InputSignals, formula: Any = None) -> Any:
    """Return what a run of ten steps from 1 s on has of inputs and base, as far as ``prescribe`` asks for it."""
    model = SimpleNamespace(nu=len(signals.names), evaluator=SimpleNamespace(moving_base=True))
    model.input_values = lambda t, parameters: formula(t) * parameters[..., :1]
    model.base = lambda t, parameters: t[:, None] + parameters[..., :1]
    takes = bool(signals.given or (signals.names and signals.formulas is None))
    run = SimpleNamespace(model=model, signals=signals, grid=SimpleNamespace(start=1.0, step=0.1), takes_rows=takes)
    made = SimpleNamespace(run=run, motion=SimpleNamespace(steps=10), equations=SimpleNamespace(p=np.array([2.0])))
    made.ends_of_steps = lambda within: LinearRun.ends_of_steps(cast(Any, made), within)
    return made


def test_inputs_by_rows_are_linear_within_their_step() -> None:
    """Those that the stepper evaluates by formulas are not; parameters may differ from row to row."""

    def law(t: float) -> float:
        return t * t

    def both(t: Array) -> Array:
        return np.stack([np.sin(t), np.cos(t)], axis=1)

    given = InputSignals(("a", "b"), {"a": law}, lambda t: 2.0 * both(t), 0.1, 1.0, left_to_stepper=True)
    run, t = run_with(given, both), np.array([1.13, 1.2, 1.2, 1.97])
    within = np.array([1.15, 1.15, 1.25, 1.99])
    found = LinearRun.prescribe(run, t, within)
    start = np.array([1.1, 1.1, 1.2, 1.9])
    chord = start**2 + (t - start) / 0.1 * ((start + 0.1) ** 2 - start**2)
    np.testing.assert_allclose(found.u, np.stack([chord, 2.0 * np.cos(t)], axis=1), rtol=1e-12)
    np.testing.assert_allclose(found.base[:, 0], t + 2.0)
    np.testing.assert_allclose(LinearRun.prescribe(run, t).u, np.stack([t * t, 2.0 * np.cos(t)], axis=1), rtol=1e-14)
    by_row = LinearRun.prescribe(run, t, within, np.array([[1.0], [2.0], [3.0], [4.0]]))
    np.testing.assert_allclose(by_row.u[:, 1], [1.0, 2.0, 3.0, 4.0] * np.cos(t), rtol=1e-12)
    np.testing.assert_allclose(by_row.base[:, 0], np.add(t, [1.0, 2.0, 3.0, 4.0]))
    rates = JumpRun._rates(run, within)
    np.testing.assert_allclose(rates[:, 0], 2.0 * start + 0.1, rtol=1e-10)
    np.testing.assert_array_equal(rates[:, 1], 0.0)
    alone = run_with(InputSignals(("a", "b"), {}, both, 0.1, 1.0), both)
    np.testing.assert_allclose(LinearRun.prescribe(alone, t, within).u, 2.0 * both(t))
    np.testing.assert_array_equal(JumpRun._rates(alone, within), np.zeros((4, 2)))
    np.testing.assert_allclose(
        LinearRun.ends_of_steps(run, np.array([0.5, 1.0, 1.9999999999, 9.0]))[0], [1, 1, 1.9, 1.9]
    )
