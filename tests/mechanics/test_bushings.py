"""Bushings: potential against SciPy's rotation vectors, power balance, exact partials, motions known in closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.forces.bushings import Bushing
from eomgen.scene.joints.model import Frame
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE
from tests.models.elements import elements_with
from tests.oracles import direct_kinematics
from tests.oracles.evaluation import Array, tape_evaluator
from tests.oracles.formulas import number, vector
from tests.oracles.random_scenes import random_scene, with_base
from tests.oracles.states import random_states, rotation_of

STATES = 12


def random_bushing(rng: np.random.Generator, name: str, first: str, second: str) -> Bushing:
    """Return a bushing with full matrices, skew frames, rest and preload."""
    places = [(body, vector(rng.uniform(-0.4, 0.4, 3).tolist())) for body in (first, second)]
    frames = [Frame(*place, _rows(Rotation.from_rotvec(rng.normal(size=3)))) for place in places]
    halves = [rng.normal(size=(6, 6)) for _ in range(2)]
    K, D = (tuple(tuple(number(entry) for entry in row) for row in (half @ half.T).tolist()) for half in halves)
    rest, preload = vector(rng.normal(size=3).tolist()), tuple(number(entry) for entry in rng.normal(size=6).tolist())
    return Bushing(name, *frames, K, D, rest, _rows(Rotation.from_rotvec(rng.normal(size=3))), preload)


def _rows(rotation: Rotation) -> Any:
    return tuple(tuple(float(entry) for entry in row) for row in rotation.as_matrix())


def scene_of(seed: int) -> Scene:
    """Return a random tree with bushings between two bodies, on the base and on the world; every second on a moving
    base."""
    rng = np.random.default_rng(seed)
    scene = random_scene(seed, 2 + seed % 4)
    scene = with_base(scene, seed, turning=seed % 4 == 1) if seed % 2 else scene
    one, last = scene.bodies[0].name, scene.bodies[-1].name
    ends = [("held", BASE, last), ("hung", "world", one)]
    ends += [("between", one, last)] if one != last else []
    return replace(scene, elements=elements_with(scene, bushings=[random_bushing(rng, *end) for end in ends]))


@pytest.mark.parametrize("seed", [2, 4, 6])
def test_potential_is_that_of_rotation_vectors(seed: int, rng: np.random.Generator) -> None:
    scene = scene_of(seed)
    state = random_states(derive(scene, ["energy"]), STATES, rng)
    found, without = (
        tape_evaluator(derive(item, ["energy"]))("energy", state)["energy"][:, 1]
        for item in (scene, replace(scene, elements=()))
    )
    poses = direct_kinematics.poses(scene, state["q"], None)
    resting = (np.broadcast_to(np.eye(3), (STATES, 3, 3)), np.zeros((STATES, 3)))
    poses = {**poses, BASE: resting, "world": resting}
    expected = np.zeros(STATES)
    for bushing in scene.bushings:
        (A, x), (B, y) = (_placed(poses, frame) for frame in (bushing.first, bushing.second))
        if not any(np.ptp(part, axis=0).any() for part in (A, x, B, y)):
            continue  # between base and world, which is left out
        turned = np.swapaxes(A, -1, -2) @ B @ np.array(bushing.rest_orientation).T
        shift = np.einsum("kji,kj->ki", A, y - x) - [entry.value for entry in bushing.rest]  # type: ignore[union-attr]
        e = np.concatenate([Rotation.from_matrix(turned).as_rotvec(), shift], axis=1)
        K = np.array([[entry.value for entry in row] for row in bushing.stiffness])  # type: ignore[union-attr]
        p = np.array([entry.value for entry in bushing.preload])  # type: ignore[union-attr]
        expected += 0.5 * np.einsum("ki,ij,kj->k", e, K, e) - e @ p
    np.testing.assert_allclose(found - without, expected, rtol=1e-11, atol=1e-11)


def _placed(poses: dict[str, tuple[Array, Array]], frame: Frame) -> tuple[Array, Array]:
    R, p = poses[frame.body]
    return R @ np.array(frame.orientation), p + R @ [entry.value for entry in frame.position]  # type: ignore[union-attr]


def test_at_rest_only_the_preload_acts_and_partials_are_finite() -> None:
    """At the rest pose the rotation vector is zero, where careless formulas divide by zero."""
    rest, turn = [0.1, -0.2, 0.3], ([0.0, 1.0, 0.0], 0.4)
    builder = SceneBuilder("held", gravity=[0, 0, 0]).body("block", 2.0, inertia=[0.1, 0.2, 0.3]).point("hook", "base")
    builder.joint("free", "free", "base", "block", initial={"position": rest, "rotation": [turn]})
    loads = {"preload": [1.0, 2.0, 3.0], "rotational_preload": [0.1, 0.2, 0.3]}
    springs = {"stiffness": [10, 20, 30], "rotational_stiffness": [1, 2, 3]}
    springs |= {"damping": [1, 1, 1], "rotational_damping": [2, 2, 2]}
    builder.bushing("mount", "hook", {"body": "block"}, rest=rest, rest_rotation=[turn], **loads, **springs)
    system = derive(builder.build(), ["force", "partials"])
    evaluate = tape_evaluator(system)
    state = {"q": np.array(system.initial_q), "v": np.zeros(6), "a": np.zeros(6)}
    R = rotation_of(state["q"][:4])
    np.testing.assert_allclose(evaluate("force", state)["Q"], [*R.T @ [0.1, 0.2, 0.3], *R.T @ [1, 2, 3]], atol=1e-15)
    found = evaluate("partials", state)
    np.testing.assert_allclose(found["C"], np.diag([2, 2, 2, 1, 1, 1]), atol=1e-14)
    assert np.all(np.isfinite(found["K"]))
    np.testing.assert_allclose(found["K"][3:, 3:], R.T @ np.diag([10, 20, 30]) @ R, atol=1e-13)


def test_absolute_coordinates_have_the_same_forces(rng: np.random.Generator) -> None:
    """A free body in joint coordinates has the same q and v as in absolute ones, with its frame at its centre of
    mass."""
    found = []
    for coordinates in ("joint", "absolute"):
        builder = SceneBuilder("body", coordinates=coordinates).body("block", 2.0, inertia=[0.1, 0.2, 0.3])
        builder.joint("free", "free", "base", "block")
        frame = {"body": "block", "position": [0.1, 0, 0.2]}
        builder.point("ceiling", "world", [0, 0, 2])
        builder.bushing(
            "mount", "ceiling", frame, stiffness=[3, 4, 5], rotational_stiffness=[1, 2, 3], damping=[1, 2, 3]
        )
        system = derive(builder.build(), ["force"])
        found.append(tape_evaluator(system)("force", random_states(system, 20, np.random.default_rng(5)))["Q"])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12, atol=1e-12)
