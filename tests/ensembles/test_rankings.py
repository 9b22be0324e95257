"""Rankings of varied quantities against indices in closed form, from results by formulas: no model is compiled."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.products.ensembles import read_distribution
from eomgen.products.ensembles.designs import random_design
from eomgen.products.ensembles.statistics import ranking

ANGLE = read_distribution("vary x", f"uniform({-np.pi!r}, {np.pi!r})")
A, B = 7.0, 0.1
#: Parts of the variance of sin x + A sin^2 y + B z^4 sin x (Ishigami and Homma 1990), of angles from -pi to pi.
PARTS = {
    "x": 0.5 * (1.0 + B * np.pi**4 / 5.0) ** 2,
    "y": A**2 / 8.0,
    "xz": B**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0),
}
WHOLE = sum(PARTS.values())
FIRST = {"x": PARTS["x"] / WHOLE, "y": PARTS["y"] / WHOLE, "z": 0.0}
TOTAL = {"x": (PARTS["x"] + PARTS["xz"]) / WHOLE, "y": PARTS["y"] / WHOLE, "z": PARTS["xz"] / WHOLE}


def ishigami(x: Array, y: Array, z: Array) -> Array:
    return np.asarray(np.sin(x) + A * np.sin(y) ** 2 + B * z**4 * np.sin(x))


def test_sobol_indices_of_the_function_of_ishigami() -> None:
    design = random_design("saltelli", [ANGLE] * 3, 2000, seed=1)  # no power of two
    values = dict(zip("xyz", design.values(0, design.samples).T, strict=True))
    found = ranking("saltelli", design.samples, values, "f.max", 1e3 + ishigami(**values))
    assert (found.kind, found.result, list(found.total)) == ("Sobol' indices", "f.max", ["x", "y", "z"])
    assert list(found.first) == list(found.first_interval) == list(found.total_interval) == ["x", "y", "z"]
    widths = []
    for shares, exact, bounds in (
        (found.first, FIRST, found.first_interval),
        (found.total, TOTAL, found.total_interval),
    ):
        for name in "xyz":
            assert shares[name] == pytest.approx(exact[name], abs=0.03)
            low, high = bounds[name]
            assert low < shares[name] < high and low - 0.01 < exact[name] < high + 0.01
            widths.append(high - low)
    assert min(widths) > 0.01 and max(widths) < 0.2
    assert found.explained == pytest.approx(sum(FIRST.values()), abs=0.05)


@pytest.mark.parametrize(("results", "share"), [(np.arange(9.0), 1.0), (np.ones(9), 0.0)])
def test_a_single_quantity_has_all_of_the_variance_that_there_is(results: Array, share: float) -> None:
    found = ranking("saltelli", 9, {"x": results}, "f", results)
    assert found.first == found.total == {"x": share} and found.first_interval == {}


def test_ranks_of_independent_quantities_have_squared_coefficients_as_shares() -> None:
    """Of monotonic functions of ranks the shares are those of a sum of uniform numbers: squares of the weights."""
    design = random_design("sobol", [read_distribution("vary x", "uniform(0, 1)")] * 2, 1024, seed=3)
    x, y = design.values(0, 1024).T
    results = np.exp(5.0 * (3.0 * x - y))
    values = {"y": y, "fixed": np.full(1024, 2.0), "x": x}
    found = ranking("sobol", 1024, values, "f", results)
    assert list(found.first) == ["x", "y", "fixed"] and found.total is found.first
    assert found.kind == "squared rank regression" and found.first["fixed"] == 0.0
    assert found.first["x"] == pytest.approx(0.9, abs=0.03) and found.first["y"] == pytest.approx(0.1, abs=0.03)
    failed = np.where(np.arange(1024) % 3 == 0, np.nan, results)
    assert ranking("sobol", 1024, values, "f", failed).first["x"] == pytest.approx(0.9, abs=0.04)
    assert set(ranking("sobol", 1024, values, "f", np.ones(1024)).first.values()) == {0.0}
