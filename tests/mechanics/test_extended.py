"""Long trees: the extended system of the recursion, with its unknowns eliminated, is the matrix of the ordinary
partials."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.implicit_step import extended_iteration
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.scene import Scene
from eomgen.symbolic.evaluate import evaluate
from eomgen.system.description import BASE, Point
from tests.mechanics.test_bushings import random_bushing
from tests.models.elements import elements_with
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.formulas import vector
from tests.oracles.random_scenes import random_scene, with_base, with_loads, with_mimics
from tests.oracles.robots import planar_chain
from tests.oracles.states import on_base, random_states

WEIGHTS = {"K": 0.3, "C": 0.7, "M": 1.9}


def with_force_elements(scene: Scene, seed: int) -> Scene:
    """Return the scene with a bushing and a tyre between its last body and what is outside."""
    rng = np.random.default_rng(seed)
    last = scene.bodies[-1].name
    hub = Point("hub", last, vector(rng.normal(size=3).tolist()))
    slip = {"stiffness": [5.0, 4.0], "friction": 0.7, "velocity": 0.5}
    wheel = (
        SceneBuilder("wheel")
        .body("wheel", 1.0, inertia=[1, 1, 1])
        .joint("wheel", "free", "base", "wheel")
        .point("hub", "wheel")
    )
    wheel.tyre("tyre", "hub", radius=3.0, stiffness=9.0, damping=2.0, onset=0.5, slip=slip)
    (tyre,) = wheel.build().tyres
    tyre = replace(tyre, second=replace(tyre.second, body=last, position=hub.position))
    bushing = random_bushing(rng, "bushing", scene.bodies[0].name if seed % 3 else BASE, last)
    bushings = () if scene.bodies[0].name == last else (bushing,)
    return replace(scene, points=(*scene.points, hub), elements=elements_with(scene, bushings=bushings, tyres=(tyre,)))


@pytest.mark.slow_cases("4-False", "5-False", "6-False", "7-False")
@pytest.mark.parametrize(("seed", "following"), [*((seed, False) for seed in range(8)), (4, True), (5, True)])
def test_eliminated_unknowns_leave_the_ordinary_partials(seed: int, following: bool, rng: np.random.Generator) -> None:
    scene = with_loads(random_scene(seed, 2 + seed), seed)
    scene = with_mimics(scene, seed) if following else scene
    scene = with_force_elements(scene, seed) if seed % 4 > 1 else scene
    scene = with_base(scene, seed, turning=True) if seed % 2 else scene
    system = derive(scene, ["partials"])
    run = tape_evaluator(system)
    state = random_states(system, 1, rng)
    state = {name: block[0] for name, block in (on_base(run, state) if scene.base is not None else state).items()}
    matrices = run("partials", state)
    expected = sum(weight * matrices[name] for name, weight in WEIGHTS.items())
    derivation = Derivation(scene)
    blocks = {block.name: block for block in extended_iteration(derivation)}
    nv = derivation.tree.nv
    size = 1 + max(row for places in derivation.patterns.values() for row, _ in places)
    whole = np.zeros((size, size))
    for name, block in blocks.items():
        weight, first = WEIGHTS.get(name, 1.0), nv if name == "X" else 0
        for (row, column), value in zip(
            derivation.patterns[name], evaluate(derivation.tape, block.refs, state), strict=True
        ):
            whole[row, first + column] += weight * value
    found = whole[:nv, :nv] - whole[:nv, nv:] @ np.linalg.solve(whole[nv:, nv:], whole[nv:, :nv])
    assert relative_error(found, expected, 2) <= 1e-11


@pytest.mark.slow
def test_everything_of_a_long_chain_is_linear_in_its_links() -> None:
    systems = [derive(planar_chain(n)) for n in (48, 60, 72)]
    assert not {"mass", "partials"} & set(systems[0].functions)
    for name in ("coupling", "force", "inverse_dynamics", "forward_dynamics", "residual", "iteration"):
        short, middle, long = (system.counts[name].statements for system in systems)
        assert long - middle == middle - short, name
    assert {"mass", "partials"} <= set(derive(planar_chain(48), ["mass", "partials"]).functions)
