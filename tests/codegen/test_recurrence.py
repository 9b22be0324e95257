"""The recurrence of a motion: inverse and forward dynamics give the same coefficients, and inverse dynamics fewer
products."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from benchmarks.taylor_and_heyoka import chain
from eomgen.codegen.series.recurrence import NEXT, Recurrence
from eomgen.mechanics.derive import derive
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import Op
from eomgen.symbolic.series import KEPT, LEFT, ORDER, PREVIOUS, RIGHT, SUMS
from eomgen.system.system import System
from tests.integrators.test_taylor import SCENES, controlled_scene, flyer_scene

Array = NDArray[np.float64]
LAST = 7


def coefficients(recurrence: Recurrence, start: Mapping[str, Array]) -> dict[str, Array]:
    """Return the coefficients of q, v and z by rows, taken on the tape."""
    series, rates = recurrence.series, recurrence.rates
    tape, size = series.tape, len(series.left)
    blocks = [name for name in ("q", "v", "z") if rates.get(name)]
    left, right = (np.zeros((LAST, size)) for _ in range(2))
    left[0], right[0] = (evaluate(tape, [term.value for term in side], start) for side in (series.left, series.right))
    kept = evaluate(tape, series.kept, start)
    previous = evaluate(tape, [term.value for term in series.previous], start)
    found = {name: [start[name], evaluate(tape, [term.value for term in rates[name]], start)] for name in blocks}
    for k in range(1, LAST):
        sums = sum((left[i] * right[k - i] for i in range(1, k)), np.zeros(size))
        known = {NEXT[name]: found[name][k] for name in blocks} | {"t_k": np.array([1.0 if k == 1 else 0.0])}
        known |= {SUMS: sums, LEFT: left[0], RIGHT: right[0], KEPT: kept}
        known |= {PREVIOUS: previous, ORDER: np.array([k, 1 / k, 1 / (k + 1), 1.0])}
        left[k], right[k] = (
            evaluate(tape, [term.next for term in side], known) for side in (series.left, series.right)
        )
        previous = evaluate(tape, [term.next for term in series.previous], known)
        for name in blocks:
            found[name].append(evaluate(tape, [term.next for term in rates[name]], known) / (k + 1))
    return {name: np.array(rows) for name, rows in found.items()}


def start_of(system: System) -> dict[str, Array]:
    rng = np.random.default_rng(3)
    q = np.array(system.initial_q) + 0.1 * rng.standard_normal(system.nq)
    for factor in system.factors:
        if factor.group != "R":
            part = slice(factor.q_start, factor.q_start + 4)
            q[part] /= np.linalg.norm(q[part])
    held = {"u": np.zeros(system.nu), "followed": np.ones(system.nu), "t": np.array([0.3])}
    parameters = np.array([item.value for item in system.parameters])
    return held | {"q": q, "v": rng.standard_normal(system.nv), "z": rng.standard_normal(system.nz), "p": parameters}


def same(first: Mapping[str, Array], second: Mapping[str, Array]) -> None:
    for name, rows in first.items():
        for row, other in zip(rows, second[name], strict=True):
            assert np.abs(row - other).max() <= 1e-11 * (1 + np.abs(other).max())


@pytest.mark.parametrize("name", SCENES)
def test_inverse_and_forward_dynamics_give_the_same_series(name: str) -> None:
    system = derive(SCENES[name]())
    start = start_of(system)
    ways = [coefficients(Recurrence(system, by_inverse=by_inverse), start) for by_inverse in (True, False)]
    same(*ways)
    assert np.abs(ways[0]["v"][LAST]).max() > 1e-6


def test_accelerations_may_be_divided_by_what_moves() -> None:
    system = derive(flyer_scene())
    tape, q = system.tape, system.tape.input("q", 7)
    divisor = tape.add(tape.constant(2.0), tape.call(Op.COS, q))
    functions = dict(system.functions)
    for name in ("residual", "mass"):
        [block] = functions[name].outputs
        refs = tuple(tape.div(ref, divisor) for ref in block.refs)
        functions[name] = replace(functions[name], outputs=(replace(block, refs=refs),))
    divided = replace(system, functions=functions)
    start = start_of(system)
    same(
        coefficients(Recurrence(divided, by_inverse=True), start),
        coefficients(Recurrence(system, by_inverse=False), start),
    )


def test_a_residual_that_is_not_affine_is_no_way_to_accelerations() -> None:
    system = derive(controlled_scene())
    tape, a = system.tape, system.tape.input("a", 0)
    [block] = system.functions["residual"].outputs
    square = replace(system.functions["residual"], outputs=(replace(block, refs=(tape.mul(a, a), *block.refs[1:])),))
    with pytest.raises(ValueError, match="the residual is not affine in the accelerations"):
        Recurrence(replace(system, functions={**system.functions, "residual": square}), by_inverse=True)


#: Products, and operations of coefficient k, at most.
BUDGETS = {2: (10, 54), 6: (54, 396)}


@pytest.mark.parametrize("links", BUDGETS)
def test_budgets_of_planar_chains(links: int) -> None:
    recurrence = Recurrence(derive(chain(links)), by_inverse=True)
    series = recurrence.series
    terms = [*series.left, *series.right, *(term for terms in recurrence.rates.values() for term in terms)]
    products, operations = BUDGETS[links]
    assert len(series.left) <= products
    assert series.tape.counts([term.next for term in terms]).flops <= operations


def test_waves_of_constant_frequency_cost_no_product() -> None:
    """x'' = x - x^3 + cos(1.2 t + 0.3) + sin(0.7 t): the square and the cube are products, waves are not."""
    builder = eomgen.SceneBuilder("oscillator", gravity=[0, 0, 0])
    builder.body("mass", 1.0)
    builder.joint("slide", "prismatic", "base", "mass", axis=[1, 0, 0])
    builder.effort("spring", "slide", "q.slide - q.slide**3 + cos(1.2 * t + 0.3) + sin(0.7 * t)")
    series = Recurrence(derive(builder.build()), by_inverse=True).series
    assert len(series.left) == 2 and len(series.previous) == 4


@pytest.mark.slow
def test_without_the_inertia_matrix_forward_dynamics_serves() -> None:
    full = eomgen.build(flyer_scene(), method="taylor")
    lean = eomgen.build(flyer_scene(), terms=["forward_dynamics"], method="taylor")
    first, second = (made.simulate(0.5, 0.1, method="taylor", tolerance=1e-13) for made in (full, lean))
    assert second.success, second.message
    assert np.abs(first.q - second.q).max() < 1e-12
