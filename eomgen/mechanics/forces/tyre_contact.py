"""Where a tyre meets the road: deflection, load, and the road's slope under the wheel's centre.

The tyre is a point contact below the centre of the wheel: deflection d = radius + h(x, y, t) - z, a law of penetration, and by
virtual work a force F (-dh/dx, -dh/dy, 1) on the centre, which is normal to the road.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from eomgen.mechanics.expressions.formulas import record
from eomgen.mechanics.forces.contact_law import Contact, contact
from eomgen.scene.forces.elements import Tyre
from eomgen.scene.formula.nodes import Formula, Symbol
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.map import splice
from eomgen.symbolic.scalar import Algebra, Scalar, Vector
from eomgen.symbolic.tape import ONE, ZERO, InputSymbol, Op, Tape

if TYPE_CHECKING:
    from eomgen.mechanics.forces.symbols import Quantities


@dataclass(frozen=True)
class TyreContact:
    """The state of a tyre, in world axes.

    Attributes
    ----------
    velocity : of the wheel's centre
    gradient : direction of the normal force, not of unit length: its z is 1
    steepness : length of ``gradient``
    deflection, rate : negative deflections are gaps
    contact : the force along ``gradient``
    load : the normal force
    """

    velocity: Vector
    gradient: Vector
    steepness: Scalar
    deflection: Scalar
    rate: Scalar
    contact: Contact

    @property
    def load(self) -> Scalar:
        return self.contact.force * self.steepness


def tyre_contact(quantities: Quantities, tyre: Tyre) -> TyreContact:
    """Record the contact of a tyre with its road."""
    algebra, kinematics = quantities.algebra, quantities.kinematics
    at = quantities.at(quantities.points[tyre.center])
    position, velocity = kinematics.position(*at), kinematics.velocity(*at)
    height, along_x, along_y, in_time = _road(quantities, tyre.road, position)
    own_rate = _road(quantities, tyre.road_rate, position)[0] if tyre.road_rate is not None else in_time
    gradient = (-along_x, -along_y, algebra.one)
    deflection = quantities.formula(tyre.radius) + height - position[2]
    rate = own_rate + along_x * velocity[0] + along_y * velocity[1] - velocity[2]
    law = {name: quantities.formula(getattr(tyre, name)) for name in ("stiffness", "damping", "onset")}
    steepness = algebra.call(Op.SQRT, along_x * along_x + along_y * along_y + 1.0)
    return TyreContact(velocity, gradient, steepness, deflection, rate, contact(algebra, deflection, rate, **law))


def _road(quantities: Quantities, formula: Formula, position: Vector) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Return the height of a road and its partials in x, y and explicitly in time.

    They are taken on a tape of their own, where x and y are independent whatever they are made of on the scene's.
    """
    tape, own = quantities.algebra.tape, Tape()

    def resolve(symbol: Symbol) -> Scalar:
        if symbol.kind == "position":
            return Scalar(own, own.input("place", symbol.index))
        given = quantities(symbol)
        source = tape.symbol(given.ref)
        ref = own.constant(given.constant or 0.0) if source is None else own.input(source.block, source.index)
        return Scalar(own, ref)

    height = record(Algebra(own), formula, resolve)
    places = [InputSymbol("place", 0), InputSymbol("place", 1)]
    (found,) = forward_partials(own, [height.ref], {symbol: {k: ONE} for k, symbol in enumerate([*places, InputSymbol("t", 0)])})
    refs = [height.ref, *(found.get(direction, ZERO) for direction in range(3))]
    bound = dict(zip(places, (position[0].ref, position[1].ref), strict=True))
    value, along_x, along_y, in_time = (Scalar(tape, ref) for ref in splice(tape, own, refs, bound))
    return value, along_x, along_y, in_time
