"""Events that are asked too much: what a run says of them, and what its error estimate does."""

from __future__ import annotations

import math
from typing import Any

import pytest
from scipy.integrate import solve_ivp

import eomgen
from tests.models.library import scene

pytestmark = pytest.mark.slow

G = 9.81


def falling(events: dict[str, Any], start: dict[str, float] | None = None, **sections: Any) -> eomgen.Model:
    """Return a mass of 1 kg that falls from 1 m, or from another state."""
    initial = start or {"position": 1.0}
    given = scene("bouncing_ball", joints__ball__initial=initial, events=events, simulation=None, **sections)
    return eomgen.build(given, profile="quick")


def test_nothing_comes_behind_an_event_that_ends_the_run() -> None:
    ground = {"when": "q.ball", "direction": "falling", "action": "stop"}
    bounce = {"when": "q.ball", "action": "impact", "restitution": 0.5}
    run = falling({"ground": ground, "bounce": bounce}).simulate(1.0, 0.01, method="rk4")
    assert run.message.startswith("stopped by the event ground at t = 0.451523641 s")
    assert run.events is not None and run.events.counts == {"ground": 1, "bounce": 0}
    assert run.v[-1, 0] == pytest.approx(-math.sqrt(2.0 * G), rel=1e-12)
    run = falling({"bounce": bounce, "ground": ground}).simulate(1.0, 0.01, method="rk4")
    assert run.message.startswith("stopped by the event ground") and run.v[-1, 0] > 0.0


@pytest.mark.parametrize("method", ["rk4", "rk45", "taylor", "generalized_alpha"])
def test_roots_that_steps_pass_over_are_told_of(method: str) -> None:
    model = falling({"wave": {"when": "sin(10000 * t)", "action": "count"}, "half": {"when": "q.ball - 0.5"}})
    run = model.simulate(1.0, 0.01, method=method)
    assert run.success and run.events is not None
    other = run.events.counts["wave"]
    assert other < 3183  # a root each pi / 10000 s
    assert f"the event wave comes {other} times, and about " in run.message
    (missed,) = (one for one in run.findings if one.name == "missed_event")
    assert missed.value == pytest.approx(3183 - other, rel=0.05)
    assert "; try: a step smaller than 0.01 s, in each of which events are looked for" in run.message
    assert "wave" in run.error.passed_over
    fine = model.simulate(1.0, 1e-4, method=method)
    assert not fine.error.passed_over and fine.events is not None and fine.events.counts["wave"] == 3183


@pytest.mark.parametrize(
    ("method", "direction", "share", "action"),
    [
        ("rk4", "both", 1.0, "count"),
        ("generalized_alpha", "rising", 0.5, "record"),
        ("taylor", "both", 1.0, "record"),
    ],
)
def test_pairs_that_all_runs_pass_over_are_told_of(method: str, direction: str, share: float, action: str) -> None:
    """Marks at 5 mm under a mass at 1 m/s: whole periods to each step, so that runs at other steps see none either."""
    wave = {"when": "sin(pi * (q.ball - 0.0012) / 0.005)", "action": action, "direction": direction}
    model = falling({"wave": wave}, {"position": 0.0, "velocity": 1.0}, gravity=[0, 0, 0])
    run = model.simulate(1.0, 0.01, method=method)
    assert run.success and run.events is not None
    lost = 200.0 * share - run.events.counts["wave"]
    assert lost > 90.0
    (missed,) = (one for one in run.findings if one.name == "missed_event")
    assert missed.value == pytest.approx(lost, abs=2.0)
    assert f"about {missed.value:.0f} more lie in pairs within single steps" in run.message
    fine = model.simulate(1.0, 1e-3, method=method)
    assert not [one for one in fine.findings if one.name == "missed_event"]
    assert fine.events is not None and fine.events.counts["wave"] == pytest.approx(200.0 * share, abs=1.0)


SEEN: dict[str, dict[str, Any]] = {
    "passive": {
        "touched": {"when": "(q.ball - 0.5)**2", "action": "count"},
        "same": {"when": "v.ball - v.ball * 1.0000001", "action": "count"},
        "once": {"when": "q.ball - 0.5", "action": "record"},
        "slow": {"when": "sin(40 * t)", "action": "count"},
    },
    "acting": {"bounce": {"when": "q.ball", "action": "impact", "restitution": 0.5, "direction": "falling"}},
}


@pytest.mark.parametrize(("name", "method"), [("passive", "rk4"), ("acting", "rk45")])
def test_events_that_steps_see_are_not_told_of(name: str, method: str) -> None:
    run = falling(SEEN[name]).simulate(0.9, 0.01, method=method)
    assert not [one for one in run.findings if one.name == "missed_event"]


def test_a_stiffness_that_an_event_switches_on_is_told_of() -> None:
    """What swings behind an event follows from the mode that the event has set, and not from that of the start."""
    model = falling(
        {"grip": {"when": "q.ball - 0.5", "action": "switch", "mode": "gripped", "to": 1e9}},
        modes={"gripped": 0},
        efforts={"grip": {"joint": "ball", "effort": "-mode.gripped * q.ball"}},
    )
    run = model.simulate(1.0, 0.01, method="generalized_alpha")
    assert f"the event grip at t = {math.sqrt(1.0 / G):.6g} s excites a motion of v.ball at 5.03e+03 Hz" in run.message


def test_an_impact_that_the_run_starts_behind_or_on_is_told_of() -> None:
    floor = {"when": "q.ball", "direction": "falling", "action": "impact", "restitution": 0.5}
    above = falling({"floor": {**floor, "direction": "rising"}}).simulate(0.2, 0.01, method="rk4")
    assert "met from the side where its formula is below zero: at the start it is 1;" in above.message
    either = falling({"floor": {**floor, "direction": "both"}}, {"position": 0.0}).simulate(0.2, 0.01, method="rk4")
    assert "the run starts at rest on the impact floor, which has no side" in either.message
    free = falling({"floor": floor}).simulate(0.2, 0.01, method="rk4")
    assert "impact" not in free.message


@pytest.mark.parametrize("more", [{}, {"tolerance": 1e-3}, {"method": "rk45"}, {"step": 0.02}])
def test_an_event_that_ends_both_runs_is_in_both(more: dict[str, Any]) -> None:
    """A pendulum: when it is there, DOP853 says; runs at other steps end a little earlier or later."""
    bob, start = {"mass": 1, "center_of_mass": [0, 0, -1]}, {"position": 1.0}
    down = {"when": "q.hinge + 0.9", "direction": "falling", "action": "stop"}
    events = {"half": {"when": "q.hinge", "direction": "falling"}, "down": down}
    given = scene("pendulum", bodies__rod=bob, joints__hinge__initial=start, events=events, outputs=None)
    run = eomgen.build(given, profile="quick").simulate(3.0, **{"step": 0.01, **more})

    def there(_: float, state: Any) -> float:
        return float(state[0] + 0.9)

    there.terminal = True  # type: ignore[attr-defined]  # as SciPy asks for it
    span, start_of = (0.0, 3.0), [1.0, 0.0]
    swing = solve_ivp(lambda _, x: [x[1], -G * math.sin(x[0])], span, start_of, "DOP853", events=there, rtol=1e-11)
    assert run.events is not None and run.events.counts == {"half": 1, "down": 1}
    assert run.events["down"].t[0] == pytest.approx(swing.t_events[0][0], abs=2e-3)
    assert run.error.available and run.error.passed_over == "" and "comes" not in run.message
