"""Stationary random inputs by the matrix of their cross-spectra; random roads under several wheels.

The wheel that follows by the distance d has the elevation w(t - d / V). Of two tracks at the distance b an isotropic
road has the cross-spectrum g G with g = 2 / Gamma(w/2) (pi n b)^(w/2) K_(w/2)(2 pi n b), K the modified Bessel
function, for a spectrum ~ n^-w (Kamash and Robson 1978, J. Sound Vib. 57(1), 89-100); 2 pi n b K_1(2 pi n b)
for w = 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass, field, replace
from eomgen.base.messages import shown
from eomgen.compiled.arguments import number_of
from eomgen.errors import Problem, UsageError
from eomgen.formula.units.labels import in_label
from eomgen.products.linear.spectra.road import Road, check_frequencies, check_positive


class Excitation(Protocol):
    """Stationary random inputs; an implementation may have ``bends``, (n,) Hz, frequencies of kinks of the spectra.

    Attributes
    ----------
    inputs : names of inputs or disturbances of the linear model
    rates : for some inputs, the names of inputs that are the time derivatives
    band : frequencies in Hz outside of which the spectra are zero
    name : in words, for titles
    """

    @property
    def inputs(self) -> tuple[str, ...]: ...
    @property
    def rates(self) -> dict[str, str]: ...
    @property
    def band(self) -> tuple[float, float]: ...
    @property
    def name(self) -> str: ...

    def cross_spectra(self, frequencies: Array) -> Complex:
        """Return the one-sided cross-spectra of the inputs.

        G[k, i, j] belongs to X_i conj(X_j), X being the Fourier transforms.

        Parameters
        ----------
        frequencies : ndarray
            Frequencies (nf,), Hz.

        Returns
        -------
        (nf, m, m) complex ndarray
            In unit_i unit_j / Hz.
        """


def check_excitation(where: str, given: object) -> None:
    """Raise an error for values that are not an excitation, such as the letter of a road class.

    Parameters
    ----------
    where : str
        Name of the call, for the message.
    given : object
        Value that is checked.

    Raises
    ------
    UsageError
        The value has no ``cross_spectra``; other attributes of an excitation are not checked.
    """
    if not hasattr(given, "cross_spectra"):
        letter = isinstance(given, str) and len(given) == 1
        fault = f"an excitation is needed, not {shown(given) if letter else type(given).__name__} [E0461]"
        road = f'RoadExcitation(Road("{given if letter else "C"}"), speed=20.0, wheels={{"road": 0.0}})'
        raise UsageError(Problem(where, fault, f"{road} of eomgen.spectra, with the names of your inputs"))


@dataclass(frozen=True)
class InputSpectrum:
    """One random input of a given power spectral density: a force, an acceleration of the base, noise of a sensor.

    Parameters
    ----------
    input : str
        Name of an input or a disturbance of the linear model: ``motor``, ``base.acceleration[2]``.
    frequencies, density : (n,), (n,)
        Hz, increasing, and unit^2/Hz; interpolated linearly in double logarithmic scales, zero outside.
    function : callable
        In place of ``density``: density at frequencies (n,); ``frequencies`` then is the band, a pair.

    Raises
    ------
    UsageError
        Arrays that are not a spectrum; a density and a function, or neither.
    """

    input: str
    frequencies: ArrayLike
    density: ArrayLike | None = None
    function: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        f = np.asarray(self.frequencies, dtype=float)
        title = f"InputSpectrum: {self.input}"
        if (self.density is None) == (self.function is None):
            raise UsageError(Problem(title, "it needs either a density or a function [E0462]", "density=[...]"))
        density = None if self.density is None else np.asarray(self.density, dtype=float)
        check_frequencies(title, f, "[1.0, 20.0, 100.0]", density)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The input, as a tuple."""
        return (self.input,)

    @property
    def rates(self) -> dict[str, str]:
        """Inputs that are time derivatives of other inputs: none."""
        return {}

    @property
    def band(self) -> tuple[float, float]:
        """First and last frequency, Hz."""
        f = np.asarray(self.frequencies, dtype=float)
        return float(f[0]), float(f[-1])

    @property
    def bends(self) -> Array:
        """Frequencies at which a density of points bends, Hz."""
        return np.asarray(self.frequencies if self.function is None else [], dtype=float)

    @property
    def name(self) -> str:
        """Name in words, for titles."""
        return f"random {self.input}"

    def cross_spectra(self, frequencies: Array) -> Complex:
        """Return the one-sided density of the input as a matrix of one entry.

        Parameters
        ----------
        frequencies : ndarray
            Frequencies (nf,), Hz.

        Returns
        -------
        (nf, 1, 1) complex ndarray
            In the input's unit squared per Hz; zero outside ``band``.

        Examples
        --------
        >>> from eomgen.spectra import InputSpectrum
        >>> InputSpectrum("push", [0.5, 5.0], [1e-2, 1e-2]).cross_spectra(np.array([1.0, 2.0])).shape
        (2, 1, 1)
        """
        low, high = self.band
        inside = (frequencies >= low) & (frequencies <= high)
        known = np.asarray(self.frequencies, dtype=float)
        if self.function is not None:
            values = np.asarray(self.function(np.clip(frequencies, low, high)), dtype=float)
        else:
            g = np.asarray(self.density, dtype=float)
            logarithms = np.log(np.where(g > 0.0, g, math.ulp(0.0)))
            values = np.exp(np.interp(np.log(np.clip(frequencies, low, high)), np.log(known), logarithms))
        result: Complex = np.where(inside, values, 0.0).astype(complex)[:, np.newaxis, np.newaxis]
        return result


_COHERENCES = ("isotropic", "independent", "equal")


@dataclass(frozen=True)
class RoadExcitation:
    """A road under wheels at a constant speed.

    Parameters
    ----------
    road : Road
        The road under all wheels.
    speed : float
        Speed, m/s.
    wheels : mapping
        Input of each wheel's elevation -> distance in m behind the first wheel: ``{"front": 0.0, "rear": 2.7}``.
    tracks : mapping
        Input -> lateral position of the wheel's track, m; 0 by default.
    coherence : ``isotropic``, ``independent``, ``equal``, or a number from 0 to 1
        Between different tracks: by the distance between tracks, none, full, or a constant over frequency.
    rates : mapping
        Input of a wheel's elevation -> input for the time derivative of the elevation, for dampers of tyres.

    Raises
    ------
    UsageError
        A speed that is not positive, no wheels, distances that are not finite, tracks or rates of unknown wheels, an
        unknown coherence, or an isotropic one between tracks of a road that is measured or has two exponents.
    """

    road: Road
    speed: float
    wheels: Mapping[str, float]
    tracks: Mapping[str, float] = field(default_factory=dict)
    coherence: str | float = "isotropic"
    rates: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the fields against each other; names of inputs are not compared with a model.

        Raises UsageError for a speed that is not positive, no wheels, distances that are not finite, tracks or rates
        of unknown wheels, and an unknown coherence. With wheels on several tracks also for the isotropic
        coherence (the default) of a measured road, which has no exponent, or of a road with two exponents.
        """
        check_positive("RoadExcitation: speed", self.speed, "speed=20.0, m/s")
        if not self.wheels:
            raise UsageError(Problem("RoadExcitation", "there are no wheels [E0471]", 'wheels={"front": 0.0}'))
        for signs, name in ((self.wheels, "wheels"), (self.tracks, "tracks")):
            for wheel, value in signs.items():
                number_of(f"RoadExcitation: {name}: {wheel}", value, "distance in m")
        for named, name in ((tuple(self.tracks), "tracks"), (tuple(self.rates), "rates")):
            for wheel in named:
                if wheel not in self.wheels:
                    fault = f"there is no wheel {ascii(wheel)[:64]} [E0470]"
                    raise UsageError(Problem(f"RoadExcitation: {name}", fault, f"one of {', '.join(self.wheels)}"))
        known = self.coherence in _COHERENCES if isinstance(self.coherence, str) else 0.0 <= self.coherence <= 1.0
        if not known:
            fault = f"{ascii(self.coherence)[:32]} is not a coherence between tracks [E0466]"
            raise UsageError(Problem("RoadExcitation", fault, f"{', '.join(_COHERENCES)}, or a number from 0 to 1"))
        has_one_exponent = not math.isnan(self.road.exponent) and self.road.long_exponent is None
        if self.coherence == "isotropic" and not has_one_exponent and len(set(self._places)) > 1:
            fault = "an isotropic road between tracks has one exponent, and a measured one none [E0467]"
            raise UsageError(Problem("RoadExcitation: coherence", fault, 'coherence="independent", or a number'))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the wheels' elevations."""
        return tuple(self.wheels)

    @property
    def band(self) -> tuple[float, float]:
        """Frequencies that the road's waves have at this speed, Hz."""
        return self.road.band[0] * self.speed, self.road.band[1] * self.speed

    @property
    def bends(self) -> Array:
        """Frequencies at which the spectrum of the elevation bends, Hz."""
        return self.road.bends * self.speed

    @property
    def name(self) -> str:
        """Road and speed in words."""
        return f"road of {self.road.name} at {self.speed:.6g} m/s"

    @property
    def delays(self) -> Array:
        """(m,) times by which the wheels follow, s."""
        return np.array(list(self.wheels.values()), dtype=float) / self.speed

    @property
    def lateral(self) -> Array:
        """(m, m) distances between the wheels' tracks, m."""
        places = np.array(self._places, dtype=float)
        return np.asarray(np.abs(places[:, np.newaxis] - places))

    @property
    def _places(self) -> list[float]:
        return [self.tracks.get(wheel, 0.0) for wheel in self.wheels]

    def at(self, speed: float | str | None = None, road: Road | None = None) -> RoadExcitation:
        """Return the same wheels at another speed, in m/s or as text with a unit, or on another road.

        Parameters
        ----------
        speed : float or str, optional
            Speed in m/s or as a text with a unit; unchanged if not given.
        road : Road, optional
            Another road; unchanged if not given.

        Returns
        -------
        RoadExcitation
            Of the same wheels, tracks, coherence and rates.

        Raises
        ------
        UsageError
            A speed that is not positive or a text without a unit of speed; a road that does not suit the coherence.

        Examples
        --------
        >>> from eomgen.spectra import Road, RoadExcitation
        >>> RoadExcitation(Road("C"), 20.0, {"front": 0.0, "rear": 2.7}).at("72 km/h").speed
        20.0
        """
        if isinstance(speed, str):
            speed = in_label("RoadExcitation: speed", speed, "m/s")
        return replace(self, speed=self.speed if speed is None else speed, road=road or self.road)

    def between_tracks(self, frequencies: Array) -> Array:
        """Return the cross-spectra of elevations at the same distance along the road over the spectrum of one wheel.

        Between tracks: the number ``coherence``, 0 for ``independent``, 1 for ``equal``; for ``isotropic`` a value that
        falls from 1 with distance and frequency.

        Parameters
        ----------
        frequencies : ndarray
            Frequencies (nf,), Hz, zero or above.

        Returns
        -------
        (nf, m, m) ndarray
            Real, without the delays of wheels, in the order of ``inputs``; 1 on the diagonal and between wheels in the
            same track.

        Examples
        --------
        >>> from eomgen.spectra import Road, RoadExcitation
        >>> wheels = RoadExcitation(Road("C"), 20.0, {"left": 0.0, "right": 0.0}, {"right": 1.4}, "equal")
        >>> wheels.between_tracks(np.array([5.0]))[0]
        array([[1., 1.],
               [1., 1.]])
        """
        if self.coherence != "isotropic":
            constant = {"equal": 1.0, "independent": 0.0}.get(str(self.coherence))
            between = np.where(self.lateral == 0.0, 1.0, float(self.coherence) if constant is None else constant)
            return np.broadcast_to(between, (len(frequencies), *between.shape))
        from scipy.special import gamma, kv  # noqa: PLC0415  # slow to import

        order = self.road.exponent / 2.0
        waves = 2.0 * np.pi * frequencies[:, np.newaxis, np.newaxis] / self.speed * self.lateral
        bessel = np.asarray(kv(order, waves), dtype=float)  # infinite as waves go to 0, and the product goes to 1
        ratio: Array = 2.0 / float(gamma(order)) * (waves / 2.0) ** order * np.where(np.isinf(bessel), 0.0, bessel)
        return np.asarray(np.where(np.isinf(bessel), 1.0, ratio))

    def phases(self, frequencies: Array) -> Complex:
        """Return e^(-2 pi i f d / V) of each wheel, its delay in the frequency domain: d / V is in ``delays``.

        Parameters
        ----------
        frequencies : ndarray
            Frequencies (nf,), Hz.

        Returns
        -------
        (nf, m) complex ndarray
            Of modulus 1, in the order of ``inputs``.

        Examples
        --------
        >>> from eomgen.spectra import Road, RoadExcitation
        >>> wheels = RoadExcitation(Road("C"), 20.0, {"front": 0.0, "rear": 2.0})
        >>> wheels.phases(np.array([5.0])).real.round(6)   # the rear follows by half a period
        array([[ 1., -1.]])
        """
        result: Complex = np.exp(-2j * np.pi * np.asarray(frequencies)[:, np.newaxis] * self.delays)
        return result

    def cross_spectra(self, frequencies: Array) -> Complex:
        """Return the one-sided cross-spectra of the elevations under the wheels.

        Parameters
        ----------
        frequencies : ndarray
            Frequencies (nf,), Hz, zero or above.

        Returns
        -------
        (nf, m, m) complex ndarray
            In m^2/Hz, in the order of ``inputs``, zero outside ``band``. Entry [k, i, j] belongs to X_i conj(X_j), X
            being the Fourier transforms.

        Examples
        --------
        >>> from eomgen.spectra import Road, RoadExcitation
        >>> wheels = RoadExcitation(Road("C"), 20.0, {"front": 0.0, "rear": 2.7})
        >>> wheels.cross_spectra(np.array([1.0, 2.0, 4.0])).shape
        (3, 2, 2)
        """
        phases = self.phases(frequencies)
        spectrum = self.road.over_time(frequencies, self.speed)[:, np.newaxis, np.newaxis]
        result: Complex = (
            spectrum * self.between_tracks(frequencies) * phases[:, :, np.newaxis] * phases.conj()[:, np.newaxis, :]
        )
        return result
