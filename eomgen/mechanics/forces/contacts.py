"""DOC OF mechanics.forces.contacts."""

from __future__ import annotations

from eomgen.base.data import dataclass
from eomgen.mechanics.laws.derived import LAWS
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar


@dataclass(frozen=True)
class Contact:
    """Contact force against a penetration, and its conservative part."""

    force: Scalar
    elastic: Scalar
    potential: Scalar


def contact(
    algebra: Algebra, penetration: Scalar, rate: Scalar, *, stiffness: Scalar, damping: Scalar, onset: Scalar
) -> Contact:
    """Record the contact force from the penetration, m (negative without contact), and its rate, m/s."""
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
