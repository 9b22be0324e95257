"""A sea of one direction whose wave numbers are multiples of one: pairs are gathered by the wave number that they make,
and labels are evaluated by FFT."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.errors import Problem, UsageError
from eomgen.products.waves.second_order.pairs import COLUMNS, OWN

Complex = NDArray[np.complex128]
#: Wave numbers that are off a multiple by this part of it at most count as one.
_CLOSE = 1e-9


@dataclass(frozen=True)
class Profile:
    """The surface of a sea of one direction at equally spaced labels, along its direction.

    Attributes
    ----------
    labels, x, z : (count,) arrays, m
    u, w : velocities along the direction and upwards, m/s
    xa, za, xaa, zaa : derivatives of x and z by the label
    """

    labels: Array
    x: Array
    z: Array
    u: Array
    w: Array
    xa: Array
    za: Array
    xaa: Array
    zaa: Array

    @property
    def slope(self) -> Array:
        """dz/dx."""
        return self.za / self.xa

    @property
    def curvature(self) -> Array:
        """Of the curve, in 1/m; negative at crests."""
        steep = self.xa**2 + self.za**2
        return (self.xa * self.zaa - self.za * self.xaa) / steep**1.5

    def mean(self, values: Array) -> float:
        """Return the mean of values over the plane: each label weighs as much as it covers of it."""
        return float(np.sum(values * self.xa) / np.sum(self.xa))


def multiples(k: Array) -> tuple[float, NDArray[np.int64]]:
    """Return the wave number of which all are multiples, and which they are.

    Raises
    ------
    UsageError
        There is none, of which 1e5 is the greatest multiple.
    """
    unit = float(k.min())
    for _ in range(40):  # Euclid's algorithm, of numbers that are rounded
        rest = np.abs(k / unit - np.rint(k / unit)) * unit
        if np.all(rest <= _CLOSE * k):
            break
        unit = float(rest[rest > _CLOSE * k].min())
    number = np.rint(k / unit).astype(np.int64)
    if np.any(np.abs(number * unit - k) > _CLOSE * k) or number.max() > 100_000:
        fault = "the wave numbers are no multiples of one that is not far smaller than all of them"
        raise UsageError(Problem("Sea.profile", fault, "components by discretized(...), or surface(labels, time)"))
    return float(np.mean(k / number)), number


def harmonics(
    number: NDArray[np.int64],
    columns: Array,
    crest: Complex,
    own: Array,
    table: Mapping[str, Array] | None,
    level: Array,
) -> tuple[dict[str, Complex], Array]:
    """Return complex amplitudes by multiple of x, z, u, w, and the constant parts of u and z.

    ``crest`` is A exp(i theta) of each component at the label 0.
    """
    row = dict(zip(COLUMNS, columns, strict=True))
    w, Ch, Sh = row["w"], row["Ch"], row["Sh"]
    size = 2 * int(number.max()) + 1
    total = {name: np.zeros(size, dtype=complex) for name in "xzuw"}

    def add(at: NDArray[np.int64], of: Mapping[str, Complex]) -> None:
        for name, values in of.items():
            total[name].real += np.bincount(at, values.real, size)
            total[name].imag += np.bincount(at, values.imag, size)

    add(number, {"x": 1j * Ch * crest, "z": Sh * crest, "u": Ch * w * crest, "w": -1j * Sh * w * crest})
    if table is None:
        return total, np.zeros(2)
    i, j = np.tril_indices(len(number), -1)
    pairs = [(number[i] - number[j], crest[i] * np.conj(crest[j]), table["w"], table["Xm"], table["Zm"])]
    if "Xp" in table:
        pairs.append((number[i] + number[j], crest[i] * crest[j], w[i] + w[j], table["Xp"], table["Zp"]))
        pairs.append((2 * number, crest * crest, 2.0 * w, own[OWN.index("Xp")], own[OWN.index("Zp")]))
    for at, product, rate, X, Z in pairs:
        horizontal, upwards = -1j * X * product, Z * product
        add(at, {"x": horizontal, "z": upwards, "u": -1j * rate * horizontal, "w": -1j * rate * upwards})
    return total, np.array([level[2], level[0]])
