"""Constraints between bodies: loop closures, and the joints of absolute coordinates; reactions: the wrench that a joint
or a constraint transmits, about a point and in the axes of a body.
"""

from __future__ import annotations

from typing import Literal

from eomgen.base.data import dataclass
from eomgen.formula.nodes import ZERO, Formula
from eomgen.formula.prescribed_motion import constant
from eomgen.scene.joint_types import TYPES, Connection, ConstraintType, JointType
from eomgen.system.description import WORLD, Point


@dataclass(frozen=True)
class Frame:
    """A frame fixed in a body (or in the base).

    Attributes
    ----------
    position : formulas of parameters, in the body's frame
    orientation : (3, 3) constant rotation, frame axes to body axes, row by row; z is the joint's axis
    """

    body: str
    position: tuple[Formula, Formula, Formula] = (ZERO, ZERO, ZERO)
    orientation: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Constraint:
    """A constraint between two frames, which coincide when it is met with all free displacements zero.

    Attributes
    ----------
    type : str
        ``revolute``, ``cylindrical``, ``helical`` and ``prismatic`` share the z axis, along which the second frame of
        ``helical`` travels ``pitch`` per radian it turns; ``planar`` keeps the second frame's origin in
        the first's xy plane with parallel z; ``universal`` keeps first x and second y perpendicular, and the origins
        together; ``point_on_line`` keeps the second's origin on the first's z axis; ``distance`` keeps the origins
        ``length`` apart; ``rolling`` lets a disc about the second frame's z axis (or a sphere) of ``radius`` roll on
        the first's xy plane without slip.
    drive : formula of t and parameters, or None
        Prescribes the free displacement: the angle or the travel that the type names.
    length : formula of t and parameters
    """

    name: str
    type: ConstraintType | JointType
    first: Frame
    second: Frame
    drive: Formula | None = None
    length: Formula = ZERO
    radius: Formula = ZERO
    pitch: Formula = ZERO
    shape: Literal["disc", "sphere"] = "disc"

    @property
    def kind(self) -> Connection:
        """Properties of its type."""
        return TYPES[self.type]

    @property
    def prescribed(self) -> Formula | None:
        """Its prescribed coordinate as a formula of time: its drive, or a length that changes; None without one."""
        return self.length if self.drive is None and not constant(self.length) else self.drive


@dataclass(frozen=True)
class Reaction:
    """Force and moment that a joint's parent exerts on its child, or a constraint's first body on its second.

    Attributes
    ----------
    section, of : the joint or constraint
    point : about which the moment is taken; None for the origin of the child's frame, or of the second frame
    axes : body whose axes the components are in, ``base`` or ``world``
    """

    name: str
    section: Literal["joints", "constraints"]
    of: str
    point: Point | None = None
    axes: str = WORLD
