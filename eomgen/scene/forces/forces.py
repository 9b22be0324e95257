"""Forces and torques on bodies, by formulas."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal, Self

from eomgen.base.data import dataclass, replace
from eomgen.base.text import key_of
from eomgen.formula.nodes import Formula, LoadSymbol, Symbol, Vector
from eomgen.formula.substitution import renamed
from eomgen.scene.forces.element import Attach, ForceElement
from eomgen.scene.forces.element_section import ElementSection, Site
from eomgen.scene.formula.scope import LOCAL_LOAD, PARAMETERS
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Triple
from eomgen.scene.reading.report import check_reference
from eomgen.system.description import BASE, WORLD

_ZEROS = (0.0, 0.0, 0.0)


class ForceEntry(Table):
    """A force and a torque on a body."""

    body: str = key("the loaded body", refers="bodies", kind="body, not the base")
    point: Triple = key("point of the force, in the body's frame", _ZEROS, unit="m", names=PARAMETERS)
    force: Triple = key("through the point", _ZEROS, unit="N", names=LOCAL_LOAD)
    torque: Triple = key("beside the force's own moment", _ZEROS, unit="N m", names=LOCAL_LOAD)
    axes: Literal["world", "body"] = key("axes of force and torque", "world")


@dataclass(frozen=True)
class Force(ForceElement):
    """Force and torque on a body at a point, formulas of everything but accelerations, in world or body axes."""

    section: ClassVar[str] = "forces"
    law: ClassVar[str] = "eomgen.mechanics.forces.forces:LAW"

    body: str
    point: Vector  # body frame, formulas of parameters
    force: Vector
    torque: Vector
    axes: Literal["world", "body"] = "world"

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        yield from ((renamed(formula, self._placed), 0) for formula in (*self.force, *self.torque))

    def _placed(self, symbol: Symbol) -> Symbol:
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
    """Return a force and a torque."""
    key, values, vector = key_of("forces", name), site.values, site.values.vector
    if force.body in (BASE, WORLD):
        why = "its motion is prescribed" if force.body == BASE else "it rests"
        values.report.add(f"{key}.body", f"a force on the {force.body} moves nothing: {why}", "a body")
    elif force.body in site.points and force.body not in site.bodies:
        fault = f"{force.body} is a point of {site.points[force.body].body}, not a body"
        hint = f'body = "{site.points[force.body].body}", and the position of {force.body} as point'
        values.report.add(f"{key}.body", fault, hint)
    else:
        check_reference(f"{key}.body", force.body, site.bodies, "body", values.report)
    point = vector(f"{key}.point", force.point, PARAMETERS)
    force_vector = vector(f"{key}.force", force.force, LOCAL_LOAD)
    return Force(name, force.body, point, force_vector, vector(f"{key}.torque", force.torque, LOCAL_LOAD), force.axes)


SECTION = ElementSection(
    key="forces",
    entry=ForceEntry,
    model=Force,
    reader=read_force,
    bounds={"point": None},
    positional=("body",),
    documentation="""
    Add a force (N) and torque (N m) on a body at a point of its frame, in ``world`` or ``body`` axes.""",
    always=True,
)
