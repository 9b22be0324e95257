"""Pictures and files of samples: what is drawn and written are the numbers of the samples."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import norm

from eomgen.base.arrays import Array
from eomgen.base.csv_tables import read_table
from eomgen.products.fields.commands import _print_samples
from eomgen.products.fields.sampling.result import FieldSamples, _chains, _power, _slices, draw
from eomgen.sampling import sample
from tests.sampling.files import changed


@cache
def made(*cells: int) -> FieldSamples:
    """Return samples of counts on a mesh with cells of 5 m; data of 1 in all cells are no picture."""
    mesh = {"cells": list(cells), "length": [5.0 * count for count in cells], "unit": "m"}
    energy = {"energy": "exp(e) - seen*counts*e", "where": {"e": "log(mean) + s - s_variance/2"}}
    data = {"counts": {"poisson": "mean*exp(s - s_variance/2)"}, "seen": 1.0}
    power = {"power": f"{300.0 * 5.0 ** (len(cells) - 3)}*exp(-(radius*k)**2)"}
    return sample(changed(mesh=mesh, cell=energy, data=data, parameters__mean=3.0, operators__s=power), samples=8)


def images(figure: Any) -> dict[str, Any]:
    """Return the image of each panel that is visible, by the title of the panel."""
    panels = [axes for axes in figure.axes if axes.get_visible() and axes.get_title("left")]
    return {axes.get_title("left"): axes.images[0] for axes in panels}


@pytest.mark.parametrize("cells", [(6, 4), (6, 4, 5)])
def test_slices_are_the_middle_plane_of_truth_data_mean_and_deviation(cells: tuple[int, ...]) -> None:
    result = made(*cells)
    truth, counts = result.problem.true_field(), result.problem.posterior.data["counts"]
    assert truth is not None
    plane: Any = (slice(None), slice(None), 2) if len(cells) == 3 else ...
    figure = _slices(result)
    drawn = images(figure)
    of_fields = np.quantile([truth[plane], result.samples.mean[plane]], (0.002, 0.998))
    expected: dict[str, tuple[Array, Any]] = {
        "s: truth": (truth, of_fields),
        "data: counts": (counts, (counts[plane].min(), np.quantile(counts[plane], 0.998))),
        "s: mean of samples": (result.samples.mean, of_fields),
        "s: deviation": (result.samples.deviation, (0.0, result.samples.deviation[plane].max())),
    }
    assert set(drawn) == set(expected)
    for title, (values, limits) in expected.items():
        np.testing.assert_array_equal(drawn[title].get_array(), values[plane].T)
        assert drawn[title].get_clim() == pytest.approx(limits), title
        assert tuple(drawn[title].get_extent()) == (0.0, 30.0, 0.0, 20.0) and drawn[title].origin == "lower"
    at = " at z = 12.5 m" if len(cells) == 3 else ""
    assert figure.get_suptitle() == f"small{at}, minimum_norm2, 2 x 8 samples"


def test_a_line_has_the_truth_and_the_mean_within_a_deviation() -> None:
    result = made(16)
    upper, lower = _slices(result).axes
    mean, truth = upper.get_lines()
    x = 5.0 * (np.arange(16) + 0.5)
    np.testing.assert_allclose(mean.get_xydata().T, [x, result.samples.mean], rtol=1e-15)
    np.testing.assert_array_equal(truth.get_ydata(), result.problem.true_field())
    band = upper.collections[0].get_paths()[0].vertices
    for place, middle, half in zip(x, result.samples.mean, result.samples.deviation, strict=True):
        ends = band[band[:, 0] == place][:, 1]
        assert (ends.min(), ends.max()) == pytest.approx((middle - half, middle + half))
    np.testing.assert_array_equal(lower.get_lines()[0].get_ydata(), result.problem.posterior.data["counts"])
    assert (upper.get_ylabel(), lower.get_ylabel(), lower.get_xlabel()) == ("s", "data: counts", "x, m")


def by_label(axes: Any) -> dict[str, Array]:
    return {line.get_label(): np.asarray(line.get_ydata()) for line in axes.get_lines()}


@pytest.mark.parametrize("known", [True, False])
def test_power_over_wave_numbers_is_that_of_the_scales(known: bool) -> None:
    result = made(6, 4)
    if not known:
        result = replace(result, problem=replace(result.problem, truth=None))
    scales = result.scales()
    column = {name: np.array([getattr(scale, name) for scale in scales]) for name in vars(scales[0])}
    left, middle, right, beside = _power(result).axes
    expected = {"samples, mean and deviation": "mean", "prior": "prior", "mean of samples": "of_mean"}
    expected |= {"truth": "truth"} if known else {}
    drawn = by_label(left)
    assert set(drawn) == set(expected)
    for label, name in expected.items():
        np.testing.assert_array_equal(drawn[label], column[name])
    np.testing.assert_array_equal(left.get_lines()[0].get_xdata(), column["k"])
    band = left.collections[0].get_paths()[0].vertices[:, 1]
    low = np.maximum(column["mean"] - column["deviation"], 1e-3 * column["mean"])
    assert (band.min(), band.max()) == pytest.approx((low.min(), (column["mean"] + column["deviation"]).max()))
    agreement = column["correlation"] if known else column["of_mean"] / column["mean"]
    np.testing.assert_array_equal(middle.get_lines()[0].get_ydata(), agreement)
    np.testing.assert_array_equal(right.get_lines()[0].get_ydata(), column["autocorrelation"])
    np.testing.assert_array_equal(beside.get_lines()[0].get_ydata(), column["r_hat"])


def test_chains_are_drawn_over_their_gradients() -> None:
    result = made(6, 4)
    left, middle, right = _chains(result).axes
    potentials = result.trajectories().reshape(2, -1, 7)
    for number in range(2):
        line, end = left.get_lines()[2 * number : 2 * number + 2]
        along = np.cumsum(potentials[number, :, 5])
        np.testing.assert_array_equal(line.get_xydata().T, [along, potentials[number, :, 6]])
        assert end.get_xdata()[0] == along[5]  # of six trajectories of warm-up
    assert sum(patch.get_height() * patch.get_width() for patch in middle.patches) == pytest.approx(1.0)
    (density,) = middle.get_lines()  # of variance twice the mean, as of long trajectories at stationarity
    errors = result.samples.energy_errors
    x, y = density.get_xydata().T
    np.testing.assert_allclose(y, norm(errors.mean(), np.sqrt(2.0 * errors.mean())).pdf(x), rtol=1e-12)
    assert (x.min(), x.max()) == (errors.min(), errors.max())
    r_hats = result.r_hats()
    assert sum(patch.get_height() for patch in right.patches) == np.isfinite(r_hats).sum()
    assert right.get_title("left").endswith(f"largest {np.nanmax(r_hats):.3f}")


@pytest.mark.parametrize(
    ("count", "warm_up", "files"),
    [(2, 0, ["slices", "power", "chains"]), (1, 0, ["chains"]), (0, 3, ["chains"]), (0, 0, [])],
)
def test_pictures_need_samples(
    count: int, warm_up: int, files: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("slices", "power", "chains"):
        monkeypatch.setattr(f"eomgen.products.fields.sampling.result._{name}", lambda result: None)
    monkeypatch.setattr("eomgen.products.fields.sampling.result.save_figure", lambda figure, path: path)
    result = SimpleNamespace(count=count, warm_up=np.zeros((2, warm_up, 4)))
    assert draw(cast(FieldSamples, result), tmp_path / "out") == [tmp_path / "out" / f"{name}.png" for name in files]


def test_files_have_the_samples_and_their_figures(tmp_path: Path) -> None:
    result = made(6, 4)
    files = result.save(tmp_path / "out")
    assert [file.name for file in files] == ["samples.npz", "trajectories.csv", "scales.csv", "summary.json"]
    with np.load(files[0]) as stored:
        for name in ("cells", "mean", "deviation", "potential", "accepted", "steps"):
            np.testing.assert_array_equal(stored[name], getattr(result.samples, name))
        np.testing.assert_array_equal(stored["truth"], result.problem.true_field())
        np.testing.assert_array_equal(stored["warm_up"], result.warm_up)
    names, rows = read_table(files[1])
    assert names == ["chain", "trajectory", "sample", "dH", "accepted", "gradients", "U"]
    np.testing.assert_array_equal(rows, result.trajectories())
    np.testing.assert_array_equal(rows[:, 0], np.repeat([0, 1], 14))
    np.testing.assert_array_equal(rows[:14, 1:3].T, [np.arange(14), [0] * 6 + [1] * 8])
    np.testing.assert_array_equal(rows[6:14, 6], result.samples.potential[0])
    names, rows = read_table(files[2])
    assert rows[:, names.index("k")].tolist() == [scale.k for scale in result.scales()]
    told = json.loads(files[3].read_text(encoding="utf-8"))
    assert told["acceptance"] == result.samples.acceptance and len(told["scales"]) == len(rows)
    each = [told[f"gradients_per_independent_sample_of_{name}"] for name in ("cells", "worst_scale")]
    np.testing.assert_array_equal(np.array(each, float), result.samples.gradients_per_sample)


def test_tables_of_samples_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    result = made(6, 4)
    _print_samples(result)
    figures, scales = capsys.readouterr().out.split("scales: power of a mode")
    told = " ".join(figures.split())
    assert f"acceptance {result.samples.acceptance:.9g}" in told and "cells 6, 4 lengths 30, 20 field s" in told
    rows = [line.split() for line in scales.splitlines() if line.strip()]
    assert rows[1:] == [
        ["-" if np.isnan(value) else f"{value:.4g}" for value in vars(scale).values()] for scale in result.scales()
    ]


def test_empty_results_have_no_scales_and_say_no_rest() -> None:
    nothing = SimpleNamespace(count=0, samples=SimpleNamespace(cells=np.empty((2, 0, 3))), problem=None)
    assert FieldSamples.scales(cast(FieldSamples, nothing)) == []
    cells = np.ones((3, 4, 2))
    cells[0, 2, 1], cells[1, 3, 0] = 1.0 + 4.0 * np.finfo(float).eps, 1.0 + 5.0 * np.finfo(float).eps
    still = SimpleNamespace(count=4, samples=SimpleNamespace(cells=cells))
    assert cast(Any, FieldSamples.rest).fget(still).startswith("; 2 of 3 chains did not move: watched cells change by")
    still.count = 1
    assert cast(Any, FieldSamples.rest).fget(still) == ""
    errors = SimpleNamespace(energy_errors=np.array([[0.1, np.inf], [np.nan, -0.3]]))
    lost = SimpleNamespace(warm_up=np.array([[[np.inf, 0, 1, 2]], [[0.2, 1, 1, 2]]]), samples=errors)
    assert cast(Any, FieldSamples.lost).fget(lost).startswith("; 3 of 6 trajectories ended at states whose energy is")
