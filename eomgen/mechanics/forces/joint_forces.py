"""Forces in joints: springs, dampers, compliant stops, and regularised dry friction (Coulomb and Stribeck)."""

from __future__ import annotations

from eomgen.formula.nodes import Symbol
from eomgen.mechanics.forces.contacts import contact
from eomgen.mechanics.forces.loads import Loads, add_effort
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.scene.joints.model import Friction, Joint, Stop
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Scalar


def add_joint(loads: Loads, joint: Joint, quantities: Quantities) -> None:
    """Add a joint's springs, dampers, stops and friction to ``loads``, in place: efforts, potential and power."""
    tape = quantities.algebra.tape
    _add_spring_and_damper(loads, joint, quantities)
    for stop in joint.stops:
        with tape.block(f"stops of joint {joint.name}"):
            _add_stop(loads, joint.name, stop, quantities)
    for friction in joint.friction:
        with tape.block(f"dry friction of joint {joint.name}"):
            rate = quantities(Symbol("v", joint.name, friction.index))
            effort = friction_effort(friction, rate, quantities)
            add_effort(loads, quantities, joint.name, -effort, friction.index)
            loads.power = loads.power - effort * rate


def _add_spring_and_damper(loads: Loads, joint: Joint, quantities: Quantities) -> None:
    of_coordinates = zip(joint.each(joint.stiffness), joint.each(joint.damping), joint.each(joint.rest), strict=True)
    for index, formulas in enumerate(of_coordinates):
        stiffness, damping, rest = (quantities.formula(formula) for formula in formulas)
        if stiffness.is_zero and damping.is_zero:
            continue
        with quantities.algebra.tape.block(f"spring and damper of joint {joint.name}"):
            stretch = quantities(Symbol("q", joint.name, index)) - rest
            rate = quantities(Symbol("v", joint.name, index))
            add_effort(loads, quantities, joint.name, -(stiffness * stretch + damping * rate), index)
            loads.potential = loads.potential + 0.5 * (stiffness * (stretch * stretch))
            loads.power = loads.power - damping * (rate * rate)


def _add_stop(loads: Loads, joint: str, stop: Stop, quantities: Quantities) -> None:
    """Add to ``loads``, in place, the efforts of the stops at both ends of a coordinate, with potential and power. The
    difference between the force of a stop and the elastic force is dissipated."""
    q, v = (quantities(Symbol(kind, joint, stop.index)) for kind in "qv")
    constants = {name: quantities.formula(getattr(stop, name)) for name in ("stiffness", "damping", "onset")}
    for bound, sign in ((stop.lower, -1.0), (stop.upper, 1.0)):
        if bound is None:
            continue
        law = contact(quantities.algebra, (q - quantities.formula(bound)) * sign, v * sign, **constants)
        add_effort(loads, quantities, joint, law.force * -sign, stop.index)
        loads.potential = loads.potential + law.potential
        loads.power = loads.power - (law.force - law.elastic) * (v * sign)


def friction_effort(friction: Friction, rate: Scalar, quantities: Quantities) -> Scalar:
    """Record the friction effort, N m or N, with the rate's sign: (Coulomb + Stribeck term) tanh(rate / velocity)."""
    algebra, formula = quantities.algebra, quantities.formula
    level = formula(friction.coulomb)
    if friction.static is not None and friction.stribeck is not None:
        share = rate / formula(friction.stribeck)
        level = level + (formula(friction.static) - level) * algebra.call(Op.EXP, -(share * share))
    return level * algebra.call(Op.TANH, rate / formula(friction.velocity))
