"""The shape of a scene file, as pydantic models: which keys exist, what kind of value each takes and what it means.

What needs more than one key to judge is in ``checks``; the tables of ``docs/scene.md`` are made from here by ``reference``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, model_validator

from eomgen.scene.constraint import ConstraintType
from eomgen.scene.formula_scope import EVERYTHING, FIXED_PARAMETERS, PARAMETERS, SPRING_FORCE, STATE, TIME
from eomgen.scene.scene import TERMS, JointType
from eomgen.scene.schema_beams import Beam
from eomgen.scene.schema_control import Controller, State
from eomgen.scene.schema_forces import Bushing, Friction, Limits, Tyre
from eomgen.scene.schema_include import Include
from eomgen.scene.schema_key import ANY_UNIT, Meaning, Table, every_unit, fields_of, key, tables_of
from eomgen.scene.schema_places import Frame, Rotations, by_coordinate
from eomgen.scene.schema_signals import Curve, Input
from eomgen.scene.schema_values import (
    NUMBER_SCHEMA,
    QUANTITY_SCHEMA,
    Description,
    Finite,
    Inertia,
    Matrix,
    Triple,
    Unit,
    Value,
    Values,
)

ORIGIN = (0.0, 0.0, 0.0)
SECTIONS = (
    "parameters",
    "curves",
    "inputs",
    "states",
    "controllers",
    "bodies",
    "beams",
    "joints",
    "constraints",
    "points",
    "springs",
    "torsion_springs",
    "bushings",
    "tyres",
    "forces",
    "efforts",
    "outputs",
)


class Parameter(Table):
    """A named number."""

    value: Finite = key("no formula", unit=ANY_UNIT)
    tunable: bool = key("can be changed at every call without compiling again", False)
    unit: Unit = key("label", "")
    description: Description = key("for tables", "")

    @model_validator(mode="before")
    @classmethod
    def _from_number(cls, data: object) -> object:
        return data if isinstance(data, Mapping) else {"value": data}




class Base(Table):
    """The prescribed motion of the frame that carries the tree."""

    position: Triple = key("of the base's origin, in world axes", ORIGIN, unit="m", names=TIME)
    rotation: Rotations = key("intrinsic rotations in order", ())


class Body(Table):
    """A rigid body."""

    mass: Value = key("0 is allowed where the body carries others that have mass", unit="kg", names=PARAMETERS)
    center_of_mass: Triple = key("in the body's frame", ORIGIN, unit="m", names=PARAMETERS)
    inertia: Inertia = key(
        "**about the centre of mass**, in the body's axes",
        (0.0,) * 6,
        unit="kg m^2",
        names=PARAMETERS,
        kind="see below, kg m²",
        shown_default="zero, a point mass",
    )
    group: Literal["SE3", "R3xSO3"] | None = key(
        "for [absolute coordinates](#absolute-coordinates) only", None, shown_default="`SE3`"
    )


_COORDINATE = {**by_coordinate("rad", "m"), "free": "m"}


class Initial(Table):
    """The state of a joint at the start."""

    position: Values | None = key(
        "the coordinates, angles first; spherical: quaternion, 4 values; free: position of the child's frame, 3 values",
        None,
        unit=_COORDINATE,
        names=FIXED_PARAMETERS,
        shown_default="zeros",
    )
    orientation: Values | None = key(
        "free: quaternion, 4 values",
        None,
        names=FIXED_PARAMETERS,
        kind="4 values of fixed parameters",
        shown_default="not turned",
    )
    rotation: Rotations | None = key("spherical, free: in place of a quaternion", None)
    velocity: Values | None = key(
        "1 to 3, or 6 values; angular first, body axes where the joint is spherical or free",
        None,
        unit={
            **by_coordinate("rad/s", "m/s"),
            "spherical": "rad/s",
            "free": ("rad/s", "rad/s", "rad/s", "m/s", "m/s", "m/s"),
        },
        names=FIXED_PARAMETERS,
        shown_default="zeros",
    )


class Mimic(Table):
    """A coordinate that follows another: multiplier q_leader + offset."""

    joint: str = key("the leader, with one coordinate; it may follow another in its turn", refers="joints")
    multiplier: Value = key("coordinate per coordinate of the leader", 1.0, names=PARAMETERS)
    offset: Value = key("coordinate where the leader's is zero", 0.0, unit=by_coordinate("rad", "m"), names=PARAMETERS)


class Joint(Table):
    """What carries a body, and lets it move against its parent."""

    type: JointType = key("how the child moves against the parent")
    parent: str = key("where it hangs", refers="bodies", kind="body, or `base`")
    child: str = key("the body that this joint carries", refers="bodies")
    position: Triple = key("origin of the child's frame in the parent's frame", ORIGIN, unit="m", names=PARAMETERS)
    rotation: Rotations | None = key("axes of the child in the parent, angles of fixed parameters", None, shown_default="`[]`")
    orientation: Matrix | None = key("the same as a matrix, child axes to parent axes; either this or `rotation`", None)
    axis: Triple | None = key(
        "in the child's axes; any length; the normal of a planar joint, the first axis of a universal one",
        None,
        names=FIXED_PARAMETERS,
        shown_default="required, but for fixed, spherical and free",
    )
    second_axis: Triple | None = key(
        "of a universal joint: the second axis, across the first, in the child's axes",
        None,
        names=FIXED_PARAMETERS,
        shown_default="required for universal",
    )
    x_axis: Triple | None = key(
        "of a planar joint: x is along the part of it in the plane, y to the left of x",
        None,
        names=FIXED_PARAMETERS,
        shown_default="coordinate axis farthest from `axis`",
    )
    pitch: Value | None = key(
        "of a helical joint: travel per radian; negative is left-handed",
        None,
        unit="m/rad",
        names=PARAMETERS,
        shown_default="required for helical",
    )
    stiffness: Values | None = key(
        "of a spring in the joint",
        None,
        unit=by_coordinate("N m/rad", "N/m"),
        names=PARAMETERS,
        shown_default="`0`",
    )
    damping: Values | None = key(
        "of a damper in the joint",
        None,
        unit=by_coordinate("N m s/rad", "N s/m"),
        names=PARAMETERS,
        shown_default="`0`",
    )
    rest: Values | None = key(
        "coordinate at which the spring is slack",
        None,
        unit=by_coordinate("rad", "m"),
        names=PARAMETERS,
        shown_default="`0`",
    )
    rotor_inertia: Values | None = key(
        "added to this joint's diagonal of M (a motor behind a gear)",
        None,
        unit=by_coordinate("kg m^2", "kg"),
        names=PARAMETERS,
        shown_default="`0`",
    )
    limits: Limits | None = key("compliant stops", None, kind="table, below")
    friction: Friction | None = key("dry friction", None, kind="table, below")
    mimic: Mimic | None = key("what the coordinate follows, in place of being free", None, kind="table, below")
    initial: Initial = key("state at the start", Initial(), shown_default="zeros")


class Constraint(Table):
    """What closes a loop between two frames."""

    type: ConstraintType = key("what it holds", kind="see below")
    first: Frame = key("a frame in one body", kind="frame, below")
    second: Frame = key("a frame in another, that can move against the first", kind="frame, below")
    drive: Value | None = key(
        "prescribes the angle of `revolute`, or the travel of `prismatic` and `cylindrical`",
        None,
        unit={"revolute": "rad", "prismatic": "m", "cylindrical": "m"},
        names=TIME,
    )
    length: Value | None = key("between the origins", None, unit="m", names=PARAMETERS, shown_default="required for `distance`")
    radius: Value | None = key(
        "of the disc or sphere", None, unit="m", names=PARAMETERS, shown_default="required for `rolling`"
    )
    shape: Literal["disc", "sphere"] | None = key("for `rolling`", None, shown_default="`disc`")
    pitch: Value | None = key(
        "travel per radian", None, unit="m/rad", names=PARAMETERS, shown_default="required for `helical`"
    )


class Point(Table):
    """A point fixed in a body, in the base or in the world."""

    body: str = key("what carries it", refers="bodies", kind="body, `base` or `world`")
    position: Triple = key("in the body's frame", ORIGIN, unit="m", names=PARAMETERS)


class Spring(Table):
    """A spring, damper or actuator along the line between two points."""

    first: str = key("one end", refers="points")
    second: str = key("the other end", refers="points")
    stiffness: Value = key("tension by length beyond `length`", 0.0, unit="N/m", names=PARAMETERS)
    damping: Value = key("tension by rate of length", 0.0, unit="N s/m", names=PARAMETERS)
    length: Value = key("length at which the spring is slack", 0.0, unit="m", names=PARAMETERS)
    force: Value = key("an actuator in parallel", 0.0, unit="N", names=SPRING_FORCE)


class TorsionSpring(Table):
    """A spring and damper between the angles of two joints."""

    first: str = key("one angle", refers="joints", kind="joint that has an angle")
    second: str = key("the other angle", "", refers="joints", kind="joint that has an angle", shown_default='`""`, none')
    stiffness: Value = key("effort by angle", 0.0, unit="N m/rad", names=PARAMETERS)
    damping: Value = key("effort by rate", 0.0, unit="N m s/rad", names=PARAMETERS)
    rest: Value = key("difference of the angles at which the spring is slack", 0.0, unit="rad", names=PARAMETERS)
    first_index: int = key("of the angle where a joint has two, as a universal one", 0, ge=0, le=1)
    second_index: int = key("the same of the second", 0, ge=0, le=1)


class Force(Table):
    """A force and a torque on a body."""

    body: str = key("what they act on", refers="bodies", kind="body, not the base")
    point: Triple = key("where the force acts, in the body's frame", ORIGIN, unit="m", names=PARAMETERS)
    force: Triple = key("through the point", ORIGIN, unit="N", names=STATE)
    torque: Triple = key("beside the force's own moment", ORIGIN, unit="N m", names=STATE)
    axes: Literal["world", "body"] = key("axes of force and torque", "world")


class Effort(Table):
    """A generalized force on one component of a joint."""

    joint: str = key("what it drives", refers="joints")
    effort: Value = key(
        "positive drives the coordinate up",
        unit={
            "revolute": "N m",
            "prismatic": "N",
            "spherical": "N m",
            "free": ("N m", "N m", "N m", "N", "N", "N"),
        },
        names=STATE,
    )
    index: Annotated[int, Field(ge=0, le=5)] = key(
        "component of the joint's velocity, angular ones first", 0
    )


class Output(Table):
    """A named quantity that is recorded along a run."""

    position: str | None = key("3 components in world axes", None, refers="points")
    velocity: str | None = key("3 components in world axes", None, refers="points")
    acceleration: str | None = key("3 components in world axes", None, refers="points")
    formula: Values | None = key("one component or several", None, names=EVERYTHING)
    energy: str | None = key(
        "J, or W for the powers", None, kind="`kinetic`, `potential`, `total`, `power`, `base_power`"
    )
    unit: Unit = key("label", "", shown_default="m, m/s, m/s², J or W where the kind of output says it")
    description: Description = key("title of its panel in the plot, or in the legend where it shares one", "")


class Simulation(Table):
    """What ``simulate`` does when it is not told otherwise."""

    method: str = key("see below", "generalized_alpha", kind="name")
    step: Finite = key("fixed step", 1e-3, unit="s", shown_default="`1e-3`")
    duration: Finite = key("of the run", 10.0, unit="s")
    rho_inf: Finite = key("numerical damping of generalized-alpha at high frequencies; 1 has none", 0.8, kind="0 to 1")
    alpha: Finite | None = key("the same for `hht`, `wbz` and `newmark`, in place of `rho_inf`", None, kind="0 to 1")
    beta: Finite | None = key("of `newmark`", None, kind="number", shown_default="0.25")
    gamma: Finite | None = key("of `newmark`", None, kind="number", shown_default="0.5")
    tolerance: Finite | None = key("of local errors of `taylor`; 0: fixed steps", None, kind="0 to 0.1", shown_default="`1e-12`")
    order: Annotated[int, Field(ge=2, le=40)] | None = key(
        "of `taylor`", None, kind="whole number, 2 to 40", shown_default="what suits the tolerance"
    )
    record_every: Annotated[int, Field(ge=1, le=1_000_000_000)] = key(
        "steps between recorded rows", 1, kind="whole number from 1"
    )
    start: Literal["initial", "equilibrium"] = key(
        "the joints' initial state, or static equilibrium near it, with their velocities", "initial"
    )


class Document(Table, BaseModel):  # the linter knows the children of BaseModel only where it is named
    """A scene file of eomgen."""

    format: Literal[1] = key("version of this format", kind="1")
    name: str = key("name of the scene and prefix of its C functions", kind="name")
    description: Description = key("one line for tables and plots", "")
    gravity: Triple = key("in world axes", (0.0, 0.0, -9.81), unit="m/s^2", names=PARAMETERS)
    coordinates: Literal["joint", "absolute"] = key("see [absolute coordinates](#absolute-coordinates)", "joint")
    terms: Annotated[tuple[Literal[TERMS], ...], Field(strict=False)] = key(  # type: ignore[valid-type]
        "functions wanted; empty means all that the scene can use, see [terms](#terms)", (), kind="list of names"
    )
    include: dict[str, Include] = {}
    parameters: dict[str, Parameter] = {}
    curves: dict[str, Curve] = {}
    inputs: dict[str, Input] = {}
    states: dict[str, State] = {}
    controllers: dict[str, Controller] = {}
    base: Base | None = None
    bodies: dict[str, Body] = {}
    beams: dict[str, Beam] = {}
    joints: dict[str, Joint] = {}
    constraints: dict[str, Constraint] = {}
    points: dict[str, Point] = {}
    springs: dict[str, Spring] = {}
    torsion_springs: dict[str, TorsionSpring] = {}
    bushings: dict[str, Bushing] = {}
    tyres: dict[str, Tyre] = {}
    forces: dict[str, Force] = {}
    efforts: dict[str, Effort] = {}
    outputs: dict[str, Output] = {}
    simulation: Simulation = Simulation()


def schema() -> dict[str, Any]:
    """Return the JSON Schema of scene files; ``x-unit`` and ``x-names`` say the unit of a key and the scope of its formulas.

    It holds what draft 4 and later ones read alike, because that is what editors of TOML know.
    """
    description = Document.model_json_schema()
    definitions = description["$defs"]
    for name, model in tables_of(Document).items():
        properties = definitions.get(name, description)["properties"]  # the document itself is no definition
        for key_name, (meaning, _) in fields_of(model).items():
            _annotate(properties[key_name], meaning)
    definitions["Parameter"] = {"anyOf": [NUMBER_SCHEMA, QUANTITY_SCHEMA, definitions["Parameter"]]}
    point = {"type": "string", "description": "the name of a point"}
    definitions["Frame"] = {"anyOf": [point, definitions["Frame"]]}
    return {"$schema": "http://json-schema.org/draft-04/schema#", **_of_every_draft(description)}


def _of_every_draft(node: Any) -> Any:
    """Return a JSON Schema without the keywords that came after draft 4, which others can say."""
    if isinstance(node, list):
        return [_of_every_draft(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    node = {key_name: _of_every_draft(entry) for key_name, entry in node.items()}
    if "prefixItems" in node:
        node["items"] = node.pop("prefixItems")[0]  # lists of a length are lists of one kind here
    if "const" in node:
        node["enum"] = [node.pop("const")]
    return node


def _annotate(entry: dict[str, Any], meaning: Meaning) -> None:
    """Add to the JSON Schema of a key what its meaning says."""
    units = every_unit(meaning)
    if units:
        entry["x-unit"] = " or ".join(units)
        entry["description"] += f" ({entry['x-unit']})"
    if units and entry.get("type") == "number":
        entry.pop("type")
        entry["anyOf"] = [NUMBER_SCHEMA, QUANTITY_SCHEMA]
    if meaning.names is not None:
        entry["x-names"] = meaning.names.description


def json_schema() -> str:
    """Return the JSON Schema of scene files as text."""
    return json.dumps(schema(), indent=2) + "\n"
