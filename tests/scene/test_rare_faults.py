"""Faults that few scenes have, with place, text and remedy; and the degree of equations in velocities."""

# ruff: noqa: E501 (a row of a table is a message, quoted whole)

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


def exact(**changes: Any) -> dict[str, Any]:
    return {**BEAM, "beams": {"rod": {"length": 1.0, "model": "cosserat", "elements": 2, **changes}}}


def shaped(**keys: Any) -> dict[str, Any]:
    return scene("pendulum", **P, shapes={"a": {"body": "rod", **keys}})


def sampled(**keys: Any) -> dict[str, Any]:
    asked = {"type": "sampled", "sample": 0.1, "signals": {"a": "q.hinge"}}
    return scene("pendulum", controllers={"c": {**asked, **keys}})


def placed(**keys: Any) -> dict[str, Any]:
    law = {"type": "state_feedback", "coordinates": ["hinge"], "calibration": {"method": "pole_placement", **keys}}
    return scene("pendulum", controllers={"c": law}, efforts={"e": {"joint": "hinge", "effort": "c"}})


def asked(effort: str, **curve: Any) -> dict[str, Any]:
    points = {"points": [[0, 0], [1, 1], [2, 0]], **curve}
    return scene("pendulum", curves={"c": points}, efforts={"e": {"joint": "hinge", "effort": effort}})


BENDING = {"modes": 1, "stiffness": 10.0}
MESH = {**BENDING, "shapes": "finite_elements", "elements": 2}
P = {"points": {"tip": {"body": "rod", "position": [0, 0, -1]}}}
ENDS = {"first": "tip", "second": "tip"}
ROAD = {"bump": {"length": 1.0, "height": 0.1}, "speed": 2.0}
HELD = {"s": {"sample": 0.1, "delay": 0.2, "formula": "q.hinge"}, "s_sampled": {"rate": "0"}}
TUNED = {
    "parameters": {"s": {"value": 0.5, "tunable": True}},
    "points": {"a": {"body": "rod", "position": ["s", 0, 0]}},
}
SHAKEN = {"base": {"acceleration": ["c(t)", 0, 0]}, "simulation": {"duration": 2}}
LED: dict[str, Any] = {"joints__elbow__mimic": {"joint": "shoulder", "multiplier": 2.0}, "joints__elbow__initial": None}
TURNS = {"type": "cylindrical", "parent": "base", "child": "rod", "axis": [0, 1, 0], "stiffness": "3 N/m"}


FAULTS: list[tuple[dict[str, Any], str]] = [
    (beam(length=None), "beams.rod) the key length is missing; try: length = 1.0"),
    (beam(length=-2.0), "beams.rod.length) the length of a beam is -2; try: a number above 0"),
    (beam(length=1e200, mass_per_length=1e200), "beams.rod) the mass or the inertia of the beam is out of the range of double precision; try: SI units"),
    (beam(mass_per_length=None, section={"density": 1.0, "elastic_modulus": 1.0}), "beams.rod.section) the key area is missing; try: area = ..., or a shape"),
    (beam(mass_profile=[]), "beams.rod.mass_profile) the list of coefficients is empty; try: [1, -0.5]"),
    (beam(mass_profile=[1, -4, 4]), "beams.rod.mass_profile) the profile of the mass vanishes at s = 0.5; try: coefficients of a polynomial above 0 for s from 0 to 1"),
    (beam(bending_y={**BENDING, "damping_ratio": -0.1}), "beams.rod.bending_y.damping_ratio) the damping ratio is -0.1; try: 0 or more"),
    (beam(bending_y={**MESH, "masses": [{"at": 1.5, "mass": 1.0}]}), "beams.rod.bending_y.masses[0].at) x = 1.5 m is beyond the beam, which goes from 0 m to 1 m; try: a place on the beam"),
    (beam(bending_y={**MESH, "masses": [{"at": 0.5, "mass": -1.0}]}), "beams.rod.bending_y.masses[0].mass) the mass -1 is negative; try: 0 or more"),
    (beam(bending_y={**BENDING, "elements": 2}), 'beams.rod.bending_y.elements) elements is for a mesh, and the shapes are clamped_free; try: shapes = "finite_elements"'),
    (beam(bending_y={**BENDING, "shapes": "pinned_pinned", "ends": "free_free"}), 'beams.rod.bending_y.ends) the shapes pinned_pinned have their own conditions at the ends; try: shapes = "free_free", or "polynomial"'),
    (beam(bending_y={**MESH, "elements": None}), "beams.rod.bending_y) finite elements need their number; try: elements = 8"),
    (beam(bending_y={**MESH, "coordinates": "nodal"}), "beams.rod.bending_y.modes) the mesh has 4 nodal coordinates, not 1; try: no modes"),
    (beam(bending_y={**MESH, "coordinates": "nodal", "modes": None, "elements": 51}), "beams.rod.bending_y.elements) 51 elements have 102 nodal coordinates, and 100 are the most; try: modal coordinates, with modes = 3"),
    (beam(bending_y={**MESH, "ends": "free_free", "modes": 5}), "beams.rod.bending_y.modes) 5 modes are requested from a mesh that has 4; try: at most 4 modes, or more elements: 3 for each mode"),
    (beam(bending_y={**BENDING, "initial": {"position": [0, 0]}}), "beams.rod.bending_y.initial.position) one value, for the one mode, is needed here, not 2; try: "),
    (beam(bending_y={**BENDING, "modes": 2, "initial": {"velocity": [0]}}), "beams.rod.bending_y.initial.velocity) 2 values, one for each mode, are needed here, not 1; try: "),
    (exact(), "beams.rod) the key mass_per_length is missing; try: mass_per_length = ..., or a section"),
    (exact(section={"density": 1.0, "elastic_modulus": 1.0}), 'beams.rod.section) the section has no area, which a geometrically exact beam needs; try: area = ..., or stiffness = { ... } without a section'),
    (beam() | TUNED, "points.a.position[0]) x on the beam rod depends on the tunable parameter s, and shapes are fixed; try: s without tunable, or a number"),
    (shaped(type="box", **ENDS), 'shapes.a) a box has no ends: first and second are for a cylinder or a capsule; try: type = "capsule"'),
    (shaped(type="capsule", radius=0.1, length=1.0, **ENDS), "shapes.a.length) first and second give the length; try: no length"),
    (shaped(type="capsule", **ENDS), "shapes.a) a capsule needs a radius; try: radius = 0.1"),
    (shaped(type="mesh", file="a.stl", scale=[1, 2]), "shapes.a.scale) a mesh has one scale or three, not 2; try: scale = 0.001"),
    (sampled(function="f"), 'controllers.c.function) function is the name of one in a C file; try: source = "controller.c"'),
    (sampled(source="f.c"), 'controllers.c.source) the name of the function in the C file is missing; try: function = "controller"'),
    (placed(poles=[[1, 2]]), "controllers.c.calibration.poles[0]) the pole [1, 2] does not decay: its real part is not below 0; try: [-1, 2]"),
    (scene("pendulum", events={"hit": {"when": "q.hinge > 0.5", "action": "stop"}}), 'events.hit.when) a comparison is 1 or 0 and does not pass zero; try: the difference of its sides, "q.ball - 0.5", and a direction'),
    (scene("pendulum", torsion_springs={"s": {"first": "hinge", "second": "hinge", "stiffness": 1.0}}), "torsion_springs.s.second) the spring connects the joint hinge to itself; try: another joint, or none"),
    (scene("pendulum", inputs={"u": {"initial": 1.0}}), "inputs.u.initial) initial belongs to an input that is a motion, and this input is not; try: formula, or motion = true"),
    (scene("pendulum", inputs={"u": {"motion": True, "formula": "t"}}), "inputs.u.formula) a motion is given by its caller, and takes no formula; try: no motion; a drive takes formulas and curves of t themselves"),
    (scene("pendulum", joints__hinge__initial={"position": [1.0, 2.0]}), "joints.hinge.initial.position) a revolute joint needs 1 number, not 2; try: "),
    (scene("pendulum", joints__hinge=TURNS), "joints.hinge.stiffness) '3 N/m' is one value, and 2 are needed here; try: units N m/rad, N/m"),
    (scene("pendulum", states=HELD), "states.s) the name s_sampled is taken, and is needed for the value that s holds during its delay; try: another name"),
    (scene("pendulum", points={"a": {"body": "rod", "x": 1}}), "points.a.x) the key 'x' is unknown here; try: position = [1, 0, 0]"),
    (scene("pendulum", definitions={"a": {"b": "2 * q.hinge"}}), 'definitions.a.b) definitions.a is a table with the key \'b\', and names have no dots; try: a_b = "2 * q.hinge"'),
    (scene("pendulum", parameters={"k": {"value": 3, "unit": "N m"}}, joints__hinge__damping="k"), "joints.hinge.damping) the parameter k is a torque (N m), a torsional damping in N m s/rad is expected; try: a parameter in N m s/rad"),
    (asked("0", unit="cm/s^2") | SHAKEN, 'base.acceleration[0]) the curve c is labelled cm/s^2, and labels do not convert: its values are in m/s^2; try: value_unit = "cm/s^2" in its table, and unit = "m/s^2"'),
    (scene("pendulum", definitions={"a": "2 +* 3"}, outputs={"o": {"formula": "1 if a else 0"}}), "definitions.a.formula) the formula is not well formed at '* 3' (column 4); try: operators between terms and matching brackets"),
    (scene("pendulum", constraints={"rope": {"type": "distance", "first": {"body": "rod"}, "second": {"body": "lost"}}}), "constraints.rope.second.body) there is no body 'lost'; try: one of base, rod"),
    (sampled(sample=0), 'controllers.c.sample) the time between two samples is 0 s, and has to be positive; try: sample = "1 ms"'),
    (scene("arm", references={"r": {"acceleration": {"elbow": 1.0}}}, **LED), "references.r.acceleration.elbow) the joint elbow follows another; try: the joint that it follows"),
    (scene("pendulum", joints__hinge__initial={"hold": True}), "joints.hinge.initial.hold) no position or velocity is given that could be held; try: a position or a velocity with it"),
    (scene("pendulum", **P, outputs={"place": {"position": "tip", "at": 0.5}}), 'outputs.place.at) at is a place on a beam, of outputs of its sections; try: section_moment = "NAME"'),
    (scene("pendulum", constraints={"rope": {"type": "distance", "first": {"body": "rod"}, "length": 1.0}}), "constraints.rope.second) the key second is missing; try: second = ..."),
    (scene("pendulum", inputs={"u": {"points": [[0, 0], [1, 1]], "wave": {"shape": "square", "period": 1.0}}}), "inputs.u) an input takes one of table, points, wave, not points and wave; try: a curve for each, and a formula"),
    (scene("pendulum", joints__hinge__drive="1 / t", joints__hinge__initial=None), "joints.hinge.drive) the motion has no finite value and rate at t = 0; try: a law that begins at t = 0 or before"),
    (scene("pendulum", repeat={"row": {"indices": {"i": 3}, "bodies": "none"}}), "repeat.row.bodies) a table is needed here, not 'none'; try: "),
]  # fmt: skip  # one line for each scene


@pytest.mark.parametrize(("data", "problem"), FAULTS)
def test_each_fault_is_told_at_its_place(data: dict[str, Any], problem: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        from_data(data)
    found = [f"{item.where.partition('(')[2]} {item.what}; try: {item.hint}" for item in caught.value.problems]
    assert problem in found, found


NOTES: list[tuple[dict[str, Any], str]] = [
    (beam(bending_y={**BENDING, "damping_ratio": 2}), "beams.rod.bending_y.damping_ratio: 2 is 200 % of critical; try 0.02"),
    (placed(modes=[1], damping_ratios=[3], frequencies=[2]), "controllers.c.calibration.damping_ratios[0]: 3 is 300 % of critical; try 0.03"),
    (asked("c(3)", outside="hold"), "efforts.e.effort: c is asked at 3, and its points are from 0 to 2: the value at an end is taken always; try: the argument in the unit of the points, 0 to 2"),
    (scene("pendulum", inputs={"u": {"unit": "mm", "road": ROAD}}), "inputs.u: its unit mm is a label, and its values are in m: labels do not convert values"),
]  # fmt: skip  # one line for each scene


@pytest.mark.parametrize(("data", "note"), NOTES)
def test_doubtful_entries_are_noted(data: dict[str, Any], note: str) -> None:
    assert note in from_data(data).notes


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
