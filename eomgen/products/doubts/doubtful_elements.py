"""Notes on elements that are allowed and hardly ever meant: beams too thick or with long rigid arms, negative stiffness
or damping, springs within one body, tyres that start in the road."""

from __future__ import annotations

import contextlib
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.limits import Limit
from eomgen.base.messages import key_of, listed
from eomgen.formula.nodes import ZERO, Vector
from eomgen.scene.bodies.cosserat import STRAINS, Cosserat
from eomgen.scene.bodies.cross_sections import SHAPES
from eomgen.scene.design_poses import UnknownPoseError
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.values import Values
from eomgen.system.description import Point

if TYPE_CHECKING:
    from eomgen.scene.bodies.beam_schema import SectionEntry
    from eomgen.scene.document.notes import SceneFacts
    from eomgen.scene.document.schema import SceneDocument

SLENDEREST = Limit(
    2.5e4,
    "1",
    "length of a beam in parts of the largest size of its section",
    "a slenderness of 1e5 of a round section",
)
BESIDE = Limit(0.25, "1", "distance of a place from the axis of a beam in parts of its length", "a choice")
NOISE = Limit(1e-3, "1", "forces due to rounding of lengths in parts of the loads of a beam", "a choice: 0.1 %")
UPRIGHT = Limit(0.9, "1", "vertical part of the unit vector along the axis of a wheel", "64 degrees of camber")


def doubtful_beams(facts: SceneFacts) -> list[str]:
    """Return notes on beams whose sections, stiffness of stretch, or places off the axis are doubtful."""
    document, elements, values = facts.document, facts.scene["elements"], facts.values
    exact = {element.beam.name: element.beam for element in elements if isinstance(element, CosseratBeam)}
    lengths = {name: beam.length for name, beam in exact.items()}
    axes = {node: name for name, beam in exact.items() for node in beam.nodes}
    for body in facts.scene["bodies"]:
        if body.beam is not None:
            lengths[body.name], axes[body.name] = body.beam.length, body.name
    return [
        *_sizes(document, lengths, values),
        *(note for beam in exact.values() for note in _stiff_stretch(beam, document, values)),
        *_rigid_arms(facts, axes, lengths),
    ]


def _sizes(document: SceneDocument, lengths: Mapping[str, float], values: Values) -> Iterator[str]:
    """Yield a note on sections larger than the length of the beam (``lengths``, m, by beam), or negligible compared
    with the length."""
    for name, length in lengths.items():
        entry, key = document.section("beams")[name], key_of("beams", name)
        tables = [(f"{key}.section", entry.section)]
        tables += [(f"{key}.parts[{number}].section", part.section) for number, part in enumerate(entry.parts)]
        sizes = [size for path, section in tables if section is not None for size in _of(path, section, values)]
        for path, size in sizes:
            if size >= length:
                note = f"{size:.6g} m is more than the length of the beam, {length:.6g} m [W0107]"
                yield f"{path}: {note}; {1e-3 * size:.6g} if it is in mm"
        path, largest = max(sizes, key=lambda pair: pair[1], default=("", math.inf))
        if 0.0 < largest < length / SLENDEREST:
            note = (
                f"the beam is {length:.6g} m long, {length / largest:.3g} times as long as its sections are thick"
                f" ({path} {largest:.3g} m) [W0106]"
            )
            yield f"{key}: {note}; numbers without a unit are in m"


def _of(key: str, section: SectionEntry, values: Values) -> Iterator[tuple[str, float]]:
    """Yield key and value, m, of the largest size of a section, halfway along a beam. A section without a shape has the
    root of the area; a section without a positive size yields none."""
    there = values.at(0.5)
    fields = ("area",) if section.shape is None else SHAPES[section.shape].sizes
    pairs = [(f"{key}.{field}", getattr(section, field)) for field in fields]
    sizes = [(path, there.value(there.formula(path, value, PARAMETERS))) for path, value in pairs if value is not None]
    sizes = [(path, math.sqrt(size) if section.shape is None else size) for path, size in sizes if size > 0.0]
    if sizes:
        yield max(sizes, key=lambda pair: pair[1])


def _stiff_stretch(beam: Cosserat, document: SceneDocument, values: Values) -> Iterator[str]:
    """Yield a note on a stretch stiffness so large that rounded positions exert forces as large as the loads."""
    stretch, bend = (STRAINS.index(strain) for strain in ("stretch", "bending_z"))
    if stretch in beam.absent_strains:
        return
    sections = list({id(part.section): part.section for part in beam.parts}.values())  # equal elements share one
    largest = max(values.value(section.stiffness[stretch][stretch]) for section in sections)
    bending = max(
        values.value(section.stiffness[k][k]) for section in sections for k in (bend, STRAINS.index("bending_y"))
    )
    weight = max(values.value(section.mass_per_length) for section in sections) * beam.length * 9.81
    noise, loads = 1e-16 * largest, max(bending / beam.length / beam.length, weight)
    if noise > NOISE * loads:
        note = f"the stiffness of stretch is {largest:.3g} N, by which rounding of positions exerts {noise:.2g} N, and"
        note += f" its bending and its weight exert {loads:.2g} N"
        field = ".stiffness.stretch" if document.section("beams")[beam.name].stiffness is not None else ""
        yield f'{key_of("beams", beam.name)}{field}: {note}; model = "inextensible" does not stretch at all [W0289]'


def _rigid_arms(facts: SceneFacts, axes: Mapping[str, str], lengths: Mapping[str, float]) -> Iterator[str]:
    """Yield a note on each place of a point or force element that is far from the axis of a beam. ``axes`` has the beam
    by the body that carries places on it, ``lengths`` the length of beams, m."""
    places: list[tuple[str, str, Vector]] = [
        (
            key_of("points" if point.name in facts.document.section("points") else "frames", point.name, "position"),
            point.body,
            point.position,
        )
        for point in facts.scene["points"]
    ]
    for element in facts.scene["elements"]:
        places += [
            (key_of(element.section, element.name, *parts), body, position)
            for parts, body, position in element.places()
        ]
    for key, body, position in places:
        if body in axes:
            beam = axes[body]
            off = math.hypot(*(facts.values.value(part) for part in position[1:]))
            if off > BESIDE * lengths[beam]:
                note = f"{off:.4g} m off the axis of the beam {beam}, which is {lengths[beam]:.4g} m long"
                yield f"{key}: {note}: a rigid arm reaches from its sections to there [W0108]"


def negative_laws(facts: SceneFacts) -> Iterator[str]:
    """Yield a note on each joint and spring whose damping or stiffness is below zero at the default parameters."""
    springs = [*facts.elements("springs"), *facts.elements("torsion_springs")]
    for field, text in (
        ("damping", "the damping {:.6g} is negative, and adds energy to every motion; {:.6g} takes it away [W0278]"),
        (
            "stiffness",
            "the stiffness {:.6g} is negative, and pushes away from where the spring is slack; {:.6g} pulls back"
            " [W0279]",
        ),
    ):
        laws = [
            (key_of("joints", joint.name), law)
            for joint in facts.scene["joints"]
            for law in joint.each(getattr(joint, field))
        ]
        laws += [(key_of(spring.section, spring.name), getattr(spring, field)) for spring in springs]
        for key, law in dict.fromkeys(laws):  # a coefficient of all coordinates of a joint once
            with contextlib.suppress(ArithmeticError):
                if law != ZERO and (value := facts.values.value(law)) < 0.0:
                    yield f"{key}.{field}: {text.format(value, -value)}"


def springs_without_laws(facts: SceneFacts) -> list[str]:
    """Return a note on each spring with neither stiffness nor damping nor force, unless a formula reads it."""
    read = {name for kind, name in facts.values.mentioned if kind in ("length", "rate", "tension")}
    return [
        f"{key_of(element.section, element.name)}: a spring without stiffness, damping and force has no effect [W0259]"
        for element in facts.elements("springs")
        if all(getattr(element, field) == ZERO for field in ("stiffness", "damping", "force"))
        and element.name not in read
    ]


def springs_within_bodies(facts: SceneFacts) -> list[str]:
    """Return a note on each spring between two points of one body, which has no effect on the motion."""
    document, notes = facts.document, []
    points = {**document.section("frames"), **document.section("points")}
    for name, spring in document.section("springs").items():
        first, second = points.get(spring.first), points.get(spring.second)
        if first is None or second is None:
            continue
        if first.body == second.body and first.body not in document.section("beams"):
            note = f"both its points are fixed in {first.body}, so the spring moves nothing"
            notes.append(f"{key_of('springs', name)}: {note} [W0109]")
    return notes


def tyres_in_the_road(facts: SceneFacts) -> list[str]:
    """Return notes on tyres that start deep in the road, at zero inputs and t = 0, or with a nearly upright axis of
    spin."""
    tyres, values, notes = facts.elements("tyres"), facts.values, list[str]()
    by_name, places = {point.name: point for point in facts.scene["points"]}, facts.places if tyres else {}
    for wheel in (tyre.drawn() for tyre in tyres):
        point = by_name.get(wheel.center)
        if point is None or point.body not in places:
            continue
        turned, origin = places[point.body]
        center = origin + turned @ np.array([values.value(part) for part in point.position])
        if wheel.axis is not None and abs((turned @ np.array(wheel.axis))[2]) > UPRIGHT:
            key = f"{key_of('tyres', wheel.name)}.slip.axis"
            notes.append(
                f"{key}: the spin axis stands nearly upright at the start, and the wheel lies on its side [W0257];"
                " try: a level axis, as [0, 1, 0] of a wheel that rolls along x"
            )

        from eomgen.products.doubts.places import depth_note  # noqa: PLC0415  # most scenes have no tyres

        if note := depth_note(wheel, center, 0.0, values.parameters, defaultdict(float)):
            notes.append(f"{key_of('tyres', wheel.name)}: {note} [W0110]")
    return notes


ON_AXIS = Limit(1e-6, "m", "distance of a point from the axis of a joint that turns", "a choice: 1 um")


def shapes_that_leave_points(facts: SceneFacts) -> Iterator[str]:
    """Yield a note on each end of a shape that is a point of another body, which a joint between both bodies moves.

    Chains of joints are judged in scenes without constraints alone.
    """
    document, reading = facts.document, facts.reading
    joints: Mapping[str, Joint] = {joint.child: joint for joint in reading.items["joints"].values()}
    points: Mapping[str, Point] = reading.items["points"]
    for name, entry in document.section("shapes").items():
        for side in ("first", "second"):
            point = points.get(getattr(entry, side) or "")
            if point is None or point.body == entry.body:
                continue
            here, there = _carriers(entry.body, joints), _carriers(point.body, joints)
            apart = [body for body in (*here, *there) if (body in here) != (body in there)]
            between = [joints[body] for body in apart if body in joints]
            if len(between) > 1 and document.section("constraints"):
                continue
            moving = [joint.name for joint in between if joint.kind.moves and not _keeps(joint, point, reading.values)]
            if moving:
                fault = f"the point {point.name} belongs to {point.body}, and the shape moves with {entry.body}"
                leaves = f"motion of {listed(moving)} takes one from the other"
                yield f"{key_of('shapes', name, side)}: {fault}: {leaves}; try: a point of {entry.body} [W0111]"


def _carriers(body: str, joints: Mapping[str, Joint]) -> list[str]:
    """Return a body and the bodies that carry this body, up to the root; ``joints`` are by their child."""
    path = [body]
    while path[-1] in joints and joints[path[-1]].parent not in path:
        path.append(joints[path[-1]].parent)
    return path


def _keeps(joint: Joint, point: Point, values: Values) -> bool:
    """Return whether a joint only turns, about an axis or a centre that the point is on, so that the point stays; True
    also for places that are unknown."""
    motions = joint.kind.chain
    if any(motion.kind not in ("turn", "ball") for motion in motions):
        return False
    try:
        way = values.design.way((joint.parent, joint.position), (point.body, point.position))
        axes = values.design.pose(joint.child).axes
    except UnknownPoseError:
        return True
    apart = np.array([values.value(part) for part in way])
    if len(motions) == 1 and motions[0].kind == "turn":
        apart = np.cross(axes @ np.array(joint.axis), apart)
    return not float(np.linalg.norm(apart)) > ON_AXIS
