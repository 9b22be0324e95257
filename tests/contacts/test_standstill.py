"""A car with locked wheels on a slope of 20 % stands: its springs are the carcasses of the tyres."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.pipeline.model import Model
from tests.contacts.pairs import scene_of
from tests.contacts.states import OWN
from tests.oracles.evaluation import Array

EXAMPLES = Path(eomgen.__file__).parents[1] / "examples"
SLOPE = math.atan(0.2)
CAR = """format = 1
name = "car"
gravity = [{along}, {across}, {down}]
bodies.car = {{ mass = 1500, inertia = [400, 2000, 2200], center_of_mass = [0.1, 0, 0.25] }}
[joints.car]
type = "free"
parent = "base"
child = "car"
initial = {{ position = [0, 0, 0.295] }}
"""
WHEEL = """
[contacts.{name}]
first = {{ body = "base", axis = [0, 0, 1], x_axis = [1, 0, 0] }}
second = {{ body = "car", position = [{x}, {y}, 0], axis = [0, 1, 0] }}
shape = "disc"
{keys}
"""
TYRES = {
    "magic_formula": f'tangential = {{ type = "magic_formula", file = "{OWN.as_posix()}" }}\n'
    'normal = { type = "linear", stiffness = "200 kN/m", damping = 4000 }\nradius = 0.31',
    "file": f'tangential = {{ type = "magic_formula", file = "{OWN.as_posix()}", '
    "coefficients = { VERTICAL_DAMPING = 4000 } }",
    "brush": 'tangential = { type = "brush", coefficients = { STIFFNESS = 15, FRICTION = 0.9 } }\n'
    'normal = { type = "linear", stiffness = "200 kN/m", damping = 4000 }\nradius = 0.31',
}


def standing(law: str, way: float, duration: float) -> tuple[Array, Array]:
    """Return positions (n, 3), m, and velocities (n, 6) of a car on a slope that falls at an angle ``way`` to the
    heading."""
    pull = 9.81 * math.sin(SLOPE)
    text = CAR.format(along=-pull * math.cos(way), across=pull * math.sin(way), down=-9.81 * math.cos(SLOPE))
    places = [(f"wheel_{k}", x, y) for k, (x, y) in enumerate(((1.4, 0.75), (1.4, -0.75), (-1.3, 0.75), (-1.3, -0.75)))]
    text += "".join(WHEEL.format(name=name, x=x, y=y, keys=TYRES[law]) for name, x, y in places)
    run = eomgen.build(scene_of(text), method="rk4", profile="quick").simulate(
        duration, 1e-3, method="rk4", record_every=100, error_estimate=False
    )
    assert run.success and not any(finding.name == "contact_step" for finding in run.findings), run.message
    return run.q[:, 4:], run.v


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "way", "duration"),
    [
        pytest.param("brush", 0.0, 6.0, id="brush"),
        pytest.param("brush", 0.0, 60.0, id="brush-long", marks=pytest.mark.long),
        pytest.param("brush", 1.0, 60.0, id="brush-oblique", marks=pytest.mark.long),
        pytest.param("magic_formula", 0.0, 60.0, id="magic_formula", marks=pytest.mark.long),
        pytest.param("magic_formula", 1.0, 60.0, id="magic_formula-oblique", marks=pytest.mark.long),
        pytest.param("file", 0.0, 60.0, id="file", marks=pytest.mark.long),
    ],
)
def test_a_car_on_a_slope_does_not_creep(law: str, way: float, duration: float) -> None:
    places, velocities = standing(law, way, duration)
    settled = len(places) // 2
    assert np.abs(velocities[settled:]).max() < 1e-5
    assert np.abs(places[-1] - places[settled]).max() / (0.5 * duration) < 1e-6
    assert 1e-4 < np.linalg.norm((places[-1] - places[0])[:2]) < 0.05


def car_at(speed: float, folder: Path) -> Model:
    """Return the example's car on a level road."""
    car, scene = (EXAMPLES / "driving_car" / "system" / "car.toml").as_posix(), folder / "scene.toml"
    include = f'[include.car]\nfile = "{car}"\nprefix = ""\nparameters = {{ speed = {speed} }}\n'
    scene.write_text(f'format = 1\nname = "car"\n{include}')
    return eomgen.build(scene, profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.0, 20.0])
@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_a_car_in_balance_raises_no_doubt(method: str, speed: float, tmp_path: Path) -> None:
    """It stands, or drives straight ahead: its struts, its rack and its lagged slips move by rounding alone."""
    run = car_at(speed, tmp_path).simulate(0.4, 1e-3, method=method)
    assert not run.findings, run.message


@pytest.mark.slow
def test_a_command_raises_no_doubt_about_a_car_that_drives_straight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Deflections of tyres are rounding, 1e-37 m; a first run has only the functions of its method."""
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))
    scene = EXAMPLES / "driving_car" / "system" / "step_steer.toml"
    options = ["--out", str(tmp_path), "--t-end", "0.02", "--no-plots", "--profile", "quick"]
    assert main(["simulate", str(scene), *options]) == 0
    assert "reached t = 0.02 s in 20 steps; method chosen" in capsys.readouterr().err


@pytest.mark.slow
def test_tyres_of_a_parked_car_are_springs(tmp_path: Path) -> None:
    """Their lagged slips hold it in all directions but one, in which it rolls."""
    found = car_at(0.0, tmp_path).equilibrium()
    assert found.frequencies[0] == 0.0 and found.frequencies[1] > 5.0
    assert len(found.undetermined) == 5 and "v.front_left_wheel" in found.undetermined


BLOCK = """format = 1
name = "block"
gravity = ["9.81 * sin(25 * pi / 180)", 0, "-9.81 * cos(25 * pi / 180)"]
bodies.block = { mass = 2, inertia = [0.01, 0.02, 0.02] }
joints.block = { type = "free", parent = "base", child = "block", initial = { position = [0, 0, 0.05] } }
parameters.damping = { value = 1, unit = "s/m", tunable = true }
"""
FOOT = """
[contacts.foot_{number}]
first = {{ body = "base", axis = [0, 0, 1] }}
second = {{ body = "block", position = [{x}, {y}, -0.05] }}
shape = "point"
normal = {{ type = "linear", stiffness = 1e5, damping = 200 }}
tangential = {{ type = "bristles", friction = 0.55, damping = "damping" }}
"""


@pytest.mark.slow
def test_bristles_with_a_tenth_of_their_critical_damping_do_not_creep() -> None:
    """Figures of docs/scene/contacts.md: a block on a slope, at 0.85 of the largest friction."""
    feet = enumerate(((0.1, 0.05), (-0.1, 0.05), (0.0, -0.1)))
    text = BLOCK + "".join(FOOT.format(number=number, x=x, y=y) for number, (x, y) in feet)
    model = eomgen.build(scene_of(text), profile="quick")
    critical = 2.0 * math.sqrt(0.55 / (9.81 * 1e-4))
    assert critical == pytest.approx(47.0, abs=0.5)
    for damping, creep in ((0.5, 0.34e-3), (1.0, 0.16e-3), (2.0, 0.0), (0.1 * critical, 0.0)):
        values = {"damping": damping}
        run = model.simulate(10.0, 1e-4, parameters=values, record_every=10, error_estimate=False)
        x, last = run.q[:, 4], run.t > 9.0
        assert x[-1] - x[last][0] == pytest.approx(creep, rel=0.1, abs=1e-7)
        if damping > 4.0:
            assert np.ptp(x[run.t > 0.5]) < 1e-6
