"""Third solutions of frequencies: finite elements of beams in NumPy, a characteristic equation, power series."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize

from tests.oracles.rotating_beam import frequencies as of_rotating_beam

Array = NDArray[np.float64]
SCENES = Path(__file__).parents[3] / "examples" / "verification"


def _cubic(x: Array, size: float) -> tuple[Array, Array, Array]:
    """Return cubic shape functions of an element at x from 0 to 1, with their first and second derivatives, (4, n)."""
    far = 3 * x**2 - 2 * x**3
    slope = 6 * x - 6 * x**2
    shapes = np.array([1 - far, size * (x - 2 * x**2 + x**3), far, size * (x**3 - x**2)])
    slopes = np.array([-slope, size * (1 - 4 * x + 3 * x**2), slope, size * (3 * x**2 - 2 * x)]) / size
    bends = np.array([12 * x - 6, size * (6 * x - 4), 6 - 12 * x, size * (6 * x - 2)]) / size**2
    return shapes, slopes, bends


def clamped_beam(
    length: float,
    stiffness: Callable[[Array], Array],
    mass: Callable[[Array], Array],
    end: Array,
    elements: int = 60,
) -> Array:
    """Return the frequencies, Hz, of a clamped beam with properties over s from 0 to 1, and a mass matrix (2, 2) at its
    end; cubic elements whose properties are integrated by Gauss's rule."""
    points, weights = np.polynomial.legendre.leggauss(6)
    x, weights = 0.5 * (points + 1.0), 0.5 * weights
    size = length / elements
    shapes, _, bends = _cubic(x, size)
    K, M = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for first in range(elements):
        s, part = (first + x) / elements, slice(2 * first, 2 * first + 4)
        K[part, part] += (bends * (size * weights * stiffness(s))) @ bends.T
        M[part, part] += (shapes * (size * weights * mass(s))) @ shapes.T
    M[-2:, -2:] += end
    return np.asarray(np.sqrt(linalg.eigh(K[2:, 2:], M[2:, 2:], eigvals_only=True)) / (2.0 * np.pi))


def nrel_tower(count: int) -> Array:
    """Return the lowest frequencies of the tower of the NREL 5 MW turbine, a tapered tube, in both planes."""

    def wall(s: Array) -> tuple[Array, Array]:
        outer = 6.0 + (3.87 - 6.0) * s
        return outer, outer - 2.0 * (0.0351 + (0.0247 - 0.0351) * s)

    def stiffness(s: Array) -> Array:
        outer, inner = wall(s)
        return np.asarray(210e9 * np.pi / 64.0 * (outer**4 - inner**4))

    def mass(s: Array) -> Array:
        outer, inner = wall(s)
        return np.asarray(8500.0 * np.pi / 4.0 * (outer**2 - inner**2))

    top, along, across = 347310.0, 1.96256, 0.41378
    ends = [
        np.array([[top, top * along], [top * along, inertia]])
        for inertia in (4.37e7 + top * along**2, 2.353e7 + top * (along**2 + across**2))
    ]
    return np.sort(np.concatenate([clamped_beam(87.6, stiffness, mass, end) for end in ends]))[:count]


def iea_tower(count: int) -> Array:
    """Return the lowest frequencies of monopile and tower of the IEA 15 MW turbine, in both planes."""
    file = SCENES / "pybmodes" / "iea_tower.csv"
    span, mass, bending = np.loadtxt(file, delimiter=",", skiprows=2).T
    top, along, across = 919540.0, 4.349459, 0.41378
    ends = [
        np.array([[top, top * along], [top * along, inertia]])
        for inertia in (1.1742e8 + top * along**2, 6.3223e7 + top * (along**2 + across**2))
    ]

    def frequencies(end: Array) -> Array:
        return clamped_beam(174.386, lambda s: np.interp(s, span, bending), lambda s: np.interp(s, span, mass), end)

    return np.sort(np.concatenate([frequencies(end) for end in ends]))[:count]


def blade(name: str, length: float, hub: float, rpm: float, count: int = 3, elements: int = 60) -> Array:
    """Return the lowest frequencies of a blade that turns: elements that bend in both planes, with sections of a table,
    linear between its rows."""
    file, speed = SCENES / "pybmodes" / f"{name}.csv", rpm * np.pi / 30.0
    span, twist, mass, flap, edge = np.loadtxt(file, delimiter=",", skiprows=2).T
    points, weights = np.polynomial.legendre.leggauss(12)
    x, weights = 0.5 * (points + 1.0), 0.5 * weights
    size = length / elements
    shapes, slopes, bends = _cubic(x, size)
    fine = np.linspace(0.0, 1.0, 200001)
    pull = np.interp(fine, span, mass) * (hub + length * fine) * length * speed**2
    pull = np.concatenate([[0.0], np.cumsum(0.5 * (pull[1:] + pull[:-1]) * np.diff(fine))])
    K, M = np.zeros((2, 4 * elements + 4, 4 * elements + 4))
    for first in range(elements):
        s = (first + x) / elements
        angle = np.radians(np.interp(s, span, twist))
        soft, stiff = np.interp(s, span, flap), np.interp(s, span, edge)
        out_of = [4 * first, 4 * first + 1, 4 * first + 4, 4 * first + 5]
        within = [index + 2 for index in out_of]
        own = (shapes * (size * weights * np.interp(s, span, mass))) @ shapes.T
        tension = (slopes * (size * weights * (pull[-1] - np.interp(s, fine, pull)))) @ slopes.T
        for rows, columns, stiffness in (
            (out_of, out_of, soft * np.cos(angle) ** 2 + stiff * np.sin(angle) ** 2),
            (within, within, soft * np.sin(angle) ** 2 + stiff * np.cos(angle) ** 2),
            (out_of, within, (soft - stiff) * np.sin(angle) * np.cos(angle)),
            (within, out_of, (soft - stiff) * np.sin(angle) * np.cos(angle)),
        ):
            K[np.ix_(rows, columns)] += (bends * (size * weights * stiffness)) @ bends.T
        K[np.ix_(out_of, out_of)] += tension
        K[np.ix_(within, within)] += tension - speed**2 * own
        M[np.ix_(out_of, out_of)] += own
        M[np.ix_(within, within)] += own
    return np.asarray(np.sqrt(linalg.eigh(K[4:, 4:], M[4:, 4:], eigvals_only=True))[:count] / (2.0 * np.pi))


def tower_with_top_mass(count: int) -> Array:
    """Return the frequencies of a uniform tower whose top mass is its own mass, by its characteristic equation."""

    def end(x: float) -> float:
        cosh, sinh = np.cosh(x), np.sinh(x)
        return float((1.0 + np.cos(x) * cosh + x * (np.cos(x) * sinh - np.sin(x) * cosh)) / cosh)

    grid = np.linspace(0.5, np.pi * (count + 0.5), 400)
    signs = np.sign([end(x) for x in grid])
    roots = [optimize.brentq(end, grid[i], grid[i + 1], xtol=1e-14) for i in np.flatnonzero(np.diff(signs))[:count]]
    return np.asarray(np.square(roots) * np.sqrt(5e10 / (5000.0 * 80.0**4)) / (2.0 * np.pi))


def uniform_blade(speed: float, count: int) -> Array:
    """Return the frequencies of a uniform blade that turns, flapwise and lagwise, by power series."""
    units = [np.sqrt(stiffness / (100.0 * 31.623**4)) for stiffness in (1e8, 1e9)]
    found = [
        unit * float(value)
        for unit, in_plane in zip(units, (False, True), strict=True)
        for value in of_rotating_beam(count, speed / unit, in_plane=in_plane, digits=16)
    ]
    return np.sort(np.array(found))[:count] / (2.0 * np.pi)


def two_discs(speed: float) -> Array:
    """Return the frequencies, rad/s, of the shaft with two discs at a speed, by transfer matrices of Timoshenko's beam.

    Deflections are in the complex plane, in which forward and backward whirl have frequencies above and below 0."""
    elastic, shear, density, diameter, width, bearing = 211e9, 81.2e9, 7810.0, 0.05, 0.07, 1e6
    area, second, poisson = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64, elastic / (2 * shear) - 1
    stiff = shear * area * 6 * (1 + poisson) / (7 + 6 * poisson)

    def end(w: float) -> float:
        tilting = w * w - 2 * speed * w
        rates = np.zeros((4, 4))  # of deflection, slope, moment and force
        rates[0, 1], rates[0, 3], rates[1, 2], rates[2, 3] = 1.0, 1.0 / stiff, 1.0 / (elastic * second), -1.0
        rates[2, 1], rates[3, 0] = -density * second * tilting, -density * area * w * w
        field = linalg.expm(0.5 * rates)
        both = field @ np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [bearing, 0.0]])
        for size in (0.28, 0.35):
            mass, radii = density * width * np.pi * (size**2 - diameter**2) / 4, size**2 + diameter**2
            across, along = mass * (radii / 16 + width**2 / 12), mass * radii / 8
            both[3] -= mass * w * w * both[0]
            both[2] -= (across * w * w - along * speed * w) * both[1]
            both = field @ both
        return float(np.linalg.det([both[2], both[3] + bearing * both[0]]))

    grid = np.arange(-1000.5, 1000.0)
    signs = np.sign([end(w) for w in grid])
    roots = [optimize.brentq(end, grid[i], grid[i + 1], xtol=1e-12) for i in np.flatnonzero(np.diff(signs))]
    return np.sort(np.abs(roots))


def _as_row(numbers: Callable[[], Array]) -> Callable[[Array], Mapping[str, Array]]:
    return lambda _: {"frequencies": numbers()[None]}


#: Third solutions by the names that rows of ``runs*.toml`` give.
FREQUENCIES: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    "NREL tower": _as_row(lambda: nrel_tower(6)),
    "NREL blade at rest": _as_row(lambda: blade("nrel_blade", 61.5, 1.5, 0.0)),
    "NREL blade": _as_row(lambda: blade("nrel_blade", 61.5, 1.5, 12.1)),
    "IEA blade": _as_row(lambda: blade("iea_blade", 117.0, 3.97, 7.55)),
    "IEA tower": _as_row(lambda: iea_tower(4)),
    "tower with top mass": _as_row(lambda: tower_with_top_mass(4)),
    "uniform blade at rest": _as_row(lambda: uniform_blade(0.0, 5)),
    "two discs at rest": _as_row(lambda: two_discs(0.0)),
    "two discs": _as_row(lambda: two_discs(4000.0 * np.pi / 30.0)),
    "uniform blade": _as_row(lambda: uniform_blade(6.0, 5)),
}
