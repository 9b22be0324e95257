"""The joints of a scene: types, coordinates, placement, and forces in them."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.base.data import dataclass
from eomgen.formula.nodes import ONE, ZERO, ZERO_VECTOR, Formula, Vector
from eomgen.scene.joint_types import JOINTS, Connection, JointType
from eomgen.system.description import Limit, component_names

#: Default of the penetration over which a stop reaches its full stiffness, by unit of the coordinate.
ONSETS: Mapping[str, float] = {"rad": 1e-3, "m": 1e-4}


@dataclass(frozen=True)
class Stop:
    """Compliant stops of one coordinate of a joint, at either end or both (None for an end without one).

    Beyond ``lower`` or ``upper`` by d the effort is s(d / onset) max(0, stiffness d + damping d'), back into the range;
    s rises from 0 to 1 over the onset.
    """

    index: int
    lower: Formula | None
    upper: Formula | None
    stiffness: Formula
    damping: Formula
    onset: Formula


@dataclass(frozen=True)
class Friction:
    """Dry friction of one coordinate of a joint, regularised: effort -level(v) tanh(v / velocity).

    The level is ``coulomb``, or with ``static`` coulomb + (static - coulomb) exp(-(v / stribeck)^2).
    """

    index: int
    coulomb: Formula
    velocity: Formula
    static: Formula | None = None
    stribeck: Formula | None = None


#: A formula of parameters for a joint with one coordinate, one formula for each of several coordinates.
Coefficients = Formula | tuple[Formula, ...]


@dataclass(frozen=True)
class Mimic:
    """A coordinate that follows another: q = multiplier q_leader + offset, formulas of parameters.

    The leader has one coordinate; it may follow another in its turn, but not in a circle.
    """

    joint: str
    multiplier: Formula = ONE
    offset: Formula = ZERO


@dataclass(frozen=True)
class Joint:
    """A joint, with the child's frame at ``position`` and ``orientation`` in the parent's frame when q is neutral.

    Attributes
    ----------
    axis : (3,) unit vector in the child's (= joint's) frame: of revolute, prismatic, helical and cylindrical joints;
        the first
        axis of universal ones, the normal of planar ones.
    second_axis : (3,) unit vector across ``axis``: the second axis of universal joints, the x axis of planar ones.
    pitch : formula of parameters, m/rad: travel of helical joints per angle.
    orientation : (3, 3) constant rotation matrix, child axes to parent axes at neutral q, row by row; right angles
        snapped.
    stiffness, damping : coefficients; effort -stiffness (q - rest) - damping v. On joints of real coordinates only.
    rotor_inertia : coefficients, added to the joint's diagonal of M.
    stops, friction : at most one each per coordinate. On joints of real coordinates only.
    initial_position : neutral-relative q: 0 to 3 numbers; spherical: quaternion (4); free: quaternion and position (7).
    initial_velocity : 0 to 3, or 6 numbers; angular first, body axes.
    mimic : the coordinate that the joint's coordinate follows, None for a coordinate of its own.
    drive : formulas of time that prescribe its coordinates, one for each; empty for free ones.
    """

    name: str
    type: JointType
    parent: str
    child: str
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    position: Vector = ZERO_VECTOR
    orientation: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    stiffness: Coefficients = ZERO
    damping: Coefficients = ZERO
    rest: Coefficients = ZERO
    rotor_inertia: Coefficients = ZERO
    initial_position: tuple[float, ...] = ()
    initial_velocity: tuple[float, ...] = ()
    stops: tuple[Stop, ...] = ()
    friction: tuple[Friction, ...] = ()
    second_axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    pitch: Formula = ZERO
    mimic: Mimic | None = None
    drive: tuple[Formula, ...] = ()

    @property
    def kind(self) -> Connection:
        """Properties of its type."""
        return JOINTS[self.type]

    def each(self, coefficients: Coefficients) -> tuple[Formula, ...]:
        """Return coefficients as one formula for each coordinate."""
        return coefficients if isinstance(coefficients, tuple) else (coefficients,) * self.kind.v_size

    def lengths(self) -> tuple[Formula, ...]:
        """Return rest lengths and ends of the ranges of its translations, m."""
        if not self.kind.coordinates:
            return ()
        first = self.kind.angles
        ends = [
            end for stop in self.stops if stop.index >= first for end in (stop.lower, stop.upper) if end is not None
        ]
        return (*self.each(self.rest)[first:], *ends)

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The ranges of the stops in terms of the joint's own coordinates, one by one."""
        meanings = list(self.kind.coordinates.items())
        names = component_names("q", self.name, len(meanings))
        result = []
        for stop in self.stops:
            meaning, unit = meanings[stop.index]
            subject = f"joint {self.name}" if len(meanings) == 1 else f"the {meaning} of joint {self.name}"
            result.append(Limit(subject, names[stop.index], unit, stop.lower, stop.upper, stop.stiffness))
        return tuple(result)
