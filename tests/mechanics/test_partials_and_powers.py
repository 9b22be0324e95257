"""Every kind of force and body, on bases that rest and move: partials against complex steps, the rate of the energy
against the powers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from tests.mechanics import test_internal_states, test_joint_forces, test_words_of_bodies
from tests.mechanics.checks import check_partials, check_powers, states_of
from tests.mechanics.test_beam_energy import floating, loaded_chain, nearly_straight
from tests.mechanics.test_bushings import scene_of as with_bushings
from tests.mechanics.test_world_points import anchored, tethered
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.random_scenes import random_scene, with_base, with_loads

TERMS = ["residual", "partials", "energy", "forward_dynamics", "internal_rate"]


def loaded_tree(seed: int) -> Scene:
    """Return a tree with springs, dampers, actuators, rotors and formula forces, on a base that rests or moves."""
    scene = with_loads(random_scene(seed, 1 + seed % 8, tunable=0.3 * (seed % 2)), seed)
    return with_base(scene, seed, turning=seed % 3 == 1) if seed % 3 else scene


SCENES: dict[str, Callable[[], Scene]] = {
    **{f"tree {seed}": partial(loaded_tree, seed) for seed in range(12)},
    **{f"bushings {seed}": partial(with_bushings, seed) for seed in range(6)},
    **{f"beams {order}": partial(loaded_chain, order) for order in (1, 2)},
    **{f"beams, floating {order}": partial(floating, order) for order in (1, 2)},
    **{f"spring to the world {base}": partial(anchored, 2, base) for base in ("resting", "translating", "turning")},
    "path and bushing to the world": tethered,
    "stops": lambda: test_joint_forces.arm().build(),
    "states": test_internal_states.scene,
    "motion of bodies": test_words_of_bodies.gyroscope,
}
#: Of elements with large stiffness, by the first word of a scene's name.
TOLERANCES = {"bushings": 1e-10, "stops": 1e-11, "motion": 1e-11}


FAST = ["tree 7", "tree 11", "bushings 4", "beams, floating 2", "spring to the world turning", "stops", "states"]
FAST += ["path and bushing to the world", "motion of bodies"]


@pytest.mark.slow_except(*FAST)
@pytest.mark.parametrize("name", SCENES)
def test_partials_are_complex_steps_and_the_energy_changes_by_the_powers(name: str, rng: np.random.Generator) -> None:
    scene, kind = SCENES[name](), name.split(maxsplit=1)[0]
    system = derive(scene, TERMS)
    state = states_of(system, rng, count=40 if kind == "stops" else 5)
    if kind.startswith("beams"):
        state = nearly_straight(system, state)
    check_partials(system, state, TOLERANCES.get(kind, 1e-12))
    state["a"] = tape_evaluator(system)("forward_dynamics", state)["vdot"]
    _, potential, power, base_power = check_powers(system, state, max(TOLERANCES.get(kind, 0.0), 1e-11)).T
    assert np.ptp(potential) > 0.0
    assert (np.abs(base_power).max() > 0.0) == (scene.base is not None)
    if kind in ("bushings", "stops"):
        assert np.all(power <= 0.0) and np.any(power < 0.0)
