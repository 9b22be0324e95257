"""Frames of compiled models: by name wherever bodies are, in batches, and what is said of mistakes."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import eomgen
from eomgen.errors import NumericalError, UsageError
from tests.compiled.test_bodies import some_state

TURNED = [{"axis": [0, 0, 1], "angle": 0.4}, {"axis": [1, 0, 0], "angle": -0.7}]


@cache
def arm() -> eomgen.Model:
    builder = eomgen.SceneBuilder("arm").parameter("reach", 0.4, tunable=True)
    builder.base(["0.1 * sin(3 * t)", 0, 0], [([0, 0, 1], "0.5 * t")])
    builder.body("upper", 1.0, center_of_mass=[0, 0, 0.1], inertia=[0.1, 0.2, 0.3])
    builder.joint("shoulder", "spherical", "base", "upper", position=[0, 0, 0.3])
    builder.body("lower", 0.5, inertia=[0.1, 0.1, 0.1])
    builder.joint("elbow", "revolute", "upper", "lower", axis=[0, 1, 0], position=[0, 0, 0.4])
    builder.frame("tool", "lower", ["reach", 0, 0.1], rotation=TURNED)
    builder.frame("mast", "base", [0, 0, 1], rotation=TURNED).frame("wall", "world", [1, 0, 0])
    terms = ["mass", "poses", "twists", "accelerations", "jacobians", "frame_poses"]
    return eomgen.build(builder.build(), terms=terms, profile="quick")


@pytest.mark.parametrize("name", ["tool", "mast", "wall", "upper"])
def test_poses_of_frames_are_those_of_the_compiled_term(name: str, rng: np.random.Generator) -> None:
    model = arm()
    q, _, _ = some_state(model, rng)
    parameters = {"reach": rng.uniform(0.2, 0.8, size=7)}
    every = model.evaluate("frame_poses", q, t=0.3, parameters=model.parameter_array(parameters))["frame_pose"]
    found = model.pose(name, q, 0.3, parameters=parameters)
    np.testing.assert_allclose(found, every[:, model.frames.index(name)], atol=1e-14)


@pytest.mark.parametrize("name", ["tool", "mast", "wall"])
def test_twists_points_and_jacobians_take_frames_for_bodies(name: str, rng: np.random.Generator) -> None:
    """The frame's origin is a point of the body that carries it; the twist turns and shifts with the frame."""
    model = arm()
    q, v, a = some_state(model, rng)
    found = model.twist(name, q, v, 0.3)
    origin = model.point(name, [0.0, 0.0, 0.0], q, v, 0.3, a=a)
    pose = model.pose(name, q, 0.3)
    np.testing.assert_allclose(origin.position, pose[:, 4:], atol=1e-14)
    step = 1e-6
    ahead = model.pose(name, moved(model, q, v, step), 0.3 + step)
    behind = model.pose(name, moved(model, q, v, -step), 0.3 - step)
    np.testing.assert_allclose((ahead[:, 4:] - behind[:, 4:]) / (2 * step), origin.velocity, atol=1e-8)
    from scipy.spatial.transform import Rotation  # of this test alone

    turn = Rotation.from_quat(pose[:, [1, 2, 3, 0]])
    np.testing.assert_allclose(turn.inv().apply(origin.velocity), found[:, 3:], atol=1e-13)
    spin = Rotation.from_quat(behind[:, [1, 2, 3, 0]]).inv() * Rotation.from_quat(ahead[:, [1, 2, 3, 0]])
    np.testing.assert_allclose(spin.as_rotvec() / (2 * step), found[:, :3], atol=1e-8)
    at_rest = model.twist(name, q, np.zeros_like(v), 0.3)
    J = model.body_jacobian(name, q)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", J, v) + at_rest, found, atol=1e-13)
    np.testing.assert_allclose(model.jacobian(name, q), J, atol=1e-14)
    assert origin.acceleration is not None and origin.acceleration.shape == (7, 3)


def moved(model: eomgen.Model, q: np.ndarray, v: np.ndarray, step: float) -> np.ndarray:
    from eomgen.lie import product

    return np.array([product.update(model.factors, each, step * rate) for each, rate in zip(q, v, strict=True)])


@pytest.mark.slow
def test_jacobians_rates_and_drifts_belong_together(rng: np.random.Generator) -> None:
    model = arm()
    q, v, _ = some_state(model, rng)
    for reference in ("body", "local_world_aligned", "world"):
        rate = model.jacobian_rate("tool", q, v, 0.2, reference=reference)
        found = model.drift("tool", q, v, 0.2, reference=reference)
        np.testing.assert_allclose(np.einsum("nij,nj->ni", rate, v), found, atol=1e-12)
    J, M = model.jacobian("tool", q, 0.2, reference="local_world_aligned"), model.mass(q)
    inertia = model.operational_inertia("tool", q, 0.2, rows=[3, 4])
    expected = np.linalg.inv((J @ np.linalg.inv(M) @ np.swapaxes(J, 1, 2))[:, 3:5, 3:5])
    np.testing.assert_allclose(inertia, expected, rtol=1e-10)


def test_what_is_said_of_mistakes() -> None:
    model = arm()
    q = model.initial_q
    loaded = eomgen.load({"format": 1, "name": "one", **ONE}, task_frames=["rod"])
    one = eomgen.build(loaded, terms=["poses"], profile="quick")
    singular = "J M^-1 J^T of tool is singular: "
    calls: list[tuple[Callable[[], object], str]] = [
        (lambda: model.jacobian("tool", q, reference="LOCAL"), "there is no reference 'LOCAL'; try: body"),
        (lambda: model.jacobian("toool", q), "there is no body or frame 'toool'; try: tool"),
        (lambda: model.operational_inertia("tool", q), singular),
        (lambda: model.operational_inertia("tool", q, rows=[7]), "rows: '[7]' are not rows of a twist; try: rows="),
        (lambda: one.jacobian("tip", q), "tip is not a task frame, and the terms of frames give rod only"),
        (lambda: eomgen.load(loaded, task_frames=["tip"]), "the task frames of a Scene are chosen where it is read"),
    ]
    for call, said in calls:
        with pytest.raises((UsageError, NumericalError), match=re.escape(said)):
            call()


ONE = {
    "bodies": {"rod": {"mass": 1.0, "inertia": [1, 1, 1]}},
    "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, 1, 0]}},
    "frames": {"tip": {"body": "rod", "position": [1, 0, 0]}},
}
