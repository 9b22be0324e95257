"""The Scene: a validated description in SI units, the input of mechanics.

All vectors are tuples of formulas; a plain number is a ``Number``. Comments at fields give the symbols that formulas
may have. Frames: the *world* is inertial; the *base* is the frame that carries the tree and moves as prescribed (it is
the world when ``Scene.base`` is None). A body's frame coincides with its joint's frame at q = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, TypeVar

from eomgen.base.calls import checked_calls, not_assigned_to, unknown_attribute
from eomgen.formula.curves import AnyCurve
from eomgen.formula.nodes import ZERO_VECTOR, Number, Vector
from eomgen.scene.bodies.model import Base, Body
from eomgen.scene.control.model import Controller, Reference, StateFeedback
from eomgen.scene.digest import digest_of
from eomgen.scene.display import html, line
from eomgen.scene.events.model import Event
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.joints.constraint_model import Constraint
from eomgen.scene.joints.model import Joint
from eomgen.scene.joints.reaction_model import Reaction
from eomgen.system.description import FixedFrame, Point, Requirement, Simulation
from eomgen.system.motions import Motion
from eomgen.system.samples import SampledController
from eomgen.system.signals import Input, Output, Parameter, State

if TYPE_CHECKING:  # a Scene needs no reader of files
    from eomgen.scene.forces.bushings import Bushing
    from eomgen.scene.forces.efforts import Effort
    from eomgen.scene.forces.forces import Force
    from eomgen.scene.forces.springs import Spring
    from eomgen.scene.forces.torsion_springs import TorsionSpring
    from eomgen.scene.forces.tyres import Tyre

#: Default, in world axes, m/s^2.
GRAVITY = (0.0, 0.0, -9.81)
#: Fields that no equation follows from.
_SAID = frozenset({"source", "notes", "metadata", "description"})

Element = TypeVar("Element", bound=ForceElement)


class _Kind(Generic[Element]):
    """The force elements of one section, as an attribute of a Scene by the section's name."""

    def __set_name__(self, owner: type[Scene], section: str) -> None:
        self.section = section

    def __get__(self, scene: Scene, owner: type[Scene]) -> tuple[Element, ...]:
        # of that kind
        return tuple(element for element in scene.elements if element.section == self.section)  # type: ignore[misc]


@not_assigned_to("{0} in the scene file or of the SceneBuilder, or a tunable parameter that it names")
@checked_calls('eomgen.load("scene.toml"), or eomgen.SceneBuilder("pendulum")...build()')
@dataclass(frozen=True)
class Scene:
    """A checked scene. Bodies and joints are in an order in which every parent comes before its children.

    Attributes
    ----------
    bodies, joints : tuples of equal length; ``joints[i]`` carries ``bodies[i]``.
    elements : the force elements; by kind in ``springs``, ``bushings``, ...
    curves : the curves that formulas can name, and the curves in inputs.
    feedback : the state feedbacks among the controllers, whose gains a calibration may fill.
    sampled : controllers whose functions are called at samples
    constraints : loop closures, in addition to the joints of the tree.
    reactions : points and axes of reactions that differ from the default of every joint and constraint.
    references : motions that formulas ask inverse dynamics about.
    motions : the inputs that are motions, which are no inputs of the equations; they are polynomials of time whose
        coefficients are tunable parameters
    parts : by section of a product, the objects of its entries
    modes : numbers that only events change; their values are the tunable parameters ``mode_...``
    events : roots of formulas that stop a run, are counted, or change the state, in their order
    coordinates : ``joint``, or ``absolute``: every body moves on its own and joints are constraints.
    groups : by body, ``SE3`` or ``R3xSO3``; for absolute coordinates, unused in joint coordinates. With ``SE3``, the
        default, a lower-pair joint to ground or to slow bodies holds exactly along a step. ``R3xSO3`` is for
        bodies that spin fast and freely.
    points : the origins of frames among them, under the frames' names.
    frames : frames of bodies by name.
    task_frames : the bodies and frames that the terms of frames give; empty means all.
    requirements : rules for values that depend on tunable parameters; checked when these are given.
    terms : the terms the scene asks for; empty means all that its users may need.
    source : mapping from a dotted key (``bodies.arm.mass``) to ``file:line`` for messages.
    content : bytes that determine the scene as it was described (canonical JSON of its data).
    notes : on elements that an importer converted, merged, snapped or left out; one sentence each.
    """

    name: str
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    gravity: Vector = (Number(GRAVITY[0]), Number(GRAVITY[1]), Number(GRAVITY[2]))
    description: str = ""
    parameters: tuple[Parameter, ...] = ()
    curves: tuple[AnyCurve, ...] = ()
    inputs: tuple[Input, ...] = ()
    motions: tuple[Motion, ...] = ()
    parts: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    states: tuple[State, ...] = ()
    controllers: tuple[Controller, ...] = ()
    feedback: tuple[StateFeedback, ...] = ()
    sampled: tuple[SampledController, ...] = ()
    base: Base | None = None
    points: tuple[Point, ...] = ()
    frames: tuple[FixedFrame, ...] = ()
    task_frames: tuple[str, ...] = ()
    elements: tuple[ForceElement, ...] = ()
    outputs: tuple[Output, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    reactions: tuple[Reaction, ...] = ()
    references: tuple[Reference, ...] = ()
    modes: tuple[str, ...] = ()
    events: tuple[Event, ...] = ()
    coordinates: Literal["joint", "absolute"] = "joint"
    groups: Mapping[str, str] = field(default_factory=dict)
    simulation: Simulation = field(default_factory=Simulation)
    terms: tuple[str, ...] = ()
    requirements: tuple[Requirement, ...] = field(default=(), repr=False, compare=False)
    source: Mapping[str, str] = field(default_factory=dict)
    content: bytes = b""
    notes: tuple[str, ...] = ()
    metadata: Mapping[str, Any] = field(default_factory=dict)

    springs: ClassVar[_Kind[Spring]] = _Kind()
    torsion_springs: ClassVar[_Kind[TorsionSpring]] = _Kind()
    bushings: ClassVar[_Kind[Bushing]] = _Kind()
    tyres: ClassVar[_Kind[Tyre]] = _Kind()
    forces: ClassVar[_Kind[Force]] = _Kind()
    efforts: ClassVar[_Kind[Effort]] = _Kind()

    @cached_property
    def digest(self) -> bytes:
        """Key of a scene in caches, of its content and its data, so that ``dataclasses.replace`` makes another.

        Empty if the content is empty: such a scene is unchecked.
        """
        data = {item.name: getattr(self, item.name) for item in fields(self) if item.name not in _SAID}
        return digest_of(data) if self.content else b""

    @property
    def leading_joints(self) -> tuple[Joint, ...]:
        """The joints with coordinates of their own: they move and follow no other joint."""
        return tuple(joint for joint in self.joints if joint.mimic is None and joint.kind.moves)

    def frames_of_terms(self) -> tuple[FixedFrame, ...]:
        """The frames that terms of frames give, in their order: the task frames, else all bodies and all frames."""
        every = {body.name: FixedFrame(body.name, body.name, ZERO_VECTOR) for body in self.bodies}
        every |= {frame.name: frame for frame in self.frames}
        return tuple(every[name] for name in self.task_frames or every)

    def __repr__(self) -> str:
        return line(self)

    def _repr_html_(self) -> str:
        return html(self)

    if not TYPE_CHECKING:  # a checker knows the attributes by itself

        def __getattr__(self, name: str) -> object:
            raise unknown_attribute(self, name)
