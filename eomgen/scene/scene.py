"""The Scene: what the user described, checked and in SI units, ready for mechanics.

All vectors are tuples of formulas; a plain number is a ``Number``. Where a field may hold a formula, its comment says of what.
Frames: the *world* is inertial; the *base* is the frame that carries the tree and moves as prescribed (it is the world when
``Scene.base`` is None). A body's frame coincides with its joint's frame at q = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from eomgen.scene.beam import Beam
from eomgen.scene.constraint import Constraint
from eomgen.scene.curve import AnyCurve
from eomgen.scene.feedback import StateFeedback
from eomgen.scene.force_elements import Bushing, Friction, Stop, Tyre
from eomgen.scene.formula_nodes import Formula, Number, Symbol

Vector = tuple[Formula, Formula, Formula]
ZERO: Formula = Number(0.0)
ONE: Formula = Number(1.0)
ZERO_VECTOR: Vector = (ZERO, ZERO, ZERO)
BASE = "base"
WORLD = "world"
#: Highest time derivative of inverse dynamics that can be asked for.
HIGHEST_RATE = 8
#: Matrices of the closed form, each a term with its time derivatives.
CLOSED_MATRICES = ("system_jacobian", "adjoints", "joint_brackets", "link_brackets", "coriolis", "coriolis_skew")
#: Names of all terms.
TERMS = (
    "mass",
    "coupling",
    "force",
    "base_motion",
    "inverse_dynamics",
    "forward_dynamics",
    "residual",
    "partials",
    "internal_rate",
    "internal_partials",
    "constraint",
    "constraint_velocity",
    "constraint_bias",
    "constraint_jacobian",
    "velocity_partials",
    "equations",
    "iteration",
    "jacobian_values",
    "poses",
    "twists",
    "accelerations",
    "jacobians",
    "outputs",
    "elastic",
    "linearization",
    "acceleration_partials",
    "output_partials",
    "energy",
    *("rates" if order == 2 else f"rates_{order}" for order in range(1, HIGHEST_RATE + 1)),
    *(f"{block}_rates{suffix}" for block in ("mass", "coupling", "force", "base_motion") for suffix in ("_1", "")),
    "rates_closed",
    "mass_rates_closed",
    *(f"{name}{suffix}" for name in CLOSED_MATRICES for suffix in ("", "_rates_1", "_rates")),
    "forward_rates_1",
    "forward_rates",
)
JointType = Literal["fixed", "revolute", "prismatic", "helical", "cylindrical", "universal", "planar", "spherical", "free"]
#: A formula of parameters where a joint has one coordinate, one formula for each where it has several.
Coefficients = Formula | tuple[Formula, ...]

#: Numbers of coordinates and of velocity components of each joint type.
SIZES: Mapping[str, tuple[int, int]] = {
    "fixed": (0, 0), "revolute": (1, 1), "prismatic": (1, 1), "helical": (1, 1), "cylindrical": (2, 2), "universal": (2, 2),
    "planar": (3, 3), "spherical": (4, 3), "free": (7, 6),
}  # fmt: skip

#: Numbers of coordinates that are angles, which come first.
ANGLES: Mapping[str, int] = {"revolute": 1, "helical": 1, "cylindrical": 1, "universal": 2, "planar": 1}


@dataclass(frozen=True)
class Parameter:
    """A named number. Tunable ones are arguments of every call; the others are folded into the code."""

    name: str
    value: float
    tunable: bool = False
    unit: str = ""
    description: str = ""


@dataclass(frozen=True)
class Input:
    """A named input u_k; what the driver hands in unless told otherwise is a formula plus a sum of harmonics.

    Attributes
    ----------
    formula : formula of t and parameters, or None
    harmonics : tuples (amplitude, angular frequency, phase), each adding amplitude cos(angular frequency t + phase)
    """

    name: str
    formula: Formula | None = None
    unit: str = ""
    description: str = ""
    harmonics: tuple[tuple[float, float, float], ...] = ()

    @property
    def given(self) -> bool:
        """Whether the scene itself says what the input is."""
        return self.formula is not None or bool(self.harmonics)


@dataclass(frozen=True)
class State:
    """An internal state z_k: zdot_k = ``rate``, a formula of everything but accelerations, from ``initial`` on."""

    name: str
    rate: Formula
    initial: float = 0.0
    unit: str = ""
    description: str = ""


@dataclass(frozen=True)
class Controller:
    """What a controller gives, by its name: a formula of its states and of its signal."""

    name: str
    output: Formula
    unit: str = ""
    description: str = ""


@dataclass(frozen=True)
class Rotation:
    """Rotation by ``angle`` about a unit ``axis``; lists of these are intrinsic, in order."""

    axis: tuple[float, float, float]
    angle: Formula


@dataclass(frozen=True)
class Base:
    """Prescribed motion of the base: position in world axes and intrinsic rotations, formulas of t and parameters."""

    position: Vector = ZERO_VECTOR
    rotations: tuple[Rotation, ...] = ()


@dataclass(frozen=True)
class Body:
    """A body. Inertia (xx, yy, zz, xy, xz, yz) about the centre of mass, body axes; products as tensor entries.

    ``beam``: how it deforms; then mass, centre of mass and inertia are those of the beam undeformed. None where it is rigid.
    """

    name: str
    mass: Formula
    center_of_mass: Vector
    inertia: tuple[Formula, Formula, Formula, Formula, Formula, Formula]
    beam: Beam | None = None


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
    axis : (3,) unit vector in the child's (= joint's) frame: of revolute, prismatic, helical and cylindrical joints; the first
        axis of universal ones, the normal of planar ones.
    second_axis : (3,) unit vector across ``axis``: the second axis of universal joints, the x axis of planar ones.
    pitch : formula of parameters, m/rad: travel of helical joints per angle.
    orientation : (3, 3) constant rotation matrix, child axes to parent axes at neutral q, row by row; right angles snapped.
    stiffness, damping : coefficients; effort -stiffness (q - rest) - damping v. On joints of real coordinates only.
    rotor_inertia : coefficients, added to the joint's diagonal of M.
    stops, friction : at most one each per coordinate. On joints of real coordinates only.
    initial_position : neutral-relative q: 0 to 3 numbers; spherical: quaternion (4); free: quaternion and position (7).
    initial_velocity : 0 to 3, or 6 numbers; angular first, body axes.
    mimic : what the joint's coordinate follows, None where it is a coordinate of its own.
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

    def each(self, coefficients: Coefficients) -> tuple[Formula, ...]:
        """Return coefficients as one formula for each coordinate."""
        return coefficients if isinstance(coefficients, tuple) else (coefficients,) * SIZES[self.type][1]


@dataclass(frozen=True)
class Point:
    """A point fixed in a body (or in the base, or in the world), coordinates in that frame, formulas of parameters."""

    name: str
    body: str
    position: Vector


@dataclass(frozen=True)
class Spring:
    """Spring-damper along the line between two points: tension = stiffness (l - length) + damping l' + force.

    ``force`` is a formula of everything (an actuator in parallel), a tension: positive pulls the points together.
    Stiffness, damping and free length are formulas of parameters.
    """

    name: str
    first: str
    second: str
    stiffness: Formula
    damping: Formula
    length: Formula
    force: Formula = ZERO


@dataclass(frozen=True)
class TorsionSpring:
    """Torsional spring-damper between two angles, coordinates of joints (or one and its rest angle, ``second`` empty).

    Effort on ``first``: -(stiffness (q1 - q2 - rest) + damping (v1 - v2)), opposite on ``second``.
    """

    name: str
    first: str
    second: str
    stiffness: Formula
    damping: Formula
    rest: Formula
    first_index: int = 0
    second_index: int = 0


@dataclass(frozen=True)
class Force:
    """Force and torque on a body at a point, formulas of everything but accelerations, in world or body axes."""

    name: str
    body: str
    point: Vector  # body frame, formulas of parameters
    force: Vector
    torque: Vector
    axes: Literal["world", "body"] = "world"


@dataclass(frozen=True)
class Effort:
    """Generalized force on one component of a joint, a formula of everything but accelerations."""

    name: str
    joint: str
    effort: Formula
    index: int = 0


@dataclass(frozen=True)
class Output:
    """A named output: ``values`` are formulas of everything (positions, accelerations and energies included).

    Named energies are the symbols of kind ``energy`` names: see ``kind`` "energy" with name kinetic, potential, total,
    base_power or power.
    """

    name: str
    values: tuple[Formula, ...]
    unit: str = ""
    description: str = ""

    @property
    def quantity(self) -> str:
        """``position``, ``velocity`` or ``acceleration`` where the values are nothing but that, else empty."""
        kinds = {value.kind if isinstance(value, Symbol) else "" for value in self.values}
        kind = kinds.pop() if len(kinds) == 1 else ""
        return kind if kind in ("position", "velocity", "acceleration") else ""


@dataclass(frozen=True)
class Simulation:
    """What ``simulate`` does when the caller does not say otherwise."""

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


@dataclass(frozen=True)
class Scene:
    """A checked scene. Bodies and joints are in an order in which every parent comes before its children.

    Attributes
    ----------
    bodies, joints : tuples of equal length; ``joints[i]`` carries ``bodies[i]``.
    curves : those that formulas can name, and those that inputs are made of.
    feedback : the state feedbacks among the controllers, whose gains a calibration may fill.
    constraints : what closes loops, besides the joints of the tree.
    coordinates : ``joint``, or ``absolute`` where every body moves on its own and joints are constraints.
    groups : by body, ``SE3`` or ``R3xSO3``; for absolute coordinates, unused in joint coordinates. ``SE3`` where nothing
        is said: a lower-pair joint to ground or to slow bodies then holds exactly along a step. ``R3xSO3`` is for bodies that
        spin fast and freely.
    terms : the terms the scene asks for; empty means all that its users may need.
    source : mapping from a dotted key (``bodies.arm.mass``) to ``file:line`` for messages.
    content : bytes that determine the scene (canonical JSON of its data), for the cache key and for golden files.
    notes : what an importer converted, merged, snapped or left out; one sentence each.
    """

    name: str
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    gravity: tuple[Formula, Formula, Formula] = (Number(0.0), Number(0.0), Number(-9.81))
    description: str = ""
    parameters: tuple[Parameter, ...] = ()
    curves: tuple[AnyCurve, ...] = ()
    inputs: tuple[Input, ...] = ()
    states: tuple[State, ...] = ()
    controllers: tuple[Controller, ...] = ()
    feedback: tuple[StateFeedback, ...] = ()
    base: Base | None = None
    points: tuple[Point, ...] = ()
    springs: tuple[Spring, ...] = ()
    torsion_springs: tuple[TorsionSpring, ...] = ()
    bushings: tuple[Bushing, ...] = ()
    tyres: tuple[Tyre, ...] = ()
    forces: tuple[Force, ...] = ()
    efforts: tuple[Effort, ...] = ()
    outputs: tuple[Output, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    coordinates: Literal["joint", "absolute"] = "joint"
    groups: Mapping[str, str] = field(default_factory=dict)
    simulation: Simulation = Simulation()
    terms: tuple[str, ...] = ()
    source: Mapping[str, str] = field(default_factory=dict)
    content: bytes = b""
    notes: tuple[str, ...] = ()
    metadata: Mapping[str, Any] = field(default_factory=dict)
