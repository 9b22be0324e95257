"""Gains for eigenvalues that are asked for, by SciPy's placement in scaled units, with checks of the poles."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Sequence

import numpy as np

from eomgen.base.arrays import Array, Complex
from eomgen.base.messages import shown
from eomgen.base.rounding import WRITTEN
from eomgen.errors import NumericalError, Problem, UsageError


def pole_array(poles: Sequence[complex], sample: float | None = None) -> Complex:
    """Return poles as a complex array; with a ``sample`` in s converted from 1/s into z = e^(s sample). Raises
    UsageError for anything but numbers."""
    try:
        wanted = np.asarray(poles, dtype=complex)
        with np.errstate(over="ignore", invalid="ignore"):
            return wanted if sample is None else np.asarray(np.exp(wanted * sample))
    except (TypeError, ValueError):
        fault = f"a list of numbers is needed, not {shown(poles)} [E2237]"
        raise UsageError(Problem("poles", fault, "[-1 + 2j, -1 - 2j], as many as states")) from None


def check_poles(wanted: Complex, size: int, inputs: int) -> None:
    """Raise UsageError unless `wanted` has ``size`` finite poles, each as often as its conjugate, and at most once for
    each of the inputs."""
    if wanted.shape != (size,):
        fault = f"{wanted.size} poles are given, and the model has {size} eigenvalues [E0402]"
        raise UsageError(Problem("poles", fault, f"{size} poles"))
    if not np.all(np.isfinite(wanted)):
        raise UsageError(Problem("poles", "a pole is not finite [E0406]", "finite numbers"))
    counts = Counter(map(complex, wanted))
    for pole, count in counts.items():
        words = f"{pole.real:g}{pole.imag:+g}i"
        if count > counts[pole.conjugate()]:
            fault = f"the pole {words} is there without its conjugate [E0404]"
            raise UsageError(Problem("poles", fault, f"{pole.real:g}{-pole.imag:+g}i too"))
        if count > inputs:
            fault = f"the pole {words} is there {count} times, and {inputs} of them can be placed at most [E0405]"
            raise UsageError(Problem("poles", fault, "distinct poles"))


def pole_gains(A: Array, B: Array, poles: Array | Complex) -> Array:
    """Return G (m, n) with the eigenvalues ``poles`` (n,) of A - B G, in scaled units, by SciPy. Raises NumericalError
    if SciPy cannot place the poles."""
    from scipy.signal import place_poles  # noqa: PLC0415  # slow to import

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # SciPy's doubts about convergence: ``check_reached`` looks at the result
            return np.real(place_poles(A, B, poles).gain_matrix)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise NumericalError(f"the poles could not be placed: {error} [E0407]", "other poles") from None


def check_reached(reached: Array | Complex, wanted: Complex, rate: float) -> None:
    """Raise NumericalError if a pole is not among the eigenvalues of the closed loop; ``rate`` is a scale of these."""
    missed = max(float(np.abs(reached - pole).min()) / max(abs(pole), 1e-3 * rate) for pole in map(complex, wanted))
    if not missed <= WRITTEN:
        fault = f"the poles are reached to {missed:.1e} of their size only [E0403]"
        raise NumericalError(fault, "poles nearer to the model's")
