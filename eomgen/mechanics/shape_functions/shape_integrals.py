"""Shape functions of a beam for mechanics: values at stations, and integrals over the beam, as plain numbers.

All functions of x, the place on the beam's axis in its frame. Shape functions f_k belong to elastic coordinates k = 0
.. n-1 in the order of ``Beam.deformations``. Integrals over mass are for a unit of ``mass_per_length`` (with the mass
profile), integrals over stiffness for a unit of the deformation's stiffness (with its profile).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.scene.bodies.model import DeformationKind


@dataclass(frozen=True)
class Station:
    """Shape functions at one position of the axis.

    Attributes
    ----------
    value : (n,) f_k: deflection, elongation, or angle of twist per unit of the coordinate
    slope : (n,) f_k' for bending, 0 for other deformations
    shortening : (n, n) int_0^x f_k' f_l' between bending coordinates of one kind, 0 elsewhere
    """

    value: Array
    slope: Array
    shortening: Array


@dataclass(frozen=True)
class ShapeIntegrals:
    """Integrals of the shape functions of one beam.

    Attributes
    ----------
    kinds : (n,) kind of each coordinate
    at : gives the Station of a place x
    along : gives the Stations of many places, to double precision
    mass, first, second : int 1, int x, int x^2 over mass
    d : (n,) int f_k over mass, 0 of torsion
    e : (n,) int x f_k over mass, 0 of torsion
    m : (n, n) int f_k f_l over mass between all displacements in any direction; 0 of torsion
    g0 : (n, n) int H_kl over mass, H_kl = int_0^x f_k' f_l' between bending coordinates of one kind
    g1 : (n, n) int x H_kl over mass
    h1 : (n, n, n) int H_kl f_m over mass, for order 2
    h2 : (n, n, n, n) int H_kl H_mn over mass, for order 2
    t0 : (n,) int f_k over polar inertia, of torsion
    t2 : (n, n) int f_k f_l over polar inertia, between torsion coordinates
    k : (n, n) stiffness, within each deformation: int f'' f'' of bending, int f' f' of stretch and torsion
    load : (n,) int f_k dx, for distributed loads
    """

    kinds: tuple[DeformationKind, ...]
    at: Callable[[float], Station]
    along: Callable[[Sequence[float]], Sequence[Station]]
    mass: float
    first: float
    second: float
    d: Array
    e: Array
    m: Array
    g0: Array
    g1: Array
    h1: Array
    h2: Array
    t0: Array
    t2: Array
    k: Array
    load: Array
