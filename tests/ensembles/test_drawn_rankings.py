"""Drawn rankings of varied parameters."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest

from eomgen.errors import Problem, UsageError
from eomgen.products.ensembles import ensemble

matplotlib.use("Agg")
from matplotlib import pyplot


@pytest.fixture(autouse=True)
def closed_figures() -> Iterator[None]:
    yield
    pyplot.close("all")


def sensitivity_of(kind: str, total: dict[str, float], intervals: bool, error: float) -> Any:
    first = {name: 0.5 * share for name, share in total.items()}
    bounds = {name: (share - 0.1, share + 0.2) for name, share in total.items()} if intervals else {}
    lower = {name: (share - 0.05, share + 0.02) for name, share in first.items()} if intervals else {}
    return SimpleNamespace(
        kind=kind, result=f"{kind} of tip", first=first, total=total if intervals else first,
        first_interval=lower, total_interval=bounds, error=error,
    )  # fmt: skip


def test_rankings_are_bars_with_intervals_and_the_largest_share_on_top() -> None:
    total = {"mass": 0.7, "length": 0.2, "damping": 0.05}
    columns = ("tip", "tilt", "none")
    rankings = {
        "tip.max": sensitivity_of("Sobol", total, True, 0.5),
        "tilt.max": sensitivity_of("Sobol", total, False, 0.0),
    }

    def sensitivity(result: str) -> Any:
        if result not in rankings:
            raise UsageError(Problem("sensitivity", "too few samples", ""))
        return rankings[result]

    run: Any = SimpleNamespace(columns=columns, varied=("mass", "length", "damping"), sensitivity=sensitivity)
    figure = ensemble._rankings(run)
    assert figure.get_size_inches().tolist() == pytest.approx([7.5, 0.5 + 2 * (0.35 * 3 + 0.9)])
    upper, lower = figure.axes
    assert upper.get_title("left") == "Sobol of tip, errors of steps up to 50 % of its deviation"
    assert lower.get_title("left") == "Sobol of tip"
    widths = [bar.get_width() for bar in upper.patches]
    assert widths == pytest.approx([0.05, 0.2, 0.7, 0.025, 0.1, 0.35])
    assert [bar.get_width() for bar in lower.patches] == pytest.approx([0.025, 0.1, 0.35])
    for axis in (upper, lower):
        assert [text.get_text() for text in axis.get_yticklabels()] == ["damping", "length", "mass"]
    segments = [[tuple(point) for point in line] for lines in upper.collections for line in lines.get_segments()]
    whole = [((share - 0.1, k + 0.12), (share + 0.2, k + 0.12)) for k, share in enumerate((0.05, 0.2, 0.7))]
    alone = [((share - 0.05, k - 0.12), (share + 0.02, k - 0.12)) for k, share in enumerate((0.025, 0.1, 0.35))]
    np.testing.assert_allclose(segments, [*whole, *alone], atol=1e-12)
    assert not lower.collections and lower.get_xlabel() == "share of the variance (Sobol)"
    assert [text.get_text() for text in upper.get_legend().get_texts()] == ["with interactions", "by itself"]
    assert ensemble._rankings(SimpleNamespace(columns=("none",), varied=("a",), sensitivity=sensitivity)) is None  # type: ignore[arg-type]
