"""Attachments to geometrically exact beams: a place on such a beam is a place on the node that is there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import TypeVar

from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ZERO, Vector
from eomgen.scene.bodies.beam import AT_END
from eomgen.scene.bodies.beam_schema import MOST_EXACT_ELEMENTS
from eomgen.scene.bodies.cosserat import Cosserat
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.joints.constraint_model import Constraint, Frame
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.values import Values
from eomgen.system.description import BASE, Point
from eomgen.text import key_of

AnyPoint = TypeVar("AnyPoint", bound=Point)
AnyElement = TypeVar("AnyElement", bound=ForceElement)


class BeamNodes:
    """Moves what is attached to geometrically exact beams to their nodes; a place between nodes is reported.

    Parameters
    ----------
    beams : by name
    """

    def __init__(self, beams: Mapping[str, Cosserat], values: Values) -> None:
        self.beams = beams
        self.values = values

    def joints(self) -> dict[str, Joint]:
        """Return the joints of the nodes: all but the first one are free to move against the base."""
        names = [name for beam in self.beams.values() for name in beam.nodes[1:]]
        neutral = (1.0, *(0.0,) * 6)
        return {
            name: Joint(name, "free", BASE, name, initial_position=neutral, initial_velocity=(0.0,) * 6)
            for name in names
        }

    def joint(self, joint: Joint) -> Joint:
        parent, position = self._at(key_of("joints", joint.name, "position"), joint.parent, joint.position)
        return replace(joint, parent=parent, position=position)

    def point(self, section: str, point: AnyPoint) -> AnyPoint:
        body, position = self._at(key_of(section, point.name, "position"), point.body, point.position)
        return replace(point, body=body, position=position)

    def constraint(self, constraint: Constraint) -> Constraint:
        first, second = (
            self._frame(key_of("constraints", constraint.name, side, "position"), frame)
            for side, frame in (("first", constraint.first), ("second", constraint.second))
        )
        return replace(constraint, first=first, second=second)

    def element(self, element: AnyElement) -> AnyElement:
        return element.attached(lambda parts, *place: self._at(key_of(element.section, element.name, *parts), *place))

    def _frame(self, key: str, frame: Frame) -> Frame:
        body, position = self._at(key, frame.body, frame.position)
        return replace(frame, body=body, position=position)

    def _at(self, key: str, body: str, position: Vector) -> tuple[str, Vector]:
        """Return the node at a place on a beam, and the place in its frame; what is on no such beam stays as it is."""
        beam, report = self.beams.get(body), self.values.report
        if beam is None or report.concerns(key) or report.concerns(key_of("beams", body)):
            return body, position
        tunable = sorted(
            symbol.name for symbol in symbols(position[0]) if self.values.names.parameters.get(symbol.name)
        )
        if tunable:
            what = (
                f"x on the beam {body} depends on the tunable parameter {tunable[0]}, and the nodes of a beam are fixed"
            )
            report.add(f"{key}[0]", what, f"{tunable[0]} without tunable, or a number")
            return body, position
        x = self.values.value(position[0])
        if math.isnan(x):
            return body, position
        node = min(range(len(beam.places)), key=lambda number: abs(beam.places[number] - x))
        if abs(x - beam.places[node]) > AT_END * beam.length:
            report.add(f"{key}[0]", *_no_node(beam, x))
        return beam.nodes[node], (ZERO, *position[1:])


def _no_node(beam: Cosserat, x: float) -> tuple[str, str]:
    """Return what is wrong with a place where a beam has no node, and what to try."""
    if not 0.0 <= x <= beam.length:
        what = f"x = {x:.6g} m is beyond the beam {beam.name}, which goes from 0 m to {beam.length:.6g} m"
        return what, "a place on the beam, or a body fixed to its end"
    nearest = min(beam.places, key=lambda place: abs(place - x))
    widths = [float(part.length) for part in beam.parts]
    alike = max(widths) - min(widths) <= AT_END * beam.length
    apart = f", which are {widths[0]:.6g} m apart" if alike else ""
    what = f"x = {x:.6g} m on the beam {beam.name} is between its nodes{apart}"
    share = Fraction(x / beam.length).limit_denominator(MOST_EXACT_ELEMENTS)
    count = share.denominator * math.ceil(beam.elements / share.denominator)
    fits = abs(float(share) * beam.length - x) <= AT_END * beam.length and count <= MOST_EXACT_ELEMENTS
    if alike and fits:
        return what, f"elements = {count}, which has a node there; or x = {nearest:.6g}"
    return what, f"x = {nearest:.6g}"
