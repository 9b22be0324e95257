"""The base and the bodies of a Scene."""

from __future__ import annotations

from eomgen.base.data import dataclass
from eomgen.formula.nodes import ZERO_VECTOR, Formula, Vector
from eomgen.scene.bodies.beam import Beam
from eomgen.scene.reading.rotations import Rotation


@dataclass(frozen=True)
class Base:
    """Prescribed motion of the base: position in world axes and intrinsic rotations, formulas of t and parameters.

    ``added_by``: keys of products that make the leading rotations, one for each; others are written as rotations.
    """

    position: Vector = ZERO_VECTOR
    rotations: tuple[Rotation, ...] = ()
    added_by: tuple[str, ...] = ()


@dataclass(frozen=True)
class Body:
    """A body. Inertia (xx, yy, zz, xy, xz, yz) about the centre of mass, body axes; products as tensor entries.

    ``beam``: its elastic part, None for a rigid body; mass, centre of mass and inertia are then the undeformed beam's.
    ``node_of``: the geometrically exact beam of which the body is a node.
    """

    name: str
    mass: Formula
    center_of_mass: Vector
    inertia: tuple[Formula, Formula, Formula, Formula, Formula, Formula]
    beam: Beam | None = None
    node_of: str = ""
