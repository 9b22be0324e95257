"""A simulator takes the steps of ``simulate`` to the bit, and keeps the order of its method where inputs, parameters
and states jump."""

from __future__ import annotations

import copy
import itertools
import pickle
from collections.abc import Mapping
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.simulation import simulator as simulator_module
from eomgen.simulation.simulator import Simulator
from tests.models.library import scene

#: A pendulum of tunable mass with a motor that lags behind its torque.
PENDULUM: dict[str, Any] = {
    "parameters": {"load": {"value": 1.0, "unit": "kg", "tunable": True}},
    "inputs": {"torque": {"unit": "N m"}},
    "states": {"lag": {"rate": "(torque - lag) / 0.2"}},
    "bodies__rod": {"mass": "load", "inertia": [0.3, 0.3, 0.3], "center_of_mass": [0, 0, -0.5]},
    "joints__hinge__initial": None,
    "efforts": {"motor": {"joint": "hinge", "effort": "lag + 0.5 * torque - 0.2 * v.hinge"}},
    "outputs": {"reached": {"formula": "q.hinge + torque"}},
    "simulation": None,
}
FREE = (
    "rk4",
    "rk45",
    "taylor",
    "generalized_alpha",
    "hht",
    "newmark",
    "rosenbrock",
    "lsrt2",
    "corrected_predictor",
    "tdg2",
    "rattlie",
)
HELD_BY_CONSTRAINTS = (
    "generalized_alpha",
    "generalized_alpha_index3",
    "generalized_alpha_f1",
    "generalized_alpha_index3_f2",
    "rk4_partitioned",
    "rattlie",
)
CASES = [*((name, "joint") for name in FREE), *((name, "absolute") for name in HELD_BY_CONSTRAINTS)]
OF_SERIES = ("taylor",)
START = {"hinge": {"position": 0.4, "velocity": -0.3}}


@cache
def pendulum(coordinates: str) -> eomgen.Model:
    return eomgen.build(scene("pendulum", coordinates=coordinates, **PENDULUM), profile="quick")


def start(name: str, coordinates: str, **options: Any) -> Any:
    model = pendulum(coordinates)
    initial = START if coordinates == "joint" else at(model, 0.4, -0.3, 0.0)
    return model.start(initial, method=name, **options)


def at(model: eomgen.Model, angle: float, rate: float, lag: float) -> Mapping[str, Any]:
    """Return the state of the pendulum at an angle, in the coordinates of the model."""
    if not model.multipliers:
        return {"hinge": {"position": angle, "velocity": rate}, "lag": lag}
    q, v = model.initial_q.copy(), model.initial_v.copy()
    q[:4] = [np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    origin = model.initial_q[4:7]  # of the body's frame, seen from the hinge
    q[4:7] = turn @ origin
    v[:] = [0.0, rate, 0.0, *np.cross([0.0, rate, 0.0], origin)]
    return {"q": q, "v": v, "z": [lag]}


def angle_of(model: eomgen.Model, q: np.ndarray) -> float:
    return float(q[0]) if not model.multipliers else float(2.0 * np.arctan2(q[2], q[0]))


def rows_of(run: Any) -> np.ndarray:
    return np.concatenate([[run.t], run.q, run.v, run.a, run.multipliers, run.z])


def rows_over(solution: eomgen.Solution) -> np.ndarray:
    return np.column_stack([solution.t, solution.q, solution.v, solution.a, solution.multipliers, solution.z])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "coordinates"), CASES)
def test_steps_are_those_of_simulate_to_the_bit(name: str, coordinates: str) -> None:
    model, steps, step = pendulum(coordinates), 40, 2.0**-6
    initial = START if coordinates == "joint" else at(model, 0.4, -0.3, 0.0)
    options: dict[str, Any] = {"method": name, "initial": initial, "parameters": {"load": 1.5}}
    if name == "newmark":
        options["alpha"] = 0.1

    def simulated(signal: Any) -> np.ndarray:
        solution = model.simulate(steps * step, step, inputs={"torque": signal}, error_estimate=False, **options)
        return rows_over(solution)

    held = simulated(0.75)
    run = model.start(step=step, **options)
    found = []
    for _ in range(steps):
        run.step(np.array([0.75]))
        found.append(rows_of(run))
    assert np.array_equal(np.array(found), held[1:])
    run = model.start(step=step, inputs={"torque": 0.75}, **options)
    run.step(n=steps - 1)
    run.step({"torque": 0.75})
    assert np.array_equal(rows_of(run), held[-1])
    if name in OF_SERIES:
        return
    followed = simulated(lambda t: np.sin(3.0 * t))
    run = model.start(step=step, inputs={"torque": lambda t: np.sin(3.0 * t)}, **options)
    run.step(n=3)
    run.step(n=steps - 3)
    assert np.array_equal(rows_of(run), followed[-1])
    table = np.random.default_rng(3).integers(-64, 64, steps + 1) / 64.0
    ramps = simulated(table)
    run = model.start(step=step, **options)
    for first, last in itertools.pairwise(table):
        run.step([first], end=[last])
    assert np.allclose(rows_of(run), ramps[-1], rtol=1e-13, atol=1e-12)  # simulate interpolates in its own order
    named = model.start(step=step, **options)
    for first, last in itertools.pairwise(table):
        named.step({"torque": first}, end={"torque": last})
    assert np.array_equal(rows_of(named), rows_of(run))


def oracle(segments: int) -> np.ndarray:
    """Return angle, rate and lag at the end of ``jumps``, by own equations and SciPy."""
    y, load = np.array([0.4, -0.3, 0.0]), 1.0

    def rates(_: float, y: np.ndarray, load: float, torque: float) -> list[float]:
        moment = y[2] + 0.5 * torque - 0.2 * y[1] - load * 9.81 * 0.5 * np.sin(y[0])
        return [y[1], moment / (0.3 + load * 0.25), (torque - y[2]) / 0.2]

    for k in range(segments):
        if k == 2:
            load = 2.5
        if k == 4:
            y = np.array([y[0] + 0.2, 1.5, -0.5])
        args = (load, (-1.0) ** k * (2.0 + k))
        y = solve_ivp(rates, (0.0, 0.25), y, "DOP853", args=args, rtol=1e-13, atol=1e-14).y[:, -1]
    return y


def jumps(name: str, coordinates: str, steps: int, segments: int = 6, **options: Any) -> np.ndarray:
    """Return angle, rate and lag behind jumps of the torque, the load and the state; ``steps`` between two jumps."""
    model = pendulum(coordinates)
    run = start(name, coordinates, step=0.25 / steps, **options)
    for k in range(segments):
        if k == 2:
            run.set_parameter("load", 2.5)
        if k == 4:
            run.set_state(at(model, angle_of(model, run.q) + 0.2, 1.5, -0.5))
        run.step([(-1.0) ** k * (2.0 + k)], steps)
    rate = run.v[0] if not model.multipliers else run.v[1]
    return np.array([angle_of(model, run.q), rate, run.z[0]])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "coordinates", "order", "options"),
    [
        ("rk4", "joint", 4, {}),
        ("generalized_alpha", "joint", 2, {}),
        ("newmark", "joint", 2, {"beta": 0.25, "gamma": 0.5}),
        ("rk4_partitioned", "absolute", 4, {}),
        ("generalized_alpha", "absolute", 2, {}),
        ("generalized_alpha_index3", "absolute", 2, {}),
    ],
)
def test_the_order_is_kept_over_jumps(name: str, coordinates: str, order: int, options: dict[str, Any]) -> None:
    exact = oracle(6)
    errors = [np.linalg.norm(jumps(name, coordinates, steps, **options) - exact) for steps in (32, 64, 128)]
    slopes = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(slopes > order - 0.25), (errors, slopes)
    assert errors[-1] < (1e-8 if order == 4 else 1e-3)


@pytest.mark.slow_except("generalized_alpha-absolute")
@pytest.mark.parametrize(("name", "coordinates"), CASES)
def test_copies_and_states_go_on_with_the_same_bits(name: str, coordinates: str) -> None:
    options = {"alpha": 0.1} if name == "newmark" else {}
    run = start(name, coordinates, step=0.01, **options)
    run.step(np.array([1.0]), 7)
    state, other, third = pickle.loads(pickle.dumps(run.state)), run.copy(), copy.copy(run)
    assert repr(state) == "<SimulatorState of pendulum at t = 0.07 s>"

    def on(simulator: Any) -> np.ndarray:
        for k in range(9):
            simulator.step(np.array([float(k % 4)]))
        return rows_of(simulator)

    first = on(run)
    assert np.array_equal(on(other), first) and np.array_equal(on(third), first)
    run.set_parameter("load", 3.0)
    run.advance(0.3)
    run.restore(state)
    assert run.parameters["load"] == 1.0 and run.t == state.t and run.inputs == [1.0]
    assert np.array_equal(on(run), first)
    fresh = start(name, coordinates, step=0.01, **options)
    fresh.restore(state)
    assert np.array_equal(on(fresh), first)
    run.step()
    plain = run.state
    run.step({"torque": 2.0})
    of_call, same = run.state, run.copy()
    for again, inputs in ((plain, [0.0]), (of_call, [2.0])):
        run.restore(again)
        assert run.inputs == inputs, "inputs of a call by name are in its state"
    assert same.inputs == [2.0]


@pytest.mark.slow_cases("absolute")
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_advance_ends_where_it_is_told_to(coordinates: str) -> None:
    """Times off the grid, with an input that is linear over all of the way, against a run by the same steps."""
    name = "rk4" if coordinates == "joint" else "rk4_partitioned"
    run, other = (start(name, coordinates, step=2.0**-6) for _ in range(2))
    run.advance(0.1, [1.0], end=[2.0])
    assert run.t == 0.1 and run.inputs == [2.0]
    other.step([1.0], 6, end=[1.0 + 0.9375])
    other.advance(0.1, [1.9375], end=[2.0])
    assert np.allclose(rows_of(run), rows_of(other), rtol=0, atol=1e-13)
    run.advance(0.1)
    run.step([2.0], 3)
    assert run.t == 0.1 + 3 * 2.0**-6
    run.advance(1.0)
    assert run.t == 1.0 and run.statistics["steps"] > 60


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda run: run.step([1.0, 2.0]), r"u: the shape is \(2,\), \(1,\) is needed: torque; try: one number for"),
        (lambda run: run.step(np.array([np.nan])), "u: torque is nan, not a finite number"),
        (lambda run: run.step({"torq": 1.0}), "there is no input 'torq'; try: torque"),
        (lambda run: run.step({"torque": [1.0]}), "input torque: a table does not say to which steps it belongs"),
        (lambda run: run.step(end=1.0), "u: inputs that move linearly need all of them at both ends"),
        (lambda run: run.step({"torque": 1.0}, end={}), "end: inputs that move linearly need all of them at both ends"),
        (lambda run: run.step(1.0, 0), "n: a whole number from 1 on is needed, not 0"),
        (lambda run: run.step(1.0, dt=1), "step: there is no argument 'dt'"),
        (lambda run: run.advance(-1.0), "t: -1 s lies before the time of the state, 0 s; try: a later time, or rest"),
        (lambda run: run.set_parameter("mass", 1.0), "there is no parameter 'mass'"),
        (lambda run: run.set_parameter("load", np.nan), "load is nan"),
        (lambda run: run.set_parameter("load", -1.0), "load"),
        (lambda run: run.set_state({"wheel": 1.0}), "there is no joint or state 'wheel'"),
        (lambda run: run.restore("old"), "state: a state of a simulator is needed, not str; try: run.state of before"),
        (lambda run: run.velocity, "a Simulator has no 'velocity'"),
    ],
)
def test_mistakes_are_told_and_change_nothing(call: Any, text: str) -> None:
    run = start("rk4", "joint", step=1e-3)
    run.step(np.array([1.0]), 2)
    before = rows_of(run)
    run.set_state(t=0.0)
    before[0] = 0.0
    with pytest.raises((eomgen.UsageError, eomgen.ModelError), match=text):
        call(run)
    assert np.array_equal(rows_of(run), before)


@pytest.mark.slow
def test_starts_that_cannot_be_are_refused() -> None:
    model = pendulum("joint")
    for options, text in (
        ({"dt": 0.1}, "there is no argument 'dt'; try: step"),
        ({"inputs": {"torque": [1.0]}}, "input torque: a table is for a run whose end is known"),
        ({"inputs": {"torque": abs}, "method": "taylor"}, "taylor needs the time derivatives of inputs"),
        ({"parameters": [[1.0], [2.0]]}, "one set of parameters is needed, not a batch"),
        ({"start": "rest"}, "a run cannot start at 'rest'"),
        ({"start": np.array([1.0, 2.0])}, r"start: a run cannot start at array\(\[1., 2.\]\)"),
        ({"method": np.array(["rk4", "rk4"])}, "method: there is no method"),
        ({"step": 1e-9, "t_start": 1e9}, "too much for a step of 1e-09 s"),
    ):
        with pytest.raises(eomgen.UsageError, match=text):
            model.start(**options)
    with pytest.raises(eomgen.UsageError, match="end: taylor holds its inputs over each step"):
        model.start(method="taylor").step(1.0, end=2.0)
    with pytest.raises(eomgen.ModelError, match="this is a state of another model 'pendulum'"):
        model.start(method="rk4").restore(model.start(method="taylor").state)


def test_a_step_that_fails_leaves_the_last_good_state() -> None:
    run = start("rk4", "joint", step=1e-3)
    run.step(1.0, 3)
    before = rows_of(run)
    with pytest.raises(eomgen.NumericalError, match=r"the step from t = 0.003 s, of 0.001 s, failed: a value became"):
        run.step(np.array([1e308]))
    assert np.array_equal(rows_of(run)[:3], before[:3])
    run.step(1.0)
    assert run.t == pytest.approx(0.004)


@pytest.mark.slow
def test_events_within_steps() -> None:
    top = {"when": "q.ball - 1.5", "direction": "rising", "action": "stop"}
    pushed = {"inputs": {"push": {"unit": "N"}}, "efforts": {"push": {"joint": "ball", "effort": "push"}}}
    events = {"events__top": top, "events__rises": None, "events__end": None, "parameters__restitution__value": 0.5}
    run = eomgen.build(scene("bouncing_ball", **pushed, **events), profile="quick").start(method="rk4", step=1e-2)
    fall = np.sqrt(2.0 / 9.81)
    run.step(np.array([0.0]), 45)
    assert run.events == ()
    run.step(np.array([0.0]))
    ((name, t),) = run.events
    assert name == "bounce" and t == pytest.approx(fall, abs=1e-12)
    assert run.event_counts == {"bounce": 1, "top": 0}
    speed = 0.5 * 9.81 * fall
    rest = run.t - fall
    assert run.q[0] == pytest.approx(speed * rest - 0.5 * 9.81 * rest**2, abs=1e-12)
    state = run.state
    run.step(np.array([0.0]))
    assert run.events == ()
    run.step(np.array([100.0]), 100)
    assert run.stopped.startswith("stopped by the event top at t = ") and run.q[0] == pytest.approx(1.5, abs=1e-9)
    with pytest.raises(eomgen.UsageError, match="step: the motion was stopped by the event top"):
        run.step(np.array([0.0]))
    run.restore(state)
    run.step(np.array([0.0]))
    assert run.stopped == "" and run.event_counts["bounce"] == 1


@pytest.mark.slow
def test_a_law_of_other_parameters_sets_other_joints_in_motion() -> None:
    """A cart of 2 kg that a drive sets off at 1 m/s at once: m r (V cos phi + r phi') + I phi' = 0 of the bob on it."""
    m, r, inertia, angle = 0.5, 0.3, 0.1, 0.3
    builder = eomgen.SceneBuilder("cart").parameter("speed", 0.0, unit="m/s", tunable=True).body("cart", 2.0)
    builder.body("bob", m, center_of_mass=[0, 0, -r], inertia=[inertia, inertia, inertia])
    builder.joint("x", "prismatic", "base", "cart", axis=[1, 0, 0], drive="speed * t")
    builder.joint("swing", "revolute", "cart", "bob", axis=[0, 1, 0], initial={"position": angle})
    model = eomgen.build(builder.build(), profile="quick")
    blow = m * r * np.cos(angle) / (m * r * r + inertia)
    told = f"corrected onto the constraints: v.x 0 -> 1 m/s, v.swing 0 -> {blow:.4g} rad/s"
    for given, expected in (({}, [1.0, blow]), ({"x": {"velocity": 1.0}}, [1.0, 0.0])):
        stepped = model.start(given, {"speed": 1.0})
        run = model.simulate(0.01, 1e-3, initial=given, parameters={"speed": 1.0})
        for v, notes in ((stepped.v, stepped.notes), (run.v[0], run.metadata["corrections"])):
            assert v == pytest.approx(expected, rel=1e-9, abs=1e-12)
            assert told in notes if not given else not notes


def test_inputs_move_on_step_by_step_while_motions_follow_functions() -> None:
    """Four steps with an input from 1 to 3, and an event in the third that stops; the second target is of a number."""
    steps: list[Any] = []
    simulator: Any = SimpleNamespace(
        _present=lambda: np.array([7.0]),
        t=2.0,
        _stepper=SimpleNamespace(step_size=0.5),
        _inputs_of=lambda name, u: np.array(u),
        _take=lambda p: steps.append(("take", *p)),
        _motions=SimpleNamespace(reached={}),
        _found=(),
        _stopped="",
    )

    def go_on(p: np.ndarray, t: float, step: float, functions: Any) -> tuple[np.ndarray, dict[str, float]]:
        assert (p.tolist(), t, step, functions) == ([7.0], 2.0, 0.5, {"lift": abs})
        return np.array([len(steps) + 0.5]), {"lift": float(len(steps))}

    def step(u: Any, n: int, end: Any) -> None:
        steps.append((np.array(u).tolist(), n, None if end is None else end.tolist()))
        simulator._found = (f"event {len(steps) // 2}",)
        simulator._stopped = "hit" if len(steps) == 6 else ""

    simulator._motions.go_on, simulator._steps = go_on, step
    Simulator._go_on(simulator, [1.0], 4, [3.0], {"lift": abs})
    expected = [("take", 0.5), ([1.0], 1, [1.5]), ("take", 2.5), ([1.5], 1, [2.0]), ("take", 4.5), ([2.0], 1, [2.5])]
    assert steps == expected
    assert simulator._found == ("event 1", "event 2", "event 3") and simulator._motions.reached == {"lift": 2.0}
    steps.clear()
    Simulator._go_on(simulator, [1.0], 2, None, {"lift": abs})
    assert [taken for taken in steps if taken[0] != "take"] == [([1.0], 1, None)] * 2
    steps.clear()
    Simulator._go_on(simulator, [1.0], 5, np.array([2.0]), {})
    assert steps == [([1.0], 5, [2.0])]


def test_laws_are_looked_at_far_ahead_or_as_far_as_they_last(monkeypatch: pytest.MonkeyPatch) -> None:
    """Laws that last up to t = 10 s, in steps of 0.5 s from 2 s on."""
    ends: list[float] = []

    def check_span(run: Any, library: object) -> None:
        ends.append(run.grid.end)
        if run.grid.end > 10.0:
            raise eomgen.UsageError("law", "it ends at 10 s")

    monkeypatch.setattr(simulator_module, "check_span", check_span)
    monkeypatch.setattr(
        simulator_module, "replace", lambda item, **changed: SimpleNamespace(**{**vars(item), **changed})
    )
    simulator: Any = SimpleNamespace(
        _cleared=0,
        _ahead=8,
        _run=SimpleNamespace(parameters=1.0, signals=SimpleNamespace(given={})),
        t=2.0,
        _stepper=SimpleNamespace(step_size=0.5),
        _motions=SimpleNamespace(rough=False, at_rest=lambda p: p),
        _library=None,
        _events=(),
    )
    Simulator._look_ahead(simulator, 2, {})
    assert ends == [7.0] and (simulator._cleared, simulator._ahead) == (8, 32)
    Simulator._look_ahead(simulator, 3, {})
    assert ends == [7.0] and simulator._cleared == 5
    Simulator._look_ahead(simulator, 6, {})
    assert ends == [7.0, 21.0, 5.0] and (simulator._cleared, simulator._ahead) == (0, 128)
    with pytest.raises(eomgen.UsageError):
        Simulator._look_ahead(simulator, 17, {})
    simulator._motions.rough, simulator._ahead = True, 8
    ends.clear()
    Simulator._look_ahead(simulator, 16, {})
    assert ends == [10.0] and simulator._cleared == 0
    simulator._motions.rough, simulator._events = False, ("hit",)
    Simulator._look_ahead(simulator, 2, {})
    assert simulator._cleared == 0
