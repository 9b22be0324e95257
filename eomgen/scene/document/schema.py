"""The shape of a scene file, as pydantic models: the keys, kinds of values, and meanings.

Checks of several keys together are in ``checks``; the tables of ``docs/scene.md`` are made from here by
``reference``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import GenericAlias
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, create_model

from eomgen.base.products import import_target
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.key_metadata import Table, key, optional, shown_power
from eomgen.scene.reading.kinds import Description, Finite, Triple
from eomgen.scene.scene import GRAVITY
from eomgen.scene.section import Section
from eomgen.scene.sections import KEYS, others, sections_for
from eomgen.system.description import Simulation as Defaults
from eomgen.system.terms import TERMS


class SimulationEntry(Table):
    """The defaults of ``simulate``."""

    method: str = key("see below", Defaults.method, kind="name")
    step: Finite = key("fixed step", Defaults.step, unit="s", shown_default=f"`{shown_power(Defaults.step)}`")
    duration: Finite = key("length of the run", Defaults.duration, unit="s")
    rho_inf: Finite = key(
        "numerical damping of generalized-alpha at high frequencies; 1 has none", Defaults.rho_inf, kind="0 to 1"
    )
    alpha: Finite | None = optional("alpha of `hht`, `wbz` and `newmark`, in place of `rho_inf`", kind="0 to 1")
    beta: Finite | None = optional("beta of `newmark`", kind="number", shown_default="0.25")
    gamma: Finite | None = optional("gamma of `newmark`", kind="number", shown_default="0.5")
    tolerance: Finite | None = optional(
        "tolerance of local errors: generalized-alpha chooses its steps by it, as `rk45` and `taylor` do; with"
        " `taylor` 0: fixed steps",
        kind="0 to 0.1",
        shown_default="the method's",
    )
    order: Annotated[int, Field(ge=2, le=40)] | None = optional(
        "order of `taylor`", kind="whole number, 2 to 40", shown_default="by the tolerance"
    )
    settings: dict[str, Finite] = key(
        "settings of the method's iteration, as of `simulate`: `rtol`, `atol`, `max_iterations`, `max_halvings`,"
        " `reuse`; of methods that choose their steps `largest_step`, s; other methods keep theirs",
        {},
        kind="numbers by name",
        shown_default="`{}`",
    )
    real: Literal["double", "float"] = key("default of the numbers in compiled code", Defaults.real)
    record_every: Annotated[int, Field(ge=1, le=1_000_000_000)] = key(
        "steps between recorded rows", Defaults.record_every, kind="whole number from 1"
    )
    start: Literal["initial", "equilibrium"] = key(
        "the joints' initial state, or static equilibrium near it, with their velocities", Defaults.start
    )


#: Default of the table of every file: a table that is made without a validator.
_SIMULATION = (SimulationEntry, SimulationEntry.model_construct())
#: Schemas of entries that other parts of a file become, ``module:name`` by key.
_OF_PARTS = {
    "include": "eomgen.scene.document.parts_schema:Include",
    "repeat": "eomgen.scene.document.parts_schema:Repeat",
}
#: Schemas by rows and sections, and how many are made before one has all sections.
_MADE: dict[tuple[tuple[Section, ...], frozenset[str]], type[SceneDocument]] = {}
_MOST_MADE = 4


class SceneDocument(Table):
    """A scene file of eomgen; subclasses have the sections that a file mentions, whose schemas are imported then."""

    #: Sections by which the file is read: late rows are among them only if the file mentions the section.
    rows: ClassVar[tuple[Section, ...]] = ()

    format: Literal[1] = key("version of this format", kind="1", example="format = 1")
    name: str = key("name of the scene and prefix of its C functions", kind="name")
    description: Description = key("one line for tables and plots", "")
    gravity: Triple = key("gravity in world axes", GRAVITY, unit="m/s^2", names=PARAMETERS)
    coordinates: Literal["joint", "absolute"] = key("see [absolute coordinates](absolute_coordinates.md)", "joint")
    terms: Annotated[tuple[Literal[tuple(TERMS)], ...], Field(strict=False)] = key(  # type: ignore[valid-type]
        "functions wanted; empty means all that the scene can use, see [terms](terms.md)", (), kind="list of names"
    )
    task_frames: Annotated[tuple[str, ...], Field(strict=False)] = key(
        "bodies and [frames](frames.md) whose Jacobians and the like the terms of frames give; empty means all",
        (),
        kind="list of names",
    )
    if TYPE_CHECKING:
        simulation: SimulationEntry

    @classmethod
    def known_keys(cls) -> list[str]:
        """Return all keys that a file may have, the keys of sections too that are absent in this schema."""
        return [*SceneDocument.model_fields, *_OF_PARTS, *KEYS, "simulation", *_keys_of_others(cls.rows)]

    def section(self, name: str) -> Mapping[str, Any]:
        """Return the entries of a section; none of a section that is absent, or whose product is not installed."""
        entries: Mapping[str, Any] = getattr(self, name, {})
        return entries

    def table(self, name: str) -> Any:
        """Return a section that is one table; None if the file has none."""
        return getattr(self, name, None)


_OF_EVERY_FILE = frozenset([*SceneDocument.model_fields, *_OF_PARTS, "simulation"])


def document_for(*data: object) -> type[SceneDocument]:
    """Return the schema of files with the sections that nested data mention, of eomgen and of other distributions."""
    return _document(_keys(data))


def every_document() -> type[SceneDocument]:
    """Return the schema of files with the sections of all distributions that are installed."""
    return _document(frozenset([*_OF_PARTS, *KEYS, *others()]))


def section_keys(*data: object) -> tuple[str, ...]:
    """Return the keys of all sections that have entries by name, of eomgen and of other distributions that nested data
    mention."""
    rows = sections_for(_keys(data) - _OF_EVERY_FILE)
    single = {row.key for row in rows if row.single}
    return tuple(key for key in (*KEYS, *_keys_of_others(rows)) if key not in single)


def _keys(data: Iterable[object]) -> frozenset[str]:
    return frozenset(str(key) for part in data if isinstance(part, Mapping) for key in part)


def _keys_of_others(rows: Iterable[Section]) -> list[str]:
    return [row.key for row in rows if row.key not in KEYS]


def _document(keys: frozenset[str]) -> type[SceneDocument]:
    """Return the schema of files with the sections of some top-level keys; once several schemas were made, with all of
    eomgen's own sections. Schemas are kept for further calls."""
    rows = sections_for(keys - _OF_EVERY_FILE)
    wanted = keys.intersection([*_OF_PARTS, *(row.key for row in rows)])
    if (rows, wanted) not in _MADE and len(_MADE) >= _MOST_MADE:
        rows = sections_for([*KEYS, *_keys_of_others(rows)])
        wanted = frozenset([*_OF_PARTS, *(row.key for row in rows)])
    if (rows, wanted) not in _MADE:
        parts = {key: _by_name(import_target(table)) for key, table in _OF_PARTS.items() if key in wanted}
        sections = {row.key: _field(row) for row in rows if row.key in wanted}
        further = {key: sections.pop(key) for key in _keys_of_others(rows)}
        fields: dict[str, Any] = {**parts, **sections, "simulation": _SIMULATION, **further}
        made = create_model("SceneDocument", __base__=SceneDocument, __doc__=SceneDocument.__doc__, **fields)
        made.rows = rows
        _MADE[rows, wanted] = made
    return _MADE[rows, wanted]


def _field(row: Section) -> tuple[Any, Any]:
    """Return type and default of a section."""
    return (row.schema | None, None) if row.single else _by_name(row.schema)


def _by_name(entry: object) -> tuple[Any, Any]:
    """Return type and default of entries by name."""
    return GenericAlias(dict, (str, entry)), {}
