"""Description: data of the back end besides the equations (names, units, limits, requirements, drawing).

A front end gives a ``Description`` with a ``System``: names, units and bounds of all numbers, formulas that are
evaluated when a run starts or fails, and geometry to draw. The back end does not know the source of the description.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.base.data import dataclass, field
from eomgen.base.rounding import COMPUTED
from eomgen.formula.evaluate import evaluate
from eomgen.formula.features import may_be_fast, summands
from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Formula, Vector
from eomgen.formula.prescribed_motion import PrescribedLaw
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.lie.product import Factor
from eomgen.system.motions import Motion
from eomgen.system.signals import Input, Output, Parameter, State

#: The frame that carries everything and moves as prescribed, and the inertial frame; names of bodies may be either.
BASE = "base"
WORLD = "world"
#: Largest argument of compiled sines and cosines, rad: up to it, range reduction subtracts exact products.
LARGEST_ANGLE = 1e10
#: Codes of sentences on a start: values that the constraints change; initial values that are lost among them although
#: the constraints leave as many free; beams that a loop strains. Messages of runs have the last two.
CORRECTED, LOST, STRAINED = "W0305", "W0306", "W0287"
#: Code of a sentence on an initial value that a drive overrides, which messages of runs have, too.
OVERRIDDEN = "W0307"


def component_names(letter: str, name: str, size: int) -> list[str]:
    """Return ``q.hinge`` for one component, ``q.ball[0]`` and so on for several; without a letter, the name alone."""
    full = f"{letter}.{name}" if letter else name
    return [full] if size == 1 else [f"{full}[{index}]" for index in range(size)]


@dataclass(frozen=True)
class LinearParameter:
    """A parameter in which inverse dynamics is linear, ``upper.mass``, kg: a column of the regressor."""

    name: str
    unit: str


@dataclass(frozen=True)
class Coordinates:
    """Names and units of the coordinates of a factor R of the configuration, for messages and random draws.

    Attributes
    ----------
    name : of the factor
    units : of each component of q; components of v have the same per second
    reach : range of each component in random draws, in the unit of the component; empty for any value
    length : reference length of small deflections, m; 0 for coordinates that are not deflections
    linear : whether the equations hold for small values only
    """

    name: str
    units: tuple[str, ...]
    reach: tuple[float, ...] = ()
    length: float = 0.0
    linear: bool = False


@dataclass(frozen=True)
class WrittenStart:
    """Which parts of the initial state of a joint the user wrote; written parts are kept as far as constraints allow.

    Attributes
    ----------
    joint : name of the factor
    held : whether a start that changes them is refused
    """

    joint: str
    position: bool
    velocity: bool
    held: bool = False


@dataclass(frozen=True)
class CoordinateLimit:
    """A range of one coordinate, beyond which a stop pushes the coordinate back.

    Attributes
    ----------
    subject : coordinate and joint, for messages: ``the travel of joint slider``
    coordinate : name among the coordinates q: ``q.slider``
    unit : of the coordinate, ``m`` or ``rad``
    lower, upper : bounds, formulas of parameters; None for an open end
    stiffness : of the stop, N/m or N m/rad
    """

    subject: str
    coordinate: str
    unit: str
    lower: Formula | None
    upper: Formula | None
    stiffness: Formula

    def passed(self, position: float, value: Callable[[Formula], float]) -> str:
        """Return a sentence on a start at ``position`` beyond the range, empty within; ``value`` evaluates formulas of
        parameters."""
        bounds = [
            math.inf * sign if bound is None else value(bound)
            for bound, sign in ((self.lower, -1.0), (self.upper, 1.0))
        ]
        size = sum(abs(bound) for bound in bounds if math.isfinite(bound))
        rounding = COMPUTED * (size + 1.0 if self.unit == "rad" or not size else size)
        for side, limit, sign in (("lower", bounds[0], -1.0), ("upper", bounds[1], 1.0)):
            depth = sign * (position - limit)
            if depth > rounding:
                effort = f"{value(self.stiffness) * depth:.3g} {'N m' if self.unit == 'rad' else 'N'}"
                return (
                    f"{self.subject} starts at {position:.4g} {self.unit}, beyond its {side} limit {limit:.4g}"
                    f" {self.unit}: the stop pushes back with up to {effort}; try an initial position within the"
                    f" limits [W0112]"
                )
        return ""


class Rule(Protocol):
    """A condition on one value, or on several together.

    Attributes
    ----------
    stage : rules of a later stage are judged only if all rules of earlier stages are satisfied
    """

    @property
    def stage(self) -> int: ...

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        """Return whether values break the rule: numbers, or arrays that broadcast. No value is NaN."""
        ...

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        """Return the fault of values that break the rule, and a remedy."""
        ...


@dataclass(frozen=True)
class Requirement:
    """A rule for values that tunable parameters decide.

    Attributes
    ----------
    where : file, line and key, for messages
    formulas : the values, formulas of parameters
    rule : None if a finite value is the only condition
    """

    where: str
    formulas: tuple[Formula, ...]
    rule: Rule | None = None


@dataclass(frozen=True)
class Point:
    """A point fixed in a body (or in the base, or in the world), coordinates in that frame, formulas of parameters."""

    name: str
    body: str
    position: Vector


@dataclass(frozen=True)
class FixedFrame(Point):
    """A frame fixed in a body (or in the base, or in the world): a point with axes.

    ``orientation``, (3, 3), and ``quaternion``, (w, x, y, z), transform from frame axes to body axes.
    """

    orientation: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


_Rows = tuple[tuple[Formula, ...], ...]


@dataclass(frozen=True)
class ElementStiffness:
    """Stiffness of the elements of a geometrically exact beam.

    Attributes
    ----------
    nodes : bodies that are the nodes, along the beam; each element joins two neighbours
    lengths : of the elements at rest, m
    stiffness : of the sections of each element, rows of 6, rotations first, section axes; formulas of parameters; rows
        of zeros for strains that the beam does not have
    twists : (6,) of each element, logarithm of the pose of the second node in the first, in the initial shape
    compliance : of elements whose sections vary, mean of the inverse of the stiffness, and means of its products with
        the distance from the middle and with the square of that; empty for other elements
    """

    nodes: tuple[str, ...]
    lengths: tuple[float, ...]
    stiffness: tuple[_Rows, ...]
    twists: tuple[tuple[float, ...], ...]
    compliance: tuple[tuple[_Rows, ...], ...]

    def matrices(self, values: Mapping[str, float]) -> Array:
        """Return the stiffness of each element at values of the parameters, (elements, 6, 6), N m/rad and N/m.

        Strains are changes of the logarithm of the relative pose. Forces and moments vary along an element: see
        ``mechanics.forces.cosserat_beams``; the flexibility is S^-1 + l^2/12 ad S^-1 ad^T, ad of the initial shape,
        with ad C1 + C1 ad^T of the first moment C1 of the compliance in addition if sections vary.
        """
        return np.array([stiffness for stiffness, _ in self._stiffness_of_elements(values)])

    def bending_within(self, values: Mapping[str, float], forces: Array) -> Array:
        """Return deflections within elements, (elements,), relative to the lengths of elements: Q l^2 / 12 EI for a
        force Q.

        The deflections are small compared with 1 if forces and moments vary along an element as in the initial shape.

        Parameters
        ----------
        values : of the parameters by name
        forces : (elements, 6) section forces by the matrices of ``matrices``
        """
        bends = [within @ force for (_, within), force in zip(self._stiffness_of_elements(values), forces, strict=True)]
        return np.asarray(np.linalg.norm(np.array(bends)[:, 3:], axis=1))

    def _stiffness_of_elements(self, values: Mapping[str, float]) -> list[tuple[Array, Array]]:
        """Return for each element the stiffness, (6, 6), and ad C2 ad^T, the flexibility by varying forces, (6, 6).
        ``values`` are the parameters by name. Equal elements are evaluated once."""
        made: dict[object, tuple[Array, Array]] = {}
        result = []
        for rows, length, twist, means in zip(self.stiffness, self.lengths, self.twists, self.compliance, strict=True):
            key = id(rows), length, twist, id(means)
            if key not in made:
                made[key] = _stiffness_of_element(rows, means, length, twist, values)
            result.append(made[key])
        return result


def _stiffness_of_element(
    rows: _Rows, means: Sequence[_Rows], length: float, twist: Sequence[float], values: Mapping[str, float]
) -> tuple[Array, Array]:
    """Return the stiffness of an element, (6, 6), and ad C2 ad^T, the flexibility by forces that vary along the
    element, (6, 6). ``rows`` are the section stiffness, ``means`` the means of the compliance (or empty), ``twist`` the
    initial shape."""

    def numbers(rows: _Rows) -> Array:
        return np.array([[evaluate(entry, lambda symbol: values[symbol.name]) for entry in row] for row in rows])

    section = numbers(rows)
    kept = np.ix_(*2 * [np.flatnonzero(np.any(section != 0.0, axis=1))])  # strains that the beam has
    flexibility, stiffness = np.zeros((6, 6)), np.zeros((6, 6))
    along = numeric.bracket_matrix(SE3, np.array(twist) / length)
    if means:
        mean, first, second = map(numbers, means)
        flexibility, within = mean + along @ first + first @ along.T, along @ second @ along.T
    else:
        flexibility[kept] = np.linalg.inv(section[kept])
        within = length**2 / 12.0 * along @ flexibility @ along.T
    stiffness[kept] = np.linalg.inv((flexibility + within)[kept]) / length
    return stiffness, within


@dataclass(frozen=True)
class Solid:
    """Drawing of a body moved by the term ``poses``: the homogeneous solid with the mass, centre and inertia of the
    body.

    Attributes
    ----------
    inertia : xx, yy, zz, xy, xz, yz about the centre of mass, body axes
    hub : start of lines to joints and forces on the body: the centre of mass (``center``) or the ``origin``
    """

    name: str
    mass: Formula
    center_of_mass: Vector = ZERO_VECTOR
    inertia: tuple[Formula, Formula, Formula, Formula, Formula, Formula] = (ZERO,) * 6
    hub: str = "origin"


@dataclass(frozen=True)
class Hinge:
    """Drawing of a joint: a pin (``turns``) or a rail (``slides``) along ``axis``, at ``position``, m, in the parent.
    ``tied``: whether the drawing of the parent extends to the joint."""

    name: str
    type: str
    parent: str
    child: str
    position: Vector
    axis: tuple[float, float, float]
    turns: bool = False
    slides: bool = False
    tied: bool = True


@dataclass(frozen=True)
class DrawnLink:
    """A connection between two places, drawn as a rod if ``visible``; both bodies are drawn up to the connection."""

    name: str
    first: Point
    second: Point
    visible: bool = False


@dataclass(frozen=True)
class Obstacle:
    """A sphere or a cylinder around which a line wraps.

    Attributes
    ----------
    after : index of the point of the line before the obstacle
    cylinder : whether it is a cylinder about the z axis
    body, position, axes : carrier; origin, m, and axes in the carrier, as of ``Shape``
    radius : m
    side : name of a point on the side on which the line passes; empty for the shorter way
    inside : whether the line goes through a ring of this radius
    """

    after: int
    cylinder: bool
    body: str
    position: Vector
    axes: tuple[tuple[float, ...], ...]
    radius: Formula
    side: str
    inside: bool


@dataclass(frozen=True)
class Line:
    """Drawing of a force between two named points, ``first`` and ``second``. ``elastic``: a spring, with ``length`` at
    rest in m. ``path``: names of all points of a line over more points, or with ``obstacles`` around which the line
    wraps; empty for a straight line."""

    name: str
    first: str
    second: str
    elastic: bool = True
    length: Formula = ZERO
    path: tuple[str, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()


@dataclass(frozen=True)
class Wheel:
    """A tyre about a point, by name, on a road: a formula of the point's position, time, inputs and parameters.

    ``axis``: of its spin in the axes of the point's body; None for a tyre without slip.
    """

    name: str
    center: str
    radius: Formula
    road: Formula
    stiffness: Formula
    axis: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class UnreadMesh:
    """The mesh of a shape in a file that is read when a picture shows the shape: to read and to thin a mesh takes
    0.1 s, and no equation depends on it.

    Attributes
    ----------
    file : path
    most : number of triangles that are kept
    read : from a shape, ``file`` and ``most`` to the shape with its mesh; raises FileError
    """

    file: str
    most: int
    read: Callable[[Shape, str, int], Shape]


@dataclass(frozen=True)
class Shape:
    """A solid or a mesh of pictures, fixed in a body, in the base or in the world.

    Attributes
    ----------
    kind : ``box``, ``cylinder``, ``sphere``, ``capsule``, ``wheel``, ``ellipsoid`` or ``mesh``
    position : of the centre of the solid, or of the origin of the mesh, m, in the body; formulas of parameters
    axes : (3, 3) own axes to body axes; z is the axis of symmetry
    sizes : m, formulas of parameters: three sides; radius and length; radius; radius and width; three semi-axes; of a
        mesh metres per unit of the vertices, one or three along its axes, negative for a mirrored mesh
    color : ``#rrggbb``; empty for the colour of the body
    opacity : 1 for a shape that hides all objects behind it
    vertices, faces : of a mesh: (n, 3) float32 and (m, 3) int32 as bytes, counterclockwise from outside
    face_colors : of a mesh: (m, 3) int16 as bytes, red, green and blue, 0 to 255, -1 for ``color``; empty without any
    closed : whether no back of a face of a mesh is seen
    implied : whether the shape follows from a tyre or a rolling constraint
    unread : the file of a mesh whose vertices and faces are not here; None if they are
    """

    name: str
    body: str
    kind: str
    position: Vector
    axes: tuple[tuple[float, ...], ...]
    sizes: tuple[Formula, ...]
    color: str = ""
    opacity: float = 1.0
    vertices: bytes = b""
    faces: bytes = b""
    face_colors: bytes = b""
    closed: bool = False
    implied: bool = False
    unread: UnreadMesh | None = None

    def whole(self) -> Shape:
        """Return the shape with its mesh, which is read now if it was not read before.

        Raises
        ------
        FileError
            The mesh cannot be read.
        """
        return self if self.unread is None else self.unread.read(self, self.unread.file, self.unread.most)


@dataclass(frozen=True)
class HeightSurface:
    """A surface over a plane, on which a body rolls or slides, or an equation of the place of a body over a plane.

    Attributes
    ----------
    body, position, axes : carrier of the plane; origin, m, and axes of the plane in the carrier, as of ``Shape``
    height : m, formula of the plane's x and y and of parameters; or an equation of x, y, z, time and parameters
    rider, center : the body on the surface, and its centre in the body, m
    size : of the body on the surface, m; 0 for an equation
    """

    name: str
    body: str
    position: Vector
    axes: tuple[tuple[float, ...], ...]
    height: Formula
    rider: str
    center: Vector
    size: Formula


@dataclass(frozen=True)
class Drawing:
    """Geometry of pictures and animations. Solids come in the order of the poses.

    ``ground``: a place in the world of a plane on which bodies roll, m, formulas of parameters; empty without one.
    """

    solids: tuple[Solid, ...] = ()
    hinges: tuple[Hinge, ...] = ()
    points: tuple[Point, ...] = ()
    lines: tuple[Line, ...] = ()
    links: tuple[DrawnLink, ...] = ()
    wheels: tuple[Wheel, ...] = ()
    shapes: tuple[Shape, ...] = ()
    contact_surfaces: tuple[HeightSurface, ...] = ()
    ground: tuple[Formula, ...] = ()


@dataclass(frozen=True)
class Simulation:
    """Defaults of ``simulate`` that a scene gives: method with options, step and duration in s, recording, tolerance,
    and type of numbers (``real``). ``start`` is ``initial`` or ``equilibrium``; ``settings`` are further options of the
    method by name."""

    method: str = "generalized_alpha"
    step: float = 1e-3
    duration: float = 10.0
    rho_inf: float = 0.8
    record_every: int = 1
    alpha: float | None = None
    beta: float | None = None
    gamma: float | None = None
    start: str = "initial"
    tolerance: float | None = None
    order: int | None = None
    settings: Mapping[str, float] = field(default_factory=dict)
    real: str = "double"


@dataclass(frozen=True)
class Description:
    """Facts of a ``CompiledModel`` besides its compiled functions.

    Attributes
    ----------
    parameters : tunable parameters, which are arguments of every call, and fixed parameters
    states, inputs, outputs : in the order of z, u and the outputs; inputs without formula and harmonics are driven
    motions : laws that a caller moves between steps, by tunable parameters
    parts : by section of a product, the objects of the entries
    coordinates : of the factors of group R; factors left out have no unit
    joints : factors of joints between absolute bodies, which serve as measures; else empty
    base : names of the base's accelerations, which count as disturbances
    laws : values prescribed over time
    formulas : formulas that forces depend on, inputs excepted
    limits : ranges of coordinates
    starts : written parts of the initial state, in joint coordinates
    requirements : conditions on values that depend on tunable parameters
    lengths : vectors, m, with norms of the order of the machine's size
    gravity : m/s^2
    exact_beams : of geometrically exact beams: the bodies of the nodes, in the order along the beam
    element_stiffness : of the elements of these beams, beam by beam
    frames : named frames of bodies
    contacts : surfaces on which bodies roll or slide, and equations between two frames, by the constraint's name
    linear_parameters : columns of the regressor, if the scene has one
    places : places of the keys of ``simulation``, for messages: ``file:line`` by ``simulation.method``
    notes : of reading the scene, shapes excepted
    """

    name: str
    description: str = ""
    parameters: tuple[Parameter, ...] = ()
    states: tuple[State, ...] = ()
    inputs: tuple[Input, ...] = ()
    motions: tuple[Motion, ...] = ()
    parts: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    outputs: tuple[Output, ...] = ()
    coordinates: tuple[Coordinates, ...] = ()
    joints: tuple[Factor, ...] = ()
    base: tuple[str, ...] = ()
    laws: tuple[PrescribedLaw, ...] = ()
    formulas: tuple[Formula, ...] = ()
    limits: tuple[CoordinateLimit, ...] = ()
    requirements: tuple[Requirement, ...] = ()
    lengths: tuple[tuple[Formula, ...], ...] = ()
    gravity: Vector = ZERO_VECTOR
    exact_beams: tuple[tuple[str, ...], ...] = ()
    element_stiffness: tuple[ElementStiffness, ...] = ()
    frames: tuple[FixedFrame, ...] = ()
    contacts: tuple[HeightSurface, ...] = ()
    linear_parameters: tuple[LinearParameter, ...] = ()
    drawing: Drawing = field(default_factory=Drawing)
    simulation: Simulation = field(default_factory=Simulation)
    places: Mapping[str, str] = field(default_factory=dict)
    starts: tuple[WrittenStart, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def fixed(self) -> dict[str, float]:
        """Values of the parameters that are not tunable."""
        return {item.name: item.value for item in self.parameters if not item.tunable}

    def values(self, tunable: Mapping[str, float]) -> dict[str, float]:
        """Return the values of all parameters by name; parameters that are not in ``tunable`` have the scene's
        values."""
        return {item.name: tunable.get(item.name, item.value) for item in self.parameters}

    def fast_laws(self, caller_inputs: Collection[str] = ()) -> list[Formula]:
        """Return the formulas of forces, rates and inputs that may change much within a step.

        Parameters
        ----------
        caller_inputs : names of inputs that the caller gives in the place of the scene's
        """
        prescribed = {law.formula for law in self.laws}
        inputs = [item.formula for item in self.inputs if item.formula is not None and item.name not in caller_inputs]
        formulas = (formula for formula in (*self.formulas, *inputs) if formula not in prescribed)
        return list(dict.fromkeys(part for formula in formulas for part in summands(formula) if may_be_fast(part)))

    @property
    def driven(self) -> tuple[str, ...]:
        """Names of the inputs that a controller or a caller drives."""
        return tuple(item.name for item in self.inputs if not item.given)

    @property
    def disturbances(self) -> tuple[str, ...]:
        """Names of the columns of a linear model's right-hand side that are not driven: given inputs, then the base."""
        return (*(item.name for item in self.inputs if item.given), *self.base)
