"""Joints that follow others, against the same tree without: the reduced terms are G^T (..) G with q = G q_reduced +
c."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from tests.oracles.constrained import constraint
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import value_of
from tests.oracles.random_scenes import random_scene, with_base, with_loads, with_mimics
from tests.oracles.states import derivative, jacobian, on_base, random_states

STATES = 4
VECTORS = {"coupling": "h", "force": "Q", "inverse_dynamics": "tau", "residual": "r"}
TERMS = ["mass", *VECTORS, "forward_dynamics", "partials", "energy", "poses", "twists", "jacobians"]


def reduction(scene: Scene, full: System, reduced: System) -> tuple[Array, Array, Array]:
    """Return G of the configuration, c, and G of the velocity, by following each joint's leader to the end."""
    joints = {joint.name: joint for joint in scene.joints}
    wanted = {factor.name: factor for factor in reduced.factors}
    G, c, G_v = np.zeros((full.nq, reduced.nq)), np.zeros(full.nq), np.zeros((full.nv, reduced.nv))
    for factor in full.factors:
        name, multiplier, offset = factor.name, 1.0, 0.0
        while (mimic := joints[name].mimic) is not None:
            offset += multiplier * value_of(mimic.offset, {})
            multiplier *= value_of(mimic.multiplier, {})
            name = mimic.joint
        leader = wanted[name]
        for k in range(factor.q_size):
            G[factor.q_start + k, leader.q_start + k], c[factor.q_start + k] = multiplier, offset
        for k in range(factor.v_size):
            G_v[factor.v_start + k, leader.v_start + k] = multiplier
    return G, c, G_v


def check_reduced(scene: Scene, rng: np.random.Generator) -> tuple[System, Mapping[str, Array]]:
    """Compare every term of a scene whose joints follow others with the projection of the same scene's in which none
    does."""
    independent = replace(scene, joints=tuple(_independent(joint) for joint in scene.joints))
    full, reduced = derive(independent, TERMS), derive(scene, TERMS)
    assert reduced.nv < full.nv
    at_full, at_reduced = tape_evaluator(full), tape_evaluator(reduced)
    G, c, G_v = reduction(scene, full, reduced)
    state = random_states(reduced, STATES, rng)
    state = on_base(at_reduced, state) if scene.base is not None else state
    other = {**state, "q": state["q"] @ G.T + c, "v": state["v"] @ G_v.T, "a": state["a"] @ G_v.T}
    M = at_reduced("mass", state)["M"]
    assert relative_error(M, G_v.T @ at_full("mass", other)["M"] @ G_v, 2) <= 1e-12
    for name, block in VECTORS.items():
        expected = at_full(name, other)[block] @ G_v
        assert relative_error(at_reduced(name, state)[block], expected, floor=1e-3) <= 1e-12, name
    found, expected = at_reduced("partials", state), at_full("partials", other)
    for name in "KCM":
        assert relative_error(found[name], G_v.T @ expected[name] @ G_v, 2, floor=1e-2) <= 1e-12, name
    for name, block in (("energy", "energy"), ("poses", "pose"), ("twists", "twist")):
        expected_block = at_full(name, other)[block]
        assert relative_error(at_reduced(name, state)[block], expected_block, expected_block.ndim - 1) <= 1e-12, name
    (found_J,), (full_J,) = at_reduced("jacobians", state).values(), at_full("jacobians", other).values()
    assert relative_error(found_J, full_J @ G_v, 3) <= 1e-12
    vdot = at_reduced("forward_dynamics", state)["vdot"]
    assert np.abs(at_reduced("residual", {**state, "a": vdot})["r"]).max() <= 1e-9 * np.abs(M).max() * (
        1 + np.abs(vdot).max()
    )
    for block, name in (("q", "K"), ("v", "C"), ("a", "M")):
        assert (
            relative_error(found[name], jacobian(at_reduced, reduced.factors, "residual", "r", state, block), 2)
            <= 1e-11
        ), name
    return reduced, state


def _independent(joint: Joint) -> Joint:
    return (
        joint if joint.mimic is None else replace(joint, mimic=None, initial_position=(0.0,), initial_velocity=(0.0,))
    )


@pytest.mark.slow_except("11")
@pytest.mark.parametrize("seed", [1, 3, 4, 5, 10, 11])
def test_a_random_tree_against_its_projection(seed: int, rng) -> None:
    """Chains of followers, leaders after and beside them, rotor inertias, springs, dampers, efforts, a moving base."""
    scene = with_mimics(with_loads(random_scene(seed, 6), seed), seed)
    assert sum(joint.mimic is not None for joint in scene.joints) >= 2
    check_reduced(with_base(scene, seed) if seed % 2 else scene, rng)


@pytest.mark.slow_except("distance")
@pytest.mark.parametrize("kind", ["distance", "point_on_line", "rolling"])
def test_loops_feel_followers(kind: str, rng) -> None:
    """B and the bias of a constraint between moving bodies, by complex step along velocities of the leaders."""
    scene = with_base(with_mimics(random_scene(5, 6), 5), 5)
    scene = replace(scene, constraints=(constraint(rng, kind, scene.bodies[1].name, scene.bodies[-1].name),))
    system = derive(
        scene, ["constraint", "constraint_jacobian", "constraint_velocity", "constraint_bias", "velocity_partials"]
    )
    evaluate = tape_evaluator(system)
    state = on_base(evaluate, random_states(system, STATES, rng))
    rows = system.holonomic
    B = evaluate("constraint_jacobian", state)["B"]
    by_q = jacobian(evaluate, system.factors, "constraint", "Phi", state, "q")
    assert relative_error(B[:, :rows], by_q, 2) <= 1e-12
    assert relative_error(B, jacobian(evaluate, system.factors, "constraint_velocity", "w", state, "v"), 2) <= 1e-12
    Z = jacobian(evaluate, system.factors, "constraint_velocity", "w", state, "q")
    assert relative_error(evaluate("velocity_partials", state)["Z"], Z, 2) <= 1e-12
    rates = {"q": state["v"], "t": np.ones((STATES, 1))}
    expected = derivative(evaluate, system.factors, "constraint_velocity", state, rates)["w"]
    assert relative_error(evaluate("constraint_bias", state)["g"], expected) <= 1e-10
