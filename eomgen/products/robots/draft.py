"""Draft of a file of robots: models with links, joints, frames and models within them, as all readers give them.

Names are the names of the file; poses are as written, in the named frames. ``conversion`` makes a scene of a
draft.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.products.robots.leftovers import ElementPlace, Leftovers
from eomgen.scene.inertia import Inertia
from eomgen.scene.joint_types import JOINTS

#: Name of the frame of a model within it, and of the frame at rest.
MODEL_FRAME, WORLD_FRAME = "__model__", "world"


@dataclass(frozen=True)
class WrittenPose:
    """A pose in the frame that it names; without a name in the frame that the format has as default."""

    place: ElementPlace
    orientation: Array = field(default_factory=lambda: np.eye(3))
    position: Array = field(default_factory=lambda: np.zeros(3))
    relative_to: str = ""


@dataclass(frozen=True)
class Visual:
    """A visible solid or mesh of a link, with a pose; ``entry`` has the keys of an entry of ``[shapes]``: type, sizes,
    colour. A pose without the name of a frame is in the frame of the link."""

    pose: WrittenPose
    entry: Mapping[str, Any]


@dataclass(frozen=True)
class DraftLink:
    """A link: mass properties in its frame, visuals, and whether gravity pulls the link. A ``kept`` link is a body of
    its own even on a fixed joint."""

    name: str
    place: ElementPlace
    inertia: Inertia
    pose: WrittenPose
    pulled: bool = True
    visuals: Sequence[Visual] = ()
    kept: bool = False


@dataclass(frozen=True)
class DraftFrame:
    """A frame, attached to the model if it names no other."""

    name: str
    place: ElementPlace
    pose: WrittenPose
    attached_to: str


@dataclass(frozen=True)
class DraftMimic:
    """Leader of an axis: q = multiplier (q_leader - reference) + offset."""

    place: ElementPlace
    joint: str
    multiplier: float
    offset: float
    axis: str = "axis"
    reference: float = 0.0


@dataclass(frozen=True)
class Axis:
    """An axis of a joint with the dynamics of the coordinate, in SI units; infinite limits and efforts are none.

    Attributes
    ----------
    vector : direction, in the frame ``expressed_in``; an empty name is the joint's frame
    damping, friction, stiffness, rest : damper, dry friction, spring, and coordinate of the spring at rest
    lower, upper, effort : limits
    limited : the quantities with a limit in the file, in words
    stop : stiffness and damping of the stops; None without
    mimic : None for an axis that follows no other
    """

    place: ElementPlace
    vector: tuple[float, ...]
    expressed_in: str = ""
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    lower: float = -np.inf
    upper: float = np.inf
    effort: float = np.inf
    limited: tuple[str, ...] = ()
    stop: tuple[float, float] | None = None
    mimic: DraftMimic | None = None


@dataclass(frozen=True)
class Gear:
    """Gearbox: theta_2 = - ratio theta_1, of the angles of the parent (1) and the child (2) against the body
    ``reference``."""

    ratio: float
    reference: str


@dataclass(frozen=True)
class DraftJoint:
    """A joint of a file, with the types in a scene and in the file.

    Attributes
    ----------
    type, written : type in a scene, empty for a type that is not known; type in the file
    parent, child : names of the frames that the joint connects
    pose : of the joint's frame, by default in the frame of the child
    pitch : of a screw, m/rad
    gear : of a gearbox
    cut : whether the file says that the joint closes a loop
    around : of a joint without axes, as a ball joint: an axis whose dynamics hold in all directions
    reference : coordinate in the configuration of the file
    entry : further keys in a scene: start, drive and rotor inertia
    """

    name: str
    place: ElementPlace
    pose: WrittenPose
    type: str
    written: str
    parent: str
    child: str
    axes: tuple[Axis, ...] = ()
    pitch: float = 0.0
    gear: Gear | None = None
    cut: bool = False
    around: Axis | None = None
    reference: float = 0.0
    entry: Mapping[str, Any] = field(default_factory=dict)

    @property
    def components(self) -> int:
        """Number of velocity components; one if the type is not known."""
        return JOINTS[self.type].v_size if self.type else 1

    @property
    def unit(self) -> str:
        """Unit of the coordinate, rad or m; empty unless there is exactly one coordinate."""
        return JOINTS[self.type].units[0] if self.type and self.components == 1 else ""


@dataclass(frozen=True)
class DraftLoop:
    """A joint that closes a loop, given by a frame in each of two links, which meet. `links` are two keys of links,
    `poses` the pose of the frame in each: z is the axis of the joint; of a universal joint x is the first and y the
    second axis."""

    name: str
    place: ElementPlace
    type: str
    links: tuple[str, ...]
    poses: tuple[WrittenPose, ...]


@dataclass
class DraftModel:
    """A model, or the world of a file; keys of links, joints, frames and models are unique among all of them.

    Attributes
    ----------
    pose : in the model around, by default in the frame of that model
    static : whether all links rest
    canonical : name of the link to which the model's frame is attached; empty for the first link
    placement : name of the frame within the model that ``pose`` places; empty for the model's own frame
    merged : names that models merged into this one have, with the keys of these models in ``models``
    """

    name: str
    place: ElementPlace
    pose: WrittenPose
    static: bool = False
    canonical: str = ""
    placement: str = ""
    links: dict[str, DraftLink] = field(default_factory=dict)
    joints: dict[str, DraftJoint] = field(default_factory=dict)
    frames: dict[str, DraftFrame] = field(default_factory=dict)
    models: dict[str, DraftModel] = field(default_factory=dict)
    merged: dict[str, str] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Keys of all that the model holds."""
        return [*self.links, *self.joints, *self.frames, *self.models, *self.merged]

    def has(self, name: str) -> bool:
        """Return whether the model holds something of a name."""
        return any(name in part for part in (self.links, self.joints, self.frames, self.models, self.merged))

    def every(self, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], DraftModel]]:
        """Yield the path (keys of models from the outermost) and the model, for this model and all models within."""
        yield path, self
        for name, model in self.models.items():
            yield from model.every((*path, name))


@dataclass
class Draft:
    """The content of a file.

    Attributes
    ----------
    name : of the scene
    world : holds all links and models
    gravity : None if the file gives none
    leftovers : parts that are not read
    undrawn : links by a note on their visuals and the reason
    notes : on the file
    loops : joints between links that close loops in any case
    root : ``free`` or ``fixed`` for the joint of a root link that stays a body; empty for links that move freely
    root_joint : name of this joint
    legal : whether names are legal and unique unchanged
    tunable : links whose mass properties are parameters
    """

    name: str
    world: DraftModel
    leftovers: Leftovers
    gravity: Sequence[float] | None = None
    undrawn: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    loops: Sequence[DraftLoop] = ()
    root: str = ""
    root_joint: str = ""
    legal: bool = False
    tunable: Collection[str] = ()
