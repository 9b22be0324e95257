"""Files of linear models number modes as tables on the screen do, from one on."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

from eomgen.linear.eigenvalue_loci import Campbell, Crossing
from eomgen.results.linear_files import described_campbell


def test_crossings_name_the_first_mode_one() -> None:
    crossings = (Crossing(1.0, 10.0, 10.0, 0, "forward"), Crossing(2.0, 7.0, 14.0, 3, ""))
    found = described_campbell(cast(Campbell, SimpleNamespace(crossings=crossings)))
    assert found == [
        {"order": 1.0, "speed": 10.0, "frequency": 10.0, "mode": 1, "whirl": "forward"},
        {"order": 2.0, "speed": 7.0, "frequency": 14.0, "mode": 4, "whirl": ""},
    ]
