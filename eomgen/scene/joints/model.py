"""The joints of a scene, constraints between bodies and reactions: types, coordinates, placement, forces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal

from eomgen.base.data import dataclass
from eomgen.errors import Problem
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ONE, ZERO, ZERO_VECTOR, Formula, Symbol, Vector, infix
from eomgen.formula.prescribed_motion import constant
from eomgen.scene.joint_types import JOINTS, TYPES, Connection, ConstraintType, JointType, is_own
from eomgen.system.description import WORLD, CoordinateLimit, Point, WrittenStart, component_names

#: Surfaces that touch a plane.
Shape = Literal["disc", "sphere", "ellipsoid", "torus"]
#: Units of equations, of positions and of velocities.
EquationUnit = Literal["m", "rad", "m/s", "rad/s"]


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
    """A constraint between two frames, which coincide if the constraint is satisfied and all free displacements are
    zero.

    Attributes
    ----------
    type : str
        ``revolute``, ``cylindrical``, ``helical`` and ``prismatic`` share the z axis, along which the second frame of
        ``helical`` travels ``pitch`` per radian; ``planar`` keeps the second frame's origin in the first's xy
        plane with parallel z; ``universal`` keeps first x and second y perpendicular, and the origins together;
        ``point_on_line`` keeps the second's origin on the first's z axis; ``orientation`` keeps the axes parallel;
        ``distance`` keeps the origins at the distance ``length``; ``rolling`` lets a disc or a torus about the second
        frame's z axis, a sphere or an ellipsoid roll on the first's xy plane without slip, ``sliding`` lets the body
        slide there; ``formula`` holds an equation.
    drive : formula of t and parameters, or None
        Prescribes the free displacement: the angle or the travel that the type names.
    length : formula of t and parameters
    radius : of the disc or sphere, of the centre line of the torus
    semi_axes : of the ellipsoid, along the axes of the second frame
    tube_radius : of the torus
    surface : height of a rolling or sliding contact's surface over the first frame's xy plane, formula of the place;
        None for the plane
    equation : formula that is 0, or None; between two frames of the local position, else of coordinates and points
    at_velocity : whether the equation is in velocities, and linear in velocities
    unit : of the equation
    framed : whether the constraint joins two frames; False for an equation of coordinates and points
    """

    name: str
    type: ConstraintType | JointType
    first: Frame
    second: Frame
    drive: Formula | None = None
    length: Formula = ZERO
    radius: Formula = ZERO
    pitch: Formula = ZERO
    shape: Shape = "disc"
    semi_axes: tuple[Formula, Formula, Formula] = ZERO_VECTOR
    tube_radius: Formula = ZERO
    surface: Formula | None = None
    equation: Formula | None = None
    at_velocity: bool = False
    unit: EquationUnit = "m"
    framed: bool = True

    @property
    def kind(self) -> Connection:
        """Properties of the type."""
        return TYPES[self.type]

    @property
    def text(self) -> str:
        """The equation as text, with x, y and z for the second frame's origin; empty without an equation."""
        if self.equation is None:
            return ""
        vectors = ("position", "velocity")
        text = infix(self.equation, lambda symbol: 3 if symbol.kind in vectors else 1)
        for k, name in enumerate("xyz"):
            text = text.replace(f"position.here[{k}]", name)
        return text

    @property
    def frames(self) -> tuple[Frame, ...]:
        """The joined frames; none for an equation of coordinates and points."""
        return (self.first, self.second) if self.framed else ()

    @property
    def has_effort(self) -> bool:
        """Whether there is one effort: of a drive, or along the value of the equation."""
        return self.prescribed_coordinate is not None or self.equation is not None

    def given_lengths(self) -> Iterator[tuple[str, Formula]]:
        """Yield the lengths that the scene gives, m, each with its key."""
        lengths = [("length", self.length), ("radius", self.radius), ("tube_radius", self.tube_radius)]
        lengths += [(f"semi_axes[{k}]", part) for k, part in enumerate(self.semi_axes)]
        yield from ((name, formula) for name, formula in lengths if formula != ZERO)

    @property
    def moving(self) -> tuple[Symbol, ...]:
        """The symbols of motion in the equation: coordinates, velocities, positions of points and local coordinates,
        sorted; none without an equation."""
        if self.equation is None:
            return ()
        named = (item for item in symbols(self.equation) if item.kind in ("q", "v", "position", "velocity", "local"))
        return tuple(sorted(named, key=lambda item: (item.kind, item.name, item.index)))

    @property
    def prescribed_coordinate(self) -> Formula | None:
        """The prescribed coordinate as a formula of time: the drive, or a variable length; None without either."""
        return self.length if self.drive is None and not constant(self.length) else self.drive


@dataclass(frozen=True)
class Reaction:
    """Force and moment of a joint's parent on the child, or of a constraint's first body on the second body.

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


#: Default penetration at which a stop reaches full stiffness, by unit of the coordinate.
ONSETS: Mapping[str, float] = {"rad": 1e-3, "m": 1e-4}


@dataclass(frozen=True)
class Stop:
    """Compliant stops of the coordinate ``index`` of a joint, at either end or both (None for an end without one).
    Beyond ``lower`` or ``upper`` by d the effort is s(d / onset) max(0, stiffness d + damping d'), back into the range;
    s rises from 0 to 1 over the onset."""

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

    The leader has one coordinate; the leader may follow another joint, but not in a circle.
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
        the first axis of universal joints, the normal of planar joints.
    second_axis : (3,) unit vector orthogonal to ``axis``: the second axis of universal joints, the x axis of planar
        joints.
    pitch : formula of parameters, m/rad: travel of helical joints per angle.
    orientation : (3, 3) constant rotation matrix, child axes to parent axes at neutral q, row by row; right angles
        snapped.
    stiffness, damping : coefficients; effort -stiffness (q - rest) - damping v. On joints of real coordinates only.
    rotor_inertia : coefficients, added to the joint's diagonal of M.
    stops, friction : at most one each per coordinate. On joints of real coordinates only.
    initial_position : neutral-relative q: 0 to 3 numbers; spherical: quaternion (4); free: quaternion and position (7).
    initial_velocity : 0 to 3, or 6 numbers; angular first, body axes.
    start : which of both the user wrote; None for neither.
    mimic : the coordinate that the joint's coordinate follows, None for an independent coordinate.
    drive : formulas of time that prescribe the coordinates, one for each; empty for free coordinates.
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
    start: WrittenStart | None = None
    stops: tuple[Stop, ...] = ()
    friction: tuple[Friction, ...] = ()
    second_axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    pitch: Formula = ZERO
    mimic: Mimic | None = None
    drive: tuple[Formula, ...] = ()

    @property
    def kind(self) -> Connection:
        """Properties of the type."""
        return JOINTS[self.type]

    @property
    def has_extension_type(self) -> bool:
        """Whether the type is another distribution's."""
        return not is_own(self.type)

    def each(self, coefficients: Coefficients) -> tuple[Formula, ...]:
        """Return coefficients as one formula for each coordinate."""
        return coefficients if isinstance(coefficients, tuple) else (coefficients,) * self.kind.v_size

    def lengths(self) -> tuple[Formula, ...]:
        """Return rest lengths and finite ends of stops' ranges for the translations, as formulas, m; none for joints
        without plain coordinates."""
        if not self.kind.coordinates:
            return ()
        first = self.kind.angles
        ends = [
            end for stop in self.stops if stop.index >= first for end in (stop.lower, stop.upper) if end is not None
        ]
        return (*self.each(self.rest)[first:], *ends)

    @property
    def limits(self) -> tuple[CoordinateLimit, ...]:
        """The range of each stop as a CoordinateLimit, with the coordinate's name and unit."""
        meanings = list(self.kind.coordinates.items())
        names = component_names("q", self.name, len(meanings))
        result = []
        for stop in self.stops:
            meaning, unit = meanings[stop.index]
            subject = f"joint {self.name}" if len(meanings) == 1 else f"the {meaning} of joint {self.name}"
            result.append(CoordinateLimit(subject, names[stop.index], unit, stop.lower, stop.upper, stop.stiffness))
        return tuple(result)


@dataclass(frozen=True)
class LightJoint:
    """A joint that moves no inertia, in a scene whose constraints may determine its motion.

    Attributes
    ----------
    joint, body : names; in absolute coordinates the body is free
    problem : to be reported if they do not
    """

    joint: str
    body: str
    problem: Problem
