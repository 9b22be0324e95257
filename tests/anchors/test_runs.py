"""Each run of another program on the page of verification: eomgen within the tolerance of its row, and the verdict."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.anchors import Anchor, anchors, measured_runs
from tests.anchors.page import verdict
from tests.anchors.runs import DISAGREEMENT, Difference, Run, runs
from tests.anchors.thirds.modelica_models import bevel_gear

Array = NDArray[np.float64]


def test_rows_from_outside_are_many_and_their_programs_are_told_apart() -> None:
    outside = [anchor for anchor in anchors().values() if anchor.kind != "equations"]
    assert len(runs()) + len(outside) >= 90
    assert len({run.program.name for run in runs().values()}) >= 10
    assert list(measured_runs()) == list(runs())


@pytest.mark.parametrize("run", runs().values(), ids=runs())
def test_a_program_that_is_off_is_told_by_a_third_solution(run: Run) -> None:
    difference = Difference(*measured_runs()[run.name])
    assert run.third or difference.between == difference.eomgen <= max(run.program.within, DISAGREEMENT), (
        "which of the two is off?"
    )
    assert difference.eomgen <= DISAGREEMENT or run.note, "why is eomgen off?"
    assert run.program.within <= 3e-3


def test_a_changed_reference_has_date_and_reason_on_the_page() -> None:
    rows: list[Run | Anchor] = [*runs().values(), *anchors().values()]
    assert [row.name for row in rows if row.changed and not re.match(r"\d{4}-\d\d-\d\d: \S", row.changed)] == []
    row = replace(runs()["iftomm_bricard"], changed="2026-11-30: misprint")
    assert verdict(row, Difference(0.0, 0.0, 0.0)).endswith("; reference changed 2026-11-30: misprint")


@pytest.mark.slow
@pytest.mark.parametrize("run", runs().values(), ids=runs())
def test_eomgen_meets_the_figures_within_the_tolerance_of_the_row(run: Run) -> None:
    own, program, _ = run.difference()
    kept = measured_runs()[run.name][1]
    assert own <= run.tolerance
    assert program <= 1.1 * kept + 1e-9, "the page has the largest difference over the whole file"


def _apart(carried: float) -> float:
    run = runs()["modelica_bevel_gear"]
    motion = bevel_gear(carried)(np.asarray(run.at))
    figures = {name: np.reshape(signal.digits, (len(run.at), -1)) for name, signal in run.signals.items()}
    return max(float(np.abs(figures[name] - motion[name]).max() / np.abs(figures[name]).max()) for name in figures)


def test_dymolas_bevel_gear_is_the_one_whose_rotors_do_not_turn_with_their_carrier() -> None:
    assert _apart(carried=0.0) < 2e-5
    assert _apart(carried=1.0) > 0.5
