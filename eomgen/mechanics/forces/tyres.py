"""Tyres: normal force of a point contact that can lift off, and optional slip forces limited by friction.

Slip follows the usual definitions (Pacejka, Tire and Vehicle Dynamics, 2012, section 1.2), with a speed added to the
rolling one so that a wheel at rest has a force too; forces grow in proportion to slip and load and approach friction
times load smoothly. The normal force over deflection and its rate follows ``contacts.contact``, as at limits of joints.
"""

from __future__ import annotations

from eomgen.base.data import dataclass
from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import record
from eomgen.mechanics.forces.contacts import Contact, contact
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.symbols import DetachedSymbols, Quantities
from eomgen.scene.forces.tyres import Slip, Tyre
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, dot, minus, multiply, plus, scaled, transpose
from eomgen.symbolic.tape import ONE, ZERO, Tape


@dataclass(frozen=True)
class TyreContact:
    """Contact of a tyre with a road, in world axes.

    Attributes
    ----------
    velocity : of the wheel's centre
    gradient : direction of the normal force, scaled to z = 1
    steepness : length of ``gradient``
    deflection, rate : vertical, of radius + height of the road - height of the centre; negative for gaps
    contact : law of the contact; its force times ``gradient`` is the force on the wheel
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
    """Record the contact of tyre and road: velocity, slopes of the road, deflection and force, in world axes."""
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
    """Return the height of a road, m, at a position, and its partials in x, in y, and explicitly in time. The partials
    are taken on a separate tape, on which x and y are independent; on the scene's tape x and y depend on common
    quantities."""
    tape, kernel = quantities.algebra.tape, Tape()
    detached = DetachedSymbols(quantities, kernel)

    def resolve(symbol: Symbol) -> Scalar:
        if symbol.kind == "position":
            return Scalar(kernel, kernel.input("place", symbol.index))
        return detached(symbol)

    height = record(detached.algebra, formula, resolve)
    coordinates = [InputSymbol("place", 0), InputSymbol("place", 1)]
    (tangent,) = forward_partials(
        kernel, [height.ref], {symbol: {k: ONE} for k, symbol in enumerate([*coordinates, InputSymbol("t", 0)])}
    )
    refs = [height.ref, *(tangent.get(direction, ZERO) for direction in range(3))]
    bound = dict(zip(coordinates, (position[0].ref, position[1].ref), strict=True))
    value, along_x, along_y, in_time = (Scalar(tape, ref) for ref in splice(tape, kernel, refs, bound))
    return value, along_x, along_y, in_time


def add_tyre(loads: Loads, tyre: Tyre, quantities: Quantities) -> None:
    """Add to ``loads``, in place, the contact force of a tyre on the wheel, the potential energy, J, and the power, W.
    On a road at rest the spring force has a potential. A moving road does work on the tyre: then the spring force
    counts as power, without a potential."""
    algebra, kinematics = quantities.algebra, quantities.kinematics
    link, s = kinematics.local(*quantities.at(quantities.points[tyre.center]))
    if link < 0:
        return  # on a body that is fixed to the base
    state = tyre_contact(quantities, tyre)
    normal = scaled(state.contact.force, state.gradient)
    if tyre.moving_road:
        loads.power = loads.power + dot(normal, state.velocity)
    else:
        loads.potential = loads.potential + state.contact.potential
        loads.power = loads.power - (state.contact.force - state.contact.elastic) * state.rate
    force, moment = normal, algebra.zero_vector
    to_world = multiply(kinematics.base.orientation, kinematics.pose(link)[0])
    if tyre.slip is not None:
        arm, patch_velocity, grip = _slip(quantities, tyre, tyre.slip, state)
        loads.power = loads.power + dot(grip, patch_velocity)
        force, moment = plus(normal, grip), cross(arm, grip)
    to_link = transpose(to_world)
    force, moment = apply(to_link, force), apply(to_link, moment)
    load = (plus(moment, cross(s, force)), force)
    add_wrench(loads.wrenches, link, load)
    add_wrench(loads.external, link, load)


def _slip(quantities: Quantities, tyre: Tyre, slip: Slip, state: TyreContact) -> tuple[Vector, Vector, Vector]:
    """Return the contact point relative to the wheel's centre, m, the velocity of the material point in contact, m/s,
    and the slip force in the plane of the road, N; (3,) each, in world axes. Raises ModelError for a spin axis normal
    to the road."""
    algebra, kinematics = quantities.algebra, quantities.kinematics
    mount = kinematics.tree.mount_at(*quantities.at(quantities.points[tyre.center]))
    up = scaled(algebra.one / state.steepness, state.gradient)
    to_world = multiply(kinematics.base.orientation, kinematics.pose(mount.link)[0])
    axis = apply(to_world, apply(mount.orientation, algebra.vector(slip.axis)))
    sideways = minus(axis, scaled(dot(axis, up), up))
    level = algebra.length(sideways)
    if level.is_zero:
        fault = "the spin axis is normal to the road for all coordinates, so the wheel has no heading [E2168]"
        raise ModelError(Problem(f"tyres.{tyre.name}.slip.axis", fault, "a level axis, as [0, 1, 0]"))
    sideways = scaled(algebra.one / level, sideways)
    forward = cross(sideways, up)
    arm = scaled(state.deflection - quantities.formula(tyre.radius), up)
    omega, _ = kinematics.inertial_twist(mount.link)
    omega = apply(to_world, omega)
    patch_velocity = plus(state.velocity, cross(omega, arm))
    rolling, at_rest = dot(state.velocity, forward), quantities.formula(slip.velocity)
    speed = algebra.call(Op.SQRT, rolling * rolling + at_rest * at_rest)
    demanded = [
        quantities.formula(stiffness) * dot(patch_velocity, direction) / speed
        for stiffness, direction in zip(slip.stiffness, (forward, sideways), strict=True)
    ]
    limit = quantities.formula(slip.friction)
    share = dot(demanded, demanded) / (limit * limit)
    size = -(state.load / algebra.call(Op.SQRT, share + 1.0))
    return arm, patch_velocity, scaled(size, plus(scaled(demanded[0], forward), scaled(demanded[1], sideways)))


#: Quantities of tyres in formulas.
_QUANTITIES = {
    "load": lambda quantities, tyre: tyre_contact(quantities, tyre).load,
    "deflection": lambda quantities, tyre: tyre_contact(quantities, tyre).deflection,
}
LAW = Law(Tyre, add_tyre, _QUANTITIES)
