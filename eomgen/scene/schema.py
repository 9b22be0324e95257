"""The shape of a scene file, as pydantic models: which keys exist and what kind of value each takes.

What needs more than one key to judge is in ``checks``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from eomgen.scene.constraint import ConstraintType
from eomgen.scene.scene import TERMS
from eomgen.scene.schema_values import NUMBER_SCHEMA, Finite, Inertia, Matrix, Triple, Value, Values

Description = Annotated[str, Field(max_length=10_000)]
Unit = Annotated[str, Field(max_length=64)]
SECTIONS = (
    "parameters",
    "inputs",
    "bodies",
    "joints",
    "constraints",
    "points",
    "springs",
    "torsion_springs",
    "forces",
    "efforts",
    "outputs",
)


class Table(BaseModel):
    """A table with known keys only."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Parameter(Table):
    value: Finite
    tunable: bool = False
    unit: Unit = ""
    description: Description = ""

    @model_validator(mode="before")
    @classmethod
    def _from_number(cls, data: object) -> object:
        return data if isinstance(data, Mapping) else {"value": data}


class Road(Table):
    road_class: Annotated[Literal["A", "B", "C", "D", "E", "F", "G", "H"], Field(alias="class")]
    speed: Value
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    offset: Value = 0.0
    harmonics: Annotated[int, Field(ge=1, le=2000)] = 200


class Input(Table):
    formula: Value | None = None
    road: Road | None = None
    unit: Unit = ""
    description: Description = ""


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
    group: Literal["SE3", "R3xSO3"] | None = None


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


class Frame(Table):
    body: str | None = None
    point: str | None = None
    position: Triple | None = None
    rotation: Rotations | None = None
    axis: Triple | None = None
    x_axis: Triple | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_point(cls, data: object) -> object:
        return {"point": data} if isinstance(data, str) else data


class Constraint(Table):
    type: ConstraintType
    first: Frame
    second: Frame
    drive: Value | None = None
    length: Value | None = None
    radius: Value | None = None
    shape: Literal["disc", "sphere"] | None = None


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
    index: Annotated[int, Field(ge=0, le=5)] = 0


class Output(Table):
    position: str | None = None
    velocity: str | None = None
    acceleration: str | None = None
    formula: Values | None = None
    energy: str | None = None
    unit: Unit = ""
    description: Description = ""


class Simulation(Table):
    method: str = "generalized_alpha"
    step: Finite = 1e-3
    duration: Finite = 10.0
    rho_inf: Finite = 0.8
    record_every: Annotated[int, Field(ge=1, le=1_000_000_000)] = 1


class Document(Table):
    """A scene file of eomgen."""

    format: Literal[1]
    name: str
    description: Description = ""
    gravity: Triple = (0.0, 0.0, -9.81)
    coordinates: Literal["joint", "absolute"] = "joint"
    terms: Annotated[tuple[Literal[TERMS], ...], Field(strict=False)] = ()  # type: ignore[valid-type]
    parameters: dict[str, Parameter] = {}
    inputs: dict[str, Input] = {}
    base: Base | None = None
    bodies: dict[str, Body] = {}
    joints: dict[str, Joint] = {}
    constraints: dict[str, Constraint] = {}
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
    definitions = description["$defs"]
    definitions["Parameter"] = {"anyOf": [NUMBER_SCHEMA, definitions["Parameter"]]}
    point = {"type": "string", "description": "the name of a point"}
    definitions["Frame"] = {"anyOf": [point, definitions["Frame"]]}
    return description


def json_schema() -> str:
    """Return the JSON Schema of scene files as text."""
    return json.dumps(schema(), indent=2) + "\n"
