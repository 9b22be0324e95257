"""Peers integrate the same beam: limits of fine meshes, and the table of times."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.beam_peers import error, limit, report, rows_of

pytestmark = pytest.mark.slow

PAIRS = ((8, 0.02), (16, 0.02))


@pytest.mark.long
def test_exudyn_has_the_same_beam() -> None:
    found = {program: rows_of(program, PAIRS, 1) for program in ("eomgen", "exudyn")}
    ours, others = (limit(rows) for rows in found.values())
    assert np.linalg.norm((ours - others).reshape(2, 3), axis=1).max() < 0.03
    coarse, fine = (error(row, others) for row in found["eomgen"])
    assert coarse > 3.5 * fine
    lines = report(found, [1.0, 1e-9]).splitlines()
    assert lines[2].split("|")[2].strip().startswith("8, 0.02, ") and lines[3].split("|")[2].strip() == "-"


@pytest.mark.long
def test_pyelastica_has_a_beam_that_keeps_its_volume() -> None:
    pytest.importorskip("elastica")
    (row,) = rows_of("pyelastica", [(32, 1e-3)], 1)
    ours = limit(rows_of("eomgen", PAIRS, 1))
    assert error(row, ours) < 0.1
