"""Unit strings: what they are worth against pint's own definitions, what is refused and why, and that nothing slips
through."""

from __future__ import annotations

import math
from decimal import Decimal
from functools import cache
from typing import Any

import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eomgen.errors import UsageError
from eomgen.formula.nodes import Number
from eomgen.formula.units.conversion import coherent, measure, to_si, to_unit
from eomgen.formula.units.labels import in_label
from eomgen.formula.units.parser import Dimension, UnitError, dimension_of, is_quantity, read_quantity, read_unit
from eomgen.formula.units.table import NAMED, PREFIXES, UNITS, names
from eomgen.scene.document.schema import every_document
from eomgen.scene.document.units import in_si
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.key_metadata import ANY_UNIT, fields_of, tables_of
from eomgen.scene.reading.report import Report
from tests.scene.test_scene_files import problems, read, replaced

DOCUMENT = every_document()


def value(text: str, unit: str) -> float:
    return to_unit(read_quantity(text), unit)


def refusal(text: str, unit: str = "", known: tuple[str, ...] = ()) -> str:
    with pytest.raises(UnitError) as caught:
        to_unit(read_quantity(text, known), unit or "m")
    return f"{caught.value.what}; try: {caught.value.hint}"


# -- numbers -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("250 mm", "m", 0.25),
        (" + 2 in ", "m", 0.0508),
        ("3000 rpm", "rad/s", 100 * math.pi),
        ("15 deg", "rad", math.pi / 12),
        ("2 rev", "rad", 4 * math.pi),
        ("2.5 kN/m", "N/m", 2500.0),
        ("9.81 m/s^2", "m/s^2", 9.81),
        ("30 km/h", "m/s", 30 / 3.6),
        ("60 mph", "m/s", 26.8224),
        ("2 kg cm^2", "kg m^2", 2e-4),
        ("3 N m", "N m/rad", 3.0),
        ("1 N m/deg", "N m/rad", 180 / math.pi),
        ("4 N/(m s^-1)", "N s/m", 4.0),
        ("5 1/s", "Hz", 5.0),
        ("2 tonnes", "kg", 2000.0),
        ("1 lbf", "N", 4.4482216152605),
        ("1 slug", "kg", 14.593902937206),
        ("1 hp", "W", 745.69987158227),
        ("1 g0", "m/s^2", 9.80665),
        ("2 millimetres", "m", 0.002),
    ],
)
def test_values(text: str, unit: str, expected: float) -> None:
    assert is_quantity(text)
    assert value(text, unit) == pytest.approx(expected, rel=1e-13)


def test_conversion_adds_no_rounding() -> None:
    for number in range(1, 1000):
        assert value(f"{number} mm", "m") == float(f"{number}e-3")
        assert value(f"0.{number} um", "m") == float(f"0.{number}e-6")
    assert value("90 deg", "rad") == math.pi / 2
    assert value("0.1 kg", "kg") == 0.1


#: Where pint's own registry has other names.
_PINT = {
    "newton_meter": "newton * meter",
    "revolution_per_minute": "rpm",
    "pound_force": "force_pound",
    "pound_force_per_square_inch": "psi",
    "mile_per_hour": "mph",
}


@cache
def registry() -> Any:
    return pint.UnitRegistry()


@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.symbol)
def test_every_unit_is_what_pint_says_of_it(unit: Any) -> None:
    ours, _ = measure(((unit.symbol, 1),))
    word = unit.words.split()[0]
    theirs = registry()(f"1 {_PINT.get(word, word)}").to_base_units()
    coherent_unit = registry()(unit.coherent.replace(" ", "*")).to_base_units()
    assert float(ours) == pytest.approx((theirs / coherent_unit).to("").magnitude, rel=1e-12)


def test_every_name_has_one_meaning() -> None:
    spellings: dict[str, set[str]] = {}
    for unit in UNITS:
        for short, long, _ in [("", "", ""), *(PREFIXES if unit.prefixed else ())]:
            first = unit.words.split()[0]
            for name in (short + unit.symbol, *(long + word for word in unit.words.split())):
                spellings.setdefault(name, set()).add(long + first)
    assert {name: meanings for name, meanings in spellings.items() if len(meanings) > 1} == {}
    for name, found in names().items():
        size, dimension = measure(((name, 1),))
        assert measure(read_unit(found.coherent)) == (1, dimension)
        assert size == 1 or not found.is_coherent
    assert all(coherent(read_unit(unit)) == unit for unit in NAMED)


# -- what is refused ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("250 mm", "kg", "'250 mm' is a length, a mass in kg is expected; try: \"0.25 kg\""),
        (
            "50 Hz",
            "rad/s",
            "'50 Hz' is a frequency, an angular speed in rad/s is expected; try: \"3000 rpm\" where a cycle",
        ),
        (
            "2 g",
            "m/s^2",
            "'2 g' is a mass, an acceleration in m/s^2 is expected; try: g is the gram: \"2 g0\", g0 being",
        ),
        ("5 %", "", "'%' is not accepted as a unit: a part of a hundred is a number; try: the number, 0.05 for five"),
        ("1,5 mm", "m", "'1,5 mm' has a comma in its number; try: \"1.5 mm\""),
        ("3 N/m s", "", "'3 N/m s' can be read in two ways; try: brackets, N/(m s), or the divisor last, N s/m"),
        ("3 m2", "", "there is no unit 'm2'; try: m^2"),
        ("3 \N{MICRO SIGN}m", "m", "'\\xb5' is not part of a unit; try: u for micro"),
        ("3 m^10", "", "an exponent in '3 m^10' is not a whole number from 1 to 9"),
        ("3 m m)", "", "'3 m m)' is not a number with a unit: it is not well formed at ')'"),
        ("3 kg/2", "kg", "more follows '3 kg', and units are not read within formulas; try: a parameter, name ="),
        ("1e300 Gm", "m", "'1e300 Gm' is out of the range of double precision in SI; try: a number below 1e300"),
        ("1" + " m" * 60, "", 'a number with a unit has at most 100 characters, not 121; try: "250 mm"'),
    ],
)
def test_refusals(text: str, unit: str, message: str) -> None:
    assert is_quantity(text)
    assert refusal(text, unit).startswith(message)


@pytest.mark.parametrize(
    "text", ["3 if t > 1 else 2", "2 * mm", "length", "1e3", "1e9999 m", "2**3", "", " ", "-t", "3 and 4"]
)
def test_formulas_are_not_taken_for_quantities(text: str) -> None:
    assert not is_quantity(text)


def test_names_of_the_scene_are_not_taken_for_units() -> None:
    assert refusal("2 m", known=("m",)).startswith(
        "in '2 m', m can be the unit or the scene's own m; try: another name"
    )
    assert refusal("2 load", known=("load",)) == "'load' is not a unit; try: a * before load"
    assert refusal("2 lenght", known=("length",)) == "there is no unit 'lenght'; try: a * before length"
    assert refusal("2 pi") == "'pi' is not a unit; try: a * before pi"
    assert value("2 mm", "m") == 0.002


# -- in scenes ---------------------------------------------------------------------------------------------------------


def test_units_in_a_scene() -> None:
    scene = read(
        """\
position = ["250 mm", 0, "1 cm"]
rotation = [{ axis = [1, 0, 0], angle = "90 deg" }]
damping = "2 N mm s/rad"
initial = { position = "15 deg", velocity = "30 rpm" }
[simulation]
step = "1 ms"
duration = "2 min"
""",
        replaced('"2*length"', '"500 g"').replace("[0.1, 0.1, 0.01]", '{ xx = "100 kg cm^2", yy = 0.02, zz = 0.02 }'),
    )
    (joint,), (body,) = scene.joints, scene.bodies
    assert joint.position == (Number(0.25), Number(0.0), Number(0.01))
    assert joint.orientation == ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
    assert (joint.damping, body.mass, body.inertia[0]) == (Number(0.002), Number(0.5), Number(0.01))
    assert (*joint.initial_position, *joint.initial_velocity) == pytest.approx((math.pi / 12, math.pi), rel=1e-15)
    assert (scene.simulation.step, scene.simulation.duration) == (0.001, 120.0)
    assert scene.source["joints.hinge.damping"] == "scene.toml:17"


def test_the_same_scene_whatever_its_units() -> None:
    plain = read(text=replaced("length = 0.8", 'length = { value = 0.8, unit = "m" }'))
    assert read(text=replaced("length = 0.8", 'length = "800 mm"')).digest == plain.digest


def test_parameters_are_kept_in_si() -> None:
    lines = (
        'length = 0.8\none = "250 mm"\ntwo = { value = "20 kN/m" }\nthree = { value = "3000 rpm", unit = "rad/s" }\n'
        'four = { value = "0.1 N m/A" }\nfive = { value = "50 Hz" }\nsix = 7'
    )
    found = {item.name: (item.value, item.unit) for item in read(text=replaced("length = 0.8", lines)).parameters}
    assert found["three"] == (pytest.approx(100 * math.pi), "rad/s")
    assert (found["one"], found["two"], found["four"]) == ((0.25, "m"), (20000.0, "N/m"), (0.1, "N m/A"))
    assert (found["five"], found["six"]) == ((50.0, "Hz"), (7.0, ""))


@pytest.mark.parametrize("label", ["rpm", "1/s", "speed of the shaft", "deg/s"])
def test_a_label_beside_a_unit_string_is_that_of_si(label: str) -> None:
    speed = f'length = 0.8\nspeed = {{ value = "3000 rpm", unit = "{label}" }}'
    [found] = problems(text=replaced("length = 0.8", speed))
    fault = f"'3000 rpm' is 314.159265 rad/s, and the label '{label}' says otherwise; try: unit = \"rad/s\", or no"
    assert found.startswith(f"scene.toml:5 (parameters.speed.unit): {fault}")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("length = 0.8", 'length = "250 nn"', "scene.toml:4 (parameters.length.value): there is no unit 'nn'"),
    ],
)
def test_one_fault_is_one_problem(old: str, new: str, message: str) -> None:
    [found] = problems(text=replaced(old, new))
    assert message in found


def test_a_fault_in_a_unit_spoils_nothing_else() -> None:
    extra = "initial = { velocity = '3 Hz' }\n[simulation]\nstep = '1 m'\nduration = -1"
    places = [text.split(":")[1] for text in problems(extra, replaced('"2*length"', '"2 m"'))]
    assert places == ["7 (bodies.link.mass)", "15 (joints.hinge.initial.velocity)", "17 (simulation.step)"]


@pytest.mark.parametrize("kind", [kind for kind, row in JOINTS.items() if row.moves])
def test_an_effort_has_the_unit_of_its_component(kind: str) -> None:
    """Moments come first, forces behind; an effort that does not say its component acts on the first."""
    row = JOINTS[kind]
    size, turning = row.v_size, row.units.count("rad")
    own = {"axis": "[0, 1, 0]", "second_axis": "[1, 0, 0]", "pitch": "0.1"}
    keys = "".join(f"{key} = {own[key]}\n" for key in (*("axis",) * bool(row.coordinates), *row.needed))
    text = replaced('"revolute"', f'"{kind}"').replace("axis = [0, 1, 0]\n", keys)
    effort = "[efforts.push]\njoint = 'hinge'\neffort = '3 {}'\n{}"
    for index in (None, *range(size)):
        unit, other = ("N m", "N") if (index or 0) < turning else ("N", "N m")
        where = "" if index is None else f"index = {index}\n"
        scene = read(effort.format(f"k{unit}", where), text)
        assert (scene.efforts[0].effort, scene.efforts[0].index) == (Number(3000.0), index or 0)
        [found] = problems(effort.format(other, where), text)
        assert f'in {unit} is expected; try: "3 {unit}"' in found


# -- every key of the schema -------------------------------------------------------------------------------------------


def _keys() -> list[tuple[str, str, str, str]]:
    """Return (class, key, type, unit) for every key with a unit, for each type that it depends on."""
    found = []
    for model in tables_of(DOCUMENT).values():
        for key, (meaning, _) in fields_of(model).items():
            by_type = meaning.unit if isinstance(meaning.unit, dict) else {"": meaning.unit}
            for kind, units in by_type.items():
                unit = units if isinstance(units, str) else units[0]
                if unit and unit != ANY_UNIT:
                    found.append((model.__name__, key, kind, unit))
    return found


@pytest.mark.parametrize(("model", "key", "kind", "unit"), _keys())
def test_every_unit_of_the_schema_is_one(model: str, key: str, kind: str, unit: str) -> None:
    size, _ = measure(read_unit(unit))
    assert size == 1, f"{model}.{key}: {unit} is not of SI"
    assert value(f"2 {unit}", unit) == 2.0
    with pytest.raises(UnitError):
        value("2 K", unit)


# -- hostile texts -----------------------------------------------------------------------------------------------------

_UNITS = ["m", "mm", "kg", "s", "N", "rad", "deg", "rpm", "Hz", "N m", "km/h", "x", "if", "else"]
_NUMBERS = ["1", "-3", "2.5", "e9", "1e308", "9" * 30]
_SIGNS = ["^", "**", "*", "/", "(", ")", " ", "+", "-", ".", ",", "%", "\N{DEGREE SIGN}", "__", "'", "\n", "\0", "[0]"]
_ATOMS = st.sampled_from([*_UNITS, *_NUMBERS, *_SIGNS])
_TEXTS = st.one_of(
    st.lists(_ATOMS, max_size=12).map("".join), st.text(max_size=40), st.lists(_ATOMS, min_size=90).map("".join)
)


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(_TEXTS)
def test_any_text_is_a_number_a_formula_or_a_problem(text: str) -> None:
    report = Report("scene.toml", {})
    data, *_ = in_si(
        {"bodies": {"arm": {"mass": text}}, "parameters": {"x": text}, "simulation": {"step": text}}, report
    )
    found = data["bodies"]["arm"]["mass"]
    assert isinstance(found, str | float)
    if isinstance(found, float):
        assert math.isfinite(found)
    elif is_quantity(text):
        assert report.concerns("bodies.arm.mass")
    for _, problem in report.noted:
        assert str(problem).isascii() and "\n" not in str(problem) and len(str(problem)) < 500


_WANTED = ["m", "kg", "s", "rad", "N", "N m", "m/s", "rad/s", "N/m", "N m/rad", "N m s/rad"]
_LIKE = {
    "m": ["m", "mm", "in"],
    "kg": ["kg", "g"],
    "s": ["s", "ms", "min"],
    "N": ["N", "kN", "lbf"],
    "rad": ["rad", "deg"],
}
_OTHERS = ["m", "mm", "kg", "s", "N", "rad", "deg", "J", "W", "Pa", "rpm", "A", "V"]


@st.composite
def quantities(draw: st.DrawFn) -> tuple[str, str, dict[str, int]]:
    """Return a wanted unit, a well-formed quantity of its kind or nearly so, and its exponents by symbols."""
    unit = draw(st.sampled_from(_WANTED))
    powers: dict[str, int] = {}
    for symbol, power in read_unit(unit):
        powers[draw(st.sampled_from(_LIKE[symbol]))] = power
    for symbol in draw(st.lists(st.sampled_from(_OTHERS), max_size=2)):
        powers[symbol] = powers.get(symbol, 0) + draw(st.sampled_from([-1, 1]))
    powers = {symbol: power for symbol, power in powers.items() if power}
    blank = draw(st.sampled_from([" ", "*", ".", " * "]))
    above = blank.join(f"{name}^{power}" for name, power in powers.items() if power > 0 or len(powers) == 1)
    below = "".join(f"/{name}**{-power}" for name, power in powers.items() if power < 0 and len(powers) > 1)
    number = draw(st.decimals(min_value=-1000, max_value=1000, places=3))
    return unit, f"{number} {above or '1'}{below}", powers


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(quantities())
def test_no_dimension_slips_through(quantity: tuple[str, str, dict[str, int]]) -> None:
    unit, text, powers = quantity
    if not powers:
        return
    theirs = registry().Quantity(float(Decimal(text.split()[0])), "dimensionless")
    for name, power in powers.items():
        theirs = theirs * registry()(name) ** power
    wanted = registry()(unit.replace(" ", "*"))
    turned = {"rad": 1, "deg": 1, "rpm": 1}
    angle = sum(turned.get(name, 0) * power for name, power in powers.items())
    angles = {"rad": (1,), "rad/s": (1,), "N m/rad": (-1, 0), "N m s/rad": (-1, 0)}.get(unit, (0,))
    fits = theirs.is_compatible_with(wanted) and angle in angles
    try:
        found = value(text, unit)
    except UnitError:
        assert not fits
        return
    assert fits
    assert found == pytest.approx(theirs.to(wanted).magnitude, rel=1e-12)
    assert to_si(read_quantity(text))[0] == pytest.approx(found, rel=1e-12)


# -- for a parameter of a run ------------------------------------------------------------------------------------------


def test_texts_count_in_the_unit_of_the_label() -> None:
    assert in_label("--set x", "300 mm", "m") == 0.3
    assert in_label("--set x", "300 mm", "mm") == 300.0
    assert in_label("--set x", "300 mm", "") == 0.3
    assert in_label("--set x", "1 rev", "deg") == pytest.approx(360.0, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "label", "message"),
    [
        ("300 mm", "per turn", "--set x: its label 'per turn' in the scene is not a unit that numbers could"),
        ("300 foo", "m", "--set x: there is no unit 'foo'; try: foot"),
        ("long", "m", "--set x: 'long' is neither a number nor a number with a unit; try: 0.25 or \"250 mm\""),
    ],
)
def test_texts_that_cannot_be_taken(text: str, label: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        in_label("--set x", text, label)
    assert str(caught.value.problems[0]).startswith(message)


@pytest.mark.parametrize("text", ["1", " 1 "])
def test_one_is_the_unit_of_plain_numbers(text: str) -> None:
    assert read_unit(text) == ()
    assert dimension_of(text) == Dimension((0.0,) * 5)
    scene = read(text=replaced("length = 0.8", f'length = 0.8\nturns = {{ value = 2, unit = "{text}" }}'))
    assert not any("turns" in note for note in scene.notes if "change" not in note)


@pytest.mark.parametrize("text", ["1 m", "1m", "11", "1 1", "2", "/1"])
def test_other_numbers_are_no_units(text: str) -> None:
    with pytest.raises(UnitError):
        read_unit(text)
