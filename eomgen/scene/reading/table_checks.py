"""Checks of nested data against types of keys: numbers, texts, words, lists, tables; faults are collected with their
places.

A check is made from a type when the first value of this type is read: few files have values of most types.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from eomgen.base.data import dataclass

#: Keys and numbers on the way to a value.
Place = tuple[str | int, ...]


class Fault(NamedTuple):
    """A value of a wrong type, with kind and text of the message."""

    kind: str
    text: str
    place: Place
    given: object


#: From a value, the place and the list for faults to the value as the scene has it.
Check = Callable[[Any, Place, list[Fault]], Any]


class ValueFaultError(Exception):
    """Refusal of a value by the function of a type.

    Parameters
    ----------
    kind, text : str
        Of the fault.
    """

    def __init__(self, kind: str, text: str) -> None:
        self.kind, self.text = kind, text


@dataclass(frozen=True, eq=False)
class By:
    """Mark of a type whose values a function makes from given values; ``alone`` without the check of the type
    afterwards."""

    function: Callable[[Any], object]
    alone: bool = False


@dataclass(frozen=True, eq=False)
class Also:
    """Mark of a type that has further values, for which a function is true."""

    accepts: Callable[[object], bool]


@dataclass(frozen=True, eq=False)
class JsonSchema:
    """Mark of a type with a given JSON Schema."""

    schema: dict[str, Any]


class Within(NamedTuple):
    """Mark of a type: bounds of a number, or of the length of a text or a table."""

    ge: float | None = None
    le: float | None = None
    gt: float | None = None
    min_length: int | None = None
    max_length: int | None = None

    def fault(self, value: Any) -> tuple[str, str] | None:
        """Return kind and text of the fault of a value; None without a fault."""
        if self.ge is not None and not value >= self.ge:
            return "greater_than_equal", f"Input should be greater than or equal to {self.ge}"
        if self.le is not None and not value <= self.le:
            return "less_than_equal", f"Input should be less than or equal to {self.le}"
        if self.gt is not None and not value > self.gt:
            return "greater_than", f"Input should be greater than {self.gt:g}"
        for bound, word in ((self.min_length, "least"), (self.max_length, "most")):
            if bound is not None and (len(value) < bound if word == "least" else len(value) > bound):
                is_text = isinstance(value, str)
                noun = f"{'character' if is_text else 'item'}{'' if bound == 1 else 's'}"
                after = "" if is_text else f" after validation, not {len(value)}"
                return "length", f"{'String' if is_text else 'Dictionary'} should have at {word} {bound} {noun}{after}"
        return None


def marks_of(annotation: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return the type of a key without marks, and the marks."""
    if get_origin(annotation) is Annotated:
        return annotation.__origin__, annotation.__metadata__
    return annotation, ()


@cache
def check_of(annotation: Any) -> Check:
    """Return the check of values of a type."""
    plain, marks = marks_of(annotation)
    origin, parts = get_origin(plain), get_args(plain)
    if any(isinstance(mark, By) and mark.alone for mark in marks):
        check: Check = _as_given
    elif origin in (Union, UnionType):
        check = _union(parts)
    elif origin is Literal:
        check = _word(parts)
    elif origin is tuple:
        check = _list(check_of(parts[0])) if parts[1:] == (...,) else _row([check_of(part) for part in parts])
    elif origin is dict:
        check = _entries(check_of(parts[1]))
    elif plain in _PLAIN:
        check = _PLAIN[plain]
    else:
        check = plain.check
    for mark in marks:
        check = _marked(check, mark)
    return check


def _marked(check: Check, mark: object) -> Check:
    """Return a check with one mark more."""
    if isinstance(mark, Within):

        def bounded(given: Any, place: Place, faults: list[Fault]) -> Any:
            before = len(faults)
            value = check(given, place, faults)
            if len(faults) == before and (fault := mark.fault(value)):
                faults.append(Fault(*fault, place, given))
            return value

        return bounded
    if isinstance(mark, By):

        def made(given: Any, place: Place, faults: list[Fault]) -> Any:
            try:
                value = mark.function(given)
            except ValueFaultError as fault:
                faults.append(Fault(fault.kind, fault.text, place, given))
                return given
            return check(value, place, faults)

        return made
    if isinstance(mark, Also):
        return lambda given, place, faults: given if mark.accepts(given) else check(given, place, faults)
    return check


def _as_given(given: Any, place: Place, faults: list[Fault]) -> Any:
    return given


def _of_type(kind: str, fits: Callable[[Any], bool], made: Callable[[Any], object]) -> Check:
    def check(given: Any, place: Place, faults: list[Fault]) -> Any:
        if fits(given):
            return made(given)
        faults.append(Fault(f"{kind}_type", "", place, given))
        return given

    return check


#: Checks of plain types; a text of a derived class becomes a plain one.
_PLAIN: Mapping[Any, Check] = {
    Any: _as_given,
    str: _of_type("string", lambda given: isinstance(given, str), str.__str__),
    bool: _of_type("bool", lambda given: isinstance(given, bool), bool),
    int: _of_type("int", lambda given: isinstance(given, int) and not isinstance(given, bool), int),
    float: _of_type("float", lambda given: isinstance(given, int | float) and not isinstance(given, bool), float),
}


def _union(parts: Iterable[Any]) -> Check:
    """Return the check of several types: None, lists, texts, and one other type, each for values of the same kind."""
    by_kind = {_kind(part): check_of(part) for part in parts if part is not NoneType}
    other = next(iter(by_kind.values()))
    optional = NoneType in parts

    def check(given: Any, place: Place, faults: list[Fault]) -> Any:
        if given is None and optional:
            return None
        kind = tuple if isinstance(given, list | tuple) else str if isinstance(given, str) else object
        return by_kind.get(kind, by_kind.get(object, other))(given, place, faults)

    return check


def _kind(annotation: Any) -> type:
    plain = marks_of(annotation)[0]
    return tuple if get_origin(plain) is tuple else str if plain is str else object


def _word(words: tuple[Any, ...]) -> Check:
    known = {word: word for word in words}
    *most, last = map(repr, words)
    text = f"Input should be {', '.join(most)}{' or ' if most else ''}{last}"

    def check(given: Any, place: Place, faults: list[Fault]) -> Any:
        if isinstance(given, str | int | float) and given in known:
            return known[given]
        faults.append(Fault("literal_error", text, place, given))
        return given

    return check


def _list(entry: Check) -> Check:
    def check(given: Any, place: Place, faults: list[Fault]) -> Any:
        if isinstance(given, list | tuple | set | frozenset):
            return tuple([entry(part, (*place, number), faults) for number, part in enumerate(given)])
        faults.append(Fault("tuple_type", "", place, given))
        return given

    return check


def _row(entries: Iterable[Check]) -> Check:
    """Return the check of lists of a length that the mark of their type has checked."""
    entries = tuple(entries)

    def check(given: Any, place: Place, faults: list[Fault]) -> Any:
        parts = enumerate(zip(entries, given, strict=True))
        return tuple([entry(part, (*place, number), faults) for number, (entry, part) in parts])

    return check


def _entries(entry: Check) -> Check:
    def check(given: Any, place: Place, faults: list[Fault]) -> Any:
        if not isinstance(given, dict):
            faults.append(Fault("dict_type", "", place, given))
            return given
        made = {}
        for name, value in given.items():
            if not isinstance(name, str):
                faults.append(Fault("string_type", "", (*place, str(name)), name))
            made[name] = entry(value, (*place, name), faults)
        return made

    return check
