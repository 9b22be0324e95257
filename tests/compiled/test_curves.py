"""Compiled curves: the numbers of Python in every number type; as input, base motion and force; in the stand-alone
program."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.formula.curves import Curve
from eomgen.mechanics.derive import derive
from tests.codegen.hand_made import call, compile_system

POINTS = [[0, 0], [0.1, 0.02], [0.25, -0.01], [0.5, 0.03], [1, 0], [1.3, 0.01], [3, 0]]
EVEN = [[0.25 * k, 0.1 * (k * (12 - k) % 7)] for k in range(13)]
T = np.concatenate([np.linspace(-1, 4, 501), [x for x, _ in POINTS]])


def scene() -> eomgen.Scene:
    builder = eomgen.SceneBuilder("cart").body("cart", 1.0).joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0])
    builder.curve("shake", points=POINTS, outside="hold").curve("even", points=EVEN, outside="periodic")
    builder.curve("bent", points=POINTS, interpolation="linear", outside="error")
    builder.curve("spring", points=[[-1, -9], [0, 0], [1, 4]])
    builder.curve("hump", bump={"length": 0.5, "height": 0.1, "position": 1.0})
    builder.curve("road", road={"class": "C", "harmonics": 20})
    builder.input("table", points=POINTS, outside="hold").input(
        "pulse", points=[[0, 0], [1, 5], [1.2, 0]], interpolation="steps"
    )
    builder.input("square", wave={"shape": "square", "period": 0.3, "low": -1})
    builder.input("triangle", wave={"shape": "triangle", "period": 0.7, "start": 0.1, "duty": 0.2})
    builder.input("saw", wave={"shape": "sawtooth", "period": 0.7, "high": 2})
    builder.input("rate", "derivative.even(2 * t) + second_derivative.hump(t) + derivative.hump(t) + hump(t)")
    builder.input("wheel", "derivative.road(20 * t) - road(20 * t)")
    builder.base(["shake(t)", 0, "even(t)"], [([0, 0, 1], "shake(2 * t)")])
    builder.effort("spring", "rail", "-spring(0.3 * sin(q.rail)) + table + bent(abs(q.rail))")
    return builder.build()


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(scene(), profile="reproducible")


def curve(name: str) -> Curve:
    found = next(curve for curve in scene().curves if curve.name == name)
    assert isinstance(found, Curve)
    return found


def near(found: np.ndarray, expected: np.ndarray) -> bool:
    return bool(np.max(np.abs(found - expected)) <= 1e-15 * np.max(np.abs(expected)))


def test_inputs(model: eomgen.Model) -> None:
    u = dict(zip(model.inputs, model.input_values(T).T, strict=True))
    for name in ("table", "pulse", "square", "triangle", "saw"):
        assert near(u[name], curve(f"inputs.{name}")(T)), name
    along = (T - 1.0) / 0.5
    on = (along >= 0) & (along < 1)
    w = 4 * np.pi
    bump = [0.05 * (1 - np.cos(w * (T - 1))), 0.05 * w * np.sin(w * (T - 1)), 0.05 * w * w * np.cos(w * (T - 1))]
    expected = curve("even")(2 * T, 1) + sum(np.where(on, part, 0.0) for part in bump)
    assert np.max(np.abs(u["rate"] - expected)) <= 1e-13 * np.max(np.abs(expected))


def test_the_derivative_of_a_road(model: eomgen.Model) -> None:
    t, step = np.linspace(0, 2, 50), 1e-5
    place = model.inputs.index("wheel")
    road = scene().curves[[item.name for item in scene().curves].index("road")]
    heights = [sum(a * np.cos(w * 20 * at + p) for a, w, p in road.harmonics) for at in (t - step, t, t + step)]  # type: ignore[union-attr]
    expected = (heights[2] - heights[0]) / (40 * step) - heights[1]
    assert np.allclose(model.input_values(t)[:, place], expected, rtol=0, atol=1e-6)


@pytest.mark.slow
def test_base_motion(model: eomgen.Model) -> None:
    base, shake, even = model.base(T), curve("shake"), curve("even")
    angle = shake(2 * T)
    assert near(base[:, 4], shake(T)) and near(base[:, 6], even(T)) and near(base[:, 9], 2 * shake(2 * T, 1))
    assert near(base[:, 15], 4 * shake(2 * T, 2)) and near(base[:, 12], even(T, 1)) and near(base[:, 18], even(T, 2))
    assert np.allclose(base[:, 10], np.cos(angle) * shake(T, 1), rtol=0, atol=1e-14)


def test_forces_and_their_partials(model: eomgen.Model) -> None:
    q, v, a = np.array([[0.4], [1.2], [-2.0]]), np.zeros((3, 1)), np.zeros((3, 1))
    spring, bent = curve("spring"), curve("bent")
    stiffness = spring(0.3 * np.sin(q), 1) * 0.3 * np.cos(q) - bent(np.abs(q), 1) * np.sign(q)
    K, _, _ = model.partials(q, v, a, 0.2, base=np.eye(19)[0])
    assert np.allclose(K[:, :, 0], stiffness, rtol=1e-14, atol=0)


@pytest.mark.slow
@pytest.mark.parametrize("real", ["float", "complex", "lanes"])
def test_other_number_types(real: str, model: eomgen.Model, tmp_path: Path) -> None:
    library = compile_system(derive(scene(), ["mass"]), tmp_path, real=real)
    t = np.linspace(0.01, 2.9, 83)
    (values,) = call(library, "inputs", {"t": (t + 1e-30j if real == "complex" else t)[:, np.newaxis]})
    expected = model.input_values(t)
    if real == "float":
        smooth = [0, 4, 5]
        assert np.max(np.abs(values - expected)[:, smooth]) <= 1e-5 * np.max(np.abs(expected[:, smooth]))
        return
    assert np.max(np.abs(np.real(values) - expected)) <= 1e-14 * np.max(np.abs(expected))
    if real == "complex":
        assert near(np.imag(values)[:, 0] / 1e-30, curve("inputs.table")(t, 1))


@pytest.mark.slow
def test_a_run_beyond_the_points() -> None:
    builder = eomgen.SceneBuilder("cart").body("cart", 1.0).joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0])
    builder.curve("spring", points=[[-1, -9], [0, 0], [1, 4]]).input("push", points=[[0.5, 0], [1, 1], [1.5, 0]])
    model = eomgen.build(builder.effort("push", "rail", "push - spring(q.rail)").build())
    run = model.simulate(1.5, 1e-2, t_start=0.5)
    assert run.success
    late = (
        r"t_end: the points of inputs.push end at t = 1.5 s, the run ends at t = 1.501 s; "
        r'try: t_end = 1.5, or outside = "hold" or "periodic"'
    )
    with pytest.raises(eomgen.UsageError, match=late):
        model.simulate(1.501, 1e-2, t_start=0.5)
    early = (
        r"t_start: the points of inputs.push begin at t = 0.5 s, the run begins at t = 0 s; try: "
        r'outside = "hold" or "periodic", points from t = 0 s on, or in Python t_start = 0.5$'
    )
    with pytest.raises(eomgen.UsageError, match=early):
        model.simulate(1.0, 1e-2)
    assert model.simulate(2.0, 1e-2, inputs={"push": 0.1}).success
    thrown = model.simulate(2.0, 1e-2, inputs={"push": 0.0}, initial={"rail": {"velocity": 9.0}})
    assert not thrown.success and "a value became infinite or not a number" in thrown.message


@pytest.mark.slow
def test_a_driver_follows_a_table() -> None:
    """A slider that a constraint drives along a table: place, speed and acceleration are those of the spline."""
    builder = eomgen.SceneBuilder("slider").body("slider", 2.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("free", "free", "base", "slider").curve(
        "way", points=[[0.2 * k, 0.1 * (k * k % 5)] for k in range(9)]
    )
    frame = {"rotation": [{"axis": [0, 1, 0], "angle": "pi / 2"}]}
    builder.constraint(
        "rail", "prismatic", {"body": "base", **frame}, {"body": "slider", **frame}, drive="way(t) - way(0.3) + 0.2"
    )
    model = eomgen.build(builder.build())
    solution = model.simulate(1.2, 1e-3, t_start=0.3)
    way = Curve("way", np.array([0.2 * k for k in range(9)]), np.array([0.1 * (k * k % 5) for k in range(9)]))
    assert solution.success
    along = solution.q[:, 4:]
    place = int(np.argmax(np.ptp(along, axis=0)))
    assert np.allclose(along[:, place], way(solution.t) - way(0.3) + 0.2, rtol=0, atol=1e-9)
    assert np.allclose(solution.v[:, 3 + place], way(solution.t, 1), rtol=0, atol=1e-8)
    a = model.constrained_dynamics(solution.q[300], solution.v[300], solution.t[300])[0]
    assert a[3 + place] == pytest.approx(float(way(solution.t[300], 2)), rel=1e-9)
