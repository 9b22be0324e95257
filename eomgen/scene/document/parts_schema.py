"""Schemas of entries that become other parts of a file before the file is read: includes and repeats."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, create_model

from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.key_metadata import Table, key, optional
from eomgen.scene.reading.kinds import Rotations, Triple, Value
from eomgen.scene.sources.register import all_options, formats_with, own_sources
from eomgen.scene.sources.source import Option, Source


def _key_of(source: Source, option: Option) -> tuple[Any, Any]:
    """Return annotation and field of the key of an include that sets an option of a source, as pydantic's models take
    them."""
    description = f"{formats_with(source, option)}: {option.of_key or option.description}"
    if isinstance(option.default, tuple):
        names = Annotated[tuple[str, ...], Field(strict=False)]
        return names, key(description, option.default, kind="list of names")
    return Literal[option.choices] if option.choices else type(option.default), key(description, option.default)


#: Types and keys of the options of sources.
_OPTIONS = {option.name: _key_of(source, option) for source, option in all_options().values()}


class Include(Table):
    """Another scene file, or a URDF, as a part of this scene."""

    file: Annotated[str, Field(min_length=1, max_length=1000)] = key("path, from the folder of this file", path=True)
    prefix: Annotated[str, Field(max_length=64)] | None = optional(
        "prefix of every name of the file", shown_default="the entry's name and `_`"
    )
    parent: str = key("body of this scene that is the file's base", "base", refers="bodies", kind="body, or `base`")
    position: Triple = key("place of the file's base in the parent frame", (0.0, 0.0, 0.0), unit="m", names=PARAMETERS)
    rotation: Rotations | None = optional(
        "axes of the file's base in the parent, angles of fixed parameters", shown_default="`[]`"
    )
    parameters: dict[str, Value] = key(
        "values in place of the file's own: numbers, numbers with a unit, or formulas of parameters of this scene",
        {},
        kind="values by name",
        shown_default="`{}`",
    )
    initial: dict[str, dict[str, Any]] = key(
        "the start of joints of the file, each as its `initial`", {}, kind="tables by joint", shown_default="`{}`"
    )
    __annotations__.update((name, kind) for name, (kind, _) in _OPTIONS.items())
    locals().update((name, value) for name, (_, value) in _OPTIONS.items())


class Repeat(Table):
    """Entries of sections that are made once for each number of the indices; the keys other than ``indices`` are
    sections of the scene."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True, defer_build=True)

    indices: dict[str, Any] = key(
        "numbers that each index takes: `{ i = 10 }` for 0 to 9, `{ i = [1, 9] }` for 1 to 9; the last one counts"
        " fastest",
        kind="whole numbers, or pairs of them, by name",
    )
    where: str = key("condition on indices, as `i < j` for pairs", "", kind="formula of indices", shown_default="all")


def include_of(source: Source | None) -> type[Include]:
    """Return the table of an include of a source's files, which may be another distribution's."""
    if source is None or source in own_sources():
        return Include
    added: dict[str, Any] = {option.name: _key_of(source, option) for option in source.options}
    return create_model("Include", __base__=Include, **added)
