"""Nodes of geometrically exact beams: stations along the axis, the nodes that carry attachments (joints, points,
constraints), and outputs of sections.

Elements end at every attachment (``beam_stations``), so that a load there acts on a separate frame, and all terms,
constraints and reactions of bodies hold. Between nodes a frame would be a function of two nodes.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from eomgen.base.messages import key_of, nearest, shown
from eomgen.base.rounding import COMPUTED
from eomgen.formula.nodes import ZERO, Formula, Number, Symbol, Vector
from eomgen.scene.bodies.cosserat import SECTION_PARTS, SECTION_ROW, Cosserat
from eomgen.scene.bodies.model import AT_END
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import Values
from eomgen.scene.section import Reading, in_reading_order
from eomgen.system.description import BASE

if TYPE_CHECKING:
    from eomgen.scene.joints import schema as written
    from eomgen.scene.signals.schema import OutputEntry


def node_joints(beams: Iterable[Cosserat]) -> dict[str, Joint]:
    """Return free joints to the base, by node, for all nodes of all beams but the first node of each beam, which is the
    beam's own body with a joint of the scene."""
    names = [name for beam in beams for name in beam.nodes[1:]]
    neutral = (1.0, *(0.0,) * 6)
    return {
        name: Joint(name, "free", BASE, name, initial_position=neutral, initial_velocity=(0.0,) * 6) for name in names
    }


def check_names_of_nodes(
    beams: Mapping[str, Cosserat], joints: Mapping[str, written.JointEntry], report: Report
) -> None:
    """Report joints whose parent or child is the name of a node: joints name the beam and a position there instead."""
    places = {node: (beam.name, x) for beam in beams.values() for node, x in zip(beam.nodes, beam.places, strict=True)}
    for name, joint in joints.items():
        for side in ("parent", "child"):
            node = getattr(joint, side)
            if node in places and node not in beams:
                beam, x = places[node]
                fault = f"{node} is a node of the beam {beam}, which a scene calls by its place [E1983]"
                hint = f'parent = "{beam}" and position = [{x:.6g}, 0, 0]'
                if side == "child":
                    fault = f"{node} is a node of the beam {beam}, whose elements carry it [E1984]"
                    hint = f'child = "{beam}" at its first end, or a constraint at x = {x:.6g}'
                report.add(key_of("joints", name, side), fault, hint)


def node_at(beams: Mapping[str, Cosserat], values: Values, key: str, body: str, position: Vector) -> tuple[str, Vector]:
    """Return the name of the node nearest to a place on a beam, and the place in the node's frame, m; places on other
    bodies, and places with a reported fault, stay unchanged. ``key`` is the dotted key of the position."""
    beam, report = beams.get(body), values.report
    if beam is None or report.concerns(key) or report.concerns(key_of("beams", body)):
        return body, position
    x, tunable = values.value(position[0]), values.tunable_in(position[0])
    if tunable:
        fault = f"x on the beam {body} depends on the tunable parameter {tunable}, and nodes are fixed [E1985]"
        report.add(f"{key}[0]", fault, f"{tunable} without tunable, or a number")
    elif not -AT_END * beam.length <= x <= (1.0 + AT_END) * beam.length and not math.isnan(x):
        fault = f"x = {x:.6g} m is beyond the beam {beam.name}, which goes from 0 m to {beam.length:.6g} m [E1986]"
        report.add(f"{key}[0]", fault, "a place on the beam, or a body fixed to its end")
    if math.isnan(x) or report.concerns(key):
        return body, position
    node = min(range(len(beam.places)), key=lambda number: abs(beam.places[number] - x))
    return beam.nodes[node], (ZERO, *position[1:])


def stations_of(beams: Sequence[str], reading: Reading) -> Mapping[str, Sequence[float]]:
    """Return x of every attachment to geometrically exact beams, m, by beam, NaN if unknown. Faults are not reported.

    Parameters
    ----------
    beams : names of the beams that are geometrically exact
    reading : state of reading before attachments, which stays; sections with attachments are read in a copy
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


def section_formulas(
    beams: Mapping[str, Cosserat], values: Values, key: str, kind: str, output: OutputEntry
) -> tuple[Formula, ...]:
    """Return the three components of an output of a beam's section, such as ``section_force``, as formulas of the
    beam's section loads; empty after a fault, which is reported.

    Loads are linear between both ends of an element, and at a node the loads of the element beyond.

    Parameters
    ----------
    key : dotted key of the output
    kind : key of the output that names the beam, and says the quantity
    output : entry with the beam's name, and with x of the section as ``at``, m
    """
    name, report = str(getattr(output, kind)), values.report
    beam = beams.get(name)
    if beam is None and report.concerns(key_of("beams", name)):
        return ()
    if beam is None:
        is_beam = name in values.names.beams
        fault, hint = f"there is no beam {shown(name)} [E1291]", nearest(name, beams)
        if is_beam:
            fault, hint = f"the beam {name} is not geometrically exact [E1987]", 'model = "cosserat"'
        report.add(f"{key}.{kind}", fault, hint)
        return ()
    if output.at is None:
        report.add(key, f"{kind} needs the place of the section [E1989]", f"at = {0.5 * beam.length:.6g}, its x in m")
        return ()
    x = values.constant(f"{key}.at", output.at)
    if math.isnan(x):
        return ()
    if not -COMPUTED * beam.length <= x <= (1.0 + COMPUTED) * beam.length:
        fault = f"x = {x:.6g} m is not on the beam {name}, which goes from 0 m to {beam.length:.6g} m [E1988]"
        report.add(f"{key}.at", fault, "a place on the beam")
        return ()
    element = min(bisect_right(beam.places, x + COMPUTED * beam.length) - 1, beam.elements - 1)
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
    return tuple(Number(1.0 - share) * a + Number(share) * b for a, b in zip(first, second, strict=True))
