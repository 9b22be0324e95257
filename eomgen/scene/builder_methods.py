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

from eomgen.scene.builder_examples import EXAMPLES
from eomgen.scene.document import schema
from eomgen.scene.reading import kinds
from eomgen.scene.reading.key_metadata import Table, every_unit, inner_table, meaning_of
from eomgen.scene.reading.kinds import Rotations as RotationList
from eomgen.scene.section import Section

#: A number, a formula, or a number with a unit.
Value = float | str
#: Intrinsic rotations (axis, angle), in order.
Rotations = Sequence[tuple[Sequence[Value], Value]]

P = ParamSpec("P")
R = TypeVar("R")
Builder = TypeVar("Builder")

#: Types that a caller may pass for a kind of value, if they differ from the kind's own type.
_TYPES: tuple[tuple[Any, str], ...] = (
    (kinds.Value, "Value"),
    (kinds.Values, "Value | Sequence[Value]"),
    (kinds.Finite, "float"),
    (kinds.Numbers, "float | Sequence[float]"),
    (kinds.Inertia, "Sequence[Any] | Mapping[str, Value]"),
    (RotationList, "Rotations"),
)
#: The argument of methods that add an entry.
_NAME = "name : str\n    Name of the entry, by which the rest of the scene refers to the entry.\n"
#: Keys that only some sources of an include have.
_FURTHER = "**keys : object\n    Further options of the source of the file.\n"
_LINK = re.compile(r"\[([^]]*)\]\([^)]*\)")


def enters(
    section: str, *, others: bool = False
) -> Callable[[Callable[Concatenate[Builder, P], R]], Callable[Concatenate[Builder, P], R]]:
    """Return a decorator for a method ``(self, ..., **keys)`` that enters keys of a table of the scene file.

    The keys that the method does not name itself become arguments by name of its signature, with defaults, types and
    meanings from the schema; a call with other arguments is a TypeError.

    Parameters
    ----------
    section : str
        Of the scene file: ``simulation``.
    others : bool
        Whether further keys are passed on: keys that only a file can give.
    """

    def decorate(method: Callable[Concatenate[Builder, P], R]) -> Callable[Concatenate[Builder, P], R]:
        table = inner_table(schema.document_for({section: {}}).model_fields[section].annotation)
        assert table is not None, section  # sections are named in this package only, never by a user
        written = inspect.signature(method)
        *first, open_ones = written.parameters.values()
        rest = [open_ones.replace(annotation="Any")] if others else []
        signature = written.replace(parameters=[*first, *_keys(table.model, [item.name for item in first]), *rest])

        @functools.wraps(method)
        def call(self: Builder, /, *args: P.args, **kwargs: P.kwargs) -> R:
            signature.bind(self, *args, **kwargs)
            return method(self, *args, **kwargs)

        describe(call, signature, documentation_of(method.__doc__ or "", table.model, signature, method.__name__))
        return call

    return decorate


def signature_of(row: Section) -> inspect.Signature:
    """Return the signature of the builder's method of a section: the name, keys by position, keys by name."""
    by_position = inspect.Parameter.POSITIONAL_OR_KEYWORD
    parameters = [inspect.Parameter("self", by_position)]
    parameters += [] if row.single else [inspect.Parameter("name", by_position, annotation="str")]
    every = {item.name: item for item in _keys(row.schema)}
    parameters += [every.pop(name).replace(kind=by_position) for name in row.positional]
    return inspect.Signature([*parameters, *every.values()], return_annotation="Self")


def documentation_of(text: str, table: type[Table], signature: inspect.Signature, method: str) -> str:
    """Return the docstring of a builder's method in numpydoc's form: ``text`` first, then parameters, result and
    example. ``table`` is the schema with the meanings of the keys, ``signature`` has the arguments to describe, and
    ``method`` is the name by which examples are looked up."""
    types, described = _types(table), table.model_fields
    names = [name for name in signature.parameters if name in described or name == "name"]
    meanings = "".join(_meaning(name, types[name], described[name]) if name in described else _NAME for name in names)
    if any(item.kind is inspect.Parameter.VAR_KEYWORD for item in signature.parameters.values()):
        meanings += _FURTHER
    inner = indent(inspect.cleandoc(text), " " * 8).strip()
    returned = "Returns\n-------\nSceneBuilder\n    The same builder, for further calls."
    lines = "\n".join(f">>> {line}" for line in EXAMPLES.get(method, ()))
    example = f"\n\nExamples\n--------\nOf the arm in the example of the class:\n\n{lines}" if lines else ""
    return inner + indent(f"\n\nParameters\n----------\n{meanings}\n{returned}{example}", " " * 8).rstrip()


def describe(method: Callable[..., Any], signature: inspect.Signature, documentation: str) -> None:
    """Set the signature, the annotations and the docstring of a function in place, as ``help`` shows them."""
    method.__doc__ = documentation
    method.__annotations__ = {name: item.annotation for name, item in signature.parameters.items() if name != "self"}
    method.__annotations__["return"] = signature.return_annotation
    method.__signature__ = signature  # type: ignore[attr-defined]


def _keys(table: type[Table], named: Sequence[str] = ()) -> list[inspect.Parameter]:
    """Return the keys of a table's schema as keyword-only arguments of a signature, with defaults and types; keys in
    ``named`` are left out."""
    types = _types(table)
    return [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=_default(field), annotation=types[name])
        for name, field in table.model_fields.items()
        if name not in named
    ]


def _types(table: type[Table]) -> dict[str, str]:
    """Return the type of each key of a table's schema as the text of an annotation; optional keys have ``| None``,
    which stands for a key that is not given."""
    result = {}
    for name, hint in get_type_hints(table, include_extras=True).items():
        if name in table.model_fields:
            field = table.model_fields[name]
            words = "Value" if hint == kinds.Finite and meaning_of(field).unit else _type(hint)
            result[name] = words if field.is_required() or words.endswith("None") else f"{words} | None"
    return result


def _type(annotation: Any) -> str:
    """Return the text of a type in a builder's signature for an annotation of the schema: ``Sequence[Value]`` for a
    vector, ``str`` for a choice of words, ``Mapping[str, Any]`` for a nested table."""
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
        short = "str | " if "point" in annotation.model_fields else ""  # of a frame: the name of a point
        return f"{short}Mapping[str, Any]"
    return "None" if annotation is NoneType else str(annotation.__name__)


def _default(field: FieldInfo) -> Any:
    """Return the default of a key as a signature shows it: None for a table."""
    if field.is_required():
        return inspect.Parameter.empty
    return field.default if isinstance(field.default, str | bool | int | float | tuple) else None


def _meaning(name: str, words: str, field: FieldInfo) -> str:
    """Return the lines on a key in a method's docstring, in numpydoc's form: name, type ``words`` and units, then the
    description of the schema's field as an indented sentence."""
    words = words.removesuffix(" | None")
    units = " or ".join(every_unit(meaning_of(field)))
    inner = inner_table(field.annotation)
    keys = f"; keys {', '.join(inner.model.model_fields)}" if inner is not None and "Mapping" in words else ""
    text = _LINK.sub(r"\1", field.description or "") + keys
    text = f"{text[:1].upper()}{text[1:]}."  # phrases of tables are sentences here
    return f"{name} : {words}{', ' if units else ''}{units}\n{indent(fill(text, 104), '    ')}\n"
