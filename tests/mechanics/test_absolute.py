"""The same scenes in joint and in absolute coordinates: the same motion, from poses that are multiplied out
independently."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.errors import ModelError
from eomgen.formula.nodes import Symbol
from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.scene.forces.forces import Effort
from eomgen.scene.forces.springs import TorsionSpring
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.model import Joint, Mimic
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE, Point
from eomgen.system.signals import Output
from eomgen.system.system import System
from tests.models.elements import elements_with
from tests.models.scenes import flyer_scene
from tests.oracles.constrained import absolute_state, kkt, mixed_groups, weighty
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import number, rigid_body, vector
from tests.oracles.random_scenes import NUMBERS, point_outputs, random_scene, with_base, with_loads
from tests.oracles.robots import body_of_masses
from tests.oracles.states import on_base, random_states

STATES = 4
JOINT = ["mass", "coupling", "residual", "forward_dynamics", "outputs", "energy", "poses", "twists"]
ROWS = ["constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian"]
GROUPS, BASES = ["SE3", "R3xSO3", "mixed"], ["resting", "translating", "turning"]


def loaded(seed: int, links: int = 4) -> Scene:
    """Return a tree with everything that can act on it, points in several bodies observed, and fixed joints in
    between."""
    scene = weighty(with_loads(random_scene(seed, links, tunable=0.3 * (seed % 2)), seed), seed)
    single = [(joint.name, k) for joint in scene.joints if joint.type in NUMBERS for k in range(joint.kind.v_size)]
    efforts = tuple(Effort(f"motor_{name}_{k}", name, Symbol("input", "pull"), k) for name, k in single)
    points = tuple(Point(f"in_{body.name}", body.name, vector((0.2, -0.1, 0.3))) for body in scene.bodies)
    scene = point_outputs(
        replace(scene, elements=elements_with(scene, efforts=efforts), points=(*scene.points, *points))
    )
    measured = tuple(
        Output(f"{kind}_{name}_{k}", (Symbol(kind, name, k),)) for name, k in single for kind in ("q", "v")
    )
    return replace(scene, outputs=(*scene.outputs, *measured))


def in_absolute(scene: Scene, groups: str) -> Scene:
    chosen = {"SE3": {}, "R3xSO3": {body.name: "R3xSO3" for body in scene.bodies}, "mixed": mixed_groups(scene)}[groups]
    return replace(scene, coordinates="absolute", groups=chosen)


def both(
    scene: Scene, groups: str, rng: np.random.Generator
) -> tuple[System, System, dict[str, Array], dict[str, Array]]:
    """Return the systems in joint and in absolute coordinates, and states of both that are the same states of the
    bodies."""
    joint = derive(scene, [*JOINT, *ROWS])
    absolute = derive(in_absolute(scene, groups), [*JOINT, *ROWS])
    at_joint = tape_evaluator(joint)
    state = random_states(joint, STATES, rng)
    state = on_base(at_joint, state) if scene.base is not None else state
    return joint, absolute, state, absolute_state(scene, joint, absolute, state, at_joint)


def one_sign(pose: Array) -> Array:
    """Return poses whose quaternions have w > 0: a quaternion and its negative are one orientation."""
    return np.concatenate([pose[..., :4] * np.sign(pose[..., :1]), pose[..., 4:]], axis=-1)


def check_same_motion(joint: System, absolute: System, state: dict[str, Array], moved: dict[str, Array]) -> None:
    at_joint, at_absolute = tape_evaluator(joint), tape_evaluator(absolute)
    own = len(joint.multipliers)
    assert np.abs(at_absolute("constraint", moved)["Phi"][:, : absolute.holonomic - joint.holonomic]).max() <= 1e-13
    if joint.multipliers:
        state = kkt(at_joint, state)
    else:
        state = {**state, "a": at_joint("forward_dynamics", state)["vdot"]}
        assert np.abs(at_absolute("constraint_velocity", moved)["w"]).max() <= 1e-12
    moved = kkt(at_absolute, moved)
    for name in ("poses", "twists"):
        (found,), (expected,) = at_absolute(name, moved).values(), at_joint(name, state).values()
        if name == "poses":
            found, expected = one_sign(found), one_sign(expected)
        assert relative_error(found, expected, 2) <= 1e-12, name
    assert relative_error(at_absolute("outputs", moved)["y"], at_joint("outputs", state)["y"]) <= 1e-10
    found, expected = at_absolute("energy", moved)["energy"], at_joint("energy", state)["energy"]
    for k, name in enumerate(("kinetic", "potential", "power", "base power")):
        assert relative_error(found[:, k, np.newaxis], expected[:, k, np.newaxis], floor=1.0) <= 1e-9, name
    if own:
        np.testing.assert_allclose(moved["lam"][:, -own:], state["lam"], rtol=1e-8, atol=1e-8)


@pytest.mark.slow_except("0-SE3-resting", "1-R3xSO3-translating", "2-mixed-turning")
@pytest.mark.parametrize(
    ("seed", "groups", "base"),
    [(3 * k + j, GROUPS[(k + j) % 3], BASES[j]) for k in range(2) for j in range(3)] + [(4, "R3xSO3", "resting")],
)
def test_same_accelerations_of_points(seed: int, groups: str, base: str, rng) -> None:
    """Springs, efforts, joint stiffness, torsion springs, forces by formula; fixed joints, also on a base that
    moves."""
    scene = loaded(seed)
    scene = scene if base == "resting" else with_base(scene, seed, turning=base == "turning")
    joint, absolute, state, moved = both(scene, groups, rng)
    assert len(absolute.multipliers) == absolute.nv - joint.nv
    check_same_motion(joint, absolute, state, moved)


def joint_angles(joint: System, absolute: System, state: dict[str, Array]) -> Array:
    """Return the angles that absolute coordinates count over turns, from a state in joint coordinates."""
    starts = {factor.name: factor.q_start for factor in joint.factors}
    labels = [label.partition(".angle") for label in absolute.angles]
    return np.stack([state["q"][:, starts[name] + int(index.strip("[]") or 0)] for name, _, index in labels], axis=1)


def over_turns(absolute: System, moved: dict[str, Array], angles: Array, rng: np.random.Generator) -> dict[str, Array]:
    """Return states of absolute bodies whose references of angles are anywhere within half a turn of them."""
    references = angles + rng.uniform(-0.95 * np.pi, 0.95 * np.pi, angles.shape)
    return {**moved, "q": np.concatenate([moved["q"][:, : absolute.nq - len(absolute.angles)], references], axis=1)}


@pytest.mark.slow_cases("5")
@pytest.mark.parametrize("seed", [0, 5])
def test_angles_count_turns_wherever_they_are_numbers(seed: int, rng) -> None:
    """Springs, torsion springs, efforts, formulas and outputs of angles of up to 60 turns, wherever the references
    are."""
    scene = with_base(loaded(seed), seed)
    joint, absolute = (derive(item, [*JOINT, *ROWS]) for item in (scene, in_absolute(scene, "mixed")))
    at_joint = tape_evaluator(joint)
    state = random_states(joint, STATES, rng)
    kinds = {item.name: item.type for item in scene.joints}
    for factor in joint.factors:
        state["q"][:, factor.q_start : factor.q_start + JOINTS[kinds[factor.name]].angles] *= 160.0
    state = on_base(at_joint, state)
    angles = joint_angles(joint, absolute, state)
    moved = over_turns(absolute, absolute_state(scene, joint, absolute, state, at_joint), angles, rng)
    measured = tape_evaluator(absolute)("joint_angles", moved)
    np.testing.assert_allclose(measured["turned"], angles, rtol=1e-14, atol=1e-12)
    check_same_motion(joint, absolute, state, moved)


LOOPS = [("distance", False, "SE3"), ("point_on_line", False, "R3xSO3"), ("cylindrical", True, "mixed")]
LOOPS += [("rolling", False, "R3xSO3")]


def with_followers(seed: int) -> Scene:
    """Return a tree of four joints, three of which follow: an angle minus an angle, a travel a travel, an angle a
    travel."""
    rng = np.random.default_rng(seed)
    bodies = tuple(body_of_masses(name, rng.uniform(0.2, 0.6, 6), rng.uniform(-0.2, 0.3, (6, 3))) for name in "abcde")
    places = [vector(rng.uniform(-0.3, 0.3, 3).tolist()) for _ in bodies]
    mimics = {"B": Mimic("A", number(-2.0), number(0.3)), "D": Mimic("C", number(0.4))}
    mimics["E"] = Mimic("D", number(0.7), number(-0.2))
    kinds = {"A": "revolute", "B": "revolute", "C": "helical", "D": "prismatic", "E": "revolute"}
    parents = {"A": BASE, "B": "a", "C": "a", "D": "b", "E": BASE}
    joints = tuple(
        Joint(
            name,
            kind,
            parents[name],
            name.lower(),
            (0.6, 0.0, 0.8),
            place,
            pitch=number(0.2),
            mimic=mimics.get(name),  # type: ignore[arg-type]
            initial_position=() if name in mimics else (0.0,),
            initial_velocity=() if name in mimics else (0.0,),
            stiffness=number(2.0),
            damping=number(0.3),
        )
        for (name, kind), place in zip(kinds.items(), places, strict=True)
    )
    return point_outputs(Scene("followers", bodies, joints, points=(Point("tip", "d", vector((0.1, 0.2, 0.3))),)))


@pytest.mark.slow_except("mixed")
@pytest.mark.parametrize("groups", GROUPS)
def test_joints_that_follow_others(groups: str, rng) -> None:
    """Four joints lead or follow; the follower of a follower too. In absolute coordinates each follower is one row
    more."""
    scene = with_base(with_followers(2), 2)
    joint, absolute = derive(scene, [*JOINT, *ROWS]), derive(in_absolute(scene, groups), [*JOINT, *ROWS])
    assert (joint.nv, len(absolute.multipliers)) == (2, 28)
    assert absolute.multipliers[:3] == ("B: follows A", "D: follows C", "E: follows D")
    at_joint = tape_evaluator(joint)
    state = random_states(joint, STATES, rng)
    state = on_base(at_joint, {**state, "q": 0.5 * state["q"]})
    free = replace(scene, joints=tuple(replace(item, mimic=None) for item in scene.joints))
    every = derive(free, JOINT)
    q, v = (np.stack([state[name][:, 0], -2.0 * state[name][:, 0], state[name][:, 1]], axis=1) for name in "qv")
    q, v = (np.column_stack([part, 0.4 * part[:, 2], 0.28 * part[:, 2]]) for part in (q, v))
    q = q + np.array([0.0, 0.3, 0.0, 0.0, -0.2])
    moved = absolute_state(free, every, absolute, {**state, "q": q, "v": v}, at_joint)
    check_same_motion(joint, absolute, state, moved)


@pytest.mark.parametrize(("follower", "multiplier"), [("prismatic", 0.01), ("revolute", 0.37), ("revolute", -2.0)])
def test_what_follows_an_angle_over_turns(follower: str, multiplier: float, rng) -> None:
    """A rack, or a gear of any ratio, follows an angle of many turns as the coordinate that it is in joint
    coordinates."""
    scene = with_followers(1)
    leader, rack = scene.joints[:2]
    rack = replace(rack, type=follower, mimic=Mimic("A", number(multiplier), number(0.2)), stiffness=number(0.0))  # type: ignore[arg-type]
    turn = Output("turn", (Symbol("q", "A"),))
    scene = replace(scene, joints=(leader, rack), bodies=scene.bodies[:2], points=(), outputs=(turn,))
    joint, absolute = derive(scene, [*JOINT, *ROWS]), derive(in_absolute(scene, "SE3"), [*JOINT, *ROWS])
    assert absolute.angles == ("A.angle",)
    at_joint = tape_evaluator(joint)
    state = random_states(joint, STATES, rng)
    state["q"] = 40.0 * state["q"]
    free = replace(scene, joints=(leader, replace(rack, mimic=None)))
    every = derive(free, JOINT)
    q, v = (np.stack([state[name][:, 0], multiplier * state[name][:, 0]], axis=1) for name in "qv")
    moved = absolute_state(free, every, absolute, {**state, "q": q + np.array([0.0, 0.2]), "v": v}, at_joint)
    check_same_motion(joint, absolute, state, over_turns(absolute, moved, joint_angles(joint, absolute, state), rng))


@pytest.mark.slow_except("2-R3xSO3")
@pytest.mark.parametrize(("seed", "groups"), [(0, "SE3"), (2, "R3xSO3"), (3, "mixed")])
def test_initial_state_and_its_accelerations(seed: int, groups: str, rng) -> None:
    """The initial state of the joints becomes that of the bodies, on a base that moves at t = 0."""
    scene = with_base(loaded(seed), seed)
    joint = derive(scene, JOINT)
    here = random_states(joint, 1, rng)
    here["t"] = np.zeros((1, 1))
    start = {item.name: item for item in scene.joints}
    for factor in joint.factors:
        initial = {"initial_position": tuple(here["q"][0, factor.q]), "initial_velocity": tuple(here["v"][0, factor.v])}
        start[factor.name] = replace(start[factor.name], **initial)  # type: ignore[arg-type]
    scene = replace(scene, joints=tuple(start.values()))
    joint, absolute = derive(scene, JOINT), derive(in_absolute(scene, groups), [*JOINT, *ROWS])
    at_joint = tape_evaluator(joint)
    here = on_base(at_joint, here)
    np.testing.assert_array_equal(joint.initial_q, here["q"][0])
    expected = absolute_state(scene, joint, absolute, here, at_joint)
    moved = {**here, "q": np.array([absolute.initial_q]), "v": np.array([absolute.initial_v])}
    np.testing.assert_allclose(moved["v"], expected["v"], atol=1e-12)
    for factor in absolute.factors:
        found, wanted = (state["q"][0, factor.q] for state in (moved, expected))
        found, wanted = (found, wanted) if factor.group == "R" else (one_sign(found), one_sign(wanted))
        np.testing.assert_allclose(found, wanted, atol=1e-12)
    check_same_motion(joint, absolute, here, moved)


def test_mass_is_constant_and_block_diagonal(rng) -> None:
    scene = loaded(1)
    for groups in GROUPS:
        system = derive(in_absolute(scene, groups), ["mass", "residual"])
        assert system.facts.constant_mass
        M = tape_evaluator(system)("mass", random_states(system, 1, rng))["M"][0]
        assert np.count_nonzero(M[:6, 6:]) == 0
        assert M[3, 3] == M[4, 4] == M[5, 5] > 0.0
        assert np.count_nonzero(M[:3, 3:6]) == 0
        assert np.linalg.eigvalsh(M).min() > 0.0


def test_a_moving_body_in_its_group() -> None:
    scene = replace(in_absolute(pendulum(), "mixed"), groups={"rod": "R3xSO3"})
    assert [(f.group, f.name, f.q_start, f.v_start) for f in derive(scene, ["residual"]).factors] == [
        ("R", "rod.position", 4, 3),
        ("SO3", "rod.orientation", 0, 0),
    ]
    assert [(f.group, f.name) for f in derive(in_absolute(pendulum(), "SE3"), ["residual"]).factors] == [("SE3", "rod")]


def pendulum(**joint: object) -> Scene:
    hinge = Joint("hinge", "revolute", BASE, "rod", (0.0, 1.0, 0.0), initial_position=(0.3,), initial_velocity=(0.0,))
    return Scene(
        "pendulum", (rigid_body("rod", 2.0, (0, 0, -0.5), (0.1, 0.1, 0.01, 0, 0, 0)),), (replace(hinge, **joint),)
    )


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (
            replace(pendulum(), bodies=(rigid_body("rod", 0.0),)),
            r"bodies\.rod: has no mass, which absolute coordinates cannot carry; try: a mass, or joint",
        ),
        (
            pendulum(rotor_inertia=number(0.1)),
            r"joints\.hinge\.rotor_inertia: has no place in absolute coordinates; try: joint",
        ),
        (
            replace(
                pendulum(type="spherical", initial_position=(1.0, 0.0, 0.0, 0.0), initial_velocity=(0.0,) * 3),
                elements=(Effort("motor", "hinge", number(1.0)),),
            ),
            (
                "joint 'hinge' has no single coordinate that absolute coordinates could measure; try: a force or torque"
                " on the body"
            ),
        ),
        (
            replace(pendulum(), outputs=(Output("swing", (Symbol("a", "hinge"),)),)),
            (
                r"the acceleration a\.hinge of a joint is not a quantity of absolute coordinates; try: the acceleration"
                r" of a point"
            ),
        ),
        (
            replace(
                pendulum(type="free", initial_position=(1.0, *(0.0,) * 6), initial_velocity=(0.0,) * 6),
                elements=(TorsionSpring("t", "hinge", "", number(1.0), number(0.0), number(0.0)),),
            ),
            "joint 'hinge' has no single coordinate",
        ),
    ],
)
def test_what_absolute_coordinates_refuse(scene: Scene, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        derive(in_absolute(scene, "SE3"))


def test_a_description_in_absolute_coordinates_has_the_factors_of_the_joints() -> None:
    scene = flyer_scene()
    expected = derive(scene).factors
    assert describe(scene).joints == ()
    assert describe(replace(scene, coordinates="absolute")).joints == expected
    assert [factor.group for factor in expected] == ["SE3", "SO3", "R"]
    assert expected[-1].q.stop == 7 + 4 + 1 and expected[-1].v.stop == 6 + 3 + 1
