"""The small examples against what is known of them: textbook equations, closed forms, published positions,
invariants."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

import eomgen
from eomgen import Model
from eomgen.cli import main
from tests.models.library import scene

EXAMPLES = Path(__file__).parents[2] / "examples"
FOLDERS = sorted(path.parent.name for path in EXAMPLES.glob("*/README.md"))
#: Without those whose model is a document of a front end of their own, which the command line does not read.
WITH_SCENES = [name for name in FOLDERS if any((EXAMPLES / name).glob("*.toml"))]
G = 9.81


def _model(name: str) -> Model:
    return eomgen.build(EXAMPLES / name / "scene.toml")


def _reference(rates: Callable[[float, np.ndarray], list[float]], start: list[float], end: float) -> np.ndarray:
    solution = solve_ivp(rates, (0.0, end), start, method="DOP853", rtol=1e-12, atol=1e-13)
    assert solution.success
    return solution.y[:, -1]


def _errors_of_halved_steps(model: Model, end: float, step: float, error: Callable[[np.ndarray], float]) -> list[float]:
    return [error(model.simulate(end, step / part).q[-1]) for part in (1, 2)]


@pytest.mark.parametrize("name", FOLDERS)
def test_each_folder_has_a_readme_with_its_picture_and_reference(name: str) -> None:
    readme = (EXAMPLES / name / "README.md").read_text(encoding="utf-8")
    assert f"]({name}.png)" in readme
    assert "## Reference" in readme


@pytest.mark.long_except_every(6)
@pytest.mark.slow_except("quarter_car")
@pytest.mark.long_cases(
    "cable_net",
    "elastic_pendulum",
    "elastic_slider_crank",
    "elastic_vehicle",
    "hanging_chain",
    "heavy_top",
    "misaligned_four_bar",
    "shear_frame_with_pendulum",
    "unbalanced_shaft",
)
@pytest.mark.parametrize("name", [name for name in WITH_SCENES if name != "active_vehicle"])
def test_commands_of_the_readme_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readme = (EXAMPLES / name / "README.md").read_text(encoding="utf-8")
    commands = re.findall(r"^    eomgen (.*)$", readme, re.MULTILINE)
    assert commands
    monkeypatch.chdir(EXAMPLES.parent)
    for command in commands:
        short = ["--t-end", "0.01", "--no-plots"] if command.startswith("simulate") else []
        arguments = [str(tmp_path / part) if part.startswith("out/") else part for part in command.split()]
        assert main([*arguments, *short]) == 0
    assert any((tmp_path / "out" / name).iterdir())


def _double_pendulum(t: float, y: np.ndarray) -> list[float]:
    """Two point masses; angles from the vertical; support at (0.04 sin 5t, 0.02 cos 8t). After any textbook."""
    m1, m2, l1, l2 = 1.0, 0.6, 0.5, 0.4
    first, second, w1, w2 = y
    side, up = -0.04 * 25.0 * math.sin(5.0 * t), G - 0.02 * 64.0 * math.cos(8.0 * t)
    c, s = math.cos(first - second), math.sin(first - second)
    matrix = [[(m1 + m2) * l1**2, m2 * l1 * l2 * c], [m2 * l1 * l2 * c, m2 * l2**2]]
    right = [
        -m2 * l1 * l2 * s * w2**2 - (m1 + m2) * l1 * (up * math.sin(first) + side * math.cos(first)),
        m2 * l1 * l2 * s * w1**2 - m2 * l2 * (up * math.sin(second) + side * math.cos(second)),
    ]
    return [w1, w2, *np.linalg.solve(matrix, right)]


@pytest.mark.slow
def test_double_pendulum_follows_the_textbook() -> None:
    model, end = _model("double_pendulum_on_shaking_base"), 5.0
    first, second, *_ = _reference(_double_pendulum, [0.8, 0.5, 0.0, 0.0], end)
    coarse, fine = _errors_of_halved_steps(
        model, end, 1e-3, lambda q: float(np.hypot(q[0] - first, q[0] + q[1] - second))
    )
    assert coarse < 2e-4
    assert coarse / fine == pytest.approx(4.0, rel=0.05)  # second order
    exact = model.simulate(end, 1e-3, method="rk4").q[-1]
    assert exact == pytest.approx([first, second - first], abs=1e-8)


def _kapitza(t: float, y: np.ndarray) -> list[float]:
    """Angle from the lower vertical; support at height 0.02 cos 150t, length 0.25."""
    return [y[1], -(G - 0.02 * 150.0**2 * math.cos(150.0 * t)) / 0.25 * math.sin(y[0])]


@pytest.mark.slow
def test_pendulum_on_shaking_base_follows_the_textbook_and_stays_upright() -> None:
    model, end = _model("pendulum_on_shaking_base"), 3.0
    angle, _ = _reference(_kapitza, [math.pi - 0.2, 0.0], end)
    coarse, fine = _errors_of_halved_steps(model, end, 2e-4, lambda q: abs(float(q[0]) - angle))
    assert coarse < 1e-3
    assert coarse / fine == pytest.approx(4.0, rel=0.05)
    assert model.simulate(end, 2e-4, method="rk4").q[-1, 0] == pytest.approx(angle, abs=5e-8)
    assert np.abs(model.simulate().outputs["lean"]).max() < 0.25


def test_pendulum_on_shaking_base_sways_at_kapitza_s_frequency() -> None:
    run = _model("pendulum_on_shaking_base").simulate(4.5)
    period = round(2.0 * math.pi / 150.0 / 2e-4)  # of the support, in steps: averaged out
    lean = np.convolve(run.outputs["lean"], np.ones(period) / period, mode="same")[300:-300]
    crossings = np.flatnonzero(np.diff(np.sign(lean)) > 0) * 2e-4
    slow = 2.0 * math.pi / np.mean(np.diff(crossings))
    # averaging: slow^2 = (amplitude frequency)^2 / (2 length^2) - g / length; its error is of order (slow / 150)^2 and
    # the squared amplitude of the sway, 0.2^2
    assert slow == pytest.approx(math.sqrt((0.02 * 150.0) ** 2 / (2.0 * 0.25**2) - G / 0.25), rel=0.03)


@pytest.mark.slow
def test_spherical_pendulum_sweeps_its_cone() -> None:
    mass, length, across, along, tilt, end = 2.0, 0.7, 0.03, 0.008, 0.6, 4.0
    rate = math.sqrt(mass * G * length / ((across + mass * length**2 - along) * math.cos(tilt)))
    bob = length * np.array(
        [math.sin(tilt) * math.cos(rate * end), math.sin(tilt) * math.sin(rate * end), -math.cos(tilt)]
    )
    model = _model("spherical_pendulum")
    for method in ("generalized_alpha", "rk4"):
        # the angular velocity in body axes is constant, and both methods move by the group's exponential: exact at any
        # step
        for step in (1e-2, 1e-3):
            run = model.simulate(end, step, method=method)
            np.testing.assert_allclose(run.outputs["bob"][-1], bob, atol=1e-13)
            np.testing.assert_allclose(run.outputs["bob"][:, 2], -length * math.cos(tilt), atol=1e-13)


def _torque_free(t: np.ndarray) -> np.ndarray:
    """Angular velocity by Jacobi's elliptic functions, for a start without rotation about the axis of smallest
    inertia."""
    first, second, third = 0.01, 0.02, 0.03
    spin, tumble = 6.0, 0.01
    energy, momentum = second * spin**2 + third * tumble**2, (second * spin) ** 2 + (third * tumble) ** 2
    a = math.sqrt((energy * third - momentum) / (first * (third - first)))
    c = math.sqrt((momentum - energy * first) / (third * (third - first)))
    pace = math.sqrt((third - second) * (momentum - energy * first) / (first * second * third))
    modulus = (second - first) * (energy * third - momentum) / ((third - second) * (momentum - energy * first))
    sn, cn, dn, _ = ellipj(pace * t + ellipk(modulus), modulus)
    return np.stack([a * cn, spin * sn, c * dn], axis=1)


@pytest.mark.slow
def test_free_body_flips_as_the_elliptic_functions_say() -> None:
    model = _model("free_spinning_body")
    run = model.simulate(method="rk4")
    expected = _torque_free(run.t)
    assert expected[:, 1].min() < -5.99  # it does turn over
    np.testing.assert_allclose(run.v[:, :3], expected, atol=1e-8)
    at_five = _torque_free(np.array([5.0]))[0]
    errors = [float(np.linalg.norm(model.simulate(5.0, step).v[-1, :3] - at_five)) for step in (1e-3, 5e-4)]
    assert errors[0] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def _arm_motion(model: Model, samples: int) -> tuple[np.ndarray, ...]:
    t, reach = np.linspace(0.0, 1.0, samples)[:, np.newaxis], np.array([0.8, 0.5, -0.6, 0.7, 0.6, -0.5, 0.9])
    pace = 2.0 * np.pi
    q = model.initial_q + reach * (1.0 - np.cos(pace * t)) / 2.0
    return q, reach * pace * np.sin(pace * t) / 2.0, reach * pace**2 * np.cos(pace * t) / 2.0


@pytest.mark.slow
def test_a_robot_arm_with_axes_beside_z_moves_as_one_with_axes_along_z() -> None:
    """Axes as a CAD program writes them. In the C they once turned about x: M off by 1, torques by 13 N m, poses by 0.3
    m."""
    axes = {"joints__joint1__axis": [1e-9, 0.0, 1.0], "joints__joint4__axis": [0.0, 3e-9, 1.0]}
    terms = ["mass", "inverse_dynamics", "forward_dynamics", "poses"]
    first, second = (
        eomgen.build(scene("robot_arm/scene", terms=terms, **changes), method="rk4") for changes in ({}, axes)
    )
    q, v, a = (part[7] for part in _arm_motion(first, 21))
    np.testing.assert_allclose(second.mass(q), first.mass(q), rtol=0, atol=1e-7)
    np.testing.assert_allclose(second.inverse_dynamics(q, v, a), first.inverse_dynamics(q, v, a), rtol=0, atol=1e-6)
    for body in first.bodies:
        np.testing.assert_allclose(second.pose(body, q), first.pose(body, q), rtol=0, atol=1e-7)
    runs = [model.simulate(0.3, 1e-3, method="rk4") for model in (first, second)]
    np.testing.assert_allclose(runs[1].q, runs[0].q, rtol=0, atol=1e-6)


@pytest.mark.slow
def test_a_four_bar_whose_drive_is_beside_the_normal_of_its_plane_turns_as_one_in_it() -> None:
    """The loop is closed by a hinge in space, whose rows lock a crank 1e-9 off if they are taken at their word."""
    first, second = (
        eomgen.build(scene("four_bar/scene", joints__drive__axis=[slant, -1.0, 0.0])).simulate(0.1, 1e-3)
        for slant in (0.0, 1e-9)
    )
    np.testing.assert_allclose(second.q, first.q, rtol=0, atol=1e-7)
