"""Checks that suites of the equations share: partials against complex steps, energies against powers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.symbolic.evaluate import evaluate as evaluate_refs
from eomgen.system.system import System
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.states import derivative, jacobian, on_base, random_states


def states_of(system: System, rng: np.random.Generator, count: int = 4) -> dict[str, Array]:
    """Return random states, with states of the scene and multipliers, on the base as its law has it."""
    state = random_states(system, count, rng)
    for block, size in (("z", system.nz), ("lam", len(system.multipliers))):
        if size:
            state[block] = rng.normal(size=(count, size))
    return on_base(tape_evaluator(system), state) if "base" in system.functions else state


def check_partials(system: System, state: dict[str, Array], tolerance: float = 1e-11, floor: float = 0.0) -> None:
    """Compare K, C and M with complex steps of the residual."""
    evaluate = tape_evaluator(system)
    found = evaluate("partials", state)
    for block, name in (("q", "K"), ("v", "C"), ("a", "M")):
        expected = jacobian(evaluate, system.factors, "residual", "r", state, block)
        assert relative_error(found[name], expected, 2, floor) <= tolerance, name


def check_powers(system: System, state: dict[str, Array], tolerance: float = 1e-11) -> Array:
    """Compare the rate of the energy along v and a with the powers, and return the energies, a row for each state."""
    evaluate = tape_evaluator(system)
    energies = evaluate("energy", state)["energy"]
    rates = {"q": state["v"], "v": state["a"], "t": np.ones((len(state["v"]), 1))}
    rate = derivative(evaluate, system.factors, "energy", state, rates)["energy"][:, :2]
    power = energies[:, 2:]
    scale = np.sum(np.abs(rate), axis=1) + np.sum(np.abs(power), axis=1)
    assert np.max(np.abs(np.sum(rate, axis=1) - np.sum(power, axis=1)) / scale) <= tolerance
    assert energies[:, 0].min() > 0.0
    return energies


def output_values(system: System, names: Sequence[str] = (), seed: int = 3) -> dict[str, Array]:
    """Return outputs of functions (all without names) at a state near the start, matrices whole."""
    random, q = np.random.default_rng(seed), np.array(system.initial_q)
    for factor in system.factors:
        part = q[factor.q]
        part += 0.1 * random.standard_normal(len(part))
        if factor.group in ("SO3", "SE3"):
            part[:4] /= np.linalg.norm(part[:4])
    sizes = {"v": system.nv, "a": system.nv, "lam": len(system.multipliers), "base": 25}
    inputs = {name: random.standard_normal(size) for name, size in sizes.items()}
    inputs |= {"q": q, "t": np.array([0.3]), "p": np.array([item.value for item in system.parameters])}
    found: dict[str, Array] = {}
    for name in names or system.functions:
        for block in system.functions[name].outputs:
            numbers = np.array(evaluate_refs(system.tape, block.refs, inputs), dtype=float)
            if name == "iteration":
                places = np.array(system.patterns[block.name], dtype=int).reshape(-1, 2)
                whole = np.zeros((max(system.nv, 1 + np.max(places, initial=0)),) * 2)
                whole[tuple(places.T)] = numbers
                numbers = whole
            found[f"{name}.{block.name}"] = numbers
    return found


def check_same_values(one: System, other: System, names: Sequence[str] = ()) -> dict[str, Array]:
    """Compare all outputs of two systems to rounding, and return those of the second."""
    found, expected = output_values(one, names), output_values(other, names)
    assert found.keys() == expected.keys()
    for name, numbers in expected.items():
        largest = np.max(np.abs(numbers), initial=0.0)
        np.testing.assert_allclose(found[name], numbers, rtol=1e-12, atol=1e-12 * largest, err_msg=name)
    return expected
