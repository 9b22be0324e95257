"""Distributed inertia of a deformed beam: its wrench on the frame, and the rows of its elastic coordinates.

Sections turn with the frame and, if torsion is requested, about the frame's x axis with their polar inertia.
"""

from __future__ import annotations

from collections.abc import Callable

from eomgen.base.data import dataclass, replace
from eomgen.formula.nodes import Formula
from eomgen.mechanics.laws.derived import LAWS
from eomgen.mechanics.shape_functions.shape_integrals import ShapeIntegrals
from eomgen.mechanics.tree.beam_fields import Amplitudes, Deflections, DistributedMass, SeparatedField
from eomgen.mechanics.tree.inertia import RecordedInertia
from eomgen.mechanics.tree.joints import JointCoordinates
from eomgen.scene.bodies.model import Beam, Deformation
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, cross, plus, scaled

Values = dict[str, Scalar]


@dataclass(frozen=True)
class RelativeMotion:
    """Motion of the points of a beam relative to the beam frame.

    Attributes
    ----------
    velocity, acceleration : fields of s' and s''
    rates, accelerations : (n,) of the elastic coordinates, which sections turn with
    """

    velocity: SeparatedField
    acceleration: SeparatedField
    rates: Amplitudes
    accelerations: Amplitudes


@dataclass(frozen=True)
class ElasticBody:
    """The deformation of an elastic body: inertia terms by the elastic coordinates of one link.

    Attributes
    ----------
    mass : integrals over the beam's mass, to be multiplied by ``density`` (one unless mass per length is a parameter)
    deflections : for the coordinates, velocities and accelerations of the tape
    twist : (n,) int f_k over polar inertia, of torsion
    twists : (n, n) int f_k f_l over polar inertia, of torsion
    """

    algebra: Algebra
    beam: Beam
    coordinates: JointCoordinates
    mass: DistributedMass
    density: Scalar
    deflections: Deflections
    twist: Amplitudes
    twists: tuple[Amplitudes, ...]

    @property
    def size(self) -> int:
        return len(self.twist)

    # -- motions against the frame -------------------------------------------------------------------------------------

    def relative_motion(self, *, rates: bool, own_rates: bool, accelerations: bool) -> RelativeMotion:
        """Return the motion of points relative to the beam frame due to the elastic coordinates, or parts of this
        motion.

        Parameters
        ----------
        rates : whether s' is included
        own_rates : whether the part of s'' that is quadratic in rates is included
        accelerations : whether the accelerations of the coordinates are included
        """
        still = (self.algebra.zero,) * self.size
        fields = self.deflections
        moving = replace(fields, v=fields.v if own_rates else still, a=fields.a if accelerations else still)
        velocity = fields.velocity() if rates else fields.resting().velocity()
        return RelativeMotion(velocity, moving.acceleration(), fields.v if rates else still, moving.a)

    def unit_acceleration(self, k: int) -> RelativeMotion:
        """Return the relative motion with unit acceleration of coordinate k and all else 0."""
        unit = tuple(self.algebra.one if j == k else self.algebra.zero for j in range(self.size))
        still = (self.algebra.zero,) * self.size
        return RelativeMotion(self.deflections.resting().velocity(), self.deflections.variation(k), still, unit)

    # -- inertia -------------------------------------------------------------------------------------------------------

    def deform(self, rigid: RecordedInertia) -> RecordedInertia:
        """Return the shape integrals of the deformed body about the frame's origin; ``rigid`` are these of the
        undeformed body."""
        s = self.deflections.position()
        first = self.algebra.vector([self.density * self.mass.first(component) for component in s])
        upper = {(i, j): self.density * self.mass.product(s[i], s[j]) for i in range(3) for j in range(i, 3)}
        second = [[rigid.second[i][j] + upper[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]
        return RecordedInertia(rigid.mass, plus(rigid.first, first), self.algebra.matrix(second))

    def wrench(self, spin: Vector, motion: RelativeMotion) -> tuple[Vector, Vector]:
        """Return the inertia wrench of the motion relative to the frame, moment about the origin and force, in frame
        axes. ``spin`` is the angular velocity of the frame. The acceleration field of the frame is not included."""
        s = self.deflections.position()
        values = {f"w{i}": spin[i] for i in range(3)}
        for name, fields in (("v", motion.velocity), ("r", motion.acceleration)):
            for i in range(3):
                values[f"{name}{i}"] = self.density * self.mass.first(fields[i])
                for j in range(3):
                    values[f"{name}{i}s{j}"] = self.density * self.mass.product(fields[i], s[j])
        x, y, z, *force = LAWS["virtual_work_of_relative_motion"].instantiate(self.algebra, values)
        along = self.algebra.identity[0]
        turning = plus(
            scaled(self._weighted_sum(self.twist, motion.accelerations), along),
            scaled(self._weighted_sum(self.twist, motion.rates), cross(spin, along)),
        )
        return plus((x, y, z), turning), (force[0], force[1], force[2])

    def row(self, k: int, origin: Vector, gradient: Matrix, spin: Vector, motion: RelativeMotion) -> Scalar:
        """Return the generalized inertia force of coordinate k: virtual work of origin + gradient s + 2 spin x s' +
        s''. ``origin`` and ``gradient`` are the acceleration field of the frame, ``spin`` the angular velocity, all in
        frame axes."""
        s, phi = self.deflections.position(), self.deflections.variation(k)
        values: Values = {}
        for i in range(3):
            values[f"A{i}"], values[f"w{i}"], values[f"f{i}"] = origin[i], spin[i], self.mass.first(phi[i])
            for j in range(3):
                values[f"U{i}{j}"] = gradient[i][j]
                for name, field in (("s", s), ("v", motion.velocity), ("r", motion.acceleration)):
                    values[f"f{i}{name}{j}"] = self.mass.product(phi[i], field[j])
        (work,) = LAWS["virtual_work_along_elastic_coordinate"].instantiate(self.algebra, values)
        return self.density * work + self._own(k, 0.5 * (gradient[2][1] - gradient[1][2]), motion.accelerations)

    def geometric_stiffness(self, origin: Scalar, gradient: Scalar) -> list[list[Scalar]]:
        """Return the geometric stiffness, (n, n), by shortening under axial accelerations ``origin + gradient x`` of
        the frame. Zero for a beam whose axis does not shorten."""
        if not self.deflections.shortens:
            return [[self.algebra.zero] * self.size for _ in range(self.size)]
        g0, g1, unit = self.mass.integrals.g0, self.mass.integrals.g1, self.mass.unit
        by_origin, by_gradient = self.density * origin, self.density * gradient
        return [
            [-(by_origin * (unit * float(g0[k, j])) + by_gradient * (unit * float(g1[k, j]))) for j in range(self.size)]
            for k in range(self.size)
        ]

    def inertia_of(self, k: int) -> Scalar:
        """Return the modal mass of coordinate k, undeformed, frame at rest."""
        return self.density * self.mass.inertia_of(k) + self.twists[k][k]

    def _own(self, k: int, angular_acceleration: Scalar, accelerations: Amplitudes) -> Scalar:
        """Return the rotary inertia terms of one row."""
        return self.twist[k] * angular_acceleration + self._weighted_sum(self.twists[k], accelerations)

    def kinetic_energy(self, omega: Vector, velocity: Vector) -> Scalar:
        """Return the kinetic energy of the relative motion, J: all of the body's kinetic energy but the part of the
        deformed body in rigid motion with the frame's inertial twist (``omega``, ``velocity``, in frame axes)."""
        fields = self.deflections
        s, rates = fields.position(), fields.velocity()
        values = {}
        for i in range(3):
            values[f"w{i}"], values[f"u{i}"], values[f"v{i}"] = (
                omega[i],
                velocity[i],
                self.density * self.mass.first(rates[i]),
            )
            for j in range(3):
                values[f"v{i}s{j}"] = self.density * self.mass.product(rates[i], s[j])
            values[f"v{i}v{i}"] = self.density * self.mass.product(rates[i], rates[i])
        (energy,) = LAWS["kinetic_energy_of_relative_motion"].instantiate(self.algebra, values)
        for k, rate in enumerate(fields.v):
            energy = energy + rate * (self.twist[k] * omega[0] + 0.5 * self._weighted_sum(self.twists[k], fields.v))
        return energy

    def _weighted_sum(self, weights: Amplitudes, amplitudes: Amplitudes) -> Scalar:
        total = self.algebra.zero
        for weight, amplitude in zip(weights, amplitudes, strict=True):
            total = total + weight * amplitude
        return total


def elastic_body(
    algebra: Algebra,
    beam: Beam,
    integrals: ShapeIntegrals,
    coordinates: JointCoordinates,
    number: Callable[[Formula], Scalar],
) -> ElasticBody:
    """Return the elastic part of a beam's link; ``number`` gives the value of a formula of parameters on the tape."""
    density = number(beam.mass_per_length)
    constant = density.constant
    unit, factor = (1.0, density) if constant is None else (constant, algebra.one)
    polar = number(beam.polar_inertia)
    n = beam.size
    beyond = [[algebra.zero] * n for _ in range(n)]
    twists = [[polar * float(entry) for entry in row] for row in integrals.t2]
    for item, here in deformations(beam):
        inertia_factor = number(item.inertia_factor)
        for k in here:
            for j in here:
                beyond[k][j] = (inertia_factor - 1.0) * (unit * float(integrals.m[k, j]))
                twists[k][j] = inertia_factor * twists[k][j]
    extra = None if all(entry.is_zero for row in beyond for entry in row) else tuple(tuple(row) for row in beyond)
    return ElasticBody(
        algebra=algebra,
        beam=beam,
        coordinates=coordinates,
        mass=DistributedMass(algebra, integrals, unit, beam.order == 2, extra),
        density=factor,
        deflections=Deflections(algebra, integrals, beam.stiffening, coordinates.q, coordinates.v, coordinates.a),
        twist=tuple(polar * float(entry) for entry in integrals.t0),
        twists=tuple(tuple(row) for row in twists),
    )


def deformations(beam: Beam) -> list[tuple[Deformation, range]]:
    """Return each deformation of a beam with the range of the deformation's coordinates."""
    ranges, start = [], 0
    for item in beam.deformations:
        ranges.append((item, range(start, start + item.modes)))
        start += item.modes
    return ranges
