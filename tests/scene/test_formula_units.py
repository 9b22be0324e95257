"""Units of formulas: dimensions against Pint, terms that disagree, and formulas that give no reason for a note."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import eomgen
from eomgen.errors import DescriptionError
from eomgen.formula.units.conversion import measure
from eomgen.formula.units.parser import dimension_of, read_unit
from eomgen.formula.units.table import NAMED, names
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import EVERYTHING, LOCAL_LOAD, SceneNames
from eomgen.scene.reading.formula_units import disagreement, unit_of

_BRACKETS = ("mass", "length", "time", "current", "temperature")
LABELS = {
    "k": "N/m",
    "d": "N s/m",
    "L": "m",
    "I": "kg m^2",
    "load_in": "N",
    "turn": "N m/rad",
    "free": "",
    "odd": "bits",
}
NAMES = SceneNames(
    parameters=dict.fromkeys((*LABELS, "c"), False),
    labels=LABELS,
    joints={"x": "prismatic", "hinge": "revolute", "ball": "spherical", "body": "free"},
    points=("tip",),
)


@given(st.lists(st.tuples(st.sampled_from(sorted(names())), st.integers(-3, 3).filter(bool)), min_size=1, max_size=4))
def test_dimensions_are_as_in_pint(factors: list[tuple[str, int]]) -> None:
    found = dimension_of(" ".join(f"{name}^{power}" for name, power in factors))
    expected = measure(tuple(factors))[1]
    assert found is not None
    assert found.powers == tuple(expected.get(f"[{name}]", 0) for name in _BRACKETS)
    assert found.angle == expected.get("[angle]", 0)


@pytest.mark.parametrize("unit", NAMED)
def test_named_units_have_their_dimension_as_text(unit: str) -> None:
    dimension = dimension_of(unit)
    assert dimension is not None
    assert measure(read_unit(str(dimension)))[1] == measure(read_unit(unit))[1]


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("k * q.x + d * v.x", "N"),
        ("k * q.x**2 / L", "N"),
        ("q.x / L", "1"),
        ("sqrt(k / 2)", ""),
        ("sqrt(k * k)", "N/m"),
        ("k / d", "1/s"),
        ("load_in if q.x > 0 else 0", "N"),
        ("max(load_in, 0) + c", "N"),
        ("v.body[4]", "m/s"),
        ("reaction.x.force[1]", "N"),
        ("gravity.hinge", "N m"),
        ("odd * q.x", ""),
        ("free + c", ""),
        ("atan2(q.x, L)", "rad"),
    ],
)
def test_units_follow_from_quantities_and_labels(text: str, unit: str) -> None:
    assert unit_of(read_formula(text, NAMES, EVERYTHING), NAMES) == unit


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("k * (q.x + v.x)", "the formula adds q.x in m and v.x in m/s [W0136]"),
        ("c * sin(q.hinge) * (3 - (load_in - k))", "the formula subtracts k in N/m from load_in in N [W0137]"),
        ("d * v.x - k * v.x", "the formula subtracts k * v.x in kg m/s^3 from d * v.x in N [W0137]"),
        ("max(q.x, v.x)", "max() has the arguments q.x in m and v.x in m/s [W0282]"),
        ("1 if q.x > t else 0", "the formula compares t in s with q.x in m [W0138]"),
        ("q.x if t > 1 else load_in", "the formula chooses between q.x in m and load_in in N [W0139]"),
        ("sin(L)", "sin() takes a plain number or an angle, not L in m [W0135]"),
    ],
)
def test_terms_of_known_and_different_units_are_named(text: str, expected: str) -> None:
    found = disagreement(read_formula(text, NAMES, EVERYTHING), NAMES)
    assert found is not None
    assert found.text == expected


@pytest.mark.parametrize(
    "text",
    [
        "q.x + 0.1",
        "exp(-t / 2) * load_in + sin(3 * t)",
        "v.hinge * L - v.x",
        "acos(position.tip[2])",
        "load_in * L * position.tip[2] - load_in * L",
        "k * q.x * (q.x > 0) + load_in",
        "load_in if q.x > 0 and v.x > 0 else c",
    ],
)
def test_formulas_without_a_contradiction_have_no_note(text: str) -> None:
    assert disagreement(read_formula(text, NAMES, EVERYTHING), NAMES) is None


@pytest.mark.parametrize(("text", "unit"), [("velocity.here[0]", "m/s"), ("angular_velocity.here[1]", "rad/s")])
def test_quantities_of_loads_have_units(text: str, unit: str) -> None:
    assert unit_of(read_formula(text, NAMES, LOCAL_LOAD), NAMES) == unit


HEAD = """
format = 1
name = "cart"
parameters.k = { value = 100.0, unit = "N/m" }
inputs.push = { formula = "sin(3 * t)", unit = "N" }
bodies.cart = { mass = 2.0 }
joints.x = { type = "prismatic", parent = "base", child = "cart", axis = [1, 0, 0] }
efforts.e = { joint = "x", effort = "EFFORT" }
"""
MAP = """
[maps.m]
x = [-1, 1]
y = [-1, 1]
values = [[0, 1], [1, 2]]
interpolation = "linear"
outside = "hold"
unit = "UNIT"
"""
LAW = """
laws.drag = { source = "drag.c", function = "drag", arguments = { speed = "m/s" }, results = { force = "N" } }
"""
C = "void drag(const double *a, const double *p, double *r) { r[0] = a[0]; }\n"


def notes(folder: Path, effort: str, more: str = "") -> list[str]:
    (folder / "drag.c").write_text(C, encoding="utf-8")
    file = folder / "scene.toml"
    file.write_text(HEAD.replace("EFFORT", effort) + more, encoding="utf-8")
    return [note for note in eomgen.load(file).notes if "unit" in note or "in m" in note or "in N" in note]


EFFORT = "efforts.e.effort: the formula "
IF_PLAIN = "if its numbers have no unit, and not in"
RATE = '[states.{}]\nrate = "{}"\nunit = "N"\n'.format


@pytest.mark.parametrize(
    ("effort", "more", "note"),
    [
        ("k * (q.x + v.x)", "", EFFORT + "adds q.x in m and v.x in m/s"),
        (
            "map.m(q.x, v.x) - push",
            MAP.replace("UNIT", "N m"),
            EFFORT + "subtracts push in N from map.m(q.x, v.x) in N m",
        ),
        (
            "pull(q.x) - push",
            '[curves.pull]\npoints = [[-1, 0], [1, 2]]\ninterpolation = "linear"\nunit = "lbf"',
            "curves.pull.unit: its unit lbf is a label, so formulas take its numbers as they are; try: points",
        ),
        ("-k * v.x", "", EFFORT + "is in kg m/s^3, a force in N is expected; try: a factor that"),
        ("push * log(k)", "", "efforts.e.effort: log() takes a plain number or an angle, not k in N/m"),
        ("push", '[outputs]\no = { formula = "k * q.x", unit = "N m" }', "outputs.o: its unit N m is a label,"),
        ("filtered", RATE("filtered", "push - filtered") + RATE("s", "v.x"), "states.s.rate: the formula is a speed"),
        ("force * 2", '[definitions]\nforce = "k * (q.x + v.x)"', "definitions.force.formula: the formula adds q.x"),
        ("-2 * k * v.x", "", f"{EFFORT}is in kg m/s^3 {IF_PLAIN} N; try: a parameter in s in place of -2"),
        ("k * sin(3 * q.x)", "", f"{EFFORT}is in N/m {IF_PLAIN} N; try: a factor in m, as a parameter"),
        (
            "force",
            '[definitions]\nforce = { formula = "3 * k", unit = "N" }',
            f"definitions.force.formula: the formula is in N/m {IF_PLAIN} N; try: a parameter in m in place of 3",
        ),
    ],
)
def test_one_note_at_the_place_of_the_terms(effort: str, more: str, note: str, tmp_path: Path) -> None:
    [found] = notes(tmp_path, effort, more)
    assert note in found


@pytest.mark.parametrize(
    ("effort", "more"),
    [
        ("map.m(q.x, v.x) - push", MAP.replace("UNIT", "N")),
        ("law.drag(v.x) + k * q.x", LAW),
        ("push * (1 + sin(3 * t)) / 2", ""),
        ("5 * angle - 2 * angle / pause", '[parameters.angle]\nvalue = "3 deg"\n[parameters.pause]\nvalue = "2 s"'),
        ("push", '[states.s]\nrate = "(push - s) / 0.05"\nunit = "N"'),
        ("force + push", '[definitions]\nforce = { formula = "-k * q.x", unit = "N" }'),
    ],
)
def test_consistent_scenes_have_no_notes(effort: str, more: str, tmp_path: Path) -> None:
    assert notes(tmp_path, effort, more) == []


ARGUMENT = "(efforts.e.effort): the argument speed of law.drag is in m/s by its own entry, and is given here in N;"


@pytest.mark.parametrize(
    ("effort", "more", "fault"),
    [
        ("law.drag(push)", LAW, ARGUMENT),
        (
            "force",
            '[definitions]\nforce = { formula = "k * (q.x + v.x)", unit = "N" }',
            "(definitions.force.formula): the formula adds q.x in m and v.x in m/s; try: a factor that turns one unit",
        ),
        (
            "force",
            '[definitions]\nforce = { formula = "k * v.x", unit = "N" }',
            "(definitions.force.unit): the unit 'N' is of a force, a quantity in kg m/s^3 is expected; try: \"kg",
        ),
        (
            "k * part",
            '[definitions]\npart = { formula = "k * q.x / push", unit = "m" }',
            "(definitions.part.unit): the unit 'm' is not of a plain number, as its formula is; try: no unit",
        ),
    ],
)
def test_certain_faults_are_refused(effort: str, more: str, fault: str, tmp_path: Path) -> None:
    with pytest.raises(DescriptionError) as caught:
        notes(tmp_path, effort, more)
    assert fault in str(caught.value)
