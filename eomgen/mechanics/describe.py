"""Description of a scene: names, units, scales, limits, requirements and drawing data, everything besides its
equations.

Scales of a machine, length and gravity, to which rounding errors of positions and accelerations are relative.

A motion may be as small as it likes against its machine. The size of an acceleration sets the required accuracy, the
size of the machine the possible accuracy: forces that cancel in a scene at rest leave fractions of their summands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain, pairwise
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.base.messages import key_of
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Formula, Number
from eomgen.formula.prescribed_motion import PrescribedLaw, constant
from eomgen.lie.product import Factor
from eomgen.mechanics.linear_parameters import linear_parameters
from eomgen.scene.bodies.cosserat import Cosserat
from eomgen.scene.bodies.model import Beam, Body
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.joint_types import DRIVE_UNITS
from eomgen.scene.joints.model import Frame, Joint
from eomgen.scene.reading.report import Report
from eomgen.scene.rotations import frame_about, rows
from eomgen.scene.scene import Scene
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.system.description import (
    BASE,
    WORLD,
    CoordinateLimit,
    Coordinates,
    Description,
    Drawing,
    DrawnLink,
    ElementStiffness,
    HeightSurface,
    Hinge,
    Line,
    Point,
    Shape,
    Solid,
    Wheel,
)


def extent(scene: Scene, algebra: Algebra, constant: Callable[[Formula], Scalar]) -> tuple[Scalar, Scalar]:
    """Return the root of the summed squares of all lengths in a scene, m, and the magnitude of gravity, m/s^2.

    Parameters
    ----------
    constant : callable
        Maps a formula of parameters to its value on the tape.
    """
    return tuple(  # type: ignore[return-value]  # one for each of the two
        _root_of_squares(algebra, map(constant, formulas)) for formulas in (_scene_lengths(scene), scene.gravity)
    )


def _root_of_squares(algebra: Algebra, values: Iterator[Scalar]) -> Scalar:
    total = algebra.zero
    for value in values:
        total = total + value * value
    return total if total.is_zero else algebra.call(Op.SQRT, total)


def _scene_lengths(scene: Scene) -> Iterator[Formula]:
    """Yield the dimensions of moving bodies and force elements, formulas of parameters; the position of the machine is
    not a dimension."""
    still = {BASE, "world"}
    yield from chain.from_iterable(body.center_of_mass for body in scene.bodies)
    yield from (Number(body.beam.length) for body in scene.bodies if body.beam is not None)
    yield from chain.from_iterable(point.position for point in scene.points if point.body not in still)
    for joint in scene.joints:
        if joint.parent not in still:
            yield from joint.position
        yield from joint.lengths()
    yield from chain.from_iterable(element.lengths() for element in scene.elements)


def describe(scene: Scene) -> Description:
    """Return the description of a scene: all data of its model besides equations, such as units, limits and drawing."""
    beams = [item.beam for item in scene.elements if isinstance(item, CosseratBeam)]
    return Description(
        name=scene.name,
        description=scene.description,
        parameters=scene.parameters,
        states=scene.states,
        inputs=scene.inputs,
        motions=scene.motions,
        parts=scene.parts,
        outputs=scene.outputs,
        coordinates=tuple(_coordinates(scene)),
        joints=joint_factors(scene) if scene.coordinates == "absolute" else (),
        base=base_disturbances(scene),
        laws=tuple(laws_of(scene)),
        formulas=tuple(formula for formula, _ in formulas_of_forces(scene)),
        limits=tuple(_limits(scene)),
        requirements=scene.requirements,
        lengths=tuple(_lengths(scene)),
        gravity=scene.gravity,
        exact_beams=tuple(beam.nodes for beam in beams),
        element_stiffness=tuple(map(_element_stiffness, beams)),
        frames=scene.frames,
        contacts=tuple(_contacts(scene)),
        linear_parameters=linear_parameters(scene),
        drawing=_drawing(scene),
        starts=tuple(joint.start for joint in scene.leading_joints if joint.start is not None),
        simulation=scene.simulation,
        notes=reading_notes(scene),
        places={key: location for key, location in scene.source.items() if key.startswith("simulation")},
    )


def reading_notes(scene: Scene) -> tuple[str, ...]:
    """Return the notes of reading a scene that its library keeps; shapes change without another library."""
    return tuple(note for note in scene.notes if not note.startswith("shapes."))


def _element_stiffness(beam: Cosserat) -> ElementStiffness:
    lengths = tuple(float(part.length) for part in beam.parts)
    compliance = tuple(() if part.moments is None else part.moments.compliance for part in beam.parts)
    stiffness = tuple(part.section.stiffness for part in beam.parts)
    return ElementStiffness(beam.nodes, lengths, stiffness, tuple(part.twist for part in beam.parts), compliance)


def base_disturbances(scene: Scene) -> tuple[str, ...]:
    """Return the names of the base's acceleration components, which are disturbances in addition to the given inputs.

    Angular components if the base rotates, then linear components, in base axes; none in absolute coordinates, because
    constraints hold the base.
    """
    if scene.base is None or scene.coordinates == "absolute":
        return ()
    angular = tuple(f"base.angular_acceleration[{k}]" for k in range(3)) if scene.base.rotations else ()
    return (*angular, *(f"base.acceleration[{k}]" for k in range(3)))


def laws_of(scene: Scene) -> Iterator[PrescribedLaw]:
    """Yield the prescribed motions in a scene, each with place in the file, meaning, unit and formula. These are drives
    of joints and constraints, lengths over time, and position and rotation of the base."""
    where = Report(scene.name, scene.source).where
    for joint in scene.joints:
        for number, (formula, (meaning, unit)) in enumerate(
            zip(joint.drive, joint.kind.coordinates.items(), strict=False)
        ):
            key = key_of("joints", joint.name, *(("drive",) if len(joint.drive) == 1 else ("drive", number)))
            yield PrescribedLaw(where(key), f"driven {meaning}", unit, formula)
    for constraint in scene.constraints:
        if constraint.drive is not None:
            key, meaning = where(key_of("constraints", constraint.name, "drive")), constraint.kind.drive
            yield PrescribedLaw(key, f"driven {meaning}", DRIVE_UNITS[meaning], constraint.drive)
        elif constraint.prescribed_coordinate is not None:
            key = where(key_of("constraints", constraint.name, "length"))
            yield PrescribedLaw(key, "driven distance", "m", constraint.prescribed_coordinate)
    if scene.base is not None:
        for axis, formula in enumerate(scene.base.position):
            written = "acceleration" if axis in scene.base.integrals else "position"
            yield PrescribedLaw(where(key_of("base", written, axis)), "position of the base", "m", formula)
        for axis, rotation in enumerate(scene.base.rotations):
            added = scene.base.added_by
            written = key_of("base", "rotation", axis - len(added), "angle")
            key = key_of("base", added[axis]) if axis < len(added) else written
            yield PrescribedLaw(where(key), "angle of the base", "rad", rotation.angle)


def formulas_of_forces(scene: Scene) -> Iterator[tuple[Formula, int]]:
    """Yield (formula, order): each formula on which forces depend, except inputs, and the number of its time
    derivatives used."""
    if scene.base is not None:
        yield from ((formula, 2) for formula in scene.base.position)
        yield from ((rotation.angle, 2) for rotation in scene.base.rotations)
    yield from ((law, 2) for law in prescribed_laws(scene))
    for item in scene.constraints:
        if item.equation is not None and not item.framed:
            yield item.equation, 1 if item.at_velocity else 2
    yield from ((state.rate, 0) for state in scene.states)
    yield from ((controller.output, 0) for controller in scene.controllers)
    yield from ((formula, 0) for reference in scene.references for formula in reference.formulas)
    yield from chain.from_iterable(element.formulas() for element in scene.elements)


def prescribed_laws(scene: Scene) -> Iterator[Formula]:
    """Yield the formulas of time that joints and constraints follow: drives and prescribed coordinates."""
    yield from (formula for joint in scene.joints for formula in joint.drive)
    yield from (item.prescribed_coordinate for item in scene.constraints if item.prescribed_coordinate is not None)


def joint_factors(scene: Scene) -> tuple[Factor, ...]:
    """Return the factors of the configuration in joint coordinates, with slices of q and v, in the order of the joints.
    Joints that follow other joints have none."""
    factors: list[Factor] = []
    q = v = 0
    for joint in scene.leading_joints:
        q_size, v_size = joint.kind.sizes
        factors.append(Factor(joint.kind.group, joint.name, q, q_size, v, v_size))
        q, v = q + q_size, v + v_size
    return tuple(factors)


def _coordinates(scene: Scene) -> Iterator[Coordinates]:
    if scene.coordinates == "absolute":
        yield from (Coordinates(f"{body.name}.position", ("m",) * 3) for body in scene.bodies)
        return
    for joint in scene.leading_joints:
        if joint.kind.group == "R":
            yield Coordinates(joint.name, joint.kind.units)
    for body in scene.bodies:
        if body.beam is not None:
            yield _elastic(body.name, body.beam)


def _elastic(name: str, beam: Beam) -> Coordinates:
    """Return the description of a beam's elastic coordinates: units, largest small deformations, length, and validity.
    A beam of order 1 is valid, and has a positive definite inertia, for deformations that are small compared with its
    length. Higher modes have steeper slopes at the same deflection, so the limits of higher modes are smaller."""
    units: list[str] = []
    reach: list[float] = []
    for item in beam.deformations:
        units += item.units
        length = min(beam.length, 1.0) if item.nodal else 1.0 if item.kind == "torsion" else beam.length
        reach += [0.01 * length / (item.modes if item.nodal else number + 1) for number in range(item.modes)]
    return Coordinates(name, tuple(units), tuple(reach), beam.length, beam.order == 1)


def _limits(scene: Scene) -> Iterator[CoordinateLimit]:
    """Yield the limits of joint coordinates. In absolute coordinates only limits of angles exist, renamed to the
    counted angles ``q.NAME.angle`` that q holds in addition to the poses."""
    for joint in scene.joints:
        for stop, limit in zip(joint.stops, joint.limits, strict=True):
            if scene.coordinates != "absolute":
                yield limit
            elif stop.index < (angles := joint.kind.angles):
                yield replace(limit, coordinate=f"q.{joint.name}.angle" + (f"[{stop.index}]" if angles > 1 else ""))


def _lengths(scene: Scene) -> Iterator[tuple[Formula, ...]]:
    """Yield tuples of formulas for lengths, m: positions on bodies, mass centres, free lengths, radii, stops."""
    yield from (point.position for point in scene.points)
    yield from (body.center_of_mass for body in scene.bodies)
    yield from (joint.position for joint in scene.joints)
    for constraint in scene.constraints:
        yield from (constraint.first.position, constraint.second.position, constraint.semi_axes)
        yield (constraint.radius, constraint.tube_radius)
        if constant(constraint.length):
            yield (constraint.length,)
    yield from (lengths for element in scene.elements if (lengths := element.lengths()))
    yield from ((Number(body.beam.length),) for body in scene.bodies if body.beam is not None)
    for joint in scene.joints:
        yield from ((length,) for length in joint.lengths())


def _drawing(scene: Scene) -> Drawing:
    """Return the data of pictures: solids, hinges, points, lines, links, beams, shapes, surfaces and ground."""
    carried = {joint.child: joint for joint in scene.joints}
    # nodes of geometrically exact beams without joints of the scene
    free = {body.name for body in scene.bodies if body.node_of and body.name != body.node_of}
    drawn = [element.drawn() for element in scene.elements]
    return Drawing(
        solids=tuple(_solid(body, carried[body.name]) for body in scene.bodies),
        hinges=tuple(_hinge(joint) for joint in scene.joints if joint.child not in free),
        points=scene.points,
        lines=tuple(item for item in drawn if isinstance(item, Line)),
        links=tuple(_links(scene)),
        wheels=tuple(item for item in drawn if isinstance(item, Wheel)),
        shapes=(*scene.shapes, *_rolling_shapes(scene)),
        contact_surfaces=tuple(item for item in _contacts(scene) if item.size != ZERO),
        ground=_ground(scene),
    )


#: Width of the drawn wheel of a tyre, and of a rolling disc, by its radius.
_TYRE_WIDTH, _DISC_WIDTH = Number(0.5), Number(0.15)


def _touching(scene: Scene) -> Iterator[tuple[Any, Any]]:
    """Yield rolling and sliding constraints, and the force elements that touch by shapes of the same attributes, each
    with the wheel of a tyre."""
    yield from ((item, None) for item in scene.constraints if item.type in ("rolling", "sliding"))
    yield from ((element, element.drawn()) for element in scene.elements if element.touches)


def _rolling_shapes(scene: Scene) -> Iterator[Shape]:
    """Yield wheels of tyres and solids of bodies that touch a surface, for bodies without shapes in the scene."""
    shown = {shape.body for shape in scene.shapes}
    for item, wheel in _touching(scene):
        frame = item.second
        if frame.body in shown or item.shape == "point":
            continue
        radius, tube, width = item.radius, item.tube_radius, _DISC_WIDTH if wheel is None else _TYRE_WIDTH
        kind, sizes = {
            "ellipsoid": ("ellipsoid", item.semi_axes),
            "sphere": ("sphere", (radius,)),
            "torus": ("wheel", (radius + tube, Number(2.0) * tube)),
        }.get(item.shape, ("wheel", (radius, width * radius)))
        axes = frame.orientation if wheel is None or wheel.axis else rows(frame_about(_spin_axis(frame, scene)))
        yield Shape(item.name, frame.body, kind, frame.position, axes, sizes, implied=True)


def _spin_axis(center: Frame, scene: Scene) -> Array:
    """Return the axis of a wheel with the given centre, (3,), in the axes of the centre's body. It is the axis of a
    revolute joint at the centre, unless nearly vertical; else y, which lies across the road."""
    for joint in scene.joints:
        if joint.type == "revolute" and abs(joint.axis[2]) < 0.5:
            if joint.child == center.body and center.position == ZERO_VECTOR:
                return np.array(joint.axis)
            if joint.parent == center.body and center.position == joint.position:
                return np.asarray(np.array(joint.orientation) @ np.array(joint.axis))
    return np.array([0.0, 1.0, 0.0])


def _contacts(scene: Scene) -> Iterator[HeightSurface]:
    """Yield the surfaces z = height(x, y) of constraints: of rolling and sliding contacts, and of equations between two
    frames."""
    heights = [(item, item.equation) for item in scene.constraints if item.framed and item.equation is not None]
    for item, height in (*heights, *((item, item.surface) for item, wheel in _touching(scene) if wheel is None)):
        if height is not None:
            first, second = item.first, item.second
            plane = (first.body, first.position, first.orientation)
            size = item.semi_axes[0] if item.shape == "ellipsoid" else item.radius
            yield HeightSurface(item.name, *plane, height, second.body, second.position, size)


def _ground(scene: Scene) -> tuple[Formula, ...]:
    """Return a point, three formulas in m, of the plane on which the first constraint rolls or slides. Without such a
    plane, the point of the flat road of the first tyre; empty without either."""
    for item, _ in _touching(scene):
        frame, still = item.first, item.first.body == WORLD or (item.first.body == BASE and scene.base is None)
        if still and all(symbol.kind == "parameter" for symbol in symbols(item.surface or ZERO)):
            x, y, z = frame.position
            return (x, y, z if item.surface is None else z + item.surface)
    return ()


def _hinge(joint: Joint) -> Hinge:
    hinge_fields = joint.name, joint.type, joint.parent, joint.child, joint.position, joint.axis
    return Hinge(*hinge_fields, *joint.kind.drawn, tied=joint.kind.group != "SE3")


def _links(scene: Scene) -> Iterator[DrawnLink]:
    """Yield constraints between two frames, and elements of geometrically exact beams, as lines between two places."""
    for item in scene.constraints:
        if item.framed:
            first, second = (Point("", frame.body, frame.position) for frame in (item.first, item.second))
            yield DrawnLink(item.name, first, second, visible=item.kind.rod)
    for element in scene.elements:
        if isinstance(element, CosseratBeam):
            for start, end in pairwise(element.beam.nodes):
                yield DrawnLink(end, Point("", start, ZERO_VECTOR), Point("", end, ZERO_VECTOR), visible=True)


def _solid(body: Body, joint: Joint) -> Solid:
    hub = "center" if joint.kind.group == "SE3" else "origin"
    return Solid(body.name, body.mass, body.center_of_mass, body.inertia, hub)
