"""Exact partials of the residual against complex step and the tape's own differentiation, with everything that can
act."""

from __future__ import annotations

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
