"""Joint velocities between absolute bodies, the velocity coordinates in which linear models are compared.

Eigenvalues of a linear model that is frozen at an instant of a motion depend on its coordinates: only coordinates
that are constant multiples of each other along the motion have the same. Velocities of bodies are no such multiples
of the joints'.
"""

from __future__ import annotations

from collections.abc import Iterator

from eomgen.mechanics.constraints.joints import joint_constraint
from eomgen.mechanics.constraints.rows import ConstraintCalculus, Row, Rows
from eomgen.mechanics.forces.frame_pairs import frame_pair
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.joints.constraint_model import Frame
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Scalar, apply, dot, minus, transpose


def joint_velocities(scene: Scene, tree: Tree, quantities: Quantities) -> ConstraintCalculus:
    """Return the calculus of the velocities of all independent joints, in the order of ``scene.leading_joints``."""
    rows = Rows()
    for joint in scene.leading_joints:
        with quantities.algebra.tape.block(f"velocity of joint {joint.name}"):
            rows.velocity += _velocities(quantities, joint)
    return ConstraintCalculus(tree, rows, quantities.kinematics.carrier)


def _velocities(quantities: Quantities, joint: Joint) -> list[Row]:
    """Return the velocity components of a joint, rad/s or m/s; on admissible motions they are its joint velocities."""
    item = joint_constraint(joint)
    if item is None or not item.kind.coordinates:
        pair = frame_pair(quantities, Frame(joint.parent, joint.position, joint.orientation), Frame(joint.child))
    else:
        pair = frame_pair(quantities, item.first, item.second)
    first, second = pair.first, pair.second
    turning = minus(pair.angular_velocity(second), pair.angular_velocity(first))
    sliding = minus(pair.velocity_at(second, second.origin), pair.velocity_at(first, second.origin))

    def components() -> Iterator[Scalar]:
        kind = joint.kind
        if not kind.coordinates:
            yield from apply(transpose(second.axes), turning)
            if kind.has("free"):
                yield from apply(transpose(second.axes), sliding)
        for frame, axis in zip((first, second), kind.turned_about, strict=False):
            yield dot(turning, frame.axis(kind.frame_axes[axis]))
        for axis in kind.travels:
            yield dot(sliding, first.axis(kind.frame_axes[axis]))

    return [Row(joint.name, value, "m/s", pair.size, pair.lever, pair.path_length) for value in components()]
