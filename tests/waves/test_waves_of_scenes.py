"""Waves of scenes: what formulas get of them, their derivatives in time and along the motion, and what is refused."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.compiled.arguments import Requirements
from eomgen.errors import DescriptionError, UsageError
from eomgen.formula.evaluate import evaluate_batch
from eomgen.formula.nodes import EntryQuantity, Formula, Symbol
from eomgen.formula.prescribed_motion import smooth
from eomgen.formula.recording import record
from eomgen.mechanics.describe import describe
from eomgen.products.waves.formula.fields import WaveField
from eomgen.products.waves.info import described_hulls, described_waves, print_waves
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import EVERYTHING, SceneNames
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.symbolic.calculus.jets import jets, time_derivatives
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import ONE, Tape
from eomgen.waves import Jonswap, divided

GRAVITY = 9.81
SEA: dict[str, Any] = {
    "spectrum": {"type": "jonswap", "height": 3, "period": 9},
    "seed": 1,
    "components": 7,
    "depth": "30 m",
    "level": 0.5,
    "spreading": {"exponent": 10, "directions": 2},
    "heading": "20 deg",
}
#: Of a body on the free joint: one of each quantity at places that move.
FORMULAS = [
    "elevation.sea(q.free[4], q.free[5])",
    "slope.sea(q.free[4], q.free[5])[0]",
    "slope.sea(q.free[4], q.free[5])[1]",
    *(f"water_velocity.sea(q.free[4], q.free[5], q.free[6])[{k}]" for k in range(3)),
    *(f"water_acceleration.sea(q.free[4], q.free[5], q.free[6])[{k}]" for k in range(3)),
]


def _data(sea: dict[str, Any] = SEA, **sections: Any) -> dict[str, Any]:
    return {
        "format": 1,
        "name": "afloat",
        "waves": {"sea": sea},
        "bodies": {"float": {"mass": 1000, "inertia": {"xx": 100, "yy": 100, "zz": 100}}},
        "joints": {"free": {"type": "free", "parent": "base", "child": "float"}},
        "points": {"middle": {"body": "float"}},
        "outputs": {"eta": {"formula": "elevation.sea(position.middle[0], position.middle[1])"}},
    } | sections


def _scene(sea: dict[str, Any] = SEA, **sections: Any) -> Scene:
    return from_data(_data(sea, **sections))


def _sea(**changes: Any) -> WaveField:
    return _waves(_scene(SEA | changes))


def _waves(scene: Scene) -> WaveField:
    """Return the waves in the first output of a scene."""
    quantity = scene.outputs[0].values[0]
    assert isinstance(quantity, EntryQuantity) and isinstance(quantity.item, WaveField)
    return quantity.item


def _recorded(formula: Formula) -> tuple[Tape, Scalar]:
    """Return a formula of t, and of q by index, on a tape of its own."""
    tape = Tape()

    def value(symbol: Symbol) -> Scalar:
        return Scalar(tape, tape.input("t") if symbol.kind == "time" else tape.input("q", symbol.index))

    return tape, record(Algebra(tape), formula, value)


def _formula(text: str, sea: WaveField) -> Formula:
    return read_formula(text, SceneNames(entries={"waves": {"sea": sea}}, joints={"free": "free"}), EVERYTHING)


def _by_potential(sea: WaveField, place: Array, t: float, *orders: tuple[int, ...]) -> list[float]:
    """Return derivatives by x, y, z and t of Airy's potential, whose terms are A g/w cosh k(z + h)/cosh kh sin th."""

    def phi(x: Any, y: Any, z: Any, time: Any) -> Any:
        total = mpmath.mpf(0)
        for kx, ky, w, A, phase, _ in sea.components:
            k = mpmath.hypot(kx, ky)
            share = mpmath.cosh(k * (z + sea.depth)) / mpmath.cosh(k * sea.depth)
            total += A * GRAVITY / w * share * mpmath.sin(kx * x + ky * y - w * time + phase)
        return total

    with mpmath.workdps(40):
        return [float(mpmath.diff(phi, (*map(mpmath.mpf, place), mpmath.mpf(t)), order)) for order in orders]


@pytest.mark.parametrize("depth", [8.0, 300.0])
def test_quantities_are_derivatives_of_the_potential(depth: float) -> None:
    """Velocities are its gradient, the elevation -phi_t/g at z = 0, and the slope the gradient of that."""
    sea = _sea(depth=depth, stretching="none", level=0)
    x, y, z, t = 3.0, -2.0, -1.7, 4.0
    gradient = _by_potential(sea, np.array([x, y, z]), t, (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0))
    rates = _by_potential(sea, np.array([x, y, z]), t, (1, 0, 0, 1), (0, 1, 0, 1), (0, 0, 1, 1))
    above = _by_potential(sea, np.array([x, y, 0.0]), t, (0, 0, 0, 1), (1, 0, 0, 1), (0, 1, 0, 1))
    of_surface = [-value / GRAVITY for value in above]
    found = [
        *(sea.value("water_velocity", k, x, y, z, t) for k in range(3)),
        *(sea.value("water_acceleration", k, x, y, z, t) for k in range(3)),
        sea.value("elevation", 0, x, y, t),
        *(sea.value("slope", k, x, y, t) for k in range(2)),
    ]
    np.testing.assert_allclose(found, [*gradient, *rates, *of_surface], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "changes", [{}, {"ramp": 20}, {"stretching": "none"}, {"order": 2}, {"spreading": None, "heading": 0}]
)
@pytest.mark.parametrize("text", ["elevation.sea(3.7, -2.1)", "slope.sea(3.7, -2.1)[0]", "slope.sea(3, -2)[1]"])
def test_waves_at_places_by_numbers_are_harmonics(text: str, changes: dict[str, Any]) -> None:
    """With the values of the loops over waves at the same places."""
    formula = _formula(text, _sea(**changes))
    tape, recorded = _recorded(formula)
    assert not recorded.is_zero or not changes.get("heading", 1)
    t = np.array([-1.0, 0.0, 3.0, 12.0, 20.0, 31.0])
    found = evaluate(tape, [recorded.ref], {"t": t[:, None]})[:, 0]
    values = evaluate_batch(formula, lambda symbol: t)
    np.testing.assert_allclose(found, np.broadcast_to(values, (6,)), rtol=0, atol=1e-13)


@pytest.mark.parametrize("text", FORMULAS)
def test_rates_along_a_motion_are_exact(text: str) -> None:
    """To second order along x(t), y(t), z(t), by jets through the loops; against complex steps of the values, and of
    the rates."""
    tape, recorded = _recorded(_formula(text, _sea(ramp=20)))
    assert sum(op is Op.MAP for op in tape.op), "waves are loops"
    rng = np.random.default_rng(2)
    path = rng.uniform(-1.0, 1.0, (7, 3))  # q(t) = c0 + c1 t + c2 t^2
    motion: dict[Any, list[Any]] = {
        InputSymbol("q", k): [tape.input("q", k), tape.constant(path[k, 1]), tape.constant(path[k, 2])]
        for k in range(7)
    }
    (jet,) = jets(tape, [recorded.ref], motion | {InputSymbol("t", 0): [tape.input("t"), ONE]}, 2)
    rates = time_derivatives(tape, jet)
    start, step = 7.0, 1e-30

    def along(ref: int, s: complex, order: int) -> complex:
        """Return a value, or a rate, at t = start + s; q and its rates are those of the path there."""
        q = path @ np.array([1.0, s, s * s])
        if order == 0:
            return complex(evaluate(tape, [ref], {"q": q, "t": np.array([start + s])})[0])
        moved = dict(motion)
        for k in range(7):
            moved[InputSymbol("q", k)] = [tape.input("q", k), tape.input("qd", k)]
        (first,) = jets(tape, [ref], moved | {InputSymbol("t", 0): [tape.input("t"), ONE]}, 1)
        rate = path @ np.array([0.0, 1.0, 2.0 * s])
        return complex(evaluate(tape, first[1:], {"q": q, "qd": rate, "t": np.array([start + s])})[0])

    found = evaluate(tape, rates, {"q": path[:, 0], "t": start})
    expected = [along(recorded.ref, 1j * step, order).imag / step for order in (0, 1)]
    np.testing.assert_allclose(found[1:], expected, rtol=1e-12, atol=1e-14)


def test_stretching_gives_a_crest_the_motion_of_the_water_at_rest() -> None:
    wave = {"regular": [{"amplitude": 2, "period": 9}], "level": 0.5}
    stretched, plain = (_waves(_scene(wave | {"stretching": word})) for word in ("wheeler", "none"))
    w = 2.0 * math.pi / 9.0
    assert stretched.value("water_velocity", 0, 0, 0, 2.5, 0.0) == pytest.approx(2.0 * w, rel=1e-14)
    assert plain.value("water_velocity", 0, 0, 0, 2.5, 0.0) == pytest.approx(2.0 * w * math.exp(2.0 * w**2 / GRAVITY))
    shallow = _sea(depth=5, spectrum={"type": "jonswap", "height": 1, "period": 9})
    bottom = shallow.value("water_velocity", 2, 1.0, 2.0, shallow.level - 5.0, 3.0)
    assert bottom == pytest.approx(0.0, abs=1e-15), "the bottom stays where it is"


@pytest.mark.parametrize("stretching", ["wheeler", "none"])
def test_motion_ends_at_the_surface_and_at_the_bottom(stretching: str) -> None:
    """High in the air and deep in the ground it is that at the edge: of very short waves, too, whose exponentials have
    no numbers there."""
    ripple = [{"amplitude": 1, "period": 8}, {"amplitude": 1e-4, "period": 0.1}]
    deep: dict[str, Any] = {"regular": ripple, "stretching": stretching}
    for sea in (_sea(stretching=stretching), _waves(_scene(deep)), _waves(_scene(deep | {"depth": 40}))):
        t = np.linspace(0.0, 8.0, 9)
        eta = sea.value("elevation", 0, 1.0, 2.0, t)
        top = np.maximum(eta, 0.0) if stretching == "none" else eta
        assert eta.min() < 0.0 < eta.max()
        for name in ("water_velocity", "water_acceleration"):
            for k in range(3):
                above = [sea.value(name, k, 1.0, 2.0, sea.level + top + more, t) for more in (0.0, 1.0, 1e6)]
                np.testing.assert_array_equal(above[1], above[2])
                np.testing.assert_allclose(above[0], above[1], rtol=0, atol=1e-12)
                if math.isfinite(sea.depth):
                    below = [sea.value(name, k, 1.0, 2.0, sea.level - sea.depth - more, t) for more in (0.0, 1e6)]
                    np.testing.assert_array_equal(below[0], below[1])
                    assert np.isfinite(below).all()
        assert not smooth(_formula("water_velocity.sea(1, 2, q.free[6])[0]", sea))


def test_a_ramp_is_three_times_differentiable_and_its_rate_is_in_the_acceleration() -> None:
    sea = _sea(ramp=20)
    full = _sea()
    assert sea.value("elevation", 0, 1.0, 2.0, 0.0) == 0.0
    assert sea.value("elevation", 0, 1.0, 2.0, 21.0) == full.value("elevation", 0, 1.0, 2.0, 21.0)
    formula = _formula("elevation.sea(1, 2)", sea)
    assert smooth(formula)
    tape, recorded = _recorded(formula)
    (jet,) = jets(tape, [recorded.ref], {InputSymbol("t", 0): [tape.input("t"), ONE]}, 3)
    for edge in (0.0, 20.0):
        before, after = (evaluate(tape, jet, {"t": edge + side}) for side in (-1e-9, 1e-9))
        np.testing.assert_allclose(before, after, rtol=0, atol=1e-7)
    grown = _sea(ramp=20, stretching="none")
    ahead, behind = (grown.value("water_velocity", 0, 1.0, 2.0, -3.0, 9.0 + s) for s in (1e-5, -1e-5))
    assert grown.value("water_acceleration", 0, 1.0, 2.0, -3.0, 9.0) == pytest.approx((ahead - behind) / 2e-5, abs=1e-9)


#: Three free waves, by their size.
def _three(size: float, depth: float | None, **more: Any) -> dict[str, Any]:
    waves = [
        {"amplitude": 1.0 * size, "period": 9, "heading": "10 deg"},
        {"amplitude": 0.7 * size, "period": 7, "heading": "-40 deg", "phase": 1},
        {"amplitude": 0.5 * size, "period": 6, "heading": "200 deg", "phase": 2},
    ]
    return {"regular": waves, "stretching": "none", "order": 2, **({} if depth is None else {"depth": depth}), **more}


def _left_at_the_surface(sea: WaveField) -> tuple[float, float]:
    """Return what is left of the full conditions at the surface, kinematic and, but for a constant, dynamic."""
    x, y, t = np.random.default_rng(1).uniform(-100.0, 100.0, (3, 400))
    kx, ky, w, A, phase, potential = np.array(sea.components).T[:, :, None]
    angle, k = kx * x + ky * y - w * t + phase, np.hypot(kx, ky)
    z = sea.value("elevation", 0, x, y, t)
    np.testing.assert_allclose(z, np.sum(A * np.cos(angle), axis=0), rtol=0, atol=1e-12)
    depth = sea.depth
    profile = np.exp(k * z) if math.isinf(depth) else np.cosh(k * (z + depth)) / np.cosh(k * depth)
    u, v, up = (sea.value("water_velocity", n, x, y, z, t) for n in range(3))
    rising = np.sum(w * A * np.sin(angle), axis=0)
    kinematic = rising + u * sea.value("slope", 0, x, y, t) + v * sea.value("slope", 1, x, y, t) - up
    pressure = np.sum(-w * potential * profile * np.cos(angle), axis=0) + GRAVITY * z + 0.5 * (u * u + v * v + up * up)
    return float(np.abs(kinematic).max()), float(np.ptp(pressure))


@pytest.mark.parametrize("depth", [None, 15.0])
def test_second_order_leaves_third_order_at_the_surface(depth: float | None) -> None:
    for order, sizes in ((2, (0.04, 0.02, 0.01)), (1, (0.02, 0.01))):
        left = [_left_at_the_surface(_waves(_scene(_three(size, depth, order=order)))) for size in sizes]
        for larger, smaller in itertools.pairwise(left):
            np.testing.assert_allclose(np.log2(np.array(larger) / smaller), order + 1.0, rtol=0, atol=0.1)


def test_one_wave_is_that_of_stokes() -> None:
    """k A^2 (3 - t^2)/(4 t^3) at twice the phase, t = tanh kh; in deep water it has no potential."""
    for depth in (None, 12.0):
        wave = {"amplitude": 0.4, "period": 8, "phase": 0.3}
        sea = {"regular": [wave], "order": 2} | ({} if depth is None else {"depth": depth})
        free, bound = _waves(_scene(sea)).components
        k = math.hypot(free.kx, free.ky)
        t = 1.0 if depth is None else math.tanh(k * depth)
        assert bound[:3] == pytest.approx((2.0 * free.kx, 2.0 * free.ky, 2.0 * free.frequency))
        assert bound.amplitude == pytest.approx(k * 0.16 * (3.0 - t**2) / (4.0 * t**3), rel=1e-12)
        assert bound.phase == pytest.approx(0.6)
        expected = 0.0
        if depth is not None:
            expected = 0.375 * 0.16 * free.frequency * math.cosh(2.0 * k * depth) / math.sinh(k * depth) ** 4
        assert bound.potential == pytest.approx(expected, rel=1e-10, abs=1e-13)


def test_a_sea_has_the_height_that_is_asked_for() -> None:
    for spectrum, height in (
        ({"type": "jonswap", "height": 3, "period": 9}, 3.0),
        ({"type": "pierson_moskowitz", "wind": 12, "height": 2}, 2.0),
        ({"type": "points", "points": [[0.4, 0.0], [0.7, 1.0], [1.5, 0.0]], "height": "150 cm"}, 1.5),
    ):
        sea = _sea(spectrum=spectrum, amplitudes="fixed", spreading=None)
        amplitudes = np.array([component.amplitude for component in sea.components])
        assert 4.0 * math.sqrt(0.5 * np.sum(amplitudes**2)) == pytest.approx(height, rel=1e-12)
    assert _sea(seed=1) == _sea(seed=1)
    assert _sea(seed=1) != _sea(seed=2)


def test_a_fully_developed_sea_has_the_height_of_the_gravity() -> None:
    """0.2092 U^2/g, but for what is beyond the band."""
    sea = {"spectrum": {"type": "pierson_moskowitz", "wind": 12}, "amplitudes": "fixed", "band": [0.5, 6]}
    for gravity in (GRAVITY, 1.62):
        waves = _waves(_scene(sea, gravity=[0, 0, -gravity]))
        height = 4.0 * math.sqrt(0.5 * sum(wave.amplitude**2 for wave in waves.components))
        assert height == pytest.approx(0.2092 * 12.0**2 / gravity, rel=2e-3)


@pytest.mark.slow
def test_a_run_takes_waves_as_the_formulas_say() -> None:
    """Forces and outputs; the acceleration of a body in water that carries it is that of the water."""
    carried = [f"1000 * water_acceleration.sea(position.middle[0], position.middle[1], -2)[{k}]" for k in range(3)]
    scene = _data(
        SEA | {"ramp": 2},
        gravity=[0, 0, -GRAVITY],
        points={"middle": {"body": "float"}},
        forces={"water": {"body": "float", "force": [*carried[:2], f"{carried[2]} + 1000 * {GRAVITY}"]}},
        outputs={
            "eta": {"formula": "elevation.sea(position.middle[0], position.middle[1])"},
            "u": {"formula": "water_velocity.sea(position.middle[0], position.middle[1], -2)[0]"},
            "pushed": {"acceleration": "middle"},
            "place": {"position": "middle"},
        },
        simulation={"duration": 1.5, "step": 0.05},
    )
    model = eomgen.build(from_data(scene))
    run = model.simulate()
    sea, t = _sea(ramp=2), run.t
    forces = model.inverse_dynamics(run.q, run.v, 0.0 * run.v, t)  # in lanes
    alone = [model.inverse_dynamics(q, v, 0.0 * v, now) for q, v, now in zip(run.q[:5], run.v[:5], t[:5], strict=True)]
    np.testing.assert_allclose(forces[:5], alone, rtol=0, atol=1e-12 * np.abs(forces).max())
    x, y, _ = run.outputs["place"].T
    np.testing.assert_allclose(run.outputs["eta"], sea.value("elevation", 0, x, y, t), rtol=0, atol=1e-13)
    np.testing.assert_allclose(run.outputs["u"], sea.value("water_velocity", 0, x, y, -2.0, t), rtol=0, atol=1e-13)
    water = np.stack([sea.value("water_acceleration", k, x, y, -2.0, t) for k in range(3)], axis=1)
    np.testing.assert_allclose(run.outputs["pushed"], water, rtol=0, atol=1e-12)


_CROSS = {"axis": [1, 0, 0], "second_axis": [0, 1, 0]}


def _pendulum_on(base: dict[str, Any]) -> dict[str, Any]:
    pendulum = {"mass": 2.0, "center_of_mass": [0, 0, -1.5], "inertia": {"xx": 0.1, "yy": 0.2, "zz": 0.3}}
    return {
        "format": 1,
        "name": "on_a_launch",
        "waves": {"sea": SEA | {"ramp": 3}},
        "base": base,
        "bodies": {"bob": pendulum},
        "joints": {"ball": {"type": "universal", "parent": "base", "child": "bob", **_CROSS}},
        "points": {"deck": {"body": "base"}, "bow": {"body": "base", "position": [1, 0, 0]}}
        | {"mast": {"body": "base", "position": [0, 0, 1]}},
        "outputs": {name: {"position": name} for name in ("deck", "bow", "mast")},
        "simulation": {"step": 0.01, "duration": 4.0, "method": "rk4"},
    }


@pytest.mark.slow
def test_a_base_that_follows_waves_has_their_height_and_tilt() -> None:
    sea = _waves(from_data(_data(SEA | {"ramp": 3})))
    turn = {"axis": [0, 0, 1], "angle": "0.3 + 0.1 * t"}
    follow = {"waves": "sea"}
    base = {"follow": follow, "position": ["2 * t", "1 + 0.2 * t**2", 0.4], "rotation": [turn]}
    run = eomgen.build(from_data(_pendulum_on(base))).simulate()
    x, y, t = 2.0 * run.t, 1.0 + 0.2 * run.t**2, run.t
    deck, bow, mast = (run.outputs[name] for name in ("deck", "bow", "mast"))
    height = sea.value("elevation", 0, x, y, t) + 0.5 + 0.4
    np.testing.assert_allclose(deck, np.column_stack((x, y, height)), rtol=0, atol=1e-12)
    slope = [sea.value("slope", k, x, y, t) for k in range(2)]
    normal = np.column_stack((-slope[0], -slope[1], np.ones_like(t)))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    assert np.abs(slope).max() > 0.05
    np.testing.assert_allclose(mast - deck, normal, rtol=0, atol=1e-12)
    # turned back about the mast, x is above the world's
    forwards = np.column_stack((np.ones_like(t), np.zeros_like(t), slope[0]))
    forwards /= np.linalg.norm(forwards, axis=1)[:, None]
    turned = np.arccos(np.sum(forwards * (bow - deck), axis=1))
    np.testing.assert_allclose(turned, 0.3 + 0.1 * t, rtol=0, atol=1e-10)


def test_a_base_that_follows_without_tilt_has_no_rotations() -> None:
    for tilt, turns in ((False, 0), (True, 2)):
        scene = from_data(_pendulum_on({"follow": {"waves": "sea", "tilt": tilt}, "position": [3, -1, 0.25]}))
        assert len(scene.base.rotations) == turns
        height = evaluate_batch(scene.base.position[2], lambda symbol: np.array([4.0]))
        expected = 0.25 + 0.5 + _waves(from_data(_data(SEA | {"ramp": 3}))).value("elevation", 0, 3.0, -1.0, 4.0)
        assert height == pytest.approx(expected, rel=1e-12)


def test_info_has_the_height_the_periods_and_the_lengths_of_seas(capsys: pytest.CaptureFixture[str]) -> None:
    regular = [{"amplitude": 1.0, "period": 8}, {"amplitude": 0.5, "period": 10, "heading": 1}]
    lengths = [GRAVITY * period**2 / (2 * math.pi) for period in (8, 10)]
    hull = {"body": "float", "start": [0, 0, -1], "end": [0, 0, 1], "diameter": 1, "waves": "sea", "stations": 3}
    scene = _scene({"regular": regular, "order": 2, "level": 0.5}, hulls={"h": hull})
    (row,) = described_waves(scene)
    assert (row["waves"], row["bound_waves"], row["level"], row["depth"]) == (2, 4, 0.5, None)
    assert row["height"] == pytest.approx(4 * math.sqrt(1.25 / 2))
    assert row["periods"] == pytest.approx([8, 10]) and row["lengths"] == pytest.approx(lengths)
    hulls = described_hulls(scene)
    assert hulls == [{"name": "h", "body": "float", "waves": "sea", "stations": 3, "moves_water": True}]
    varied = SEA | {"variables": True, "spreading": None}
    (known,) = described_waves(_scene(varied))
    parts = divided(Jonswap(3.0, 9.0), 7, depth=30.0, height=3.0)
    assert known["height"] == pytest.approx(parts.height) and len(known["variables"]) == 14
    print_waves({"waves": [row, known], "hulls": hulls})
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert lines[3][:7] == ["sea", "2", "4", "3.16228", "8", "to", "10"] and "none" in lines[3]
    assert lines[-1] == ["h", "float", "sea", "3", "True"]


def test_a_base_follows_waves_that_are_there() -> None:
    with pytest.raises(DescriptionError, match=r"\(base.follow.waves\): there is no wave 'see'; try: sea"):
        from_data(_pendulum_on({"follow": {"waves": "see"}}))
    assert not [
        note for note in from_data(_pendulum_on({"follow": {"waves": "sea"}})).notes if "changes nothing" in note
    ]


def test_jumps_of_a_base_that_follows_waves_are_said_where_they_stand() -> None:
    """The rotations of the surface stand before those of the file, and in no list of it."""
    kinked = {"axis": [0, 0, 1], "angle": "abs(t - 0.5)"}
    turned = _pendulum_on({"follow": {"waves": "sea"}, "rotation": [kinked]})
    with pytest.raises(DescriptionError, match=r"\(base.rotation\[0\].angle\): the rate of the angle of the b"):
        eomgen.derive(from_data(turned))
    moved = _pendulum_on({"follow": {"waves": "sea"}, "position": ["9 if t > 0.5 else 0", 0, 0]})
    with pytest.raises(DescriptionError, match=r"\(base.follow\): the angle of the base jumps") as caught:
        eomgen.derive(from_data(moved))
    assert "base.rotation" not in str(caught.value)


def test_generated_loops_do_not_grow_with_the_number_of_waves(tmp_path: Path) -> None:
    lengths = []
    for count in (8, 80):
        folder = tmp_path / str(count)
        eomgen.generate(_scene(SEA | {"components": count, "spreading": None}), folder)
        text = (folder / "afloat.c").read_text()
        lengths.append((text.count("EG_COS") + text.count("EG_SIN"), text.count("{\n")))
        assert "elevation of sea, wave by wave" in text
    assert lengths[0] == lengths[1]


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"spectrum": None}, r"\(waves\.sea\): neither spectrum nor regular says which waves there are"),
    ({"regular": [{"amplitude": 1, "period": 8}]}, r"both spectrum and regular say which waves there are"),
    ({"depth": -3}, r"\(waves\.sea\.depth\): the depth -3 m is not positive; try: no depth for water without"),
    ({"ramp": -1}, r"the time -1 s is negative"),
    ({"band": [2, 1]}, r"\(waves\.sea\.band\): 2 to 1 does not increase from above 0; try: band = \[0\.5, 3\.0\]"),
    ({"components": 60, "order": 2}, r"order\): 120 waves have 14400 bound waves, more than 10000; try: fewer"),
    ({"spreading": {"exponent": 0}}, r"\(waves\.sea\.spreading\.exponent\): 0 is not above 0; try: a number above 0"),
    ({"spreading": {"exponent": 1e308}}, r"exponent\): 1e\+308 is above 1e\+06; try: no spreading"),
    ({"spectrum": {"type": "jonswap", "height": 3, "period": 1e300}}, r"at the peak the period 1e\+300 s is not from"),
    ({"spectrum": {"type": "jonswap", "height": 3}}, r"the type jonswap needs the key period; try: period = 9"),
    ({"spectrum": {"type": "jonswap", "height": -3, "period": 9}}, r"spectrum\.height\): the height -3 is not"),
    (
        {"spectrum": {"type": "jonswap", "height": 9, "period": 5}},
        r"break from a height of 5\.541 m on, and the significant height is 9 m",
    ),
    ({"spectrum": {"type": "points", "points": [[1, 2]]}}, r"points\): a spectrum needs two points or more, not 1"),
    (
        {"spectrum": {"type": "points", "points": [[1, 0], [2, 1], [9, 0]]}, "band": [0.1, 0.2]},
        r"the spectrum is zero from 0\.2 to 0\.4 rad/s; try: a band in which the spectrum has energy",
    ),
]


#: Of waves one by one.
REGULAR: list[tuple[dict[str, Any], str]] = [
    (
        {"regular": [{"amplitude": 1, "period": 8}, {"amplitude": 0.5, "period": 8}], "order": 2},
        r"regular\): two waves have the same period and heading; try: one with the sum of both",
    ),
    ({"regular": []}, r"regular\): there are no waves"),
    *(
        (
            {"regular": [{"amplitude": 0, "period": period}]},
            rf"regular\[0\]\.period\): the period {text} s is not from 1e-06 to 1e\+09 s; try: period = 8",
        )
        for period, text in ((1e300, r"1e\+300"), (1e-300, "1e-300"), (0, "0"))
    ),
    ({"regular": [{"amplitude": -1, "period": 8}]}, r"the amplitude -1 m is negative; try: the phase \+ pi"),
    (
        {"regular": [{"amplitude": 1, "period": 8}, {"amplitude": 3, "period": 4}]},
        r"a wave of 24\.98 m breaks from an amplitude of 1\.774 m on, and this one has",
    ),
    ({"regular": [{"amplitude": 1, "period": 8}], "seed": 3}, r"seed\): seed belongs to a spectrum, and these waves"),
]


@pytest.mark.parametrize(("sea", "message"), [*((SEA | changes, text) for changes, text in REFUSED), *REGULAR])
def test_what_is_wrong_with_waves_is_said_once(sea: dict[str, Any], message: str) -> None:
    sea = {key: value for key, value in sea.items() if value is not None}
    with pytest.raises(DescriptionError, match=message) as caught:
        _scene(sea)
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize(
    ("sections", "text"),
    [
        ({"waves": {"sea": {"spectrum": {"type": "jonswap", "Hs": 3, "period": 9}}}}, "here; try: height"),
        ({"waves": {"sea": {"spectrum": {"type": "jonswap", "height": 3, "Tp": 9}}}}, "here; try: period"),
        (
            {"waves": {"sea": {"regular": [{"height": 3, "period": 9, "amplitude": 1}]}}},
            "try: amplitude = 1.5, half of the height",
        ),
        (
            {"waves": {"sea": {"regular": [{"frequency": 0.1, "period": 9, "amplitude": 1}]}}},
            "the key 'frequency' is unknown here; try: period = 10, s",
        ),
        ({"hulls": {"h": {"body": "float", "Cd": 1}}}, "'Cd' is unknown here; try: drag"),
        ({"hulls": {"h": {"body": "float", "Cm": 2}}}, "'Cm' is unknown here; try: added_mass, which is c_m - 1"),
        ({"base": {"follow": "sea"}}, "a table is needed here, not 'sea'; try: follow = { waves = \"sea\" }"),
        ({"base": {"follow": {}}}, '(base.follow.waves): the key waves is missing; try: waves = "sea"'),
        ({"outputs": {"eta": {"formula": "elevation(1, 2)"}}}, "unknown function 'elevation' (column 1)"),
    ],
)
def test_words_of_others_are_answered_with_those_of_scenes(sections: dict[str, Any], text: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(text)):
        from_data(_data(**sections))


@pytest.mark.parametrize("gravity", [[0, -9.81, 0], [0, 0, 9.81], [1, 0, -9.81], [0, 1e-6, -9.81]])
def test_water_is_level_in_z(gravity: list[float]) -> None:
    """Parts of gravity that are rounding do not count, and without gravity there are no waves."""
    assert _scene(gravity=["9.81 * sin(pi)", 0, "-9.81"]).gravity
    with pytest.raises(DescriptionError, match=r"waves need gravity, and the scene has none; try: gravity = \[0, 0"):
        _scene(gravity=[0, 0, 0])
    with pytest.raises(DescriptionError, match=r"\(gravity\): water at rest is level in z and below the air") as caught:
        _scene(gravity=gravity)
    assert len(caught.value.problems) == 1
    (problem,) = caught.value.problems
    assert problem.hint == "gravity = [0, 0, -9.81], and z upwards"


def test_a_call_may_not_tilt_the_water() -> None:
    known = {"slope": {"value": 0.0, "tunable": True}}
    tilted = _scene(parameters=known, gravity=["9.81 * slope", 0, -9.81])
    check = Requirements(describe(tilted), ("slope",)).check
    check(np.array([0.0]))
    with pytest.raises(UsageError, match=r"water at rest is level in z.* \[0\.0981, 0, -9\.81\] at slope = 0\.01"):
        check(np.array([0.01]))


@pytest.mark.parametrize(
    ("changes", "taken", "refused"),
    [
        ({}, "swell_z28", True),  # of seven frequencies in two directions
        ({}, "swell_z29", False),
        ({"spreading": None}, "swell_z14", True),
        ({"spreading": None}, "swell_z15", False),
        ({"variables": False}, "swell_z1", False),
    ],
)
def test_variables_of_waves_have_names_of_their_own(changes: dict[str, Any], taken: str, refused: bool) -> None:
    sections: Any = {"waves": {"swell": SEA | {"variables": True} | changes}, "parameters": {taken: 1.0}, "outputs": {}}
    if not refused:
        assert taken not in _scene(**sections).parts["waves"][0].variables
        return
    text = f"the sea swell has the parameter {taken}, and there is a parameter of that name; try: another name for one"
    with pytest.raises(DescriptionError, match=text):
        _scene(**sections)


TURNS = 'to 30 rad, 4.77 turns: angles without a unit are radians, "30 deg" is in degrees'
WAVE, SHALLOW = {"amplitude": 1, "period": 8}, {"regular": [{"amplitude": 0.5, "period": 9}], "depth": 3, "order": 2}
HIGH = [{"amplitude": 3.0, "period": period, "phase": period} for period in (7.0, 7.5, 8.0)]
RIPPLES = {"spectrum": {"type": "points", "points": [[0.9, 0.5], [1.0, 1.0], [4.0, 1.0]]}, "band": [0.9, 5.0]}
OF_DEFAULTS = "waves have the gravity of the default parameters, even if a run has another"


@pytest.mark.parametrize(
    ("sea", "sections", "note"),
    [
        (SEA | {"heading": 30}, {}, f"the waves sea run {TURNS}"),
        ({"regular": [WAVE, WAVE | {"period": 9, "heading": 30}]}, {}, f"regular[1] of the waves sea runs {TURNS}"),
        (SHALLOW, {}, "A / (k^2 h^3) = 1.06 for the largest wave, k = 0.132 rad/m; an expansion of second order holds"),
        (
            {"regular": HIGH},
            {},
            "at meeting crests the slope comes to 0.65, and waves break from 0.446 on: forces there",
        ),
        (RIPPLES, {}, "forces there are not physical. A lower sea, or a band that ends before its shortest waves"),
        (RIPPLES | {"variables": True, "amplitudes": "gaussian"}, {}, "waves.sea: the significant slope is "),
        (SEA, {"parameters": {"g": {"value": GRAVITY, "tunable": True}}, "gravity": [0, 0, "-g"]}, OF_DEFAULTS),
        (SEA, {"outputs": {}}, "the sea sea changes nothing: no formula mentions it"),
    ],
)
def test_what_is_doubtful_is_noted(sea: dict[str, Any], sections: dict[str, Any], note: str) -> None:
    assert any(note in text for text in _scene(sea, **sections).notes)
