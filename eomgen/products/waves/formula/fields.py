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
from importlib import import_module
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.words import Word

Stretching = Literal["wheeler", "none"]
_RECORDING = "eomgen.products.waves.formula.recording"


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

    def added_arguments(self) -> tuple[Formula, ...]:
        """Return the arguments of quantities after the place: the time, and the extra arguments."""
        return (Symbol("time"), *self.extra_arguments)

    def __str__(self) -> str:
        return f"{len(self.components)} waves"

    @cached_property
    def columns(self) -> dict[str, tuple[float, ...]]:
        """Numbers of all components by name, a tuple each: kx, ky, w, A, phase, k, bottom and potential. ``bottom`` is
        b = exp(-2 |k| h), so that cosh |k|(z + h)/cosh |k|h = (e + b/e)/(1 + b) with e = exp |k|z has no large numbers;
        ``potential`` is the amplitude of the potential at z = 0 divided by 1 + b."""
        kx, ky, w, A, phase, potential = (np.array(column) for column in zip(*self.components, strict=True))
        k = np.hypot(kx, ky)
        bottom = np.exp(-2.0 * k * self.depth)
        bottom = np.where(k * self.depth > 20.0, 0.0, bottom)  # below the last digit
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
        """Return a quantity in SI units, as recorded, of the common broadcast shape of the arguments. ``name`` is a key
        of ``WORDS``; ``component`` is 0, 1 or 2 for x, y or z. The arguments are x, y, z (if the quantity depends on
        z), t, and then the values of ``extra_arguments``."""
        value: NDArray[np.float64] = import_module(_RECORDING).wave_value(self, name, component, *arguments)
        return value


def in_quadrature(name: str, component: int) -> bool:
    """Return whether a quantity is proportional to the sine of a component's angle, not to the cosine."""
    return name == "slope" or (name.startswith("water") and (name == "water_velocity") == (component == 2))


def _word(name: str, arguments: tuple[str, ...], components: int, unit: str) -> Word:
    """Return a word of formulas for waves, whose values WaveField gives. Words with two arguments are smooth."""
    return Word(
        name,
        "waves",
        arguments,
        WaveField.value,
        f"{_RECORDING}:wave_quantity",
        WaveField.added_arguments,
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
