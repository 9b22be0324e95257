"""Spectra of runs: a sine of known size, Parseval, units, plots, weighted root mean squares, and columns that
have none."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.errors import UsageError
from eomgen.spectra import WEIGHTINGS, weighted_signal, weighting_response


def _of_signal(t: Array, values: Array, unit: str = "m/s^2", name: str = "seat") -> eomgen.Solution:
    none = np.zeros((len(t), 0))
    return eomgen.Solution(
        t=t, q=none, v=none, a=none, z=none, multipliers=none,
        outputs={name: values}, metadata={"units": {"outputs": {name: unit}}},
    )  # fmt: skip  # a row of states, and a row of the output


def oscillation(unit: str = "N") -> eomgen.Solution:
    """Return 0.3 at 2 Hz and nothing else."""
    t = np.arange(0.0, 64.0 + 1e-9, 1 / 256)
    return _of_signal(t, 0.3 * np.cos(4.0 * np.pi * t), unit, "force")


@pytest.mark.parametrize(("unit", "squared"), [("N", "N^2/Hz"), ("m/s", "(m/s)^2/Hz")])
def test_a_sine_is_a_line_of_its_mean_square(unit: str, squared: str) -> None:
    run = oscillation(unit)
    spectrum = run.psd("force", segments=np.int64(7))
    assert spectrum.unit == squared
    assert spectrum.frequencies[1] == pytest.approx(256.0 / (2 * 16385 // 8)) and spectrum.frequencies[-1] == 128.0
    assert spectrum.frequencies[np.argmax(spectrum.density)] == pytest.approx(2.0, abs=0.07)
    assert spectrum.rms() == pytest.approx(0.3 / math.sqrt(2.0), rel=2e-3)
    assert spectrum.rms(1.5, 2.5) == pytest.approx(spectrum.rms(), rel=1e-4)
    assert spectrum.rms(5.0, 50.0) <= 3e-4
    late = run.psd("force", segments=3, start=32.0)
    assert late.source == "32 to 64 s of a run, 3 segments" and late.frequencies[1] == pytest.approx(256.0 / 4096)
    assert late.rms() == pytest.approx(0.3 / math.sqrt(2.0), rel=2e-3)
    moved = replace(run, outputs={"force": run.outputs["force"] + 100.0})
    np.testing.assert_allclose(moved.psd("force").density, run.psd("force").density, atol=1e-9)


def test_columns_without_a_spectrum() -> None:
    run = oscillation()
    three = _of_signal(run.t, np.zeros((len(run.t), 3)), name="tip")
    for call, text in (
        (lambda: run.psd("forces"), "the solution has no curve 'forces'; try: force"),
        (lambda: three.psd("tip"), "'tip' are 3 columns, and psd takes one; try: one of"),
        (lambda: run.psd("force", start=63.97), "the run has 8 rows from 63.97 s on, and a spectrum needs 16"),
        (lambda: run.psd("force", segments=0), "segments: a whole number from 1 on is needed, not 0; try: 1"),
        (lambda: run.psd("force", segments=1025), "psd: segments: 1025 segments of 16385 rows; try: a whole number"),
    ):
        with pytest.raises(UsageError, match=text):
            call()
    assert len(run.psd("force", segments=1024).frequencies) == 16
    assert len(run.psd("force", segments=1, start=64.0 - 15.0 / 256).frequencies) == 9
    late = replace(run, t=np.where(run.t > 32.0, run.t + 1e-3, run.t))
    with pytest.raises(UsageError, match=r"not evenly spaced: 0\.00490625 s at t = 32 s, 0\.00390631 s on the mean"):
        late.psd("force")


#: Wk of ISO 2631-1:1997, table 3, in thousandths, at these frequencies in Hz.
_WK = {1.0: 482, 2.0: 531, 4.0: 967, 6.3: 1054, 16.0: 768, 31.5: 405}


@pytest.mark.parametrize("frequency", _WK)
def test_a_sine_in_time_is_weighted_by_the_tabulated_factor(frequency: float) -> None:
    """Rows are uneven, gravity, a constant, is weighted by zero, and means are over whole periods."""
    settled, last = math.ceil(5.0 * frequency), math.ceil(5.0 * frequency) + 12
    periods = np.linspace(0.0, last, 24 * last + 1)
    periods = periods + 0.01 * np.sin(2.0 * math.pi * periods)
    t = periods / frequency
    run = _of_signal(t, 9.81 + 2.0 * np.sin(2.0 * math.pi * periods))
    weighted = run.rms("seat", weighting="Wk", start=(settled - 1e-6) / frequency)
    assert weighted == pytest.approx(1e-3 * _WK[frequency] * 2.0**0.5, abs=2e-3)
    assert run.rms("seat") == pytest.approx(math.sqrt(9.81**2 + 2.0), rel=1e-3)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_the_filter_in_time_is_the_filter_over_frequency(weighting: str) -> None:
    """A smooth pulse: its weighted spectrum is the spectrum of the weighted signal; Fourier's sums are exact for it.
    Gravity has no weight from the start."""
    t = np.arange(0.0, 60.0, 2e-3)
    pulse = np.exp(-(((t - 20.0) / 0.04) ** 2)) * np.sin(2.0 * math.pi * 6.0 * t)
    f = np.fft.rfftfreq(len(t), 2e-3)
    expected = np.fft.irfft(np.fft.rfft(pulse) * weighting_response(weighting, f), len(t))
    assert np.allclose(weighted_signal(weighting, t, 9.81 + pulse), expected, atol=1e-6)


def test_runs_without_a_weighted_rms() -> None:
    t = np.linspace(0.0, 1.0, 101)
    run = _of_signal(t, np.ones(101), "m")
    for call, text in (
        (lambda: run.rms("seat", weighting="Wk"), r"seat is in m, and weightings apply to accelerations in m/s\^2"),
        (lambda: _of_signal(t, t).rms("seat", weighting="Wx"), "there is no weighting 'Wx'; try: Wk: vertical"),
        (lambda: _of_signal(t[:9], t[:9]).rms("seat", weighting="Wk"), "9 rows, and a weighting needs 16 and more"),
        (lambda: run.rms("seat", start=2.0), "the run has 0 rows from 2 s on, and a mean over time needs 2"),
        (lambda: run.rms("seats"), "rms: the solution has no curve 'seats'; try: seat"),
        (lambda: run.rms("seat", start="1 s"), "rms: start: a time in s is needed, not '1 s'; try: start=5.0"),
        (lambda: run.rms(["seat"]), r"the name of one column is needed, not \['seat'\]; try: solution.rms\("),
    ):
        with pytest.raises(UsageError, match=text):
            call()


@pytest.mark.parametrize(
    ("frequency", "distance", "step", "text"),
    [
        (60.0, 0.05, 1e-3, "rms of seat: rows every 0.05 s hold frequencies up to 10 Hz, and Wk counts up to 80 Hz"),
        (20.0, 0.02, 0.02, "rms of seat: every other row gives "),
        (20.0, 1e-3, 1e-3, ""),
        (0.5, 0.05, 0.05, ""),
    ],
)
def test_rows_that_are_too_coarse_for_a_weighting(frequency: float, distance: float, step: float, text: str) -> None:
    t = np.arange(0.0, 8.0, distance)
    run = _of_signal(t, np.sin(2.0 * math.pi * frequency * t + 0.3))
    run.metadata["step"] = step
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run.rms("seat", weighting="Wk")
    assert [str(each.message)[: len(text)] for each in caught] == [text] * bool(text)
    assert all(each.filename == __file__ for each in caught)
