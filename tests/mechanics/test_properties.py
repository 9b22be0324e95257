"""What must hold for every tree: checked on random ones, against direct kinematics where a second way exists."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eomgen.formula.nodes import Formula, Number
from eomgen.mechanics.derive import derive
from eomgen.scene.bodies.model import Body
from eomgen.scene.scene import Scene
from eomgen.system.signals import Parameter
from tests.mechanics.checks import states_of
from tests.oracles import direct_kinematics
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.formulas import parameter, value_of
from tests.oracles.pinocchio_oracle import oracle_of_tree
from tests.oracles.random_scenes import random_scene, with_base, with_loads
from tests.oracles.states import on_base, random_states

STATES = 4
SEPARATED = ["mass", "coupling", "force", "inverse_dynamics", "forward_dynamics", "residual", "base_motion"]
seeds = st.integers(min_value=0, max_value=10**6)
few = settings(max_examples=12, deadline=None, derandomize=True)


def loaded_scene(seed: int) -> Scene:
    """Return a tree of 1 to 8 links with everything acting on it, on a moving base for odd seeds, partly with
    parameters."""
    scene = with_loads(random_scene(seed, 1 + seed % 8, tunable=0.4 * (seed % 3 == 0)), seed)
    return with_base(scene, seed) if seed % 2 else scene


def gravity_of(scene: Scene) -> list[float]:
    return [value_of(item, {}) for item in scene.gravity]


@pytest.mark.slow
@settings(few, max_examples=5)
@given(seeds)
def test_mass_matrix_is_symmetric_positive_and_that_of_the_bodies(seed: int) -> None:
    scene = random_scene(seed, 1 + seed % 8, tunable=0.4 * (seed % 3 == 0))
    system = derive(scene, ["mass"])
    state = random_states(system, STATES, np.random.default_rng(seed))
    M = tape_evaluator(system)("mass", state)["M"]
    assert np.array_equal(M, np.swapaxes(M, -1, -2)), "M is one half written twice"
    assert np.linalg.eigvalsh(M).min() > 0.0, "kinetic energy is positive"
    assert relative_error(M, direct_kinematics.mass_matrix(scene, system.factors, state["q"]), 2) <= 1e-12


@pytest.mark.slow
@few
@given(seeds)
def test_random_trees_against_pinocchio(seed: int) -> None:
    scene = random_scene(seed, 1 + seed % 8)
    system = derive(scene, [*SEPARATED, "partials"])
    evaluate, oracle = tape_evaluator(system), oracle_of_tree(scene)
    state = random_states(system, STATES, np.random.default_rng(seed))
    assert relative_error(evaluate("mass", state)["M"], oracle.mass(state), 2) <= 1e-12
    assert relative_error(evaluate("coupling", state)["h"], oracle.coupling(state), floor=1e-3) <= 1e-12
    assert relative_error(evaluate("force", state)["Q"], oracle.weight(state), floor=1e-2) <= 1e-12
    assert relative_error(evaluate("inverse_dynamics", state)["tau"], oracle.inverse_dynamics(state)) <= 1e-12
    if {"cylindrical", "universal", "planar"} & {joint.type for joint in scene.joints}:
        # Pinocchio's partials leave out that motion subspaces change; test_partials_and_powers has all joints
        return
    by_q, by_v = oracle.partials(state)
    found = evaluate("partials", state)
    assert relative_error(found["K"], by_q, 2, floor=1e-2) <= 1e-12
    assert relative_error(found["C"], by_v, 2, floor=1e-2) <= 1e-12


@pytest.mark.slow
@few
@given(seeds)
def test_separated_terms_are_inverse_dynamics_which_forward_dynamics_inverts(seed: int) -> None:
    system = derive(loaded_scene(seed), SEPARATED)
    evaluate, state = tape_evaluator(system), states_of(system, np.random.default_rng(seed), STATES)
    M, Q = evaluate("mass", state)["M"], evaluate("force", state)["Q"]
    parts = np.einsum("kij,kj->ki", M, state["a"]) + evaluate("coupling", state)["h"] - Q
    if "base" in system.functions:
        parts = parts + evaluate("base_motion", state)["b"]
    tau = evaluate("inverse_dynamics", state)["tau"]
    assert relative_error(parts, tau) <= 1e-12
    assert np.array_equal(tau, evaluate("residual", state)["r"])
    vdot = evaluate("forward_dynamics", state)["vdot"]
    remaining = np.linalg.norm(evaluate("inverse_dynamics", {**state, "a": vdot})["tau"], axis=1)
    scale = np.linalg.norm(M, axis=(1, 2)) * np.linalg.norm(vdot, axis=1) + np.linalg.norm(Q, axis=1)
    assert np.max(remaining / scale) <= 1e-12


def with_inertias_as_parameters(scene: Scene) -> Scene:
    """Return the scene with every inertial number a tunable parameter, so that nothing can be grouped."""
    parameters: list[Parameter] = []

    def made(formula: Formula) -> Formula:
        assert isinstance(formula, Number)
        parameters.append(Parameter(f"i{len(parameters)}", formula.value, tunable=True))
        return parameter(parameters[-1].name)

    bodies = tuple(
        Body(body.name, made(body.mass), tuple(map(made, body.center_of_mass)), tuple(map(made, body.inertia)))  # type: ignore[arg-type]
        for body in scene.bodies
    )
    return replace(scene, bodies=bodies, parameters=tuple(parameters))


@pytest.mark.slow_cases("3", "5", "6", "7")
@pytest.mark.parametrize("seed", range(8))
def test_grouping_changes_no_generalized_force(seed: int) -> None:
    scene = with_base(with_loads(random_scene(seed, 1 + seed), seed), seed)
    terms = [*SEPARATED, "partials"]
    system, ungrouped = derive(scene, terms), derive(with_inertias_as_parameters(scene), terms)
    state = random_states(ungrouped, STATES, np.random.default_rng(seed))
    evaluate, other = tape_evaluator(system), tape_evaluator(ungrouped)
    state = on_base(evaluate, state)
    assert system.counts["inverse_dynamics"].flops < ungrouped.counts["inverse_dynamics"].flops
    for term in [*SEPARATED[:4], "base_motion", "partials"]:
        found, expected = evaluate(term, state), other(term, state)
        for name, value in found.items():
            assert relative_error(value, expected[name], value.ndim - 1) <= 1e-12, f"{term} {name}"


def test_weight_is_that_of_every_centre_of_mass(rng) -> None:
    for seed in range(6):
        scene = random_scene(seed, 5, tunable=0.3)
        system = derive(scene, ["force"])
        state = random_states(system, STATES, rng)
        expected = direct_kinematics.weight(scene, system.factors, state["q"], gravity_of(scene))
        assert relative_error(tape_evaluator(system)("force", state)["Q"], expected) <= 1e-12
