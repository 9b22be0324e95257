"""Generalized momenta and what changes them: Lagrange's equations along motions, against the residual."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.lie import product
from eomgen.scene.scene import Scene
from tests.mechanics.test_linearization import drone, state_of
from tests.oracles.evaluation import Array, relative_error
from tests.oracles.random_scenes import random_scene, with_loads
from tests.oracles.robots import panda
from tests.oracles.states import on_base

STEP = 1e-5
TERMS = ["residual", "momenta"]


def differences(scene: Scene, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return dp/dt - ad_v^T p - (dT/dq + Q) along motions with given accelerations, by differences of order 4, and the
    residual without multipliers, which says the same by virtual work."""
    system, evaluate, state = state_of(scene, TERMS, rng)

    def moved(sign: float) -> Array:
        change = sign * STEP
        there = {
            **state,
            "q": product.update(system.factors, state["q"], change * state["v"]),
            "v": state["v"] + change * state["a"],
            "t": state["t"] + change,
        }
        if scene.base is not None:
            there = on_base(evaluate, there)
        return np.asarray(evaluate("momenta", there)["momentum"], float)

    rate = (8 * (moved(1) - moved(-1)) - (moved(2) - moved(-2))) / (12 * STEP)
    here = evaluate("momenta", state)
    brackets = product.bracket_matrix(system.factors, state["v"])
    turned = np.einsum("nji,nj->ni", brackets, here["momentum"])
    without = {**state, "lam": 0.0 * state["lam"]} if system.multipliers else state
    return rate - turned - here["momentum_rate"], np.asarray(evaluate("residual", without)["r"], float)


SCENES = {
    "tree": drone,
    "loop": lambda: drone(looped=True),
    "absolute": lambda: drone("absolute", looped=True),
    "arm": panda,
    "beam": lambda: eomgen.load("examples/elastic_pendulum/scene.toml"),
    "beam_on_a_crank": lambda: eomgen.load("examples/elastic_slider_crank/scene.toml"),
}


@pytest.mark.parametrize("name", SCENES)
def test_lagrange_s_equations_are_the_residual(name: str, rng: np.random.Generator) -> None:
    found, expected = differences(SCENES[name](), rng)
    assert relative_error(found, expected, 1) <= 1e-8


@pytest.mark.parametrize("seed", range(4))
def test_random_trees(seed: int, rng: np.random.Generator) -> None:
    found, expected = differences(with_loads(random_scene(seed), seed), rng)
    assert relative_error(found, expected, 1) <= 1e-8
