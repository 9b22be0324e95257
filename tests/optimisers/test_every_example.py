"""Functions for CasADi of some examples: Jacobians and Hessians against complex steps of the C, and
sparsity at 1000 random states, as a table too."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest

import eomgen
from eomgen.compiled.functions import Functions
from eomgen.lie.product import Factor
from tests.mechanics.test_argument_derivatives import given, state_of
from tests.optimisers.test_casadi import derivatives

EXAMPLES = Path(__file__).parents[2] / "examples"
Array = np.ndarray
EVERY = sorted(path.parent.relative_to(EXAMPLES).as_posix() for path in EXAMPLES.rglob("scene.toml"))
#: Examples that have all groups, rows, states, inputs, beams and laws by cases; the table is of every example.
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


class Deviation(NamedTuple):
    """Nonzeros of a function's Jacobian and Hessian, and their largest differences from complex steps of the C, by the
    largest entry; of the Hessian also by the Jacobian's, since second derivatives of stiff forces cancel."""

    function: str
    nonzeros: tuple[int, int]
    differences: tuple[float, float]


def deviations(example: str, rng: np.random.Generator) -> Iterator[Deviation]:
    """Yield the rows of all functions of an example but its step."""
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
        sizes_of = (len(pattern.rows), len(model.sparsity(name, 2).rows))
        yield Deviation(name, sizes_of, (first, largest(hessian[np.ix_(places, places)] - second) / scale))


def largest(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))


@pytest.mark.slow
@pytest.mark.long_except("pi_servo", "gear_with_backlash")
@pytest.mark.parametrize("example", SCENES)
def test_derivatives_are_those_of_complex_steps(example: str, rng: np.random.Generator) -> None:
    for row in deviations(example, rng):
        assert max(row.differences) <= 1e-12, row


@pytest.mark.slow
@pytest.mark.long_except("pi_servo", "gear_with_backlash")
@pytest.mark.parametrize("example", SCENES)
def test_sparsity_is_exact_at_random_states(example: str, rng: np.random.Generator) -> None:
    for name, order, zero in always_zero(example, rng):
        pattern = model_of(example).sparsity(name, order)
        assert not zero.any(), (name, order, pattern.rows[zero], pattern.columns[zero])


def always_zero(example: str, rng: np.random.Generator, count: int = STATES) -> Iterator[tuple[str, int, Array]]:
    """Yield which nonzeros of Jacobian and Hessian are zero at all of ``count`` states, by function and order.

    Parameters that are zero in the scene have random values, since products with them are nonzeros.
    """
    model = model_of(example)
    states = [state_of(model, rng) for _ in range(count)]
    batch = {name: np.stack([state[name] for state in states]) for name in states[0]}
    batch["t"] = rng.uniform(0.0, 3.0, (count, 1))
    values = np.broadcast_to(model.parameter_array(), batch["p"].shape)
    batch["p"] = np.where(values == 0.0, 1.0, values) * rng.uniform(0.5, 1.0, values.shape)
    in_rare_cases(example, list(model.parameters), batch, rng)
    for name in (name for name in functions_of(example) if name != "step"):
        arguments: dict[str, Any] = {**given(model, batch, name), "t": batch["t"][:, 0]}
        for order in (1, 2):
            if order == 1:
                values = model.derivatives(name, **arguments, sparse=True)
            else:
                weights = rng.normal(size=(count, model.sparsity(name).shape[0]))
                values = model.hessian(name, weights, **arguments, sparse=True)
            yield name, order, ~np.any(values != 0.0, axis=0)


def in_rare_cases(example: str, parameters: list[str], batch: dict[str, Array], rng: np.random.Generator) -> None:
    """Move half of the states to cases of a law that random states do not reach: a damper at its upper limit; a tyre
    within 2 mm of its first touch, on a bump."""
    p, half = dict(zip(parameters, batch["p"].T, strict=True)), slice(None, None, 2)
    if example == "active_quarter_car":
        p["semi"][half] = 1e5
    if example == "quarter_car_on_bump":
        along = rng.uniform(0.1, 0.9, len(batch["t"]))
        batch["t"][half, 0] = ((1.0 + along) / p["speed"])[half]
        road = p["bump_height"] / 2.0 * (1.0 - np.cos(2.0 * np.pi * along))
        at_touch = (240.0 + 36.0) * 9.81 / 160000.0 + road
        batch["q"][half, 0] = (at_touch + rng.uniform(-3e-3, 3e-3, len(road)))[half]


@pytest.mark.long
def test_derivatives_of_panda_are_those_of_casadis_symbols(rng: np.random.Generator) -> None:
    """Of forward dynamics by articulated bodies and of inverse dynamics by the recursion of Newton and Euler, in SX."""
    pytest.importorskip("pinocchio")
    from benchmarks.optimisers import Robot  # needs Pinocchio
    from benchmarks.robots import ROBOTS, driven, pinocchio_model, scene

    described = scene(ROBOTS["panda"])
    arm = Robot(pinocchio_model(ROBOTS["panda"], described).model)
    own = eomgen.casadi(driven(described), ["forward_dynamics", "inverse_dynamics"], profile="quick")
    q, v, a = (ca.SX.sym(name, 7) for name in "qva")
    native = {
        "forward_dynamics": ca.Function("native", [q, v, a], [arm.forward_dynamics(q, v, a)]),
        "inverse_dynamics": ca.Function("native", [q, v, a], [arm.inverse_dynamics(q, v, a)]),
    }
    for name, function in native.items():
        for _ in range(3):
            point, weights = [rng.normal(size=7) for _ in range(3)], rng.normal(size=7)
            given_points = point if name == "forward_dynamics" else [*point, np.zeros(7)]
            found = derivatives(own[name], given_points, weights)
            for one, other in zip(found, derivatives(function, point, weights), strict=True):
                part = one[tuple(slice(size) for size in other.shape)]
                assert np.max(np.abs(part - other)) <= 1e-12 * np.max(np.abs(other)), name


def main(words: list[str]) -> None:
    """Write a table of all examples, or of those that are named, to the file that is named first."""
    lines = [
        "`python -m tests.optimisers.test_every_example FILE [EXAMPLES]`, profile quick: one random state for"
        f" differences from complex steps of the C, {STATES} for sparsity.",
        "",
        "| example | functions | nonzeros of Jacobians | of Hessians | Jacobians differ by | Hessians by | always 0 |",
        "|---|---|---|---|---|---|---|",
    ]
    for example in words[1:] or EVERY:
        rng = np.random.default_rng(37)
        rows = list(deviations(example, rng))
        zeros = sum(int(zero.sum()) for *_, zero in always_zero(example, rng))
        nonzeros, differences = (np.array([row[k] for row in rows]) for k in (1, 2))
        counted = [*map(str, nonzeros.sum(axis=0)), *(f"{x:.1e}" for x in differences.max(axis=0)), str(zeros)]
        lines.append(f"| {' | '.join([example, str(len(rows)), *counted])} |")
        print(lines[-1], flush=True)
        Path(words[0]).write_text("\n".join([*lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
