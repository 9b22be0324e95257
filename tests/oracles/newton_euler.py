"""Newton and Euler by hand: what each rigid body lacks to be in balance, from its motion and all that acts on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from eomgen.formula.nodes import Symbol
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE
from eomgen.system.signals import Output
from tests.oracles.direct_kinematics import body_data
from tests.oracles.evaluation import Array, Evaluate
from tests.oracles.formulas import value_of
from tests.oracles.states import rotation_of

#: Terms that the motion of the bodies is taken from.
MOTION = ["poses", "twists", "accelerations", "outputs"]


def with_reactions(scene: Scene) -> Scene:
    """Return the scene with moment and force of each joint and constraint as outputs called like them."""
    names = [item.name for item in (*scene.joints, *scene.constraints)]
    outputs = tuple(Output(name, tuple(Symbol("reaction", name, k) for k in range(6))) for name in names)
    return replace(scene, outputs=outputs)


@dataclass
class Moving:
    """Bodies of a scene in motion, a batch of states; all in world axes but the inertia.

    Attributes
    ----------
    R, p : orientation, (..., 3, 3), and origin, (..., 3), of each body; of the base where it rests
    omega, velocity : of each body's frame
    forces, moments : that act on each body, moments about its origin
    """

    scene: Scene
    R: dict[str, Array]
    p: dict[str, Array]
    omega: dict[str, Array]
    velocity: dict[str, Array]
    alpha: dict[str, Array]
    acceleration: dict[str, Array]
    outputs: dict[str, Array]
    forces: dict[str, Array] = field(default_factory=dict)
    moments: dict[str, Array] = field(default_factory=dict)

    def place(self, body: str, r: Array) -> Array:
        return self.p[body] + np.einsum("...ij,j->...i", self.R[body], r)

    def push(self, body: str, place: Array, force: Array, moment: Array) -> None:
        """Add a force at a place, and a moment."""
        self.forces[body] = self.forces.get(body, 0.0) + force
        self.moments[body] = self.moments.get(body, 0.0) + moment + np.cross(place - self.p[body], force)

    def velocity_at(self, body: str, place: Array) -> Array:
        return self.velocity[body] + np.cross(self.omega[body], place - self.p[body])


def moving(scene: Scene, evaluate: Evaluate, state: Mapping[str, Array]) -> Moving:
    """Return the bodies of a scene with its reactions as outputs (``with_reactions``), pushed by these reactions."""
    pose, twist = evaluate("poses", state)["pose"], evaluate("twists", state)["twist"]
    acceleration, y = evaluate("accelerations", state)["acceleration"], evaluate("outputs", state)["y"]
    shape = pose.shape[:-2]
    still, none = np.broadcast_to(np.eye(3), (*shape, 3, 3)), np.zeros((*shape, 3))
    outputs, start = {}, 0
    for output in scene.outputs:
        outputs[output.name] = y[..., start : start + len(output.values)]
        start += len(output.values)
    bodies = Moving(scene, {BASE: still}, *({BASE: none} for _ in range(5)), outputs)
    for number, body in enumerate(scene.bodies):
        R = rotation_of(pose[..., number, :4])
        in_world = [
            np.einsum("...ij,...j->...i", R, block[..., number, part])
            for block in (twist, acceleration)
            for part in (slice(0, 3), slice(3, 6))
        ]
        bodies.R[body.name], bodies.p[body.name] = R, pose[..., number, 4:]
        bodies.omega[body.name], bodies.velocity[body.name] = in_world[:2]
        bodies.alpha[body.name], bodies.acceleration[body.name] = in_world[2:]
    for first, second, place, moment, force in reactions(bodies):
        bodies.push(second, place, force, moment)
        bodies.push(first, place, -force, -moment)
    return bodies


def reactions(bodies: Moving) -> list[tuple[str, str, Array, Array, Array]]:
    """Return of each joint and constraint: who pushes whom, where, with what moment and force."""
    scene, found = bodies.scene, []
    for joint in scene.joints:
        load = bodies.outputs[joint.name]
        found.append((joint.parent, joint.child, bodies.p[joint.child], load[..., :3], load[..., 3:]))
    parameters = {parameter.name: parameter.value for parameter in scene.parameters}
    for item in scene.constraints:
        load = bodies.outputs[item.name]
        r = np.array([value_of(part, parameters) for part in item.second.position])
        place = bodies.place(item.second.body, r)
        found.append((item.first.body, item.second.body, place, load[..., :3], load[..., 3:]))
    return found


def imbalance(bodies: Moving) -> Array:
    """Return the largest force or moment that a body lacks, as a part of the largest that acts on any, (...,)."""
    parameters = {parameter.name: parameter.value for parameter in bodies.scene.parameters}
    gravity = np.array([value_of(part, parameters) for part in bodies.scene.gravity])
    lacking, acting = [], []
    for name, mass, center, inertia in body_data(bodies.scene):
        R, omega, alpha = bodies.R[name], bodies.omega[name], bodies.alpha[name]
        c = np.einsum("...ij,j->...i", R, center)
        J = R @ inertia @ np.swapaxes(R, -1, -2)
        spin = np.einsum("...ij,...j->...i", J, omega)
        of_center = bodies.acceleration[name] + np.cross(alpha, c) + np.cross(omega, np.cross(omega, c))
        force = mass * (of_center - gravity)
        moment = np.einsum("...ij,...j->...i", J, alpha) + np.cross(omega, spin) + np.cross(c, force)
        lacking += [force - bodies.forces[name], moment - bodies.moments[name]]
        acting += [force, moment, bodies.forces[name], bodies.moments[name]]
    sizes = [np.linalg.norm(np.stack(kind), axis=-1).max(axis=0) for kind in (lacking, acting)]
    return np.asarray(sizes[0] / sizes[1])


def transmitted_power(bodies: Moving) -> dict[str, Array]:
    """Return the power that each joint and constraint gives to its two bodies together, W."""
    found = {}
    names = [item.name for item in (*bodies.scene.joints, *bodies.scene.constraints)]
    for name, (first, second, place, moment, force) in zip(names, reactions(bodies), strict=True):
        turning = bodies.omega[second] - bodies.omega[first]
        passing = bodies.velocity_at(second, place) - bodies.velocity_at(first, place)
        found[name] = np.sum(moment * turning + force * passing, axis=-1)
    return found


def pull(bodies: Moving, first: tuple[str, Array], second: tuple[str, Array], tension: Array) -> None:
    """Add a tension, (..., 1), between a point of one body and a point of another."""
    a, b = bodies.place(*first), bodies.place(*second)
    along = (b - a) / np.linalg.norm(b - a, axis=-1, keepdims=True)
    none = np.zeros_like(a)
    bodies.push(first[0], a, tension * along, none)
    bodies.push(second[0], b, -tension * along, none)
