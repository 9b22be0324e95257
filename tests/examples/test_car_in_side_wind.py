"""The car in a side wind: laws in C files against formulas, complex steps, and the car by hand in SciPy."""

from __future__ import annotations

import json
import re
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import BSpline

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from tests.oracles.evaluation import Array, tape_evaluator
from tests.oracles.states import jacobian

FOLDER = Path(__file__).parents[2] / "examples" / "car_in_side_wind" / "system"
SCENE = FOLDER / "car.toml"
RESULTS = ("drag", "side", "yaw", "down")


def table() -> Array:
    """Return the coefficients in ``air.c``: result, side-slip, opening of the wing."""
    text = (FOLDER / "air.c").read_text(encoding="utf-8").partition("= {")[2].partition("};")[0]
    return np.array(re.findall(r"-?\d+\.\d+", text), dtype=float).reshape(4, 9, 6)


TYRE = {
    "inner_x{n}": "{b} * {k} - 0.3 * ({b} * {k} - atan({b} * {k}))",
    "inner_y{n}": "0.8 * {b} * {a} - 0.3 * (0.8 * {b} * {a} - atan(0.8 * {b} * {a}))",
    "of_x{n}": "sin(1.6 * atan(inner_x{n}))",
    "of_y{n}": "sin(1.3 * atan(inner_y{n}))",
    "ellipse{n}": "sqrt(1 - 0.5 * of_y{n} * of_y{n} * of_x{n} * of_x{n})",
}


def by_formulas() -> dict[str, Any]:
    """Return the scene with both laws written as definitions."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    del data["laws"]
    extra = {}
    for n in ("front", "rear"):
        names = {"n": n, "b": "stiffness", "k": f"{n}_kappa", "a": f"{n}_alpha"}
        extra |= {key.format(**names): formula.format(**names) for key, formula in TYRE.items()}
        extra[f"{n}_x"] = f"mu * {n}_load * of_x{n} * ellipse{n}"
        extra[f"{n}_y"] = f"-mu * {n}_load * of_y{n} * ellipse{n}"
    places = {"beta": ("beta * (18 / pi) + 4", 9), "wing": ("2.5 * wing + 1.25", 6)}
    for name, (place, count) in places.items():
        extra[f"place_{name}"] = f"min(max({place}, 1), {count - 2})"
        for k in range(count):
            extra[f"s_{name}{k}"] = f"abs(place_{name} - {k})"
            near, far = f"max(1 - s_{name}{k}, 0)", f"max(2 - s_{name}{k}, 0)"
            extra[f"B_{name}{k}"] = f"({far}**3 - 4 * {near}**3) / 6"
    for result, rows in zip(RESULTS, table(), strict=True):
        for k, row in enumerate(rows):
            extra[f"row_{result}{k}"] = " + ".join(f"({c}) * B_wing{j}" for j, c in enumerate(row))
        extra[f"c_{result}"] = " + ".join(f"B_beta{k} * row_{result}{k}" for k in range(len(rows)))
    data["definitions"] |= extra
    return _without_air(data)


def _without_air(item: Any) -> Any:
    if isinstance(item, dict):
        return {key: _without_air(value) for key, value in item.items()}
    if isinstance(item, list):
        return [_without_air(value) for value in item]
    return re.sub(r"law\.air\.(\w+)\(beta, wing\)", r"c_\1", item) if isinstance(item, str) else item


def states(count: int = 30) -> dict[str, Array]:
    """Return states in which the car slides and brakes, the air comes from the side, and some wings are open."""
    rng = np.random.default_rng(36)
    speed = rng.uniform(15.0, 50.0, (count, 1))
    q = np.hstack([rng.uniform(-0.1, 0.1, (count, 1)), rng.uniform(0, 120, (count, 1)), rng.uniform(-2, 2, (count, 3))])
    wheels = speed / 0.32 * rng.uniform(0.85, 1.05, (count, 2))
    v = np.hstack([rng.uniform(-0.3, 0.3, (count, 1)), speed, rng.uniform(-2, 2, (count, 1)), wheels])
    z = np.hstack([rng.uniform(0.0, 1.0, (count, 1)), rng.uniform(-200, 1500, (count, 1))])
    return {"q": q, "v": v, "z": z, "t": rng.uniform(1.0, 2.0, (count, 1))}


def difference(first: Array, second: Array) -> float:
    return float(np.abs(first - second).max() / np.abs(second).max())


def evaluated(scene: Any) -> tuple[Any, Any]:
    """Return a system and its evaluation without compiled C."""
    system = derive(scene, ["forward_dynamics", "residual", "partials", "internal_rate"])
    return system, tape_evaluator(system)


@pytest.mark.long
def test_laws_in_c_are_the_formulas_and_their_complex_steps() -> None:
    """Complex steps through the formulas are independent of the partials in the files."""
    model = eomgen.build(SCENE)
    system, evaluate = evaluated(from_data(by_formulas()))
    state = states()
    q, v, z, t = (state[name] for name in ("q", "v", "z", "t"))
    u = 0.5 * (1.0 + np.tanh((t - 1.5) / 0.2))
    a = model.forward_dynamics(q, v, t[:, 0], z=z)
    given = {**state, "u": u, "a": a, "p": np.tile(model.parameter_array(), (len(q), 1))}
    for column, expected in zip(a.T, evaluate("forward_dynamics", given)["vdot"].T, strict=True):
        assert difference(column, expected) < 1e-13
    assert difference(evaluate("internal_rate", given)["zdot"], model.internal_rates(q, v, z, t[:, 0])) < 1e-13
    exact = evaluate("partials", given)
    for name, matrix, block in zip("KC", model.partials(q, v, a, t[:, 0], z=z), "qv", strict=False):
        assert difference(matrix, exact[name]) < 1e-13
        assert difference(matrix, jacobian(evaluate, system.factors, "residual", "r", given, block)) < 1e-10


def _slope(s: Array, b: float, c: float) -> Array:
    x = b * s
    return np.asarray(np.sin(c * np.arctan(x - 0.3 * (x - np.arctan(x)))))


def _tyre(kappa: float, alpha: float, load: float) -> tuple[float, float]:
    x, y = _slope(np.asarray(kappa), 12.0, 1.6), _slope(np.asarray(alpha), 9.6, 1.3)
    weight = np.sqrt(1.0 - 0.5 * (x * y) ** 2)
    return float(load * x * weight), float(-load * y * weight)


def _rates(t: float, y: Array, coefficients: Array, gust: float) -> Array:
    """Return the rates of yaw, place, angles of the wheels, their velocities, wing and shifted load, by hand."""
    (yaw, x, beside), (r, vx, vy), (front_w, rear_w), (wing, shift) = y[:3], y[5:8], y[8:10], y[10:]
    brake = 0.5 * (1.0 + np.tanh((t - 1.5) / 0.2))
    ahead, left = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    velocity = np.array([vx, vy])
    wind = velocity - [0.0, gust * np.exp(-(((x - 60.0) / 20.0) ** 2))]
    beta = np.arctan2(wind @ left, wind @ ahead)
    over = [np.arange(-2.0, count + 2.0) for count in (9, 6)]
    places = np.clip(beta * 18.0 / np.pi + 4.0, 1.0, 7.0), np.clip(2.5 * wing + 1.25, 1.0, 4.0)
    weights = [
        BSpline.design_matrix(np.array([place]), knots, 3).toarray()[0]
        for place, knots in zip(places, over, strict=True)
    ]
    drag, side, turn, down = coefficients @ weights[1] @ weights[0]
    pressure = 1.2 * (wind @ wind)
    loads = 11100.0 * np.array([1.4, 1.3]) / 2.7 + pressure * down * np.array([0.45, 0.55]) + [shift, -shift]
    steer = -0.006 * beside - 0.2 * yaw - 0.12 * r
    total, moment, pushed = pressure * (-drag * ahead - side * left), -pressure * 2.7 * turn, 0.0
    spins = []
    for arm, angle, w, load, torque in ((1.3, steer, front_w, loads[0], 1600.0), (-1.4, 0.0, rear_w, loads[1], 960.0)):
        forward = np.cos(angle) * ahead + np.sin(angle) * left
        sideways = np.cos(angle) * left - np.sin(angle) * ahead
        contact = velocity + r * arm * left
        rolling = np.sqrt((contact @ forward) ** 2 + 1.0)
        fx, fy = _tyre((0.32 * w - contact @ forward) / rolling, np.arctan2(contact @ sideways, rolling), load)
        force = fx * forward + fy * sideways
        total = total + force
        moment += arm * (force @ left)
        pushed += fx
        spins.append((-0.32 * fx - torque * brake * np.tanh(w)) / 2.0)
    inertia = 1500.0 + 2.0 * 1.2 + 40.0 * (1.3**2 + 1.4**2)
    # The axles' masses lie 1.3 m before and 1.4 m behind the car's centre of mass.
    offset = 40.0 * (1.3 - 1.4)
    matrix = np.array(
        [
            [inertia, *(offset * left)],
            [offset * left[0], 1130.0, 0.0],
            [offset * left[1], 0.0, 1130.0],
        ]
    )
    acceleration = np.linalg.solve(matrix, [moment, *(total + offset * r**2 * ahead)])
    lags = [(brake - wing) / 0.3, (pushed * 0.45 / 2.7 + shift) / -0.05]
    return np.array([*y[5:10], *acceleration, *spins, *lags])


@pytest.mark.long
def test_the_car_is_the_car_by_hand() -> None:
    run = eomgen.build(SCENE).simulate(settings={"rtol": 1e-12, "atol": 1e-12}, step=2.5e-4)
    start = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 50.0, 0.0, 156.25, 156.25, 0.0, 0.0]
    exact = solve_ivp(_rates, (0.0, 3.5), start, "Radau", [3.5], args=(table(), 20.0), rtol=1e-8, atol=1e-10)
    assert np.max(np.abs(run.q[-1, :3] - exact.y[:3, -1])) < 2e-5
    assert abs(run.v[-1, 1] - exact.y[6, -1]) < 2e-5


@pytest.mark.long
def test_its_c_stands_alone_and_gives_the_rows_of_the_run(tmp_path: Path) -> None:
    eomgen.generate(SCENE, tmp_path)
    command = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))["compile"]
    subprocess.run(f"{command} -Wall -Wextra -Wpedantic -Werror", shell=True, cwd=tmp_path, check=True)
    printed = subprocess.run(["./car_in_side_wind", "0.2"], cwd=tmp_path, check=True, capture_output=True, text=True)
    rows = np.array([line.split(",")[1:6] for line in printed.stdout.splitlines()[1:]], dtype=float)
    run = eomgen.build(SCENE, profile="reproducible").simulate(0.2)
    assert np.array_equal(rows, run.q)


@pytest.mark.slow
def test_a_gust_moves_the_car_out_of_its_lane() -> None:
    """First tier: still air leaves the car straight; in the gust it goes with the wind, and comes back."""
    model = eomgen.build(SCENE)
    still, blown = (model.simulate(step=4e-3, parameters={"gust": gust}) for gust in (0.0, 20.0))
    assert np.max(np.abs(still.outputs["offset"])) < 1e-12
    largest = int(np.argmax(blown.outputs["offset"]))
    assert 1.5 < blown.outputs["offset"][largest] < 2.0 and 2.3 < blown.t[largest] < 2.8
