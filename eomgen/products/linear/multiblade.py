"""Multiblade (Coleman) coordinates for rotors with three or more equal blades, and frequencies seen from the support.
In these coordinates an isotropic rotor on any support has a linear model with constant coefficients.

Blade k of N has the azimuth psi_k = psi + 2 pi k / N, psi = speed t, and a coordinate x_k of the blade is

    x_k = collective + sum over n of (cosine_n cos n psi_k + sine_n sin n psi_k) + (-1)^k differential

with n = 1 .. (N - 1) / 2, and a differential coordinate for even N (Coleman and Feingold 1958, NACA Report 1351;
Hohenemser and Yin 1972; Bir 2008, AIAA 2008-1300).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import takewhile
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import listed, nearest, shown
from eomgen.base.rounding import WRITTEN
from eomgen.errors import Problem, UsageError
from eomgen.products.linear.freedom import Freedom, Partials

_EXAMPLE = '{"spin": [("flap_1", "flap_2", "flap_3")]}'

#: Words of the warning of signals of single blades, which leave frequencies and shapes as they are.
AT_ONE_AZIMUTH = "in no group of multiblade hold at one azimuth"
#: Groups of equal coordinates by the component of the rotor: each of the blades in the order of azimuth.
Blades = Mapping[str, Sequence[Sequence[str]]]


@dataclass(frozen=True)
class Rotor:
    """A rotor at one time.

    Attributes
    ----------
    name : component of the velocity, such as ``spin``
    speed, azimuth : rad/s and rad
    groups : names of equal coordinates, states or signals, each of the blades in the order of azimuth
    """

    name: str
    speed: float
    azimuth: float
    groups: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, eq=False)
class Multiblade:
    """The multiblade coordinates of a linear model.

    Attributes
    ----------
    rotors : at the reference
    components : (nv, nv) changes of the components of v by the changes in multiblade coordinates, at the reference
    pairs : cosine and sine coordinates, whose orbits show the sense of whirl
    variation : largest change of the coefficients over azimuths, as a part of the largest coefficient of the row; 0
        for a rotor at rest
    """

    rotors: tuple[Rotor, ...]
    components: Array
    pairs: tuple[tuple[str, str], ...]
    variation: float = 0.0

    def __str__(self) -> str:
        turning = ", ".join(f"{rotor.name} at {rotor.speed:.6g} rad/s" for rotor in self.rotors)
        if not any(rotor.speed for rotor in self.rotors):
            return f"in multiblade coordinates about {turning}"
        return f"in multiblade coordinates about {turning}, over azimuths constant but for {self.variation:.2g}"


class _BladeGroup(NamedTuple):
    """Places of equal names, with the basis of their multiblade coordinates, its first and second time derivative."""

    places: list[int]
    labels: list[str]
    basis: Array
    rate: Array
    second: Array


@dataclass(frozen=True, eq=False)
class Basis:
    """Linear map from multiblade coordinates to n quantities, (n, n) ``matrix``, with its time derivatives ``rate`` and
    ``second`` at constant speeds, and the names of the multiblade coordinates."""

    names: tuple[str, ...]
    matrix: Array
    rate: Array
    second: Array
    groups: tuple[_BladeGroup, ...]

    @staticmethod
    def of(names: Sequence[str], rotors: Sequence[Rotor]) -> Basis:
        """Return the basis of named quantities for the groups of some rotors; names that are in no group stay
        unchanged."""
        groups = [
            _group(group, end, [names.index(name) for name in members], rotor)
            for rotor in rotors
            for group in rotor.groups
            for end, members in _members(group, names).items()
        ]
        labels, n = list(names), len(names)
        matrix, rate, second = np.eye(n), np.zeros((n, n)), np.zeros((n, n))
        for group in groups:
            block = np.ix_(group.places, group.places)
            matrix[block], rate[block], second[block] = group.basis, group.rate, group.second
            for position, label in zip(group.places, group.labels, strict=True):
                labels[position] = label
        return Basis(tuple(labels), matrix, rate, second, tuple(groups))

    def part(self, places: Sequence[int]) -> Basis:
        """Return the basis of some of the quantities, of which a group has all or none."""
        block = np.ix_(places, places)
        names = tuple(self.names[k] for k in places)
        return Basis(names, self.matrix[block], self.rate[block], self.second[block], ())

    def solve(self, right: Array) -> Array:
        """Return the multiblade coordinates of quantities, (n, ...)."""
        return np.asarray(np.linalg.solve(self.matrix, right)) if len(self.matrix) else right

    def values(self, values: Array) -> Array:
        """Return the multiblade coordinates of values, (n,), some of which may not be numbers."""
        result = np.array(values, dtype=float)
        for group in self.groups:
            result[group.places] = np.linalg.solve(group.basis, result[group.places])
        return result

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Names of the cosine and sine coordinates of one wave around the rotor."""
        return [(group.labels[1], group.labels[2]) for group in self.groups]


def _members(group: Sequence[str], names: Sequence[str]) -> dict[str, list[str]]:
    """Return the equal quantities of a group of blades by the common end of their names, one name for each blade. A
    blade's name stands for the quantity of this name (an empty end), or for its components and parts, such as ``[0]``
    or ``.x``. Raises UsageError if blades differ in their parts."""
    ends = [_ends(name, names) for name in group]
    for name, blade_end in zip(group[1:], ends[1:], strict=True):
        for first, of_one, second, of_other in (
            (group[0], ends[0], name, blade_end),
            (name, blade_end, group[0], ends[0]),
        ):
            if missing := [end for end in of_one if end not in of_other]:
                fault = f"there is {first}{missing[0]}, and no {second}{missing[0]} [E0442]"
                raise UsageError(Problem("multiblade", fault, "blades that are modelled alike"))
    return {end: [f"{name}{end}" for name in group] for end in ends[0]}


def _label(group: Sequence[str]) -> str:
    """Return the common part of the names of a group: ``flap`` of ``flap_1``, ``flap_2``, ``flap_3``."""
    start = "".join(letters[0] for letters in takewhile(lambda every: len(set(every)) == 1, zip(*group, strict=False)))
    reverse = [name[len(start) :][::-1] for name in group]
    end = "".join(letters[0] for letters in takewhile(lambda every: len(set(every)) == 1, zip(*reverse, strict=False)))
    return start.rstrip("_0123456789") + end[::-1] or group[0]


def _ends(name: str, names: Sequence[str]) -> list[str]:
    parts = [label.removeprefix(name) for label in names if label.startswith(name)]
    return [part for part in parts if part[:1] in ("", "[", ".")]


def _group(group: Sequence[str], end: str, places: list[int], rotor: Rotor) -> _BladeGroup:
    count = len(group)
    psi = rotor.azimuth + 2.0 * np.pi * np.arange(count) / count
    still = np.zeros(count)
    waves = [("collective", np.ones(count), still, still)]
    for n in range(1, (count - 1) // 2 + 1):
        cosine, sine, number = np.cos(n * psi), np.sin(n * psi), n if n > 1 else ""
        waves.append((f"cosine{number}", cosine, -n * sine, -(n**2) * cosine))
        waves.append((f"sine{number}", sine, n * cosine, -(n**2) * sine))
    if count % 2 == 0:
        waves.append(("differential", np.where(np.arange(count) % 2 == 0, 1.0, -1.0), still, still))
    kinds, *parts = zip(*waves, strict=True)
    basis, slope, bend = (np.array(part).T for part in parts)
    labels = [f"{_label(group)}.{kind}{end}" for kind in kinds]
    return _BladeGroup(places, labels, basis, rotor.speed * slope, rotor.speed**2 * bend)


def _is_list(value: object) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _are_names(value: Any) -> bool:
    return _is_list(value) and len(value) > 0 and all(isinstance(name, str) for name in value)


def checked_groups(blades: Blades, known: Sequence[str]) -> dict[str, tuple[tuple[str, ...], ...]]:
    """Return the groups of equal names by rotor, each a tuple of blades in the order of azimuth.

    A single group may stand without a list around it.

    Parameters
    ----------
    blades : the caller's mapping of rotors to groups
    known : names of all coordinates, internal states, inputs and outputs

    Raises
    ------
    UsageError
        Not a mapping of rotors to groups; fewer than three blades; names that are unknown or given twice.
    """
    if not isinstance(blades, Mapping) or not blades:
        fault = f"{shown(blades)} is not a mapping of rotors to blades [E0443]"
        raise UsageError(Problem("multiblade", fault, _EXAMPLE))
    result: dict[str, tuple[tuple[str, ...], ...]] = {}
    seen: set[str] = set()
    for rotor, named_groups in blades.items():
        groups: Any = [named_groups] if _are_names(named_groups) else named_groups
        if not (_is_list(groups) and len(groups) and all(map(_are_names, groups))):
            raise UsageError(Problem("multiblade", f"{shown(named_groups)} is not a list of blades [E0444]", _EXAMPLE))
        for group in groups:
            if len(group) < 3:  # sums over cosines and sines of the azimuth are not constant
                fault = f"{listed(group)} are {len(group)} blades, and multiblade coordinates need three [E0445]"
                hint = "model.floquet(period), in Python, for rotors of one or two blades"
                raise UsageError(Problem("multiblade", fault, hint))
            for name in group:
                if not _ends(name, known):
                    fault = f"there is no coordinate, state, input or output {shown(name)} [E0446]"
                    raise UsageError(Problem("multiblade", fault, nearest(name, known)))
                if name in seen:
                    raise UsageError(Problem("multiblade", f"{shown(name)} is named twice [E0447]", "each name once"))
                seen.add(name)
        result[str(rotor)] = tuple(tuple(group) for group in groups)
    return result


def in_multiblade(
    partials: Partials, free: Freedom, of: Mapping[str, Basis], measured: Basis
) -> tuple[Partials, Freedom]:
    """Return the partial derivatives and the free motions transformed into multiblade coordinates.

    x = X xi and y = X eta + X' xi if y is x', so that eta is xi'; then the matrices of the second order are

        X^T M0 X,   X^T (C0 X + 2 M0 X'),   X^T (K0 X + C0 X' + M0 X'')

    Parameters
    ----------
    partials, free : of the linear model in coordinates of single blades
    of : bases of ``components``, ``states``, ``inputs``, ``disturbances`` and ``outputs``
    measured : basis of the candidates of x and y
    """
    x, y = measured.part(free.coordinates), measured.part(free.velocities)
    both = [free.coordinates.index(k) if k in free.coordinates else -1 for k in free.velocities]
    chosen = np.array([[float(k == column) for column in range(len(free.coordinates))] for k in both])
    chosen = chosen.reshape(len(free.velocities), len(free.coordinates))
    G, G_rate = chosen @ x.rate, chosen @ x.second
    N = x.solve(free.N @ y.matrix)
    W = x.solve(free.N @ G + free.W @ x.matrix - x.rate)
    to = of["components"].solve
    T = to(free.S @ G + free.T @ x.matrix)
    U = to(free.S @ (y.rate + G @ N) + free.U @ y.matrix)
    V = to(free.S @ (G_rate + G @ W) + free.U @ G + free.V @ x.matrix)
    R, S = to(free.R @ x.matrix), to(free.S @ y.matrix)
    turned = Freedom(free.coordinates, free.velocities, R, S, T, U, V, N, W, np.zeros_like(free.W_rate))
    q, z, u, w = (of[kind].matrix for kind in ("components", "states", "inputs", "disturbances"))
    columns = {"M": q, "C": q, "K": q, "B": u, "E": w, "Rz": z}
    forces = {name: q.T @ getattr(partials, name) @ matrix for name, matrix in columns.items()}
    by = {"q": q, "v": q, "a": q, "z": z, "u": u, "w": w}
    rates = {f"F{key}": of["states"].solve(getattr(partials, f"F{key}") @ by[key]) for key in "qvzuw"}
    rates["Fz"] = rates["Fz"] - of["states"].solve(of["states"].rate)
    outputs = {f"Y{key}": of["outputs"].solve(getattr(partials, f"Y{key}") @ by[key]) for key in by}
    outputs["Ylam"] = of["outputs"].solve(partials.Ylam)
    rows = {name: getattr(partials, name) @ q for name in ("J", "Z", "Aq", "Av")}
    changed: dict[str, Any] = {**forces, **rates, **outputs, **rows}
    return replace(partials, **changed), turned


def largest_change(A: Array, others: Collection[Array], sizes: Array, least: float) -> tuple[float, int]:
    """Return the largest difference of matrices from A (n, n), as a part of the largest entry of the row, and the row.

    Parameters
    ----------
    A, others : (n, n) matrix, and matrices that are compared with A
    sizes : (n,) of the states, which make entries comparable: roots of inertias
    least : lower bound of the largest entry of a row
    """
    scale = sizes[:, np.newaxis] / sizes
    of_rows = np.max(np.abs(A) * scale, axis=1)
    of_rows = np.maximum(of_rows, max(least, WRITTEN * float(np.max(of_rows))))
    changes = np.array([np.max(np.abs(matrix - A) * scale, axis=1) / of_rows for matrix in others])
    k = int(np.argmax(np.max(changes, axis=0)))
    return float(np.max(changes)), k
