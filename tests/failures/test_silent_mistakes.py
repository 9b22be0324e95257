"""What a strict user did by mistake and nothing said: every such scene now has an error or a note, and what is meant as
it is written has none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from tests.failures.failure import SCENE
from tests.failures.mistakes import arm, pushed, scene_of

pytestmark = pytest.mark.slow

CORD = '[points.o]\nbody = "base"\nposition = [0.5, 0, 0]\n[springs.cord]\nfirst = "tip"\nsecond = "o"\n'
SHOULDER = "axis = [0, 1, 0]\n"
HELICAL = ('"revolute"', '"helical"')


def changed(*changes: tuple[str, str], more: str = "") -> str:
    text = SCENE
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text + more


def refused(text: str) -> str:
    with pytest.raises(eomgen.DescriptionError) as caught:
        scene_of(text)
    return str(caught.value)


def notes(text: str) -> str:
    return " | ".join(scene_of(text).notes)


def joint(keys: str) -> str:
    return changed((SHOULDER, SHOULDER + keys + "\n"))


# -- units -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "piece"),
    [
        (
            changed(('unit = "m" }', 'unit = "m" }\nweight = "5 N"'), ('"1 + load"', '"weight"')),
            "bodies.upper.mass): the parameter weight is a force (N), a mass in kg is expected",
        ),
        (
            changed(HELICAL, (SHOULDER, SHOULDER + 'pitch = "5 mm"\n')),
            'a length, a quantity in m/rad is expected; try: "5 mm/rev", the travel of a turn',
        ),
        (
            changed(("[0.03, 0.03, 0.002]", '["300 g/cm^2", 0.1, 0.1]')),
            'a moment of inertia in kg m^2 is expected; try: "300 g cm^2", a product of units',
        ),
    ],
)
def test_a_value_of_another_dimension_is_refused(text: str, piece: str) -> None:
    assert piece in refused(text)


def test_parameters_whose_unit_fits_or_is_unknown_are_left_alone() -> None:
    for label in ("kg", "g", "kilo", "-", ""):
        given = changed(('unit = "m" }', f'unit = "m" }}\nload2 = {{ value = 1, unit = "{label}" }}'))
        assert " is expected" not in notes(given.replace('"1 + load"', '"load2"'))
    stiff = changed(('unit = "m" }', 'unit = "m" }\nk = "5 N m"'), (SHOULDER, SHOULDER + 'stiffness = "k"\n'))
    assert " is expected" not in notes(stiff)
    screw = changed(HELICAL, (SHOULDER, SHOULDER + 'pitch = "5 mm/rev"\n'))
    assert not [note for note in scene_of(screw).notes if "pitch" in note]


# -- angles ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "note"),
    [
        (
            joint("limits = { lower = -180, upper = 3, stiffness = 50 }"),
            "the joint shoulder has its lower limit at -180 rad, 28.6 turns: angles without a unit are radians",
        ),
        (joint("stiffness = 5\nrest = 90"), "the spring of the joint shoulder rests at 90 rad, 14.3 turns"),
        (
            changed(more='[torsion_springs.t]\nfirst = "shoulder"\nstiffness = 1\nrest = 45\n'),
            "the torsion spring t rests at 45 rad, 7.16 turns",
        ),
    ],
)
def test_degrees_without_their_unit_are_noted(text: str, note: str) -> None:
    assert note in notes(text)


# -- numbers -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "note"),
    [
        (SCENE + CORD + "stiffness = -80\n", "springs.cord.stiffness: the stiffness -80 is negative, and pushes away"),
        (
            changed(more="[curves.push]\npoints = [[0, 0], [1, 5]]\n"),
            "the curve push changes nothing: no formula mentions it",
        ),
        (
            changed(("[0.03, 0.03, 0.002]", "[30000, 30000, 2000]")),
            "bodies.upper.inertia: the radius of gyration is 122 m, and the scene is no larger than 0.5 m",
        ),
    ],
)
def test_what_is_hardly_meant_is_noted(text: str, note: str) -> None:
    assert note in notes(text)


def test_a_spring_of_negative_length_is_refused() -> None:
    text = refused(SCENE + CORD + "stiffness = 80\nlength = -0.3\n")
    assert "springs.cord.length): the length of a spring is -0.3; try: 0 or more" in text


BEAM = """format = 1
name = "beam"
[beams.b]
length = 1.0
section = { elastic_modulus = 2.1e11, density = 7850, area = 1e-4, second_moments = [1e-9, 1e-9] }
bending_z = { modes = 2, damping_ratio = RATIO }
[joints.r]
type = "fixed"
parent = "base"
child = "b"
"""
HOLD = """[controllers.hold]
type = "state_feedback"
coordinates = ["shoulder"]
[controllers.hold.calibration]
method = "pole_placement"
damping_ratios = RATIO
"""


def test_damping_in_percent_of_critical_is_noted() -> None:
    assert "beams.b.bending_z.damping_ratio: 2 is 200 % of critical; try 0.02" in notes(BEAM.replace("RATIO", "2"))
    assert not scene_of(BEAM.replace("RATIO", "0.02")).notes
    held = changed(('effort = "motor"', 'effort = "motor + hold"')) + HOLD
    note = "controllers.hold.calibration.damping_ratios[0]: 30 is 3000 % of critical; try 0.3"
    assert note in notes(held.replace("RATIO", "30"))
    assert "critical" not in notes(held.replace("RATIO", "0.3"))


# -- words -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "piece"),
    [
        (
            joint("rotation = [0, 1.57, 0]"),
            "a table is needed for each; try: rotation = [{ axis = [0, 1, 0], angle = 1.57 }]",
        ),
        (changed((SHOULDER, "axis = 0, 1, 0\n")), "try: a list stands in [ ]: axis = [0, 1, 0]"),
        (changed(('effort = "motor"', 'effort = "tip[2]"')), "try: position.tip[2]"),
    ],
)
def test_what_is_meant_is_told(text: str, piece: str) -> None:
    assert piece in refused(text)


def test_the_command_line_prints_the_notes_of_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "arm.toml").write_text(joint("stiffness = -5"))
    words = ["simulate", str(tmp_path / "arm.toml"), "--out", str(tmp_path / "o"), "--no-plots"]
    assert main([*words, "--t-end", "0.01", "--initial", "shoulder=30"]) == 0
    said = capsys.readouterr()
    assert said.err.count("note: joints.shoulder.stiffness: the stiffness -5 is negative") == 1
    assert (said.err + said.out).count("the joint shoulder starts at 30 rad, 4.77 turns") == 1


def test_starts_on_the_command_line_have_the_units_of_their_coordinates(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "arm.toml").write_text(SCENE)
    words = ["simulate", str(tmp_path / "arm.toml"), "--out", str(tmp_path / "o"), "--no-plots", "--t-end", "0.01"]
    assert main([*words, "--initial", "shoulder=5 m"]) == 2
    said = "usage error: initial position of shoulder: '5 m' is a length, an angle in rad is expected; try: \"5 rad\""
    assert said in capsys.readouterr().err
    assert main([*words, "--initial", "shoulder=90 deg", "--initial", "v.shoulder=30 rpm"]) == 0
    assert "corrected" not in capsys.readouterr().out
    start = eomgen.Solution.load(tmp_path / "o" / "solution.npz")
    assert (start["q.shoulder"][0], start["v.shoulder"][0]) == pytest.approx((np.pi / 2, np.pi))


def test_one_elastic_coordinate_starts_where_it_is_told() -> None:
    bent = {"modes": 2, "stiffness": 10.0}
    beam = {"length": 2.0, "mass_per_length": 1.0, "bending_y": bent, "bending_z": bent}
    model = eomgen.build(
        {
            **{"format": 1, "name": "mast", "beams": {"mast": beam}},
            "joints": {"foot": {"type": "fixed", "parent": "base", "child": "mast"}},
        }
    )
    run = model.simulate(1e-3, 1e-3, initial={"mast[2]": "3 mm", "mast[1]": {"velocity": 0.2}}, error_estimate=False)
    assert run.q[0].tolist() == [0.0, 0.0, 0.003, 0.0] and run.v[0].tolist() == [0.0, 0.2, 0.0, 0.0]
    for name, said in (("mast[4]", "there is no joint 'mast[4]'"), ("mast[1]", "'1 rad' is an angle, a length in m")):
        with pytest.raises(eomgen.UsageError) as caught:
            model.simulate(1e-3, 1e-3, initial={name: "1 rad"})
        assert said in str(caught.value)


# -- runs --------------------------------------------------------------------------------------------------------------


def told(model: eomgen.Model, *span: float, **options: Any) -> list[str]:
    return list(model.simulate(*span, error_estimate=False, **options).metadata["notes"])


def test_an_input_that_nobody_gives_is_noted() -> None:
    model = eomgen.build(pushed().build(), profile="quick")
    note = "the input u is 0: neither the scene nor the run gives it"
    assert note in told(model, 0.01, 1e-3)
    assert note not in told(model, 0.01, 1e-3, inputs={"u": 0.0})
    assert not told(arm(), 0.01, 1e-3)


def test_a_sample_longer_than_the_run_is_noted() -> None:
    servo = """[controllers.servo]
type = "sampled"
sample = "100 ms"
signals = { error = "0.1 - q.shoulder" }
"""
    scene = scene_of(changed(('effort = "motor"', 'effort = "motor + servo"')) + servo)
    model = eomgen.build(scene, profile="quick")
    law = {"controllers": {"servo": lambda t, signals: signals[0]}}
    assert "servo is sampled once: every 0.1 s in a run of 0.05 s" in told(model, 0.05, 1e-3, **law)
    assert not told(model, 0.1, 1e-3, **law)
