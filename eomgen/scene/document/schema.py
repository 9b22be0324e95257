"""The shape of a scene file, as pydantic models: which keys exist, what kind of value each takes and what it means.

What needs more than one key to judge is in ``checks``; the tables of ``docs/scene.md`` are made from here by
``reference``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import GenericAlias
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, create_model

from eomgen.scene.bodies.beam_schema import Beam
from eomgen.scene.bodies.schema import Base, Body, BodyFrame, Point
from eomgen.scene.control.references import ReferenceEntry
from eomgen.scene.control.schema import Controller
from eomgen.scene.events.schema import Event, Mode
from eomgen.scene.forces.register import ELEMENTS
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joints.schema import Constraint, Joint, Reaction
from eomgen.scene.random.schema import RandomProcess
from eomgen.scene.reading.key_metadata import Table, key, optional, shown_power
from eomgen.scene.reading.kinds import Description, Finite, Triple, Value
from eomgen.scene.reading.rotation_schema import Rotations
from eomgen.scene.scene import GRAVITY
from eomgen.scene.signals.schema import Curve, Input, Output, Parameter, State
from eomgen.scene.sources.register import BUILT_IN, all_options
from eomgen.scene.sources.source import Option, Source
from eomgen.scene.waves.schema import SeaWaves
from eomgen.system.description import Simulation as Defaults
from eomgen.system.terms import TERMS


def _key_of(source: Source, option: Option) -> tuple[Any, Any]:
    """Return the type of an option of a source as a key of an include, and the key."""
    description = f"{source.name}: {option.of_key or option.description}"
    if isinstance(option.default, tuple):
        names = Annotated[tuple[str, ...], Field(strict=False)]
        return names, key(description, option.default, kind="list of names")
    return Literal[option.choices] if option.choices else type(option.default), key(description, option.default)


class Include(Table):
    """Another scene file, or a URDF, as a part of this scene."""

    file: Annotated[str, Field(min_length=1, max_length=1000)] = key(
        "path, from the folder of this file", kind="text", path=True
    )
    prefix: Annotated[str, Field(max_length=64)] | None = optional(
        "goes before every name of the file", kind="text", shown_default="the entry's name and `_`"
    )
    parent: str = key("what the file's base is in this scene", "base", refers="bodies", kind="body, or `base`")
    position: Triple = key("of the file's base in the parent's frame", (0.0, 0.0, 0.0), unit="m", names=PARAMETERS)
    rotation: Rotations | None = optional(
        "axes of the file's base in the parent, angles of fixed parameters", shown_default="`[]`"
    )
    parameters: dict[str, Value] = key(
        "in place of the file's own: numbers, numbers with a unit, or formulas of parameters of this scene",
        {},
        kind="values by name",
        shown_default="`{}`",
    )
    for source, option in all_options().values():
        __annotations__[option.name], locals()[option.name] = _key_of(source, option)
    del source, option


class Repeat(Table):
    """Entries of sections that are made once for each number of the indices; the keys beside ``indices`` are sections
    of the scene."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True)

    indices: dict[str, Any] = key(
        "numbers that each index takes: `{ i = 10 }` for 0 to 9, `{ i = [1, 9] }` for 1 to 9; the last one counts"
        " fastest",
        kind="whole numbers, or pairs of them, by name",
    )
    where: str = key(
        "of all combinations of indices those that are taken, as `i < j` for pairs",
        "",
        kind="formula of indices",
        shown_default="all",
    )


def include_of(source: Source | None) -> type[Include]:
    """Return the table of an include of a source's files, which may be another distribution's."""
    if source is None or source in BUILT_IN:
        return Include
    added: dict[str, Any] = {option.name: _key_of(source, option) for option in source.options}
    return create_model("Include", __base__=Include, **added)


SECTIONS = (
    "parameters",
    "curves",
    "inputs",
    "random",
    "waves",
    "states",
    "controllers",
    "bodies",
    "beams",
    "joints",
    "constraints",
    "reactions",
    "points",
    "frames",
    *(row.section for row in ELEMENTS),
    "references",
    "outputs",
    "modes",
    "events",
)


class Simulation(Table):
    """The defaults of ``simulate``."""

    method: str = key("see below", Defaults.method, kind="name")
    step: Finite = key("fixed step", Defaults.step, unit="s", shown_default=f"`{shown_power(Defaults.step)}`")
    duration: Finite = key("of the run", Defaults.duration, unit="s")
    rho_inf: Finite = key(
        "numerical damping of generalized-alpha at high frequencies; 1 has none", Defaults.rho_inf, kind="0 to 1"
    )
    alpha: Finite | None = optional("the same for `hht`, `wbz` and `newmark`, in place of `rho_inf`", kind="0 to 1")
    beta: Finite | None = optional("of `newmark`", kind="number", shown_default="0.25")
    gamma: Finite | None = optional("of `newmark`", kind="number", shown_default="0.5")
    tolerance: Finite | None = optional(
        "of local errors: generalized-alpha chooses its steps by it, as `rk45` and `taylor` do; with `taylor` 0: fixed"
        " steps",
        kind="0 to 0.1",
        shown_default="the method's",
    )
    order: Annotated[int, Field(ge=2, le=40)] | None = optional(
        "of `taylor`", kind="whole number, 2 to 40", shown_default="what suits the tolerance"
    )
    settings: dict[str, Finite] = key(
        "of the method's iteration, as of `simulate`: `rtol`, `atol`, `max_iterations`, `max_halvings`, `reuse`; of"
        " methods that choose their steps `largest_step`, s; other methods keep theirs",
        {},
        kind="numbers by name",
        shown_default="`{}`",
    )
    real: Literal["double", "float"] = key(
        "numbers of the compiled code, where `eomgen.build` is not told", Defaults.real
    )
    record_every: Annotated[int, Field(ge=1, le=1_000_000_000)] = key(
        "steps between recorded rows", Defaults.record_every, kind="whole number from 1"
    )
    start: Literal["initial", "equilibrium"] = key(
        "the joints' initial state, or static equilibrium near it, with their velocities", Defaults.start
    )


class Document(Table, BaseModel):  # the linter knows the children of BaseModel only where it is named
    """A scene file of eomgen."""

    format: Literal[1] = key("version of this format", kind="1")
    name: str = key("name of the scene and prefix of its C functions", kind="name")
    description: Description = key("one line for tables and plots", "")
    gravity: Triple = key("in world axes", GRAVITY, unit="m/s^2", names=PARAMETERS)
    coordinates: Literal["joint", "absolute"] = key("see [absolute coordinates](#absolute-coordinates)", "joint")
    terms: Annotated[tuple[Literal[tuple(TERMS)], ...], Field(strict=False)] = key(  # type: ignore[valid-type]
        "functions wanted; empty means all that the scene can use, see [terms](#terms)", (), kind="list of names"
    )
    task_frames: Annotated[tuple[str, ...], Field(strict=False)] = key(
        "bodies and [frames](#frames) whose Jacobians and the like the terms of frames give; empty means all",
        (),
        kind="list of names",
    )
    include: dict[str, Include] = {}
    repeat: dict[str, Repeat] = {}
    parameters: dict[str, Parameter] = {}
    curves: dict[str, Curve] = {}
    inputs: dict[str, Input] = {}
    random: dict[str, RandomProcess] = {}
    waves: dict[str, SeaWaves] = {}
    states: dict[str, State] = {}
    controllers: dict[str, Controller] = {}
    base: Base | None = None
    bodies: dict[str, Body] = {}
    beams: dict[str, Beam] = {}
    joints: dict[str, Joint] = {}
    constraints: dict[str, Constraint] = {}
    reactions: dict[str, Reaction] = {}
    points: dict[str, Point] = {}
    frames: dict[str, BodyFrame] = {}
    for row in ELEMENTS:
        __annotations__[row.section] = GenericAlias(dict, (str, row.entry))
        locals()[row.section] = {}
    del row
    references: dict[str, ReferenceEntry] = {}
    outputs: dict[str, Output] = {}
    modes: dict[str, Mode] = {}
    events: dict[str, Event] = {}
    simulation: Simulation = Simulation()

    def section(self, name: str) -> Mapping[str, Any]:
        """Return the entries of a section."""
        entries: Mapping[str, Any] = getattr(self, name)
        return entries
