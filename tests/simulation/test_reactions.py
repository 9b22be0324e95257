"""Reactions along runs: outputs get the accelerations and multipliers of their rows."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.scene.load import from_data
from tests.oracles.placed_loops import four_bar

OUTPUTS = {
    "pin": {"reaction_force": "closure"},
    "foot": {"reaction_force": "support"},
    "drive": {"reaction_force": "drive"},
    "coupler": {"formula": [f"acceleration.middle[{k}]" for k in range(3)]},
    "rocker": {"formula": [f"acceleration.rocker[{k}]" for k in range(3)]},
    "crank": {"formula": [f"acceleration.crank[{k}]" for k in range(3)]},
}
MASSES = {"crank": 0.2, "coupler": 0.7, "rocker": 0.6}
GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    data = four_bar("spherical")
    data["points"] = {
        "crank": {"body": "crank", "position": [0.05, 0, 0]},
        "middle": {"body": "coupler", "position": [0.175, 0, 0]},
        "rocker": {"body": "rocker", "position": [0.15, 0, 0]},
    }
    return eomgen.build(from_data(data | {"outputs": OUTPUTS}), profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "generalized_alpha_index3", "rosenbrock", "lsrt2"])
def test_rows_of_a_run_are_in_balance(model: eomgen.Model, method: str) -> None:
    """The whole linkage, and the rocker alone: forces at the ground and at the pin are mass times acceleration."""
    solution = model.simulate(0.1, 1e-4, method=method)
    found = solution.outputs
    forces = {name: mass * (found[name] - GRAVITY) for name, mass in MASSES.items()}
    scale = np.abs(forces["rocker"]).max()
    assert np.abs(found["pin"]).max() > scale / 10
    assert np.abs(found["drive"] + found["foot"] - sum(forces.values())).max() <= 1e-9 * scale
    assert np.abs(found["pin"] + found["foot"] - forces["rocker"]).max() <= 1e-9 * scale


def test_outputs_of_a_state_have_the_multipliers_of_its_motion(model: eomgen.Model) -> None:
    solution = model.simulate(0.05, 1e-4)
    state = solution.at(0.03)
    row = int(np.argmin(np.abs(solution.t - 0.03)))
    expected = solution.outputs["pin"][row]
    held = model.outputs(
        solution.q[row], solution.v[row], solution.a[row], solution.t[row], multipliers=solution.multipliers[row]
    )
    assert np.array_equal(held["pin"], expected)
    free = model.outputs(solution.q[row], solution.v[row])
    assert free["pin"] == pytest.approx(expected, rel=1e-4)
    assert solution.outputs_at(0.03)["pin"] == pytest.approx(expected, rel=1e-4)
    assert model.outputs(state.q, state.v, state.a)["pin"] == pytest.approx(expected, rel=1e-4)


def test_a_simulator_has_the_reactions_of_its_step(model: eomgen.Model) -> None:
    run = model.start(step=1e-4)
    run.advance(0.02)
    solution = model.simulate(0.02, 1e-4)
    assert run.outputs["pin"] == pytest.approx(solution.outputs["pin"][-1], rel=1e-9)
