"""Points fixed in the world while the base moves: where they are, what springs to them do, and whose power that is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.formula.nodes import Symbol
from eomgen.mechanics.derive import derive
from eomgen.scene.forces.springs import Spring
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.system.description import Point
from eomgen.system.signals import Output
from tests.mechanics.checks import states_of
from tests.models import library
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.formulas import number, vector
from tests.oracles.random_scenes import random_scene, with_base, with_loads

STATES = 5
ANCHOR = (1.5, -2.0, 2.5)


def anchored(seed: int, base: str) -> Scene:
    """Return a loaded tree with one more spring, from its tip to a point that rests in the world."""
    scene = with_loads(random_scene(seed, 1 + seed), seed)
    scene = scene if base == "resting" else with_base(scene, seed, turning=base == "turning")
    spring = Spring("tether", "tip", "anchor", number(40.0), number(2.0), number(0.7), Symbol("input", "pull"))
    outputs = tuple(
        Output(f"{kind}_{point}", tuple(Symbol(kind, point, k) for k in range(3)))
        for kind in ("position", "velocity", "acceleration")
        for point in ("anchor", "tip")
    )
    tether = Output("tether", (Symbol("length", "tether"), Symbol("rate", "tether"), Symbol("tension", "tether")))
    points = (*scene.points, Point("anchor", "world", vector(ANCHOR)))
    return replace(scene, points=points, elements=(*scene.elements, spring), outputs=(*outputs, tether))


def tethered() -> Scene:
    """Return a pendulum on a turning base with a path and a bushing to a point of the world."""
    base = {"position": ["0.3 * sin(2 * t)", "0.2 * t", 0], "rotation": [{"axis": [0, 1, 2], "angle": "0.7 * t"}]}
    points = {"tip": {"body": "rod", "position": [0.1, 0, -1]}, "wall": {"body": "world", "position": [1, 2, 3]}}
    rope = {"points": ["tip", "wall"], "stiffness": 10.0, "length": 1.0, "damping": 2.0}
    rubber = {"first": {"body": "rod"}, "second": "wall", "stiffness": [3.0, 4.0, 5.0], "damping": [1.0, 2.0, 3.0]}
    parts = {"tendons": {"rope": rope}, "bushings": {"rubber": rubber}}
    return from_data(library.scene("pendulum", base=base, points=points, **parts))


@pytest.mark.parametrize("base", ["resting", "translating", "turning"])
@pytest.mark.parametrize("seed", range(4))
def test_a_point_of_the_world_rests_and_a_spring_to_it_knows_its_length(seed: int, base: str, rng) -> None:
    system = derive(anchored(seed, base), ["outputs"])
    evaluate, state = tape_evaluator(system), states_of(system, rng, STATES)
    y = evaluate("outputs", state)["y"]
    anchor, tip, tether = y[:, :3], y[:, 3:6], y[:, 18:]
    assert relative_error(anchor, np.broadcast_to(ANCHOR, anchor.shape)) <= 1e-12
    for resting in (y[:, 6:9], y[:, 12:15]):  # velocity and acceleration, beside those of the tip
        assert np.abs(resting).max() <= 1e-12 * max(1.0, np.abs(y[:, 9:18]).max())
    span = tip - np.array(ANCHOR)
    length = np.linalg.norm(span, axis=1)
    rate = np.sum(span * y[:, 9:12], axis=1) / length
    pull = state["u"][:, 0]
    expected = np.stack([length, rate, 40.0 * (length - 0.7) + 2.0 * rate + pull], axis=1)
    assert relative_error(tether, expected) <= 1e-12
