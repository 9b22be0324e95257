"""The content of an SDF file as data: models with links, joints, frames and models within them.

The format is the Simulation Description Format, http://sdformat.org/spec, versions 1.7 to 1.12. Names are as in the
file; poses are as written, in the frames that they name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.products.robots.draft import Place
from eomgen.scene.inertia import Inertia

#: Name of the frame of a model within it, and of the frame at rest.
MODEL_FRAME, WORLD_FRAME = "__model__", "world"


@dataclass(frozen=True)
class WrittenPose:
    """A pose in the frame that it names; without a name in the frame that the format has as default."""

    place: Place
    orientation: Array = field(default_factory=lambda: np.eye(3))
    position: Array = field(default_factory=lambda: np.zeros(3))
    relative_to: str = ""


@dataclass(frozen=True)
class SdfVisual:
    """A solid or a mesh, by default in the frame of its link; ``entry`` has type, sizes and colour of ``[shapes]``."""

    pose: WrittenPose
    entry: Mapping[str, Any]


@dataclass(frozen=True)
class SdfLink:
    """A link: mass properties in its frame, visuals, and whether gravity pulls it."""

    name: str
    place: Place
    pose: WrittenPose
    inertia: Inertia
    pulled: bool = True
    visuals: Sequence[SdfVisual] = ()


@dataclass(frozen=True)
class SdfFrame:
    """A frame, attached to the model if it names no other."""

    name: str
    place: Place
    pose: WrittenPose
    attached_to: str


@dataclass(frozen=True)
class SdfMimic:
    """Leader of an axis: q = multiplier (q_leader - reference) + offset."""

    place: Place
    joint: str
    axis: str
    multiplier: float
    offset: float
    reference: float


@dataclass(frozen=True)
class SdfAxis:
    """An axis with the dynamics of its coordinate; ``stop`` has stiffness and damping of the stops, None without.

    Limits that are infinite are none.
    """

    place: Place
    vector: tuple[float, ...]
    expressed_in: str = ""
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    lower: float = -np.inf
    upper: float = np.inf
    effort: float = np.inf
    speed: float = np.inf
    stop: tuple[float, float] | None = None
    mimic: SdfMimic | None = None

    @property
    def limited(self) -> tuple[str, ...]:
        """Quantities with a limit, in words."""
        limits = {
            "position": min(-self.lower, self.upper),
            "velocity": self.speed,
            "effort": self.effort,
        }
        return tuple(quantity for quantity, limit in limits.items() if np.isfinite(limit))


@dataclass(frozen=True)
class Gear:
    """theta_2 = - ratio theta_1, of angles of the child and of the parent against a body."""

    ratio: float
    reference: str


@dataclass(frozen=True)
class SdfJoint:
    """A joint; ``pitch`` in m/rad, of a screw; ``cut`` if the file says that the joint closes a loop; ``around`` of a
    ball joint, which has no axes: an axis whose dynamics hold in all directions, as in Drake."""

    name: str
    place: Place
    pose: WrittenPose
    type: str
    parent: str
    child: str
    axes: tuple[SdfAxis, ...] = ()
    pitch: float = 0.0
    gear: Gear | None = None
    cut: bool = False
    around: SdfAxis | None = None


@dataclass
class SdfModel:
    """A model, or the world of a file; names of links, joints, frames and models are unique among all of them.

    Attributes
    ----------
    merged : names that models merged into this one give it, with the keys of these models
    """

    name: str
    place: Place
    pose: WrittenPose
    static: bool = False
    canonical: str = ""
    placement: str = ""
    links: dict[str, SdfLink] = field(default_factory=dict)
    joints: dict[str, SdfJoint] = field(default_factory=dict)
    frames: dict[str, SdfFrame] = field(default_factory=dict)
    models: dict[str, SdfModel] = field(default_factory=dict)
    merged: dict[str, str] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of all that the model holds."""
        return [*self.links, *self.joints, *self.frames, *self.models, *self.merged]

    def has(self, name: str) -> bool:
        """Return whether the model holds something of a name."""
        return any(name in part for part in (self.links, self.joints, self.frames, self.models, self.merged))

    def every(self, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], SdfModel]]:
        """Yield the model and the models within it with their paths, from this one."""
        yield path, self
        for name, model in self.models.items():
            yield from model.every((*path, name))
