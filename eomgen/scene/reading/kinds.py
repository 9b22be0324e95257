"""Kinds of scene values: numbers, formulas, lists, inertias, rotations; each rejects other values with a message."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any, LiteralString, TypeGuard

from pydantic import BeforeValidator, Field, PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

from eomgen.base.messages import shown
from eomgen.scene.formula.scope import FIXED_PARAMETERS, TIME
from eomgen.scene.reading.key_metadata import Table, key

ORIGIN = (0.0, 0.0, 0.0)
NUMBER_SCHEMA = {"type": "number"}
VALUE_SCHEMA: dict[str, Any] = {
    "anyOf": [NUMBER_SCHEMA, {"type": "string", "description": "a formula, or a number with a unit"}]
}
QUANTITY_SCHEMA: dict[str, Any] = {
    "type": "string",
    "pattern": r"^[ \t]*[+-]?[ \t]*([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,3})?[ \t]*[A-Za-z1]",
    "description": "a number with a unit",
}
_INERTIA_KEYS = ("xx", "yy", "zz", "xy", "xz", "yz")


class FaultyText(str):
    """A text whose fault is reported already."""

    __slots__ = ()


def describe(value: object) -> str:
    kinds: tuple[tuple[type, str], ...] = ((bool, "a boolean"), (dict, "a table"), (list, "a list"), (tuple, "a list"))
    for kind, title in kinds:
        if isinstance(value, kind):
            return f"{title} ({str(value).lower()})" if kind is bool else title
    return shown(value)


def _refusal(kind: LiteralString, text: str) -> PydanticCustomError:
    """Return the error of a value that a kind of values does not take."""
    return PydanticCustomError(kind, "{text}", {"text": text})


def _number(value: object, wanted: str = "a number") -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _refusal("number", f"{wanted} is needed here, not {describe(value)} [E1475]")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise _refusal("number", f"a finite number is needed here, not {shown(value)} [E1475]")
    return number


def _value(value: object) -> float | str:
    return value if isinstance(value, str) else _number(value, "a number or a formula")


def _bound(value: object) -> float | str | None:
    """Return an end of a range, None if infinite."""
    return None if isinstance(value, float) and math.isinf(value) else _value(value)


def list_of(*lengths: int) -> Callable[[object], object]:
    """Return a validator for pydantic that returns lists of one of the given lengths as tuples, and refuses other
    values."""

    def check(value: object) -> object:
        if not isinstance(value, list | tuple) or len(value) not in lengths:
            got = f"{len(value)}" if isinstance(value, list | tuple) else describe(value)
            needed = " or ".join(str(length) for length in lengths)
            raise _refusal("list", f"a list of {needed} entries is needed here, not {got} [E1475]")
        return tuple(value)

    return check


def _as_list(value: object) -> object:
    return tuple(value) if isinstance(value, list | tuple) else (value,)


class _Once:
    """Annotation of a kind of values, whose schema is made once for all keys, since a scene has dozens of keys per
    kind.

    Annotations for the JSON Schema stand behind this one.
    """

    def __init__(self) -> None:
        self.made: dict[str, Any] = {}

    def __get_pydantic_core_schema__(self, source: object, handler: Callable[[object], Any]) -> Any:
        self.made = self.made or handler(source)
        return {**self.made, "metadata": dict(self.made.get("metadata", {}))}  # which pydantic adds to for a key


Description = Annotated[str, Field(max_length=10_000)]
Unit = Annotated[str, Field(max_length=64)]
Finite = Annotated[float, PlainValidator(_number), _Once(), WithJsonSchema(NUMBER_SCHEMA)]
Value = Annotated[float | str, PlainValidator(_value), _Once(), WithJsonSchema(VALUE_SCHEMA)]
Triple = Annotated[tuple[Value, Value, Value], BeforeValidator(list_of(3)), _Once()]
Pair = Annotated[tuple[Value, Value], BeforeValidator(list_of(2)), _Once()]
Values = Annotated[
    tuple[Value, ...],
    BeforeValidator(_as_list),
    _Once(),
    WithJsonSchema({"anyOf": [*VALUE_SCHEMA["anyOf"], {"type": "array", "items": VALUE_SCHEMA}]}),
]
Numbers = Annotated[
    tuple[Finite, ...],
    BeforeValidator(_as_list),
    _Once(),
    WithJsonSchema({"anyOf": [NUMBER_SCHEMA, {"type": "array", "items": NUMBER_SCHEMA}]}),
]
NumberPair = Annotated[tuple[Finite, Finite], BeforeValidator(list_of(2))]
Bound = Annotated[float | str | None, PlainValidator(_bound), WithJsonSchema(VALUE_SCHEMA)]
Bounds = Annotated[
    tuple[Bound, ...],
    BeforeValidator(_as_list),
    _Once(),
    WithJsonSchema({"anyOf": [*VALUE_SCHEMA["anyOf"], {"type": "array", "items": VALUE_SCHEMA}]}),
]
Row = Annotated[tuple[Finite, Finite, Finite], BeforeValidator(list_of(3))]
Matrix = Annotated[tuple[Row, Row, Row], BeforeValidator(list_of(3)), _Once()]
LongRow = Annotated[tuple[Finite, Finite, Finite, Finite, Finite, Finite], BeforeValidator(list_of(6))]
SixBySix = Annotated[tuple[LongRow, LongRow, LongRow, LongRow, LongRow, LongRow], BeforeValidator(list_of(6))]
SixValues = Annotated[tuple[Value, Value, Value, Value, Value, Value], BeforeValidator(list_of(6))]
SixBySixValues = Annotated[
    tuple[SixValues, SixValues, SixValues, SixValues, SixValues, SixValues], BeforeValidator(list_of(6))
]


def _inertia(value: object) -> object:
    """Return an inertia as the tuple (xx, yy, zz, xy, xz, yz), from 3 moments, 6 entries, a table or a symmetric 3x3
    matrix; raise PydanticCustomError for any other value. Entries may be numbers or formulas."""
    if isinstance(value, Mapping):
        unknown = [str(key) for key in value if key not in _INERTIA_KEYS]
        missing = [key for key in _INERTIA_KEYS[:3] if key not in value]
        if unknown or missing:
            fault = f"{shown(unknown[0])} is unknown" if unknown else f"{missing[0]} is missing"
            text = f"an inertia table has the keys xx yy zz, and xy xz yz where needed: {fault} [E2228]"
            raise _refusal("inertia", text)
        return tuple(value.get(key, 0.0) for key in _INERTIA_KEYS)
    if isinstance(value, list | tuple):
        if len(value) == 3 and all(isinstance(row, list | tuple) and len(row) == 3 for row in value):
            for row, column in ((0, 1), (0, 2), (1, 2)):
                if not _same(value[row][column], value[column][row]):
                    text = f"the inertia matrix is not symmetric in [{row}][{column}] and [{column}][{row}] [E2229]"
                    raise _refusal("inertia", text)
            return value[0][0], value[1][1], value[2][2], value[0][1], value[0][2], value[1][2]
        if len(value) == 3:
            return (*value, 0.0, 0.0, 0.0)
        if len(value) == 6:
            return tuple(value)
    text = "an inertia is needed here: [xx, yy, zz], [xx, yy, zz, xy, xz, yz], a table or a 3x3 matrix [E2230]"
    raise _refusal("inertia", text)


def _same(first: object, second: object) -> bool:
    if isinstance(first, int | float) and isinstance(second, int | float):
        return math.isclose(first, second, rel_tol=1e-9, abs_tol=1e-12)
    return first == second


def _array_schema(length: int, items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items, "minItems": length, "maxItems": length}


Inertia = Annotated[
    tuple[Value, Value, Value, Value, Value, Value],
    BeforeValidator(_inertia),
    WithJsonSchema(
        {
            "anyOf": [
                _array_schema(3, VALUE_SCHEMA),
                _array_schema(6, VALUE_SCHEMA),
                {
                    "type": "object",
                    "properties": dict.fromkeys(_INERTIA_KEYS, VALUE_SCHEMA),
                    "required": ["xx", "yy", "zz"],
                    "additionalProperties": False,
                },
                _array_schema(3, _array_schema(3, VALUE_SCHEMA)),
            ]
        }
    ),
]


class RotationEntry(Table):
    """A rotation by an angle about an axis."""

    axis: Triple = key("axis of any length", names=FIXED_PARAMETERS)
    angle: Value = key(
        "angle: a formula of time for the base, else of fixed parameters", unit="rad", names=TIME, kind="value, rad"
    )


def is_plain_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a number, and no integer of a file that is too large for a number of the machine."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def plain_angles(value: object) -> TypeGuard[list[float]]:
    """Return whether a value in place of rotations is three numbers, such as roll, pitch and yaw."""
    return isinstance(value, list | tuple) and len(value) == 3 and all(map(is_plain_number, value))


def is_matrix(value: object) -> bool:
    """Return whether a value in place of rotations is three rows of three numbers."""
    return isinstance(value, list | tuple) and len(value) == 3 and all(plain_angles(row) for row in value)


def _rotations(value: object) -> object:
    if plain_angles(value):
        fault = "angles alone say no axes and no order: a table is needed for each [E2231]"
        raise PydanticCustomError("rotations", fault)
    if is_matrix(value):
        raise PydanticCustomError("rotations", "this is a matrix, and a list of turns about axes is needed [E2232]")
    return value


Rotations = Annotated[tuple[RotationEntry, ...], Field(strict=False), BeforeValidator(_rotations)]
