"""Third solutions of rows that are no runs, by SciPy and NumPy from formulas written for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, optimize, special, stats

Array = NDArray[np.float64]


def _over_normals(chance: Callable[[float], float], *breaks: float) -> float:
    """Return the mean of a chance that depends on one standard normal variable, with its kinks."""
    result = integrate.quad(
        lambda z: np.exp(-0.5 * z * z) * chance(z),
        -9.0,
        9.0,
        points=breaks or None,
        limit=500,
        epsabs=0.0,
        epsrel=1e-10,
    )[0]
    return float(result / np.sqrt(2.0 * np.pi))


def _lognormal(mean: float, deviation: float) -> tuple[float, float]:
    """Return mean and deviation of the logarithm."""
    variance = np.log1p((deviation / mean) ** 2)
    return np.log(mean) - 0.5 * variance, np.sqrt(variance)


def _axial_beam() -> float:
    mean, deviation = _lognormal(300.0, 30.0)
    return _over_normals(lambda z: special.ndtr((75e3 - 100.0 * np.pi * np.exp(mean + deviation * z)) / 5e3))


def _problem_25() -> float:
    """Both parts of the largest one are negative between two bounds of the second variable."""

    def chance(z: float) -> float:
        low, high = (z * z + 16.0) / 8.0, 16.0 * z - 32.0
        return max(0.0, float(special.ndtr(-low) - special.ndtr(-high)))

    return _over_normals(chance, 2.0, 64.0 - np.sqrt(64.0**2 - 272.0))


def _problem_35() -> float:
    """Fails above a curve of the second variable, or above 4.5 / x1 (below it if x1 is negative)."""

    def chance(z: float) -> float:
        bound = 2.0 + np.exp(-0.1 * z * z) + (0.2 * z) ** 4
        if z > 0.0:
            return float(special.ndtr(-min(bound, 4.5 / z)))
        return float(special.ndtr(-bound) + (special.ndtr(4.5 / z) if z < 0.0 else 0.0))

    crossings = [x for x in np.roots([0.0016, 0.0, 0.0, 0.0, 2.0, -4.5]) if abs(x.imag) < 1e-9]
    return _over_normals(chance, 0.0, *(float(x.real) for x in crossings))


def _problem_53() -> float:
    return _over_normals(
        lambda z: special.ndtr(-(1.0 + 20.0 * (np.sin(2.5 * (z + 1.5)) + 2.0) / ((z + 1.5) ** 2 + 4.0) - 2.5))
    )


def _problem_55() -> float:
    """The difference of both variables has a density of a triangle, (2 - |d|) / 4."""
    edge = 5.0 / np.sqrt(2.0) - 2.2

    def fails(d: float) -> float:
        return 0.2 + 0.6 * d**4 - d / float(np.sqrt(2.0))

    first, second = optimize.brentq(fails, 0.0, 0.5), optimize.brentq(fails, 0.6, 2.0)
    low, high = (2.0 - first) ** 2, (2.0 - second) ** 2
    return float((low - high + max(0.0, 2.0 - edge) ** 2) / 4.0)


def _product(level: float, both: bool) -> float:
    """P(x1 x2 > level), and with ``both`` P(x1 x2 < -level) as well, of two standard normal variables."""
    tail = (
        2.0
        * integrate.quad(
            lambda z: stats.norm.pdf(z) * special.ndtr(-level / z),
            0.0,
            40.0,
            points=[np.sqrt(level)],
            epsabs=0.0,
            epsrel=1e-11,
        )[0]
    )
    return float(tail * (2.0 if both else 1.0))


def _problem_8() -> float:
    """Fourier inversion of the sum: x1 + 2 x2 + 2 x3 + x4 - 5 x5 - 5 x6, each lognormal (Gil-Pelaez)."""
    terms = [
        (1.0, 120.0, 12.0),
        (2.0, 120.0, 12.0),
        (2.0, 120.0, 12.0),
        (1.0, 120.0, 12.0),
        (-5.0, 50.0, 10.0),
        (-5.0, 40.0, 8.0),
    ]
    nodes, weights = np.polynomial.hermite_e.hermegauss(160)
    weights = weights / weights.sum()
    step = 2.0 * np.pi / 6000.0
    frequencies = (np.arange(240) + 0.5) * step
    values = np.ones(len(frequencies), complex)
    for factor, mean, deviation in terms:
        center, width = _lognormal(mean, deviation)
        values *= np.exp(1j * np.outer(frequencies, factor * np.exp(center + width * nodes))) @ weights
    return float(0.5 - np.sum(values.imag / frequencies) * step / np.pi)


def _problem_60() -> float:
    """Given x5, every other variable is below x5 / 2, between, or above x5."""
    means = [_lognormal(mean, mean / 10.0) for mean in (2200.0, 2100.0, 2300.0, 2000.0)]
    load, spread = _lognormal(1200.0, 480.0)

    def chance(z: float) -> float:
        level = load + spread * z
        whole = [special.ndtr((level - mean) / width) for mean, width in means]
        half = [special.ndtr((level - np.log(2.0) - mean) / width) for mean, width in means]
        # g11 < 0: x4 below x5, and x2 or x3 below x5, and one of x2, x3, x4 below x5 / 2
        some = whole[3] * (1.0 - (1.0 - whole[1]) * (1.0 - whole[2]))
        none_half = (whole[3] - half[3]) * ((1.0 - half[1]) * (1.0 - half[2]) - (1.0 - whole[1]) * (1.0 - whole[2]))
        return float(whole[0] + (1.0 - whole[0]) * (some - none_half))

    return _over_normals(chance)


def _problem_91() -> float:
    """The strength is normal; the mean over the three loads by Gauss and Hermite."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(40)
    x3, x4, x5 = np.meshgrid(13.0 + 60.0 * nodes, 4751.0 + 48.0 * nodes, -684.0 + 11.0 * nodes, indexing="ij")
    share = np.einsum("i,j,k->ijk", weights, weights, weights) / weights.sum() ** 3
    stress = np.maximum(np.sqrt(x3**2 + x4**2 - x3 * x4 + 3.0 * x5**2), np.abs(x4))
    return float((share * special.ndtr((stress / 84e3 - 0.07433) / 0.005)).sum())


#: Probabilities of failure by the numbers of the problems.
PROBABILITIES: Mapping[str, Callable[[], float]] = {
    "axial beam": _axial_beam,
    "problem 8": _problem_8,
    "problem 22": lambda: _over_normals(lambda z: special.ndtr(-(2.5 + 0.2 * z * z))),
    "problem 25": _problem_25,
    "problem 31": lambda: _over_normals(lambda z: special.ndtr(-2.0 - 256.0 * z**4)),
    "problem 35": _problem_35,
    "problem 53": _problem_53,
    "problem 55": _problem_55,
    "problem 60": _problem_60,
    "problem 75": lambda: _product(3.0, both=False),
    "problem 91": _problem_91,
    "problem 107": lambda: float(special.ndtr(-5.0)),
    "problem 111": lambda: _product(12.5, both=True),
}


def _as_row(number: Callable[[], float]) -> Callable[[Array], Mapping[str, Array]]:
    return lambda _: {"probability": np.array([[number()]])}


#: Third solutions by the names that rows of ``runs*.toml`` give.
QUANTITIES: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    name: _as_row(number) for name, number in PROBABILITIES.items()
}
