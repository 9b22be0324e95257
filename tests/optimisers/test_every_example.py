"""Functions for CasADi of some examples: Jacobians and Hessians against complex steps of the C, and sparsity at random
states."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.compiled.functions import Functions
from eomgen.lie.product import Factor
from tests.mechanics.test_argument_derivatives import given, state_of
from tests.optimisers.test_casadi import derivatives

EXAMPLES = Path(__file__).parents[2] / "examples"
Array = np.ndarray
#: Examples that have all groups, rows, states, inputs, beams and laws by cases.
SCENES = [
    *("active_quarter_car", "four_bar", "free_spinning_body", "gear_with_backlash", "pi_servo", "slider_crank_spatial"),
    *("spin_up_beam", "vehicle_with_preview/model"),
]
#: Random states for sparsity.
STATES = 1000
#: An imaginary step, the square of which is lost.
IMAGINARY = 1e-40


@cache
def model_of(example: str) -> eomgen.Model:
    return eomgen.build(EXAMPLES / example / "scene.toml", profile="quick")


@cache
def functions_of(example: str) -> Any:
    return eomgen.casadi(model_of(example), profile="quick")


def unit(factors: list[Factor], q: Array) -> Array:
    """Return q with unit quaternions; analytic in q."""
    result = q.copy()
    for factor in (factor for factor in factors if factor.group != "R"):
        p = slice(factor.q_start, factor.q_start + 4)
        result[p] = q[p] / np.sqrt(np.sum(q[p] * q[p]))
    return result


def in_components(factors: list[Factor], q: Array, left: Array) -> Array:
    """Return derivatives (..., nq) in the components of q, as of a function of q/|q|, from left-trivialised ones.

    With d = 2 (w dx - dw x - x cross dx)/|q|^2 the rotation of a change, and R^T dp the travel.
    """
    result = np.zeros((*left.shape[:-1], len(q)), np.result_type(q, left))
    for factor in factors:
        if factor.group == "R":
            result[..., factor.q] = left[..., factor.v]
            continue
        w, x, y, z = p = q[factor.q_start : factor.q_start + 4]
        n = np.sum(p * p)
        turn = np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]]) * (2.0 / n)
        result[..., factor.q_start : factor.q_start + 4] = left[..., factor.v_start : factor.v_start + 3] @ turn
        if factor.group == "SE3":
            w, x, y, z = p / np.sqrt(n)
            rows = [
                [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
                [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
                [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
            ]
            travel = left[..., factor.v_start + 3 : factor.v_start + 6] @ np.array(rows)
            result[..., factor.q_start + 4 : factor.q_start + 7] = travel
    return result


def called(functions: Functions, term: str, state: Mapping[str, Array]) -> Array:
    """Return the values of a term in complex numbers, quaternions at unit length; t is one number."""
    values = {**state, "t": state["t"][0]}
    if "base" in functions:
        values["base"] = functions("base", values)[0]
    return np.concatenate([part.ravel() for part in functions(term, {x: values[x] for x in functions.inputs(term)})])


def moved(state: Mapping[str, Array], block: str, k: int) -> dict[str, Array]:
    """Return a state with an imaginary increment of one component."""
    result = {name: array.astype(complex) for name, array in state.items()}
    result[block][k] += 1j * IMAGINARY
    return result


def by_complex_steps(function: Any, taken: list[str], state: Mapping[str, Array]) -> Array:
    """Return the derivatives of an array function of a state in components of the arguments, (size, arguments)."""
    columns = [function(moved(state, block, k)).imag / IMAGINARY for block in taken for k in range(len(state[block]))]
    return np.stack(columns, axis=-1)


@pytest.mark.slow
@pytest.mark.long_except("pi_servo", "gear_with_backlash")
@pytest.mark.parametrize("example", SCENES)
def test_derivatives_are_those_of_complex_steps(example: str, rng: np.random.Generator) -> None:
    """Differences by the largest entry; of the Hessian also by the Jacobian's, since second derivatives of stiff forces
    cancel."""
    model, functions = model_of(example), functions_of(example)
    factors = list(model.factors)
    for name in (name for name in functions if name != "step"):
        function, state = functions[name], state_of(model, rng)
        taken, own = function.name_in(), list(model.sparsity(name).arguments)
        weights = rng.normal(size=function.size1_out(0))
        jacobian, hessian = derivatives(function, [state[block] for block in taken], weights)
        in_complex, pattern = model.in_complex((name, f"{name}_derivatives")), model.sparsity(name)

        def value(state: Mapping[str, Array], name: str = name, in_complex: Functions = in_complex) -> Array:
            return called(in_complex, name, {**state, "q": unit(factors, state["q"])})

        def gradient(
            state: Mapping[str, Array], name: str = name, in_complex: Functions = in_complex, w: Array = weights
        ) -> Array:
            """Return that of weights . function in the arguments that it takes, in components."""
            q, pattern = state["q"], model.sparsity(name)
            left = np.zeros(pattern.shape[1], complex)
            if len(pattern.rows):
                nonzeros = called(in_complex, f"{name}_derivatives", {**state, "q": unit(factors, q)})
                np.add.at(left, pattern.columns, w[pattern.rows] * nonzeros)
            parts = {block: left[place] for block, place in pattern.arguments.items()}
            if "q" in parts:
                parts["q"] = in_components(factors, q, parts["q"])
            return np.concatenate(list(parts.values()))

        assert pattern.shape[0] == len(weights)
        expected = by_complex_steps(value, taken, state)
        first = largest(jacobian - expected) / (largest(expected) or 1.0)
        sizes = {block: function.size1_in(k) for k, block in enumerate(taken)}
        places = np.concatenate([np.full(size, block in own) for block, size in sizes.items()])
        assert not hessian[~places].any(), name
        second = by_complex_steps(gradient, own, state)
        scale = max(largest(second), largest(weights @ expected)) or 1.0
        assert max(first, largest(hessian[np.ix_(places, places)] - second) / scale) <= 1e-12, name


def largest(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))


@pytest.mark.slow
@pytest.mark.long_except("pi_servo", "gear_with_backlash")
@pytest.mark.parametrize("example", SCENES)
def test_sparsity_is_exact_at_random_states(example: str, rng: np.random.Generator) -> None:
    """Parameters that are zero in the scene have random values, since products with them are nonzeros."""
    model = model_of(example)
    states = [state_of(model, rng) for _ in range(STATES)]
    batch = {name: np.stack([state[name] for state in states]) for name in states[0]}
    batch["t"] = rng.uniform(0.0, 3.0, (STATES, 1))
    values = np.broadcast_to(model.parameter_array(), batch["p"].shape)
    batch["p"] = np.where(values == 0.0, 1.0, values) * rng.uniform(0.5, 1.0, values.shape)
    if example == "active_quarter_car":  # random states do not bring its damper to the upper limit
        batch["p"][::2, list(model.parameters).index("semi")] = 1e5
    for name in (name for name in functions_of(example) if name != "step"):
        arguments: dict[str, Any] = {**given(model, batch, name), "t": batch["t"][:, 0]}
        weights = rng.normal(size=(STATES, model.sparsity(name).shape[0]))
        for order, values in (
            (1, model.derivatives(name, **arguments, sparse=True)),
            (2, model.hessian(name, weights, **arguments, sparse=True)),
        ):
            pattern, zero = model.sparsity(name, order), ~np.any(values != 0.0, axis=0)
            assert not zero.any(), (name, order, pattern.rows[zero], pattern.columns[zero])
