"""Systems whose equations are known in closed form: written here by hand, from textbooks."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.errors import ModelError
from eomgen.mechanics.derive import derive
from eomgen.scene.bodies.model import Base
from eomgen.scene.joints.model import Joint
from eomgen.scene.rotations import Rotation
from eomgen.scene.scene import Scene
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.formulas import TIME, rigid_body, times, vector
from tests.oracles.states import on_base


def test_gyroscopic_moment_of_a_wheel_on_a_turning_base() -> None:
    """A wheel that spins at s on a table turning at W needs the moment I s W across both: here it loads a tilt
    hinge."""
    axial, across = 0.04, 0.025
    frame = rigid_body("frame", 0.0)
    wheel = rigid_body("wheel", 1.0, (0, 0, 0), (axial, across, across, 0, 0, 0))
    joints = (
        Joint("tilt", "revolute", "base", "frame", (0, 1, 0)),
        Joint("spin", "revolute", "frame", "wheel", (1, 0, 0)),
    )
    table = Base(rotations=(Rotation((0, 0, 1), times(3.0, TIME)),))
    system = derive(Scene("gyroscope", (frame, wheel), joints, gravity=vector((0, 0, 0)), base=table))
    evaluate = tape_evaluator(system)
    state = {"q": np.zeros((1, 2)), "v": np.array([[0.0, 50.0]]), "a": np.zeros((1, 2)), "t": np.array([[0.4]])}
    b = evaluate("base_motion", on_base(evaluate, state))["b"]
    np.testing.assert_allclose(b, [[axial * 50.0 * 3.0, 0.0]], rtol=1e-14, atol=1e-14)


def test_unknown_term_is_named() -> None:
    rod = rigid_body("rod", 1.0, (0.5, 0, 0), (0, 0, 0.1, 0, 0, 0))
    scene = Scene("pendulum", (rod,), (Joint("hinge", "revolute", "base", "rod", (0, 0, 1)),))
    with pytest.raises(ModelError, match=r"no term is called 'inertia'.*one of mass, mass_values, coupling"):
        derive(scene, ["inertia"])


def test_scene_without_motion_is_refused() -> None:
    rod = rigid_body("rod", 1.0)
    with pytest.raises(ModelError, match="scene 'welded' has no moving joint"):
        derive(Scene("welded", (rod,), (Joint("weld", "fixed", "base", "rod"),)))
