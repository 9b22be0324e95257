"""Geometrically exact beams whose sections have their mass off the axis: energy of rigid motions, weight, tangents."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from tests.mechanics.checks import check_partials
from tests.mechanics.test_cosserat_beams import PULL, TERMS, states_near
from tests.models.cosserat import beam_scene, pose_of_last, rest
from tests.oracles.evaluation import Array, tape_evaluator

MASS, ABOUT, CENTER = "1 + s", [0.3, 0.1, 0.2], ["0.3 - 0.2 * s", "0.1 * s**2"]


def kinetic_energy(omega: Array, velocity: Array, places: int = 20_000) -> float:
    """Return the kinetic energy of the beam of 10 m in a rigid motion, by the midpoint rule along its axis."""
    s = (np.arange(places) + 0.5) / places
    x = np.stack([10.0 * s, 0.3 - 0.2 * s, 0.1 * s**2], axis=1)
    v = velocity + np.cross(omega, x)
    found: float = np.mean(5.0 * (1.0 + s) * np.sum(v * v, axis=1)) + 5.0 * np.sum(ABOUT * omega**2)
    return found


def found_energy(elements: int, omega: Array, velocity: Array) -> float:
    """Return the kinetic energy of the same motion from the nodes of a straight beam."""
    beam = {"mass_per_length": MASS, "rotary_inertia": ABOUT, "center_of_mass": CENTER}
    system = derive(from_data(beam_scene(elements, PULL, beam, type="free")), ["energy"])
    nodes = np.linspace(0.0, 10.0, elements + 1)
    twists = [np.concatenate([omega, velocity + np.cross(omega, [x, 0.0, 0.0])]) for x in nodes]
    state = {"q": system.initial_q, "v": np.concatenate(twists), "a": np.zeros(system.nv), "p": np.ones(1)}
    energy: float = tape_evaluator(system)("energy", state)["energy"][0]
    return energy


def test_the_energy_of_rigid_motions_nears_its_integral_with_the_square() -> None:
    omega, velocity = np.array([0.7, -0.4, 0.5]), np.array([1.0, 2.0, -0.5])
    exact = kinetic_energy(omega, velocity)
    errors = [abs(found_energy(elements, omega, velocity) - exact) for elements in (4, 8, 16)]
    assert errors[0] < 0.02 * exact
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.1)


def test_a_turn_about_the_axis_has_the_energy_of_the_offset() -> None:
    found = found_energy(2, np.array([1.0, 0.0, 0.0]), np.zeros(3))
    points, weights = np.polynomial.legendre.leggauss(4)
    places = 0.5 + 0.5 * points
    offset = (0.3 - 0.2 * places) ** 2 + (0.1 * places**2) ** 2
    assert found == pytest.approx(5.0 * np.sum(0.5 * weights * (ABOUT[0] + (1.0 + places) * offset)), rel=1e-9)


def test_weight_beside_the_axis_twists_by_its_closed_form() -> None:
    gravity, offset, torsion, length = 1e-4, 0.25, 500.0, 10.0
    scene = beam_scene(4, {"force": [0.0, 0.0, 0.0]}, {"center_of_mass": [offset, 0.0]})
    scene["gravity"] = [0.0, 0.0, -gravity]
    system = derive(from_data(scene), TERMS)
    quaternion = pose_of_last(system, rest(system, 1))[:4]
    twist = 2.0 * quaternion[1] / quaternion[0]
    assert twist == pytest.approx(-gravity * offset * length**2 / (2.0 * torsion), rel=1e-4)


@pytest.mark.parametrize("joint", ["fixed", "free"])
def test_tangents_are_exact(joint: str, rng: np.random.Generator) -> None:
    beam: dict[str, Any] = {"center_of_mass": CENTER, "mass_per_length": MASS, "curvature": [0.02, -0.1, 0.05]}
    system = derive(from_data(beam_scene(3, PULL, beam, type=joint)), TERMS)
    check_partials(system, states_near(system, rng))
