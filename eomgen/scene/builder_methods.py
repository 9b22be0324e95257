"""Methods of a builder from the schema: the keys of an entry, their defaults, types and meanings."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Sequence
from textwrap import fill, indent
from types import NoneType, UnionType
from typing import Annotated, Any, Concatenate, Literal, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from pydantic.fields import FieldInfo

from eomgen.scene.document import schema
from eomgen.scene.reading import kinds
from eomgen.scene.reading.key_metadata import Table, every_unit, inner_table, meaning_of
from eomgen.scene.reading.rotation_schema import Rotations as RotationList

#: A number, a formula, or a number with a unit.
Value = float | str
#: Intrinsic rotations (axis, angle), in order.
Rotations = Sequence[tuple[Sequence[Value], Value]]

P = ParamSpec("P")
R = TypeVar("R")
Builder = TypeVar("Builder")

#: What a caller may give for a kind of value, where it is not what the kind is made of.
_TYPES: tuple[tuple[Any, str], ...] = (
    (kinds.Value, "Value"),
    (kinds.Values, "Value | Sequence[Value]"),
    (kinds.Finite, "float"),
    (kinds.Numbers, "float | Sequence[float]"),
    (kinds.Inertia, "Sequence[Any] | Mapping[str, Value]"),
    (RotationList, "Rotations"),
)
_LINK = re.compile(r"\[([^]]*)\]\([^)]*\)")


def enters(
    section: str, *, others: bool = False
) -> Callable[[Callable[Concatenate[Builder, P], R]], Callable[Concatenate[Builder, P], R]]:
    """Return a decorator for a method ``(self, name, ..., **keys)`` that enters keys of a section of the scene file.

    The keys that the method does not name itself become arguments by name of its signature, with defaults, types and
    meanings from the schema; a call with other arguments is a TypeError.

    Parameters
    ----------
    section : str
        Of the scene file: ``bodies``, ``base``.
    others : bool
        Whether further keys are passed on: those that only a file can tell.
    """

    def decorated(method: Callable[Concatenate[Builder, P], R]) -> Callable[Concatenate[Builder, P], R]:
        table = inner_table(schema.Document.model_fields[section].annotation)
        assert table is not None, section  # sections are named in this package only, never by a user
        written = inspect.signature(method)
        *given, open_ones = written.parameters.values()
        named = [parameter.name for parameter in given]
        added = {name: field for name, field in table.model.model_fields.items() if name not in named}
        types = _types(table.model)
        by_name = inspect.Parameter.KEYWORD_ONLY
        keys = [
            inspect.Parameter(name, by_name, default=_default(field), annotation=types[name])
            for name, field in added.items()
        ]
        rest = [open_ones.replace(annotation="Any")] if others else []
        signature = written.replace(parameters=[*given, *keys, *rest])

        @functools.wraps(method)
        def called(self: Builder, /, *args: P.args, **kwargs: P.kwargs) -> R:
            signature.bind(self, *args, **kwargs)
            return method(self, *args, **kwargs)

        meanings = "".join(_meaning(name, types[name], field) for name, field in table.model.model_fields.items())
        parameters = indent(f"\n\nParameters\n----------\n{meanings}", " " * 8)
        called.__doc__ = (method.__doc__ or "").rstrip() + parameters.rstrip()
        called.__annotations__ = {
            item.name: item.annotation for item in signature.parameters.values() if item.name != "self"
        }
        called.__annotations__["return"] = written.return_annotation
        called.__signature__ = signature  # type: ignore[attr-defined]
        return called

    return decorated


def _types(table: type[Table]) -> dict[str, str]:
    """Return the type of each key of a table, as Python writes it; None stands for a key that is not given."""
    found = {}
    for name, hint in get_type_hints(table, include_extras=True).items():
        if name in table.model_fields:
            field = table.model_fields[name]
            words = "Value" if hint == kinds.Finite and meaning_of(field).unit else _type(hint)
            found[name] = words if field.is_required() or words.endswith("None") else f"{words} | None"
    return found


def _type(annotation: Any) -> str:
    for known, words in _TYPES:
        if annotation == known:
            return words
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type(inner[0])
    if origin in (Union, UnionType):
        return " | ".join(_type(part) for part in inner)
    if origin is tuple:
        return f"Sequence[{_type(inner[0])}]"
    if origin is dict:
        return f"Mapping[str, {_type(inner[1])}]"
    if origin is Literal:
        return "str"
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return "Mapping[str, Any]"
    return "None" if annotation is NoneType else str(annotation.__name__)


def _default(field: FieldInfo) -> Any:
    """Return the default of a key as a signature shows it: None for a table."""
    if field.is_required():
        return inspect.Parameter.empty
    return field.default if isinstance(field.default, str | bool | int | float | tuple) else None


def _meaning(name: str, words: str, field: FieldInfo) -> str:
    """Return what the documentation of a method says of a key."""
    words = words.removesuffix(" | None")
    units = " or ".join(every_unit(meaning_of(field)))
    inner = inner_table(field.annotation)
    keys = f"; keys {', '.join(inner.model.model_fields)}" if inner is not None and "Mapping" in words else ""
    text = _LINK.sub(r"\1", field.description or "") + keys
    return f"{name} : {words}{', ' if units else ''}{units}\n{indent(fill(text, 104), '    ')}\n"
