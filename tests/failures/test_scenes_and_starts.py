"""Mistakes in scenes, starts and calls that were passed over or answered by a hint that misled; tables and units of
curves are in ``tests/scene/test_column_units.py``."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.scene.load import load_toml

SLIDER = """\
format = 1
name = "slider"
[inputs]
motor = { unit = "N" }
[bodies.m]
mass = 1
[joints.x]
type = "prismatic"
parent = "base"
child = "m"
axis = [1, 0, 0]
[efforts.e]
joint = "x"
effort = "motor"
"""
ARM = """\
format = 1
name = "arm"
[bodies.upper]
mass = 2
center_of_mass = [0, 0, -0.25]
inertia = [0.03, 0.03, 0.002]
[joints.shoulder]
type = "revolute"
parent = "base"
child = "upper"
axis = [0, 1, 0]
[points.tip]
body = "upper"
position = [0, 0, -0.5]
"""
BEAM = """\
format = 1
name = "beam"
[beams.b]
model = "cosserat"
length = 1.0
elements = 4
section = { shape = "circle", diameter = 0.01, density = 7800, elastic_modulus = 2e11, poisson_ratio = 0.3 }
[joints.c]
type = "fixed"
parent = "base"
child = "b"
"""
CAR = """\
format = 1
name = "car"
[bodies.m]
mass = 300
[joints.h]
type = "prismatic"
parent = "base"
child = "m"
axis = [0, 0, 1]
initial = { position = 0.29 }
[points.hub]
body = "m"
[tyres.w]
center = "hub"
radius = 0.3
stiffness = 2e5
damping = 500
"""

REFUSED = [
    (SLIDER, 'effort = "motor"', 'effort = "= motor"', "a formula does not begin with '='", "the formula without it"),
    (
        SLIDER,
        "[base]",
        "velocity = [1, 0, 0]",
        "unknown here",
        "position alone, from which rates follow",
    ),
    (SLIDER, "[events.e]", 'when = "q.x == 0"', "'==' is not part", '"q.x": an event is at the roots'),
    (SLIDER, "[events.e]", 'when = "q.x = 0.5"', "'=' is not part", '"q.x - (0.5)": an event is at the roots'),
    (SLIDER, "[outputs.f]", 'formula = "effort.e"', "unknown quantity 'effort'", "drive_effort.e of a driven joint"),
    (SLIDER, "[simulation]", 'method = "ode45"', "there is no method 'ode45'", "rk45, or taylor for small errors"),
    (BEAM, "elements = 4", "elements = 4\ndamping_ratio = 0.1", "unknown here", "stiffness_damping, 2 ratio / w in s"),
    (BEAM, "elements = 4", "elements = 4\nmass_damping = 0.1", "unknown here", "none goes with the mass"),
    (BEAM, "elements = 4", "elements = 4\ninitial = { angle = 1 }", "unknown here", "shape or curvature, of the beam"),
    (BEAM, "elements = 4", "elements = 4\nEI = 100", "unknown here", "stiffness"),
    (BEAM, "density", "rho", "unknown here", "density"),
]


@pytest.mark.parametrize(("text", "old", "new", "what", "hint"), REFUSED)
def test_what_is_refused_says_what_to_write(
    text: str, old: str, new: str, what: str, hint: str, tmp_path: Path
) -> None:
    changed = text.replace(old, new) if old in text else f"{text}{old}\n{new}\n"
    (tmp_path / "scene.toml").write_text(changed)
    with pytest.raises(eomgen.DescriptionError) as error:
        eomgen.load(tmp_path / "scene.toml")
    assert any(what in problem.what and hint in problem.hint for problem in error.value.problems), str(error.value)
    assert all("scene.toml:" in problem.where for problem in error.value.problems)


@pytest.mark.parametrize("points", ["[0, 0, 0], [1, 0, 0], [0, 0, 0]", "[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 0, 0.01]"])
def test_a_beam_whose_points_go_back_on_themselves_is_refused(points: str) -> None:
    with pytest.raises(eomgen.DescriptionError, match=r"the points go back on themselves: by 1[78]"):
        load_toml(BEAM.replace("length = 1.0", f"shape = {{ points = [{points}] }}"))


@pytest.mark.parametrize("angle", [0, 45, 90, 150])
def test_points_around_a_bend_are_taken(angle: int) -> None:
    x, y = 1.0 + np.cos(np.radians(angle)), np.sin(np.radians(angle))
    load_toml(BEAM.replace("length = 1.0", f"shape = {{ points = [[0, 0, 0], [1, 0, 0], [{x}, {y}, 0]] }}"))


NOTED = [
    (
        BEAM,
        "7800",
        "7.85",
        "beams.b.section.density: the density 7.85 kg/m^3 is below the density of any foam; 7850",
    ),
    (
        BEAM,
        "2e11",
        "210",
        "beams.b.section.elastic_modulus: the modulus 210 Pa is below the modulus of any solid;",
    ),
    (
        CAR,
        "position = 0.29",
        "position = 0",
        "tyres.w: the tyre w starts 0.3 m deep in its road, with a radius of 0.3 m",
    ),
    (CAR, "radius = 0.3", "radius = 1.2", "tyres.w: the tyre w starts 0.91 m deep in its road, with a radius"),
]


@pytest.mark.parametrize(("text", "old", "new", "note"), NOTED)
def test_numbers_that_hardly_anyone_means_are_noted(text: str, old: str, new: str, note: str) -> None:
    assert load_toml(text).notes == ()
    assert any(found.startswith(note) for found in load_toml(text.replace(old, new)).notes)


@pytest.fixture(scope="module")
def arm() -> eomgen.Model:
    return eomgen.build(load_toml(ARM), profile="quick")


@pytest.fixture(scope="module")
def car() -> eomgen.Model:
    return eomgen.build(load_toml(CAR), profile="quick")


@pytest.mark.slow_cases("0.2")
@pytest.mark.parametrize("height", [0.2, 0.1, 0.0, -2.0])
def test_a_tyre_that_a_call_starts_in_the_road_is_told_with_depth_and_force(car: eomgen.Model, height: float) -> None:
    found = car.simulate(0.01, 1e-3, initial={"h": height})
    depth = 0.3 - height
    assert f"the tyre w starts {depth:.4g} m deep in its road" in found.message
    assert f"{2e5 * depth / 1e3:.3g} kN push it out" in found.message
    assert "deep_start" in {finding.name for finding in found.findings}


@pytest.mark.parametrize("height", [0.24, 0.3, 2.0])
def test_a_tyre_on_its_road_is_left_alone(car: eomgen.Model, height: float) -> None:
    assert "deep in its road" not in car.simulate(0.01, 1e-3, initial={"h": height}).message


def test_a_tyre_in_the_road_is_told_by_simulators(car: eomgen.Model) -> None:
    note = "the tyre w starts 0.3 m deep in its road"
    simulator = car.start({"h": 0.0})
    assert any(note in text for text in simulator.notes)
    simulator.set_state({"h": 0.3})
    assert simulator.notes == ()
    simulator.set_state({"h": 0.0})
    assert any(note in text for text in simulator.notes)
    assert car.start({"h": 0.0}, start="equilibrium").notes[0].startswith("initial position")


@pytest.mark.slow_cases("initial0-True")
@pytest.mark.parametrize(
    ("initial", "turned"),
    [
        ({"q": [45]}, True),
        ({"q": np.array([-90.0])}, True),
        ({"shoulder": 90}, True),
        ({"q": [6]}, False),
        ({"q": np.radians([400.0])}, False),
        ({"shoulder": "450 deg"}, False),
    ],
)
def test_starts_of_many_turns_are_told_for_runs_and_equilibria(
    arm: eomgen.Model, initial: dict[str, object], *, turned: bool
) -> None:
    note = "the joint shoulder starts at"
    assert (note in arm.simulate(0.01, 1e-3, initial=initial).message) is turned
    assert any(note in text for text in arm.start(initial).notes) is turned
    assert any(note in text for text in arm.equilibrium(initial).notes) is turned


@pytest.mark.slow_cases("uniform(-180, 180)--162.0")
@pytest.mark.slow_cases("uniform(20, 40)-39.0")
@pytest.mark.parametrize(
    ("text", "farthest"),
    [
        ("uniform(20, 40)", 39.0),
        ("uniform(-180, 180)", -162.0),
        ("values(10, 30)", 30.0),
        ("uniform(20 deg, 40 deg)", None),
        ("normal(0, 1)", None),
        ("uniform(-3.2, 3.2)", None),
    ],
)
def test_samples_that_start_at_many_turns_are_told(arm: eomgen.Model, text: str, farthest: float | None) -> None:
    message = arm.simulate_many(0.01, 1e-3, vary={"q.shoulder": text}, samples=2, workers=1).message
    told = f"vary q.shoulder = {text}: samples start at up to"
    assert (told in message) is (farthest is not None)
    if farthest is not None:
        assert abs(float(message.partition(told)[2].split()[0])) == pytest.approx(abs(farthest))


def test_a_joint_of_the_name_of_a_block_without_numbers_is_a_joint() -> None:
    model = eomgen.build(load_toml(CAR.replace("joints.h", "joints.z")), profile="quick")
    for value in (0.5, "50 cm", {"position": 0.5}, [0.5]):
        assert model.simulate(0.01, 1e-3, initial={"z": value}).q[0, 0] == 0.5
        assert model.start({"z": value}).q[0] == 0.5


@pytest.mark.slow
def test_one_motion_of_several_coordinates_that_nothing_determines_is_told_as_one() -> None:
    """A body hangs on a ball joint with its centre beside all of its axes: turns about the vertical have no force."""
    text = ARM.replace('"revolute"', '"spherical"').replace("axis = [0, 1, 0]", "")
    text = text.replace("center_of_mass = [0, 0, -0.25]", "center_of_mass = [0.1, 0.2, -0.25]")
    rest = eomgen.build(load_toml(f"{text}\n[base]\n"), profile="quick").equilibrium()
    assert len(rest.undetermined) == 3
    assert f"nothing determines 1 motion along {', '.join(rest.undetermined)}" in rest.message


@pytest.mark.slow_cases("generalized_alpha")
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4"])
def test_a_motion_that_grows_beyond_the_largest_number_is_told_without_a_warning(method: str) -> None:
    text = SLIDER.replace('effort = "motor"', 'effort = "30 * (q.x - 1) + 2 * v.x"')
    model = eomgen.build(load_toml(text), method=method, profile="quick")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solution = model.simulate(100.0, 1e-2)
    assert not solution.success
    assert "the energy is beyond the finite numbers from t = 5" in solution.message
    assert ": the motion grows without end: v.x by a factor of" in solution.message
    assert "try: other signs or sizes of gains, damping and stiffnesses" in solution.message


@pytest.mark.slow_cases("words1")
@pytest.mark.parametrize("words", [["--help"], ["simulate", "--help"]])
def test_a_reader_of_the_output_that_has_gone_is_no_error(words: list[str], tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(ARM)
    reading, writing = os.pipe()
    os.close(reading)
    try:
        command = [sys.executable, "-m", "eomgen", *words]
        done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, cwd=tmp_path, check=False)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")
