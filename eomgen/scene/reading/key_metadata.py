"""Metadata of scene keys, one place for each: unit, scope of formulas, reference, and description.

The check of unit strings, the JSON Schema, the prefixes of included files and the tables of ``docs/scene/`` all read
this.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import cache
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from eomgen.base.data import dataclass
from eomgen.base.products import rows_of
from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS, Scope

#: A unit in SI, or units of components; by type for keys with a unit that depends on a type (of joint, of constraint).
Units = str | tuple[str, ...]
#: For values with a unit of their own, such as parameters.
ANY_UNIT = "any unit"
#: One of the two columns of a curve.
Column = Literal["", "argument", "value"]


class Table(BaseModel):
    """A table with known keys only; a text in place of the table is the value of the key ``short``, if any.

    The value of the key ``rate_of_entry`` has the unit of the entry divided by s.

    Parameters
    ----------
    **data : object
        Values by key.
    """

    short: ClassVar[str] = ""
    rate_of_entry: ClassVar[str] = ""
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)

    @classmethod
    def column_labels(cls, data: Mapping[str, Any]) -> tuple[str, str] | None:
        """Return the labels of argument and value of the curve that an entry describes.

        Parameters
        ----------
        data : mapping
            The entry as written.

        Returns
        -------
        tuple of str or None
            Labels with units; None for entries without a curve.
        """
        return None

    #: Whether the label ``unit`` of an entry is the unit of the column of values.
    labels_values: ClassVar[bool] = True


def label_of(text: object) -> str:
    """Return a label of unchecked data; empty unless a text."""
    return text if isinstance(text, str) else ""


@dataclass(frozen=True, eq=False, repr=False)  # each is one of its kind; pydantic asks for text of the identity
class KeyMetadata:
    """Metadata of a key.

    Attributes
    ----------
    unit : SI unit of the numbers; by component; or by the ``type`` of the entry, of the enclosing entry, or of its
        ``joint``.
    names : the names that formulas of the key may use; None for a key without formulas.
    refers : the section whose entries the key names.
    sets : whether the key is a table whose keys are components of the state, in the notation of formulas.
    path : whether the value is the path of a file, relative to the folder of the file with the key.
    column : the column of a curve to which the numbers or the unit belong; for pairs, one column per entry.
    kind : words for the type of value, in place of words from the annotation.
    shown_default : words for the default, in place of the value.
    example : a value, for messages.
    """

    unit: Units | Mapping[str, Units] = ""
    names: Scope | None = None
    refers: str = ""
    sets: bool = False
    path: bool = False
    column: Column | tuple[Column, Column] = ""
    kind: str = ""
    shown_default: str = ""
    example: str = ""


def key(
    description: str,
    default: Any = ...,
    *,
    unit: Units | Mapping[str, Units] = "",
    names: Scope | None = None,
    refers: str = "",
    sets: bool = False,
    path: bool = False,
    column: Column | tuple[Column, Column] = "",
    kind: str = "",
    shown_default: str = "",
    example: str = "",
    **constraints: Any,
) -> Any:
    """Return a field of a table with metadata; ``constraints`` (``alias``, ``ge``, ``le``, ...) as in pydantic's
    ``Field``.

    Parameters
    ----------
    description : str
        For the reference page and for editors: one line of Markdown, no full stop.
    default : object
        The value if the key is absent; required by default.
    unit : str, tuple of str or mapping, optional
        SI unit of the numbers: one for all, by component, or a mapping by the type of the entry, the enclosing entry or
        its joint; ``any unit`` for a unit that the key ``unit`` of the entry gives; none by default.
    names : Scope, optional
        Names that formulas of the key may use; no formulas by default.
    refers : str, optional
        Section whose entries the value names.
    sets : bool, optional
        Whether the value is a table whose keys are components of the state, as ``q.joint``.
    path : bool, optional
        Whether the value is the path of a file, relative to the folder of the file with the key.
    column : str or tuple of str, optional
        Column of a curve, ``argument`` or ``value``, to which numbers or unit belong; for pairs, both.
    kind : str, optional
        Words for the type on the reference page, in place of the type's own.
    shown_default : str, optional
        Words for the default on the reference page.
    example : str, optional
        Value for messages about a missing or a wrong value: ``name = "arm"``.
    **constraints : object
        ``alias``, ``ge``, ``le`` and others, as of pydantic's ``Field``.

    Returns
    -------
    object
        A field of a ``Table``.
    """
    meaning = KeyMetadata(unit, names, refers, sets, path, column, kind, shown_default, example)
    field = Field(default, description=description, **constraints)
    field.metadata.append(meaning)
    return field


def optional(description: str, **meaning: Any) -> Any:
    """Return a key with the default None.

    Parameters
    ----------
    description : str
        As of ``key``.
    **meaning : object
        Further arguments of ``key``.

    Returns
    -------
    object
        A field of a ``Table``.
    """
    return key(description, None, **meaning)


def of_parameters(description: str, *, unit: Units | Mapping[str, Units] = "", shown_default: str = "") -> Any:
    """Return an optional key whose values are formulas of parameters.

    Parameters
    ----------
    description : str
        As of ``key``.
    unit : str, tuple of str or mapping, optional
        As of ``key``.
    shown_default : str, optional
        As of ``key``.

    Returns
    -------
    object
        A field of a ``Table``.
    """
    return optional(description, unit=unit, names=PARAMETERS, shown_default=shown_default)


def given_in(phrase: str) -> Any:
    """Return the key ``in``: the frame in whose axes an entry is given at the design position."""
    description = f"frame in which {phrase}, at the [design position](conventions.md#design-position)"
    kind = "body, `base` or `world`"
    return optional(description, alias="in", refers="bodies", kind=kind, shown_default="the body itself")


def of_fixed_parameters(description: str, **meaning: Any) -> Any:
    """Return an optional key whose values are formulas of parameters that are not tunable.

    Parameters
    ----------
    description : str
        As of ``key``.
    **meaning : object
        Further arguments of ``key``.

    Returns
    -------
    object
        A field of a ``Table``.
    """
    return optional(description, names=FIXED_PARAMETERS, **meaning)


@dataclass(frozen=True)
class AddedKey:
    """A key that a product adds to the entries of a section: a row of the register of keys.

    Attributes
    ----------
    section : of a scene file
    added : the key
    type : annotation of the value
    field : the field of the key, by ``optional``
    read : function of the value, the item of the entry without the key, and the reader of values, which returns the
        item with the key
    example : from a wrong value to an example
    required : example of each required key of a value that is a table
    """

    section: str
    added: str
    type: Any
    field: Any
    read: Callable[[Any, Any, Any], Any]
    example: Callable[[object], str]
    required: Mapping[str, str]

    @property
    def name(self) -> str:
        """Place of the key in a scene file: ``base.follow``."""
        return f"{self.section}.{self.added}"


@dataclass(frozen=True)
class ForeignKeys:
    """Names in other tools of keys of a product's tables: a row of the register. ``hint`` is a function of an unknown
    name, the keys of the table and the value under the name; the result is the right key, or keys, as text for a
    message, empty without one."""

    hint: Callable[[str, Collection[str], object], str]


@cache
def added_keys(section: str) -> tuple[AddedKey, ...]:
    """Return the keys that products add to the entries of a section."""
    return tuple(row for row in rows_of("eomgen.keys", AddedKey) if row.section == section)


def shown_power(value: float) -> str:
    """Return a power of ten as the reference page writes it, 1e-3; other numbers lose all digits but the first."""
    return f"{value:.0e}".replace("e-0", "e-")


def meaning_of(field: FieldInfo) -> KeyMetadata:
    """Return the metadata of a field of a table."""
    return next((entry for entry in field.metadata if isinstance(entry, KeyMetadata)), KeyMetadata())


def every_unit(meaning: KeyMetadata) -> tuple[str, ...]:
    """Return each unit that a key can have, once, in order."""
    by_type = meaning.unit.values() if isinstance(meaning.unit, Mapping) else (meaning.unit,)
    flat = [unit for units in by_type for unit in ((units,) if isinstance(units, str) else units)]
    return tuple(dict.fromkeys(unit for unit in flat if unit))


class Inner(NamedTuple):
    """The tables in the value of a key: one, entries by name, or a list of tables."""

    shape: Literal["table", "entries", "list"]
    model: type[Table]


def inner_table(annotation: Any) -> Inner | None:
    """Return the class of tables in the value of a key with an annotation, and whether the value is a table, a list of
    tables or tables by name; None for a value without tables."""
    origin = get_origin(annotation)
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return Inner("table", annotation)
    if origin is Annotated:
        return inner_table(get_args(annotation)[0])
    if origin in (Union, UnionType):
        return next((result for part in get_args(annotation) if (result := inner_table(part)) is not None), None)
    if origin in (dict, tuple):
        result = inner_table(get_args(annotation)[1 if origin is dict else 0])
        return None if result is None else Inner("entries" if origin is dict else "list", result.model)
    return None


@cache
def fields_of(model: type[Table]) -> dict[str, tuple[KeyMetadata, Inner | None]]:
    """Return the metadata of each key of a table, by name in a file, and the tables in the value."""
    fields = model.model_fields.items()
    return {field.alias or name: (meaning_of(field), inner_table(field.annotation)) for name, field in fields}


def tables_of(model: type[Table]) -> dict[str, type[Table]]:
    """Return a class of tables and all inner classes of tables, by name."""
    result = {model.__name__: model}
    for _, inner in fields_of(model).values():
        if inner is not None and inner.model.__name__ not in result:
            result |= tables_of(inner.model)
    return result
