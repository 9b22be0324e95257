"""Waves as functions of place and time: elevation, slope, velocity and acceleration of the water.

A component of wave vector k, frequency w and amplitude A over water of depth h (Airy; Dean and Dalrymple, Water Wave
Mechanics for Engineers and Scientists, 1991, chapter 3):

    eta = A cos(th),  th = k.x - w t + phase,
    u = A w (k/|k|) cosh |k|(z + h)/sinh |k|h cos(th),  w = A w sinh |k|(z + h)/sinh |k|h sin(th),

z from the water at rest. Accelerations are measured at a place that rests. Bound waves of second order are components
with a potential that does not follow from the amplitude.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.words import Word

Stretching = Literal["wheeler", "none"]
#: From k h on the bottom is too deep to be felt: exp(-2 k h) is below the last digit.
_DEEP = 20.0
#: Product of depth and wave number above which a wave vanishes at depth: the exponential is kept above 0, since b is
#: divided by it.
LEAST = 300.0


class WaveComponent(NamedTuple):
    """One wave: its vector in rad/m, frequency in rad/s, amplitude in m, phase in rad, and the amplitude of its
    potential at z = 0 in m^2/s, which is A g/w of a free wave."""

    kx: float
    ky: float
    frequency: float
    amplitude: float
    phase: float
    potential: float


@dataclass(frozen=True)
class WaveField:
    """The waves of one sea.

    Attributes
    ----------
    depth : m; infinite if there is no bottom
    level : z of the water at rest in the world, m
    ramp : time in which the amplitudes grow from 0 at t = 0, s; 0 for waves that are there from the beginning
    stretching : motion between the water at rest and the surface: ``wheeler`` takes z - eta, shrunk to the depth, for
        z; ``none`` takes z unchanged, so that short waves grow exponentially. Above the surface
        (``none``: and above the water at rest) the motion is equal to the motion at the surface, and below the bottom
        to the motion at the bottom
    free : number of free waves, which come first; bound waves follow. None for all
    factor : of all amplitudes, a formula of tunable parameters; bound waves have the square of this factor. None for 1
    variables : tunable parameters, two for each free wave: the factor z1 + i z2 of amplitude times exp(i phase). None
        for waves that do not change from run to run
    drawn : for each component the free waves of which it is composed, and the sign of the second phase; -1 and 1 for
        none
    seed : of the values that the variables have by default
    """

    name: str
    components: tuple[WaveComponent, ...]
    depth: float
    level: float
    ramp: float
    stretching: Stretching
    free: int | None = None
    factor: Formula | None = None
    variables: tuple[str, ...] = ()
    drawn: tuple[tuple[int, int, int], ...] = ()
    seed: int = 0

    @property
    def bound(self) -> NDArray[np.bool_]:
        """Whether each component is a bound wave of second order, shape (components,)."""
        return np.arange(len(self.components)) >= (len(self.components) if self.free is None else self.free)

    @property
    def extra_arguments(self) -> tuple[Formula, ...]:
        """Arguments of quantities after the time: the factor of amplitudes, and the variables."""
        factor = () if self.factor is None else (self.factor,)
        return (*factor, *(Symbol("parameter", name) for name in self.variables))

    def __str__(self) -> str:
        return f"{len(self.components)} waves"

    @cached_property
    def columns(self) -> dict[str, tuple[float, ...]]:
        """Numbers of all components by name, a tuple each: kx, ky, w, A, phase, k, bottom and potential. ``bottom`` is
        b = exp(-2 |k| h), so that cosh |k|(z + h)/cosh |k|h = (e + b/e)/(1 + b) with e = exp |k|z has no large numbers;
        ``potential`` is the amplitude of the potential at z = 0 divided by 1 + b."""
        kx, ky, w, A, phase, potential = (np.array(column) for column in zip(*self.components, strict=True))
        k = np.hypot(kx, ky)
        bottom = np.where(k * self.depth > _DEEP, 0.0, np.exp(-2.0 * np.minimum(k * self.depth, _DEEP)))
        result = {"kx": kx, "ky": ky, "w": w, "A": A, "phase": phase, "k": k, "bottom": bottom}
        result["potential"] = potential / (1.0 + bottom)
        return {name: tuple(column.tolist()) for name, column in result.items()}

    def factors(self, name: str, component: int) -> tuple[float, ...]:
        """Return the factor of each component's cosine or sine in a quantity, without the dependence on depth. ``name``
        is a key of ``WORDS``; ``component`` 0, 1 or 2 for x, y or z."""
        column = {name: np.array(values) for name, values in self.columns.items()}
        along = ("kx", "ky")[component] if component < 2 else ""
        match name:
            case "elevation":
                result = column["A"]
            case "slope":
                result = -column["A"] * column[along]
            case "water_velocity":
                result = column["potential"] * column[along or "k"]
            case _:
                result = column["potential"] * column["w"] * (column[along] if along else -column["k"])
        return tuple(result.tolist())

    def value(self, name: str, component: int, *arguments: ArrayLike) -> NDArray[np.float64]:
        """Return a quantity in SI units, of the common broadcast shape of the arguments. ``name`` is a key of
        ``WORDS``; ``component`` is 0, 1 or 2 for x, y or z. The arguments are x, y, z (if the quantity depends on z),
        t, and then the values of ``extra_arguments``."""
        numbers = [np.asarray(argument, dtype=float) for argument in arguments]
        count = len(WORDS[name].arguments)
        position, t, extra_values = numbers[:count], numbers[count], numbers[count + 1 :]
        grown, growing = self._growth(t)
        rest: NDArray[np.float64] = grown * self._full(name, component, position, t, extra_values)
        if name != "water_acceleration" or self.ramp == 0.0:
            return rest
        return rest + growing * self._full("water_velocity", component, position, t, extra_values)

    def _sizes(self, extra_values: list[NDArray[np.float64]]) -> NDArray[np.complex128]:
        """Return the complex factor, without unit, of the amplitude and phase of each wave component, (..., n).

        ``extra_values`` are the values (...) of ``extra_arguments``: the tunable factor of all amplitudes, then z1 and
        z2 of each free wave; without any the factor is 1. A free wave has factor times z1 + i z2, a bound wave the
        square of the factor times the product of both free waves (one conjugated for a difference). Amplitude and
        decay with depth are not in it.
        """
        sizes = np.ones(len(self.components), dtype=complex)
        if self.factor is not None:
            factor = extra_values[0][..., None]
            sizes = sizes * np.where(self.bound, factor**2, factor)
        if self.variables:
            drawn = np.stack(np.broadcast_arrays(*extra_values[-len(self.variables) :]), axis=-1)
            z = drawn[..., ::2] + 1j * drawn[..., 1::2]
            first, second, sign = np.array(self.drawn).T
            partner = np.where(sign > 0, z[..., second], np.conj(z[..., second]))
            sizes = sizes * z[..., first] * np.where(second < 0, 1.0, partner)
        return sizes

    def _growth(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the factor of the amplitudes at times t during the ramp, and the rate in 1/s, each of the shape of
        t."""
        if self.ramp == 0.0:
            return np.ones(()), np.zeros(())
        s = np.clip(t / self.ramp, 0.0, 1.0)
        return s**4 * (35.0 - 84.0 * s + 70.0 * s**2 - 20.0 * s**3), 140.0 * (s * (1.0 - s)) ** 3 / self.ramp

    def _full(
        self,
        name: str,
        component: int,
        position: list[NDArray[np.float64]],
        t: NDArray[np.float64],
        extra_values: list[NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """Return a quantity of waves without the ramp, at the height of motion by stretching. Arguments are as for
        ``value``: ``position`` has x, y and perhaps z, ``extra_values`` the values of ``extra_arguments``."""
        column = {name: np.array(values) for name, values in self.columns.items()}
        x, y, time = (np.asarray(item)[..., None] for item in (position[0], position[1], t))
        angle = column["kx"] * x + column["ky"] * y - column["w"] * time + column["phase"]
        crest = self._sizes(extra_values) * np.exp(1j * angle)
        wave = crest.imag if in_quadrature(name, component) else crest.real
        terms = np.array(self.factors(name, component)) * wave
        if len(position) > 2:
            e = np.exp(np.maximum(column["k"] * self._motion_height(position, t, extra_values)[..., None], -LEAST))
            terms = terms * (e + column["bottom"] / e if component < 2 else e - column["bottom"] / e)
        return np.asarray(terms.sum(axis=-1))

    def _motion_height(
        self, position: list[NDArray[np.float64]], t: NDArray[np.float64], extra_values: list[NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        eta = self.value("elevation", 0, position[0], position[1], t, *extra_values)
        highest = np.maximum(eta, 0.0) if self.stretching == "none" else eta
        z = np.maximum(np.minimum(position[2] - self.level, highest), -self.depth)
        return z if self.stretching == "none" else np.asarray((z - eta) / (1.0 + eta / self.depth))


def in_quadrature(name: str, component: int) -> bool:
    """Return whether a quantity is proportional to the sine of a component's angle, not to the cosine."""
    return name == "slope" or (name.startswith("water") and (name == "water_velocity") == (component == 2))


def _added_arguments(waves: WaveField) -> tuple[Formula, ...]:
    """Return the arguments of a quantity of waves after the place: the time, and parameters of the waves."""
    return (Symbol("time"), *waves.extra_arguments)


def _word(name: str, arguments: tuple[str, ...], components: int, unit: str) -> Word:
    """Return a word of formulas for waves, whose values WaveField gives. Words with two arguments are smooth."""
    return Word(
        name,
        "waves",
        arguments,
        WaveField.value,
        "eomgen.products.waves.formula.recording:wave_quantity",
        _added_arguments,
        components,
        unit,
        # waves that grow are three times differentiable at both ends of the ramp, and motion of the water bends at the
        # surface and at the bottom
        smooth=len(arguments) < 3,
        # sums of harmonics: comparison runs show errors that occur in all steps
        fast=False,
    )


ELEVATION = _word("elevation", ("x", "y"), 1, "m")
SLOPE = _word("slope", ("x", "y"), 2, "1")
WATER_VELOCITY = _word("water_velocity", ("x", "y", "z"), 3, "m/s")
WATER_ACCELERATION = _word("water_acceleration", ("x", "y", "z"), 3, "m/s^2")
#: Words of waves in formulas by name.
WORDS = {word.name: word for word in (ELEVATION, SLOPE, WATER_VELOCITY, WATER_ACCELERATION)}
