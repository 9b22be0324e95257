"""Generalized forces on components of joints, by formulas."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar

from pydantic import Field

from eomgen.base.data import dataclass
from eomgen.base.text import key_of
from eomgen.formula.nodes import Formula
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection, Site
from eomgen.scene.formula.scope import LOAD
from eomgen.scene.joint_types import JOINTS, by_component
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Value
from eomgen.scene.reading.report import check_reference


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
    """Return a generalized force on a component of a joint."""
    key, values = key_of("efforts", name), site.values
    if check_reference(f"{key}.joint", effort.joint, values.names.joints, "joint", values.report):
        kind = values.names.joints[effort.joint]
        size = JOINTS[kind].v_size if kind else math.inf
        if effort.index >= size:
            hint = f"an index from 0 to {size - 1}" if size else "a moving joint"
            values.report.add(f"{key}.index", f"the {kind} joint {effort.joint} has no component {effort.index}", hint)
    return Effort(name, effort.joint, values.formula(f"{key}.effort", effort.effort, LOAD), effort.index)


SECTION = ElementSection(
    key="efforts",
    entry=EffortEntry,
    model=Effort,
    reader=read_effort,
    positional=("joint", "effort"),
    documentation="Add a generalized force on one component of a joint.",
    always=True,
)
