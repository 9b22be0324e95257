"""The shape of a scene file, as pydantic models: which keys exist, what kind of value each takes and what it means.

Checks of several keys together are in ``checks``; the tables of ``docs/scene.md`` are made from here by
``reference``.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import GenericAlias
from typing import Annotated, Any, ClassVar, Literal, cast

from pydantic import BaseModel, ConfigDict, Field, create_model

from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.key_metadata import Table, key, optional, shown_power
from eomgen.scene.reading.kinds import Description, Finite, Rotations, Triple, Value
from eomgen.scene.scene import GRAVITY
from eomgen.scene.section import Section
from eomgen.scene.sections import OWN, others, sections_for
from eomgen.scene.sources.register import BUILT_IN, all_options, formats_with
from eomgen.scene.sources.source import Option, Source
from eomgen.system.description import Simulation as Defaults
from eomgen.system.terms import TERMS


def _key_of(source: Source, option: Option) -> tuple[Any, Any]:
    """Return the type of an option of a source as a key of an include, and the key."""
    description = f"{formats_with(source, option)}: {option.of_key or option.description}"
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
    parent: str = key("body of this scene that is the file's base", "base", refers="bodies", kind="body, or `base`")
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
    initial: dict[str, dict[str, Any]] = key(
        "the start of joints of the file, each as its `initial`", {}, kind="tables by joint", shown_default="`{}`"
    )
    for source, option in all_options().values():
        __annotations__[option.name], locals()[option.name] = _key_of(source, option)
    del source, option


class Repeat(Table):
    """Entries of sections that are made once for each number of the indices; the keys other than ``indices`` are
    sections of the scene."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True, defer_build=True)

    indices: dict[str, Any] = key(
        "numbers that each index takes: `{ i = 10 }` for 0 to 9, `{ i = [1, 9] }` for 1 to 9; the last one counts"
        " fastest",
        kind="whole numbers, or pairs of them, by name",
    )
    where: str = key(
        "condition on the combinations of indices, as `i < j` for pairs",
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
        "of `taylor`", kind="whole number, 2 to 40", shown_default="by the tolerance"
    )
    settings: dict[str, Finite] = key(
        "of the method's iteration, as of `simulate`: `rtol`, `atol`, `max_iterations`, `max_halvings`, `reuse`; of"
        " methods that choose their steps `largest_step`, s; other methods keep theirs",
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


#: Schemas without absent sections, by the whole one and the keys of these sections, and how many are made.
_SHORTENED: dict[tuple[type[Document], frozenset[str]], type[Document]] = {}
_MOST_SHORTENED = 4


def section_keys(document: type[Document]) -> tuple[str, ...]:
    """Return the keys of the sections of a file that have entries by name."""
    return tuple(row.key for row in document.rows if not row.single)


def document_for(*data: object) -> type[Document]:
    """Return the schema of files with eomgen's own sections, and with sections of other distributions that nested data
    have."""
    keys = dict.fromkeys(str(key) for part in data if isinstance(part, Mapping) for key in part)
    return _document(sections_for(key for key in keys if key not in Document.model_fields))


def every_document() -> type[Document]:
    """Return the schema of files with the sections of all distributions that are installed."""
    return _document(sections_for(others()))


@cache
def _document(rows: tuple[Section, ...]) -> type[Document]:
    if rows == OWN:
        return Document
    added: dict[str, Any] = {row.key: (GenericAlias(dict, (str, row.entry)), {}) for row in rows[len(OWN) :]}
    made = create_model("Document", __base__=Document, **added)
    made.rows = rows
    return made


def without_absent_sections(schema: type[Document], data: Mapping[str, Any]) -> type[Document]:
    """Return the schema without the sections that data lack, since validators of sections take most of the time of a
    first reading; the whole schema once several were made."""
    key = schema, frozenset(row.key for row in schema.rows if row.key not in data)
    if key not in _SHORTENED:
        if len(_SHORTENED) == _MOST_SHORTENED:
            return schema
        kept: dict[str, Any] = {
            name: (field.annotation, field) for name, field in schema.model_fields.items() if name not in key[1]
        }
        # the class has all attributes that readers of a Document use besides the entries of sections
        made = cast("type[Document]", create_model("Document", __base__=(_Sections, Table), **kept))
        made.rows = schema.rows
        _SHORTENED[key] = made
    return _SHORTENED[key]


class _Sections:
    """Access to the sections of a scene file by key."""

    rows: ClassVar[tuple[Section, ...]] = OWN

    def section(self, name: str) -> Mapping[str, Any]:
        """Return the entries of a section; none of a section that is absent, or whose product is not installed."""
        entries: Mapping[str, Any] = getattr(self, name, {})
        return entries

    def table(self, name: str) -> Any:
        """Return a section that is one table; None if the file has none."""
        return getattr(self, name, None)


class Document(_Sections, Table, BaseModel):  # the linter knows the children of BaseModel only if it is a direct base
    """A scene file of eomgen."""

    format: Literal[1] = key("version of this format", kind="1")
    name: str = key("name of the scene and prefix of its C functions", kind="name")
    description: Description = key("one line for tables and plots", "")
    gravity: Triple = key("in world axes", GRAVITY, unit="m/s^2", names=PARAMETERS)
    coordinates: Literal["joint", "absolute"] = key("see [absolute coordinates](absolute_coordinates.md)", "joint")
    terms: Annotated[tuple[Literal[tuple(TERMS)], ...], Field(strict=False)] = key(  # type: ignore[valid-type]
        "functions wanted; empty means all that the scene can use, see [terms](terms.md)", (), kind="list of names"
    )
    task_frames: Annotated[tuple[str, ...], Field(strict=False)] = key(
        "bodies and [frames](frames.md) whose Jacobians and the like the terms of frames give; empty means all",
        (),
        kind="list of names",
    )
    include: dict[str, Include] = {}
    repeat: dict[str, Repeat] = {}
    for row in OWN:
        __annotations__[row.key] = row.entry | None if row.single else GenericAlias(dict, (str, row.entry))
        locals()[row.key] = None if row.single else {}
    del row
    simulation: Simulation = Simulation()


SECTIONS = section_keys(Document)
