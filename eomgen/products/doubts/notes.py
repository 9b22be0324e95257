"""Notes of a scene, one row for each kind of doubtful value."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.base.messages import key_of, unused_note
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import law_and_rate
from eomgen.products.doubts.doubtful_elements import (
    BESIDE,
    NOISE,
    ON_AXIS,
    SLENDEREST,
    UPRIGHT,
    doubtful_beams,
    negative_laws,
    shapes_that_leave_points,
    springs_within_bodies,
    springs_without_laws,
    tyres_in_the_road,
)
from eomgen.products.doubts.out_of_scale import (
    DENSEST,
    FACTOR,
    GYRATION,
    HEAVIEST,
    MANY_SAMPLES,
    RARE,
    angles_against_numbers,
    angles_of_several_turns,
    doubtful_times,
    lengths_against_numbers,
    out_of_scale,
    scene_size,
)
from eomgen.scene.control.controllers import outputs_of_controllers, states_of_controllers
from eomgen.scene.document.notes import Note, SceneFacts
from eomgen.scene.formula.namespaces import read_as_written
from eomgen.scene.formula.scope import ANYWHERE
from eomgen.scene.joint_types import JOINTS
from eomgen.system.description import BASE
from eomgen.system.events import mode_parameter
from eomgen.system.motions import motion_parameters


def unused_names(facts: SceneFacts) -> list[str]:
    """Return a note on each kind of names that no formula mentions (parameters, inputs, curves, and entries that serve
    formulas alone), and on each mode and controller without effect."""
    notes, document, reading, values = [], facts.document, facts.reading, facts.values
    mentioned = values.mentioned
    by_parameters = {name for name in values.names.motions if ("parameter", motion_parameters(name)[0]) in mentioned}
    for kind in ("parameter", "input", "curve"):
        known = by_parameters | {name for of, name in mentioned if of == kind}
        unused = [name for name in document.section(f"{kind}s") if name not in known]
        notes.append(unused_note(kind, f"{kind}s", unused))
    notes = list(filter(None, [*notes, *(unused_note(*row.unused(reading)) for row in reading.rows)]))
    for name in document.section("modes"):
        if ("parameter", mode_parameter(name)) not in values.mentioned:
            notes.append(f"the mode {name} changes nothing: no formula mentions it [W0102]")
    read = {name for kind, name in values.mentioned if kind in ("controller", "state")}
    for name, controller in document.section("controllers").items():
        alone = {name: controller}
        if read.isdisjoint([*outputs_of_controllers(alone), *states_of_controllers(alone)]):
            notes.append(f"the controller {name} changes nothing: no formula mentions what it gives [W0103]")
    return notes


def efforts_on_drives(facts: SceneFacts) -> list[str]:
    """Return a note on each effort on a joint whose motion is prescribed by a drive."""
    return [
        f"{key_of('efforts', name)}: the joint {effort.joint} is driven, so the effort changes nothing of its motion,"
        f" only drive_effort.{effort.joint} [W0104]"
        for name, effort in facts.document.section("efforts").items()
        if (joint := facts.document.section("joints").get(effort.joint)) is not None and joint.drive is not None
    ]


def loads_without_size(facts: SceneFacts) -> list[str]:
    """Return a note on each force with neither ``force`` nor ``torque``, and on each effort without ``index`` on a
    joint of several velocity components."""
    notes, joints = [], facts.document.section("joints")
    for name, force in facts.document.section("forces").items():
        if not {"force", "torque"} & force.model_fields_set:
            notes.append(f"{key_of('forces', name)}: a load without force and torque has no effect [W0258]")
    for name, effort in facts.document.section("efforts").items():
        kind = JOINTS.get(joints[effort.joint].type) if effort.joint in joints else None
        if kind is not None and kind.v_size > 1 and "index" not in effort.model_fields_set:
            first = f"without an index the effort acts on v.{effort.joint}[0] of {kind.v_size} components"
            notes.append(f"{key_of('efforts', name)}: {first}; angular ones come first [W0255]")
    return notes


def _below_planes(facts: SceneFacts) -> Iterator[str]:
    """Yield a note on each body that starts below the plane on which a constraint lets it roll or slide, or below the
    plane of a contact."""
    places, value = {BASE: (np.eye(3), np.zeros(3)), **facts.places}, facts.values.value
    touching = [("constraints", item) for item in facts.scene["constraints"] if item.type in ("rolling", "sliding")]
    touching += [(item.section, item) for item in facts.scene["elements"] if item.touches]
    for section, item in touching if facts.places else ():
        if item.surface is not None:
            continue
        if not {item.first.body, item.second.body} <= places.keys():
            continue
        (turned, origin), (of_second, second) = places[item.first.body], places[item.second.body]
        origin = origin + turned @ [value(part) for part in item.first.position]
        second = second + of_second @ [value(part) for part in item.second.position]
        normal = turned @ np.array(item.first.orientation)[:, 2]
        if (height := float(normal @ (second - origin))) < 0.0:
            fault = f"{item.second.body} starts {-height:.3g} m below the plane, and is moved to the side of its z axis"
            remedy = "first.axis in the opposite direction, or a start on this side"
            yield f"{key_of(section, item.name)}: {fault}; try: {remedy} [W0113]"


def _base_with_gravity(facts: SceneFacts) -> Iterator[str]:
    """Yield a note if the base has the acceleration of gravity."""
    acceleration, gravity = (facts.data.get("base") or {}).get("acceleration"), facts.document.gravity
    if acceleration is None or tuple(acceleration) != gravity or not any(gravity):
        return
    fault = "base.acceleration is the gravity of the scene: the base falls freely, and bodies in it have no weight"
    yield f"{fault}; try: no acceleration, if gravity alone is meant [W0114]"


SAME_GRAVITY = Limit(
    0.02, "1", "difference of a mean acceleration and gravity in parts of gravity", "errors of accelerometers"
)


def _base_against_gravity(facts: SceneFacts) -> Iterator[str]:
    """Yield notes on a mean acceleration of the base opposite to gravity, and on an axis along which both position and
    acceleration move the base."""
    written, base = facts.data.get("base", {}), facts.scene["base"]
    if base is None or written.get("acceleration") is None:
        return
    positions = written.get("position", (0.0, 0.0, 0.0))
    duration = facts.document.simulation.duration or 1.0
    times = np.linspace(0.0, duration, 257)
    for axis, gravity in enumerate(facts.document.gravity):
        if written["acceleration"][axis] == 0.0:
            continue
        speeds = law_and_rate(base.position[axis], facts.values.parameters)(times)[1]
        mean = float(speeds[-1] - speeds[0]) / duration
        key = f"base.acceleration[{axis}]"
        if isinstance(gravity, int | float) and gravity and abs(mean + gravity) <= SAME_GRAVITY * abs(gravity):
            fault = f"{key} has a mean of {mean:.4g} m/s^2, opposite to gravity: an accelerometer at rest reads this"
            yield f"{fault}, and the base moves away; try: the readings with {gravity:+.6g} added [W0115]"
        position = positions[axis]
        names = facts.values.names
        if isinstance(position, str) and Symbol("time") in symbols(read_as_written(position, names, ANYWHERE)):
            fault = f"base.position[{axis}] and {key} both move the base over time, and their motions add"
            yield f"{fault}; try: one of the two, if they describe the same motion [W0116]"


RANGE = Limit(10.0, "1", "range of a to and fro motion of the base in sizes of the scene", "a choice")
SHOCK = Limit(100.0, "m/s^2", "acceleration of this motion", "ten times gravity")


def _base_out_of_scale(facts: SceneFacts) -> Iterator[str]:
    """Yield notes on rotations of the base to and fro over more than a turn, and on shaking over many times the scene's
    size."""
    base = facts.scene["base"]
    if base is None:
        return
    times = np.linspace(0.0, facts.document.simulation.duration or 10.0, 2056)
    for index, rotation in enumerate(base.rotations[len(base.added_by) :]):
        angle, _ = _to_and_fro(rotation.angle, times, facts)
        if angle > 2.0 * np.pi:
            fault = f"goes to and fro over {angle:.4g} rad, {angle / (2.0 * np.pi):.3g} turns"
            remedy = 'angles in formulas are radians; try: a parameter of "30 deg" as the amplitude'
            yield f"base.rotation[{index}].angle {fault}: {remedy} [W0117]"
    size = facts.once(scene_size)
    for axis, law in enumerate(base.position):
        travel, acceleration = _to_and_fro(law, times, facts)
        if size > 0.0 and travel > RANGE * size and acceleration > SHOCK:
            fault = f"shakes the base over {travel:.4g} m, and the size of the scene is {size:.3g} m"
            remedy = "numbers without a unit are in m; try: the unit of the curve's values, or a factor of 0.001"
            yield f"base.position[{axis}] {fault}: {remedy} [W0290]"


def _to_and_fro(law: Formula, times: Array, facts: SceneFacts) -> tuple[float, float]:
    """Return range and largest second derivative, over the times (n,) in s, of a law of time that changes direction; 0
    and 0 for any other law."""
    used = symbols(law)
    if not any(symbol.kind == "time" for symbol in used) or any(
        symbol.kind not in ("time", "parameter") for symbol in used
    ):
        return 0.0, 0.0
    values, rates = law_and_rate(law, facts.values.parameters)(times)
    defined = np.isfinite(values) & np.isfinite(rates)
    values, rates, times = values[defined], rates[defined], times[defined]
    if len(times) < 2 or not np.min(rates) < 0.0 < np.max(rates):
        return 0.0, 0.0
    return float(np.ptp(values)), float(np.max(np.abs(np.gradient(rates, times))))


#: In the order of listing, after the notes of the core.
NOTES: tuple[Note, ...] = (
    Note("unused names", unused_names),
    Note("plain angles", angles_of_several_turns),
    Note("plain angles in formulas", angles_against_numbers),
    Note("plain lengths in formulas", lengths_against_numbers, limits=(FACTOR,)),
    Note("plain times", doubtful_times, limits=(MANY_SAMPLES, RARE)),
    Note("negative stiffness or damping", negative_laws),
    Note("springs without laws", springs_without_laws),
    Note("springs within a body", springs_within_bodies),
    Note("shapes that leave their points", shapes_that_leave_points, limits=(ON_AXIS,)),
    Note("values out of scale", out_of_scale, limits=(FACTOR, GYRATION, DENSEST, HEAVIEST)),
    Note("efforts on drives", efforts_on_drives),
    Note("loads without a size or a component", loads_without_size),
    Note("doubtful beams", doubtful_beams, limits=(SLENDEREST, BESIDE, NOISE)),
    Note("tyres in the road", tyres_in_the_road, limits=(UPRIGHT,)),
    Note("bodies below planes of contact", _below_planes),
    Note("base that falls freely", _base_with_gravity),
    Note("base opposite to gravity or moved twice", _base_against_gravity, limits=(SAME_GRAVITY,)),
    Note("base with motions far beyond the scene", _base_out_of_scale, limits=(RANGE, SHOCK)),
)
