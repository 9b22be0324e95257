"""Faults that few scenes have, each one problem at its place; and the degree of equations in velocities."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Number, Symbol
from eomgen.scene.bodies.element_sections import _inverse
from eomgen.scene.formula.namespaces import SceneNames
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import VELOCITIES
from eomgen.scene.joints.constraint_reading import degree
from eomgen.scene.load import from_data, load
from tests.models.library import scene
from tests.models.toml_text import toml_text

BEAM: dict[str, Any] = {
    "format": 1,
    "name": "mast",
    "beams": {"rod": {"length": 1.0, "mass_per_length": 1.0, "bending_y": {"modes": 1, "stiffness": 10.0}}},
    "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, 1, 0]}},
}


def beam(**changes: Any) -> dict[str, Any]:
    rod = {name: value for name, value in {**BEAM["beams"]["rod"], **changes}.items() if value is not None}
    return {**BEAM, "beams": {"rod": rod}}


def problems(data: dict[str, Any]) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        from_data(data)
    return [f"{problem.where.partition('(')[2]} {problem.what}" for problem in caught.value.problems]


BENDING = {"modes": 1, "stiffness": 10.0}
P = {"points": {"tip": {"body": "rod", "position": [0, 0, -1]}}}


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (beam(length=None), "beams.rod) the key length is missing"),
        (beam(length=-2.0), "beams.rod.length) the length of a beam is -2"),
        (beam(mass_profile=[]), "beams.rod.mass_profile) the list of coefficients is empty"),
        (
            beam(bending_y={**BENDING, "masses": [{"at": 1.5, "mass": 1.0}]}),
            "beams.rod.bending_y.masses[0].at) x = 1.5 m is beyond the beam, which goes from 0 m to 1 m",
        ),
        (
            scene("pendulum", joints__hinge__initial={"hold": True}),
            "joints.hinge.initial.hold) no position or velocity is given that could be held",
        ),
        (
            scene("pendulum", **P, outputs={"place": {"position": "tip", "at": 0.5}}),
            "outputs.place.at) at is a place on a beam, of outputs of its sections",
        ),
        (
            scene("pendulum", constraints={"rope": {"type": "distance", "first": {"body": "rod"}, "length": 1.0}}),
            "constraints.rope.second) the key second is missing",
        ),
        (
            scene("pendulum", inputs={"u": {"points": [[0, 0], [1, 1]], "wave": {"shape": "square", "period": 1.0}}}),
            "inputs.u) an input takes one of table, points, wave, not points and wave",
        ),
        (
            scene("pendulum", joints__hinge__drive="1 / t", joints__hinge__initial=None),
            "joints.hinge.drive) the motion has no finite value and rate at t = 0",
        ),
        (
            scene("pendulum", repeat={"row": {"indices": {"i": 3}, "bodies": "none"}}),
            "repeat.row.bodies) a table is needed here, not 'none'",
        ),
    ],
)
def test_each_fault_is_one_problem(data: dict[str, Any], problem: str) -> None:
    found = problems(data)
    assert any(problem in text for text in found), found


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"format": None}, "the key format is missing"),
        ({"format": 3}, "this eomgen reads format 1, not 3"),
        ({"dampings": 1}, "the key 'dampings' is unknown here"),
        ({"points": 5}, "a table is needed here, not 5"),
    ],
)
def test_faults_of_included_files_are_at_their_place(changes: dict[str, Any], problem: str, tmp_path: Path) -> None:
    inner = {name: value for name, value in {**scene("pendulum"), **changes}.items() if value is not None}
    (tmp_path / "inner.toml").write_text(toml_text(inner), encoding="utf-8")
    outer = scene("pendulum", include={"left": {"file": "inner.toml"}})
    (tmp_path / "outer.toml").write_text(toml_text(outer), encoding="utf-8")
    with pytest.raises(DescriptionError) as caught:
        load(tmp_path / "outer.toml")
    assert any("inner.toml" in item.where and problem in item.what for item in caught.value.problems), caught.value


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("q.a * 2 + sin(t)", 0),
        ("v.a - 3", 1),
        ("v.a * q.a - v.b / (1 + q.a**2)", 1),
        ("q.a / v.a", 2),
        ("v.a * v.b", 2),
        ("v.a**2", 2),
        ("sin(v.a)", 2),
        ("-v.a", 1),
        ("v.a if q.a < 1 else 2 * v.b", 1),
        ("v.a if v.b < 1 else 0", 2),
        ("v.a * v.b * v.a * v.b", 2),
    ],
)
def test_equations_are_linear_in_velocities_by_their_degree(text: str, expected: int) -> None:
    names = SceneNames(joints={"a": "revolute", "b": "revolute"})
    assert degree(read_formula(text, names, VELOCITIES)) == expected


@pytest.mark.parametrize("size", [1, 2, 3])
def test_compliances_of_formulas_are_inverses(size: int) -> None:
    rng = np.random.default_rng(size)
    root = rng.normal(size=(size, size))
    numbers = root @ root.T + np.eye(size)
    symbols = {f"k{i}{j}": numbers[i, j] for i in range(size) for j in range(size)}
    matrix: Any = [[Symbol("parameter", f"k{min(i, j)}{max(i, j)}") for j in range(size)] for i in range(size)]
    found = [[evaluate(entry, lambda symbol: symbols[symbol.name]) for entry in row] for row in _inverse(matrix)]
    np.testing.assert_allclose(found, np.linalg.inv(numbers), rtol=1e-12)
    plain: Any = [[Number(numbers[i, j]) for j in range(size)] for i in range(size)]
    np.testing.assert_allclose([[entry.value for entry in row] for row in _inverse(plain)], found, rtol=1e-12)
