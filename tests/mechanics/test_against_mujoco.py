"""Against MuJoCo: forward and inverse dynamics of scenes with springs, dampers and armature.

Loops are compared in ``tests/compiled/test_loop_efforts.py``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.mujoco_oracle import Engine
from tests.oracles.states import random_states

STATES = 30
SKEW = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]


def flying_tree() -> SceneBuilder:
    """A free body that carries an arm on a ball joint, and on that a forearm on a sprung and geared hinge."""
    builder = SceneBuilder("flying_tree", gravity=[0.5, -1.0, -9.81])
    builder.body("trunk", 3.0, center_of_mass=[0.05, -0.02, 0.1], inertia=[0.2, 0.3, 0.25, 0.01, -0.02, 0.03])
    builder.body("arm", 1.2, center_of_mass=[0.2, 0.01, 0.0], inertia=[0.01, 0.05, 0.05, 0.001, 0.002, -0.003])
    builder.body("forearm", 0.8, center_of_mass=[0.0, 0.15, 0.02], inertia=[0.02, 0.004, 0.02])
    builder.joint("root", "free", "base", "trunk").joint(
        "shoulder", "spherical", "trunk", "arm", position=[0.1, 0.2, 0.3]
    )
    spring = {"stiffness": 9.0, "rest": 0.4, "damping": 0.7, "rotor_inertia": 0.05}
    return builder.joint(
        "elbow", "revolute", "arm", "forearm", axis=[0.2, 1, -0.5], position=[0.4, 0, 0], orientation=SKEW, **spring
    )


def strut() -> SceneBuilder:
    """A boom and a carriage on it, tied to the ground and to one another by springs and dampers between points."""
    builder = SceneBuilder("strut").body("boom", 4.0, center_of_mass=[0.5, 0, 0.02], inertia=[0.05, 0.4, 0.4])
    builder.body("carriage", 1.5, center_of_mass=[0, 0.1, 0.05], inertia=[0.02, 0.01, 0.02])
    builder.joint("luff", "revolute", "base", "boom", axis=[0, -1, 0], position=[0, 0, 1], damping=0.3)
    builder.joint(
        "run", "prismatic", "boom", "carriage", axis=[1, 0.2, 0], position=[0.3, 0, 0], orientation=SKEW, damping=2.0
    )
    builder.point("mast", "base", [-0.4, 0.1, 1.8])
    builder.point("tip", "boom", [1.0, 0.05, 0.0]).point("hook", "carriage", [0, 0.1, -0.2])
    builder.spring("stay", "mast", "tip", stiffness=150.0, damping=12.0, length=1.1)
    return builder.spring("brace", "hook", "mast", stiffness=80.0, damping=5.0, length=0.6)


def torsion() -> SceneBuilder:
    """A branching shaft train: springs on joints and between them, geared rotors."""
    builder = SceneBuilder("torsion", gravity=[0, 3.0, -9.0])
    shafts = (("base", [1, 0, 0]), ("shaft0", [0.8, 0, 0.6]), ("shaft0", [0, 1, 0]), ("shaft2", [1, 1, 1]))
    for k, (parent, axis) in enumerate(shafts):
        center, inertia = [0.1, 0.02 * k, 0.05], [0.02, 0.03, 0.04, 0.0, 0.005, 0.0]
        builder.body(f"shaft{k}", 1.0 + 0.3 * k, center_of_mass=center, inertia=inertia)
        joint = {"stiffness": 4.0 + k, "damping": 0.2 * k, "rest": 0.1 * k - 0.2, "rotor_inertia": 0.1 * (k % 2)}
        builder.joint(f"bearing{k}", "revolute", parent, f"shaft{k}", axis=axis, position=[0.3, 0.1 * k, 0], **joint)
    builder.torsion_spring("coupling", "bearing1", "bearing3", stiffness=25.0, damping=0.8, rest=0.3)
    return builder.torsion_spring("tail", "bearing2", stiffness=6.0, damping=0.4, rest=-0.5)


FREE: dict[str, Callable[[], SceneBuilder]] = {"flying_tree": flying_tree, "strut": strut, "torsion": torsion}


@pytest.mark.parametrize("name", FREE)
def test_forward_and_inverse_dynamics(name: str, rng: np.random.Generator) -> None:
    scene = FREE[name]().build()
    system = derive(scene, ["forward_dynamics", "inverse_dynamics"])
    evaluate, engine = tape_evaluator(system), Engine.of(scene, system)
    state = random_states(system, STATES, rng)
    pairs = [(q, v, a) for q, v, a in zip(state["q"], state["v"], state["a"], strict=True)]
    inverse = np.array([engine.inverse(*pair) for pair in pairs])
    assert relative_error(evaluate("inverse_dynamics", state)["tau"], inverse) <= 1e-11
    forward = np.array([engine.forward(q, v) for q, v, _ in pairs])
    assert relative_error(evaluate("forward_dynamics", state)["vdot"], forward) <= 1e-10
