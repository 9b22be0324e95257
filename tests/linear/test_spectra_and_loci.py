"""Spectra, weightings of human response, Campbell diagrams and root loci as objects: numbers that are given here."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from eomgen.errors import Problem, UsageError
from eomgen.products.linear.eigenvalue_loci import (
    Campbell,
    Crossing,
    MergedWarnings,
    root_locus,
)
from eomgen.products.linear.linearization import Linearization
from eomgen.products.linear.spectra import PowerSpectrum
from eomgen.products.linear.spectra.power_spectrum import weighting_response
from tests.linear.by_hand import linear_model


def test_units_of_densities() -> None:
    units = {"m": "m^2/Hz", "m/s^2": "(m/s^2)^2/Hz", "N m": "(N m)^2/Hz", "1": "1/Hz", "": "", "m^2": "(m^2)^2/Hz"}
    f = np.array([1.0, 2.0])
    assert {unit: PowerSpectrum("x", unit, f, f).unit for unit in units} == units


def test_mean_squares_are_areas_between_two_frequencies() -> None:
    """Under the line g = f from 1 to 3 Hz."""
    spectrum = PowerSpectrum("seat", "m/s^2", np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 3.0]), "a road")
    assert spectrum.rms() == pytest.approx(2.0)
    assert spectrum.rms(1.5, 2.5) == pytest.approx(math.sqrt(0.5 * (2.5**2 - 1.5**2)))
    assert spectrum.rms(0.0, 2.0) == pytest.approx(math.sqrt(1.5)) and spectrum.rms(5.0, 9.0) == 0.0
    f = np.linspace(1.0, 3.0, 2001)
    weighted = np.trapezoid(f * np.abs(weighting_response("Wd", f)) ** 2, f)
    fine = PowerSpectrum("seat", "m/s^2", f, f)
    assert fine.rms(weighting="Wd") == pytest.approx(math.sqrt(weighted))
    assert repr(spectrum) == "<PowerSpectrum of seat: 3 points, 1 to 3 Hz; rms 2 m/s^2>"
    with pytest.raises(UsageError, match="seat is in m, and weightings apply to accelerations in m/s\\^2"):
        PowerSpectrum("seat", "m", f, f).rms(weighting="Wk")
    with pytest.raises(UsageError, match="there is no weighting 'Wz'; try: Wk: vertical, of a seat or the floor; Wd:"):
        fine.rms(weighting="Wz")


def test_spectra_are_drawn_where_logarithms_exist() -> None:
    spectrum = PowerSpectrum("seat", "m", np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 2.0, 0.0, 3.0]), "a road")
    (axis,) = spectrum.plot(Figure().subplots(), "now")
    (line,) = axis.lines
    assert line.get_xdata().tolist() == [1.0, 3.0] and line.get_ydata().tolist() == [2.0, 3.0]
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("frequency, Hz", "power spectral density, m^2/Hz")
    assert axis.get_title(loc="left") == "seat; a road" and axis.get_legend().get_texts()[0].get_text() == "now"
    (axis,) = PowerSpectrum("seat", "", np.array([1.0, 2.0]), np.ones(2)).plot(Figure().subplots())
    assert axis.get_ylabel() == "power spectral density" and axis.get_title(loc="left") == "seat"
    assert axis.get_legend() is None


DIAGRAM = Campbell(
    "spin", "rad/s", np.array([0.0, 10.0, 20.0]),
    np.array([[-1.0 + 6.0j, -2.0 + 40.0j], [-3.0 + 4.0j, math.nan], [-1.0 + 2.0j, -2.0 + 60.0j]]),
    np.array([[1, -1], [0, 0], [1, 0]]), (1.0, 2.0),
    (Crossing(1.0, 3.0, 3.0, 0, "forward"), Crossing(2.0, 21.0, 42.0, 1, "")), ("stable",) * 3,
)  # fmt: skip  # a table


def test_campbell_diagrams_have_rows_in_hertz_and_turns_per_minute() -> None:
    assert DIAGRAM.headings == ("order", "spin, rad/s", "1/min", "damped frequency, Hz", "mode", "whirl")
    assert DIAGRAM.rows == [
        ("1", "3", f"{90.0 / math.pi:.9g}", f"{1.5 / math.pi:.9g}", "1", "forward"),
        ("2", "21", f"{630.0 / math.pi:.9g}", f"{21.0 / math.pi:.9g}", "2", ""),
    ]
    assert DIAGRAM.critical_speeds.tolist() == [3.0]
    np.testing.assert_allclose(DIAGRAM.frequencies[:, 0], np.array([6.0, 4.0, 2.0]) / (2.0 * math.pi))
    assert DIAGRAM.damping_ratios[1, 0] == 0.6
    assert repr(DIAGRAM) == (
        f"<Campbell: 2 modes at 3 values of spin, 0 to 20 rad/s, up to {30.0 / math.pi:.6g} Hz; 1x at 3 rad/s, 2x at 21"
        " rad/s>"
    )
    nothing = Campbell(
        "c", "1", DIAGRAM.values, DIAGRAM.eigenvalues, DIAGRAM.whirl, (), (), (), {5.0: "no rest", 7.5: "no rest"}, True
    )
    assert repr(nothing).endswith("no crossings; none at 5, 7.5; interrupted>") and ", 0 to 20, up" in repr(nothing)


def test_roots_over_damping_are_closed_forms_in_columns() -> None:
    """x'' + c x' + 4 x = 0: a pair that meets at c = 4, and two real roots beyond."""
    values, told, before = [0.5, 1.0, 2.0, 3.0, 5.0], list[tuple[int, int]](), list[Any]()

    def linearized(value: float, last: Linearization | None) -> Linearization:
        before.append(last)
        return linear_model(1.0, value, 4.0, ["x"])

    locus = root_locus("c", values, linearized, lambda *done: told.append(done))
    half = np.array(values)[:, np.newaxis] / 2.0
    roots = -half + np.sqrt((half**2 - 4.0).astype(complex)) * [1.0, -1.0]
    assert repr(locus) == "<RootLocus: 2 roots at 5 values of c, 0.5 to 5; stable>"
    for found, expected in zip(locus.eigenvalues, roots, strict=True):
        np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), atol=1e-12)
    assert np.all(np.sign(locus.eigenvalues[:4].imag) == np.sign(locus.eigenvalues[0].imag))
    assert (locus.parameter, locus.values.tolist(), locus.stability) == ("c", values, ("stable",) * 5)
    assert told == [(k, 5) for k in range(1, 6)] and before[0] is None and all(before[1:])

    def interrupting(done: int, _: int) -> None:
        if done == 4:
            raise KeyboardInterrupt

    part = root_locus("c", values, linearized, interrupting)
    assert part.interrupted and part.values.tolist() == values[:4]
    np.testing.assert_array_equal(part.eigenvalues, locus.eigenvalues[:4])
    with pytest.raises(KeyboardInterrupt):
        root_locus("c", values, lambda *_: interrupting(4, 5))  # type: ignore[arg-type,return-value]  # before a value


def test_warnings_that_differ_in_numbers_are_one_with_the_values_of_the_caller() -> None:
    doubts = MergedWarnings("job", "p", [1, 2, 3])
    for value, texts in ((1.0, ["off by 1.5 %"]), (1.5, ["off by 2e-3 %"]), (2.0, ["off by -7 %", "other"])):
        with doubts.at(value):
            for text in texts:
                warnings.warn(text, RuntimeWarning, stacklevel=1)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        doubts.warn(1)
    assert [str(item.message) for item in caught] == [
        "job: at 2 values of p from 1 to 2, at p = 1 for instance: off by 1.5 % [W0040]",
        "job: at p = 2: other [W0040]",
    ]
    for where, said in (("", "at p = 3: a fault; try: this"), ("a place", "at p = 3: a place: a fault; try: this")):
        with pytest.raises(UsageError) as refusal, doubts.at(3.0):
            raise UsageError(Problem(where, "a fault", "this"))
        assert str(refusal.value) == f"usage error: {said}"
