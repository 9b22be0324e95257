"""Attachments to geometrically exact beams: a place on such a beam is a place on the node that is there.

Elements end at every attachment (``beam_stations``), so that a load there acts on a frame of its own, and
all terms, constraints and reactions of bodies hold. Between nodes a frame would be a function of two of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from eomgen.base.text import key_of
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ZERO, Vector
from eomgen.scene.bodies.beam import AT_END
from eomgen.scene.bodies.cosserat import Cosserat
from eomgen.scene.joints import schema as written
from eomgen.scene.joints.constraint_model import Constraint
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.values import Values
from eomgen.scene.section import AttachByKey
from eomgen.system.description import BASE, Point

AnyPoint = TypeVar("AnyPoint", bound=Point)


def attached_joint(joint: Joint, attach: AttachByKey) -> Joint:
    """Return a joint whose parent is a node if it is on a geometrically exact beam."""
    parent, position = attach(key_of("joints", joint.name, "position"), joint.parent, joint.position)
    return replace(joint, parent=parent, position=position)


def attached_point(section: str, point: AnyPoint, attach: AttachByKey) -> AnyPoint:
    """Return a point, or a frame, of a node if it is on a geometrically exact beam."""
    body, position = attach(key_of(section, point.name, "position"), point.body, point.position)
    return replace(point, body=body, position=position)


def attached_constraint(constraint: Constraint, attach: AttachByKey) -> Constraint:
    """Return a constraint whose frames are of nodes if they are on geometrically exact beams."""
    moved = {}
    for side, frame in (("first", constraint.first), ("second", constraint.second)):
        body, position = attach(key_of("constraints", constraint.name, side, "position"), frame.body, frame.position)
        moved[side] = replace(frame, body=body, position=position)
    return replace(constraint, first=moved["first"], second=moved["second"])


class BeamNodes:
    """Moves attachments of geometrically exact beams to their nodes; a place beyond a beam is reported.

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

    def check_names(self, joints: Mapping[str, written.Joint]) -> None:
        """Report joints that call nodes by their names, which are none of the scene's: places on the beam are."""
        places = {
            node: (beam, x) for beam in self.beams.values() for node, x in zip(beam.nodes, beam.places, strict=True)
        }
        for name, joint in joints.items():
            if joint.parent in places and joint.parent not in self.beams:
                beam, x = places[joint.parent]
                fault = f"{joint.parent} is a node of the beam {beam.name}, which a scene calls by its place"
                hint = f'parent = "{beam.name}" and position = [{x:.6g}, 0, 0]'
                self.values.report.add(key_of("joints", name, "parent"), fault, hint)
            if joint.child in places and joint.child not in self.beams:
                beam, x = places[joint.child]
                fault = f"{joint.child} is a node of the beam {beam.name}, whose elements carry it"
                hint = f'child = "{beam.name}" at its first end, or a constraint at x = {x:.6g}'
                self.values.report.add(key_of("joints", name, "child"), fault, hint)

    def at(self, key: str, body: str, position: Vector) -> tuple[str, Vector]:
        """Return the node at a place on a beam, and the place in its frame; places on other bodies stay unchanged."""
        beam, report = self.beams.get(body), self.values.report
        if beam is None or report.concerns(key) or report.concerns(key_of("beams", body)):
            return body, position
        tunable = sorted(
            symbol.name for symbol in symbols(position[0]) if self.values.names.parameters.get(symbol.name)
        )
        if tunable:
            fault = (
                f"x on the beam {body} depends on the tunable parameter {tunable[0]}, and the nodes of a beam are fixed"
            )
            report.add(f"{key}[0]", fault, f"{tunable[0]} without tunable, or a number")
            return body, position
        x = self.values.value(position[0])
        if math.isnan(x):
            return body, position
        if not -AT_END * beam.length <= x <= (1.0 + AT_END) * beam.length:
            fault = f"x = {x:.6g} m is beyond the beam {beam.name}, which goes from 0 m to {beam.length:.6g} m"
            report.add(f"{key}[0]", fault, "a place on the beam, or a body fixed to its end")
            return body, position
        node = min(range(len(beam.places)), key=lambda number: abs(beam.places[number] - x))
        return beam.nodes[node], (ZERO, *position[1:])
