"""Sampled states as data for the templates: their clocks, and which state follows which."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from eomgen.system.samples import SampleRow

#: How far a sample may be moved onto a point of the time grid, as a part of the shortest period.
CLOSEST = 1e-5


def sample_data(rows: Sequence[SampleRow]) -> dict[str, Any]:
    """Return the sampled states as JSON types: ``clocks``, each a period and its first time in s, and ``rows``."""
    clocks = list(dict.fromkeys((row.period, row.offset) for row in rows))
    return {
        "clocks": [list(clock) for clock in clocks],
        "rows": [asdict(row) | {"clock": clocks.index((row.period, row.offset))} for row in rows],
        "closest": CLOSEST * min(row.period for row in rows),
    }
