"""Exact partials of the residual against complex step and the tape's own differentiation, with everything that can
act."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from eomgen.symbolic.calculus.configuration import configuration_seeds
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.evaluate import evaluate as evaluate_refs
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.tape import ONE
from tests.mechanics.checks import states_of
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.random_scenes import random_scene, with_base, with_loads

STATES = 5


def scene_of(seed: int) -> Scene:
    """Return a tree with springs, dampers, actuators and formula forces; every second one on a moving base."""
    scene = with_loads(random_scene(seed, 2 + seed % 5, tunable=0.3 * (seed % 3)), seed)
    return with_base(scene, seed, turning=seed % 4 == 1) if seed % 2 else scene


@pytest.mark.parametrize("seed", range(16, 22))
def test_partials_against_differentiation_of_the_tape(seed: int, rng) -> None:
    """Forward differentiation of the residual's operations knows nothing of screws and composites."""
    system = derive(scene_of(seed), ["residual", "partials"])
    evaluate, tape, nv = tape_evaluator(system), system.tape, system.nv
    state = states_of(system, rng, STATES)
    seeds = configuration_seeds(tape, [(f.group, f.q_start, f.q_size, f.v_start) for f in system.factors])
    for k in range(nv):
        seeds[InputSymbol("v", k)], seeds[InputSymbol("a", k)] = {nv + k: ONE}, {2 * nv + k: ONE}
    tangents = forward_partials(tape, system.functions["residual"].refs, seeds)
    refs = [tangent.get(direction, tape.constant(0.0)) for tangent in tangents for direction in range(3 * nv)]
    expected = evaluate_refs(tape, refs, state).reshape(STATES, nv, 3 * nv)
    found = evaluate("partials", state)
    for k, name in enumerate("KCM"):
        assert relative_error(found[name], expected[..., k * nv : (k + 1) * nv], 2) <= 1e-12


@pytest.mark.parametrize("seed", range(6))
def test_partials_cost_less_than_differentiating_the_operations(seed: int) -> None:
    system = derive(random_scene(seed, 6), ["residual", "partials"])
    tape, nv = system.tape, system.nv
    seeds = configuration_seeds(tape, [(f.group, f.q_start, f.q_size, f.v_start) for f in system.factors])
    for k in range(nv):
        seeds[InputSymbol("v", k)], seeds[InputSymbol("a", k)] = {nv + k: ONE}, {2 * nv + k: ONE}
    tangents = forward_partials(tape, system.functions["residual"].refs, seeds)
    differentiated = tape.counts([ref for tangent in tangents for ref in tangent.values()]).flops
    assert system.counts["partials"].flops < differentiated


def test_third_direction_of_a_quaternion_is_a_body_direction(rng) -> None:
    """A top's weight changes with a turn about its own axes: K of a spherical pendulum is m g times known geometry."""
    from eomgen.scene.joints.model import Joint
    from tests.oracles.formulas import rigid_body

    body = rigid_body("top", 2.0, (0.1, -0.2, 0.5), (0.3, 0.4, 0.5, 0.0, 0.0, 0.0))
    scene = Scene("top", (body,), (Joint("ball", "spherical", "base", "top", initial_position=(1.0, 0, 0, 0)),))
    system = derive(scene, ["partials"])
    state = {"q": np.array([[1.0, 0.0, 0.0, 0.0]]), "v": np.zeros((1, 3)), "a": np.zeros((1, 3))}
    found = tape_evaluator(system)("partials", state)["K"][0]
    # r = c x m g ez as seen from the body; a body turn d changes ez by ez x d
    weight, c, ez = 2.0 * 9.81, np.array([0.1, -0.2, 0.5]), np.array([0.0, 0.0, 1.0])
    expected = np.stack([weight * np.cross(c, np.cross(ez, d)) for d in np.eye(3)], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)
