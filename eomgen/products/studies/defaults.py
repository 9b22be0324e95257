"""Defaults of studies, for calls and the command line.

Read by signatures of ``eomgen.studies`` and options of the command line, so that ``--help`` imports no study.
"""

from __future__ import annotations

#: States at which closed forms are checked, and the seed of their random numbers.
CHECK_STATES, CHECK_SEED = 8, 0
#: Timed runs of each variant, whose median counts.
SAVINGS_ROUNDS = 7
#: Seconds of computation without builds.
TRADEOFF_BUDGET, TUNE_BUDGET, EXTREMES_BUDGET = 120.0, 60.0, 300.0
#: How often configurations near the front are timed.
TRADEOFF_REPEATS = 20
#: Seconds for one cell of a map of extreme conditions.
EXTREMES_LIMIT = 20.0
#: Largest number of names in a message, and of listed items.
NAMED = 4
#: Whose error is looked at, and how over time.
OUTPUT, MEASURE = "state", "largest"
