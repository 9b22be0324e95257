"""The Scene: what the user described, checked and in SI units, ready for mechanics.

All vectors are tuples of formulas; a plain number is a ``Number``. Where a field may hold a formula, its comment says of what.
Frames: the *world* is inertial; the *base* is the frame that carries the tree and moves as prescribed (it is the world when
``Scene.base`` is None). A body's frame coincides with its joint's frame at q = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from eomgen.calls import checked_calls, unknown_attribute
from eomgen.scene.bodies.beam import Beam
from eomgen.scene.control.model import StateFeedback
from eomgen.scene.forces.elements import Bushing, Tyre
from eomgen.scene.forces.model import Effort, Force, Spring, TorsionSpring
from eomgen.scene.formula.nodes import ZERO_VECTOR, Formula, Number, Symbol, Vector
from eomgen.scene.formula.piecewise import AnyCurve
from eomgen.scene.joints.constraint_model import Constraint
from eomgen.scene.joints.model import SIZES, Joint
from eomgen.scene.reading.requirements import Requirement

BASE = "base"
WORLD = "world"


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
class Point:
    """A point fixed in a body (or in the base, or in the world), coordinates in that frame, formulas of parameters."""

    name: str
    body: str
    position: Vector


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


@checked_calls('eomgen.load("scene.toml"), or eomgen.SceneBuilder("pendulum")...build()')
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
    requirements : what its values must be that tunable parameters decide; checked where these are given.
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
    requirements: tuple[Requirement, ...] = field(default=(), repr=False, compare=False)
    source: Mapping[str, str] = field(default_factory=dict)
    content: bytes = b""
    notes: tuple[str, ...] = ()
    metadata: Mapping[str, Any] = field(default_factory=dict)

    @property
    def leading_joints(self) -> tuple[Joint, ...]:
        """The joints that move and follow no other: those with coordinates of their own."""
        return tuple(joint for joint in self.joints if joint.mimic is None and SIZES[joint.type][1])

    if not TYPE_CHECKING:  # a checker knows the attributes by itself

        def __getattr__(self, name: str) -> object:
            raise unknown_attribute(self, name)
