"""Radar images of a sea: velocity bunching of a synthetic aperture, its statistics, and specular points.

A platform flies along +x (azimuth) at a speed V and looks from the side at slant range R; a facet with the velocity u_r
towards the radar appears at x + (R/V) u_r. Particles are followed, so the image is a map of labels, and brightness is
the ratio of two Jacobians: no expansion about mean water, and caustics at the zeros of one of them.
Sources: Hasselmann and Hasselmann, JGR 96 (1991) 10713 (linear transfer and cut-off); Kerbaol, Chapron and Vachon, JGR
103 (1998) 7833 (azimuth cut-off); Kodis, IEEE Trans. AP 14 (1966) 77 (specular points).
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicHermiteSpline

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call, checked_calls
from eomgen.base.data import dataclass
from eomgen.base.rounding import SUMMED, WRITTEN
from eomgen.errors import Problem, UsageError
from eomgen.products.waves.sea_states.components import DiscreteSpectrum
from eomgen.products.waves.sea_states.spectra import STANDARD_GRAVITY, check_number, check_whole
from eomgen.products.waves.second_order.profiles import Profile
from eomgen.products.waves.second_order.sea import Sea

#: Labels of an image at most, and cells of a line.
_MOST_LABELS, _MOST_CELLS = 3e7, 10_000_000


@checked_calls()
@dataclass(frozen=True)
class Radar:
    """A radar with a synthetic aperture.

    Attributes
    ----------
    range_to_velocity : float, s
        Slant range over the platform's speed: about 30 s from an aeroplane, 120 s from a satellite.
    incidence : float, rad
        Angle of the line of sight from the vertical; the line of sight points to -y and up.
    """

    range_to_velocity: float
    incidence: float

    def __post_init__(self) -> None:
        if not self.range_to_velocity >= 0.0 or not math.isfinite(self.range_to_velocity):
            raise UsageError(Problem("Radar: range_to_velocity", f"{self.range_to_velocity:.6g} s is below 0 [E1207]"))
        if not 0.0 <= self.incidence < 0.5 * math.pi:
            fault = f"{self.incidence:.6g} rad is not from 0 to below pi/2 [E1208]"
            raise UsageError(Problem("Radar: incidence", fault, "the angle from the vertical, 0.4 for 23 degrees"))

    @property
    def sight(self) -> Array:
        """Unit vector from the sea to the radar."""
        return np.array([0.0, -math.sin(self.incidence), math.cos(self.incidence)])

    # -- images -----------------------------------------------------------------------------------------------------

    def bunching(self, sea: Sea, labels: ArrayLike, time: float) -> tuple[Array, Array]:
        """Return the image points of facets and their intensities.

        The intensity is |J/J'|: J is the Jacobian of places by labels, J' the Jacobian of image points by labels.
        Intensities of facets with the same image point are not added.

        Parameters
        ----------
        sea : Sea
            The sea.
        labels : array_like
            Labels (points, 2) of facets of the surface, m; UsageError for another shape or numbers that are not finite.
        time : float
            Time, s.

        Returns
        -------
        points : (points, 2) ndarray
            Image points, m: x (azimuth) of a facet plus ``range_to_velocity`` times its velocity towards the radar, and
            y (ground range) of the facet.
        intensities : (points,) ndarray
            Infinite on caustics.
        """
        labels = np.asarray(labels, dtype=float)
        here, first = sea.motion(labels, time), sea.derivatives(labels, time)[0]
        image = here.position[:, :2].copy()
        image[:, 0] += self.range_to_velocity * (here.velocity @ self.sight)
        # derivatives of velocities by labels: of fourth order, at distances of an 80th of the shortest wave
        step = 2.0 * math.pi / np.hypot(*sea.vectors.T).max() / 80.0
        change = np.zeros((len(labels), 2))
        for axis, move in enumerate(step * np.eye(2)):
            for offset, weight in ((-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)):
                seen = sea.motion(labels + offset * move, time).velocity @ self.sight
                change[:, axis] += weight * seen / (12.0 * step)
        moved = first[:, :2].copy()
        moved[:, 0] += self.range_to_velocity * change
        with np.errstate(divide="ignore"):
            return image, np.abs(np.linalg.det(first[:, :2]) / np.linalg.det(moved))

    def image(self, sea: Sea, time: float, columns: ArrayLike, rows: ArrayLike, labels_per_cell: int = 3) -> Array:
        """Return the intensity of cells between edges, of facets that all scatter alike: 1 on average.

        Labels on a grid carry the area of a patch of sea to an image point, so that caustics conserve energy; labels
        extend beyond the edges by four standard deviations of the displacement of facets.

        Parameters
        ----------
        sea : Sea
            The sea.
        time : float
            Time, s.
        columns, rows : array_like
            Edges along x (azimuth) and y (ground range), increasing, equally spaced, m.
        labels_per_cell : int
            Labels of each cell along each direction.

        Returns
        -------
        (rows - 1, columns - 1) ndarray
            Intensities.

        Raises
        ------
        UsageError
            Edges that do not increase by equal widths, a time that is not finite, ``labels_per_cell`` that is not a
            whole number from 1 to 1000, or more than 3e7 labels.
        """
        x, y = _edges("columns", columns), _edges("rows", rows)
        check_number("Radar.image: time", time, "s")
        check_whole("Radar.image: labels_per_cell", labels_per_cell, 1, 1000, "3")
        spacing = np.array([x[1] - x[0], y[1] - y[0]]) / labels_per_cell
        w, k = sea.frequency, np.hypot(*sea.vectors.T)
        moved = np.sqrt(0.5 * np.sum(sea.amplitude**2 / np.tanh(np.minimum(k * sea.depth, 700.0)) ** 2))
        seen = np.sqrt(0.5 * np.sum((sea.amplitude * w) ** 2 / np.tanh(np.minimum(k * sea.depth, 700.0)) ** 2))
        reach = 4.0 * np.array([moved + self.range_to_velocity * seen, moved])
        count = np.prod((np.array([np.ptp(x), np.ptp(y)]) + 2.0 * reach) / spacing)
        if count > _MOST_LABELS:
            fault = f"{count:.3g} labels are needed, more than {_MOST_LABELS:.0e}"
            fault = f"{fault}: facets move by up to {reach[0]:.4g} m [E1209]"
            raise UsageError(Problem("Radar.image", fault, "larger cells, fewer labels_per_cell, or a smaller R/V"))
        a, b = (
            np.arange(edges[0] - far + 0.5 * step, edges[-1] + far, step)
            for edges, far, step in zip((x, y), reach, spacing, strict=True)
        )
        total = np.zeros((len(y) - 1, len(x) - 1))
        for row in np.array_split(b, max(1, len(a) * len(b) // 100_000)):
            labels = np.stack(np.meshgrid(a, row), axis=-1).reshape(-1, 2) - (sea.current + sea.drift) * time
            motion, first = sea.motion(labels, time), sea.derivatives(labels, time)[0]
            area = np.abs(np.linalg.det(first[:, :2])) * spacing[0] * spacing[1]
            azimuth = motion.position[:, 0] + self.range_to_velocity * (motion.velocity @ self.sight)
            total += np.histogram2d(motion.position[:, 1], azimuth, (y, x), weights=area)[0]
        return np.asarray(total / np.outer(np.diff(y), np.diff(x)))

    def line(self, profile: Profile, length: float, cells: int, direction: Literal[1, -1] = 1) -> Array:
        """Return the intensity of a line of cells, over the length after which a sea along the flight repeats itself.

        Facets are displaced by ``range_to_velocity`` times their velocity towards the radar, modulo ``length``, and a
        cell adds up the facets in it.

        Parameters
        ----------
        profile : Profile
            Surface of the sea along the direction of the waves, which is taken to be along the flight.
        length : float
            Length over which the labels of ``profile`` extend, m; not compared with ``profile``.
        cells : int
            Number of cells, of equal width from x = 0 on.
        direction : int, optional
            1 for waves that run with the platform, -1 for waves against the platform.

        Returns
        -------
        (cells,) ndarray
            Intensities, 1 on average.

        Raises
        ------
        UsageError
            A ``length`` not above 0, ``cells`` that are not a whole number from 1 to 1e7, another ``direction``.
        """
        check_number("Radar.line: length", length, "m", "that after which the sea repeats itself", above_zero=True)
        check_whole("Radar.line: cells", cells, 1, _MOST_CELLS, "400")
        _check_direction("Radar.line", direction)
        moved = direction * profile.x + self.range_to_velocity * math.cos(self.incidence) * profile.w
        weights = np.abs(profile.xa) * length / len(profile.labels)
        result, _ = np.histogram(np.mod(moved, length), cells, (0.0, length), weights=weights)
        return np.asarray(result * cells / length)

    # -- statistics of first order ----------------------------------------------------------------------------------

    def velocity_deviation(self, spectrum: DiscreteSpectrum, gravity: float = STANDARD_GRAVITY) -> float:
        """Return the standard deviation of the surface's velocities of first order towards the radar, in deep water.

        Parameters
        ----------
        spectrum : DiscreteSpectrum
            The sea.
        gravity : float, optional
            In m/s^2.

        Returns
        -------
        float
            In m/s.

        Raises
        ------
        UsageError
            The wave with the most energy feels the bottom; longer waves are not checked.
        """
        spectrum.check_deep("Radar.velocity_deviation", "velocities of realisations, by Sea.motion")
        _check_gravity("Radar.velocity_deviation", gravity)
        k = np.hypot(*spectrum.vectors.T)
        across = math.sin(self.incidence) * spectrum.vectors[:, 1] / k
        square = spectrum.energy * gravity * k * (across**2 + math.cos(self.incidence) ** 2)
        return math.sqrt(float(square.sum()))

    def cutoff(self, spectrum: DiscreteSpectrum, gravity: float = STANDARD_GRAVITY) -> float:
        """Return the shortest wave length along the flight that an image shows.

        It is pi R/V times the deviation of velocities.

        Parameters
        ----------
        spectrum : DiscreteSpectrum
            The sea.
        gravity : float, optional
            In m/s^2.

        Returns
        -------
        float
            Wave length, m.
        """
        return math.pi * self.range_to_velocity * self.velocity_deviation(spectrum, gravity)

    def fold_probability(self, spectrum: DiscreteSpectrum, gravity: float = STANDARD_GRAVITY) -> float:
        """Return the part of labels at which the image of a deep sea of first order along the flight is folded over.

        Parameters
        ----------
        spectrum : DiscreteSpectrum
            The sea.
        gravity : float, optional
            In m/s^2.

        Returns
        -------
        float
            From 0 to 0.5.

        Raises
        ------
        UsageError
            Waves that run not along x, forwards or backwards; the wave with the most energy feels the bottom.
        """
        k, change = self._along_the_flight(spectrum, gravity, "fold_probability")
        variance = float(np.sum(spectrum.energy * (k * change) ** 2))
        return 0.5 * math.erfc(1.0 / math.sqrt(2.0 * variance)) if variance else 0.0

    def intensity_spectrum(
        self, spectrum: DiscreteSpectrum, length: float, count: int, gravity: float = STANDARD_GRAVITY
    ) -> Array:
        """Return the mean image spectrum of a deep sea along the flight, at wave numbers 2 pi n/length, n from 1 to
        ``count``: the mean of |sum over the line of I exp(-i k x') dx'/length|^2, exact for first-order seas.

        Facets are moved by a Gaussian process D of labels, and cover 1 + g of the plane; over the lag r

            P(k) = 1/length integral of [(1 + i k S)^2 + G] exp(-k^2 V/2 - i k r) dr

        with V the variance of D(r) - D(0), G the covariance of g, S the covariance of -g and D(r) - D(0) (the integral
        transform of Hasselmann and Hasselmann, with facets that move along as well).

        Parameters
        ----------
        spectrum : DiscreteSpectrum
            The sea.
        length : float
            Length after which the sea repeats itself, m: all wave numbers are multiples of 2 pi/length.
        count : int
            Number of wave numbers.
        gravity : float, optional
            In m/s^2.

        Returns
        -------
        (count,) ndarray
            Mean over the realisations of the spectrum; without a unit, because intensities are 1 on average.

        Raises
        ------
        UsageError
            Waves that run not along x, forwards or backwards, or that do not repeat themselves after this length; the
            wave with the most energy feels the bottom; a ``length`` not above 0; a ``count`` that is not a whole number
            from 1 on, or needs more than 1e9 terms.
        """
        k, change = self._along_the_flight(spectrum, gravity, "intensity_spectrum")
        check_number("Radar.intensity_spectrum: length", length, "m", above_zero=True)
        check_whole("Radar.intensity_spectrum: count", count, 1, _MOST_CELLS, "100")
        multiple = k * length / (2.0 * math.pi)
        if np.any(np.abs(multiple - np.rint(multiple)) > WRITTEN):
            fault = f"the waves do not repeat themselves after {length:.6g} m [E1210]"
            hint = "the length that discretized(spectrum, length=...) had; 2 pi over the distance of two wave numbers"
            raise UsageError(Problem("Radar.intensity_spectrum: length", fault, hint))
        wanted = 2.0 * math.pi / length * np.arange(1, count + 1)
        moved = math.sqrt(float(np.sum(spectrum.energy * change**2)))
        # lags that resolve the wave number asked for, the sea, and the decay of exp(-k^2 V/2)
        finest = max(4.0 * wanted[-1], 4.0 * float(k.max()) * (1.0 + float(wanted[-1]) * moved))
        points = 2 ** math.ceil(math.log2(finest * length / math.pi))
        if points * count > 1e9:
            fault = f"{count} wave numbers need {points} lags each [E1211]"
            raise UsageError(Problem("Radar.intensity_spectrum: count", fault, "fewer, or a shorter length"))
        lag = length / points * np.arange(points)
        V, S, G = np.zeros(points), np.zeros(points), np.zeros(points)
        for k_j, m_j, energy in zip(k, change, spectrum.energy, strict=True):
            cosine = np.cos(k_j * lag)
            V += 2.0 * energy * m_j**2 * (1.0 - cosine)
            S += energy * k_j * m_j * np.sin(k_j * lag)
            G += energy * k_j**2 * cosine
        result = [np.mean(((1.0 + 1j * K * S) ** 2 + G) * np.exp(-0.5 * K**2 * V - 1j * K * lag)).real for K in wanted]
        return np.array(result)

    def critical_amplitude(
        self, wave_number: float, direction: Literal[1, -1] = 1, gravity: float = STANDARD_GRAVITY
    ) -> float:
        """Return the amplitude from which on the image of one deep wave of first order along the flight has caustics.

        Parameters
        ----------
        wave_number : float
            In rad/m, above 0.
        direction : int, optional
            1 for a wave that runs with the platform, -1 against it.
        gravity : float, optional
            In m/s^2.

        Returns
        -------
        float
            Amplitude, m, without a check whether a wave of this length can be so high; infinite if the displacements of
            facets and of their image cancel.
        """
        check_number("Radar.critical_amplitude: wave_number", wave_number, "rad/m", "0.04", above_zero=True)
        _check_direction("Radar.critical_amplitude", direction)
        _check_gravity("Radar.critical_amplitude", gravity)
        change = self._change(np.array([math.sqrt(gravity * wave_number)]), np.array([float(direction)]))
        return 1.0 / (wave_number * abs(float(change[0]))) if change[0] else math.inf

    def _along_the_flight(self, spectrum: DiscreteSpectrum, gravity: float, name: str) -> tuple[Array, Array]:
        """Return wave numbers (n,), rad/m, and, (n,), the multiple of each amplitude by which a facet is moved along
        the waves. Raises UsageError at the method ``name`` for waves across the flight, or that feel the bottom."""
        k = np.hypot(*spectrum.vectors.T)
        if np.any(np.abs(spectrum.vectors[:, 1]) > SUMMED * k):
            fault = "waves run across the flight; there is a closed form for those along x alone [E1212]"
            raise UsageError(Problem(f"Radar.{name}", fault, "bunching(sea, labels, time), or heading = 0"))
        spectrum.check_deep(f"Radar.{name}", "bunching(sea, labels, time) of realisations")
        _check_gravity(f"Radar.{name}", gravity)
        return k, self._change(np.sqrt(gravity * k), np.sign(spectrum.vectors[:, 0]))

    def _change(self, w: Array, direction: Array) -> Array:
        """Return, for frequencies w (n,) and directions (n,) of 1 or -1, the multiple of k A cos(theta) by which the
        derivative of the image point by the label differs from 1."""
        return direction * self.range_to_velocity * w * math.cos(self.incidence) - 1.0

    def backscatter(self, slope_density: float, reflectivity: float = 1.0) -> float:
        """Return the normalised cross section of specular points near the vertical, pi |R|^2 f / cos(incidence)^4.

        Parameters
        ----------
        slope_density : float
            Joint density f of both slopes at (tan(incidence) towards the radar, 0 across), not below 0: the density
            ``SeaStatistics.slope_density`` along the waves, times the density of slopes across them at 0.
        reflectivity : float, optional
            |R|^2 of water at normal incidence, not below 0.

        Returns
        -------
        float
            Cross section over area.

        Raises
        ------
        UsageError
            An argument below 0.
        """
        for name, value in (("slope_density", slope_density), ("reflectivity", reflectivity)):
            if not value >= 0.0:
                raise UsageError(Problem(f"Radar.backscatter: {name}", f"{value:.6g} is below 0 [E1213]"))
        return math.pi * reflectivity * slope_density / math.cos(self.incidence) ** 4


@dataclass(frozen=True)
class SpecularPoints:
    """Points of a profile with one slope: labels, places x and heights z in m, and the profile's curvature in 1/m."""

    labels: Array
    x: Array
    z: Array
    curvature: Array


@checked_call()
def specular_points(profile: Profile, slope: float) -> SpecularPoints:
    """Return the points of a profile that have a slope.

    They are roots of dz - slope dx between labels, on the cubics through values and derivatives at the labels. No root
    is sought between the last label and the repetition of the first.

    Parameters
    ----------
    profile : Profile
        Surface of a sea of one direction.
    slope : float
        The slope dz/dx; UsageError if not finite.

    Returns
    -------
    SpecularPoints
        Labels, places, heights and curvatures, by increasing label; empty arrays if no point is seen. Curvatures are
        linear between labels.
    """
    check_number("specular_points: slope", slope)
    off = CubicHermiteSpline(profile.labels, profile.za - slope * profile.xa, profile.zaa - slope * profile.xaa)
    roots = off.roots(extrapolate=False)
    labels = roots[np.isfinite(roots)]  # not a number if all slopes are equal
    x, z = (
        CubicHermiteSpline(profile.labels, values, rates)(labels)
        for values, rates in ((profile.x, profile.xa), (profile.z, profile.za))
    )
    return SpecularPoints(labels, x, z, np.interp(labels, profile.labels, profile.curvature))


def _edges(name: str, edges: ArrayLike) -> Array:
    result = np.asarray(edges, dtype=float)
    widths = np.diff(result) if result.ndim == 1 and len(result) > 1 else np.zeros(1)
    if not (widths.min() > 0.0 and np.ptp(widths) <= WRITTEN * widths.mean()):
        fault = f"cells are {widths.min():.6g} to {widths.max():.6g} m wide [E1215]"
        hint = "edges that increase and are equally spaced, np.linspace(0, 800, 81)"
        raise UsageError(Problem(f"Radar.image: {name}", fault, hint))
    return result


def _check_gravity(where: str, gravity: float) -> None:
    check_number(f"{where}: gravity", gravity, "m/s^2", f"{STANDARD_GRAVITY}", above_zero=True)


def _check_direction(where: str, direction: int) -> None:
    if direction not in (1, -1):
        fault = f"{direction!r} is none [E0829]"
        raise UsageError(Problem(f"{where}: direction", fault, "1 with the flight, -1 against it"))
