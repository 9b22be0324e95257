"""The law of contacts, of stops and tyres: spring and damper under compression only, smooth at the onset, exactly
linear beyond it, never pulling.

With penetration d, its rate d', stiffness k, damping c and onset w the force is s(d / w) max(0, k d + c d'); s rises
from 0 to 1 as the cubic with level ends. Force and elastic force are continuous with their first derivatives at the
begin of contact and at the end of the onset, so methods of order 2 keep their order; only if the damper pulls is there
a kink.
"""

from __future__ import annotations

from eomgen.base.data import dataclass
from eomgen.mechanics.laws.derived import LAWS
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar


@dataclass(frozen=True)
class Contact:
    """Contact force, N or N m, the conservative part without the damper, and its potential, J."""

    force: Scalar
    elastic: Scalar
    potential: Scalar


def contact(
    algebra: Algebra, penetration: Scalar, rate: Scalar, *, stiffness: Scalar, damping: Scalar, onset: Scalar
) -> Contact:
    """Record the contact force for a penetration, m (negative without contact), and the rate of penetration, m/s.
    Stiffness is in N/m, damping in N s/m, ``onset`` the penetration, m, below which the force rises smoothly. For
    angles the units are in rad and N m."""
    depth = algebra.call(Op.MAX, penetration, algebra.zero)
    within = algebra.call(Op.MIN, depth, onset)
    rise, stored = LAWS["onset_of_contact"].instantiate(algebra, {"u": within / onset})
    linear = stiffness * depth
    elastic = rise * linear
    potential = stiffness * (onset * onset * stored + 0.5 * (depth * depth - within * within))
    if damping.is_zero:
        return Contact(elastic, elastic, potential)
    force = rise * algebra.call(Op.MAX, linear + damping * rate, algebra.zero)
    return Contact(force, elastic, potential)
