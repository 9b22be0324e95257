"""Drawn distributions and covariances of random responses."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest
from scipy import stats

from eomgen.products.reliability.vibration import result as vibration
from eomgen.products.reliability.vibration.result import Distribution

matplotlib.use("Agg")
from matplotlib import pyplot


@pytest.fixture(autouse=True)
def closed_figures() -> Iterator[None]:
    yield
    pyplot.close("all")


def test_distributions_are_drawn_on_a_normal_scale_by_the_smaller_tail() -> None:
    y, order = np.array([6.0, 0.0, 2.0, 4.0]), [1, 2, 3, 0]
    place = np.array([9.0, -2.0, 0.1, 1.5])
    below, above = stats.norm.cdf(place), stats.norm.sf(place)
    counted = Distribution(below.copy(), above.copy(), stats.norm.cdf(place - 0.5), stats.norm.cdf(place + 0.25))
    counted.below[2] = counted.above[2] = np.nan
    result: Any = SimpleNamespace(
        thresholds=y, output="tip", unit="m", scene="mast", t=2.5,
        distributions={"monte_carlo": counted, "form": Distribution(below, above, np.zeros(0), np.zeros(0))},
    )  # fmt: skip
    (axis,) = vibration._distribution(result).axes
    form, samples = axis.lines
    assert form.get_xdata().tolist() == y[order].tolist()
    np.testing.assert_allclose(form.get_ydata(), place[order], rtol=1e-9)
    assert samples.get_xdata().tolist() == [0.0, 4.0, 6.0]
    assert (form.get_label(), samples.get_label()) == ("FORM", "Monte Carlo, 95 % confidence")
    (bars,) = axis.collections
    ends = [((0.0, -2.5), (0.0, -1.75)), ((2.0, -0.4), (2.0, 0.35)), ((4.0, 1.0), (4.0, 1.75))]
    np.testing.assert_allclose(bars.get_segments()[:3], ends, atol=1e-6)
    named = dict(zip([text.get_text() for text in axis.get_yticklabels()], axis.get_yticks(), strict=True))
    for text, share in (("0.01", 0.01), ("0.5", 0.5), ("0.99", 0.99), ("1 - 1e-3", 0.999), ("1 - 1e-5", 1 - 1e-5)):
        assert named[text] == pytest.approx(stats.norm.ppf(share), abs=1e-6)
    assert "1e-3" not in named and axis.get_xlabel() == "tip, m"
    assert axis.get_title() == "mast: tip at t = 2.5 s"
    assert vibration._percent(1e-3) == "0.001" and vibration._percent(1e-5) == "1e-5"


def test_covariances_are_drawn_in_the_order_of_times() -> None:
    result: Any = SimpleNamespace(
        times=np.array([2.0, 0.0, 1.0]), autocovariance={"hermite": np.array([1.0, 4.0, 3.0])},
        output="tip", unit="m", t=1.5,
    )  # fmt: skip
    (axis,) = vibration._covariance(result).axes
    assert axis.lines[0].get_xydata().tolist() == [[0.0, 4.0], [1.0, 3.0], [2.0, 1.0]]
    assert axis.lines[1].get_ydata() == [0.0, 0.0]
    assert axis.get_ylabel() == "covariance, (m)²" and axis.get_xlabel() == "time, s"
    assert axis.get_title() == "covariance of tip with its value at t = 1.5 s"
