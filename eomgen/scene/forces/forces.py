"""Forces in scene files, keys and data: forces and torques on bodies, and efforts (generalized forces) on components of
joints, by formulas."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from eomgen.base.data import dataclass, replace
from eomgen.base.messages import key_of
from eomgen.formula.nodes import Formula, LoadSymbol, Symbol, Vector
from eomgen.formula.substitution import map_symbols
from eomgen.scene.forces.element import Attach, ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.formula.scope import LOAD, LOCAL_LOAD, PARAMETERS
from eomgen.scene.joint_types import JOINTS, by_component
from eomgen.scene.joints.frames import Site
from eomgen.scene.reading.key_metadata import Table, given_in, key
from eomgen.scene.reading.kinds import ORIGIN, Triple, Value
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.values import read_placement
from eomgen.scene.rotations import rows
from eomgen.system.description import BASE, WORLD


class ForceEntry(Table):
    """A force and a torque on a body."""

    body: str = key("the loaded body", refers="bodies", kind="body, not the base")
    point: Triple = key("point of the force, in the body's frame", ORIGIN, unit="m", names=PARAMETERS)
    force: Triple = key("force through the point", ORIGIN, unit="N", names=LOCAL_LOAD)
    torque: Triple = key("couple, added to the moment of the force", ORIGIN, unit="N m", names=LOCAL_LOAD)
    axes: Literal["world", "body"] = key("axes of force and torque", "world")
    given_in: str | None = given_in("the point, not the force, is given")


@dataclass(frozen=True)
class Force(ForceElement):
    """Force and torque on a body at a point, formulas of everything but accelerations, in world or body axes; the point
    is in the body's frame, m, as formulas of parameters."""

    section: ClassVar[str] = "forces"
    law: ClassVar[str] = "eomgen.mechanics.forces.forces:LAW"

    body: str
    point: Vector  # body frame, formulas of parameters
    force: Vector
    torque: Vector
    axes: Literal["world", "body"] = "world"

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        yield from ((map_symbols(formula, self._load_symbol), 0) for formula in (*self.force, *self.torque))

    def _load_symbol(self, symbol: Symbol) -> Symbol:
        if symbol.kind != "local":
            return symbol
        return LoadSymbol(symbol.kind, symbol.name, symbol.index, "", self.body, self.point, self.axes == "body")

    def passive(self) -> None:
        return None

    def places(self) -> Iterator[tuple[tuple[str, ...], str, Vector]]:
        yield ("point",), self.body, self.point

    def attached(self, at: Attach) -> Self:
        body, point = at(("point",), self.body, self.point)
        return replace(self, body=body, point=point)


def read_force(name: str, force: ForceEntry, site: Site) -> Force:
    """Return the force and torque of an entry of [forces], with the point in the body's frame; a body that is unknown
    or does not move freely is reported."""
    key, values = key_of("forces", name), site.values
    if force.body in (BASE, WORLD):
        why = "its motion is prescribed" if force.body == BASE else "it rests"
        values.report.add(f"{key}.body", f"a force on the {force.body} has no effect: {why} [E1499]", "a body")
    elif force.body in site.points and force.body not in site.bodies:
        fault = f"{force.body} is a point of {site.points[force.body].body}, not a body [E1500]"
        hint = f'body = "{site.points[force.body].body}", and the position of {force.body} as point'
        values.report.add(f"{key}.body", fault, hint)
    else:
        check_reference(f"{key}.body", force.body, site.bodies, "body", values.report)
    point = values.keys(key, force, "point")["point"]
    if force.body in site.bodies:
        positioned = "point" in force.model_fields_set
        point, _ = read_placement(key, force.given_in, positioned, force.body, point, rows(np.eye(3)), values, "point")
    return Force(name, point=point, **values.keys(key, force, "body", "force", "torque", "axes"))


SECTION = ElementSection(
    key="forces",
    entry=ForceEntry,
    model=Force,
    reader=read_force,
    bounds={"point": None},
    positional=("body",),
    documentation="""
    Add a force (N) and torque (N m) on a body at a point of its frame, in ``world`` or ``body`` axes.""",
)


class EffortEntry(Table):
    """A generalized force on one component of a joint."""

    joint: str = key("the driven joint", refers="joints")
    effort: Value = key(
        "positive drives the coordinate up",
        unit=by_component("N m", "N"),
        names=LOAD,
    )
    index: Annotated[int, Field(ge=0, le=5)] = key("component of the joint's velocity, angular ones first", 0)


@dataclass(frozen=True)
class Effort(ForceElement):
    """Generalized force on one component of a joint, a formula of everything but accelerations."""

    section: ClassVar[str] = "efforts"
    law: ClassVar[str] = "eomgen.mechanics.forces.forces:EFFORT_LAW"

    joint: str
    effort: Formula
    index: int = 0

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        yield self.effort, 0

    def passive(self) -> None:
        return None


def read_effort(name: str, effort: EffortEntry, site: Site) -> Effort:
    """Return the generalized force of an entry of [efforts]; an unknown joint, and a component that the type does not
    have, is reported."""
    key, values = key_of("efforts", name), site.values
    if check_reference(f"{key}.joint", effort.joint, values.names.joints, "joint", values.report):
        kind = values.names.joints[effort.joint]
        size = JOINTS[kind].v_size if kind else math.inf
        if effort.index >= size:
            hint = f"an index from 0 to {size - 1}" if size else "a moving joint"
            fault = f"the {kind} joint {effort.joint} has no component {effort.index} [E1501]"
            values.report.add(f"{key}.index", fault, hint)
    return Effort(name, **values.keys(key, effort))


EFFORT_SECTION = ElementSection(
    key="efforts",
    entry=EffortEntry,
    model=Effort,
    reader=read_effort,
    positional=("joint", "effort"),
    documentation="Add a generalized force on one component of a joint.",
)
