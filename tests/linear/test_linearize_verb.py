"""``eomgen linearize``: what it prints, what it writes, and about which states."""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.solvers import equilibrium_search

QUARTER_CAR = str(Path(__file__).parents[2] / "examples" / "quarter_car" / "scene.toml")
TOP = """\
format = 1
name = "top"
[parameters]
mass = { value = 1.3, unit = "kg", tunable = true }
[bodies]
yoke = { mass = 0 }
ring = { mass = 0 }
top = { mass = "mass", center_of_mass = [0, 0, 0.25], inertia = [0.04, 0.04, 0.03] }
[joints]
precession = { type = "revolute", parent = "base", child = "yoke", axis = [0, 0, 1] }
nutation = { type = "revolute", parent = "yoke", child = "ring", axis = [1, 0, 0], initial = { position = 0.6 } }
spin = { type = "revolute", parent = "ring", child = "top", axis = [0, 0, 1] }
"""


@pytest.fixture
def top(tmp_path: Path) -> str:
    path = tmp_path / "top.toml"
    path.write_text(TOP, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize("words", [["equilibrium"], ["linearize"]])
def test_an_interrupted_search_tells_how_far_it_has_come(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    step, calls = equilibrium_search._step, []

    def interrupted(*given: Any) -> Any:
        calls.append(given)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return step(*given)

    monkeypatch.setattr(equilibrium_search, "_step", interrupted)
    assert main([*words, QUARTER_CAR, "--t", "30"]) == 130
    told = capsys.readouterr()
    assert told.out == ""
    assert re.fullmatch(
        r"interrupted: the search for an equilibrium by a damped motion had 2 steps; the largest unbalanced"
        r" acceleration there is \d+\.\d+ m/s\^2 or rad/s\^2",
        told.err.strip(),
    )


@pytest.mark.slow
def test_everything_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "out"
    words = ["--root-locus", "damper=100:6000:7:log", "--band", "0.5:20", "--response", "road:tyre_load"]
    words += ["--response", "road:body", "--ride", "body_acceleration", "--set", "skyhook=300", "--json"]
    words += ["--out", str(folder), "--profile", "instant"]
    assert main(["linearize", QUARTER_CAR, "--t", "30", *words]) == 0
    data = json.loads(capsys.readouterr().out)
    files = ["modes.json", "modes.csv", "matrices.npz", "modes.png", "root_locus.csv", "root_locus.png"]
    files += ["responses.csv", "responses.png", "ride.csv", "spectra.csv", "spectra.png"]
    assert data["files"] == files and all((folder / name).is_file() for name in files)
    model = eomgen.build(QUARTER_CAR, profile="instant")
    lin = model.linearize(t=30.0, parameters={"skyhook": 300.0})
    values = lin.modes().eigenvalues.tolist()
    assert [mode["eigenvalue"] for mode in data["modes"]] == [[value.real, value.imag] for value in values]
    assert {k: v for k, v in data.items() if k != "files"} == json.loads((folder / "modes.json").read_text())
    roots = np.loadtxt(folder / "root_locus.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(roots[:, 0], np.geomspace(100.0, 6000.0, 7), rtol=1e-12)
    for row in roots:
        at = model.linearize(t=30.0, parameters={"skyhook": 300.0, "damper": row[0]}).state_space().A
        found = np.sort_complex(row[1::2] + 1j * row[2::2])
        np.testing.assert_allclose(found, np.sort_complex(np.linalg.eigvals(at)), rtol=1e-9)
    responses = np.loadtxt(folder / "responses.csv", delimiter=",", skiprows=1)
    assert (responses[0, 0], responses[-1, 0]) == (0.5, pytest.approx(20.0))
    expected = lin.frequency_response(2.0 * math.pi * responses[:, 0], "road", "body")
    np.testing.assert_allclose(responses[:, 3] + 1j * responses[:, 4], expected, rtol=1e-12)


@pytest.mark.slow
def test_about_a_steady_motion(top: str, capsys: pytest.CaptureFixture[str]) -> None:
    wanted = ["--at", "steady", "--velocity", "spin=80", "--coordinate", "nutation=0.6", "--json"]
    assert main(["linearize", top, *wanted]) == 0
    shown = capsys.readouterr()
    data = json.loads(shown.out)
    assert (data["about"], data["stability"]) == ("steady motion", "marginal")
    assert data["v"][2] == 80.0
    assert "neither stable nor unstable: 5 modes without decay or growth" in shown.err


@pytest.mark.slow
def test_about_the_initial_state_and_a_time_of_a_run(top: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["linearize", top, "--at", "initial"]) == 0
    shown = capsys.readouterr()
    assert "top about the initial state at t = 0 s" in shown.out
    assert "unstable, frozen at t = 0 s in a state that accelerates: mode" in shown.err
    assert main(["linearize", QUARTER_CAR, "--at", "0.5", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["about"], data["t"]) == ("motion", 0.5)


def test_roots_in_python_follow_an_equilibrium() -> None:
    """A mass on a spring that hangs at m g / k: the equilibrium moves with the stiffness."""
    builder = eomgen.SceneBuilder("hanging").parameter("stiffness", 100.0, tunable=True).body("m", 2.0)
    builder.joint("slide", "prismatic", "base", "m", axis=[0, 0, 1], stiffness="stiffness")
    model = eomgen.build(builder.build(), profile="instant")
    locus = model.root_locus("stiffness", [50.0, 100.0, 200.0])
    np.testing.assert_allclose(
        np.abs(locus.eigenvalues), np.sqrt(np.array([[25.0], [50.0], [100.0]])) * [[1.0, 1.0]], rtol=1e-12
    )
    assert np.all(np.sign(locus.eigenvalues.imag) == np.sign(locus.eigenvalues.imag[0]))
    assert locus.stability == ("marginal",) * 3
    with pytest.raises(eomgen.UsageError, match=r"values: the shape is \(\), \(n,\) with n from 1 on is needed"):
        model.root_locus("stiffness", 5.0)  # type: ignore[arg-type]  # on purpose
    with pytest.raises(eomgen.UsageError, match="at stifness = 5: there is no parameter 'stifness'; try: stiffness"):
        model.root_locus("stifness", [5.0])


@pytest.mark.slow
def test_a_ride_on_a_measured_road(capsys: pytest.CaptureFixture[str]) -> None:
    """The row of a road with a gap of 1 m has the number of Python, which a run has, too; classes are refused."""
    car = str(Path(QUARTER_CAR).parents[1] / "half_car_on_measured_road" / "scene.toml")
    words = ["linearize", car, "--ride", "body_acceleration:Wk"]
    assert main([*words, "--speeds", "10,15", "--json"]) == 0
    ride = json.loads(capsys.readouterr().out)["ride"]
    assert [(row["class"], row["speed"]) for row in ride] == [("measured", 10.0), ("measured", 15.0)]
    model = eomgen.build(car)
    expected = model.linearize().rms("body_acceleration", model.road_excitation(), weighting="Wk")
    assert ride[0]["rms"]["body_acceleration"] == pytest.approx(expected, rel=1e-9)
    assert expected == pytest.approx(model.simulate().rms("body_acceleration", weighting="Wk"), rel=0.05)
    assert main(words) == 0
    heading, row = (line.split() for line in capsys.readouterr().out.splitlines()[-2:])
    assert heading == ["class", "speed", "[m/s]", "rms", "body_acceleration", "(Wk)", "[m/s^2]"]
    assert row == ["measured", "10", f"{expected:.6g}"]
    assert main([*words, "--classes", "A,C"]) == 2
    assert capsys.readouterr().err.endswith(
        "--classes A,C: the road of the scene is a measured one, which has a spectrum of its own, and no class;"
        " try: without --classes [E2187]\n"
    )


@pytest.mark.slow
def test_a_campbell_diagram_of_a_tilting_disc(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """I_d w^2 = k + I_p W w, forward with w positive: 2x at k / (4 I_d - 2 I_p), backward 1x at k / (I_d + I_p)."""
    path, folder = tmp_path / "rotor.toml", tmp_path / "out"
    path.write_text(
        """\
format = 1
name = "rotor"
gravity = [0, 0, 0]
[bodies]
cross = { mass = 0 }
middle = { mass = 0 }
disc = { mass = 5, inertia = [0.18, 0.18, 0.31] }
[joints]
tilt_x = { type = "revolute", parent = "base", child = "cross", axis = [1, 0, 0], stiffness = 7200 }
tilt_y = { type = "revolute", parent = "cross", child = "middle", axis = [0, 1, 0], stiffness = 7200 }
spin = { type = "revolute", parent = "middle", child = "disc", axis = [0, 0, 1] }
""",
        encoding="utf-8",
    )
    words = ["--campbell", "spin=10:300:3", "--orders", "1,2", "--whirl", "tilt_x:tilt_y", "--json"]
    drawn = ["--modes", "3", "--speed-unit", "rpm", "--band", "1:40", "--profile", "instant"]
    assert main(["linearize", str(path), "--out", str(folder), *words, *drawn]) == 0
    crossings = json.loads(capsys.readouterr().out)["campbell"]
    expected = [
        (1.0, math.sqrt(7200 / 0.49), "backward"),
        (2.0, math.sqrt(7200 / (4 * 0.18 + 2 * 0.31)), "backward"),
        (2.0, math.sqrt(7200 / (4 * 0.18 - 2 * 0.31)), "forward"),
    ]
    assert [(item["order"], item["whirl"]) for item in crossings] == [(order, word) for order, _, word in expected]
    for item, (_, speed, _) in zip(crossings, expected, strict=True):
        assert item["speed"] == pytest.approx(speed, rel=1e-9)
    with (folder / "campbell.csv").open(encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    assert header[:4] == ["spin", "mode3 damped frequency [Hz]", "mode3 damping_ratio", "mode3 whirl"]
    assert [float(row[0]) for row in rows] == [10.0, 155.0, 300.0] and float(rows[0][3]) == -1.0
    assert {item["mode"] for item in crossings} == {3, 4}  # the spin is modes 1 and 2, without stiffness
