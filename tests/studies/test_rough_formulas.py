"""Formulas that bend, jump, or have unbounded derivatives: remarked where they do, neither silently passed nor called
wrong."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.products.studies.verification.differences import LADDER
from eomgen.studies import FormReport, check

pytestmark = pytest.mark.slow


def swing(effort: str, position: float = 0.0, velocity: float = 0.0) -> eomgen.SceneBuilder:
    """Return a pendulum with a formula in its joint."""
    builder = eomgen.SceneBuilder("swing").body("bob", 2.0, center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.1])
    start = {"position": position, "velocity": velocity}
    builder.joint("pin", "revolute", "base", "bob", axis=[0, 1, 0], initial=start)
    return builder.effort("push", "pin", effort)


def checked(scene: eomgen.Scene, form: str = "partials.K", states: int = 6) -> FormReport:
    report = check(scene, states=states, only=["partials"], profile="quick")
    assert report.passed, [(item.name, str(item.worst)) for item in report.failures]
    return next(item for item in report.forms if item.name == form)


@pytest.mark.parametrize(
    ("effort", "form", "kind", "cause"),
    [
        ("-3 * abs(q.pin)", "partials.K", "not smooth", "abs"),
        ("-100 * max(0, q.pin)", "partials.K", "not smooth", "max"),
        ("-3 * sign(v.pin)", "partials.C", "not smooth", "sign"),
        # At rest with q.pin = 0 the force is zero, so the motion stays there.
        ("sqrt(q.pin)", "partials.K", "unbounded derivative", "sqrt"),
        ("sqrt(q.pin ** 2)", "partials.K", "unbounded derivative", "sqrt"),
        ("abs(q.pin) ** 0.3", "partials.K", "not smooth", "abs"),
    ],
)
def test_what_is_not_smooth_at_the_initial_state_is_remarked(effort: str, form: str, kind: str, cause: str) -> None:
    found = checked(swing(effort).build(), form)
    assert f"{kind} at initial state, t = 0.03 s, t = 0.06 s ({cause} in effort push)" in found.remarks
    assert found.verdict == "agrees" and found.complex_step is not None and found.complex_step < 1e-12
    assert found.agreement is not None and found.agreement < 1e-7


@pytest.mark.parametrize(
    "effort", ["-3 * abs(v.pin) * v.pin", "-abs(q.pin) ** 1.5", "-1e9 * q.pin", "sin(3000 * q.pin)"]
)
def test_what_is_smooth_enough_stiff_or_fast_is_not(effort: str) -> None:
    report = check(swing(effort, velocity=0.0).build(), states=6, only=["partials"], profile="quick")
    assert report.passed and report.remarks == () and report.notes == ()


def test_a_kink_beside_a_state_is_no_failure() -> None:
    """Steps smaller than the distance to the kink are taken; where there are none, the kink is remarked."""
    near = checked(swing("-100 * max(0, q.pin)", position=1e-7).build(), states=1)
    assert near.remarks == () and near.step is not None and near.step <= LADDER[14]
    nearer = checked(swing("-100 * max(0, q.pin)", position=1e-15).build(), states=1)
    assert nearer.remarks == ("not smooth at initial state (max in effort push)",)


def test_kinks_of_tables_are_named() -> None:
    builder = swing("10 * bend(q.pin)", position=0.1)
    builder.curve("bend", points=[[-1, 0], [0.1, 0], [1, 1]], interpolation="linear", outside="hold")
    found = checked(builder.build())
    assert any(remark.startswith("not smooth at initial state") and "curve bend" in remark for remark in found.remarks)


@pytest.mark.parametrize("error", [-20.0, 120.0])
def test_a_derivative_that_belongs_to_neither_side_of_a_kink_is_found(
    error: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Slopes of the sides are 0 and 100 beside the weight's: complex steps on both sides bound the closed form."""
    from eomgen.compiled.functions import Functions

    original = Functions.__call__

    def wrong(self: Functions, name: str, blocks: object) -> tuple[np.ndarray, ...]:
        values = original(self, name, blocks)  # type: ignore[arg-type]
        return (values[0] + error, *values[1:]) if name == "partials" else values

    monkeypatch.setattr(Functions, "__call__", wrong)
    report = check(swing("-100 * max(0, q.pin)").build(), states=1, only=["partials.K"], profile="quick")
    (form,) = report.failures
    assert form.worst is not None and form.worst.by == "complex step" and form.worst.state == "initial state"


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


def test_agreement_is_claimed_only_where_functions_are_defined() -> None:
    report = check(swing("-3 * abs(q.pin)").build(), states=2, only=["partials"], profile="quick")
    assert report.passed and report.summary == "all agree where defined" and report.corners == ("abs in effort push",)
