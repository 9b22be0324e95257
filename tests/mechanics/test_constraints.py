"""Constraint rows and their derivatives: against complex step, against motions that each type means to allow, and
rolling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.joint_types import CONSTRAINTS
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE
from eomgen.system.system import System
from tests.mechanics.checks import check_partials, check_powers, states_of
from tests.models.elements import elements_with
from tests.oracles.constrained import (
    FREEDOMS,
    constraint,
    freely_displaced,
    kkt,
    mixed_groups,
    on_constraints,
    small_body,
    variants,
    weighty,
)
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import value_of, vector
from tests.oracles.random_scenes import random_scene, shaking_base, with_base, with_loads
from tests.oracles.states import (
    STEP,
    derivative,
    displaced,
    jacobian,
    quaternion_product,
    random_unit_quaternions,
    rotation_of,
)

STATES = 4
TERMS = [
    "constraint",
    "constraint_velocity",
    "constraint_bias",
    "constraint_jacobian",
    "velocity_partials",
    "residual",
    "partials",
    "equations",
    "iteration",
    "jacobian_values",
]


def two_bodies(seed: int, *, base: bool) -> Scene:
    """Return two free bodies, on a base that shakes where ``base`` is true."""
    joints = tuple(replace(free_joint(name), position=vector((0.3, -0.2, 0.5))) for name in ("one", "two"))
    scene = Scene("pair", (small_body("one"), small_body("two")), joints)
    return replace(scene, base=shaking_base(np.random.default_rng(seed))) if base else scene


def free_joint(name: str) -> Joint:
    return Joint(name, "free", BASE, name, initial_position=(1.0, *(0.0,) * 6), initial_velocity=(0.0,) * 6)


def check_derivatives(system: System, state: dict[str, Array]) -> None:
    """Compare B, Phi', bias, Z, K, C and the packed forms with complex steps along left-trivialised directions."""
    evaluate, factors, rows = tape_evaluator(system), system.factors, system.holonomic
    along = {"q": state["v"], "t": np.ones((STATES, 1))}
    B = evaluate("constraint_jacobian", state)["B"]
    w = evaluate("constraint_velocity", state)["w"]
    if rows:
        assert relative_error(B[:, :rows], jacobian(evaluate, factors, "constraint", "Phi", state, "q"), 2) <= 1e-12
        assert (
            relative_error(w[:, :rows], derivative(evaluate, factors, "constraint", state, along)["Phi"], floor=1e-3)
            <= 1e-11
        )
    assert relative_error(B, jacobian(evaluate, factors, "constraint_velocity", "w", state, "v"), 2) <= 1e-11
    bias = evaluate("constraint_bias", state)["g"]
    assert (
        relative_error(bias, derivative(evaluate, factors, "constraint_velocity", state, along)["w"], floor=1e-3)
        <= 1e-10
    )
    Z = evaluate("velocity_partials", state)["Z"]
    expected = jacobian(evaluate, factors, "constraint_velocity", "w", state, "q")
    assert relative_error(Z, expected, 2, floor=1e-3) <= 1e-10
    check_partials(system, state, 1e-10, floor=1e-3)
    found = evaluate("partials", state)
    lam = jacobian(evaluate, factors, "residual", "r", state, "lam")
    assert relative_error(np.swapaxes(B, 1, 2), lam, 2) <= 1e-12
    together, packed = evaluate("equations", state), evaluate("iteration", state)
    np.testing.assert_allclose(together["w"], w, rtol=0, atol=1e-12)
    for name, dense in (*found.items(), ("B", B), ("Z", Z)):
        full = np.zeros(dense.shape)
        if system.patterns[name]:
            full[(slice(None), *np.transpose(system.patterns[name]))] = packed[name]
        np.testing.assert_allclose(full, dense, rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind, driven, shape", variants())
def test_derivatives_of_every_type(kind: str, driven: bool, shape: str, rng) -> None:
    """Each between two bodies, a body and the base, or the base and a body, in joint or in absolute coordinates."""
    number = variants().index((kind, driven, shape))
    first, second = (("one", "two"), ("one", BASE), (BASE, "two"))[number % 3]
    coordinates = ("joint", "absolute")[number // 3 % 2]
    scene = two_bodies(3, base=number % 3 > 0)
    item = constraint(rng, kind, first, second, driven=driven, shape=shape)
    scene = replace(scene, constraints=(item,), coordinates=coordinates, groups={"one": "R3xSO3"})
    system = derive(scene, TERMS)
    holonomic, level = CONSTRAINTS[kind].rows
    assert (system.holonomic, len(system.multipliers)) == (holonomic + driven, holonomic + driven + level)
    assert all(name.startswith("loop: ") for name in system.multipliers)
    check_derivatives(system, states_of(system, rng))


@pytest.mark.slow_except("0", "1", "3")
@pytest.mark.parametrize("seed", range(6))
def test_derivatives_of_trees_with_loops(seed: int, rng) -> None:
    """Joints of the tree as constraints, springs and efforts between absolute bodies, and a loop besides."""
    scene = weighty(with_loads(random_scene(seed, 3), seed), seed)
    efforts = tuple(item for item in scene.efforts if kind_of(scene, item.joint) in ("revolute", "prismatic"))
    scene = with_base(scene, seed) if seed % 2 else scene
    kind = ("revolute", "distance", "universal", "rolling", "planar", "point_on_line")[seed]
    loop = constraint(rng, kind, BASE, scene.bodies[-1].name, driven=seed == 0)
    elements = elements_with(scene, efforts=efforts)
    scene = replace(scene, elements=elements, constraints=(loop,), coordinates="absolute", groups=mixed_groups(scene))
    system = derive(scene, TERMS)
    check_derivatives(system, states_of(system, rng))


def kind_of(scene: Scene, joint: str) -> str:
    return next(item.type for item in scene.joints if item.name == joint)


def quaternion_of(R: Array) -> Array:
    """Return the quaternion of a matrix turned less than half a turn; it may have an infinitesimal imaginary part."""
    w = 0.5 * np.sqrt(1.0 + np.trace(R))
    return np.array([w, *(np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4.0 * w))])


def pair_state(scene: Scene, second_in_first: tuple[Array, Array], one: Array) -> Array:
    """Return q of two free bodies, the first posed by ``one``, the second where its frame has the given pose in the
    first's."""
    item = scene.constraints[0]
    F, G = np.array(item.first.orientation), np.array(item.second.orientation)
    f, g = (np.array([value_of(part, {}) for part in side.position]) for side in (item.first, item.second))
    R, x = rotation_of(one[:4]), one[4:]
    D, d = second_in_first
    turned = R @ F @ D @ G.T
    return np.array([*one, *quaternion_of(turned), *(x + R @ (f + F @ d) - turned @ g)])


@pytest.mark.parametrize("kind, driven, shape", variants())
def test_what_each_type_allows(kind: str, driven: bool, shape: str, rng) -> None:
    """Rows vanish where the frames are as the type means it, and B leaves exactly the motions that keep them so."""
    scene = replace(
        two_bodies(0, base=False), constraints=(constraint(rng, kind, "one", "two", driven=driven, shape=shape),)
    )
    system = derive(scene, ["constraint", "constraint_jacobian"])
    evaluate = tape_evaluator(system)
    t, s = rng.uniform(0.2, 1.0), rng.uniform(-0.8, 0.8, FREEDOMS[kind])
    one = np.concatenate([random_unit_quaternions(rng, 1)[0], rng.uniform(-1.0, 1.0, 3)])
    q = pair_state(scene, freely_displaced(kind, s, t, driven, shape), one)
    state = {"q": q[np.newaxis], "t": np.array([[t]])}
    assert np.abs(evaluate("constraint", state)["Phi"]).max() <= 1e-13
    directions = []
    for k in range(len(s)):
        moved = s + 1j * STEP * np.eye(len(s))[k]
        displacement = freely_displaced(kind, moved, t, driven, shape)
        directions.append(body_velocity(q, pair_state(scene, displacement, one.astype(complex)).imag / STEP))
    for k in range(6):  # the whole pair as one rigid body
        moved = displaced(system.factors[:1], one, 1j * STEP * np.eye(6)[k])
        displacement = freely_displaced(kind, s, t, driven, shape)
        directions.append(body_velocity(q, pair_state(scene, displacement, moved).imag / STEP))
    B = evaluate("constraint_jacobian", state)["B"][0, : CONSTRAINTS[kind].rows[0] + driven]
    allowed = np.array(directions)
    assert np.abs(B @ allowed.T).max() <= 1e-12
    freedoms = np.linalg.matrix_rank(allowed, tol=1e-9)
    assert freedoms == FREEDOMS[kind] - driven + 6
    assert np.linalg.matrix_rank(B, tol=1e-9) == len(B) == 12 - freedoms


def body_velocity(q: Array, rate: Array) -> Array:
    """Return the body twists of two poses (quaternion, position) from their rates."""
    found = []
    for start in (0, 7):
        pose, change = q[start : start + 7], rate[start : start + 7]
        inverse = pose[:4] * np.array([1.0, -1.0, -1.0, -1.0])
        found += [*2.0 * quaternion_product(inverse, change[:4])[1:], *rotation_of(pose[:4]).T @ change[4:]]
    return np.array(found)


@pytest.mark.parametrize("shape", ["disc", "sphere"])
def test_rolling_without_slip(shape: str, rng) -> None:
    """A wheel on the plane of another body that moves: pure rolling meets the rows, slip is what they give."""
    scene = replace(two_bodies(0, base=False), constraints=(constraint(rng, "rolling", "one", "two", shape=shape),))
    system = derive(scene, ["constraint", "constraint_velocity", "constraint_jacobian"])
    evaluate, item = tape_evaluator(system), scene.constraints[0]
    one = np.concatenate([random_unit_quaternions(rng, 1)[0], rng.uniform(-1.0, 1.0, 3)])
    D, d = freely_displaced("rolling", rng.uniform(-0.8, 0.8, 5), 0.0, False, shape)
    q = pair_state(scene, (D, d), one)
    R, S = rotation_of(q[:4]), rotation_of(q[7:11])
    F = R @ np.array(item.first.orientation)
    f, g = (np.array([value_of(part, {}) for part in side.position]) for side in (item.first, item.second))
    center = q[11:] + S @ g
    np.testing.assert_allclose(center, q[4:7] + R @ f + F @ d, atol=1e-14)
    normal, axle = F[:, 2], S @ np.array(item.second.orientation)[:, 2]
    reach = normal if shape == "sphere" else normal - (normal @ axle) * axle
    contact = center - 0.45 * reach / np.linalg.norm(reach)
    assert abs((contact - q[4:7] - R @ f) @ normal) <= 1e-14
    omega_one, speed_one, omega_two = rng.uniform(-2.0, 2.0, (3, 3))
    ground = speed_one + np.cross(omega_one, contact - q[4:7])
    for slip in (np.zeros(3), 0.3 * F[:, 0] - 0.7 * F[:, 1]):
        speed_two = ground + slip - np.cross(omega_two, contact - q[11:])
        v = np.concatenate([R.T @ omega_one, R.T @ speed_one, S.T @ omega_two, S.T @ speed_two])
        w = evaluate("constraint_velocity", {"q": q, "v": v})["w"]
        np.testing.assert_allclose(w, [0.0, *(slip @ F[:, :2])], atol=1e-14)
    assert np.linalg.matrix_rank(evaluate("constraint_jacobian", {"q": q, "v": v})["B"]) == 3


@pytest.mark.slow_except("0-resting-joint", "4-translating-absolute", "5-turning-absolute", "3-turning-joint")
@pytest.mark.parametrize(
    ("seed", "base", "coordinates"),
    [(seed, ("resting", "translating", "turning")[seed % 3], ("joint", "absolute")[seed // 3]) for seed in range(6)]
    + [(3, "turning", "joint"), (1, "translating", "absolute"), (0, "resting", "absolute")],
)
def test_energy_changes_by_the_powers_only(seed: int, base: str, coordinates: str, rng) -> None:
    """Springs, efforts, forces, a loop and a driver on a moving base, whose wrench comes through all of them."""
    scene = weighty(with_loads(random_scene(seed, 4), seed), seed)
    efforts = tuple(item for item in scene.efforts if kind_of(scene, item.joint) in ("revolute", "prismatic"))
    kind = ("cylindrical", "distance", "prismatic", "rolling", "spherical", "revolute")[seed]
    scene = replace(scene, bodies=(*scene.bodies, small_body("wheel")), joints=(*scene.joints, free_joint("wheel")))
    scene = replace(scene, elements=elements_with(scene, efforts=efforts))
    scene = scene if base == "resting" else with_base(scene, seed, turning=base == "turning")
    loop = constraint(rng, kind, BASE if seed % 2 else scene.bodies[0].name, "wheel", driven=seed in (0, 2, 5))
    elements = elements_with(scene, efforts=efforts)
    scene = replace(scene, elements=elements, constraints=(loop,), coordinates=coordinates, groups=mixed_groups(scene))
    system = derive(scene, ["energy", "mass", *TERMS[1:4], "residual"])
    evaluate = tape_evaluator(system)
    assert ("lam" in system.functions["energy"].inputs) == (loop.drive is not None)
    state = kkt(evaluate, on_constraints(evaluate, states_of(system, rng)))
    base_power = check_powers(system, state, 1e-10)[:, 3]
    assert (np.abs(base_power).max() > 0.0) == (scene.base is not None or loop.drive is not None)
