"""The Scene: a validated description in SI units, the input of mechanics; with a digest for caches and the display in
notebooks.

All vectors are tuples of formulas; a plain number is a ``Number``. Comments at fields give the symbols that formulas
may have. Frames: the *world* is inertial; the *base* is the frame that carries the tree and moves as prescribed (it is
the world when ``Scene.base`` is None). A body's frame coincides with its joint's frame at q = 0.
"""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterator, Mapping
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, TypeVar, cast

import numpy as np

from eomgen.base.calls import checked_calls, not_assigned_to, unknown_attribute
from eomgen.base.data import dataclass, field, field_names, is_dataclass
from eomgen.base.extensions import code_stamp
from eomgen.base.html import page, paragraph, table
from eomgen.formula.curves import AnyCurve
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import ZERO_VECTOR, Number, Vector, infix
from eomgen.scene.bodies.model import Base, Body
from eomgen.scene.control.model import Controller, Reference, StateFeedback
from eomgen.scene.design_poses import DesignPlace, DesignPoses, FramePlacement, UnknownPoseError
from eomgen.scene.events.model import Event
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.joints.model import Constraint, Joint, LightJoint, Reaction
from eomgen.system.description import FixedFrame, Point, Requirement, Shape, Simulation
from eomgen.system.motions import Motion
from eomgen.system.signals import Input, Output, Parameter, SampledController, State

if TYPE_CHECKING:
    from eomgen.scene.forces.bushings import Bushing
    from eomgen.scene.forces.forces import Effort, Force
    from eomgen.scene.forces.springs import Spring, TorsionSpring
    from eomgen.scene.forces.tendons import Tendon


def digest_of(data: Mapping[str, Any]) -> bytes:
    """Return SHA-256 of named data of a Scene, to the last bit of each number.

    Raises
    ------
    TypeError
        For a value of a class that no Scene contains: unread parts of the value could differ between two scenes.
    """
    parts: list[bytes] = []
    _add(data, parts, {})
    return hashlib.sha256(b"\0".join(parts)).digest()


#: Bytes of fields by the identity of the values; the values are kept alive, so that identities stay unique.
Known = dict[int, tuple[Any, bytes]]


def _add(value: Any, parts: list[bytes], known: Known) -> None:
    """Append bytes to ``parts`` that differ for any two different values of the classes in a Scene. ``known`` caches
    the bytes of fields by the identity of the value. Raises TypeError for a value of another class."""
    kind = type(value)
    if kind is float or kind is str or kind is int:  # most values
        parts.append(f"{kind.__name__}:{value!r}".encode())
    elif kind is tuple or kind is list:
        parts.append(f"of {len(value)}".encode())
        for item in value:
            _add(item, parts, known)
    elif names := _field_names(cast("Hashable", kind)):
        parts.append(kind.__qualname__.encode())
        for name in names:
            _add_field(getattr(value, name), parts, known)
    elif value is None or isinstance(value, bool | int | float | complex | str | bytes) or kind.__name__ == "Fraction":
        parts.append(f"{kind.__name__}:{value!r}".encode())
    elif isinstance(value, np.ndarray):
        parts.append(f"array:{value.dtype.str}{value.shape}".encode())
        parts.append(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        _add(list(value.items()), parts, known)
    elif isinstance(value, tuple | list):
        _add(list(value), parts, known)
    elif callable(value) and hasattr(value, "__qualname__"):  # rules of requirements, values of words of formulas
        parts.append(f"{value.__module__}.{value.__qualname__}{code_stamp(value)}".encode())
    else:
        raise TypeError(f"a {kind.__qualname__} in a scene has no digest")


def _add_field(value: Any, parts: list[bytes], known: Known) -> None:
    """Append the bytes of a field's value to ``parts``; bytes of tuples and data classes are cached in ``known``,
    because equal parts of a scene share most fields."""
    kind = type(value)
    if kind is not tuple and not _field_names(cast("Hashable", kind)):
        _add(value, parts, known)
        return
    if id(value) not in known:
        pieces: list[bytes] = []
        _add(value, pieces, known)
        known[id(value)] = (value, b"\0".join(pieces))
    parts.append(known[id(value)][1])


@cache
def _field_names(kind: Hashable) -> tuple[str, ...]:
    """Return the names of the fields in a data class; none for another class."""
    return field_names(kind) if is_dataclass(kind) else ()


#: Parts of a scene in the order of the summary, with singular and plural nouns.
_PARTS = (
    ("bodies", "body", "bodies"), ("joints", "joint", "joints"), ("constraints", "constraint", "constraints"),
    ("elements", "force element", "force elements"), ("controllers", "controller", "controllers"),
    ("inputs", "input", "inputs"), ("motions", "motion", "motions"), ("states", "internal state", "internal states"),
    ("events", "event", "events"),
    ("parameters", "parameter", "parameters"), ("outputs", "output", "outputs"),
)  # fmt: skip  # a table


def html(scene: Scene) -> str:
    """Return the scene as HTML with tables of bodies with their joints, constraints, force elements, signals and
    parameters, for the display in notebooks."""
    bodies = (
        (body.name, infix(body.mass), ", ".join(map(infix, body.center_of_mass)), joint.name, joint.type, joint.parent)
        for body, joint in zip(scene.bodies, scene.joints, strict=True)
    )
    constraints = (
        (
            item.name,
            item.type,
            *([frame.body for frame in item.frames] or ("", "")),
            item.text,
            infix(item.drive) if item.drive else "",
        )
        for item in scene.constraints
    )
    kinds = {"input": scene.inputs, "motion": scene.motions, "internal state": scene.states, "output": scene.outputs}
    every: Iterator[tuple[str, Any]] = ((kind, item) for kind, items in kinds.items() for item in items)
    signals = ((item.name, kind, item.unit, item.description) for kind, item in every)
    parameters = (
        (item.name, f"{item.value:.9g}", item.unit, "tunable" if item.tunable else "", item.description)
        for item in scene.parameters
    )
    return page(
        f"Scene {scene.name}",
        paragraph(scene.description),
        table(("body", "mass, kg", "centre of mass, m", "joint", "type", "parent"), bodies),
        table(("constraint", "type", "first", "second", "equation", "driven as"), constraints),
        table(("force element",), ((element.label,) for element in scene.elements)),
        table(("signal", "kind", "unit", "meaning"), signals),
        table(("parameter", "value", "unit", "", "meaning"), parameters),
    )


#: Default, in world axes, m/s^2.
GRAVITY = (0.0, 0.0, -9.81)
#: Fields that no equation follows from.
_SAID = frozenset({"source", "light", "notes", "metadata", "description", "shapes"})

Element = TypeVar("Element", bound=ForceElement)


class _Kind(Generic[Element]):
    """Descriptor that gives a Scene's force elements of one section as a tuple; the attribute's name is the section's
    key."""

    def __set_name__(self, owner: type[Scene], section: str) -> None:
        self.section = section

    def __get__(self, scene: Scene, owner: type[Scene]) -> tuple[Element, ...]:
        # of that kind
        return tuple(element for element in scene.elements if element.section == self.section)  # type: ignore[misc]


@not_assigned_to("{0} in the scene file or of the SceneBuilder, or a tunable parameter that it names")
@checked_calls('eomgen.load("scene.toml"), or eomgen.SceneBuilder("pendulum")...build()')
@dataclass(frozen=True)
class Scene:
    """A checked scene. Bodies and joints are in an order with every parent before the children.

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
    motions : the inputs that are motions, which are not inputs of the equations, but polynomials of time with tunable
        parameters as coefficients
    parts : by section of a product, the objects of the entries
    modes : numbers that only events change, with values in the tunable parameters ``mode_...``
    events : roots of formulas that stop a run, are counted, or change the state, in order
    shapes : solids and meshes of pictures, which are not part of the digest
    light : joints that move no inertia, so that constraints have to determine their motion
    coordinates : ``joint``, or ``absolute``: every body is free and joints are constraints.
    groups : by body, ``SE3`` or ``R3xSO3``; for absolute coordinates, unused in joint coordinates. With ``SE3``, the
        default, a lower-pair joint to ground or to slow bodies holds exactly along a step. ``R3xSO3`` is for
        bodies that spin fast and freely.
    points : including the origins of frames, under the frames' names.
    frames : frames of bodies by name.
    task_frames : the bodies and frames that the terms of frames give; empty means all.
    requirements : rules for values that depend on tunable parameters; checked when these are given.
    terms : the terms requested by the scene; empty means all terms that may be needed.
    source : mapping from a dotted key (``bodies.arm.mass``) to ``file:line`` for messages.
    content : not empty in a scene that was read and checked.
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
    elements: tuple[ForceElement, ...] = field(default_factory=tuple)  # no attribute of the class, see __getattr__
    outputs: tuple[Output, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    reactions: tuple[Reaction, ...] = ()
    references: tuple[Reference, ...] = ()
    modes: tuple[str, ...] = ()
    events: tuple[Event, ...] = ()
    shapes: tuple[Shape, ...] = ()
    light: tuple[LightJoint, ...] = ()
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
    tendons: ClassVar[_Kind[Tendon]] = _Kind()
    bushings: ClassVar[_Kind[Bushing]] = _Kind()
    tyres: ClassVar[_Kind[ForceElement]] = _Kind()
    forces: ClassVar[_Kind[Force]] = _Kind()
    efforts: ClassVar[_Kind[Effort]] = _Kind()

    @cached_property
    def digest(self) -> bytes:
        """Key of a scene in caches, of all fields that equations follow from.

        Empty if the content is empty: such a scene is unchecked.
        """
        data = {name: getattr(self, name) for name in field_names(cast("Hashable", type(self))) if name not in _SAID}
        return digest_of(data) if self.content else b""

    @property
    def leading_joints(self) -> tuple[Joint, ...]:
        """The joints with independent coordinates: joints that move and follow no other joint."""
        return tuple(joint for joint in self.joints if joint.mimic is None and joint.kind.moves)

    def frames_of_terms(self) -> tuple[FixedFrame, ...]:
        """Return the frames that terms of frames give, in order: the task frames, else all bodies and then all frames.

        Returns
        -------
        tuple of FixedFrame
            In the order of the arrays of these terms. A body is a frame of its name, at its origin and with its axes.
        """
        every = {body.name: FixedFrame(body.name, body.name, ZERO_VECTOR) for body in self.bodies}
        every |= {frame.name: frame for frame in self.frames}
        return tuple(every[name] for name in self.task_frames or every)

    def design_places(self) -> list[DesignPlace]:
        """Return the places of joints, points, frames and frames of constraints with every joint at zero, at the
        default parameters.

        Places on geometrically exact beams, and on bodies carried by such beams, are left out, because they follow from
        the shape of the beam.

        Returns
        -------
        list of DesignPlace
            Name (``joints.hinge``), body, and position of each place in its body, of a joint in the parent, and in the
            frame of the base, m.
        """
        placements = {
            joint.child: FramePlacement(joint.parent, joint.position, joint.orientation) for joint in self.joints
        }
        poses = DesignPoses(placements, {body.name for body in self.bodies if body.node_of})
        values = {parameter.name: parameter.value for parameter in self.parameters}
        result = []
        for name, body, position in self._places():
            try:
                vectors = position, poses.in_base(body, position)
            except UnknownPoseError:
                continue
            local, world = (tuple(evaluate(item, lambda symbol: values[symbol.name]) for item in v) for v in vectors)
            result.append(DesignPlace(name, body, local, world))
        return result

    def _places(self) -> Iterator[tuple[str, str, Vector]]:
        """Yield dotted name (``joints.hinge``, ``constraints.pin.first``), body and position on this body, m, of each
        joint, point, frame and frame of a constraint; the body of a joint is the parent."""
        for joint in self.joints:
            yield f"joints.{joint.name}", joint.parent, joint.position
        frames = {frame.name for frame in self.frames}
        for point in self.points:
            yield f"{'frames' if point.name in frames else 'points'}.{point.name}", point.body, point.position
        for constraint in self.constraints:
            for side, frame in zip(("first", "second"), constraint.frames, strict=False):
                yield f"constraints.{constraint.name}.{side}", frame.body, frame.position

    def __repr__(self) -> str:
        counts = ((len(getattr(self, part)), noun, several) for part, noun, several in _PARTS)
        parts = (f"{count} {noun if count == 1 else several}" for count, noun, several in counts if count)
        return f"<Scene {self.name}: {', '.join(parts)}>"

    def _repr_html_(self) -> str:
        return html(self)

    if not TYPE_CHECKING:  # type checkers know the attributes

        def __getattr__(self, name: str) -> object:
            """Return the force elements of a scene that was read before, which are made on the first request."""
            if name == "elements" and "_elements" in vars(self):
                vars(self)[name] = vars(self)["_elements"]()
                return vars(self)[name]
            raise unknown_attribute(self, name)
