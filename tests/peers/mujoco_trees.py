"""Random trees with springs and dampers in MuJoCo."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from eomgen.formula.nodes import Formula
from eomgen.mechanics.derive import derive
from eomgen.scene.forces.springs import Spring, TorsionSpring
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE, Point
from tests.models.elements import elements_with
from tests.oracles.formulas import number, value_of, vector
from tests.peers.trees import Differences, Values, differences, first_scene, kinds, states

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def dynamics(seed: int) -> Differences:
    """Compare inverse and forward dynamics."""
    from tests.oracles.mujoco_oracle import KINDS, Engine

    def fits(scene: Scene) -> bool:
        lowest = all(joint.parent == BASE for joint in scene.joints if joint.type == "free")
        return kinds(scene) <= {*KINDS, "fixed"} and lowest and all(value_of(body.mass, {}) for body in scene.bodies)

    scene = with_springs(first_scene(seed, fits), seed)
    system = derive(scene, ["inverse_dynamics", "forward_dynamics"])
    engine, state = Engine.of(scene, system), states(system, seed)
    each = list(zip(state["q"], state["v"], state["a"], strict=True))
    expected: Values = {
        ("inverse dynamics", "inverse_dynamics", "tau"): np.array([engine.inverse(*one) for one in each]),
        ("accelerations", "forward_dynamics", "vdot"): np.array([engine.forward(q, v) for q, v, _ in each]),
    }
    return differences(system, state, expected)


def with_springs(scene: Scene, seed: int) -> Scene:
    """Return the scene with springs and dampers on joints, between joints, and between points.

    Free joints start at the origin, as MuJoCo has them.
    """
    rng = np.random.default_rng(seed)

    def value(low: float, high: float) -> Formula:
        return number(float(rng.uniform(low, high)))

    def with_law(joint: Joint) -> Joint:
        if joint.type == "free":
            return replace(joint, position=vector((0.0, 0.0, 0.0)), orientation=IDENTITY)
        if joint.type in ("revolute", "prismatic") and rng.uniform() < 0.6:
            return replace(joint, stiffness=value(1, 9), damping=value(0.1, 2), rest=value(-1, 1))
        return joint

    first, last = scene.bodies[0].name, scene.bodies[-1].name
    points = [Point("ground", BASE, vector((1.5, -2.0, 2.5)))]
    points += [Point(f"on_{body}", body, vector(rng.uniform(-0.5, 0.5, 3).tolist())) for body in {first: 0, last: 0}]
    ends = [(points[0], points[-1]), *pairwise(points[1:])]
    springs = [
        Spring(f"spring{k}", a.name, b.name, value(5, 40), value(0.2, 2), value(0.5, 2))
        for k, (a, b) in enumerate(ends)
    ]
    turning = [joint.name for joint in scene.joints if joint.type == "revolute"]
    pairs = list(pairwise(turning)) or [(name, "") for name in turning]
    torsion = [
        TorsionSpring(f"torsion{k}", a, b, value(1, 9), value(0.1, 1), value(0, 1)) for k, (a, b) in enumerate(pairs)
    ]
    elements = elements_with(scene, springs=springs, torsion_springs=torsion)
    return replace(scene, joints=tuple(map(with_law, scene.joints)), points=tuple(points), elements=elements)
