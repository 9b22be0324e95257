"""Generated C of scenes that start at equilibrium: it starts where ``simulate`` does, or says why not."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.lie.numeric import rotation_matrix
from tests.codegen.test_stand_alone import compiled, run
from tests.models.library import scene_text

SERVO = scene_text(
    "oscillator",
    name="servo",
    gravity=None,
    parameters={"load": {"value": 2.0, "unit": "kg", "tunable": True}},
    bodies__cart__mass="load",
    joints={
        "rail": {
            "type": "prismatic",
            "parent": "base",
            "child": "cart",
            "axis": [0, 0, 1],
            "initial": {"position": 0.3},
        }
    },
    states={"held": {"rate": "(500 * q.rail - held) / 0.1"}},
    efforts={"spring": {"joint": "rail", "effort": "-held - 40 * v.rail"}},
    outputs=None,
    simulation={"start": "equilibrium"},
)


def four_bar(start: str) -> eomgen.Scene:
    """Return a loop of three rods that hangs with a spring at its crank."""
    builder = eomgen.SceneBuilder("four_bar").simulation(start=start)
    before = "base"
    for name, length, angle in (("crank", 0.3, 0.6), ("coupler", 0.5, -0.3), ("rocker", 0.4, 1.2)):
        inertia = [1e-4, length**2 / 12, length**2 / 12]
        builder.body(name, 1.0, center_of_mass=[length / 2, 0, 0], inertia=inertia)
        place = [{"base": 0.0, "crank": 0.3, "coupler": 0.5}[before], 0, 0]
        more: dict[str, object] = {"initial": {"position": angle}}
        more |= {"stiffness": 8.0, "damping": 0.5} if name == "crank" else {}
        builder.joint(f"pin_{name}", "revolute", before, name, axis=[0, 1, 0], position=place, **more)
        before = name
    ground = {"body": "base", "position": [0.6, 0, 0], "axis": [0, 1, 0]}
    builder.constraint("end", "point_on_line", ground, {"body": "rocker", "position": [0.4, 0, 0]})
    return builder.build()


def rows_of(program: Path, *words: str) -> np.ndarray:
    result = run(program, *words)
    assert (result.returncode, result.stderr) == (0, "")
    return np.array([[float(text) for text in line.split(",")] for line in result.stdout.splitlines()[1:]])


@pytest.mark.slow
def test_the_program_of_a_spring_stands_still_at_m_g_over_k_also_with_an_internal_state(tmp_path: Path) -> None:
    scene = tmp_path / "servo.toml"
    scene.write_text(SERVO, encoding="utf-8")
    eomgen.generate(scene, tmp_path / "c")
    rows = rows_of(compiled(tmp_path / "c"), "2.0", "1e-2", "50")
    np.testing.assert_allclose(rows[:, 1], -2.0 * 9.81 / 500.0, atol=1e-12)
    np.testing.assert_allclose(rows[:, 2:4], 0.0, atol=1e-10)
    told = "It starts at static equilibrium, found when this code was made, at the default parameters (load = 2 kg)."
    assert told in (tmp_path / "c" / "README.md").read_text(encoding="utf-8")
    assert told[:60] in (tmp_path / "c" / "servo.c").read_text(encoding="utf-8")
    moved = rows_of(tmp_path / "c" / "program", "0.2", "1e-2", "5", "load=3")
    assert moved[-1, 1] < rows[0, 1] - 1e-3


def test_other_scenes_keep_their_bytes_but_for_the_start(tmp_path: Path) -> None:
    eomgen.generate(four_bar("initial"), tmp_path / "c")
    for file in (tmp_path / "c").iterdir():
        assert "equilibrium" not in file.read_text(encoding="utf-8")


@pytest.mark.slow
def test_what_has_no_equilibrium_starts_as_the_joints_say_and_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "falling.toml"
    scene.write_text(SERVO.replace("-held - 40 * v.rail", "-40 * v.rail"), encoding="utf-8")
    said = (
        "The scene asks for a start at static equilibrium, which was not found when this code was made, so it starts at"
        " the initial state of the joints. The reason: equilibrium: nothing holds v.rail: it accelerates with -9.81"
        " m/s^2"
    )
    assert main(["generate", str(scene), "--out", str(tmp_path / "c")]) == 0
    assert f"warning: servo: {said}" in capsys.readouterr().err
    assert said in (tmp_path / "c" / "README.md").read_text(encoding="utf-8")
    assert rows_of(compiled(tmp_path / "c"), "0.1", "1e-2")[0, 1] == 0.3


@pytest.mark.slow
def test_without_a_compiler_the_folder_is_written_with_the_reason(tmp_path: Path) -> None:
    script = f"import eomgen; eomgen.generate({str(tmp_path / 's.toml')!r}, {str(tmp_path / 'c')!r})"
    (tmp_path / "s.toml").write_text(SERVO, encoding="utf-8")
    environment = {"EOMGEN_CACHE": str(tmp_path / "cache"), "CC": str(tmp_path / "none"), "PATH": str(tmp_path)}
    result = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    assert "RuntimeWarning: servo: The scene asks for a start at static equilibrium" in result.stderr
    assert "which was not found when this code was made" in (tmp_path / "c" / "README.md").read_text(encoding="utf-8")


def rolling(speed: str) -> eomgen.Model:
    """Return a sprung wheel that rolls with slip at 10 m/s, ahead as the text gives it."""
    builder = eomgen.SceneBuilder("rolling").body("car", 100.0).body("wheel", 10.0, inertia=[0.3, 0.5, 0.3])
    ahead = {"drive": speed} if "t" in speed else {"initial": {"velocity": float(speed)}}
    builder.joint("ahead", "prismatic", "base", "car", axis=[1, 0, 0], **ahead)
    builder.body("axle", 0.0).joint("heave", "prismatic", "car", "axle", axis=[0, 0, 1], stiffness=4e4)
    builder.joint("spin", "revolute", "axle", "wheel", axis=[0, 1, 0], initial={"velocity": 40.0})
    builder.effort("slip", "spin", "-20 * (0.25 * v.spin - v.ahead)")
    builder.simulation(start="equilibrium")
    return eomgen.build(builder.build(), profile="instant")


def test_a_vehicle_that_pitches_as_it_settles_starts_along_the_road() -> None:
    scene: dict[str, Any] = {"format": 1, "name": "vehicle", "gravity": [0, 0, -9.81], "points": {}, "forces": {}}
    scene["bodies"] = {"car": {"mass": 1000.0, "inertia": [300, 900, 1000]}}
    start = {"velocity": [0, 0, 0.2, 10, 0, 0]}
    scene["joints"] = {"car": {"type": "free", "parent": "base", "child": "car", "initial": start}}
    for name, x, y, stiffness in (
        ("a", 1.2, 0.7, 3e4),
        ("b", 1.2, -0.7, 3e4),
        ("c", -1.3, 0.7, 1e4),
        ("d", -1.3, -0.7, 1e4),
    ):
        scene["points"][name] = {"body": "car", "position": [x, y, 0]}
        spring = [0, 0, f"-{stiffness} * position.{name}[2] - 1e3 * velocity.{name}[2]"]
        scene["forces"][name] = {"body": "car", "point": [x, y, 0], "force": spring}
    scene["simulation"] = {"start": "equilibrium"}
    run = eomgen.build(scene, profile="instant").simulate(1e-3, 1e-3, error_estimate=False)
    R = rotation_matrix(run.q[0][:4])
    assert np.arcsin(R[2, 0]) > 0.05
    np.testing.assert_allclose(R @ run.v[0][3:], [10.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(R @ run.v[0][:3], [0.0, 0.0, 0.2], atol=1e-12)


@pytest.mark.slow
def test_a_wheel_that_rolls_starts_settled_by_its_initial_velocity_or_as_a_steady_motion() -> None:
    settled = -10.0 * 9.81 / 4e4
    run = rolling("10").simulate(0.1, 1e-3, error_estimate=False)
    np.testing.assert_allclose(run["q.heave"], settled, rtol=1e-6)
    np.testing.assert_allclose(run["v.spin"], 40.0, rtol=1e-12)
    driven = rolling("10 * t")
    with pytest.raises(eomgen.NumericalError) as caught:
        driven.simulate(0.1)
    assert "equilibrium: nothing holds v.spin: it accelerates with 400 rad/s^2" in str(caught.value)
    assert str(caught.value).endswith(
        "or a fixed joint; if spin rolls along with a drive, an initial velocity in place of the drive, or a run from"
        ' steady_motion({"spin": 40}), in Python'
    )
    steady = driven.steady_motion({"spin": 40.0})
    run = driven.simulate(0.1, 1e-3, initial={"q": steady.q, "v": steady.v}, error_estimate=False)
    np.testing.assert_allclose(run["q.heave"], settled, rtol=1e-6)
    np.testing.assert_allclose(run["v.spin"], 40.0, rtol=1e-9)
