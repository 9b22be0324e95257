"""The guard of steps of one factorization against growth that they cannot follow: rows of families that have it.

``newton/growth.c.jinja`` looks at the pivots (``newton.signs``); a step calls ``_note_growth`` behind a factorization,
with ``stop_at_growth`` in its workspace. If a method chooses its steps, such a step is tried again as a smaller one.
"""

from __future__ import annotations

from dataclasses import replace

from eomgen.integrators.families.family import SMALLER_STEP, Field, Setting, Status

STOP_AT_GROWTH = Setting(
    "stop_at_growth", 1, "0: growth that a step cannot follow is only counted; 1: it ends the run", (0, 1)
)
SHRINK_AT_GROWTH = Setting(
    "stop_at_growth", 1, "0: growth that a step cannot follow is only counted; 1: a smaller step is taken", (0, 1)
)
UNFOLLOWED_GROWTH = Field(
    "unfollowed_growth", "matrices with something that grows so fast that the step would damp it", kind="long"
)
GROWTH_STATUS = Status(
    10,
    "UNFOLLOWED_GROWTH",
    "something grows by itself so fast that a step would damp it, as behind a force that pushes away",
    f"{SMALLER_STEP}, or stop_at_growth = 0 if the growth does not matter",
)
#: The same if constraints border the matrix, since their rows may change a sign too.
GROWTH_OR_SINGULAR_STATUS = replace(
    GROWTH_STATUS,
    text="something grows by itself so fast that a step would damp it, or the constraints are singular within the step",
)
