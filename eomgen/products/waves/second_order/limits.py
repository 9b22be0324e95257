"""Limits of seas: impossible ones, and seas for which an expansion of second order does not hold."""

from __future__ import annotations

import math
import warnings

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.errors import Problem, UsageError
from eomgen.products.waves.sea_states.components import Components
from eomgen.products.waves.sea_states.nonlinearity import beyond_second_order, breaking_height, too_steep_together
from eomgen.products.waves.sea_states.spectra import STANDARD_GRAVITY, check_depth, check_number
from eomgen.products.waves.second_order.pairs import ENTRIES

_COMPONENTS = "Sea: components"


def check_points(where: str, points: ArrayLike) -> None:
    """Raise UsageError unless points have the shape (points, 2) and are finite."""
    array = np.asarray(points, dtype=float)
    if array.ndim != 2 or array.shape[1] != 2 or not np.all(np.isfinite(array)):
        finite = "" if np.all(np.isfinite(array)) else ", with numbers that are not finite"
        fault = f"an array of shape {array.shape}{finite} [E1187]"
        raise UsageError(Problem(where, fault, "finite numbers of shape (points, 2)"))


def check_sea(components: Components, depth: float, order: int, gravity: float) -> None:
    """Raise UsageError for components of wrong shapes or values, zero or equal wave vectors, negative amplitudes, an
    impossible depth, order or gravity, a wave that crosses itself, and at order 2 a wave that breaks by itself, or too
    many pairs."""
    vectors, amplitude, phase = (np.asarray(x, dtype=float) for x in vars(components).values())
    shapes = vectors.shape, amplitude.shape, phase.shape
    if not vectors.size or shapes != ((len(vectors), 2), (len(vectors),), (len(vectors),)):
        fault = "wave vectors, amplitudes and phases have the shapes {}, {} and {} [E1188]".format(*shapes)
        raise UsageError(Problem(_COMPONENTS, fault, "(n, 2), (n,) and (n,), at least one"))
    if not all(np.all(np.isfinite(x)) for x in (vectors, amplitude, phase)):
        raise UsageError(Problem(_COMPONENTS, "a wave vector, an amplitude or a phase is not a finite number [E1190]"))
    if np.any(amplitude < 0.0):
        fault = f"the amplitude {amplitude.min():.6g} m is negative [E1191]"
        raise UsageError(Problem(_COMPONENTS, fault, "the phase + pi"))
    if order not in (1, 2):
        raise UsageError(Problem("Sea: order", f"there is no order {order} [E1192]", "1 or 2"))
    check_number("Sea: gravity", gravity, "m/s^2", f"{STANDARD_GRAVITY}", above_zero=True)
    check_depth("Sea", depth)
    k = np.hypot(*vectors.T)
    _check_waves(vectors, amplitude, k, depth)
    if order == 2:
        _check_second_order(amplitude, k, depth)


def _check_waves(vectors: Array, amplitude: Array, k: Array, depth: float) -> None:
    """Raise UsageError for a wave without a length, two waves of one vector, or a wave that crosses itself.

    Parameters
    ----------
    vectors, amplitude, k : (n, 2) in rad/m, (n,) in m, (n,) wave numbers in rad/m
    """
    if not np.all(k > 0.0):
        number = int(np.argmin(k))
        fault = f"component {number} has the wave vector (0, 0): the water's level changes, without a wave [E1194]"
        raise UsageError(Problem(_COMPONENTS, fault, "components with a wave number above 0"))
    if len(np.unique(vectors, axis=0)) < len(vectors):
        fault = "two components have the same wave vector [E1196]"
        raise UsageError(Problem(_COMPONENTS, fault, "one with the sum of both"))
    steep = k * amplitude / np.tanh(np.minimum(k * depth, 700.0))
    if np.any(steep >= 1.0):
        number = int(np.argmax(steep))
        fault = f"component {number} has k A coth(k h) = {steep[number]:.4g}; from 1 on a wave crosses itself [E1195]"
        raise UsageError(Problem(_COMPONENTS, fault, f"an amplitude below {amplitude[number] / steep[number]:.4g} m"))


def _check_second_order(amplitude: Array, k: Array, depth: float) -> None:
    """Raise UsageError for waves that break, or for more pairs than fit the memory of a table.

    Parameters
    ----------
    amplitude, k : (n,) in m, (n,) wave numbers in rad/m
    """
    highest = np.array([0.5 * breaking_height(float(wave_number), depth) for wave_number in k])
    if np.any(amplitude > highest):
        number = int(np.argmax(amplitude / highest))
        fault = f"component {number}, a wave of {2.0 * math.pi / k[number]:.4g} m, breaks from an amplitude of"
        fault += f" {highest[number]:.4g} m on, and has {amplitude[number]:.4g} m [E1199]"
        hint = "a smaller amplitude, or order = 1: Gerstner's waves do not break"
        raise UsageError(Problem(_COMPONENTS, fault, hint))
    if (needed := 4.0 * len(k) ** 2 * len(ENTRIES)) > 2e9:
        pairs = len(k) * (len(k) - 1) // 2
        fault = f"{len(k)} components have {pairs} pairs, whose table takes {needed / 1e9:.3g} GB [E1201]"
        hint = "fewer components, order = 1, or a SteppedSea, whose second order needs no pairs"
        raise UsageError(Problem(_COMPONENTS, fault, hint))


def warn_of_doubtful_waves(vectors: Array, amplitude: Array, depth: float, order: int) -> None:
    """Warn (RuntimeWarning) of water too shallow for second order, and of several waves that break together."""
    k = np.hypot(*vectors.T)
    shallow = beyond_second_order(vectors, amplitude, depth) if order == 2 else ""
    steep = too_steep_together(k, amplitude, depth, alone=False) if len(k) > 1 else ""
    for message in (shallow, steep):
        if message:
            warnings.warn(f"Sea: {message}", RuntimeWarning, stacklevel=4)
