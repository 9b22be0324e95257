"""Base-motion terms against a tree on a free-flyer whose pose, twist and acceleration are prescribed, and the base's
own law."""

from __future__ import annotations

from functools import partial

import numpy as np
import pinocchio as pin
import pytest

from eomgen.mechanics.derive import derive
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.pinocchio_oracle import PinocchioOracle, oracle_of_tree
from tests.oracles.random_scenes import random_scene, with_base
from tests.oracles.robots import panda
from tests.oracles.states import random_states, random_unit_quaternions

TERMS = ["coupling", "base_motion", "force", "inverse_dynamics", "forward_dynamics"]
STATES = 20
SCENES = {"panda": panda, **{f"tree {seed}": partial(random_scene, seed, 5) for seed in range(6)}}


def prescribed(count: int, rng: np.random.Generator) -> Array:
    """Return random base structs: pose, twist and its derivative without any law behind them."""
    return np.concatenate([random_unit_quaternions(rng, count), rng.uniform(-2.0, 2.0, size=(count, 15))], axis=1)


def on_carrier(state: dict[str, Array]) -> dict[str, Array]:
    """Return the state of the tree and its carrier together."""
    base = state["base"]
    return {
        "q": np.concatenate([base[:, :7], state["q"]], axis=1),
        "v": np.concatenate([base[:, 7:13], state["v"]], axis=1),
        "a": np.concatenate([base[:, 13:19], state["a"]], axis=1),
    }


def without_gravity(oracle: PinocchioOracle) -> PinocchioOracle:
    oracle.model.gravity.linear = np.zeros(3)
    return oracle


@pytest.mark.parametrize("name", SCENES)
def test_every_term_is_what_a_prescribed_carrier_adds(name: str, rng: np.random.Generator) -> None:
    scene = SCENES[name]()
    system = derive(with_base(scene, 1), TERMS)
    evaluate = tape_evaluator(system)
    state = {**random_states(system, STATES, rng), "base": prescribed(STATES, rng)}
    carrier = oracle_of_tree(scene, pin.Inertia.Random())
    expected = carrier.inverse_dynamics(on_carrier(state))[:, 6:]
    assert relative_error(evaluate("force", state)["Q"], carrier.weight(on_carrier(state))[:, 6:]) <= 1e-12
    assert relative_error(evaluate("inverse_dynamics", state)["tau"], expected) <= 1e-12
    vdot = evaluate("forward_dynamics", state)["vdot"]
    at_rest = carrier.inverse_dynamics(on_carrier({**state, "a": vdot}))[:, 6:]
    assert np.abs(at_rest).max() <= 1e-11 * np.abs(expected).max()
    carried = without_gravity(carrier).inverse_dynamics(on_carrier(state))[:, 6:]
    fixed = without_gravity(oracle_of_tree(scene)).inverse_dynamics(state)
    assert relative_error(evaluate("base_motion", state)["b"], carried - fixed) <= 1e-12
