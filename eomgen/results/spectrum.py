"""Power spectral densities of columns of a solution, by Welch's method (Welch 1967)."""

from __future__ import annotations

import numpy as np

from eomgen.base.messages import listed
from eomgen.errors import Problem, UsageError
from eomgen.linear.spectra import PowerSpectrum
from eomgen.results.plots import chosen_curves
from eomgen.results.recorded import Recorded

#: Spacings of rows are equal if the spacings differ by less than this part.
_EQUAL = 1e-6
_FEWEST = 16


def psd(solution: Recorded, name: str, segments: int, start: float | None) -> PowerSpectrum:
    """Return the spectrum of a column; see ``Solution.psd``."""
    curves = chosen_curves(solution, [name], "psd")
    if len(curves) != 1:
        fault = f"{ascii(name)[:64]} are {len(curves)} columns, and a spectrum is of one"
        raise UsageError(Problem("psd", fault, f"one of {listed([curve.name for curve in curves][:6])}"))
    values, unit = curves[0].values, curves[0].unit
    used = solution.t >= (-np.inf if start is None else start)
    t, x = solution.t[used], values[used]
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
    return PowerSpectrum(curves[0].name, unit, np.asarray(frequencies), np.asarray(density), run)
