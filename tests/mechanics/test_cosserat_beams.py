"""Geometrically exact beams against matrix logarithms of SciPy, ordinary differential equations and closed forms."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import logm
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from eomgen.lie import product
from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from eomgen.system.system import System
from tests.mechanics.checks import check_partials
from tests.models.cosserat import ROLL_UP, beam_scene, pose_of_last, rest
from tests.oracles.beam_elements import element_to_second_order
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.states import derivative, jacobian, quaternion_product, rotation_of

TERMS = ("residual", "partials", "poses", "energy", "force")
DAMPING = {"stretch": 3.0, "shear_y": 2.0, "shear_z": 1.5, "torsion": 4.0, "bending_y": 5.0, "bending_z": 6.0}
COUPLED = np.diag([500.0, 600.0, 700.0, 1e4, 2e4, 3e4])
COUPLED[0, 4] = COUPLED[4, 0] = 300.0
COUPLED[1, 3] = COUPLED[3, 1] = -400.0
PULL = {"force": ["30 * load", "-20 * load", "10 * load"]}


def bent_beam(elements: int, joint: str, **beam: Any) -> System:
    scene = beam_scene(elements, PULL, {"curvature": [0.02, -0.1, 0.05], "damping": DAMPING, **beam})
    scene["joints"]["clamp"] |= {"type": joint, **({"axis": [0.0, 0.6, 0.8]} if joint == "revolute" else {})}
    return derive(from_data(scene), TERMS)


def states_near(system: System, rng: np.random.Generator, count: int = 6, size: float = 0.4) -> dict[str, Array]:
    """Return states in which all nodes are moved and turned at random from where they start."""
    theta = size * rng.normal(size=(count, system.nv))
    return {
        "q": product.update(system.factors, np.broadcast_to(system.initial_q, (count, system.nq)), theta),
        "v": rng.normal(size=(count, system.nv)),
        "a": rng.normal(size=(count, system.nv)),
        "p": np.ones((count, 1)),
    }


def logarithm(pose: Array, other: Array) -> Array:
    """Return log of one pose in another, rotation first, by SciPy's logarithm of 4 x 4 matrices."""
    first, second = np.eye(4), np.eye(4)
    for matrix, numbers in ((first, pose), (second, other)):
        matrix[:3, :3], matrix[:3, 3] = rotation_of(numbers[:4]), numbers[4:]
    twist = np.real(logm(np.linalg.solve(first, second)))
    return np.array([twist[2, 1], twist[0, 2], twist[1, 0], *twist[:3, 3]])


@pytest.mark.parametrize(("elements", "joint"), [(1, "free"), (3, "fixed"), (3, "revolute")])
def test_the_potential_is_that_of_the_logarithms_of_relative_poses(
    elements: int, joint: str, rng: np.random.Generator
) -> None:
    system = bent_beam(elements, joint, stiffness=None, stiffness_matrix=COUPLED.tolist())
    evaluate, state = tape_evaluator(system), states_near(system, rng)
    found, poses = evaluate("energy", state)["energy"][:, 1], evaluate("poses", state)["pose"]
    length, at_rest = 10.0 / elements, np.array([0.02, -0.1, 0.05, 1.0, 0.0, 0.0])
    stiffness, _ = element_to_second_order(COUPLED, np.eye(6), length, at_rest)
    order = [list(system.bodies).index(name) for name in ("rope", *(f"rope.{k}" for k in range(1, elements + 1)))]
    for energy, nodes in zip(found, poses[:, order], strict=True):
        strains = [logarithm(*pair) / length - at_rest for pair in pairwise(nodes)]
        assert energy == pytest.approx(sum(0.5 * length * e @ stiffness @ e for e in strains), rel=1e-11)


@pytest.mark.parametrize("joint", ["fixed", "free", "revolute"])
def test_forces_are_those_of_the_potential_and_of_the_damping(joint: str, rng: np.random.Generator) -> None:
    system = bent_beam(3, joint)
    evaluate, state = tape_evaluator(system), states_near(system, rng) | {"p": np.zeros((6, 1))}
    still = state | {"v": 0.0 * state["v"]}
    slope = jacobian(evaluate, system.factors, "energy", "energy", still, "q")[:, 1]
    assert relative_error(-evaluate("force", still)["Q"], slope) < 1e-13
    stored = derivative(evaluate, system.factors, "energy", state, {"q": state["v"]})["energy"][:, 1]
    power = np.sum(evaluate("force", state)["Q"] * state["v"], axis=-1)
    lost = evaluate("energy", state)["energy"][:, 2]
    assert np.all(lost < 0.0)
    np.testing.assert_allclose(power, lost - stored, rtol=1e-11)


@pytest.mark.parametrize(("elements", "joint"), [(4, "fixed"), (1, "free"), (4, "revolute")])
def test_tangents_are_exact(elements: int, joint: str, rng: np.random.Generator) -> None:
    system = bent_beam(elements, joint)
    check_partials(system, states_near(system, rng))


def test_tangents_are_exact_where_the_stiffness_is_tunable(rng: np.random.Generator) -> None:
    system = bent_beam(3, "free", stiffness={**ROLL_UP, "torsion": "500 * (1 + load)"}, damping={"torsion": "load"})
    evaluate, state = tape_evaluator(system), states_near(system, rng) | {"p": rng.uniform(0.5, 2.0, size=(6, 1))}
    expected = jacobian(evaluate, system.factors, "residual", "r", state, "q")
    assert relative_error(evaluate("partials", state)["K"], expected, axes=2) < 1e-11


def test_long_beams_have_the_nonzeros_of_the_same_tangents(rng: np.random.Generator) -> None:
    scene = from_data(beam_scene(12, PULL, {"damping": DAMPING}))
    system = derive(scene, ["iteration", "partials"])
    state = states_near(system, rng, count=2)
    evaluate = tape_evaluator(system)
    whole, sparse = evaluate("partials", state), evaluate("iteration", state)
    assert sparse.pop("X").size == 0, "no unknowns of a recursion"
    for name, values in sparse.items():
        rows, columns = np.transpose(system.patterns[name])
        assert np.all(np.abs(rows // 6 - columns // 6) <= 1)
        filled = np.zeros_like(whole[name])
        filled[:, rows, columns] = values
        assert relative_error(filled, whole[name], axes=2) < 1e-14, name


@pytest.mark.parametrize("far", [1.0, 100.0])
def test_rigid_motions_change_neither_energy_nor_forces(far: float, rng: np.random.Generator) -> None:
    system = bent_beam(4, "free")
    evaluate, state = tape_evaluator(system), states_near(system, rng) | {"p": np.zeros((6, 1))}
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    moved = state["q"].copy()
    for factor in system.factors:
        quaternion, place = slice(factor.q_start, factor.q_start + 4), slice(factor.q_start + 4, factor.q_start + 7)
        moved[:, quaternion] = quaternion_product(np.broadcast_to(turn, (6, 4)), state["q"][:, quaternion])
        moved[:, place] = state["q"][:, place] @ rotation_of(turn).T + far
    there = state | {"q": moved}
    one, other = (evaluate("energy", item)["energy"][:, 1] for item in (state, there))
    assert np.max(np.abs(one - other) / one) < 1e-13 * far
    assert relative_error(evaluate("force", there)["Q"], evaluate("force", state)["Q"]) < 1e-12 * far


@pytest.mark.slow
@pytest.mark.parametrize(("elements", "places"), [(3, 2), (8, 1)])
def test_a_moment_rolls_a_beam_up_wherever_it_is(elements: int, places: int, rng: np.random.Generator) -> None:
    for turn in Rotation.random(places, random_state=rng):
        axis = turn.apply([0.0, 1.0, 0.0]) * 2.0 * np.pi * 500.0 / 10.0
        torque = [f"{number!r} * load" for number in axis.tolist()]
        scene = beam_scene(elements, {"torque": torque}, orientation=turn.as_matrix().tolist())
        system = derive(from_data(scene), TERMS)
        last = pose_of_last(system, rest(system, 16))
        assert np.linalg.norm(last[4:]) < 1e-9 * 10.0
        relative = turn.inv() * Rotation.from_quat(np.roll(last[:4], -1))
        assert relative.magnitude() < 1e-9


def elastica(load: float, EI: float, EA: float, GA: float) -> tuple[float, float]:
    """Return where the tip of a clamped beam of 10 m is under a dead force across it (Reissner's plane equations)."""

    def slopes(_: float, y: Array) -> Array:
        angle = y[2]
        axial, across = load * np.sin(angle), load * np.cos(angle)
        stretch, shear = 1.0 + axial / EA, across / GA
        x = stretch * np.cos(angle) - shear * np.sin(angle)
        z = stretch * np.sin(angle) + shear * np.cos(angle)
        return np.array([x, z, y[3] / EI, -load * x])

    def end(moment: Array) -> Array:
        run = solve_ivp(slopes, (0.0, 10.0), [0.0, 0.0, 0.0, float(moment[0])], method="DOP853", rtol=1e-12, atol=1e-12)
        return np.asarray(run.y[:, -1])

    found = root(lambda moment: end(moment)[3], [load * 8.0], tol=1e-13)
    x, z, *_ = end(found.x)
    return float(x), float(z)
