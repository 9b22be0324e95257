"""Attachments to beams: compatibility of their shape functions with the joint that carries them, and places on
geometrically exact beams with their nodes and outputs.

Compatibility of the shape functions of a beam with the joint that carries it.

A joint holds the beam's frame. If the shapes vanish at the frame's origin, slope included, the frame is fixed in the
material there, and any joint will do. If not, the material moves relative to the frame, so the joint has to let the
frame move in the same direction: else it does not hold the beam (mean axes are right for a beam that floats).

Places on geometrically exact beams: stations along the axis, the nodes that carry attachments, and outputs of
sections.

Elements end at every attachment (``beam_stations``), so that a load there acts on a separate frame, and
all terms, constraints and reactions of bodies hold. Between nodes a frame would be a function of two of them.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.text import key_of, nearest, shown
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ZERO, Formula, Number, Symbol, Vector
from eomgen.scene.bodies.cosserat import SECTION_PARTS, SECTION_ROW, Cosserat
from eomgen.scene.bodies.model import AT_END, Beam, Body, Deformation
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.geometry import ALIKE
from eomgen.scene.joint_types import GROUPS
from eomgen.scene.joints import schema as written
from eomgen.scene.joints.model import Constraint, Joint
from eomgen.scene.joints.tree import displaced
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import Values
from eomgen.scene.section import AttachByKey, Reading, in_reading_order
from eomgen.scene.signals.schema import Output
from eomgen.system.description import BASE, FixedFrame, Point


def check_places(
    bodies: Mapping[str, Body],
    joints: Iterable[Joint],
    points: Iterable[Point],
    elements: Iterable[ForceElement],
    constraints: Iterable[Constraint],
    values: Values,
) -> None:
    """Report attachments to a beam at places that are not on it."""
    places = [(key_of("joints", joint.name, "position"), joint.parent, joint.position) for joint in joints]
    for point in points:
        section = "frames" if isinstance(point, FixedFrame) else "points"
        places.append((key_of(section, point.name, "position"), point.body, point.position))
    for element in elements:
        places += [
            (key_of(element.section, element.name, *parts), body, place) for parts, body, place in element.places()
        ]
    for constraint in constraints:
        for field, frame in zip(("first", "second"), constraint.frames, strict=False):
            places.append((key_of("constraints", constraint.name, field, "position"), frame.body, frame.position))
    judged = set()
    for key, body, position in places:
        if (body, position) not in judged:  # a frame in a point is the point's matter, and points come before
            _check_place(key, body, position, bodies, values)
        judged.add((body, position))


def _check_place(key: str, name: str, position: Sequence[Formula], bodies: Mapping[str, Body], values: Values) -> None:
    body = bodies.get(name)
    if (
        body is None
        or body.beam is None
        or values.report.concerns(key)
        or values.report.concerns(key_of("beams", name))
    ):
        return
    beam, along = body.beam, position[0]
    tunable = sorted(symbol.name for symbol in symbols(along) if values.names.parameters.get(symbol.name))
    if tunable:
        fault = (
            f"x on the beam {name} depends on the tunable parameter {tunable[0]}, and shape functions are evaluated"
            " once"
        )
        values.report.add(f"{key}[0]", fault, f"{tunable[0]} without tunable, or a number")
        return
    x = values.value(along)
    if beam.is_beyond(x):
        reach = f"{beam.start:.6g} m to {beam.start + beam.length:.6g} m"
        fault = f"x = {x:.6g} m is beyond the beam {name}, which goes from {reach}"
        values.report.add(f"{key}[0]", fault, "a place on the beam, or a body fixed to its end")


#: Twist (rotation, translation) of the frame that the deflection and the slope of each deformation stand for.
_DEFLECTION = {"bending_y": 4, "bending_z": 5, "stretch": 3, "torsion": 0}
_SLOPE = {"bending_y": 2, "bending_z": 1}
_WORDS = tuple(f"{move} {axis}" for move in ("turn about", "move along") for axis in "xyz")


def check_not_absolute(beams: Iterable[str], report: Report) -> None:
    """Report beams in a scene of absolute coordinates."""
    for name in beams:
        fault = "absolute coordinates know rigid bodies only, and this is a beam"
        report.add(key_of("beams", name), fault, 'coordinates = "joint"')


def check_frames(joints: Sequence[Joint], bodies: Mapping[str, Body], values: Values) -> None:
    """Report shapes that move the material in a direction in which a joint holds it.

    Parameters
    ----------
    joints : sequence of Joint
        Parents first.
    """
    carried = {joint.child: joint for joint in joints}
    for joint in joints:
        beam = bodies[joint.child].beam
        key = key_of("beams", joint.child)
        if beam is None or values.report.concerns(key):
            continue
        free = _freedoms(joint, carried, bodies)
        for deformation in beam.deformations:
            held = [_WORDS[twist] for twist in _moved(deformation, beam) if _is_held(np.eye(6)[twist], free)]
            if held:
                fault = (
                    f"with {deformation.shapes} shapes the beam can {' and '.join(held)} at the frame's origin, where"
                    f" the {joint.type} joint {joint.name} holds it"
                )
                values.report.add(f"{key}.{deformation.kind}.shapes", fault, _hint(deformation, beam))


def _is_held(twist: Array, free: Array) -> bool:
    return bool(np.linalg.norm(twist - free @ (free.T @ twist)) > ALIKE)


def _hint(deformation: Deformation, beam: Beam) -> str:
    if beam.start < 0.0:
        return "clamped_free shapes and start = 0, the frame at the beam's first end; or a free joint"
    return (
        'shapes = "clamped_free"'
        if deformation.shapes not in ("polynomial", "finite_elements")
        else 'ends = "clamped_free"'
    )


def _moved(deformation: Deformation, beam: Beam) -> list[int]:
    """Return the components of the twist with which the material at the frame's origin moves against the frame."""
    ends = deformation.ends if deformation.shapes in ("polynomial", "finite_elements") else deformation.shapes
    first, last = beam.start >= -AT_END * beam.length, beam.start + beam.length <= AT_END * beam.length
    held = (first and ends != "free_free") or (last and ends == "pinned_pinned")
    clamped = first and ends == "clamped_free"
    result = [] if held else [_DEFLECTION[deformation.kind]]
    if deformation.kind in _SLOPE and not clamped:
        result.append(_SLOPE[deformation.kind])
    return result


def _freedoms(joint: Joint, carried: Mapping[str, Joint], bodies: Mapping[str, Body]) -> Array:
    """Return an orthonormal basis (6, n) of the twists that a joint, and joints of massless bodies before it, leave to
    the child.

    Neutral positions are looked at, and a chain of joints at one place.
    """
    columns = [_motions(joint)]
    turned = np.array(joint.orientation).T
    parent = carried.get(joint.parent)
    while parent is not None and bodies[parent.child].mass == ZERO and bodies[parent.child].beam is None:
        motions = _motions(parent)
        columns.append(np.vstack([turned @ motions[:3], turned @ motions[3:]]))
        turned = turned @ np.array(parent.orientation).T
        parent = carried.get(parent.parent)
    vectors, sizes, _ = np.linalg.svd(np.hstack(columns))
    return np.asarray(vectors[:, : int(np.sum(sizes > ALIKE))])


def _motions(joint: Joint) -> Array:
    """Return the twists (6, n) of a joint in its child's frame; a screw's travel cannot follow a deflection by
    itself."""
    neutral = np.zeros(joint.kind.q_size)
    if joint.kind.group in GROUPS.values():
        neutral[0] = 1.0
    return displaced(joint.kind, joint.axis, joint.second_axis, neutral)[2]


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
        """Report joints that call nodes by name, which are none of the scene's: places on the beam are."""
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


def stations_of(beams: Sequence[str], reading: Reading) -> Mapping[str, Sequence[float]]:
    """Return x of every station, m, by beam, NaN if it is not known.

    Parameters
    ----------
    beams : names of the beams that are geometrically exact
    reading : before anything is attached; all of it is read again with the nodes that follow
    """
    stations: dict[str, list[float]] = {name: [] for name in beams}
    if not beams:
        return stations

    def note(key: str, body: str, position: Vector) -> tuple[str, Vector]:
        if body in stations and not aside.report.concerns(key):
            stations[body].append(aside.values.value(position[0]))
        return body, position

    aside = reading.aside(note)
    for row in in_reading_order(reading.rows):
        if row.attached:
            aside.items[row.key] = row.read(aside)
    return stations


#: How far beyond an end a place may be by rounding, of the length.
_ROUNDING = 1e-9


def section_formulas(
    beams: Mapping[str, Cosserat], values: Values, key: str, kind: str, output: Output
) -> tuple[Formula, ...]:
    """Return the three components of an output of a section; none if there is a fault.

    Loads are linear between both ends of an element, and at a node the loads of the element beyond.
    """
    name, report = str(getattr(output, kind)), values.report
    beam = beams.get(name)
    if beam is None and report.concerns(key_of("beams", name)):
        return ()
    if beam is None:
        other = name in values.names.beams
        fault = f"the beam {name} is no geometrically exact one" if other else f"there is no beam {shown(name)}"
        report.add(f"{key}.{kind}", fault, 'model = "cosserat"' if other else nearest(name, beams))
        return ()
    if output.at is None:
        report.add(key, f"{kind} needs the place of the section", f"at = {0.5 * beam.length:.6g}, its x in m")
        return ()
    x = values.constant(f"{key}.at", output.at)
    if math.isnan(x):
        return ()
    if not -_ROUNDING * beam.length <= x <= (1.0 + _ROUNDING) * beam.length:
        fault = f"x = {x:.6g} m is not on the beam {name}, which goes from 0 m to {beam.length:.6g} m"
        report.add(f"{key}.at", fault, "a place on the beam")
        return ()
    element = min(bisect_right(beam.places, x + _ROUNDING * beam.length) - 1, beam.elements - 1)
    start, end = beam.places[element : element + 2]
    share = min(max((x - start) / (end - start), 0.0), 1.0)
    first, second = (
        [Symbol("section_load", name, element * SECTION_ROW + start + part) for part in range(3)]
        for start in SECTION_PARTS[kind]
    )
    if first == second or share == 0.0:
        return tuple(first)
    if share == 1.0:
        return tuple(second)
    return tuple(Number(1.0 - share) * one + Number(share) * other for one, other in zip(first, second, strict=True))
