"""Linear models about the motion of a solution; power spectral densities of columns by Welch's method (Welch 1967), and
root mean squares, weighted in time."""

from __future__ import annotations

import warnings

import numpy as np

from eomgen.base.arrays import Array, count_of
from eomgen.base.rounding import WRITTEN
from eomgen.compiled.arguments import number_of
from eomgen.compiled.coordinates import StateArrays
from eomgen.errors import Problem, UsageError
from eomgen.products.linear.analyses.linearize import about_motion
from eomgen.products.linear.linearization import Linearization
from eomgen.products.linear.spectra import PowerSpectrum, check_weighted, weighted_signal
from eomgen.results.plots import only_curve, rows_from
from eomgen.results.recorded import ModelOfRun, MotionWithModel, RecordedSolution, model_of

_FEWEST = 16


def linearize(solution: MotionWithModel, t: float) -> Linearization:
    """Return the linear model about the motion at a time within the solution; see ``Model.linearize``.

    Accelerations and multipliers follow from the dynamics in the state of ``at``, brought onto the constraints
    if there are any. Inputs and parameters are the run's.

    Parameters
    ----------
    t : float
        Time within the solution, s.

    Returns
    -------
    Linearization
        The linear model, as ``Model.linearize`` returns it.

    Raises
    ------
    UsageError
        Times outside the solution, or half a turn or more between two rows; or the model is not at hand, as the
        solution comes from a file or from another process.
        ``Model.attach`` gives the model back.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> run = model.simulate(0.1, 1e-3)
    >>> run.linearize(0.05).state_space().A.shape
    (4, 4)
    """
    model = model_of(solution, "linearize", "a linear model needs")
    return about_row(model, solution.at(number_of("t", t)))


def about_row(run: ModelOfRun, state: StateArrays) -> Linearization:
    """Return the linear model about one state of a run, with the inputs of the run at its time."""
    return about_motion(run.model, state, *run.given_at(state))


def psd(solution: RecordedSolution, name: str, *, segments: int = 8, start: float | None = None) -> PowerSpectrum:
    """Return the one-sided power spectral density of a column by Welch's method: Hann windows that overlap by half.

    Parameters
    ----------
    name : str
        Column by name: ``"tip[2]"``, ``"q.hinge"``, ``"body_acceleration"``.
    segments : int
        More segments: less scatter, coarser frequencies.
    start : float
        Rows before this time in s are left out, for a motion that has to settle first.

    Returns
    -------
    PowerSpectrum
        Densities over frequency, Hz, in the square of the column's unit per Hz.

    Raises
    ------
    UsageError
        No column or more than one of that name; rows that are not evenly spaced; too few rows.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> spectrum = model.simulate(2.0, 1e-2).psd("body_acceleration", segments=2)
    >>> spectrum.frequencies.shape
    (68,)
    """
    curve = only_curve(solution, name, "psd")
    used = rows_from(solution.t, start, "psd")
    t, x = solution.t[used], curve.values[used]
    if len(t) < _FEWEST:
        since = f" from {start:.6g} s on" if start is not None else ""
        fault = f"the run has {len(t)} rows{since}, and a spectrum needs {_FEWEST} and more [E1306]"
        raise UsageError(Problem("psd", fault, "a longer run, or one with more rows"))
    spacings = np.diff(t)
    spacing = float(np.mean(spacings))
    if np.any(np.abs(spacings - spacing) > WRITTEN * spacing):
        k = int(np.argmax(np.abs(spacings - spacing)))
        uneven = f"{spacings[k]:.6g} s at t = {t[k]:.6g} s, {spacing:.6g} s on the mean"
        fault = f"the rows are not evenly spaced: {uneven} [E1307]"
        raise UsageError(Problem("psd", fault, "a run with a fixed step, without events that record rows of their own"))
    segments = count_of("segments", segments)
    if segments > len(t) // _FEWEST:
        fault = f"{segments} segments of {len(t)} rows [E1308]"
        raise UsageError(Problem("psd: segments", fault, f"a whole number from 1 to {len(t) // _FEWEST}"))
    from scipy.signal import welch  # noqa: PLC0415  # slow to import

    # segments overlap by one half
    length = 2 * len(t) // (segments + 1)
    frequencies, density = welch(x, 1.0 / spacing, "hann", nperseg=length, detrend="constant")
    run = f"{t[0]:.6g} to {t[-1]:.6g} s of a run, {segments} segments"
    return PowerSpectrum(curve.name, curve.unit, np.asarray(frequencies), np.asarray(density), run)


def rms(solution: RecordedSolution, name: str, *, weighting: str | None = None, start: float | None = None) -> float:
    """Return the root mean square of a column over time, with the mean included.

    A weighting is applied in time, exactly for the cubic spline through the rows, from the first row on; a constant
    part is weighted by zero. ``psd(name).rms(low, high)`` is of a band, without the mean.

    Parameters
    ----------
    name : str
        Column by name: ``"motor"``, ``"tip[2]"``, ``"body_acceleration"``.
    weighting : str, optional
        ``Wk`` or ``Wd`` of ISO 2631-1, for an acceleration in m/s^2.
    start : float
        Rows before this time in s are left out of the mean, for a motion that has to settle first; a weighting
        settles within 3 s.

    Returns
    -------
    float
        In the column's unit.

    Raises
    ------
    UsageError
        No column or more than one of that name; no such weighting, or no acceleration; too few rows.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> model.simulate(4.0, 1e-2).rms("body_acceleration", weighting="Wk", start=2.0) > 0.0
    True
    """
    curve = only_curve(solution, name, "rms")
    t, x = solution.t, curve.values
    kept = np.concatenate([np.diff(t) > 0.0, [True]])  # of rows before and after an event the later row
    t, x = t[kept], x[kept]
    if weighting is not None:
        check_weighted(curve.name, curve.unit)
        if len(t) < _FEWEST:
            fault = f"the run has {len(t)} rows, and a weighting needs {_FEWEST} and more [E1310]"
            raise UsageError(Problem("rms", fault, "a longer run, or one with more rows"))
        _warn_of_coarse_rows(solution, curve.name, weighting, t, x, start)
        x = weighted_signal(weighting, t, x)
    used = rows_from(t, start, "rms")
    t, x = t[used], x[used]
    if len(t) < 2:
        since = f" from {start:.6g} s on" if start is not None else ""
        fault = f"the run has {len(t)} rows{since}, and a mean over time needs 2 [E1309]"
        raise UsageError(Problem("rms", fault, "a longer run, or one with more rows"))
    return _root_mean_square(t, x)


def _root_mean_square(t: Array, x: Array) -> float:
    return float(np.sqrt(np.trapezoid(x * x, t) / (t[-1] - t[0])))


def _warn_of_coarse_rows(
    solution: RecordedSolution, name: str, weighting: str, t: Array, x: Array, start: float | None
) -> None:
    """Warn (RuntimeWarning) if the rows of a run are too coarse for a frequency weighting. That is the case if every
    other row gives another root mean square by more than 5 %, or if rows are thinner than steps and hold no frequencies
    of 16 Hz. `t` and `x` (n,) are times and values, `start` the first time that counts."""
    distance = float(np.median(np.diff(t)))
    step = solution.metadata.get("step")
    if 0.5 / distance < 16.0 and isinstance(step, float) and step < 0.75 * distance:
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
        if abs(values[1] - values[0]) <= 0.05 * values[0]:
            return
        text = f"every other row gives {values[1]:.4g} in place of {values[0]:.4g}"
    warnings.warn(
        f"rms of {name}: {text}; try: record_every=1, or a smaller step [W0097]", RuntimeWarning, stacklevel=4
    )
