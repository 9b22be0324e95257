"""Beams as many points of mass, moved by the exact kinematics; what their motion demands by d'Alembert's principle.

Only values and slopes of shape functions at places are taken from eomgen. Integrals over the beam are sums over points,
time derivatives are those of Taylor arithmetic, and variations are by complex step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.mechanics.shape_functions.integrals import shape_integrals
from eomgen.scene.bodies.model import Beam
from tests.oracles.evaluation import Array
from tests.oracles.states import STEP
from tests.oracles.taylor import Matrix, Moving, Vector, cos, moving, product, rotated, rotation, shifted, sin, vector

#: Orientation and position of a frame.
Frame = tuple[Matrix, Vector]
#: Masses, and positions with arrays of the same length as components.
Points = tuple[Array, Vector]

IDENTITY: Matrix = (vector((1, 0, 0)), vector((0, 1, 0)), vector((0, 0, 1)))
WORLD: Frame = (IDENTITY, vector((0, 0, 0)))


def gauss(length: float, count: int) -> tuple[Array, Array]:
    """Return places and weights of Gauss's rule on 0 .. length."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * length * (nodes + 1.0), 0.5 * length * weights


@dataclass(frozen=True)
class Axis:
    """Shape functions of a beam at places: (n, m) values and slopes, (n, n, m) shortenings."""

    kinds: tuple[str, ...]
    x: Array
    value: Array
    slope: Array
    shortening: Array


def axis_of(beam: Beam, places: Sequence[float]) -> Axis:
    """Return the shape functions at places; the shortening is summed from slopes between the origin and each place."""
    at = shape_integrals(beam).at
    kinds = tuple(item.kind for item in beam.deformations for _ in range(item.modes))
    same = np.array([[beam.stiffening and one == other for other in kinds] for one in kinds])
    shortenings = []
    for x in places:
        nodes, weights = gauss(x, 40)
        slopes = np.array([at(s).slope for s in nodes])
        shortenings.append(np.where(same, np.einsum("p,pk,pl->kl", weights, slopes, slopes), 0.0))
    stations = [at(x) for x in places]
    value, slope = np.array([s.value for s in stations]).T, np.array([s.slope for s in stations]).T
    return Axis(kinds, np.array(places, float), value, slope, np.moveaxis(np.array(shortenings), 0, -1))


def deflected(axis: Axis, eta: Sequence[Moving]) -> tuple[Vector, Vector]:
    """Return positions of the axis in the beam's frame, and slope vectors (twist, -w', v')."""
    along, twist = moving(axis.x), moving(np.zeros_like(axis.x))
    across, slopes = {"y": twist, "z": twist}, {"y": twist, "z": twist}
    for k, kind in enumerate(axis.kinds):
        if kind == "stretch":
            along = along + eta[k] * axis.value[k]
        elif kind == "torsion":
            twist = twist + eta[k] * axis.value[k]
        else:
            way = kind[-1]
            across[way], slopes[way] = across[way] + eta[k] * axis.value[k], slopes[way] + eta[k] * axis.slope[k]
            for j in range(len(axis.kinds)):
                along = along - 0.5 * (eta[k] * eta[j] * axis.shortening[k, j])
    return (along, across["y"], across["z"]), (twist, -slopes["z"], slopes["y"])


class ManyPoints:
    """A uniform beam as points: four on each section where it has polar inertia, so that they have its mass and that
    inertia."""

    def __init__(self, beam: Beam, mass_per_length: float, polar_inertia: float = 0.0, count: int = 20) -> None:
        self.beam = beam
        places, weights = gauss(beam.length, count)
        self.axis = axis_of(beam, list(beam.start + places))
        self.stations: dict[float, Axis] = {}
        self.radius = np.sqrt(polar_inertia / mass_per_length)
        self.angles = [0.0] if polar_inertia == 0.0 else [0.5 * np.pi * k for k in range(4)]
        self.masses = np.tile(mass_per_length * weights / len(self.angles), len(self.angles))

    def points(self, frame: Frame, eta: Sequence[Moving]) -> Points:
        place, (twist, _, _) = deflected(self.axis, eta)
        parts = []
        for angle in self.angles:
            around = (moving(0.0), self.radius * cos(twist + angle), self.radius * sin(twist + angle))
            parts.append(shifted(rotated(frame[0], shifted(place, around)), frame[1]))
        return self.masses, joined(parts)

    def station(self, frame: Frame, eta: Sequence[Moving], r: Sequence[float]) -> Frame:
        """Return the frame that the material around r carries, with its origin there."""
        if r[0] not in self.stations:
            self.stations[r[0]] = axis_of(self.beam, [r[0]])
        place, slopes = deflected(self.stations[r[0]], eta)
        R = rotation(first_of(slopes))
        local = shifted(first_of(place), rotated(R, vector((0.0, r[1], r[2]))))
        return product(frame[0], R), shifted(rotated(frame[0], local), frame[1])


def joined(parts: Sequence[Vector]) -> Vector:
    """Return several lots of points as one."""
    size = max(np.size(component.x) for part in parts for component in part)

    def component(i: int) -> Moving:
        return Moving(
            *(np.concatenate([np.broadcast_to(getattr(part[i], name), size) for part in parts]) for name in "xva")
        )

    return component(0), component(1), component(2)


def first_of(points: Vector) -> Vector:
    """Return the only point of a lot of one."""
    return vector(Moving(*(np.ravel(getattr(component, name))[0] for name in "xva")) for component in points)


def demanded(
    points: Callable[[Sequence[Moving]], list[Points]],
    q: Array,
    v: Array,
    a: Array,
    gravity: Sequence[float] = (0.0, 0.0, 0.0),
) -> Array:
    """Return sum of mass (acceleration - gravity) . dp/dq over all points, for coordinates that are plain numbers."""
    along = [Moving(*numbers) for numbers in zip(q, v, a, strict=True)]
    accelerations = [(masses, [part.a - g for part, g in zip(p, gravity, strict=True)]) for masses, p in points(along)]
    rows = []
    for k in range(len(q)):
        varied = [Moving(value + (1j * STEP if j == k else 0.0)) for j, value in enumerate(q)]
        total = 0.0
        for (masses, acceleration), (_, p) in zip(accelerations, points(varied), strict=True):
            for component, part in zip(acceleration, p, strict=True):
                total += float(np.sum(masses * component * np.imag(part.x) / STEP))
        rows.append(total)
    return np.array(rows)
