"""Finite elements of a beam, reduced to the modes of the mesh or taken with their nodal displacements as coordinates.

Bending has two nodes an element, deflection and slope at each, and cubic Hermite polynomials between; stretch and torsion have
three nodes and quadratic ones. Both are conforming, so frequencies come down to the exact ones, with the fourth power of the
element's length (G. Strang and G. J. Fix, An Analysis of the Finite Element Method, 1973, section 6.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from eomgen.mechanics.beams.families import Array
from eomgen.scene.beam import Beam, Deformation, Ends

_NODES = 12  # of Gauss's rule in an element: exact for any profile of a degree up to 17
_CUBIC = np.array([[1.0, 0.0, -3.0, 2.0], [0.0, 1.0, -2.0, 1.0], [0.0, 0.0, 3.0, -2.0], [0.0, 0.0, -1.0, 1.0]])
_QUADRATIC = np.array([[1.0, -3.0, 2.0], [0.0, 4.0, -4.0], [0.0, -1.0, 2.0]])
#: Nodal coordinates held at the first and at the last node; the last ones are counted from the end.
_HELD_BENDING: dict[Ends, tuple[int, ...]] = {"clamped_free": (0, 1), "free_free": (), "pinned_pinned": (0, -2)}
_HELD: dict[Ends, tuple[int, ...]] = {"clamped_free": (0,), "free_free": (), "pinned_pinned": (0, -1)}


@dataclass(frozen=True)
class Elements:
    """Piecewise polynomials on a uniform mesh of s = 0 .. 1.

    Attributes
    ----------
    count : number of elements
    local : (n_local, degree + 1) coefficients of the element's functions on 0 .. 1, constant first
    nodal : (n_nodal, n) nodal values of each shape function; an element has ``n_local`` of them and shares the last
        ``shared`` with the next one
    shared : see ``nodal``
    """

    count: int
    local: Array
    nodal: Array
    shared: int

    @property
    def size(self) -> int:
        """Number of functions."""
        return int(self.nodal.shape[1])

    @property
    def breaks(self) -> tuple[float, ...]:
        """Ends of elements, where derivatives jump."""
        return tuple(number / self.count for number in range(1, self.count))

    @property
    def wave_number(self) -> float:
        """The degree."""
        return float(self.local.shape[1] - 1)

    def values(self, s: Array, derivative: int = 0) -> Array:
        """Return (n, m) values of a derivative by s; of the element that begins there where two meet."""
        element = np.minimum((s * self.count).astype(int), self.count - 1)
        within = s * self.count - element
        functions = np.polynomial.polynomial.polyder(self.local, derivative, axis=1)
        basis = np.polynomial.polynomial.polyval(within, functions.T) * float(self.count) ** derivative
        stride = len(self.local) - self.shared
        result = np.zeros((self.size, len(s)))
        for number, row in enumerate(basis):
            result += self.nodal[element * stride + number].T * row
        return result


def elements(deformation: Deformation, beam: Beam) -> Elements:
    """Return the shape functions of a mesh: its lowest modes, ``int f^2 = 1`` over s, or its nodal displacements."""
    bending = deformation.kind.startswith("bending")
    count = deformation.elements
    if bending:
        h = beam.length / count
        mesh = Elements(count, _CUBIC * np.array([[1.0], [h], [1.0], [h]]), np.eye(2 * count + 2), 2)
    else:
        mesh = Elements(count, _QUADRATIC, np.eye(2 * count + 1), 1)
    size = mesh.size
    held = {place % size for place in (_HELD_BENDING if bending else _HELD)[deformation.ends]}
    free = [place for place in range(size) if place not in held]
    if deformation.nodal:
        return Elements(count, mesh.local, mesh.nodal[:, free], mesh.shared)
    K = _assembled(mesh, beam, deformation.kind, 2 if bending else 1)
    M = _assembled(mesh, beam, "polar" if deformation.kind == "torsion" else "mass", 0)
    for x, mass, inertia in deformation.masses:
        place = np.array([(x - beam.start) / beam.length])
        value, slope = mesh.values(place)[:, 0], mesh.values(place, 1)[:, 0] / beam.length
        M += mass * np.outer(value, value) if deformation.kind != "torsion" else inertia * np.outer(value, value)
        M += inertia * np.outer(slope, slope) if bending else 0.0
    rigid = (2 if bending else 1) if deformation.ends == "free_free" else 0
    wanted = (rigid, rigid + deformation.modes - 1)
    _, modes = scipy.linalg.eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], subset_by_index=wanted)
    nodal = np.zeros((size, deformation.modes))
    nodal[free] = modes
    found = Elements(count, mesh.local, nodal, mesh.shared)
    square = nodal.T @ _assembled(mesh, Beam(0.0, 1.0, beam.mass_per_length, ()), "mass", 0) @ nodal
    lowest = {"clamped_free": 2 if bending else 1, "free_free": 0, "pinned_pinned": 1}[deformation.ends]
    signs = np.sign(found.values(np.array([0.0]), lowest)[:, 0])
    return Elements(count, mesh.local, nodal * signs / np.sqrt(np.diag(square)), mesh.shared)


def _assembled(mesh: Elements, beam: Beam, profile: str, derivative: int) -> Array:
    """Return the matrix of int f^(d) f^(d) of a mesh, weighted by a profile of the beam, per unit of the property."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    within, weights = (nodes + 1.0) / 2.0, weights / 2.0
    h = beam.length / mesh.count
    functions = np.polynomial.polynomial.polyder(mesh.local, derivative, axis=1)
    basis = np.polynomial.polynomial.polyval(within, functions.T) / h**derivative
    places = (np.arange(mesh.count)[:, None] + within) / mesh.count
    along = h * weights * np.polynomial.polynomial.polyval(places, np.array(beam.profiles.get(profile, (1.0,))))
    local = np.einsum("ip,ep,jp->eij", basis, along, basis)
    stride, size = len(mesh.local) - mesh.shared, len(mesh.local)
    matrix = np.zeros((len(mesh.nodal), len(mesh.nodal)))
    for element, part in enumerate(local):
        first = element * stride
        matrix[first : first + size, first : first + size] += part
    return matrix
