"""Rows of the programs that tests install, each on a few scenes of its own: the page has the full numbers."""

from __future__ import annotations

import pytest

from tests.peers import ROWS

#: Seeds that `make peers` does not use.
SEEDS = (1000, 1001, 1002)
INSTALLED = ("Pinocchio", "MuJoCo", "EXUDYN")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # EXUDYN renames settings with each version
@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if row.program in INSTALLED])
def test_a_row_on_other_scenes(name: str) -> None:
    row = ROWS[name]
    for seed in SEEDS:
        found = row.differences(seed)
        assert found and not row.above_limit({"differences": found}), f"seed {seed}: {found}"
        assert all(found[quantity] > row.accuracy for quantity in row.deviates)
