"""Shape integrals of a beam: all that its equations of motion need to know of its shape functions."""

from __future__ import annotations

import numpy as np

from eomgen.mechanics.beams.families import Array, Family
from eomgen.mechanics.beams.quadrature import Grid
from eomgen.mechanics.beams.shape_integrals import ShapeIntegrals, Station
from eomgen.mechanics.beams.shapes import shapes
from eomgen.scene.beam import Beam

_ROUNDING = 1e-13  # relative to what Cauchy and Schwarz allow: below are zeros of symmetry or orthogonality


def shape_integrals(beam: Beam) -> ShapeIntegrals:
    """Return the shape integrals of a beam.

    Integrals that vanish by symmetry or orthogonality are exactly zero, so that they cost nothing later.
    ``h1`` and ``h2`` are empty where ``beam.order`` is 1, which needs none of them.
    """
    return _Integrator(beam).integrals()


class _Integrator:
    def __init__(self, beam: Beam) -> None:
        self.beam = beam
        self.families = [shapes(deformation, beam) for deformation in beam.deformations]
        self.origin = min(max(-beam.start / beam.length, 0.0), 1.0)
        self.grid = Grid(self.families, [self.origin])
        self.kinds = tuple(item.kind for item in beam.deformations for _ in range(item.modes))
        self.owner = np.array([number for number, item in enumerate(beam.deformations) for _ in range(item.modes)], int)

    def integrals(self) -> ShapeIntegrals:
        beam, grid, length = self.beam, self.grid, self.beam.length
        kinds = np.array(self.kinds, dtype=object)
        bending = np.array([kind.startswith("bending") for kind in self.kinds], bool)
        torsion = kinds == "torsion"
        x = beam.start + length * grid.places
        ones = length * grid.weights
        mass = ones * self.profile("mass", grid.places)
        polar = ones * self.profile("polar", grid.places)
        f = stacked(self.families, grid.places)
        moved, twist = np.where(torsion[:, None], 0.0, f), np.where(torsion[:, None], f, 0.0)
        m, t2 = (moved * mass) @ moved.T, (twist * polar) @ twist.T
        total, second = float(mass.sum()), float(mass @ x**2)
        scale, twist_scale = np.sqrt(np.diag(m)), np.sqrt(np.diag(t2))
        extent = max(abs(beam.start), abs(beam.start + length))

        slope = np.where(bending[:, None], stacked(self.families, grid.places, 1), 0.0) / length
        H = self.shortening(slope)
        g0 = H @ mass
        steepness = np.sqrt(total * slope**2 @ ones)
        h_scale = np.outer(steepness, steepness)
        h1 = h2 = np.zeros(0)
        if beam.order == 2:
            h1 = np.einsum("klp,mp->klm", H, moved * mass)
            h2 = np.einsum("klp,mnp->klmn", H * mass, H)
        return ShapeIntegrals(
            kinds=self.kinds,
            at=self.station,
            mass=total,
            first=float(mass @ x),
            second=second,
            d=cleaned(moved @ mass, np.sqrt(total) * scale),
            e=cleaned(moved @ (mass * x), np.sqrt(second) * scale),
            m=cleaned(m, np.outer(scale, scale)),
            g0=cleaned(g0, h_scale),
            g1=cleaned(H @ (mass * x), extent * h_scale),
            h1=h1,
            h2=h2,
            t0=cleaned(twist @ polar, np.sqrt(polar.sum()) * twist_scale),
            t2=cleaned(t2, np.outer(twist_scale, twist_scale)),
            k=self.stiffness(bending),
            load=cleaned(f @ ones, np.sqrt(length) * np.sqrt((f**2) @ ones)),
        )

    def profile(self, name: str, s: Array) -> Array:
        return np.asarray(np.polynomial.Polynomial(self.beam.profiles.get(name, (1.0,)))(s))

    def stiffness(self, bending: Array) -> Array:
        """Return the stiffness matrix: curvatures of bending, strains of the others."""
        k = np.zeros((len(self.kinds), len(self.kinds)))
        for number, (item, family) in enumerate(zip(self.beam.deformations, self.families, strict=True)):
            order = 2 if item.kind.startswith("bending") else 1
            strain = family.values(self.grid.places, order) / self.beam.length**order
            own = np.flatnonzero(self.owner == number)
            weights = self.beam.length * self.grid.weights * self.profile(item.kind, self.grid.places)
            k[np.ix_(own, own)] = (strain * weights) @ strain.T
        scale = np.sqrt(np.diag(k))
        return cleaned(k, np.outer(scale, scale))

    def shortening(self, slope: Array) -> Array:
        """Return (n, n, m) H at the places of the grid."""
        products = self.beam.length * slope[:, None, :] * slope[None, :, :]
        same = self.owner[:, None] == self.owner[None, :]
        return np.asarray(self.grid.from_origin(np.where(same[:, :, None], products, 0.0), self.origin))

    def station(self, x: float) -> Station:
        """Return the shape functions at a place of the axis."""
        s = min(max((x - self.beam.start) / self.beam.length, 0.0), 1.0)
        place = np.array([s])
        bending = np.array([kind.startswith("bending") for kind in self.kinds], bool)
        value, slope = (
            cleaned(stacked(self.families, place, order)[:, 0], self.mean_square(order) ** 0.5) for order in range(2)
        )
        return Station(value, np.where(bending, slope, 0.0) / self.beam.length, self.shortening_at(s))

    def mean_square(self, derivative: int) -> Array:
        return np.asarray(stacked(self.families, self.grid.places, derivative) ** 2 @ self.grid.weights)

    def shortening_at(self, s: float) -> Array:
        if s == self.origin:
            return np.zeros((len(self.kinds), len(self.kinds)))
        grid = Grid(self.families, [self.origin, s])
        bending = np.array([kind.startswith("bending") for kind in self.kinds], bool)
        slope = np.where(bending[:, None], stacked(self.families, grid.places, 1), 0.0) / self.beam.length
        low, high = sorted((s, self.origin))
        within = (grid.places > low) & (grid.places < high)
        weights = np.copysign(self.beam.length, s - self.origin) * grid.weights * within
        same = self.owner[:, None] == self.owner[None, :]
        H = np.where(same, (slope * weights) @ slope.T, 0.0)
        scale = np.sqrt(np.abs(np.diag(H)))
        return cleaned(H, np.outer(scale, scale))


def stacked(families: list[Family], s: Array, derivative: int = 0) -> Array:
    """Return (n, m) values of the functions of several families."""
    return np.concatenate([np.zeros((0, len(s))), *(family.values(s, derivative) for family in families)])


def cleaned(values: Array, scale: Array) -> Array:
    """Return values with zeros in place of rounding."""
    return np.where(np.abs(values) <= _ROUNDING * np.abs(scale), 0.0, values)
