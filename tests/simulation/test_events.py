"""Events of users: located to round-off, in the order of the method, with resets, impacts and modes, against closed
forms, SciPy's events and impulses written out by hand."""

from __future__ import annotations

import copy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import eomgen
from eomgen.base.arrays import Array
from eomgen.errors import DescriptionError, UsageError
from eomgen.pipeline.model import Model
from tests.models.library import scene, scene_file
from tests.simulation.rails import built, on_rail

G = 9.81
BALL, DOUBLE, CRANK = scene("bouncing_ball"), scene("double_pendulum"), scene("slider_crank")


FALL = np.sqrt(2.0 / G)


COUNTS = {"bounce": 6, "top": 6, "rises": 5, "end": 1}


BY_TOLERANCE: dict[str, Any] = {"method": "generalized_alpha", "tolerance": 1e-6}


def simulated(given: dict[str, Any], *times: float, **options: Any) -> Any:
    return eomgen.build(given, profile="quick").simulate(*times, **options)


def changed(scene: dict[str, Any], name: str, **sections: Any) -> dict[str, Any]:
    """Return a scene with other sections."""
    return {**copy.deepcopy(scene), "name": name, **sections}


@cache
def ball() -> Model:
    return eomgen.build(BALL, profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize(
    "method", ["rk4", "rk45", "taylor", "generalized_alpha", "rosenbrock", "corrected_predictor", "rattlie", "tdg3"]
)
def test_a_bouncing_ball_follows_its_closed_form(method: str) -> None:
    solution = ball().simulate(method=method)
    assert solution.success and solution.message.startswith("stopped by the event end at t = 3.05 s")
    assert solution.t[-1] == pytest.approx(3.05, abs=1e-15)
    assert solution.events is not None
    bounces, tops = solution.events["bounce"], solution.events["top"]
    times = FALL + 2.0 * FALL * np.append(0.0, np.cumsum(0.8 ** np.arange(1, len(bounces))))
    speeds = G * FALL * 0.8 ** np.arange(len(bounces) + 1)
    assert len(bounces) == 6 and len(tops) == 6
    np.testing.assert_allclose(bounces.t, times, rtol=1e-14)
    np.testing.assert_allclose(bounces.v_before[:, 0], -speeds[:-1], rtol=1e-14)
    np.testing.assert_allclose(bounces.v[:, 0], speeds[1:], rtol=1e-14)
    np.testing.assert_allclose(bounces.q, 0.0, atol=2e-15)
    np.testing.assert_allclose(tops.q[:, 0], 0.64 ** np.arange(1, 7), rtol=2e-14)
    assert dict(solution.events.counts) == COUNTS
    assert {record.name for record in solution.events} == {"bounce", "top", "end"}


@pytest.mark.slow
def test_a_ball_that_comes_to_rest_ends_the_run_and_names_event_and_time() -> None:
    solution = ball().simulate(5.0, parameters={"restitution": 0.3}, initial={"ball": 0.1})
    rest = np.sqrt(0.2 / G) * (1.0 + 2.0 * 0.3 / 0.7)
    assert not solution.success
    assert "the event bounce comes again and again at t = " in solution.message
    assert "try: an event that stops the run, or switches a mode, where the motion comes to rest" in solution.message
    assert solution.t[-1] == pytest.approx(rest, rel=1e-6)


@pytest.mark.slow_except("more0")
@pytest.mark.parametrize("more", [{"method": "rk4"}, {"method": "rk45"}, {"method": "taylor"}, BY_TOLERANCE])
def test_a_ball_on_the_ground_never_falls_through_it(more: dict[str, Any]) -> None:
    """It starts on the ground at rest or moving down, or an impact without restitution leaves it there."""
    for start, speed, restitution in ((0.0, 0.0, 0.8), (0.0, -1.0, 0.8), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)):
        state = {"ball": {"position": start, "velocity": speed}}
        solution = ball().simulate(1.0, 0.05, initial=state, parameters={"restitution": restitution}, **more)
        assert solution.events is not None and solution.q.min() > -1e-12
        assert solution.events.counts["bounce"] >= 1
        if speed:
            assert solution.events["bounce"].v[0] == pytest.approx(0.8, rel=1e-8)
        else:
            assert "the event bounce comes again and again at t = " in solution.message


@pytest.mark.slow_except("0.5-more0")
@pytest.mark.parametrize("more", [{"method": "rk45"}, BY_TOLERANCE])
@pytest.mark.parametrize("rows", [0.5, 4.0])
def test_methods_that_choose_their_steps_see_events_between_rows(more: dict[str, Any], rows: float) -> None:
    solution = ball().simulate(4.0, rows, **more)
    assert solution.events is not None and dict(solution.events.counts) == COUNTS
    times = FALL + 2.0 * FALL * np.append(0.0, np.cumsum(0.8 ** np.arange(1, 6)))
    np.testing.assert_allclose(solution.events["bounce"].t, times, rtol=1e-13)
    assert solution.stats["own_steps"] < 20 + 3.1 / rows


def test_more_events_than_are_kept_between_two_rows_end_the_run() -> None:
    solution = ball().simulate(8.0, 4.0, method="rk45", initial={"ball": 0.01}, parameters={"restitution": 0.97})
    assert not solution.success and solution.events is not None and len(solution.events) == 64
    assert ": more events lie between two rows than the 64 that are kept" in solution.message
    assert "try: a smaller step, which is the distance of rows here, or the action count" in solution.message


@pytest.mark.slow
def test_a_function_that_rests_on_its_root_is_seen_when_it_leaves_and_comes_back() -> None:
    model = built(on_rail("t * cos(4*t)").event("zero", "v.x"))

    def speed(t: float) -> float:
        return float(4.0 * t * np.sin(4.0 * t) + np.cos(4.0 * t) - 1.0) / 16.0

    roots = [brentq(speed, 0.4, 0.7), brentq(speed, 1.4, 1.7), brentq(speed, 2.2, 2.45), brentq(speed, 3.0, 3.2)]
    for more in ({"method": "rk4"}, {"method": "generalized_alpha"}, {"method": "rk45"}, BY_TOLERANCE):
        solution = model.simulate(3.5, 0.01, **more)
        assert solution.events is not None
        np.testing.assert_allclose(solution.events["zero"].t, roots, rtol=2e-3)


def test_a_run_goes_on_from_a_checkpoint_with_the_same_bits(tmp_path: Path) -> None:
    whole = ball().simulate(2.5)
    first = ball().simulate(1.37, checkpoint=tmp_path / "run.ckpt")
    both = first.followed_by(ball().resume(tmp_path / "run.ckpt", 2.5))
    np.testing.assert_array_equal(both.q, whole.q)
    assert both.events is not None and whole.events is not None
    np.testing.assert_array_equal(both.events.t, whole.events.t)
    assert both.events.counts == whole.events.counts


@pytest.mark.slow
def test_a_pendulum_at_a_wall_is_scipys() -> None:
    reset = {"when": "q.hinge + 0.4", "direction": "falling", "action": "reset", "reset": {"v.hinge": "-0.7*v.hinge"}}
    bob = {"mass": 1.0, "center_of_mass": [0, 0, -1.0]}
    start = {"position": 1.2}
    given = scene("pendulum", bodies__rod=bob, joints__hinge__initial=start, events={"wall": reset})
    solution = simulated(given, 8.0, 0.02, method="taylor")
    assert solution.events is not None

    def wall(t: float, y: Array) -> float:
        return float(y[0] + 0.4)

    wall.terminal, wall.direction = True, -1  # type: ignore[attr-defined]
    t, y, times = 0.0, np.array([1.2, 0.0]), []
    while t < 8.0:
        part = solve_ivp(
            lambda _, y: [y[1], -G * np.sin(y[0])], (t, 8.0), y, "DOP853", rtol=1e-13, atol=1e-13, events=wall
        )
        t, y = float(part.t[-1]), part.y[:, -1]
        if part.status == 1:
            times.append(t)
            y = np.array([y[0], -0.7 * y[1]])
    assert len(times) > 3
    np.testing.assert_allclose(solution.events.t, times, atol=2e-11)
    np.testing.assert_allclose([solution.q[-1, 0], solution.v[-1, 0]], y, atol=1e-10)


@pytest.mark.slow
def test_an_impact_of_a_double_pendulum_is_the_impulse_along_the_gradient() -> None:
    model = eomgen.build(DOUBLE, profile="quick")
    events = model.simulate().events
    assert events is not None and len(events) > 2
    for event in events:
        first, both = event.q[0], event.q.sum()
        height = -np.cos(first) - 0.8 * np.cos(both)
        g = np.array([np.sin(first) + 0.8 * np.sin(both), 0.8 * np.sin(both)])
        Mg = np.linalg.solve(model.mass(event.q), g)
        expected = event.v_before - 1.6 * (g @ event.v_before) / (g @ Mg) * Mg
        assert height == pytest.approx(-1.5, abs=1e-14)
        np.testing.assert_allclose(event.v, expected, rtol=1e-12)


def clutch() -> eomgen.SceneBuilder:
    """Return a cart with a mode."""
    return on_rail(name="bang_bang", position=1.0).mode("stiff", 1.0)


@cache
def switching() -> Model:
    """Return a cart whose spring is nine times as stiff on the right."""
    builder = (
        clutch().effort("spring", "x", "-(1 + 8*mode.stiff)*q.x").output("force", formula="-(1 + 8*mode.stiff)*q.x")
    )
    builder.event("soft", "q.x", direction="falling", action="switch", mode="stiff", to=0)
    return built(builder.event("hard", "q.x", direction="rising", action="switch", mode="stiff", to="1 - mode.stiff"))


def switched(t: float) -> float:
    """Return the position of the cart: half periods of pi/3 (q > 0) and pi (q < 0) in turn."""
    if t < np.pi / 6.0:
        return float(np.cos(3.0 * t))
    t = (t - np.pi / 6.0) % (np.pi + np.pi / 3.0)
    return float(-3.0 * np.sin(t) if t < np.pi else np.sin(3.0 * (t - np.pi)))


@pytest.mark.slow_except("rk4-4")
@pytest.mark.parametrize(("method", "order"), [("rk4", 4), ("generalized_alpha", 2)])
def test_a_method_keeps_its_order_through_switches(method: str, order: int) -> None:
    errors = []
    for step in (0.02, 0.01, 0.005):
        solution = switching().simulate(5.96, step, method=method)
        assert solution.events is not None and len(solution.events) == 3
        errors.append(abs(solution.q[-1, 0] - switched(5.96)))
        force = -(1.0 + 8.0 * (solution.q[:, 0] > 0.0)) * solution.q[:, 0]
        np.testing.assert_allclose(solution.outputs["force"], force, atol=1e-12)
    slopes = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(np.abs(slopes - order) < 0.3), errors


@pytest.mark.slow
def test_events_at_one_time_come_in_the_order_of_the_scene() -> None:
    builder = clutch().effort("spring", "x", "-(1 + 8*mode.stiff)*q.x")
    builder.event("twice", "t - 0.5", action="reset", reset={"v.x": "2*v.x"})
    builder.event("more", "t - 0.5", action="reset", reset={"v.x": "v.x + 1", "q.x": "v.x"})
    builder.event("off", "t - 0.5", action="switch", mode="stiff", to=-0.125)
    solution = built(builder).simulate(1.0, 0.02, method="rk4")
    assert solution.events is not None and solution.events.names == ("twice", "more", "off")
    first, second, third = solution.events
    np.testing.assert_allclose(first.v, 2.0 * first.v_before)
    np.testing.assert_array_equal(second.v_before, first.v)
    np.testing.assert_array_equal(second.q, first.v)
    np.testing.assert_allclose(second.v, first.v + 1.0)
    assert third.modes == [-0.125]
    np.testing.assert_allclose(solution.q[-1], second.q + 0.5 * second.v, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["generalized_alpha", "rk4_partitioned", "generalized_alpha_index3", "absolute"])
def test_an_impact_of_a_slider_crank_is_one_of_its_crank_alone(kind: str) -> None:
    """With one degree of freedom all velocities change sign and shrink by the restitution, whatever the masses."""
    if kind == "absolute":
        solution = simulated(changed(CRANK, "absolute_crank", coordinates="absolute"), 0.5)
    else:
        solution = simulated(CRANK, 0.5, method=kind)
        assert solution.events["block"].q[:, 2] == pytest.approx(0.78, abs=1e-15)
    assert solution.success and len(solution.events) >= 1
    bound = 1e-5 if "index3" in kind else 1e-12
    np.testing.assert_allclose(solution.events.v, -0.5 * solution.events.v_before, rtol=bound, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("reset", "text"),
    [
        ({"v.s": 0.4}, ""),
        ({"v.s": 0.4, "v.a": 1.0}, "the event kick: no impulse gives the velocities that an event asks for"),
        ({"q.s": 0.75}, "the event kick: the positions that an event sets break the constraints"),
        ({"v.a": "log(-q.s)"}, "the event kick: the action of an event gives values that are not finite"),
    ],
)
def test_resets_of_a_loop_hold_the_constraints_or_say_that_they_cannot(reset: dict[str, Any], text: str) -> None:
    kick = {"kick": {"when": "t - 0.3", "action": "reset", "reset": reset}}
    solution = simulated(changed(CRANK, "kicked_crank", events=kick), 0.4)
    assert solution.events is not None and solution.success == (not text)
    assert text in solution.message and (not text or "at t = 0.3 s, " in solution.message)
    assert len(solution.events) == (not text)
    for event in solution.events:
        assert event.v[2] == pytest.approx(0.4, rel=1e-15)
        np.testing.assert_allclose(event.v / event.v[2], event.v_before / event.v_before[2], rtol=1e-9)


@pytest.mark.slow
def test_events_of_an_orientation_are_on_the_group() -> None:
    turning = {"joints__root__initial": {"velocity": [0.0, -5.0, 0.0, 0, 0, 0]}, "bodies__hull__inertia": [0.1] * 3}
    tip = {"tip": {"body": "hull", "position": [1.0, 0, 0]}}
    given = scene("free_body", points=tip, events={"level": {"when": "position.tip[2] - 0.5"}}, **turning)
    model = eomgen.build(given, profile="quick")
    times = (np.array([1.0, 5.0, 13.0]) * np.pi / 6.0) / 5.0
    for method in ("rk4", "generalized_alpha"):
        events = model.simulate(1.5, 0.01, method=method).events
        assert events is not None
        np.testing.assert_allclose(events.t, times, atol=1e-13)


@pytest.mark.slow
def test_internal_states_are_reset_and_their_roots_found() -> None:
    """A saw-tooth: z' = 1 - z from 0, back to 0.2 of itself at 0.5."""
    builder = on_rail().state("charge", rate="1 - charge")
    model = built(builder.event("discharge", "charge - 0.5", action="reset", reset={"charge": "0.2*charge"}))
    times = np.log(2.0) + np.log(0.9 / 0.5) * np.arange(4)
    for method, tolerance in (("rk4", 1e-9), ("taylor", 1e-13), ("generalized_alpha", 1e-4)):
        found = model.simulate(2.5, 0.01, method=method).events
        assert found is not None
        np.testing.assert_allclose(found.t, times, atol=tolerance)
        np.testing.assert_allclose(found.z_before, 0.5, rtol=1e-13)
        np.testing.assert_allclose(found.z, 0.1, rtol=1e-13)


WRONG: dict[str, dict[str, Any]] = {
    "q.bal: there is no joint 'bal' (column 1); try: ball": {"when": "q.bal"},
    "the action reset needs the key reset": {"when": "q.ball", "action": "reset"},
    "the reset is empty": {"when": "q.ball", "action": "reset", "reset": {}},
    "a.ball cannot be used here": {"when": "q.ball", "action": "reset", "reset": {"a.ball": 0}},
    "'2*v.ball' is not a number of the state": {"when": "q.ball", "action": "reset", "reset": {"2*v.ball": 0}},
    "the action impact needs the key restitution": {"when": "q.ball", "action": "impact"},
    "restitution has no meaning for record; try: action = impact": {"when": "q.ball", "restitution": 1},
    "'gear'": {"when": "q.ball", "action": "switch", "mode": "gear", "to": 1},
    "the action switch needs the key mode": {"when": "q.ball", "action": "switch"},
    "mode.gear: the scene has no [modes] (column 1); try: [modes] and gear = 1": {"when": "mode.gear"},
    "-1 s is negative": {"when": "q.ball", "least_interval": -1.0},
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_with_an_event_is_said_with_its_place(text: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        eomgen.load(changed(BALL, "wrong", events={"bounce": WRONG[text]}))
    assert "events.bounce" in str(caught.value) and text in str(caught.value)


@pytest.mark.slow
def test_a_negative_restitution_is_refused_whatever_it_is_made_of() -> None:
    said = r"\(events\.bounce\.restitution\): the restitution is -0\.5 at restitution = -0\.5"
    with pytest.raises(UsageError, match=said):
        ball().simulate(parameters={"restitution": -0.5})
    events = {"bounce": {"when": "q.ball", "direction": "falling", "action": "impact", "restitution": "v.ball"}}
    run = simulated(changed(BALL, "by_speed", events=events))
    assert not run.success and run.q.min() > -1e-9
    assert run.message == (
        "at t = 0.451523641 s, the event bounce: the restitution of an impact is negative, and the motion would go on"
        " through the obstacle, after 45 of 400 steps; try: a formula of the restitution that gives 0 or more there"
    )


@pytest.mark.slow
def test_states_and_outputs_between_rows_follow_the_modes() -> None:
    solution = switching().simulate(3.0, 0.1, method="taylor")
    t = np.linspace(0.0, 3.0, 101)
    q = solution.at(t).q[:, 0]
    np.testing.assert_allclose(q, [switched(time) for time in t], atol=1e-12)
    stiffness = np.where((t < np.pi / 6.0), 9.0, 1.0)
    np.testing.assert_allclose(solution.outputs_at(t)["force"], -stiffness * q, atol=1e-12)


@pytest.mark.slow
def test_events_and_modes_of_an_included_file_have_its_names(tmp_path: Path) -> None:
    reset = {"q.slide": "q.slide + 1", " v.slide[0]": "-lag", "lag": 0}
    events = {
        "change": {"when": "q.slide - 1", "action": "switch", "mode": "gear", "to": "-mode.gear"},
        "back": {"when": "v.slide", "direction": "falling", "action": "reset", "reset": reset},
    }
    states, pull = {"lag": {"rate": "q.slide - lag"}}, {"pull": {"joint": "slide", "effort": "mode.gear"}}
    free = {"joints__slide__stiffness": None, "joints__slide__initial": None, "simulation": None, "outputs": None}
    scene_file(tmp_path, "oscillator", modes={"gear": 2}, states=states, efforts=pull, events=events, **free)
    include = "".join(f'{name} = {{ file = "oscillator.toml" }}\n' for name in "ab")
    (tmp_path / "two.toml").write_text(f'format = 1\nname = "two"\ngravity = [0, 0, 0]\n[include]\n{include}')
    given = eomgen.load(tmp_path / "two.toml")
    assert given.modes == ("a_gear", "b_gear")
    assert [event.name for event in given.events] == ["a_change", "a_back", "b_change", "b_back"]
    model = eomgen.build(given, profile="quick")
    assert model.parameters == {"mode_a_gear": 2.0, "mode_b_gear": 2.0}
    found = model.simulate(3.0, 1e-3, parameters={"mode_b_gear": 1.0}).events
    assert found is not None and found.mode_names == ("a_gear", "b_gear")
    first, second, back = found["a_change"], found["b_change"], found["a_back"]
    np.testing.assert_allclose([first.t[0], second.t[0]], [1.0, np.sqrt(2.0)], atol=1e-5)
    np.testing.assert_array_equal(second.modes[0], [-2.0, -1.0])
    np.testing.assert_allclose(back.q[0, 0], back.q_before[0, 0] + 1.0)
    np.testing.assert_allclose(back.v[0, 0], -back.z_before[0, 0])
    assert back.z[0, 0] == 0.0
