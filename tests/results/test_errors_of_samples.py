"""Estimated errors of samples: the worst one, with its run, in words and as JSON."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from eomgen.results.error_estimate import ErrorEstimate, LargestError, SampleErrors


def estimate(share: float, output: float | None = None, order: float = 2.0) -> ErrorEstimate:
    of_output = None if output is None else LargestError("force", 3.0, "N", 0.5, output)
    return ErrorEstimate(
        available=True, t=np.array([0.0, 1.0]), relative_at=np.array([0.0, share]), relative=share, order=order,
        declared_order=2.0, largest=LargestError("q.hinge", 0.1, "rad", 1.0, share), largest_output=of_output,
    )  # fmt: skip  # two lines


NOTHING = SampleErrors(ErrorEstimate.missing("the runs failed"), step=0.01)


def test_without_estimates_errors_are_not_known() -> None:
    assert not NOTHING.available and math.isnan(NOTHING.relative) and NOTHING.worst is None
    assert str(NOTHING) == "the discretisation error of samples is not known: the runs failed"
    summary = NOTHING.summary()
    assert (summary["available"], summary["reason"], summary["relative"], summary["largest"]) == (
        False, "the runs failed", None, None,
    )  # fmt: skip  # one table
    assert not replace(NOTHING, of_samples={3: ErrorEstimate.missing("no")}).available
    assert replace(NOTHING, of_samples={3: estimate(0.1)}).available


SHARES = ("(the run without variations)", "(sample 7, the worst of 2 runs with estimates)")


SMALLER = "; try: a step smaller than 0.005 s"


@pytest.mark.parametrize(
    ("nominal", "of_samples", "worst", "text"),
    [
        (estimate(0.03), {}, None, SHARES[0]),  # small enough to be told without a remedy
        (estimate(0.04), {}, None, f"{SHARES[0]}{SMALLER}"),
        (estimate(0.02), {7: estimate(0.04)}, 7, f"{SHARES[1]}{SMALLER}"),
        # half: of an output
        (estimate(0.01), {7: estimate(0.009, 0.5), 8: ErrorEstimate.missing("it")}, 7, f"{SHARES[1]}{SMALLER}"),
    ],
)
def test_the_worst_run_is_named_with_a_step_that_makes_its_error_a_hundredth(
    nominal: ErrorEstimate, of_samples: dict[int, ErrorEstimate], worst: int | None, text: str
) -> None:
    columns = {"q.hinge": 0.1, "force": math.nan}
    errors = SampleErrors(nominal, of_samples, columns, step=0.01, seconds=2.0)
    assert errors.worst is not None and errors.worst[0] == worst
    assert errors.relative == errors.worst[1].share
    assert str(errors) == f"the estimated error of samples is {errors.worst[1]} {text}"
    summary = json.loads(json.dumps(errors.summary()))
    assert summary["available"] and summary["reason"] == "" and summary["seconds"] == 2.0
    assert (summary["worst_sample"], summary["relative"]) == (worst, errors.relative)
    assert summary["columns"] == {"q.hinge": 0.1, "force": None}
    assert summary["largest"]["name"] == errors.worst[1].name
    for estimate_of in (errors.summary(), nominal.described()):
        estimate_of["largest"]["name"] = "another"
    assert "another" not in str(errors), "a caller changes a dictionary of his own"
    assert set(summary["samples"]) == {str(number) for number in of_samples}
    assert summary["without_variations"]["relative"] == nominal.relative


@pytest.mark.parametrize(
    ("order", "share", "factor"),
    [(2.0, 0.04, 0.5), (4.0, 0.04, 0.5), (0.2, 0.04, 0.25), (2.0, 0.005, 1.0), (math.nan, 0.16, 0.25), (2.0, 0.0, 1.0)],
)
def test_refinements_follow_the_observed_order_up_to_the_declared_one(
    order: float, share: float, factor: float
) -> None:
    assert estimate(share, order=order).refinement(0.01) == pytest.approx(factor)


def test_errors_without_an_order_are_told_from_noticeable_ones() -> None:
    assert not estimate(0.2).unordered
    assert not estimate(0.2, order=0.5).unordered and estimate(0.2, order=0.49).unordered
    assert not estimate(0.03, order=0.1).unordered and estimate(0.031, order=0.1).unordered
    assert estimate(0.01, 0.031, order=0.1).unordered
    assert not replace(estimate(0.2, order=0.1), declared_order=math.nan).unordered
    assert not replace(estimate(0.2, order=0.1), available=False).unordered


def test_times_above_a_share_begin_with_the_first() -> None:
    grows = replace(estimate(0.2), t=np.array([0.0, 1.0, 2.0]), relative_at=np.array([0.0, 0.1, 0.2]))
    assert [grows.above(part) for part in (0.05, 0.1, 0.2)] == [1.0, 2.0, math.inf]
