"""The shape of a scene file, as pydantic models: which keys exist and what kind of value each takes.

What needs more than one key to judge is in ``checks``.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationError,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from eomgen.scene.names import key_of, nearest, shown
from eomgen.scene.report import Report
from eomgen.scene.scene import TERMS

_NUMBER_SCHEMA = {"type": "number"}
_VALUE_SCHEMA: dict[str, Any] = {"anyOf": [_NUMBER_SCHEMA, {"type": "string", "description": "a formula"}]}
_INERTIA_KEYS = ("xx", "yy", "zz", "xy", "xz", "yz")
SECTIONS = ("parameters", "inputs", "bodies", "joints", "points", "springs", "torsion_springs", "forces", "efforts", "outputs")


def _described(value: object) -> str:
    kinds: tuple[tuple[type, str], ...] = ((bool, "a boolean"), (dict, "a table"), (list, "a list"), (tuple, "a list"))
    for kind, title in kinds:
        if isinstance(value, kind):
            return f"{title} ({str(value).lower()})" if kind is bool else title
    return shown(value)


def _number(value: object, wanted: str = "a number") -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise PydanticCustomError("number", "{text}", {"text": f"{wanted} is needed here, not {_described(value)}"})
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise PydanticCustomError("number", "{text}", {"text": f"a finite number is needed here, not {shown(value)}"})
    return number


def _value(value: object) -> float | str:
    return value if isinstance(value, str) else _number(value, "a number or a formula")


def _list_of(*lengths: int) -> Callable[[object], object]:
    """Return a validator that takes lists of one of the given lengths."""

    def check(value: object) -> object:
        if not isinstance(value, list | tuple) or len(value) not in lengths:
            got = f"{len(value)}" if isinstance(value, list | tuple) else _described(value)
            needed = " or ".join(str(length) for length in lengths)
            raise PydanticCustomError("list", "{text}", {"text": f"a list of {needed} entries is needed here, not {got}"})
        return tuple(value)

    return check


def _as_list(value: object) -> object:
    return tuple(value) if isinstance(value, list | tuple) else (value,)


Finite = Annotated[float, PlainValidator(_number), WithJsonSchema(_NUMBER_SCHEMA)]
Value = Annotated[float | str, PlainValidator(_value), WithJsonSchema(_VALUE_SCHEMA)]
Triple = Annotated[tuple[Value, Value, Value], BeforeValidator(_list_of(3))]
Values = Annotated[
    tuple[Value, ...],
    BeforeValidator(_as_list),
    WithJsonSchema({"anyOf": [*_VALUE_SCHEMA["anyOf"], {"type": "array", "items": _VALUE_SCHEMA}]}),
]
Row = Annotated[tuple[Finite, Finite, Finite], BeforeValidator(_list_of(3))]
Matrix = Annotated[tuple[Row, Row, Row], BeforeValidator(_list_of(3))]


def _inertia(value: object) -> object:
    """Bring the four ways to write an inertia to (xx, yy, zz, xy, xz, yz)."""
    if isinstance(value, Mapping):
        unknown = [str(key) for key in value if key not in _INERTIA_KEYS]
        missing = [key for key in _INERTIA_KEYS[:3] if key not in value]
        if unknown or missing:
            fault = f"{shown(unknown[0])} is unknown" if unknown else f"{missing[0]} is missing"
            text = f"an inertia table has the keys xx yy zz, and xy xz yz where needed: {fault}"
            raise PydanticCustomError("inertia", "{text}", {"text": text})
        return tuple(value.get(key, 0.0) for key in _INERTIA_KEYS)
    if isinstance(value, list | tuple):
        if len(value) == 3 and all(isinstance(row, list | tuple) and len(row) == 3 for row in value):
            for row, column in ((0, 1), (0, 2), (1, 2)):
                if not _same(value[row][column], value[column][row]):
                    text = f"the inertia matrix is not symmetric: entry [{row}][{column}] differs from [{column}][{row}]"
                    raise PydanticCustomError("inertia", "{text}", {"text": text})
            return value[0][0], value[1][1], value[2][2], value[0][1], value[0][2], value[1][2]
        if len(value) == 3:
            return (*value, 0.0, 0.0, 0.0)
        if len(value) == 6:
            return tuple(value)
    text = "an inertia is needed here: [xx, yy, zz], [xx, yy, zz, xy, xz, yz], a table or a 3x3 matrix"
    raise PydanticCustomError("inertia", "{text}", {"text": text})


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
                _array_schema(3, _VALUE_SCHEMA),
                _array_schema(6, _VALUE_SCHEMA),
                {
                    "type": "object",
                    "properties": dict.fromkeys(_INERTIA_KEYS, _VALUE_SCHEMA),
                    "required": ["xx", "yy", "zz"],
                    "additionalProperties": False,
                },
                _array_schema(3, _array_schema(3, _VALUE_SCHEMA)),
            ]
        }
    ),
]


class Table(BaseModel):
    """A table with known keys only."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Parameter(Table):
    value: Finite
    tunable: bool = False
    unit: str = ""
    description: str = ""

    @model_validator(mode="before")
    @classmethod
    def _from_number(cls, data: object) -> object:
        return data if isinstance(data, Mapping) else {"value": data}


class Input(Table):
    formula: Value | None = None
    unit: str = ""
    description: str = ""


class Rotation(Table):
    axis: Triple
    angle: Value


Rotations = Annotated[tuple[Rotation, ...], Field(strict=False)]


class Base(Table):
    position: Triple = (0.0, 0.0, 0.0)
    rotation: Rotations = ()


class Body(Table):
    mass: Value
    center_of_mass: Triple = (0.0, 0.0, 0.0)
    inertia: Inertia = (0.0,) * 6


class Initial(Table):
    position: Values | None = None
    orientation: Values | None = None
    rotation: Rotations | None = None
    velocity: Values | None = None


class Joint(Table):
    type: Literal["fixed", "revolute", "prismatic", "spherical", "free"]
    parent: str
    child: str
    position: Triple = (0.0, 0.0, 0.0)
    rotation: Rotations | None = None
    orientation: Matrix | None = None
    axis: Triple | None = None
    stiffness: Value | None = None
    damping: Value | None = None
    rest: Value | None = None
    rotor_inertia: Value | None = None
    initial: Initial = Initial()


class Point(Table):
    body: str
    position: Triple = (0.0, 0.0, 0.0)


class Spring(Table):
    first: str
    second: str
    stiffness: Value = 0.0
    damping: Value = 0.0
    length: Value = 0.0
    force: Value = 0.0


class TorsionSpring(Table):
    first: str
    second: str = ""
    stiffness: Value = 0.0
    damping: Value = 0.0
    rest: Value = 0.0


class Force(Table):
    body: str
    point: Triple = (0.0, 0.0, 0.0)
    force: Triple = (0.0, 0.0, 0.0)
    torque: Triple = (0.0, 0.0, 0.0)
    axes: Literal["world", "body"] = "world"


class Effort(Table):
    joint: str
    effort: Value
    index: Annotated[int, Field(ge=0)] = 0


class Output(Table):
    position: str | None = None
    velocity: str | None = None
    acceleration: str | None = None
    formula: Values | None = None
    energy: str | None = None
    unit: str = ""
    description: str = ""


class Simulation(Table):
    method: str = "generalized_alpha"
    step: Finite = 1e-3
    duration: Finite = 10.0
    rho_inf: Finite = 0.8
    record_every: Annotated[int, Field(ge=1)] = 1


class Document(Table):
    """A scene file of eomgen."""

    format: Literal[1]
    name: str
    description: str = ""
    gravity: Triple = (0.0, 0.0, -9.81)
    terms: Annotated[tuple[Literal[TERMS], ...], Field(strict=False)] = ()  # type: ignore[valid-type]
    parameters: dict[str, Parameter] = {}
    inputs: dict[str, Input] = {}
    base: Base | None = None
    bodies: dict[str, Body] = {}
    joints: dict[str, Joint] = {}
    points: dict[str, Point] = {}
    springs: dict[str, Spring] = {}
    torsion_springs: dict[str, TorsionSpring] = {}
    forces: dict[str, Force] = {}
    efforts: dict[str, Effort] = {}
    outputs: dict[str, Output] = {}
    simulation: Simulation = Simulation()


def schema() -> dict[str, Any]:
    """Return the JSON Schema of scene files."""
    description = Document.model_json_schema()
    parameter = description["$defs"]["Parameter"]
    description["$defs"]["Parameter"] = {"anyOf": [_NUMBER_SCHEMA, parameter]}
    return description


def json_schema() -> str:
    """Return the JSON Schema of scene files as text."""
    return json.dumps(schema(), indent=2) + "\n"


def read_document(data: Mapping[str, Any], report: Report) -> tuple[Document, dict[str, set[str]]]:
    """Bring nested data to a Document; what cannot be taken is reported and left out.

    Returns
    -------
    document : Document
        Of the entries that are well formed.
    refused : dict
        For each section, the names of the entries left out: they exist, and are not to be reported as unknown.
    """
    refused: dict[str, set[str]] = {section: set() for section in SECTIONS}
    kept = dict(data)
    try:
        return Document.model_validate(kept), refused
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            location = tuple(part for part in detail["loc"] if isinstance(part, str | int))
            what, hint = _explained(detail["type"], detail["msg"], location, detail.get("input"))
            report.add(key_of(*location), what, hint)
            section = str(location[0])
            if section in SECTIONS and len(location) > 1 and isinstance(kept.get(section), Mapping):
                refused[section].add(str(location[1]))
                kept[section] = {name: entry for name, entry in kept[section].items() if name != location[1]}
            elif section in kept:
                refused.get(section, set()).add("")
                del kept[section]
    return Document.model_validate({"format": 1, "name": "scene", **kept}), refused


def _explained(kind: str, message: str, location: tuple[str | int, ...], given: object) -> tuple[str, str]:
    """Return what pydantic found, in the words of the scene file, and a hint."""
    last = str(location[-1])
    if kind == "extra_forbidden":
        return f"the key {shown(last)} is unknown here", nearest(last, _keys_at(location[:-1]))
    if kind == "missing":
        return f"the key {last} is missing", f"{last} = {'1' if last == 'format' else '...'}"
    if kind == "literal_error":
        expected = message.removeprefix("Input should be ").replace("'", "")
        return f"{_described(given)} is not known here", f"one of {expected}"
    plain = {"string_type": "a text", "bool_type": "true or false", "int_type": "a whole number", "dict_type": "a table"}
    plain |= {"model_type": "a table", "tuple_type": "a list", "int_from_float": "a whole number"}
    if kind in plain:
        return f"{plain[kind]} is needed here, not {_described(given)}", ""
    return message[0].lower() + message[1:], ""


def _keys_at(location: tuple[str | int, ...]) -> list[str]:
    """Return the keys that the schema knows at a place."""
    model: Any = Document
    for part in location:
        if isinstance(model, type) and issubclass(model, BaseModel) and part in model.model_fields:
            model = model.model_fields[str(part)].annotation
            while not isinstance(model, type) or not issubclass(model, BaseModel):
                candidates = [candidate for candidate in get_args(model) if candidate is not type(None) and candidate is not str]
                if not candidates:
                    return []
                model = candidates[-1] if candidates[-1] is not Ellipsis else candidates[0]
    return list(model.model_fields)
