"""Attachments to beams with shape functions: their places, and whether the shapes are compatible with the joint that
carries the beam.

A joint holds the beam's frame. If the shapes vanish at the frame's origin, slope included, the frame is fixed in the
material there, and any joint will do. If not, the material moves relative to the frame, so the joint has to let the
frame move in the same direction: else the frame does not hold the beam (mean axes are right for a beam that floats).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import key_of
from eomgen.formula.nodes import ZERO, Formula
from eomgen.scene.bodies.model import AT_END, Beam, Body, Deformation
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.joints.model import Constraint, Joint
from eomgen.scene.joints.tree import motion_subspace
from eomgen.scene.reading.values import Values
from eomgen.scene.rotations import ALIKE
from eomgen.system.description import FixedFrame, Point


def check_places(items: Mapping[str, Mapping[str, Any]], elements: Iterable[ForceElement], values: Values) -> None:
    """Report joints, points, frames, constraints and force elements that are attached to a beam with shape functions
    beyond the ends, or at a place that tunable parameters move. ``items`` are the results of sections by key."""
    joints: Iterable[Joint] = items["joints"].values()
    constraints: Iterable[Constraint] = items["constraints"].values()
    points: Mapping[str, Point] = {**items["points"], **items["frames"]}
    places = [(key_of("joints", joint.name, "position"), joint.parent, joint.position) for joint in joints]
    for point in points.values():
        section = "frames" if isinstance(point, FixedFrame) else "points"
        places.append((key_of(section, point.name, "position"), point.body, point.position))
    for element in elements:
        places += [
            (key_of(element.section, element.name, *parts), body, vector) for parts, body, vector in element.places()
        ]
    for constraint in constraints:
        for field, frame in zip(("first", "second"), constraint.frames, strict=False):
            places.append((key_of("constraints", constraint.name, field, "position"), frame.body, frame.position))
    judged = set()
    for key, body, position in places:
        if (body, position) not in judged:  # a frame in a point is the point's matter, and points come before
            _check_place(key, body, position, items["bodies"], values)
        judged.add((body, position))


def _check_place(key: str, name: str, position: Sequence[Formula], bodies: Mapping[str, Body], values: Values) -> None:
    """Report a position on a beam with shape functions that is beyond the ends, or whose x depends on a tunable
    parameter; other bodies, and entries with a fault, are passed over. ``name`` is the body."""
    body = bodies.get(name)
    if body is None or body.beam is None or any(map(values.report.concerns, (key, key_of("beams", name)))):
        return
    beam, along = body.beam, position[0]
    if tunable := values.tunable_in(along):
        fault = f"x on the beam {name} depends on the tunable parameter {tunable}, and shapes are fixed [E1979]"
        values.report.add(f"{key}[0]", fault, f"{tunable} without tunable, or a number")
        return
    x = values.value(along)
    if beam.is_beyond(x):
        reach = f"{beam.start:.6g} m to {beam.start + beam.length:.6g} m"
        fault = f"x = {x:.6g} m is beyond the beam {name}, which goes from {reach} [E1980]"
        values.report.add(f"{key}[0]", fault, "a place on the beam, or a body fixed to its end")


#: Twist (rotation, translation) of the frame that the deflection and the slope of each deformation stand for.
_DEFLECTION = {"bending_y": 4, "bending_z": 5, "stretch": 3, "torsion": 0}
_SLOPE = {"bending_y": 2, "bending_z": 1}
_WORDS = tuple(f"{move} {axis}" for move in ("turn about", "move along") for axis in "xyz")


def check_frames(joints: Sequence[Joint], bodies: Mapping[str, Body], values: Values) -> None:
    """Report shape functions of beams that displace the material at the frame's origin in a direction in which the
    joint that carries the beam holds the frame. Joints have parents first."""
    carried = {joint.child: joint for joint in joints}
    for joint in joints:
        beam = bodies[joint.child].beam
        key = key_of("beams", joint.child)
        if beam is None or values.report.concerns(key):
            continue
        free = _freedoms(joint, carried, bodies)
        for deformation in beam.deformations:
            moving = _free_components(deformation, beam)
            held = [_WORDS[k] for k in moving if np.linalg.norm(np.eye(6)[k] - free @ free[k]) > ALIKE]
            if held:
                key_of_ends = "ends" if deformation.shapes in ("polynomial", "finite_elements") else "shapes"
                hint = f'{key_of_ends} = "clamped_free"'
                if beam.start < 0.0:
                    hint = "clamped_free shapes and start = 0, the frame at the beam's first end; or a free joint"
                fault = (
                    f"{deformation.shapes} shapes {' and '.join(held)} where the joint {joint.name} holds them [E1982]"
                )
                values.report.add(f"{key}.{deformation.kind}.shapes", fault, hint)


def _free_components(deformation: Deformation, beam: Beam) -> list[int]:
    """Return the indices of the twist (angular part first) with which a deformation moves the material at the frame's
    origin against the beam's frame."""
    ends = deformation.ends if deformation.shapes in ("polynomial", "finite_elements") else deformation.shapes
    first, last = beam.start >= -AT_END * beam.length, beam.start + beam.length <= AT_END * beam.length
    held = (first and ends != "free_free") or (last and ends == "pinned_pinned")
    clamped = first and ends == "clamped_free"
    result = [] if held else [_DEFLECTION[deformation.kind]]
    if deformation.kind in _SLOPE and not clamped:
        result.append(_SLOPE[deformation.kind])
    return result


def _freedoms(joint: Joint, carried: Mapping[str, Joint], bodies: Mapping[str, Body]) -> Array:
    """Return an orthonormal basis (6, n) of the twists, in the child's axes, that a joint and preceding joints of
    massless bodies leave to the child, at neutral coordinates and as if these joints were at one place. ``carried`` is
    the joint of each body."""
    columns = [motion_subspace(joint.kind, joint.axis, joint.second_axis)]
    turned = np.array(joint.orientation).T
    parent = carried.get(joint.parent)
    while parent is not None and bodies[parent.child].mass == ZERO and bodies[parent.child].beam is None:
        motions = motion_subspace(parent.kind, parent.axis, parent.second_axis)
        columns.append(np.vstack([turned @ motions[:3], turned @ motions[3:]]))
        turned = turned @ np.array(parent.orientation).T
        parent = carried.get(parent.parent)
    vectors, sizes, _ = np.linalg.svd(np.hstack(columns))
    return np.asarray(vectors[:, : int(np.sum(sizes > ALIKE))])
