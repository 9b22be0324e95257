"""The motorcycle against a linear model written by hand: lateral velocity, yaw, roll and steer, with lagged slips.

The model is the one of Sharp (J. Mech. Eng. Sci. 13, 1971, 316) with toroidal tyres and camber, derived here for this
motorcycle with its springs locked: x forward, y left, z up from the road, below the rear axle.
"""

from __future__ import annotations

import math
import runpy
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.contacts.tangential_laws import tangential_law
from eomgen.products.contacts.tyre_files import TyreFile, read_tyre_file
from tests.oracles.evaluation import Array

FOLDER = Path(__file__).parents[2] / "examples" / "motorcycle"
SCENE = FOLDER / "system" / "motorcycle.toml"
GRAVITY = 9.81
example: Any = SimpleNamespace(**runpy.run_path(str(FOLDER / "weave_and_wobble.py")))


def locked() -> dict[str, Any]:
    """Return the scene without the freedoms of rider, fork and swing arm."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    for name in ("lean", "fork", "rear_spring"):
        kept = ("parent", "child", "position")
        joint = data["joints"][name]
        data["joints"][name] = {"type": "fixed", **{key: joint[key] for key in kept if key in joint}}
    for contact in data["contacts"].values():
        contact["tangential"]["file"] = str(SCENE.with_name(contact["tangential"]["file"]))
    return data


def slopes(file: TyreFile, load: float) -> dict[str, float]:
    """Return lateral force and aligning moment by slip and by camber, and the relaxation length."""
    law = tangential_law("magic_formula", file.version)
    known = {"load": load, "slip_x": 0.0, "wheel_speed": 100.0, "velocity_x": 30.0}
    step, found = 1e-4, dict[str, float]()
    for name in ("slip_y", "camber"):
        moved = {"slip_y": 0.0, "camber": 0.0} | {name: np.array([-step, step])}
        for result, pair in law.values(["force_y", "moment_z"], file.numbers, **known, **moved).items():
            found[f"{result}_{name}"] = float(pair[1] - pair[0]) / (2.0 * step)
    rest = law.values(["relaxation_y"], file.numbers, load=load, camber=0.0)
    return found | {"relaxation": float(rest["relaxation_y"])}


def by_hand(speed: float, damper: float) -> Array:
    """Return the matrix (8, 8) of lateral velocity, yaw rate, roll rate, steer rate, roll, steer, and the slips of the
    front and the rear tyre."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    number = {name: item["value"] for name, item in data["parameters"].items()}
    rake, trail, base = number["rake"], number["trail"], number["wheelbase"]
    files = {end: read_tyre_file(SCENE.with_name(f"{end}_tyre.tir")) for end in ("front", "rear")}
    head = base + trail - 0.85 * math.tan(rake)
    origin = {"frame": (0.0, 0.0), "rider": (0.5, 0.78), "swing_arm": (0.5, 0.36), "head": (head, 0.85)}
    origin |= {"fork": origin["head"], "rear_wheel": (0.0, 0.31), "front_wheel": (base, 0.30)}
    rigid = []
    for name, (x, z) in origin.items():
        body = data["bodies"][name]
        own = body.get("center_of_mass", [0.0, 0.0, 0.0])
        xx, _, zz, _, xz, _ = [*body["inertia"], 0.0, 0.0, 0.0][:6]
        turned = name in ("head", "fork", "front_wheel")
        rigid.append((body["mass"], x + own[0], z + own[2], np.array([[xx, xz], [xz, zz]]), turned))
    weight = GRAVITY * sum(item[0] for item in rigid)
    load = {"front": GRAVITY * sum(m * x for m, x, *_ in rigid) / base}
    load["rear"] = weight - load["front"]
    sunk = {end: load[end] / files[end].numbers["VERTICAL_STIFFNESS"] for end in load}
    heave = {end: -depth for end, depth in sunk.items()}
    lower = 0.5 * (heave["front"] + heave["rear"])
    axis = np.array([-math.sin(rake), math.cos(rake)])  # of the steering, x and z
    foot = head + (0.85 + lower) * math.tan(rake)

    def arm(x: float, z: float) -> float:
        """Return the lateral displacement by the steering angle."""
        return float(axis[1] * (x - foot) - axis[0] * z)

    mass, rates, stiffness = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((2, 2))
    for m, x, high, inertia, turned in rigid:
        z = high + lower
        reach = arm(x, z) if turned else 0.0
        moves = np.array([1.0, x, -z, reach])
        turns = np.zeros((2, 4))
        turns[1, 1] = turns[0, 2] = 1.0
        turns[:, 3] = axis if turned else 0.0
        mass += m * np.outer(moves, moves) + turns.T @ inertia @ turns
        rates[:, 1] += m * speed * moves
        stiffness += m * GRAVITY * height(z, reach, rake)
    K, slip, ends = np.zeros((4, 2)), np.zeros((2, 8)), np.zeros((8, 8))
    for row, (end, place, radius, tube) in enumerate((("front", base, 0.30, 0.06), ("rear", 0.0, 0.31, 0.09))):
        front, tyre = end == "front", slopes(files[end], load[end])
        spin = data["bodies"][f"{end}_wheel"]["inertia"][1] * speed / radius
        turns = np.array([[0.0, 0.0, 1.0, axis[0] * front], [0.0, 1.0, 0.0, axis[1] * front]])
        rates += spin * turns.T @ np.array([[0.0, -1.0], [1.0, 0.0]]) @ turns
        camber = np.array([1.0, axis[0] * front])
        z = radius + heave[end]
        raised = height(z, arm(place, z) if front else 0.0, rake) + (radius - tube) * np.outer(camber, camber)
        stiffness -= load[end] * raised
        pushed = np.array([1.0, place, 0.0, arm(place, 0.0) if front else 0.0])
        moment = np.array([0.0, 1.0, 0.0, axis[1] * front])
        K += np.outer(tyre["force_y_camber"] * pushed + tyre["moment_z_camber"] * moment, camber)
        ends[:4, 6 + row] = tyre["force_y_slip_y"] * pushed + tyre["moment_z_slip_y"] * moment
        slip[row, :4] = pushed
        slip[row, 5], slip[row, 6 + row] = -speed * axis[1] * front, -speed
        slip[row] /= tyre["relaxation"]
    rates[3, 3] += damper
    K[2:] -= stiffness
    ends[:4, :4], ends[:4, 4:6] = -rates, K
    ends[:4] = np.linalg.solve(mass, ends[:4])
    ends[4, 2] = ends[5, 3] = 1.0
    ends[6:] = slip
    return ends


def height(z: float, reach: float, rake: float) -> Array:
    """Return the second partials by roll and steer of the height of a point of the front, or without reach of the
    rear."""
    return np.array([[-z, reach], [reach, -math.sin(rake) * reach]])


@pytest.mark.slow
@pytest.mark.parametrize(
    "speeds", [pytest.param((35.0,), id="one"), pytest.param((8.0, 20.0, 60.0), id="more", marks=pytest.mark.long)]
)
def test_eigenvalues_are_the_ones_of_the_model_by_hand(speeds: tuple[float, ...]) -> None:
    model = eomgen.build(eomgen.load(locked()), profile="quick")
    for speed in speeds:
        for damper in (0.0, 6.0):
            values = {"kick": 0.0, "damper": damper}
            steady = model.steady_motion({"x": speed}, {"y": 0.0}, parameters=values)
            found = model.linearize(at=steady, parameters=values).modes().eigenvalues
            expected = np.linalg.eigvals(by_hand(speed, damper))
            for root in expected[expected.imag >= 0.0]:
                allowed = 2e-3 if root.imag else 6e-3
                assert np.abs(found - root).min() < allowed * abs(root), (speed, damper, root)


@pytest.mark.slow
def test_a_slow_motorcycle_swings_and_falls_and_a_faster_one_capsizes() -> None:
    """At 5 m/s roll and steering swing ever more; at 7 m/s the swing decays, and a mode without oscillation grows."""
    model = eomgen.build(eomgen.load(locked()), profile="quick")
    for speed in (5.0, 7.0):
        for damper in (0.0, 6.0):
            values = {"kick": 0.0, "damper": damper}
            steady = model.steady_motion({"x": speed}, {"y": 0.0}, parameters=values)
            found = model.linearize(at=steady, parameters=values).modes().eigenvalues
            expected = np.linalg.eigvals(by_hand(speed, damper))
            slow = expected[(np.abs(expected) < 8.0) & (expected.imag >= 0.0)]
            [growing] = slow[slow.real > 0.0]
            assert (growing.imag > 1.0) == (speed == 5.0)
            for root in slow:
                assert np.abs(found - root).min() < 2e-2, (speed, damper, root)


@pytest.mark.slow
def test_a_small_kick_decays_by_the_eigenvalues() -> None:
    """After the kick the steering angle is a sum of the modes; wobble and weave alone are most of it."""
    model = eomgen.build(SCENE, profile="quick")
    steady = model.steady_motion({"x": 40.0}, {"y": 0.0}, parameters={"kick": 0.0})
    start = {"initial": {"q": steady.q, "v": steady.v, "z": steady.z}}
    run = model.simulate(1.6, parameters={"kick": 0.5}, **start)
    later = run.t > 0.6
    roots = model.linearize(at=steady, parameters={"kick": 0.0}).modes().eigenvalues
    roots = roots[(roots.real > -60.0) & (np.abs(roots) > 1e-3)]
    basis = np.exp(np.outer(run.t[later] - 0.6, roots))
    steer = run.outputs["steer"][later]
    columns = np.concatenate([basis.real, basis.imag[:, roots.imag > 0.0]], axis=1)
    left = steer - columns @ np.linalg.lstsq(columns, steer)[0]
    assert np.abs(left).max() < 1e-3 * np.abs(steer).max()
    assert np.abs(steer[-100:]).max() < 0.1 * np.abs(steer[:100]).max()


@pytest.mark.slow
def test_the_damper_makes_wobble_stable_and_weave_less_so() -> None:
    model = eomgen.build(SCENE, profile="quick")
    found = {damper: example.weave_and_wobble(model, damper, np.array([20.0, 40.0, 60.0])) for damper in (0.0, 6.0)}
    assert found[0.0]["wobble"][-1].real > 0.0 > found[6.0]["wobble"][-1].real
    assert found[0.0]["weave"][-1].real < found[6.0]["weave"][-1].real < 0.0
    assert 5.0 < found[6.0]["wobble"][1].imag / (2.0 * np.pi) < 10.0
    assert 2.0 < found[6.0]["weave"][1].imag / (2.0 * np.pi) < 4.0


@pytest.mark.slow
def test_each_panel_of_the_picture_names_its_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    roots = np.full(len(example.SPEEDS), -1.0 + 20.0j)
    monkeypatch.setitem(
        example.draw.__globals__, "weave_and_wobble", lambda *_: {"weave": roots, "wobble": 2.0 * roots}
    )
    example.draw(eomgen.build(SCENE, profile="quick"), tmp_path / "motorcycle.png")
    for axes, lines in zip(example.plt.gcf().axes, (4, 4, 2), strict=True):
        assert len(axes.get_legend().get_texts()) == lines
