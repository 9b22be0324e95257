"""Power spectral densities of columns of a solution, by Welch's method (Welch 1967), and root mean squares, weighted in
time."""

from __future__ import annotations

import numpy as np

from eomgen.errors import Problem, UsageError
from eomgen.linear.spectra import PowerSpectrum, check_weighted, weighted_signal
from eomgen.results.plots import only_curve
from eomgen.results.recorded import RecordedSolution

#: Spacings of rows are equal if the spacings differ by less than this part.
_EQUAL = 1e-6
_FEWEST = 16


def psd(solution: RecordedSolution, name: str, segments: int, start: float | None) -> PowerSpectrum:
    """Return the spectrum of a column; see ``Solution.psd``."""
    curve = only_curve(solution, name, "psd")
    used = solution.t >= (-np.inf if start is None else start)
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
        x = weighted_signal(weighting, t, x)
    used = t >= (-np.inf if start is None else start)
    t, x = t[used], x[used]
    if len(t) < 2:
        since = f" from {start:.6g} s on" if start is not None else ""
        fault = f"the run has {len(t)} rows{since}, and a mean over time needs 2"
        raise UsageError(Problem("rms", fault, "a longer run, or one with more rows"))
    return float(np.sqrt(np.trapezoid(x * x, t) / (t[-1] - t[0])))
