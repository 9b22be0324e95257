"""Reactions of a Stewart platform, a four-bar and an arm along their motions: against Newton and Euler by hand, and
their work against the balance of energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from tests.models.stewart import stewart
from tests.oracles.constrained import kkt, on_constraints
from tests.oracles.direct_kinematics import body_data
from tests.oracles.evaluation import Array, Evaluate, tape_evaluator
from tests.oracles.formulas import number, value_of
from tests.oracles.newton_euler import MOTION, Moving, imbalance, moving, transmitted_power, with_reactions
from tests.oracles.placed_loops import four_bar
from tests.oracles.robots import panda
from tests.oracles.states import STEP, displaced, random_states

TOLERANCE = 1e-9
TREE = [*MOTION, "energy", "mass", "residual"]
LOOP = [*TREE, "constraint", "constraint_jacobian", "constraint_bias", "constraint_velocity"]
STATES = 3


def damped_arm() -> Scene:
    joints = tuple(replace(joint, damping=number(0.4), stiffness=number(6.0)) for joint in panda().joints)
    return replace(panda(), joints=joints)


#: Scene, and rows that repeat others: the hinge that closes the planar loop in space.
MACHINES = {
    "stewart": (stewart, ()),
    "four_bar": (lambda: from_data(four_bar("revolute"), file="four_bar"), (2, 3, 4)),
    "arm": (damped_arm, ()),
}


def closed(system: System, evaluate: Evaluate) -> Array:
    """Return initial configurations brought onto the constraints, by Gauss and Newton."""
    q = np.tile(system.initial_q, (STATES, 1))
    for _ in range(12):
        Phi, B = evaluate("constraint", {"q": q})["Phi"], evaluate("constraint_jacobian", {"q": q})["B"]
        q = displaced(system.factors, q, -np.einsum("kij,kj->ki", np.linalg.pinv(B), Phi))
        for factor in system.factors:
            if factor.group != "R":
                turn = slice(factor.q_start, factor.q_start + 4)
                q[:, turn] /= np.linalg.norm(q[:, turn], axis=1, keepdims=True)
    return q


def in_motion(scene: Scene, left_out: Sequence[int], rng: np.random.Generator) -> tuple[System, dict[str, Array]]:
    """Return states on the constraints with random velocities, and the accelerations and multipliers of the motion."""
    system = derive(scene, LOOP if scene.constraints else TREE, left_out)
    evaluate, state = tape_evaluator(system), random_states(system, STATES, rng)
    if not scene.constraints:
        rest = evaluate("residual", {**state, "a": np.zeros_like(state["a"])})["r"]
        return system, {**state, "a": np.linalg.solve(evaluate("mass", state)["M"], -rest[..., np.newaxis])[..., 0]}
    state["q"] = closed(system, evaluate)
    assert np.abs(evaluate("constraint", state)["Phi"]).max() <= 1e-13
    return system, kkt(evaluate, on_constraints(evaluate, state))


@pytest.mark.parametrize("machine", MACHINES)
def test_of_machines(machine: str, rng) -> None:
    """Bodies are in balance; a joint gives the power of its spring, damper and motor; all of it is kinetic energy."""
    make, left_out = MACHINES[machine]
    scene = with_reactions(make())
    system, state = in_motion(scene, left_out, rng)
    evaluate = tape_evaluator(system)
    bodies = moving(scene, evaluate, state)
    assert imbalance(bodies).max() <= TOLERANCE
    power, expected = transmitted_power(bodies), powers_of_joints(scene, system, state)
    scale = max(np.abs(value).max() for value in (*power.values(), weight_power(bodies)))
    for name, value in power.items():
        assert np.abs(value - expected.get(name, 0.0)).max() <= TOLERANCE * scale, name
    along = {
        "q": displaced(system.factors, state["q"], 1j * STEP * state["v"]),
        "v": state["v"] + 1j * STEP * state["a"],
    }
    kinetic = evaluate("energy", {**state, **along})["energy"][..., 0].imag / STEP
    assert np.abs(sum(power.values()) + weight_power(bodies) - kinetic).max() <= TOLERANCE * scale


def powers_of_joints(scene: Scene, system: System, state: dict[str, Array]) -> dict[str, Array]:
    """Return the power of the spring, damper and motor of each joint that has some."""
    motors = {item.joint: value_of(item.effort, {}) for item in scene.efforts}
    starts = {factor.name: (factor.q_start, factor.v_start) for factor in system.factors}
    found = {}
    for joint in scene.joints:
        if joint.type in ("revolute", "prismatic"):
            q, v = (state[block][:, start] for block, start in zip("qv", starts[joint.name], strict=True))
            stiffness, damping = (
                value_of(item, {}) for item in (*joint.each(joint.stiffness), *joint.each(joint.damping))
            )
            found[joint.name] = (motors.get(joint.name, 0.0) - stiffness * q - damping * v) * v
    return found


def weight_power(bodies: Moving) -> Array:
    gravity = np.array([value_of(part, {}) for part in bodies.scene.gravity])
    return sum(
        mass * bodies.velocity_at(name, bodies.place(name, center)) @ gravity
        for name, mass, center, _ in body_data(bodies.scene)
    )
