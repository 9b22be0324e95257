"""Parts of doubts on runs by hand: events between steps, times at which laws jump, laws that are named, partials of
rates, places of fast motions, and upright tyres."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.formula.nodes import Number
from eomgen.products.doubts import causes, fast_motions, remarks, unseen_laws
from eomgen.products.doubts.places import depth_note
from eomgen.products.doubts.unseen_events import _Roots
from eomgen.products.doubts.unseen_laws import _Examination, _known_times, rate_partials
from eomgen.system.description import Wheel
from tests.oracles.evaluation import Array


def path_over(t: Array) -> Any:
    """Return the path of a run whose states are its times."""
    return SimpleNamespace(
        states=SimpleNamespace(t=t),
        at=lambda times, steps: SimpleNamespace(t=times, steps=steps),
        at_rows=SimpleNamespace(t=t),
    )


@pytest.mark.parametrize("waves", [3, 40])
def test_events_in_pairs_within_steps_are_counted(waves: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sines with whole waves in a step, off its ends: two roots to a wave, one of which rises."""
    t = np.arange(11.0)

    def values(self: object, there: Any) -> Array:
        wave = np.sin(2.0 * math.pi * waves * there.t + 0.3)
        return np.stack([wave, wave, -wave, 0.0 * wave + 1.0], axis=1)

    monkeypatch.setattr(_Roots, "_values", values)
    signs, total = np.array([0, 1, 1, 0]), 20.0 * waves
    roots = _Roots(path_over(t), range(4), signs, np.zeros(0))
    assert roots.count_missed(np.zeros(4)).tolist() == [total, 0.5 * total, 0.5 * total, 0.0]
    if waves == 3:  # more roots than places are first counted too low
        found = roots.count_missed(np.array([total, 0.5 * total - 1.0, 0.5 * total - 2.0, 0.0]))
        assert found.tolist() == [0.0, 0.0, 2.0, 0.0]
    changed = _Roots(path_over(t), range(4), signs, np.array([2.5, 7.5]))  # two steps are changed within
    assert changed.count_missed(np.zeros(4))[0] == pytest.approx(0.8 * total)
    assert _Roots(path_over(t[:2]), range(4), signs, np.array([0.5])).count_missed(np.ones(4)).tolist() == [0.0] * 4


def test_known_times_are_those_within_the_run_of_periods_that_are_not_short(monkeypatch: pytest.MonkeyPatch) -> None:
    points = {
        "step": (0.7, 0.0),
        "wave": (10.0, 0.4),
        "early": (-3.0, 0.0),
        "at the end": (2.0, 0.0),
        "fast": (0.0, 1e-5),
    }

    def breakpoints(law: str, value_of: Any) -> Any:
        assert value_of(SimpleNamespace(name="gain")) == 5.0
        time, period = points[law]
        yield SimpleNamespace(time=time, period=period)

    monkeypatch.setattr(unseen_laws, "breakpoints", breakpoints)
    path = path_over(np.array([0.5, 1.0, 2.0]))
    path.parameters = np.array([5.0])
    path.run = SimpleNamespace(model=SimpleNamespace(parameters=["gain"], description=SimpleNamespace(values=dict)))
    laws: Any = [*points]
    assert _known_times(path, laws) == pytest.approx([0.7, 0.8, 1.2, 1.6])
    path.parameters = np.array([[5.0], [6.0], [7.0]])
    assert _known_times(path, laws[:1]).tolist() == [0.7]


def examined(known: dict[str, Any], rates: Any, *, opaque: bool) -> _Examination:
    """Return an examination of steps of 2 s whose laws are functions of the time."""
    path = path_over(np.array([0.0, 2.0, 4.0]))
    path.values = lambda law, blocks: known[law](blocks.t)
    path.rates = lambda blocks: np.stack([0.0 * blocks.t, rates(blocks.t)], axis=1)
    result = object.__new__(_Examination)
    vars(result).update(
        _t=path.states.t,
        _path=path,
        _known=[*known],
        _opaque=opaque,
        _model=SimpleNamespace(v_names=["v.cart"], z_names=["z.level"]),
    )
    return result


def pulse(size: float, begin: float, end: float) -> Any:
    return lambda t: np.where((t > begin) & (t < end), size, 0.0) + 3.0 * t


def test_the_law_with_the_largest_nonlinearity_is_named_with_its_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unseen_laws, "infix", str)
    mesh = np.linspace(0.0, 1.0, 201)
    known = {"weak": pulse(0.5, 2.5, 3.5), "kick": pulse(40.0, 3.0, 3.1), "line": lambda t: 9.0 * t}
    words, width = examined(known, np.zeros_like, opaque=False)._culprit(1, mesh, "z.level")
    assert words == "the formula kick" and width == pytest.approx(0.1, rel=1e-6)
    two = {"twice": lambda t: pulse(5.0, 2.4, 2.6)(t) + pulse(5.0, 3.4, 3.6)(t) - 3.0 * t}
    words, width = examined(two, np.zeros_like, opaque=False)._culprit(1, mesh, "z.level")
    assert words == "the formula twice" and width == pytest.approx(0.2, rel=1e-6)  # of each pulse
    rate = pulse(100.0, 2.2, 2.6)
    assert examined(known, rate, opaque=False)._culprit(1, mesh, "z.level")[0] == "the formula kick"
    words, width = examined(known, rate, opaque=True)._culprit(1, mesh, "z.level")
    assert words == "the rate of z.level" and width == pytest.approx(0.4, rel=1e-6)
    assert examined(known, rate, opaque=True)._culprit(1, mesh, "v.cart")[0] == "the formula kick"
    assert examined({}, np.zeros_like, opaque=False)._culprit(0, mesh, "v.cart") == ("the rate of v.cart", 2.0)


@pytest.mark.parametrize("nz", [0, 1])
def test_partials_of_rates_under_constraints_are_differences_over_the_moves(nz: int) -> None:
    """Accelerations come from the equations, and rates z' = 3 q^2 - v z as differences."""
    q, v, z = np.array([[2.0], [3.0]]), np.array([[0.5], [0.25]]), np.array([[1.0], [4.0]])
    moves: list[Any] = [((q + 0.1, v, z), (q - 0.1, v, z), 0.2), ((q, v, z + 0.5), (q, v, z - 0.25), 0.75)]
    of_equations = np.arange(4.0).reshape(2, 1, 2)

    def partials(named: Any, **state: Any) -> Array:
        assert [item[2] for item in named] == [0.2, 0.75] and state["base"] is None and state["u"] is None
        return of_equations

    model = SimpleNamespace(
        evaluator=SimpleNamespace(multipliers=["row"], acceleration_partials=partials),
        nu=0,
        nz=nz,
        internal_rates=lambda q, v, z, **_: 3.0 * q**2 - v * z,
    )
    blocks: Any = SimpleNamespace(states=(q, v, z), t=np.zeros(2), p=np.zeros(0))
    path: Any = SimpleNamespace(run=SimpleNamespace(model=model))
    found = rate_partials(path, blocks, moves)
    np.testing.assert_array_equal(found[:, :1], of_equations)
    assert found.shape == (2, 1 + nz, 2)
    if nz:
        np.testing.assert_allclose(found[:, 1, 0], 6.0 * q[:, 0], rtol=1e-12)
        np.testing.assert_allclose(found[:, 1, 1], -v[:, 0], rtol=1e-12)


def test_partials_of_rates_without_constraints_are_differences_of_all_rates() -> None:
    model = SimpleNamespace(evaluator=SimpleNamespace(multipliers=[]))
    path: Any = SimpleNamespace(run=SimpleNamespace(model=model), rates=lambda blocks, x: np.stack([x**2, 5.0 * x], 1))
    ahead, behind = np.array([2.0, 3.5]), np.array([1.0, 3.0])
    found = rate_partials(path, path, [(ahead, behind, 0.5)])  # type: ignore[list-item]
    np.testing.assert_allclose(found[:, :, 0], [[6.0, 10.0], [6.5, 5.0]], rtol=1e-12)


def test_fast_motions_begin_at_the_start_at_events_that_act_and_at_jumps(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.arange(6.0)
    q, v, z = 10.0 * t[:, np.newaxis], 100.0 * t[:, np.newaxis], np.zeros((6, 0))
    monkeypatch.setattr(fast_motions, "parameters_with", lambda events, model, p, modes: p + modes)
    monkeypatch.setattr(fast_motions, "parameters_over", lambda events, model, p, time: p + 100.0 * time)
    none = np.zeros(0)
    events = [
        SimpleNamespace(
            name=f"e{k}",
            t=time,
            q=np.array([k]),
            v=none,
            z=none,
            modes=k,
            q_before=-np.array([k]),
            v_before=none,
            z_before=none,
        )
        for k, time in enumerate((1.5, 2.5, 3.5, 5.0))
    ]
    run = SimpleNamespace(
        model=None, grid=SimpleNamespace(start=0.0, end=5.0), parameters=np.array([7.0]), settings={"step": 1.0}
    )
    finished: Any = SimpleNamespace(
        run=run,
        events=events,
        changes=np.array([1.5, 3.5, 5.0]),
        states=(t, q, v, None, None, z),
        known_jumps=lambda order: np.array([0.0, 1.5, 3.0, 3.5, 4.1, 5.0]),
    )
    found = fast_motions._places(finished)
    assert [(item.name, item.t) for item in found] == [
        ("the start", 0.0), ("the event e0 at t = 1.5 s", 1.5), ("the event e2 at t = 3.5 s", 3.5),
        ("the jump at t = 3 s", 3.0),
    ]  # fmt: skip  # two lines
    start, first, second, jump = found
    assert start.before is None and start.q.tolist() == [0.0] and start.p.tolist() == [7.0]
    assert first.before is not None and second.before is not None
    assert (first.p.tolist(), first.before[3].tolist()) == ([7.0], [7.0]) and second.before[0].tolist() == [-2.0]
    assert (second.p.tolist(), second.before[3].tolist(), second.q.tolist()) == ([9.0], [7.0], [2.0])
    assert jump.jump and jump.q.tolist() == [30.0] and jump.v.tolist() == [300.0] and jump.p.tolist() == [307.0]
    run.grid.start = -1.0
    assert fast_motions._places(finished)[0].name.startswith("the event e0")


@pytest.mark.parametrize(("angle", "named"), [(0.0, ""), (0.5 * math.pi, "front"), (1.5, "")])
def test_tyres_whose_axis_is_upright_are_named(angle: float, named: str) -> None:
    """Wheels that turn about y, on a body that turns about x; one has no axis."""
    half = 0.5 * angle
    pose = np.array([math.cos(half), math.sin(half), 0.0, 0.0, 1.0, 2.0, 3.0])
    points = [SimpleNamespace(name="hub", body="fork"), SimpleNamespace(name="rear", body="frame")]
    wheels = [
        SimpleNamespace(name="front", axis=(0.0, 2.0, 0.0), center="hub"),
        SimpleNamespace(name="back", axis=(0.0, 2.0, 0.0), center="rear"),
        SimpleNamespace(name="ball", axis=None, center="hub"),
    ]
    drawing = SimpleNamespace(points=points, wheels=wheels)
    model: Any = SimpleNamespace(description=SimpleNamespace(drawing=drawing))
    poses = {"fork": pose, "frame": np.array([1.0, *[0.0] * 6])}
    assert causes._upright_tyres(model, lambda: poses) == named


def test_numbers_at_rows_are_those_that_every_row_has(monkeypatch: pytest.MonkeyPatch) -> None:
    def values_of(model: object, t: float, q: Array, v: Array, z: Array, p: Array, signals: object) -> dict[Any, float]:
        some = {
            ("time", "", 0): t,
            ("q", "x", 0): float(q[0]),
            ("v", "x", 0): float(v[0]),
            ("state", "s", 0): float(z[0]),
        }
        return some | ({("input", "u", 0): 1.0} if t < 700.0 else {})

    monkeypatch.setattr(causes, "values_of", values_of)
    t = np.arange(1001.0)
    states: Any = SimpleNamespace(t=t, q=2.0 * t[:, None], v=3.0 * t[:, None], z=4.0 * t[:, None])
    nothing: Any = None
    found = remarks._values_at_rows(nothing, states, np.zeros(0), nothing)
    assert set(found) == {("time", "", 0), ("q", "x", 0), ("v", "x", 0), ("state", "s", 0)}
    assert len(found["time", "", 0]) == 334 and found["time", "", 0][:3].tolist() == [0.0, 3.0, 6.0]
    for name, factor in (("q", 2.0), ("v", 3.0), ("state", 4.0)):
        key = name, "s" if name == "state" else "x", 0
        np.testing.assert_array_equal(found[key], factor * found["time", "", 0])


@pytest.mark.parametrize(("depth", "told"), [(0.125, False), (0.1251, True)])
def test_tyres_start_deep_from_a_quarter_of_their_radius(depth: float, told: bool) -> None:
    wheel = Wheel("front", "hub", Number(0.5), Number(0.0), Number(1e5))
    note = depth_note(wheel, np.array([0.0, 0.0, 0.5 - depth]), 0.0, {}, {})
    assert bool(note) == told
    if told:
        assert note == (
            "the tyre front starts 0.1251 m deep in its road, with a radius of 0.5 m: 12.5 kN push it out; its centre"
            " belongs about 0.5 m above the road [W0204]"
        )
    point = Wheel("front", "hub", Number(0.0), Number(0.0), Number(1e5))
    assert depth_note(point, np.array([0.0, 0.0, -1.0]), 0.0, {}, {}) == ""
