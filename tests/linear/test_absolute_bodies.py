"""Linear models of absolute bodies about any motion are those of the same scene in joint coordinates, in all
matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe, joint_factors
from eomgen.products.linear.freedom import Measures, Partials, freedom
from eomgen.products.linear.linearization import Linearization, LinearNames, Reference
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE
from eomgen.system.system import System
from tests.mechanics.test_absolute import in_absolute, joint_angles, loaded, over_turns
from tests.oracles.constrained import absolute_state, constraint, kkt, small_body
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.random_scenes import with_base
from tests.oracles.states import on_base, random_states

LINEAR = ["linearization", "output_partials", "joint_velocities"]
ROWS = ["constraint_jacobian", "velocity_partials", "acceleration_partials"]
TERMS = ["mass", "residual", "forward_dynamics", "constraint", "constraint_velocity", "constraint_bias", *LINEAR, *ROWS]
RENAMED = {"M0": "M", "C0": "C", "K0": "K", "B0": "B", "E0": "E", "B": "J"}


def linear(scene: Scene, system: System, state: dict[str, Array]) -> Linearization:
    """Return the linear model about one state with its accelerations and multipliers, evaluated on the tape."""
    evaluate = tape_evaluator(system)
    blocks: dict[str, Array] = {}
    for term in (*LINEAR, *ROWS):
        if term in system.functions:
            blocks |= {RENAMED.get(name, name): block[0] for name, block in evaluate(term, state).items()}
    names = [f"{factor.name}.{k}" for factor in joint_factors(scene) for k in range(factor.v_size)]
    outputs = tuple(f"{item.name}.{k}" for item in scene.outputs for k in range(len(item.values)))
    said = describe(scene)
    known = LinearNames(tuple(names), tuple(names), (), said.driven, said.disturbances, outputs)
    partials = Partials.of(blocks, len(known.inputs), len(known.disturbances), len(outputs), system.holonomic)
    v, a = state["v"][0], state["a"][0]
    if scene.coordinates == "absolute":
        shape = (len(names), system.nv)
        P, Z, Av, Aq = (blocks.get(name, np.zeros(shape)) for name in ("Pv", "Pq", "Pav", "Paq"))
        measures = Measures(joint_factors(scene), blocks["joint_v"], blocks["joint_a"], P, Z, Av, Aq)
    else:
        assert [f"{factor.name}.{k}" for factor in system.factors for k in range(factor.v_size)] == names
        measures = Measures.components(system.factors, v, a)
    nothing = np.zeros(0)
    reference = Reference(0.0, state["q"][0], v, a, nothing, nothing, nothing, "given state")
    return Linearization(reference, partials, freedom(measures, partials), known)


def both(scene: Scene, rng: np.random.Generator) -> tuple[Linearization, Linearization]:
    """Return the linear models of a scene about one random motion, in joint and in absolute coordinates."""
    free = in_absolute(scene, "mixed")
    joint, absolute = derive(scene, TERMS), derive(free, TERMS)
    at_joint = tape_evaluator(joint)
    state = random_states(joint, 1, rng)
    state = on_base(at_joint, state) if scene.base is not None else state
    moved = absolute_state(scene, joint, absolute, state, at_joint)
    if absolute.angles:
        moved = over_turns(absolute, moved, joint_angles(joint, absolute, state), rng)
    return linear(scene, joint, of_dynamics(joint, state)), linear(free, absolute, of_dynamics(absolute, moved))


def of_dynamics(system: System, state: dict[str, Array]) -> dict[str, Array]:
    """Return a state with the accelerations and multipliers of the motion through it."""
    evaluate = tape_evaluator(system)
    return kkt(evaluate, state) if system.multipliers else {**state, "a": evaluate("forward_dynamics", state)["vdot"]}


def check_equal(joint: Linearization, absolute: Linearization) -> None:
    assert absolute.coordinates == joint.coordinates
    assert absolute.velocities == joint.velocities
    assert np.max(np.abs(joint.reference.a)) > 0.1
    found, expected = absolute.state_space(), joint.state_space()
    own = [expected.disturbances.index(name) for name in found.disturbances]  # in absolute ones the base has none
    for name in "ABCDEF":
        first, second = getattr(found, name), getattr(expected, name)
        second = second[:, own] if name in "EF" else second
        assert relative_error(first.ravel()[np.newaxis], second.ravel()[np.newaxis], floor=1e-9) <= 1e-9, name
    if joint.free.holonomic:
        for name in ("M0", "C0", "K0", "B0"):
            first, second = getattr(absolute, name), getattr(joint, name)
            assert relative_error(first.ravel()[np.newaxis], second.ravel()[np.newaxis], floor=1e-9) <= 1e-9, name


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 5, 9])
def test_any_tree_about_any_motion(seed: int, rng: np.random.Generator) -> None:
    """All joint types, forces, springs, formulas of joint coordinates and outputs, about states that move and
    accelerate."""
    scene = loaded(seed)
    check_equal(*both(with_base(scene, seed) if seed % 2 else scene, rng))


@pytest.mark.slow_cases("rolling-False", "cylindrical-True")
@pytest.mark.parametrize("kind, driven", [("cylindrical", True), ("rolling", False)])
def test_loops_leave_the_same_coordinates_independent(kind: str, driven: bool, rng: np.random.Generator) -> None:
    """What a loop leaves of the joints' coordinates, rolling included, which leaves fewer velocities."""
    scene = with_base(loaded(3, 6), 3)
    still = {"initial_position": (1.0, *(0.0,) * 6), "initial_velocity": (0.0,) * 6}
    free = Joint("free", "free", scene.bodies[0].name, "wheel", **still)
    scene = replace(scene, bodies=(*scene.bodies, small_body("wheel")), joints=(*scene.joints, free))
    check_equal(*both(replace(scene, constraints=(constraint(rng, kind, BASE, "wheel", driven=driven),)), rng))
