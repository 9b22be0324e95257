"""Parts by which runs are judged and told, on models by hand: functions of numbers against closed forms and whole
matrices."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.errors import ModelError, Problem
from eomgen.lie.product import Factor
from eomgen.simulation import automatic_method
from eomgen.simulation.accuracy import error_estimation
from eomgen.simulation.accuracy.error_estimation import _moves_between_rows
from eomgen.simulation.accuracy.step_path import StepPath
from eomgen.simulation.judgement import failures, singular_positions
from eomgen.simulation.judgement.diagnosis import fast_joint
from eomgen.simulation.judgement.singular_positions import (
    _by_nonzeros,
    _by_whole_matrices,
    beyond_reach,
    examined_rows,
)
from eomgen.simulation.resume import _goes_on
from eomgen.simulation.stepping.events import without_value
from eomgen.simulation.timing import StepTimes
from tests.oracles.evaluation import Array

LINE = [Factor("R", "x", 0, 1, 0, 1)]


def constrained(masses: Array, rows: Array) -> tuple[Any, Any]:
    """Return a model with inertia (n, nv, nv) and constraint rows (n, rows, nv) at positions, and its nonzeros."""
    model = SimpleNamespace(
        multipliers=[f"row{k}" for k in range(rows.shape[1])],
        nv=rows.shape[2],
        mass=lambda q, parameters: masses,
        evaluate=lambda name, q, t, parameters: {"B": rows},
    )

    def nonzeros(model: object, name: str, *_: object, **__: object) -> Any:
        whole = masses if name == "mass" else rows
        places = np.nonzero(np.any(whole != 0.0, axis=0))
        return SimpleNamespace(values=whole[(slice(None), *places)], rows=places[0], columns=places[1])

    return model, nonzeros


@pytest.mark.parametrize("positions", [1, 3])
@pytest.mark.parametrize("moving", [False, True])
def test_nonzeros_have_the_singular_values_of_whole_matrices(
    positions: int, moving: bool, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    roots = np.tril(rng.normal(size=(positions if moving else 1, 2, 2))) + 3.0 * np.eye(2)
    masses = np.zeros((positions, 6, 6))
    for k in range(0, 6, 2):
        masses[:, k : k + 2, k : k + 2] = (k + 1.0) * roots @ np.swapaxes(roots, 1, 2)
    rows = rng.normal(size=(positions, 4, 6)) * (rng.uniform(size=(4, 6)) < 0.7)
    rows[:, 3] = 0.0 if moving else rows[:, 3]
    model, nonzeros = constrained(masses, rows)
    monkeypatch.setattr(singular_positions, "nonzeros", nonzeros)
    arguments = np.zeros(positions), np.zeros((positions, 6)), np.zeros(0)
    found, expected = _by_nonzeros(model, *arguments), _by_whole_matrices(model, *arguments)
    assert found is not None and expected is not None
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-9, atol=1e-12)
    assert found[1] == (pytest.approx(expected[1], rel=1e-9) if positions == 1 else np.inf)
    rows[0, 0, 0] = np.nan
    assert _by_nonzeros(model, *arguments) is None and _by_whole_matrices(model, *arguments) is None


def test_singular_values_stay_in_other_units_of_rows_and_masses(rng: np.random.Generator) -> None:
    masses, rows = np.eye(5)[np.newaxis] * rng.uniform(1.0, 3.0, 5), rng.normal(size=(2, 3, 5))
    masses, nothing = np.repeat(masses, 2, axis=0), (np.zeros(2), np.zeros((2, 5)), np.zeros(0))
    values, largest = _by_whole_matrices(constrained(masses, rows)[0], *nothing) or ((), 0.0)
    other = rows * np.array([1e3, 1.0, 1e-4])[:, np.newaxis]
    again = _by_whole_matrices(constrained(1e3 * masses, other)[0], *nothing)
    assert again is not None
    np.testing.assert_allclose(again[0], values, rtol=1e-9)
    assert again[1] == pytest.approx(largest, rel=1e-9)
    weighed = rows / np.sqrt(np.diagonal(masses, axis1=1, axis2=2))[:, np.newaxis]
    weighed /= np.linalg.norm(weighed, axis=-1).max(axis=0)[:, np.newaxis]
    np.testing.assert_allclose(values, [np.linalg.svd(one, compute_uv=False)[-1] for one in weighed], rtol=1e-9)


def test_examined_rows_are_spread_and_have_all_of_the_last() -> None:
    model: Any = SimpleNamespace(nv=2, multipliers=["one"])
    assert examined_rows(model, 0).tolist() == []
    assert examined_rows(model, 3).tolist() == [0, 1, 2]
    chosen = examined_rows(model, 10**6)
    assert chosen[0] == 0 and chosen[-1] == 10**6 - 1 and np.all(np.diff(chosen) > 0)
    assert np.all(np.diff(chosen)[-5:] == 1) and np.diff(chosen).max() <= 10**6 / 20
    large: Any = SimpleNamespace(nv=10**4, multipliers=["row"] * 10**3)
    assert 2 <= len(examined_rows(large, 10**6)) < len(chosen)


@pytest.mark.parametrize(("last", "told"), [(0.3, True), (np.inf, False)])
def test_a_drive_beyond_the_reach_of_its_loop_is_named_with_its_place(last: float, told: bool) -> None:
    """Positions meet the constraints up to a time."""

    def consistent(q: Array, v: Array, t: float, parameters: Array) -> None:
        if t > last:
            raise ModelError(Problem("constraints", "they contradict each other"))

    model: Any = SimpleNamespace(
        nv=2,
        multipliers=["crank: angle", "pin: x"],
        functions=("constraint_velocity",),
        q_names=["q.crank", "q.rod"],
        q_units=["rad", "rad"],
        evaluate=lambda *_, **__: {"held": np.array([2.0]), "free": np.array([0.0])},
        consistent=consistent,
    )
    q, p = np.array([0.7, 1.3]), np.zeros(0)
    found = beyond_reach(model, 0.3, q, p, 0.01)
    assert (found is not None) == told
    if found is not None:
        assert found.text == (
            "after t = 0.3 s no position meets the constraints: the drive of crank leaves the range that its loop can"
            " reach, at 0.7 rad"
        )
    model.evaluate = lambda *_, **__: {"held": np.zeros(1), "free": np.zeros(1)}
    assert beyond_reach(model, 0.3, q, p, 0.01) is None
    model.functions = ()
    assert beyond_reach(model, 0.3, q, p, 0.01) is None


def test_events_without_a_value_in_the_next_step_are_named() -> None:
    """A body with q = 1, v = -3 and a = 1 is below 0 between t = 0.35 and 5.65 s, and its speed 0 at 3 s."""
    fields = {"sizes": {"q": 1, "v": 1, "lam": 0, "z": 0}}

    def evaluate(name: str, q: Array, v: Array, a: Array, t: float, u: Array | None, **_: object) -> dict[str, Array]:
        assert u is None and a.tolist() == [1.0] and t - 2.0 <= 0.5
        return {
            "event": np.array([np.sqrt(q[0]), np.sqrt(-v[0]), 1.0]),
            "event_rate": np.array([0.0, 0.0, np.log(q[0] - 0.3)]),
        }

    rows = [{"name": name} for name in ("height", "speed", "rate")]
    library = SimpleNamespace(layout={"method": {"events": {"rows": rows}}})
    model = SimpleNamespace(functions=SimpleNamespace(**fields), multipliers=(), nu=0, factors=LINE, library=library)
    model.evaluate = evaluate
    run: Any = SimpleNamespace(model=model, parameters=np.zeros(0), settings={"step": 0.5})
    record = np.array([[1.0, 9.0, 9.0, 9.0], [2.0, 1.0, -3.0, 1.0]])
    assert without_value(run, record, None) == ["height", "rate"]
    run.settings["step"] = 0.3
    assert without_value(run, record, None) == ["rate"]
    run.settings["step"] = 0.2
    assert without_value(run, record, None) == []


class OneEvent(list[Any]):
    """Events of a run with the times as an array."""

    @property
    def t(self) -> Array:
        return np.array([event.t for event in self])


def test_the_last_state_is_that_of_the_row_or_of_a_later_event(monkeypatch: pytest.MonkeyPatch) -> None:
    model: Any = SimpleNamespace(functions=SimpleNamespace(sizes={"q": 1, "v": 1, "lam": 0, "z": 0}))
    run: Any = SimpleNamespace(model=model, parameters=np.array([5.0]))
    trajectory: Any = SimpleNamespace(rows=np.array([[2.0, 1.0, -3.0, 1.0]]))
    event = SimpleNamespace(t=2.5, q=np.ones(1), v=np.zeros(1), z=np.zeros(0), modes=np.zeros(0), name="hit")
    monkeypatch.setattr(failures, "parameters_with", lambda events, model, p, modes: p + 1.0)
    for time, behind in ((2.5, ", after the event hit"), (2.0, ""), (1.5, "")):
        event.t = time
        last = failures._last_state(run, trajectory, OneEvent([event]))  # type: ignore[arg-type]
        assert last.behind == behind and last.t == max(time, 2.0)
        assert (last.p.tolist(), bool(np.isnan(last.a[0]))) == (([6.0], True) if behind else ([5.0], False))
        assert last.q.tolist() == [1.0] and last.v.tolist() == ([0.0] if behind else [-3.0])


def test_a_resumed_input_begins_with_the_stored_one() -> None:
    table = np.array([1.0, 2.0, 3.0])
    for again, same in (([1, 2, 3, 4], True), ([1, 2, 3], True), ([1, 2], False), ([1, 2, 4, 4], False)):
        assert _goes_on(table, again) is same  # type: ignore[arg-type]
    assert _goes_on(np.array(2.0), 2) and not _goes_on(np.array(2.0), 2.5) and not _goes_on(table, 1.0)
    assert not _goes_on(table, "text")  # type: ignore[arg-type]
    assert not _goes_on(table, [[1.0, 2.0, 3.0]])  # type: ignore[arg-type]


@pytest.mark.parametrize(("speed", "told"), [(-700.0, "the joint wheel turns by 7 rad in a step"), (400.0, "")])
def test_a_joint_that_turns_too_far_within_a_step_is_named(speed: float, told: str) -> None:
    motion = (np.zeros(2), np.array([1.0, speed]))
    model: Any = SimpleNamespace(
        angles=["door.angle", "wheel.angle"], evaluator=SimpleNamespace(angle_motion=lambda q, v, t, p: motion)
    )
    assert fast_joint(model, 0.0, np.zeros(2), np.zeros(2), np.zeros(0), 0.01) == told
    model.angles = []
    assert fast_joint(model, 0.0, np.zeros(2), np.zeros(2), np.zeros(0), 0.01) == ""


def test_the_largest_eigenvalue_is_of_the_motion_or_of_the_internal_states(monkeypatch: pytest.MonkeyPatch) -> None:
    """An oscillator with omega = 3 1/s beside a second, held component, and states with rates -2 and -7 1/s."""
    K, C, M = np.diag([18.0, 1e9]), np.diag([0.0, 1e9]), np.diag([2.0, 1.0])
    rates = np.array([[-2.0, 1.0], [0.0, -7.0]])
    functions: list[str] = []
    model: Any = SimpleNamespace(
        multipliers=(), functions=functions, internal_partials=lambda *_, **__: SimpleNamespace(rate_z=rates)
    )
    monkeypatch.setattr(automatic_method, "has_residual_partials", lambda model: True)
    monkeypatch.setattr(automatic_method, "accelerations", lambda *_, **__: np.zeros(2))
    monkeypatch.setattr(automatic_method, "residual_partials", lambda *_, **__: (K, C, M))
    monkeypatch.setattr(automatic_method, "free_directions", lambda *_: np.eye(2)[:, :1])
    state: Any = SimpleNamespace(q=np.zeros(2), v=np.zeros(2), z=np.zeros(2))
    assert automatic_method.largest_eigenvalue(model, state, 0.0, np.zeros(0)) == pytest.approx(3.0, rel=1e-9)
    functions.append("internal_partials")
    assert automatic_method.largest_eigenvalue(model, state, 0.0, np.zeros(0)) == pytest.approx(7.0, rel=1e-9)
    M[0, 0] = 0.0
    assert automatic_method.largest_eigenvalue(model, state, 0.0, np.zeros(0)) is None


def test_times_of_steps_are_quantiles(tmp_path: Any) -> None:
    seconds = 1e-6 * np.arange(1.0, 1001.0)
    times = StepTimes(seconds[::-1], 0.5 * seconds)
    summary = times.summary()
    assert summary["steps"] == 1000 and summary["longest"] == pytest.approx(1e-3)
    assert (summary["median"], summary["call_median"]) == pytest.approx((500.5e-6, 250.25e-6))
    assert summary["late"] == pytest.approx(2.0 * summary["call_late"]) and 0.9e-3 < summary["late"] <= 1e-3
    assert str(times).startswith("median 500 us, ") and "longest 1e+03 us, of 1000 steps; in it the call" in str(times)
    written = times.write(tmp_path / "times.csv").read_text().splitlines()
    assert written[0] == "seconds" and np.array(written[1:], float) == pytest.approx(seconds[::-1])


def test_internal_states_are_cubics_or_held_between_samples() -> None:
    """z0 = t^2, whose differences have the slopes of neighbours; z1 is sampled at t = 0.25 + k / 2."""
    t = np.array([0.0, 1.0, 2.0, 3.0])
    q, v, a = t**3, 3.0 * t**2, 6.0 * t
    held = SimpleNamespace(sampling=SimpleNamespace(period=0.5, offset=0.25))
    rows = np.column_stack([t, q, v, a, t**2, [10.0, 20.0, 30.0, 40.0]])
    model = SimpleNamespace(
        functions=SimpleNamespace(sizes={"q": 1, "v": 1, "lam": 0, "z": 2}),
        nz=2,
        factors=LINE,
        description=SimpleNamespace(states=[SimpleNamespace(sampling=None), held]),
    )
    path = StepPath(SimpleNamespace(model=model), rows, np.zeros(0))  # type: ignore[arg-type]
    times = np.array([1.1, 1.2, 1.3, 1.6, 1.8])
    q_there, v_there, z_there = path.between(times, np.ones(5, dtype=int))
    np.testing.assert_allclose(q_there[:, 0], times**3, rtol=1e-12)
    np.testing.assert_allclose(v_there[:, 0], 3.0 * times**2, rtol=1e-12)
    np.testing.assert_allclose(z_there[:, 0], times**2, rtol=1e-12)
    assert z_there[:, 1].tolist() == [20.0, 20.0, 30.0, 30.0, 30.0]


@pytest.mark.parametrize(("hidden", "larger"), [(2.1, True), (1.9, False), (np.inf, False)])
def test_a_motion_between_sparse_rows_is_measured_by_all_steps(
    hidden: float, larger: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows, finer = np.zeros((2, 4)), np.ones((3, 4))
    known = {"v": np.array([1.0, 4.0]), "z": np.array([1.0])}
    seen: list[int] = []

    def size(model: object, rows: Array, outputs: object) -> Any:
        seen.append(len(rows))
        return SizeOfMotion({"v": np.array([hidden, 3.0]), "z": np.array([0.5])})

    monkeypatch.setattr(error_estimation, "step_rows", lambda *_: SimpleNamespace(rows=finer))
    monkeypatch.setattr(error_estimation, "motion_size", size)
    monkeypatch.setattr(error_estimation, "replace", lambda item, sizes: SizeOfMotion(sizes))
    taken = SimpleNamespace(model=None), None, rows, np.zeros(0), None, {}
    runs: Any = SimpleNamespace(taken=taken, size=SizeOfMotion(known))
    assert _moves_between_rows(runs) is larger and seen == [5]
    assert runs.size.sizes["v"].tolist() == ([2.1, 4.0] if larger else [1.0, 4.0])
    assert runs.size.sizes["z"].tolist() == [1.0]
    monkeypatch.setattr(error_estimation, "step_rows", lambda *_: None)
    assert not _moves_between_rows(runs)


class SizeOfMotion:
    def __init__(self, sizes: dict[str, Array]) -> None:
        self.sizes = sizes
