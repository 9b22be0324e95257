"""Strains and section loads of geometrically exact beams against matrix exponentials of SciPy, and statics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from tests.mechanics.test_cosserat_beams import COUPLED, DAMPING, logarithm, states_near
from tests.models.cosserat import beam_scene, rest
from tests.oracles.beam_elements import element_to_second_order
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.states import rotation_of

pytestmark = pytest.mark.slow

AT_REST = np.array([0.02, -0.1, 0.05, 1.0, 0.0, 0.0])
#: By rotations first; bending along y turns about z.
STIFFNESS = {
    "torsion": 500.0,
    "bending_z": 600.0,
    "bending_y": 700.0,
    "stretch": 800.0,
    "shear_y": 900.0,
    "shear_z": 950.0,
}
TERMS = ("section_loads", "poses", "twists")


def skew(x: Array) -> Array:
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


def moved(load: Array, screw: Array) -> Array:
    """Return a wrench, moment first, at a frame that is exp(screw) in the one it is given in, in the axes there."""
    pose = expm(np.block([[skew(screw[:3]), screw[3:, None]], [np.zeros((1, 4))]]))
    back = pose[:3, :3].T
    return np.concatenate([back @ (load[:3] - np.cross(pose[:3, 3], load[3:])), back @ load[3:]])


def later(pose: Array, twist: Array, time: float) -> Array:
    """Return a pose that moves with a constant twist of its own axes, quaternion and position."""
    angle = time * float(np.linalg.norm(twist[:3]))
    turn = np.array([np.cos(0.5 * angle), *(0.5 * time * np.sinc(0.5 * angle / np.pi) * twist[:3])])
    w, n = pose[0], pose[1:4]
    quaternion = np.concatenate([[w * turn[0] - n @ turn[1:]], w * turn[1:] + turn[0] * n + np.cross(n, turn[1:])])
    step = expm(time * np.block([[skew(twist[:3]), twist[3:, None]], [np.zeros((1, 4))]]))[:3, 3]
    return np.concatenate([quaternion, pose[4:] + rotation_of(pose[:4]) @ step])


@pytest.mark.parametrize("joint", ["fixed", "revolute"])
def test_strains_and_loads_are_those_of_logarithms_and_of_statics(joint: str, rng: np.random.Generator) -> None:
    shape: dict[str, Any] = {"curvature": AT_REST[:3].tolist(), "damping": DAMPING, "stiffness": None}
    scene = beam_scene(3, {"force": [0.0, 0.0, 0.0]}, {**shape, "stiffness_matrix": COUPLED.tolist()})
    scene["joints"]["clamp"] |= {"type": joint, **({"axis": [0.0, 0.6, 0.8]} if joint == "revolute" else {})}
    system = derive(from_data(scene), TERMS)
    evaluate, state = tape_evaluator(system), states_near(system, rng, count=3)
    found, poses, twists = evaluate("section_loads", state), *(evaluate(name, state) for name in TERMS[1:])
    length, order = 10.0 / 3.0, [list(system.bodies).index(name) for name in ("rope", "rope.1", "rope.2", "rope.3")]
    damping = np.diag([4.0, 6.0, 5.0, 3.0, 2.0, 1.5])  # as DAMPING, by rotations: bending along y turns about z
    stiffness, damping = element_to_second_order(COUPLED, damping, length, AT_REST)
    np.testing.assert_allclose(found["x"], np.broadcast_to(length * np.array([0.5, 1.5, 2.5]), (3, 3)), rtol=1e-15)
    weights, points = np.polynomial.legendre.leggauss(12)[::-1]
    for row in range(3):
        nodes, rates = poses["pose"][row, order], twists["twist"][row, order]
        for k in range(3):
            screw = logarithm(nodes[k], nodes[k + 1])
            strain = screw / length - AT_REST
            around = [
                logarithm(*(later(nodes[j], rates[j], time) for j in (k, k + 1))) / length for time in (-1e-5, 1e-5)
            ]
            load = stiffness @ strain + damping @ (around[1] - around[0]) / 2e-5
            first, last = found["load_at_ends"][row, k]
            mean = sum(0.5 * w * moved(first, 0.5 * (s + 1.0) * screw) for w, s in zip(weights, points, strict=True))
            assert relative_error(found["strain"][row, k], np.linalg.solve(COUPLED, stiffness @ strain)) < 1e-12
            assert relative_error(found["load"][row, k], load) < 1e-8  # of differences in time
            assert relative_error(mean, found["load"][row, k]) < 1e-12
            assert relative_error(moved(first, screw), last) < 1e-12


@pytest.mark.parametrize("elements", [1, 2, 6])
def test_at_rest_sections_bear_what_acts_beyond_them(elements: int) -> None:
    """Force and lever of a dead load at the tip, whatever the number of elements."""
    force = np.array([3.0, -2.0, 5.0])
    system = derive(from_data(beam_scene(elements, {"force": force.tolist()})), (*TERMS, "residual", "partials"))
    state = {"q": rest(system, 4), "v": np.zeros(system.nv), "a": np.zeros(system.nv), "p": np.ones(1)}
    evaluate = tape_evaluator(system)
    found, poses = evaluate("section_loads", state)["load_at_ends"], evaluate("poses", state)["pose"]
    names = ("rope", *(f"rope.{k}" for k in range(1, elements + 1)))
    poses = poses[[list(system.bodies).index(name) for name in names]]
    for k in range(elements):
        for end in (0, 1):
            axes, place = rotation_of(poses[k + end, :4]), poses[k + end, 4:]
            moment = np.cross(poses[-1, 4:] - place, force)
            np.testing.assert_allclose(found[k, end, 3:], axes.T @ force, atol=1e-9)
            np.testing.assert_allclose(found[k, end, :3], axes.T @ moment, atol=1e-8)


@pytest.mark.parametrize(("model", "missing"), [("kirchhoff", 2), ("inextensible", 3)])
def test_strains_that_a_beam_does_not_have_bear_their_multipliers(
    model: str, missing: int, rng: np.random.Generator
) -> None:
    kept = {strain: stiffness for place, (strain, stiffness) in enumerate(STIFFNESS.items()) if place < 6 - missing}
    beam = {"model": model, "stiffness": kept}
    system = derive(from_data(beam_scene(3, {"force": [0.0, 0.0, 0.0]}, beam)), ("section_loads", "poses"))
    state = states_near(system, rng, count=2) | {"lam": rng.normal(size=(2, 3 * missing))}
    evaluate = tape_evaluator(system)
    found = evaluate("section_loads", state)
    diagonal = np.array([*STIFFNESS.values()][: 6 - missing])
    np.testing.assert_allclose(found["load"][..., : 6 - missing], diagonal * found["strain"][..., : 6 - missing])
    forces = state["lam"].reshape(2, 3, missing)
    np.testing.assert_array_equal(found["load"][..., 6 - missing :], forces)
    order = [list(system.bodies).index(name) for name in ("rope", "rope.1", "rope.2", "rope.3")]
    for row, poses in enumerate(evaluate("poses", state)["pose"][:, order]):
        for k in range(3):
            first, last = found["load_at_ends"][row, k]
            assert relative_error(moved(first, logarithm(poses[k], poses[k + 1])), last) < 1e-11
