"""Results print as one short line, without arrays."""

from __future__ import annotations

import numpy as np

from eomgen.compiled.actuators import ActuatorEfforts
from eomgen.results.events import Events


def test_events_print_their_counts_and_times() -> None:
    rows = np.zeros((3, 1))
    times = np.array([0.25, 0.5, 1.5])
    events = Events(("bounce", "bounce", "stop"), times, *[rows] * 7, counts={"bounce": 2, "stop": 1})
    assert repr(events) == "<Events: 2 bounce, 1 stop from t = 0.25 to 1.5 s>"
    assert repr(Events((), np.zeros(0), *[np.zeros((0, 1))] * 7)) == "<Events: none>"


def test_efforts_of_actuators_print_by_name_and_whether_they_are_unique() -> None:
    none = np.zeros(0)
    one = ActuatorEfforts(("left", "right"), np.array([1.5, -2.0]), none, np.zeros((2, 0)))
    assert repr(one) == "<ActuatorEfforts: left 1.5, right -2; unique>"
    many = ActuatorEfforts(("left", "right"), np.zeros((4, 2)), np.zeros((4, 0)), np.ones((4, 2, 1)))
    assert repr(many) == "<ActuatorEfforts: left, right at 4 states; the least of many>"
