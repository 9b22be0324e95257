"""Limits of laws and events between the steps of a run."""

from __future__ import annotations

from eomgen.base.limits import Limit

DEFECT = Limit(
    0.05, "1", "sum of defects of steps in parts of a velocity or a range", "a choice: half of a large error"
)
DEFECT_WITHIN = Limit(
    0.25, "1", "largest defect within a step in such parts", "a fourth of a velocity is half of the energy"
)
ALIASED = Limit(
    0.8, "1", "deviation of a law from its chords in standard deviations", "a sine with 2.2 steps to a period"
)
ALIASED_PART = Limit(0.5, "1", "part of the steps with such deviations", "a choice")
UNDERSTATED = Limit(
    3.0, "1", "effect of such a law in parts of the stated error", "errors are up to 1.5 times an estimate"
)
MISSED = Limit(1.5, "1", "number of events that are missed in pairs", "a pair has two")
MISSED_PART = Limit(0.05, "1", "the same in parts of all events if some steps are examined", "a choice")
