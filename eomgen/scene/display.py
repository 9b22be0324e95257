"""How a Scene shows itself: one line at a prompt, tables in a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

from eomgen.base.html import page, paragraph, table
from eomgen.formula.infix import infix
from eomgen.formula.nodes import Formula
from eomgen.scene.bodies.model import Body
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.joints.constraint_model import Constraint
from eomgen.scene.joints.model import Joint
from eomgen.system.motions import Motion
from eomgen.system.signals import Input, Output, Parameter, State

#: Parts of a scene in the order of the summary, with their singular and plural.
_PARTS = (
    ("bodies", "body", "bodies"), ("joints", "joint", "joints"), ("constraints", "constraint", "constraints"),
    ("elements", "force element", "force elements"), ("controllers", "controller", "controllers"),
    ("inputs", "input", "inputs"), ("motions", "motion", "motions"), ("states", "internal state", "internal states"),
    ("events", "event", "events"),
    ("parameters", "parameter", "parameters"), ("outputs", "output", "outputs"),
)  # fmt: skip  # a table


class Shown(Protocol):
    """The fields of a ``Scene`` that its summary shows."""

    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def bodies(self) -> tuple[Body, ...]: ...
    @property
    def joints(self) -> tuple[Joint, ...]: ...
    @property
    def constraints(self) -> tuple[Constraint, ...]: ...
    @property
    def elements(self) -> tuple[ForceElement, ...]: ...
    @property
    def inputs(self) -> tuple[Input, ...]: ...
    @property
    def motions(self) -> tuple[Motion, ...]: ...
    @property
    def states(self) -> tuple[State, ...]: ...
    @property
    def outputs(self) -> tuple[Output, ...]: ...
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...


def line(scene: Shown) -> str:
    """Return ``<Scene four_bar: 3 bodies, 3 joints, 1 constraint>``."""
    return f"<Scene {scene.name}: {', '.join(_counted(scene))}>"


def _counted(scene: Shown) -> Iterator[str]:
    for part, one, several in _PARTS:
        if count := len(getattr(scene, part)):
            yield f"{count} {one if count == 1 else several}"


def html(scene: Shown) -> str:
    """Return the scene as tables: bodies with their joints, constraints, force elements, signals and parameters."""
    carried = dict(zip((body.name for body in scene.bodies), scene.joints, strict=True))
    bodies = (
        (body.name, infix(body.mass), _vector(body.center_of_mass), joint.name, joint.type, joint.parent)
        for body in scene.bodies
        for joint in (carried[body.name],)
    )
    constraints = (
        (item.name, item.type, item.first.body, item.second.body, infix(item.drive) if item.drive else "")
        for item in scene.constraints
    )
    signals = (
        *((item.name, "input", item.unit, item.description) for item in scene.inputs),
        *((item.name, "motion", item.unit, item.description) for item in scene.motions),
        *((item.name, "internal state", item.unit, item.description) for item in scene.states),
        *((item.name, "output", item.unit, item.description) for item in scene.outputs),
    )
    parameters = (
        (item.name, f"{item.value:.9g}", item.unit, "tunable" if item.tunable else "", item.description)
        for item in scene.parameters
    )
    return page(
        f"Scene {scene.name}",
        paragraph(scene.description),
        table(("body", "mass, kg", "centre of mass, m", "joint", "type", "parent"), bodies),
        table(("constraint", "type", "first", "second", "driven as"), constraints),
        table(("force element",), ((element.label,) for element in scene.elements)),
        table(("signal", "kind", "unit", "meaning"), signals),
        table(("parameter", "value", "unit", "", "meaning"), parameters),
    )


def _vector(components: Sequence[Formula]) -> str:
    return ", ".join(infix(component) for component in components)
