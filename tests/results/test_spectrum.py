"""Spectra of runs: a sine of known size, Parseval, units, plots, and columns that have none."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.spectra import PowerSpectrum
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]


@pytest.fixture(scope="module")
def run() -> eomgen.Solution:
    """Return a free oscillation of 0.3 m at 2 Hz and nothing else."""
    scene = (
        eomgen.SceneBuilder("oscillator", gravity=[0, 0, 0])
        .body("mass", 1.0)
        .joint(
            "x", "prismatic", "base", "mass", axis=[1, 0, 0], stiffness=(4 * math.pi) ** 2, initial={"position": 0.3}
        )
        .output("force", formula=f"-{(4 * math.pi) ** 2} * q.x", unit="N")
    )
    return eomgen.build(scene.build(), profile="quick").simulate(64.0, 1 / 256, method="rk4", error_estimate=False)


@pytest.mark.slow
def test_a_sine_is_a_line_of_its_mean_square(run: eomgen.Solution) -> None:
    for name, size, unit in (("q.x", 0.3, "m^2/Hz"), ("force", 0.3 * (4 * math.pi) ** 2, "N^2/Hz")):
        spectrum = run.psd(name, segments=7)
        assert spectrum.unit == unit
        assert spectrum.frequencies[np.argmax(spectrum.density)] == pytest.approx(2.0, abs=0.07)
        assert spectrum.rms() == pytest.approx(size / math.sqrt(2.0), rel=2e-3)
        assert spectrum.rms(1.5, 2.5) == pytest.approx(spectrum.rms(), rel=1e-4)
        assert spectrum.rms(5.0, 50.0) <= 1e-3 * size
    assert run.psd("v.x").unit == "(m/s)^2/Hz"


def test_it_draws_on_axes_of_the_caller(run: eomgen.Solution) -> None:
    from matplotlib.figure import Figure

    axis = Figure().subplots()
    assert run.psd("force").plot(axis, label="run") == [axis]
    run.psd("force", segments=30).plot(axis, label="smoother")
    assert len(axis.lines) == 2 and axis.get_ylabel() == "power spectral density, N^2/Hz"
    assert axis.get_xscale() == axis.get_yscale() == "log" and "0 to 64 s of a run" in axis.get_title(loc="left")
    with pytest.raises(UsageError, match="axes of matplotlib are needed, not int"):
        run.psd("force").plot(3)


def test_columns_without_a_spectrum(run: eomgen.Solution) -> None:
    for call, text in (
        (lambda: run.psd("forces"), "the solution has no curve 'forces'; try: force"),
        (lambda: run.psd("energy"), "'energy' are 3 columns, and a spectrum is of one; try: one of"),
        (lambda: run.psd("force", start=63.97), "the run has 8 rows from 63.97 s on, and a spectrum needs 16"),
        (lambda: run.psd("force", segments=0), "psd: segments: 0 segments of 16385 rows; try: a whole number from 1"),
    ):
        with pytest.raises(UsageError, match=text):
            call()
    late = replace(run, t=np.where(run.t > 32.0, run.t + 1e-3, run.t))
    with pytest.raises(UsageError, match=r"not evenly spaced: 0\.00490625 s at t = 32 s, 0\.00390631 s on the mean"):
        late.psd("q.x")


#: Wk of ISO 2631-1:1997, table 3, in thousandths, at these frequencies in Hz.
_WK = {1.0: 482, 2.0: 531, 4.0: 967, 6.3: 1054, 16.0: 768, 31.5: 405}


@pytest.mark.parametrize("frequency", _WK)
def test_a_narrow_band_is_weighted_by_the_tabulated_factor(frequency: float) -> None:
    f = frequency * np.linspace(0.999, 1.001, 41)
    spectrum = PowerSpectrum("seat", "m/s^2", f, np.full(41, 3.0), "")
    assert spectrum.rms(weighting="Wk") / spectrum.rms() == pytest.approx(1e-3 * _WK[frequency], abs=1e-3)


def test_what_has_no_weighted_rms() -> None:
    spectrum = PowerSpectrum("seat", "m", np.linspace(0.0, 9.0, 10), np.ones(10), "")
    with pytest.raises(UsageError, match=r"seat is in m, and weightings are of accelerations in m/s\^2"):
        spectrum.rms(weighting="Wk")
    acceleration = PowerSpectrum("seat", "m/s^2", np.linspace(0.0, 9.0, 10), np.ones(10), "")
    with pytest.raises(UsageError, match="there is no weighting 'Wx'"):
        acceleration.rms(weighting="Wx")
