"""The car that drives: its linear range against a single-track model by hand, the nonlinear one against a planar model
by hand in SciPy, and its manoeuvres."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.mechanics.derive import derive
from tests.examples.demos import EXAMPLES, demo_module
from tests.oracles.evaluation import Array, tape_evaluator

FOLDER = EXAMPLES / "driving_car" / "system"
G, MASS, FRONT, REAR, TRACK, HEIGHT, RADIUS, TYRE = 9.81, 1300.0, 1.2, 1.5, 1.5, 0.55, 0.31, 2e5
CORNER = 40.0  # kg, a wheel with its hub
NOMINAL = 4000.0
#: Moments of inertia of a wheel, about its axle and across, and of a hub.
AXLE, ACROSS, HUB = 0.9, 0.5, 0.3


def manoeuvre(name: str, speed: float = 80.0 / 3.6, **parameters: float) -> dict[str, Any]:
    """Return the data of a manoeuvre at a speed, with parameters of the car."""
    data = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    data["parameters"]["speed"] = {"value": speed, "unit": "m/s"}
    data["include"]["car"]["file"] = str(FOLDER / "car.toml")
    data["include"]["car"]["parameters"] |= parameters
    return data


def loads() -> Array:
    """Return the load of a tyre at rest in front and at the rear, N."""
    return G * (MASS / 2 * np.array([REAR, FRONT]) / (FRONT + REAR) + CORNER)


def cornering_stiffness(load: Array) -> Array:
    """Return the slope of the lateral force over the slip angle, N/rad, by the Magic Formula and car.tir."""
    return 20.0 * NOMINAL * np.sin(2.0 * np.arctan(load / (1.6 * NOMINAL)))


def yaw_response(speed: float, angular_frequencies: Array) -> Array:
    """Return yaw rate by angle of the front wheels of a single-track model that rolls about the ground.

    Unknowns are the lateral velocity at the ground, the yaw rate, the roll angle and the lagged slips of both axles.
    Weights stand below places where the springs of an axle and its tyres yield in series.
    """
    load = loads()
    stiffness, trail = 2.0 * cornering_stiffness(load), 0.1 * load * RADIUS / NOMINAL
    lag, sunk = cornering_stiffness(load) / 1.6e5, load / TYRE
    rolling, centre = RADIUS - sunk / 3.0, RADIUS - sunk
    mass = MASS + 4.0 * CORNER
    offset = 2.0 * CORNER * (FRONT - REAR) / mass  # of the centre of mass, from the body's
    arm = np.array([FRONT - offset, -REAR - offset])
    spin = 2.0 * AXLE * speed / rolling  # angular momentum of an axle
    yaw = 2100.0 + MASS * offset**2 + 2.0 * CORNER * (arm @ arm + TRACK**2 / 2.0) + 4.0 * (HUB + ACROSS)
    yaw += 2.0 * AXLE * (TRACK / 2.0) ** 2 * (1.0 / rolling**2).sum()  # inner wheels turn slower
    static = MASS * HEIGHT + 2.0 * CORNER * centre.sum()
    product = -MASS * HEIGHT * offset + 2.0 * CORNER * centre @ arm
    roll = 450.0 + MASS * HEIGHT**2 + 4.0 * (HUB + ACROSS) + 2.0 * CORNER * (centre @ centre)
    tilt = 2.0 * 0.8 * load  # force by camber
    found = []
    for s in 1j * np.asarray(angular_frequencies):
        springs = (np.array([24e3, 26e3]) + 2.0 * np.array([18e3, 6e3]) + 2200.0 * s) * TRACK**2 / 2.0
        tyres = (TYRE + CORNER * s**2) * TRACK**2 / 2.0
        leaning = springs / (springs + tyres)  # of an axle on its tyres, by the body's roll angle
        uneven = (AXLE * TRACK**2 / 6.0 * speed / rolling**3 * leaning).sum()  # loaded wheels have to turn faster
        support = (springs * tyres / (springs + tyres)).sum()
        matrix = [
            [mass * s, mass * speed, -static * s**2 + tilt.sum(), *stiffness],
            [0.0, yaw * s, -product * s**2 + spin.sum() * s + uneven * s + tilt @ arm, *(stiffness * (arm - trail))],
            [-static * s, -static * speed - product * s - spin.sum(), roll * s**2 + support - static * G, 0.0, 0.0],
            [-1.0, -arm[0], -sunk[0] * s, lag[0] * s + speed, 0.0],
            [-1.0, -arm[1], -sunk[1] * s, 0.0, lag[1] * s + speed],
        ]
        turned = [0.0, -2.0 * (HUB + ACROSS) * s**2, spin[0] * s, -speed, 0.0]
        found.append(np.linalg.solve(matrix, turned)[1])
    return np.array(found)


def magic_formula(kappa: Array, alpha: Array, load: Array) -> tuple[Array, Array, Array]:
    """Return longitudinal and lateral force and aligning moment by slip, tangent of the slip angle and load, of the
    tyre of car.tir: Pacejka (2012), 4.E9 to 4.E74 with the coefficients that are not zero."""
    angle, dfz = np.arctan(alpha), load / NOMINAL - 1.0

    def pure(slip: Array, slope: Array, shape: float, peak: Array, curvature: float) -> Array:
        inner = slope / (shape * peak) * slip
        return peak * np.sin(shape * np.arctan(inner - curvature * (inner - np.arctan(inner))))

    slope_x = 24.0 * load * np.exp(-0.2 * dfz)
    lateral_slope = -cornering_stiffness(load)
    lateral = pure(angle, lateral_slope, 1.4, (1.0 - 0.15 * dfz) * load, -0.6)
    force_x = pure(kappa, slope_x, 1.6, (1.1 - 0.1 * dfz) * load, 0.2)
    force_x *= np.cos(np.arctan(12.0 / np.sqrt(1.0 + (10.0 * kappa) ** 2) * angle))
    weight = np.cos(np.arctan(12.0 / np.sqrt(1.0 + (8.0 * angle) ** 2) * kappa))
    size = np.hypot(np.sin(angle), slope_x / lateral_slope * kappa * np.cos(angle))
    inner = 9.0 * np.arctan2(size, np.cos(angle))
    trail = 0.1 * load * RADIUS / NOMINAL * np.cos(1.1 * np.arctan(inner + 1.5 * (inner - np.arctan(inner))))
    return force_x, weight * lateral, -trail / np.sqrt(1.0 + alpha**2) * weight * lateral


def planar_rates(t: float, state: Array, steer: Callable[[float], float]) -> Array:
    """Return the rates of a car in the plane: velocities along and across, yaw rate, speeds of the wheels and
    deflections of their tyres, by the angle of the front wheels over time."""
    speed = 80.0 / 3.6
    ahead, across, yaw_rate = state[:3]
    wheels, bent = state[3:7], state[7:].reshape(2, 4)
    load = np.repeat(loads(), 2)
    sunk = load / TYRE
    rolling = RADIUS - sunk / 3.0
    mass = MASS + 4.0 * CORNER
    offset = 2.0 * CORNER * (FRONT - REAR) / mass
    x = np.array([FRONT, FRONT, -REAR, -REAR]) - offset
    y = TRACK / 2.0 * np.array([1.0, -1.0, 1.0, -1.0])
    turned = np.array([1.0, 1.0, 0.0, 0.0]) * steer(t)
    cosine, sine = np.cos(turned), np.sin(turned)
    vx, vy = ahead - yaw_rate * y, across + yaw_rate * x
    along, beside = cosine * vx + sine * vy, cosine * vy - sine * vx
    dfz, carcass = load / NOMINAL - 1.0, np.array([[3.5e5], [1.6e5]])
    lag = np.stack([24.0 * load * np.exp(-0.2 * dfz), cornering_stiffness(load)]) / carcass
    held = load * np.stack([1.1 - 0.1 * dfz, 1.0 - 0.15 * dfz]) / carcass
    square = ((bent / held) ** 2).sum(axis=0)
    bend = (1.0 + 3.0 * square**2) / (1.0 + square**2)
    gain = 1.0 / np.maximum(lag / bend, 1.5e-3 * along)
    excess = np.maximum(square - 1.0, 0.0) ** 2
    released = excess / (4.0 + excess) / 1.5e-3
    bent_rate = np.stack([wheels * rolling - along, beside]) - (along * gain + released) * bent
    kappa, alpha = (gain + released / along) * bent
    force_x, force_y, moment = magic_formula(kappa, alpha, load)
    pushed, moved = cosine * force_x - sine * force_y, sine * force_x + cosine * force_y
    inertia = 2100.0 + MASS * offset**2 + CORNER * (x @ x + y @ y) + 4.0 * (HUB + ACROSS)
    driven = np.array([1.0, 1.0, 0.0, 0.0]) * 2000.0 * (speed - ahead)
    return np.concatenate(
        [
            [pushed.sum() / mass + yaw_rate * across, moved.sum() / mass - yaw_rate * ahead],
            [(x @ moved - y @ pushed + moment.sum()) / inertia],
            (driven - (RADIUS - sunk) * force_x) / AXLE,
            *bent_rate,
        ]
    )


def test_figures_of_a_step_by_a_closed_form() -> None:
    """A damped oscillation has its peak after half a period, above the steady value by exp(-pi decay / rate)."""
    t = np.linspace(0.0, 20.0, 20001)
    wheel, since, decay, rate = np.clip(t / 0.2, 0.0, 1.0), np.maximum(t - 0.1, 0.0), 1.0, 3.0
    values = 2.0 - 2.0 * np.exp(-decay * since) * (np.cos(rate * since) + decay / rate * np.sin(rate * since))
    found = demo_module("driving_car").step_response(t, wheel, values)
    assert found["steady"] == pytest.approx(2.0, abs=1e-6)
    assert found["peak"] == pytest.approx(np.pi / rate, abs=1e-3)
    assert found["overshoot"] == pytest.approx(np.exp(-np.pi * decay / rate), rel=1e-5)
    assert np.interp(0.1 + found["response"], t, values) == pytest.approx(1.8, rel=1e-6)


def test_lanes_are_the_ones_of_the_standard(monkeypatch: pytest.MonkeyPatch) -> None:
    """ISO 3888-1:2018 for a car 1.4 m wide, from limits that others printed."""
    demo = demo_module("driving_car")
    monkeypatch.setattr(demo, "WIDTH", 1.4)
    expected = [(0.0, 15.0, -0.895, 0.895), (45.0, 70.0, 2.605, 4.535), (95.0, 125.0, -0.895, 1.175)]
    np.testing.assert_allclose(demo.lanes(), expected, atol=1e-12)


@pytest.mark.long
def test_the_sine_with_dwell_by_the_criteria_of_the_regulation(capsys: pytest.CaptureFixture[str]) -> None:
    demo = demo_module("driving_car")
    demo.sine_with_dwell(demo.built("sine_with_dwell", "car.toml"))
    rows = {row.split()[0]: row.split() for row in capsys.readouterr().out.splitlines()[1:]}
    for angle, ratio, displacement in (("100", 0.0, 2.93), ("150", 65.8, 3.41)):
        assert float(rows[angle][2]) == pytest.approx(ratio, abs=0.2)
        assert float(rows[angle][6]) == pytest.approx(displacement, abs=0.01)


@pytest.mark.long
def test_both_cars_shake_the_driver_on_a_rough_road() -> None:
    demo = demo_module("driving_car")
    for car, weighted in (("car.toml", 0.85), ("full_car.toml", 0.65)):
        run = demo.built("rough_road", car).simulate(30.0)
        assert run.success and run["loads"].min() > 0.0
        assert run.rms("seat[2]", weighting="Wk", start=5.0) == pytest.approx(weighted, rel=0.1)
        # the front wheels meet a bump a wheelbase before the rear wheels
        front, rear = (run["loads"][5000:, wheel] - run["loads"][5000:, wheel].mean() for wheel in (0, 2))
        rows = round(2.7 / run["ground_speed"].mean() / (run.t[1] - run.t[0]))
        assert np.corrcoef(front[:-rows], rear[rows:])[0, 1] > 0.5 > abs(np.corrcoef(front, rear)[0, 1])


@pytest.mark.slow
def test_the_car_stands_and_rolls_in_balance_at_the_start() -> None:
    """First tier: springs carry the body, tyres the car, and wheels roll at the speed of the road."""
    system = derive(eomgen.load(FOLDER / "step_steer.toml"), ["forward_dynamics", "internal_rate"])
    state = {
        name: np.array([values], dtype=float)
        for name, values in (
            ("q", system.initial_q),
            ("v", system.initial_v),
            ("z", [item.value for item in system.states]),
            ("t", [0.0]),
            ("u", [0.0]),
            ("p", [item.value for item in system.parameters]),
        )
    }
    evaluate = tape_evaluator(system)
    assert np.abs(evaluate("forward_dynamics", state)["vdot"]).max() < 1e-9
    assert np.abs(evaluate("internal_rate", state)["zdot"]).max() < 1e-9


@pytest.mark.long
@pytest.mark.parametrize("speed", [10.0, 20.0, 30.0, 40.0])
def test_the_linear_range_is_a_single_track_model(speed: float) -> None:
    model = eomgen.build(manoeuvre("step_steer", speed=speed))
    frequencies = 2.0 * np.pi * np.array([1e-3, 0.1, 0.3, 0.5, 1.0, 1.5, 2.0, 3.0])
    linear = model.linearize(at="initial")
    yaw, steer = (linear.frequency_response(frequencies, "hand", name) for name in ("yaw_rate", "steer"))
    ratio = yaw / steer / yaw_response(speed, frequencies)
    assert abs(ratio[0] - 1.0) < 2e-4
    assert np.abs(ratio - 1.0).max() < 3e-3


@pytest.mark.long
def test_a_flat_car_is_a_planar_model_in_scipy() -> None:
    """The centre of mass of body and wheels is on the ground, so no load moves and the body does not roll."""
    low = -4.0 * CORNER * (RADIUS - loads().mean() / TYRE) / MASS
    data = manoeuvre("step_steer", height=low)
    run = eomgen.build(data).simulate(3.0, parameters={"angle": np.radians(90.0)})
    assert run["lateral_acceleration"].max() > 7.0
    rolling = RADIUS - np.repeat(loads(), 2) / TYRE / 3.0
    start = np.concatenate([[80.0 / 3.6, 0.0, 0.0], 80.0 / 3.6 / rolling, np.zeros(8)])

    def steer(t: float) -> float:
        return float(np.interp(t, run.t, run["steer"].ravel()))

    rows = run.t[::100]
    exact = solve_ivp(planar_rates, (0.0, 3.0), start, "Radau", rows, args=(steer,), rtol=1e-8, atol=1e-9)
    yaw_rate = run["yaw_rate"].ravel()[::100]
    assert np.abs(exact.y[2] - yaw_rate).max() < 2e-3 * yaw_rate.max()


@pytest.mark.slow
def test_a_manoeuvre_at_another_speed() -> None:
    """At 90 km/h the lane change starts at 25 m/s, and a corner of the body touches a cone."""
    demo = demo_module("driving_car")
    run = demo.built("lane_change", "car.toml", 90.0).simulate(6.5)
    assert run["ground_speed"][0] == pytest.approx(25.0, rel=1e-9)
    assert demo.clearance(run) == pytest.approx(-0.10, abs=0.01)


@pytest.mark.long
def test_the_car_by_hard_points_takes_the_place_of_the_small_one() -> None:
    demo = demo_module("driving_car")
    run = demo.built("step_steer", "full_car.toml").simulate(3.0)
    assert run.success and run["ground_speed"][-1] == pytest.approx(80.0 / 3.6, rel=1e-2)
    found = demo.step_response(run.t, run.inputs["hand"].ravel(), run["yaw_rate"].ravel())
    assert np.degrees(found["steady"]) == pytest.approx(8.77, rel=0.02)
    assert found["response"] == pytest.approx(0.172, abs=5e-3)
    # in steady motion the lateral acceleration is speed times yaw rate
    assert run["lateral_acceleration"][-1] == pytest.approx(found["steady"] * run["ground_speed"][-1], rel=5e-3)


@pytest.mark.slow
def test_braking_on_split_friction() -> None:
    """Wheels start at the car's speed; a car that turns around more than once is steered without jumps."""
    demo = demo_module("driving_car")
    model = demo.built("split_braking", "car.toml")
    run = model.simulate()
    np.testing.assert_allclose(run["rolling"][0], 80.0 / 3.6, rtol=3e-3)
    assert run["place"][-1, 0] - np.interp(0.5, run.t, run["place"][:, 0]) == pytest.approx(50.4, abs=0.2)
    locked = model.simulate(parameters={"control": 0.0})
    assert np.ptp(np.unwrap(locked["heading"].ravel())) > 2.0 * np.pi
    assert "between the steps" not in locked.message


def test_manoeuvres_by_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    demo, driven = demo_module("driving_car"), []
    monkeypatch.setattr(demo, "built", lambda name, *_: driven.append(name))
    monkeypatch.setattr(demo, "MANOEUVRES", dict.fromkeys(demo.MANOEUVRES, lambda _: demo.plt.figure()))
    for words, expected in ([], [*demo.MANOEUVRES]), (["lane_change"], ["lane_change"]):
        driven.clear()
        monkeypatch.setattr("sys.argv", ["demo.py", *words, "--out", str(tmp_path)])
        demo.main()
        assert driven == expected
    monkeypatch.setattr("sys.argv", ["demo.py", "step_stear"])
    with pytest.raises(SystemExit):
        demo.main()
    assert "invalid choice: 'step_stear'" in capsys.readouterr().err
