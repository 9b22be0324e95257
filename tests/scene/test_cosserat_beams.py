"""Geometrically exact beams in scene files: what is read, what follows from a section, what sits on nodes, and what is
refused."""

# ruff: noqa: E501 (a row of the table is a message, quoted whole)

from __future__ import annotations

import copy
import re
from typing import Any

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from tests.models.cosserat import ROLL_UP, beam_scene


def numbers(formulas: tuple[Formula, ...]) -> list[float]:
    return [evaluate(formula, lambda symbol: {"load": 1.0}[symbol.name]) for formula in formulas]


def beam_of(scene: Scene) -> Any:
    return next(element.beam for element in scene.elements if isinstance(element, CosseratBeam))


def changed(path: str, value: Any) -> dict[str, Any]:
    """Return a beam of 8 elements with another value at a path; None takes the key away."""
    data = copy.deepcopy(beam_scene(8, {"force": [0.0, 0.0, 1.0]}))
    *parts, last = path.split(".")
    table = data
    for part in parts:
        table = table.setdefault(part, {})
    if value is None:
        del table[last]
    else:
        table[last] = value
    return data


def test_nodes_share_the_mass_and_all_that_sits_on_the_beam_sits_on_them() -> None:
    data = changed("points.middle", {"body": "rope", "position": [5.0, 0.1, 0.2]})
    scene = from_data(data)
    masses = [numbers((body.mass,))[0] for body in scene.bodies]
    assert [body.name for body in scene.bodies] == ["rope", *(f"rope.{k}" for k in range(1, 9))]
    assert masses == [0.625, *[1.25] * 7, 0.625]
    assert numbers(scene.bodies[3].inertia) == [12.5, 12.5, 12.5, 0.0, 0.0, 0.0]
    assert scene.forces[0].body == "rope.8" and numbers(scene.forces[0].point) == [0.0, 0.0, 0.0]
    assert scene.points[0].body == "rope.4" and numbers(scene.points[0].position) == [0.0, 0.1, 0.2]


def test_a_section_gives_stiffness_mass_and_rotary_inertia() -> None:
    data = beam_scene(4, {"force": [0.0, 0.0, 1.0]})
    for key in ("stiffness", "mass_per_length", "rotary_inertia"):
        del data["beams"]["rope"][key]
    data["beams"]["rope"]["section"] = {
        "elastic_modulus": 200.0, "density": 3.0, "area": 0.5, "second_moments": [0.2, 0.7],
        "shear_modulus": 80.0, "torsion_constant": 0.4, "shear_factors": [0.8, 0.9],
    }  # fmt: skip  # a table
    data["beams"]["rope"]["stiffness_damping"] = 0.1
    beam = beam_of(from_data(data)).parts[0].section
    stiffness = np.array([numbers(row) for row in beam.stiffness])
    # the rotation about z bends along y
    np.testing.assert_allclose(stiffness, np.diag([32.0, 140.0, 40.0, 100.0, 32.0, 36.0]), rtol=1e-14)
    np.testing.assert_allclose([numbers(row) for row in beam.damping], 0.1 * stiffness, rtol=1e-14)
    np.testing.assert_allclose(numbers((beam.mass_per_length, *beam.rotary_inertia)), [1.5, 2.7, 2.1, 0.6], rtol=1e-14)


def symmetric(place: int, value: float) -> list[list[float]]:
    matrix = np.diag([500.0, 500.0, 500.0, 1e4, 1e4, 1e4])
    matrix[place, place] = value
    matrix[0, 1] = matrix[1, 0] = 600.0 if place == 5 else 0.0
    return [list(map(float, row)) for row in matrix]


SKEW = [[1.0 if row == column else 0.5 if (row, column) == (0, 1) else 0.0 for column in range(6)] for row in range(6)]
REFUSED: list[tuple[str, Any, str]] = [
    ("beams.rope.length", 0.0, "(beams.rope.length): the length of a beam is 0; try: a number above 0"),
    ("beams.rope.elements", None, "(beams.rope): a beam of the model cosserat needs the number of its elements"),
    ("beams.rope.stiffness.shear_y", -1.0, "(beams.rope.stiffness.shear_y): the stiffness of shear along y is -1"),
    ("beams.rope.rotary_inertia", None, "(beams.rope): the sections have no rotary inertia, without which their"),
    ("beams.rope.rotary_inertia", [1.0, 0.0, 1.0], "(beams.rope.rotary_inertia[1]): the rotary inertia of a section"),
    ("forces.tip.point", [11.0, 0.0, 0.0], "(forces.tip.point[0]): x = 11 m is beyond the beam rope, which goes"),
    (
        "forces.tip.point",
        ["load", 0.0, 0.0],
        "(forces.tip.point[0]): x on the beam rope depends on the tunable parameter load, and nodes are fixed",
    ),
    ("outputs.bent", {"formula": "q.rope[0]"}, "(outputs.bent.formula[0]): q.rope: a geometrically exact beam"),
    (
        "distributed_loads.wind",
        {"beam": "rope", "force": [0, 0, "1 / (s - 0.5)"]},
        "(distributed_loads.wind.force[2]): at s = 0.5, div(1, 0) has no finite value; try: other values of the parameters",
    ),
    (
        "distributed_loads.wind",
        {"beam": "rope", "force": [0, 0, 0], "moment": [0, 0, "-rotation.here[3]"]},
        "(distributed_loads.wind.moment[2]): rotation.here has no component 3 (column 2); try: an index from 0 to 2",
    ),
]
MATRICES = {
    "skew": (SKEW, "the matrix is not symmetric: entry [0][1] differs from [1][0]"),
    "zero": (symmetric(1, 0.0), "the section does not resist bending_z: entry [1][1] is 0"),
    "indefinite": (symmetric(5, 1e4), "scaled to a diagonal of 1, its smallest eigenvalue is -0.2"),
}


@pytest.mark.parametrize(("path", "value", "message"), REFUSED)
def test_what_no_beam_can_be_is_refused_with_one_message(path: str, value: Any, message: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)) as caught:
        from_data(changed(path, value))
    assert len(caught.value.problems) == 1, str(caught.value)


@pytest.mark.parametrize(("matrix", "message"), list(MATRICES.values()), ids=list(MATRICES))
def test_an_indefinite_section_is_refused(matrix: list[list[float]], message: str) -> None:
    data = changed("beams.rope.stiffness_matrix", matrix)
    del data["beams"]["rope"]["stiffness"]
    with pytest.raises(DescriptionError, match=re.escape(f"(beams.rope.stiffness_matrix): {message}".split(": ")[1])):
        from_data(data)


def test_keys_of_one_model_are_refused_by_the_other() -> None:
    data = changed("beams.rope.model", "euler_bernoulli")
    fault = "(beams.rope.stiffness): a beam of the model euler_bernoulli has no stiffness; try: model = "
    with pytest.raises(DescriptionError, match=re.escape(fault)):
        from_data(data)


def test_stiffness_is_given_once() -> None:
    data = changed("beams.rope.stiffness_matrix", symmetric(0, 500.0))
    with pytest.raises(DescriptionError, match="stiffness and stiffness_matrix are both given; try: one of them"):
        from_data(data)


def test_stiffness_may_be_tunable() -> None:
    data = changed("beams.rope.stiffness", {**ROLL_UP, "torsion": "500 * load"})
    assert any(requirement.rule is not None for requirement in from_data(data).requirements)
