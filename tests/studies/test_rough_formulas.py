"""Checks of compiled models whose formulas bend or leave their domain: states that are left out, and summaries."""

from __future__ import annotations

import pytest

import eomgen
from eomgen.studies import check

pytestmark = pytest.mark.slow


def swing(effort: str) -> eomgen.SceneBuilder:
    """Return a pendulum with a formula in its joint."""
    builder = eomgen.SceneBuilder("swing").body("bob", 2.0, center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.1])
    builder.joint("pin", "revolute", "base", "bob", axis=[0, 1, 0])
    return builder.effort("push", "pin", effort)


def test_states_outside_of_a_formulas_domain_are_said_to_be_left_out() -> None:
    report = check(swing("log(q.pin)").build(), states=6, only=["partials"], profile="quick")
    assert report.passed and len(report.states) < 6 and "initial state" not in report.states
    assert any(
        note.startswith("left out: initial state, where the equations of motion are not finite")
        for note in report.notes
    )


def test_where_no_state_can_be_checked_nothing_has_passed() -> None:
    report = check(swing("log(q.pin - 100)").build(), states=3, only=["partials.K"], profile="quick")
    assert not report.passed and [form.verdict for form in report.failures] == ["no state"]


def test_corners_that_no_state_is_near_are_listed() -> None:
    report = check(
        swing("(2 if q.pin > 40 else 1) * min(q.pin, 50)").build(), states=2, only=["partials"], profile="quick"
    )
    assert report.remarks == () and report.summary == "all agree"
    assert sorted(report.corners) == ["comparison in effort push", "min in effort push", "select in effort push"]
    assert check(swing("-3 * q.pin").build(), states=1, only=["partials.K"], profile="quick").corners == ()
