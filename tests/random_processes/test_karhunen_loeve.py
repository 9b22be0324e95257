"""Modes of processes: closed forms, mpmath, orthonormality, Mercer's sum, and what is refused."""

from __future__ import annotations

import re
from dataclasses import dataclass

import mpmath
import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.errors import UsageError
from eomgen.formula.curves import Curve
from eomgen.products.reliability.random_processes import karhunen_loeve
from eomgen.products.reliability.random_processes.covariance import (
    Constant,
    Covariance,
    CovarianceTable,
    DampedCosine,
    RoadProfile,
    SquaredExponential,
    exponential,
    kanai_tajimi,
    oscillator,
)
from eomgen.products.reliability.random_processes.karhunen_loeve import MOST_MODES, expand

UNIT = SquaredExponential(1.0, 1.0)


@dataclass(frozen=True)
class _Unnamed:
    """A covariance that nobody knows a closed form of."""

    of: Covariance

    @property
    def smooth(self) -> bool:
        return self.of.smooth

    def at(self, lag: Array) -> Array:
        return self.of.at(lag)

    def density(self, frequency: Array) -> Array:
        return self.of.density(frequency)


@pytest.mark.parametrize(
    ("covariance", "counts"),
    [
        (UNIT, {0.95: 10, 0.99: 14, 0.999: 17, 0.9999: 21, 0.999999: 26}),
        (oscillator(1.0, np.hypot(0.2, 1.2), 0.2 / np.hypot(0.2, 1.2)), {0.95: 9, 0.99: 14, 0.999: 26, 0.9999: 53}),
    ],
)
def test_as_many_modes_as_a_share_asks_for(covariance: Covariance, counts: dict[float, int]) -> None:
    for share, count in counts.items():
        found = expand(covariance, 15.0, share=share)
        assert len(found.eigenvalues) == count
        assert found.variance_shares[-1] >= share > found.variance_shares[-2]


def test_the_closed_form_of_the_exponential_meets_its_equations() -> None:
    found = expand(exponential(1.0, 1.0), 15.0, modes=100)
    np.testing.assert_allclose(found.eigenvalues[:3], [1.93378538, 1.75749908, 1.52223483], rtol=0, atol=5e-9)
    np.testing.assert_allclose(found.variance_shares[[9, 29, 99]], [0.7087, 0.8981, 0.9695], rtol=0, atol=5e-5)
    with mpmath.workdps(30):  # c = w tan(w a) of the even ones, w = -c tan(w a) of the odd ones
        for k in (0, 1, 6, 7, 98, 99):
            start = mpmath.mpf(k) * mpmath.pi / 15
            if k % 2 == 0:
                equation = lambda w: mpmath.cos(7.5 * w) - w * mpmath.sin(7.5 * w)  # noqa: E731
            else:
                equation = lambda w: w * mpmath.cos(7.5 * w) + mpmath.sin(7.5 * w)  # noqa: E731
            w = mpmath.findroot(equation, (start + mpmath.mpf("1e-9"), start + mpmath.pi / 15), solver="anderson")
            assert found.eigenvalues[k] == pytest.approx(float(2 / (w**2 + 1)), rel=2e-14)


def test_nystrom_across_the_kink_has_the_digits_of_the_closed_form() -> None:
    covariance = exponential(1.3, 0.7)
    exact, found = expand(covariance, 12.0, modes=60), expand(_Unnamed(covariance), 12.0, modes=60)
    np.testing.assert_allclose(found.eigenvalues, exact.eigenvalues, rtol=1e-12)
    times = np.linspace(0.0, 12.0, 500)
    np.testing.assert_allclose(found.modes(times), exact.modes(times), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "covariance",
    [UNIT, DampedCosine(1.2, 0.5, 3.0), kanai_tajimi(0.8, 6.0, 0.5), exponential(1.0, 2.0), RoadProfile("C")],
    ids=lambda item: type(item).__name__,
)
def test_modes_are_orthonormal_and_sum_up_to_the_covariance(covariance: Covariance) -> None:
    duration = 10.0
    found = expand(covariance, duration, modes=24)
    node, weight = np.polynomial.legendre.leggauss(400)
    times, weights = 0.5 * duration * (1.0 + node), 0.5 * duration * weight
    shape = found.function(times)
    np.testing.assert_allclose(shape * weights @ shape.T, np.eye(24), rtol=0, atol=1e-9)
    assert np.all(np.diff(found.eigenvalues) <= 0.0)
    assert np.all(shape[:, 0] > 0.0)  # the sign is the same on every machine
    apart = covariance.at(times[:, np.newaxis] - times)
    np.testing.assert_allclose(found.eigenvalues.sum(), found.variance_shares[-1] * found.total, rtol=1e-14)
    # what is left of the covariance has the trace of the eigenvalues that are left out
    left = apart - found.modes(times).T @ found.modes(times)
    assert weights @ np.diag(left) == pytest.approx(
        (1.0 - found.variance_shares[-1]) * found.total, abs=1e-9 * found.total
    )
    # each is an eigenfunction, but for the error of plain quadrature at the kink
    error = (apart * weights) @ shape.T - found.eigenvalues * shape.T
    assert np.max(np.abs(error)) < (1e-9 if covariance.smooth else 2e-3) * found.eigenvalues[0]


@pytest.fixture
def few_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search for modes ends at 256 nodes of the window in place of 4096."""
    monkeypatch.setattr(karhunen_loeve, "_MOST_NODES", 256)


@pytest.mark.slow
@pytest.mark.usefixtures("few_nodes")
def test_a_table_is_what_it_was_sampled_from_and_a_box_is_none() -> None:
    lags = np.linspace(0.0, 5.0, 51)
    exact = expand(exponential(1.0, 2.0), 4.0, modes=8)
    table = expand(CovarianceTable(Curve("", lags, np.exp(-lags / 2.0))), 4.0, modes=8)
    np.testing.assert_allclose(table.eigenvalues, exact.eigenvalues, rtol=0, atol=1e-6 * exact.eigenvalues[0])
    box = CovarianceTable(Curve("", lags, 1.0 / (1.0 + (lags / 1.2) ** 16)))
    with pytest.raises(UsageError, match=r"the covariance is not positive: an eigenvalue of it in the window is"):
        expand(box, 4.0, share=0.9)


def test_a_covariance_that_is_not_positive_is_refused_or_its_positive_part_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Eigenvalues by the trapezoidal rule on a fine grid of the window."""
    monkeypatch.setattr(karhunen_loeve, "_MOST_NODES", 512)
    bad = CovarianceTable(Curve("", np.array([0.0, 0.5, 1.0, 2.0]), np.array([1.0, -0.9, 0.95, 0.0])))
    t = np.linspace(0.0, 3.0, 901)
    weights = np.where((t == 0.0) | (t == 3.0), 0.5, 1.0) * t[1]
    root = np.sqrt(weights)
    values = np.linalg.eigvalsh(root[:, np.newaxis] * bad.at(t[:, np.newaxis] - t) * root)
    negative = np.linalg.norm(values[values < 0.0]) / np.linalg.norm(values)
    with pytest.raises(UsageError) as caught:
        expand(bad, 3.0, share=0.9)
    fault = caught.value.problems[0].what
    part, removed = re.findall(r"is (-[\d.]+) times the largest; .* by ([\d.]+) of its norm", fault)[0]
    assert float(part) == pytest.approx(values[0] / values[-1], rel=0.02)
    assert float(removed) == pytest.approx(negative, rel=0.03)
    found = expand(bad, 3.0, share=0.9, repair=True)
    assert found.repaired == pytest.approx(negative, rel=0.02)
    assert found.total == pytest.approx(values[values > 0.0].sum(), rel=0.02)
    np.testing.assert_allclose(found.eigenvalues, values[::-1][: len(found.eigenvalues)], rtol=0.03)
    assert found.variance_shares[-1] >= 0.9 > found.variance_shares[-2]


def test_a_constant_is_one_mode() -> None:
    found = expand(Constant(3.0), 4.0)
    assert found.eigenvalues.tolist() == [36.0] and found.variance_shares.tolist() == [1.0]
    np.testing.assert_allclose(found.modes(np.array([0.0, 1.0, 4.0])), [[3.0, 3.0, 3.0]], rtol=1e-15)
    assert Constant(3.0).at(np.array([0.0, -7.0])).tolist() == [9.0, 9.0]
    assert Constant(3.0).density(np.array([0.0, 1.0])).tolist() == [0.0, 0.0]


def test_a_share_or_a_number_of_modes_is_needed() -> None:
    with pytest.raises(UsageError, match="neither a share of the variance nor a number of modes is given; try: share"):
        expand(exponential(1.0, 1.0), 1.0)


def test_shares_that_need_too_many_modes_are_refused_with_the_share_that_does_not() -> None:
    with pytest.raises(
        UsageError, match=f"needs more than {MOST_MODES} modes; {MOST_MODES} have 0.997.*; try: share = "
    ):
        expand(exponential(1.0, 1.0), 15.0, share=0.9999)


@pytest.mark.usefixtures("few_nodes")
def test_a_window_in_which_nodes_do_not_resolve_the_process_is_refused() -> None:
    with pytest.raises(UsageError, match="the window is too long for 256 nodes: its modes are not found"):
        expand(UNIT, 1e6, share=0.9)


@pytest.mark.usefixtures("few_nodes")
def test_modes_that_a_process_has_not_are_refused() -> None:
    with pytest.raises(UsageError, match=r"the process has \d+ modes in this window beyond rounding, and 60 are asked"):
        expand(UNIT, 1.0, modes=60)


def test_an_earthquake_of_ten_seconds_has_its_modes() -> None:
    """Of Kanai and Tajimi's spectrum; the number of modes is that of the spectrum, within a few."""
    soil = kanai_tajimi(1.0, 15.0, 0.6)
    found = expand(soil, 10.0, share=0.85)
    frequency = np.linspace(0.0, 200.0, 400_001)
    below = np.cumsum(soil.density(frequency)) * frequency[1]
    assert len(found.eigenvalues) == pytest.approx(20.0 * frequency[np.searchsorted(below, 0.85)], abs=8)
    assert found.variance_shares[-1] >= 0.85
