"""Power spectral densities of columns of a solution, by Welch's method (Welch 1967), and root mean squares, weighted in
time."""

from __future__ import annotations

import warnings

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import Problem, UsageError
from eomgen.linear.spectra import PowerSpectrum, check_weighted, weighted_signal
from eomgen.results.plots import only_curve, rows_from
from eomgen.results.recorded import RecordedSolution

#: Spacings of rows are equal if the spacings differ by less than this part.
_EQUAL = 1e-6
_FEWEST = 16
#: Hz: rows have to hold lower frequencies for weightings of ISO 2631-1, which weigh lower ones by a third and more.
_HIGHEST_FELT = 16.0
#: Part by which a weighted value from every other row may differ.
_RESOLVED = 0.05


def psd(solution: RecordedSolution, name: str, segments: int, start: float | None) -> PowerSpectrum:
    """Return the spectrum of a column; see ``Solution.psd``."""
    curve = only_curve(solution, name, "psd")
    used = rows_from(solution.t, start, "psd")
    t, x = solution.t[used], curve.values[used]
    if len(t) < _FEWEST:
        since = f" from {start:.6g} s on" if start is not None else ""
        fault = f"the run has {len(t)} rows{since}, and a spectrum needs {_FEWEST} and more"
        raise UsageError(Problem("psd", fault, "a longer run, or one with more rows"))
    spacings = np.diff(t)
    spacing = float(np.mean(spacings))
    if np.any(np.abs(spacings - spacing) > _EQUAL * spacing):
        k = int(np.argmax(np.abs(spacings - spacing)))
        fault = f"the rows are not evenly spaced: {spacings[k]:.6g} s at t = {t[k]:.6g} s, {spacing:.6g} s on the mean"
        raise UsageError(Problem("psd", fault, "a run with a fixed step, without events that record rows of their own"))
    if not (isinstance(segments, int) and 1 <= segments <= len(t) // _FEWEST):
        fault = f"{ascii(segments)[:32]} segments of {len(t)} rows"
        raise UsageError(Problem("psd: segments", fault, f"a whole number from 1 to {len(t) // _FEWEST}"))
    from scipy.signal import welch  # noqa: PLC0415  # slow to import

    # segments overlap by one half
    length = 2 * len(t) // (segments + 1)
    frequencies, density = welch(x, 1.0 / spacing, "hann", nperseg=length, detrend="constant")
    run = f"{t[0]:.6g} to {t[-1]:.6g} s of a run, {segments} segments"
    return PowerSpectrum(curve.name, curve.unit, np.asarray(frequencies), np.asarray(density), run)


def rms(solution: RecordedSolution, name: str, weighting: str | None, start: float | None) -> float:
    """Return the root mean square of a column; see ``Solution.rms``."""
    curve = only_curve(solution, name, "rms")
    t, x = solution.t, curve.values
    kept = np.concatenate([np.diff(t) > 0.0, [True]])  # of rows before and after an event the later row
    t, x = t[kept], x[kept]
    if weighting is not None:
        check_weighted(curve.name, curve.unit)
        if len(t) < _FEWEST:
            fault = f"the run has {len(t)} rows, and a weighting needs {_FEWEST} and more"
            raise UsageError(Problem("rms", fault, "a longer run, or one with more rows"))
        _warn_of_coarse_rows(solution, curve.name, weighting, t, x, start)
        x = weighted_signal(weighting, t, x)
    used = rows_from(t, start, "rms")
    t, x = t[used], x[used]
    if len(t) < 2:
        since = f" from {start:.6g} s on" if start is not None else ""
        fault = f"the run has {len(t)} rows{since}, and a mean over time needs 2"
        raise UsageError(Problem("rms", fault, "a longer run, or one with more rows"))
    return _root_mean_square(t, x)


def _root_mean_square(t: Array, x: Array) -> float:
    return float(np.sqrt(np.trapezoid(x * x, t) / (t[-1] - t[0])))


def _warn_of_coarse_rows(
    solution: RecordedSolution, name: str, weighting: str, t: Array, x: Array, start: float | None
) -> None:
    """Warn of rows that are too coarse for a weighting, by the value from every other row, or thinner than steps."""
    distance = float(np.median(np.diff(t)))
    step = solution.metadata.get("step")
    if 0.5 / distance < _HIGHEST_FELT and isinstance(step, float) and step < 0.75 * distance:
        text = f"rows every {distance:.4g} s hold frequencies up to {0.5 / distance:.4g} Hz"
        text += f", and {weighting} counts up to 80 Hz"
    else:
        values = []
        for every in (1, 2):
            used = rows_from(t[::every], start, "rms")
            if np.count_nonzero(used) < _FEWEST:
                return
            weighted = weighted_signal(weighting, t[::every], x[::every])
            values.append(_root_mean_square(t[::every][used], weighted[used]))
        if abs(values[1] - values[0]) <= _RESOLVED * values[0]:
            return
        text = f"every other row gives {values[1]:.4g} in place of {values[0]:.4g}"
    warnings.warn(f"rms of {name}: {text}; try: record_every=1, or a smaller step", RuntimeWarning, stacklevel=5)
