"""Centre of mass and centroidal momentum of all that moves, from composite bodies, and generalized momenta with
their rates.

The wrench of inertia forces under a unit acceleration of one joint, carried to the base, is the momentum that a unit of
its velocity has: the composite-body recursion of the mass matrix, taken one link further (Orin, Goswami and Lee,
Autonomous Robots 35, 2013, 161). About the centre of mass, in world axes, these columns are the centroidal momentum
matrix. The inertia wrench of the motion with the joints' accelerations at zero is its drift.

Generalized momenta and their rates are both sides of Lagrange's equations in left-trivialised velocities. With the
inertial kinetic energy T(q, v, t), p = dT/dv, and ad_v the bracket with v (Hamel 1904; Bloch, Krishnaprasad, Marsden
and Ratiu, Commun. Math. Phys. 175 (1996) 1):

    dp/dt - ad_v^T p = dT/dq + Q - B^T lam
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial

from eomgen.mechanics.dynamics.separated import carried_loads, composites, field_wrenches, unit_acceleration, zero_base
from eomgen.mechanics.kinematics.directions import configuration_directions
from eomgen.mechanics.kinematics.fields import Wrench, carry, pair_plus, total_fields
from eomgen.mechanics.kinematics.points import Kinematics
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.tree.inertia import RecordedInertia
from eomgen.mechanics.tree.links import ROOT, no_inertia
from eomgen.symbolic.calculus.partials import gradient
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, minus, plus, scaled
from eomgen.symbolic.tape import ZERO
from eomgen.system.system import Block


class Centroidal:
    """Centre of mass and momentum of the links of a tree, with inertias that have not been grouped.

    Bodies fixed to the base are left out. Rotor inertias have no momentum here: they stand for gears inside links.
    """

    def __init__(self, kinematics: Kinematics) -> None:
        self.kinematics = kinematics
        self.tree = kinematics.tree.without_water()
        self.algebra = kinematics.algebra

    @cached_property
    def _bodies(self) -> list[RecordedInertia]:
        return composites(self.tree)

    @cached_property
    def _whole(self) -> RecordedInertia:
        """Mass and first moment of all links about the base's origin, in base axes; the second moment is left 0."""
        total = no_inertia(self.algebra)
        still = total.second
        for link, body in zip(self.tree.links, self._bodies, strict=True):
            if link.parent == ROOT:
                first = plus(link.rotation.rotate(body.first), scaled(body.mass, link.position))
                total = RecordedInertia(total.mass + body.mass, plus(total.first, first), still)
        return total

    @property
    def mass(self) -> Scalar:
        """Mass of all links, kg."""
        return self._whole.mass

    @cached_property
    def _divisor(self) -> Scalar:
        """The mass, or 1 if all bodies that move have no mass: the centre is then the base's origin, and as the linear
        momentum vanishes, the angular momentum is the same about every point."""
        algebra, mass = self.algebra, self.mass
        if mass.number is not None:
            return algebra.one if mass.is_zero else mass
        return algebra.select(algebra.call(Op.LT, algebra.zero, mass), mass, algebra.one)

    @cached_property
    def _center(self) -> Vector:
        """Centre of mass relative to the base, (3,), m, in base axes."""
        first = self._whole.first
        return (first[0] / self._divisor, first[1] / self._divisor, first[2] / self._divisor)

    def center(self) -> Vector:
        """Return the centre of mass in the world, (3,), m."""
        base = self.kinematics.base
        return plus(base.position, apply(base.orientation, self._center))

    @cached_property
    def _columns(self) -> list[Wrench]:
        """Momentum about the base's origin per unit of each velocity component, in base axes, angular first."""
        zero = self.algebra.zero_vector
        result: list[Wrench] = [(zero, zero)] * self.tree.nv
        for index, link in enumerate(self.tree.links):
            with self.algebra.tape.block(f"momentum of joint {link.joint.name}"):
                for k, dof in enumerate(link.dofs):
                    load = unit_acceleration(link, self._bodies[index], k)[0]
                    below = index
                    while below != ROOT:
                        load = carry(self.tree.links[below], load)
                        below = self.tree.links[below].parent
                    ratio = link.coordinates.ratio
                    result[dof] = pair_plus(result[dof], (scaled(ratio, load[0]), scaled(ratio, load[1])))
        return result

    def jacobian(self) -> list[Scalar]:
        """Return the Jacobian of the centre of mass, (3, nv) row by row, in world axes, base at rest."""
        turn = self.kinematics.base.orientation
        inverse = self.algebra.one / self._divisor
        return _rows([apply(turn, scaled(inverse, linear)) for _, linear in self._columns])

    def momentum(self) -> list[Scalar]:
        """Return the centroidal momentum matrix, (6, nv) row by row, in world axes, angular first, base at rest."""
        turn = self.kinematics.base.orientation
        columns = [
            (*apply(turn, minus(angular, cross(self._center, linear))), *apply(turn, linear))
            for angular, linear in self._columns
        ]
        return _rows(columns)

    def drift(self) -> list[Scalar]:
        """Return dA/dt v for the matrix A of ``momentum``, (6,): the rate of momentum at constant v, in world axes."""
        fields = total_fields(self.tree, zero_base(self.tree), accelerations=False, gravity=False)
        loads = carried_loads(self.tree, field_wrenches(self.tree, fields), "rate of momentum")
        zero = self.algebra.zero_vector
        moment, force = zero, zero
        for link, load in zip(self.tree.links, loads, strict=True):
            if link.parent == ROOT:
                moment, force = pair_plus((moment, force), carry(link, load))
        moment = minus(moment, cross(self._center, force))
        base = self.kinematics.base
        if base.turning:
            angular, linear = zero, zero
            for k, column in enumerate(self._columns):
                rate = Scalar(self.algebra.tape, self.algebra.tape.input("v", k))
                angular, linear = pair_plus((angular, linear), (scaled(rate, column[0]), scaled(rate, column[1])))
            moment = plus(moment, cross(base.omega, minus(angular, cross(self._center, linear))))
            force = plus(force, cross(base.omega, linear))
        return [*apply(base.orientation, moment), *apply(base.orientation, force)]

    def center_drift(self) -> list[Scalar]:
        """Return dJ/dt v for the Jacobian J of the centre of mass, (3,)."""
        return [value / self._divisor for value in self.drift()[3:]]


def _rows(columns: Sequence[Sequence[Scalar]]) -> list[Scalar]:
    return [value for row in zip(*columns, strict=True) for value in row]


def center_of_mass(derivation: Derivation) -> list[Block]:
    """Return the centre of mass in the world, (3,), m, and the mass, kg, of all that moves against the base."""
    of_all = Centroidal(derivation.kinematics)
    return [
        derivation.block("c", (3,), of_all.center(), "centre of mass in the world, m"),
        derivation.block("m", (1,), [of_all.mass], "mass, kg"),
    ]


#: Name of the block, rows, words, and values. J v is the velocity of the centre of mass against the base, A v the
#: momentum about the centre of mass, angular first, both in world axes; a drift is dJ/dt v or dA/dt v.
_ROWS: Mapping[str, tuple[str, int, str, Callable[[Centroidal], list[Scalar]]]] = {
    "center_of_mass_jacobian": ("J", 3, "Jacobian of the centre of mass", Centroidal.jacobian),
    "center_of_mass_jacobian_rate": (
        "J_dot", 3, "dJ/dt of the centre of mass", lambda of: of.kinematics.rates(of.jacobian())
    ),
    "center_of_mass_drift": ("drift", 3, "dJ/dt v of the centre of mass", Centroidal.center_drift),
    "centroidal_momentum": ("A", 6, "centroidal momentum matrix", Centroidal.momentum),
    "centroidal_momentum_rate": (
        "A_dot", 6, "dA/dt of the centroidal momentum matrix", lambda of: of.kinematics.rates(of.momentum())
    ),
    "centroidal_drift": ("drift", 6, "dA/dt v of the centroidal momentum matrix", Centroidal.drift),
}  # fmt: skip  # a table


def _centroidal(derivation: Derivation, term: str) -> list[Block]:
    """Return the block of a term of ``_ROWS``, (rows, nv), or of a drift, (rows,)."""
    name, rows, description, values = _ROWS[term]
    shape = (rows,) if name == "drift" else (rows, derivation.tree.nv)
    return [derivation.block(name, shape, values(Centroidal(derivation.kinematics)), description)]


CENTROIDAL_RECORDERS: Mapping[str, Callable[[Derivation], list[Block]]] = {
    "center_of_mass": center_of_mass,
    **{term: partial(_centroidal, term=term) for term in _ROWS},
}


def momenta(derivation: Derivation) -> list[Block]:
    """Return the blocks p = dT/dv, and dT/dq + Q, left-trivialised, (nv,) each; kg m/s and N, or kg m^2/s and N m of
    angles."""
    tape, nv = derivation.tape, derivation.tree.nv
    kinetic = derivation.energies()["kinetic"].ref
    seeds = configuration_directions(derivation.tree)
    velocities = [tape.input("v", k) for k in range(nv)]
    places = [tape.input(key.block, key.index) if isinstance(key, InputSymbol) else key for key in seeds]
    Q = derivation.force()[0].refs
    with tape.block("momenta"):
        p = gradient(tape, kinetic, velocities)
        along = list(Q)
        for slope, tangent in zip(gradient(tape, kinetic, places), seeds.values(), strict=True):
            for direction, ref in tangent.items() if slope != ZERO else ():
                along[direction] = tape.add(along[direction], tape.mul(slope, ref))
    return [
        Block("momentum", (nv,), tuple(p), "generalized momenta p = dT/dv"),
        Block("momentum_rate", (nv,), tuple(along), "dT/dq + Q, left-trivialised"),
    ]
