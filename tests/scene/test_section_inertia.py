"""Offset centres of mass and 6 x 6 inertias of sections: what nodes have, and what is refused."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate
from eomgen.scene.bodies.cross_sections import MatrixRule
from eomgen.scene.bodies.model import Body
from eomgen.scene.load import from_data
from tests.oracles.evaluation import Array

ROTARY = {"mass_per_length": None, "rotary_inertia": None}


def beam(**keys: Any) -> dict[str, Any]:
    """Return a clamped beam of 3 m with three elements, and other keys; None takes a key away."""
    blade: dict[str, Any] = {
        "model": "cosserat",
        "length": 3.0,
        "elements": 3,
        "mass_per_length": 2.0,
        "rotary_inertia": [0.06, 0.02, 0.05],
        "stiffness": dict.fromkeys(("stretch", "shear_y", "shear_z", "torsion", "bending_y", "bending_z"), 1e3),
    }
    blade = {key: value for key, value in {**blade, **keys}.items() if value is not None}
    return {
        "format": 1,
        "name": "blade",
        "parameters": {"offset": {"value": 0.1, "tunable": True}},
        "beams": {"blade": blade},
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "blade"}},
    }


def matrix(mass: float, y: float, z: float, about: Array) -> Array:
    """Return the inertia about the axis of a section with a centre of mass at (y, z): the sum over four masses."""
    moments, axes = np.linalg.eigh(0.5 * np.trace(about) * np.eye(3) - about)
    found = np.zeros((6, 6))
    for moment, axis in zip(moments, axes.T, strict=True):
        for side in (-1.0, 1.0):
            found += _at(mass / 6.0, np.array([0.0, y, z]) + side * np.sqrt(3.0 * max(moment, 0.0) / mass) * axis)
    return found


def _at(mass: float, place: Array) -> Array:
    """Return the inertia of a mass at a place: v + omega x place, squared."""
    cross = np.array([[0.0, -place[2], place[1]], [place[2], 0.0, -place[0]], [-place[1], place[0], 0.0]])
    velocity = np.hstack([-cross, np.eye(3)])
    found: Array = mass * velocity.T @ velocity
    return found


ABOUT = np.array([[0.07, 0.0, 0.0], [0.0, 0.02, 0.004], [0.0, 0.004, 0.05]])
MATRIX = matrix(2.0, 0.1, -0.03, ABOUT)


def inertia_of(body: Body, offset: float = 0.1) -> tuple[float, list[float], list[float]]:
    def number(formula: Any) -> float:
        return evaluate(formula, lambda _: offset)

    return number(body.mass), [number(x) for x in body.center_of_mass], [number(x) for x in body.inertia]


def test_a_matrix_gives_mass_centre_and_rotary_inertia_about_it() -> None:
    scene = from_data(beam(inertia_matrix=MATRIX.tolist(), **ROTARY))
    mass, center, inertia = inertia_of(scene.bodies[1])
    assert mass == pytest.approx(2.0)
    assert center == pytest.approx([0.0, 0.1, -0.03])
    assert inertia == pytest.approx([0.07, 0.02, 0.05, 0.0, 0.0, 0.004])
    assert inertia_of(scene.bodies[0])[2] == pytest.approx([0.035, 0.01, 0.025, 0.0, 0.0, 0.002])


def test_a_centre_of_mass_is_where_the_rotary_inertia_is_about() -> None:
    scene = from_data(beam(center_of_mass=["offset", 0.02]))
    assert inertia_of(scene.bodies[1], 0.3) == (2.0, [0.0, 0.3, 0.02], [0.06, 0.02, 0.05, 0.0, 0.0, 0.0])


def test_a_node_between_unlike_elements_has_the_inertia_of_both_halves() -> None:
    whole = beam(center_of_mass=["offset * s", "0.1 * (1 - s)"], mass_per_length="1 + s")
    body = from_data(whole).bodies[1]
    expected = np.zeros((6, 6))
    points, weights = np.polynomial.legendre.leggauss(4)
    for s, weight in zip(1 / 3 + points / 6, weights / 2, strict=True):  # 1 m from s = 1/6 to 1/2
        about = np.diag([0.06, 0.02, 0.05])
        expected += weight * matrix(1 + s, 0.1 * s, 0.1 * (1 - s), about)
    mass, center, (xx, yy, zz, xy, xz, yz) = inertia_of(body)
    found = matrix(mass, center[1], center[2], np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)


def test_a_part_has_its_own_inertia() -> None:
    part = {"length": 1.0, "elements": 1}
    parts = [part, {**part, "inertia_matrix": MATRIX.tolist()}, {**part, "center_of_mass": [0.0, 0.2]}]
    scene = from_data(beam(length=None, elements=None, parts=parts, center_of_mass=[0.05, 0.0]))
    centers = [inertia_of(body)[1] for body in scene.bodies]
    np.testing.assert_allclose(centers, [[0, 0.05, 0], [0, 0.075, -0.015], [0, 0.05, 0.085], [0, 0.0, 0.2]], atol=1e-15)


def with_entry(row: int, column: int, value: float, *, both: bool = True) -> list[list[float]]:
    changed = MATRIX.copy()
    changed[row, column] = value
    if both:
        changed[column, row] = value
    return changed.tolist()


@pytest.mark.parametrize("length", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("share", "refused"), [(3e-7, False), (1e-5, True)])
def test_rounding_of_a_section_is_judged_alike_in_all_units_of_length(
    share: float, refused: bool, length: float
) -> None:
    """A product of mass and place that no rigid section has, as a part of the root of mass times moment."""
    scaled = matrix(2.0, 0.1 * length, -0.3 * length, length**2 * ABOUT)
    scaled[0, 3] = scaled[3, 0] = share * np.sqrt(2.0 * np.abs(scaled[:3, :3]).max())
    rule = MatrixRule()
    assert bool(rule.broken(np.ravel(scaled).tolist())) == refused
    fault, _ = rule.fault(np.ravel(scaled).tolist())
    assert fault.startswith("no rigid section has this inertia: entry [0][3]") == refused


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "not symmetric": (
        {"inertia_matrix": with_entry(0, 5, 0.3, both=False)},
        "the matrix is not symmetric: entry [0][5] differs from [5][0]; try: the mean of both",
    ),
    "no mass": ({"inertia_matrix": with_entry(3, 3, 0.0)}, "the mass per length, entry [3][3], is 0; try: a number"),
    "two masses": (
        {"inertia_matrix": with_entry(4, 4, 3.0)},
        "no rigid section has this inertia: entry [4][4], a mass, is 3 where 2 belongs; try: [[J, S], [-S, m]]",
    ),
    "centre before the section": (
        {"inertia_matrix": with_entry(1, 5, 0.3)},
        "no rigid section has this inertia: entry [1][5], a product of mass and place, is 0.3 where 0 belongs",
    ),
    "about the centre of mass": (
        {"inertia_matrix": with_entry(2, 2, 0.01)},
        "the rotary inertia about the centre of mass is not positive definite: its smallest eigenvalue is -0.0105",
    ),
    "triangle": ({"inertia_matrix": with_entry(0, 0, 0.2)}, "about the centre of mass, the principal moments 0.0194"),
    "along the axis": (
        {"inertia_matrix": matrix(2.0, 0.0, 0.0, ABOUT).tolist(), "section": None, "center_of_mass": [0.1, 0.0]},
        "center_of_mass is given, and inertia_matrix too, which has it; try: one of them",
    ),
    "varied": (
        {"inertia_matrix": [[f"{x} * (0.5 - s)" for x in row] for row in MATRIX.tolist()]},
        "the mass per length, entry [3][3], is 0",
    ),
}


@pytest.mark.parametrize(("keys", "message"), list(REFUSED.values()), ids=list(REFUSED))
def test_what_no_section_weighs_is_refused_with_one_message(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)) as caught:
        from_data(beam(**ROTARY, **keys))
    assert len(caught.value.problems) == 1, str(caught.value)


def test_small_deflections_have_neither_key() -> None:
    data = beam(model=None, center_of_mass=[0.1, 0.0])
    with pytest.raises(DescriptionError) as caught:
        from_data(data)
    message = "(beams.blade.center_of_mass): a beam of the model euler_bernoulli has no center_of_mass"
    assert message in str(caught.value)
