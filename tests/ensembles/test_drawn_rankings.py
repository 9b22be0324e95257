"""Drawn ensembles: fan charts over time, results against varied quantities, rankings."""

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


def drawn(columns: int, samples: int, varied: tuple[str, ...]) -> Any:
    """Return an ensemble whose column k has the quantile p = 10 k + t + p, the mean 10 k + t + 0.6, and whose results
    are k + the number of the sample."""
    names = tuple(f"output.y{k}" if k else "q.hinge" for k in range(columns))
    t, number = np.array([0.0, 1.0, 2.0]), np.arange(float(samples))

    def quantile(column: str, probability: Any) -> Any:
        return 10.0 * names.index(column) + t + np.asarray(probability)[..., np.newaxis] * np.ones(3)

    def envelope(column: str) -> Any:
        return quantile(column, -1.0), quantile(column, 2.0)

    return SimpleNamespace(
        columns=names, t=t, varied=varied, scene="swing", design="sobol", done=samples, failed=(1,) * 3,
        units={"q.hinge": "rad", "output.y1": "m", "v.hinge": "rad/s"},
        envelope=envelope, quantile=quantile, mean=lambda column: quantile(column, 0.6),
        values={name: 2.0 * number + k for k, name in enumerate(varied)},
        results={f"{name}.max": number + k for k, name in enumerate(names)},
    )  # fmt: skip


@pytest.mark.parametrize(("columns", "more"), [(2, ""), (14, "; 2 more columns in statistics.csv")])
def test_fans_are_bands_of_quantiles_around_the_median(columns: int, more: str) -> None:
    figure = ensemble._fans(drawn(columns, 20, ("mass",)))
    panels = figure.axes
    assert len(panels) == min(columns, 12)
    assert figure.get_size_inches().tolist() == pytest.approx([8.0, 0.6 + 2.6 * len(panels)])
    assert figure.get_suptitle() == f"swing: 17 samples, sobol{more}"
    for k, axis in enumerate(panels):
        ends = [
            (band.get_paths()[0].vertices[:, 1].min(), band.get_paths()[0].vertices[:, 1].max())
            for band in axis.collections
        ]
        expected = [(10 * k - 1, 10 * k + 4), (10 * k + 0.05, 10 * k + 2.95), (10 * k + 0.25, 10 * k + 2.75)]
        np.testing.assert_allclose(ends, expected)
        middle = [line.get_ydata() for line in axis.lines]
        np.testing.assert_allclose(middle, 10 * k + np.array([[0.5, 1.5, 2.5], [0.6, 1.6, 2.6]]))
    assert [axis.get_ylabel() for axis in panels[:2]] == ["q.hinge, rad", "y1, m"]
    assert panels[-1].get_xlabel() == "time, s" and not panels[0].get_xlabel()
    said = ["smallest to largest", "5 to 95 %", "25 to 75 %", "median", "mean"]
    assert sorted(text.get_text() for text in figure.legends[0].get_texts()) == sorted(said)


@pytest.mark.parametrize(("samples", "stride"), [(5000, 1), (5001, 2)])
def test_results_are_drawn_against_varied_quantities(samples: int, stride: int) -> None:
    figure = ensemble._scatter(drawn(8, samples, ("mass", "v.hinge")))
    grid = np.array(figure.axes).reshape(6, 2)
    assert figure.get_size_inches().tolist() == pytest.approx([0.8 + 2.9 * 2, 0.6 + 2.5 * 6])
    number = np.arange(0.0, samples, stride)
    for row, column in np.ndindex(6, 2):
        (line,) = grid[row, column].lines
        np.testing.assert_array_equal(line.get_xdata(), 2.0 * number + column)
        np.testing.assert_array_equal(line.get_ydata(), number + row)
    assert [axis.get_ylabel() for axis in grid[:2, 0]] == ["q.hinge.max, rad", "y1.max, m"]
    assert [axis.get_xlabel() for axis in grid[-1]] == ["mass", "v.hinge, rad/s"] and not grid[0, 0].get_xlabel()
    thinned = ", one sample of each 2" if stride > 1 else ""
    assert figure.get_suptitle() == f"swing: results against varied quantities{thinned}"
