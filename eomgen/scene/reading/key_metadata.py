"""Metadata of scene keys, one place for each: unit, scope of formulas, reference, and description.

The check of unit strings, the JSON Schema, the prefixes of included files and the tables of ``docs/scene/`` all read
this.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache
from inspect import get_annotations
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, Union, get_args, get_origin, get_type_hints

from eomgen.base.data import dataclass, replace
from eomgen.base.products import rows_of
from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS, Scope
from eomgen.scene.reading.table_checks import Check, Fault, Place, Within, check_of, marks_of

#: A unit in SI, or units of components; by type for keys with a unit that depends on a type (of joint, of constraint).
Units = str | tuple[str, ...]
#: For values with a unit of their own, such as parameters.
ANY_UNIT = "any unit"
#: One of the two columns of a curve.
Column = Literal["", "argument", "value"]


def label_of(text: object) -> str:
    """Return a label of unchecked data; empty unless a text."""
    return text if isinstance(text, str) else ""


@dataclass(frozen=True)
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
    """

    unit: Units | Mapping[str, Units] = ""
    names: Scope | None = None
    refers: str = ""
    sets: bool = False
    path: bool = False
    column: Column | tuple[Column, Column] = ""
    kind: str = ""
    shown_default: str = ""


@dataclass(frozen=True, eq=False)
class Key:
    """A key of a table.

    Attributes
    ----------
    default : of the key, ``...`` of a required one
    description : of the key; None if the key is in no table of the reference page
    alias : name of the key in a file, unless Python has the same name
    meaning : unit, scope and others
    within : bounds of the value
    type : of the value, with marks
    """

    default: Any = ...
    description: str | None = None
    alias: str | None = None
    meaning: KeyMetadata = KeyMetadata()
    within: Within | None = None
    type: Any = Any

    @property
    def annotation(self) -> Any:
        """Type of the value without marks."""
        return marks_of(self.type)[0]

    def is_required(self) -> bool:
        """Return whether the key has no default."""
        return self.default is ...


class _TableType(type):
    """Type of tables, which have keys."""

    @property
    def model_fields(cls) -> Mapping[str, Key]:
        """The keys of a table by name in Python, which are read from the class on the first request."""
        return _keys_of(cls)


@cache
def _keys_of(kind: type) -> Mapping[str, Key]:
    keys: dict[str, Key] = {}
    for base in [base for base in reversed(kind.__mro__) if issubclass(base, Table) and base is not Table]:
        own: dict[str, Any] = get_annotations(base)
        if any(isinstance(annotation, str) for annotation in own.values()):
            hints = get_type_hints(base, include_extras=True)
            own = {name: hints[name] for name in own}
        for name, annotation in own.items():
            if get_origin(annotation) is not ClassVar:
                given = vars(base).get(name, ...)
                item = given if isinstance(given, Key) else Key(given)
                keys[name] = replace(item, type=Annotated[annotation, item.within] if item.within else annotation)
    return keys


@cache
def _reading_of(kind: type[Table]) -> tuple[tuple[str, str, Key, Check], ...]:
    """Return name in Python, name in a file, key and check of each key of a table."""
    return tuple((name, key.alias or name, key, check_of(key.type)) for name, key in kind.model_fields.items())


class Table(metaclass=_TableType):
    """A table with known keys only; a text in place of the table is the value of the key ``short``, if any.

    Parameters
    ----------
    **data : object
        Values by key.

    Attributes
    ----------
    model_fields : keys of the table by name
    model_fields_set : names of the keys that are given
    """

    short: ClassVar[str] = ""
    #: Whether the table may have further keys, which are not kept.
    others: ClassVar[bool] = False
    #: Whether the label ``unit`` of an entry is the unit of the column of values.
    labels_values: ClassVar[bool] = True
    model_fields_set: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, **data: Any) -> None:
        faults: list[Fault] = []
        vars(self).update(vars(self.check(data, (), faults)))
        if faults:
            raise ValueError(faults)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a {type(self).__name__} does not change")

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in _values(self))})"

    @classmethod
    def prepared(cls, given: object) -> object:
        """Return a given value in the form of a table; the same value unless a table has a short form.

        Parameters
        ----------
        given : object
            Nested data.

        Returns
        -------
        object
            The table as nested data, or the value itself.
        """
        return given

    @classmethod
    def check(cls, given: object, place: Place, faults: list[Fault]) -> Any:
        """Return the table of nested data.

        Parameters
        ----------
        given : object
            Nested data.
        place : tuple
            Keys on the way to the table.
        faults : list
            Gets the faults; with any, the table lacks values.

        Returns
        -------
        Table
            The table, with defaults.
        """
        if isinstance(given, cls):
            return given
        data = cls.prepared(given)
        if not isinstance(data, dict):
            faults.append(Fault("model_type", "", place, data))
            return None
        values: dict[str, Any] = {}
        known = set()
        names = set()
        for name, written, item, check in _reading_of(cls):
            names.add(written)
            if written in data:
                values[name] = check(data[written], (*place, written), faults)
                known.add(name)
            elif item.default is ...:
                faults.append(Fault("missing", "", (*place, written), data))
            else:
                values[name] = dict(item.default) if isinstance(item.default, dict) else item.default
        for written, value in {} if cls.others else data.items():
            if not isinstance(written, str):
                faults.append(Fault("invalid_key", "Keys should be strings", (*place, str(written)), written))
            elif written not in names:
                faults.append(Fault("extra_forbidden", "", (*place, written), value))
        made = object.__new__(cls)
        vars(made).update(values, model_fields_set=frozenset(known))
        return made

    def changed(self, **values: Any) -> Self:
        """Return the table with other values of some keys.

        Parameters
        ----------
        **values : object
            Values by name, which are not checked.

        Returns
        -------
        Table
            Another table.
        """
        made = object.__new__(type(self))
        vars(made).update(vars(self), **values)
        vars(made)["model_fields_set"] = self.model_fields_set | values.keys()
        return made

    def plain(self) -> dict[str, Any]:
        """Return the values that are not None as nested data for JSON.

        Returns
        -------
        dict
            By name.
        """
        return {name: _plain(value) for name, value in _values(self) if value is not None}

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


def _values(table: Table) -> Iterator[tuple[str, Any]]:
    return ((name, getattr(table, name)) for name in type(table).model_fields)


def _plain(value: Any) -> Any:
    """Return a value of a table as nested data for JSON."""
    if isinstance(value, Table):
        return value.plain()
    if isinstance(value, tuple | list):
        return [_plain(part) for part in value]
    return {name: _plain(part) for name, part in value.items()} if isinstance(value, dict) else value


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
    **constraints: Any,
) -> Any:
    """Return a key of a table; ``constraints`` are ``alias``, the name in a file, and bounds as of ``Within``.

    Parameters
    ----------
    description : str
        For the reference page and for editors: one line of Markdown, no full stop.
    default : object
        The value if the key is absent; required by default.
    unit : str, tuple of str or mapping, optional
        Unit of the values in SI; several for alternatives; by another key's value as a mapping.
    names : Scope, optional
        Names that a formula under the key may use.
    refers : str, optional
        Section whose entries the value names.
    sets : bool, optional
        Whether the value sets an entry of the section, and does not read it.
    path : bool, optional
        Whether the value is the path of a file.
    column : str or tuple of str, optional
        Label of the key that describes a column of a table.
    kind : str, optional
        Words for the type on the reference page, in place of the type's own.
    shown_default : str, optional
        Words for the default on the reference page.
    **constraints : object
        ``alias``, the name in a file, and bounds: ``ge``, ``le``, ``gt``, ``min_length``, ``max_length``.

    Returns
    -------
    object
        A field of a ``Table``.
    """
    meaning = KeyMetadata(unit, names, refers, sets, path, column, kind, shown_default)
    alias = constraints.pop("alias", None)
    return Key(default, description, alias, meaning, Within(**constraints) if constraints else None)


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


def given_in(description: str) -> Any:
    """Return the key ``in``: the frame in whose axes an entry is given at the design position."""
    return optional(
        description, alias="in", refers="bodies", kind="body, `base` or `world`", shown_default="the body itself"
    )


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
    """Names in other tools of keys of a product's tables: a row of the register.

    ``hint``: from a name, the keys that the table has and the given value to the key, or keys; empty without one.
    """

    hint: Callable[[str, Collection[str], object], str]


@cache
def added_keys(section: str) -> tuple[AddedKey, ...]:
    """Return the keys that products add to the entries of a section."""
    return tuple(row for row in rows_of("eomgen.keys", AddedKey) if row.section == section)


def shown_power(value: float) -> str:
    """Return a small number in the notation of the reference page: ``1e-3``."""
    return f"{value:.0e}".replace("e-0", "e-")


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
    """Return the table that a key of an annotation holds, alone, in a list or by name; None for a key without
    tables."""
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
    return {field.alias or name: (field.meaning, inner_table(field.annotation)) for name, field in fields}


def tables_of(model: type[Table]) -> dict[str, type[Table]]:
    """Return a class of tables and all inner classes of tables, by name."""
    result = {model.__name__: model}
    for _, inner in fields_of(model).values():
        if inner is not None and inner.model.__name__ not in result:
            result |= tables_of(inner.model)
    return result
