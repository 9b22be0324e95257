"""Sensors of MJCF as outputs: of joints, tendons, actuators, frames and trees of bodies.

Quantities as MuJoCo's documentation has them, "XML reference: sensor"; accelerations of frames include gravity, as an
accelerometer measures them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from eomgen.base.messages import listed
from eomgen.products.robots.mjcf.draft import Draft, clipped, times, total
from eomgen.products.robots.mjcf.equalities import site_place
from eomgen.products.robots.scene_draft import LinkPlace, number
from eomgen.system.description import BASE


def convert_sensors(draft: Draft) -> None:
    """Add the sensors of a file as outputs of their names; list the sensors that no scene has in a note."""
    model = draft.model
    if model.nsensor and draft.disabled("SENSOR"):
        place = draft.place("sensor", 0, model.nsensor)
        draft.leave_out(place, f"not modelled: sensors ({model.nsensor}), which the file switches off [W0252]")
        return
    absent = []
    for index in range(model.nsensor):
        kind = draft.mujoco.mjtSensor(int(model.sensor_type[index])).name.removeprefix("mjSENS_")
        components = _KINDS[kind](draft, index) if kind in _KINDS and _is_plain(draft, index) else None
        written = draft.written("sensor", index)
        if components is None:
            absent.append(written or kind.lower())
            continue
        bound = float(model.sensor_cutoff[index])
        if bound > 0.0 and int(model.sensor_datatype[index]) == int(draft.mujoco.mjtDataType.mjDATATYPE_REAL):
            components = [clipped(component, -bound, bound) for component in components]
        name = draft.name("output", written, f"sensor_{index + 1}")
        draft.section("outputs")[name] = {"formula": components if len(components) > 1 else components[0]}
        draft.lines[f"outputs.{name}"] = str(draft.place("sensor", index, model.nsensor))
    if absent:
        place = draft.place("sensor", 0, model.nsensor)
        draft.leave_out(place, f"not modelled: sensors ({len(absent)}: {listed(absent)}) [W0155]")


def _is_plain(draft: Draft, index: int) -> bool:
    """Return whether a sensor measures against the world, at once and at all times."""
    model = draft.model
    late = [getattr(model, name) for name in ("sensor_delay", "sensor_interval") if hasattr(model, name)]
    return int(model.sensor_refid[index]) < 0 and not any(np.any(values[index]) for values in late)


#: The components of a sensor; None for one that no scene has.
_Components = Callable[[Draft, int], list[str] | None]


def _object(draft: Draft, index: int) -> int:
    return int(draft.model.sensor_objid[index])


def _joint(letter: str, size: int) -> _Components:
    def components(draft: Draft, index: int) -> list[str]:
        name = draft.joints[_object(draft, index)]
        return [f"{letter}.{name}"] if size == 1 else [f"{letter}.{name}[{k}]" for k in range(size)]

    return components


def _tendon(suffix: str) -> _Components:
    def components(draft: Draft, index: int) -> list[str] | None:
        tendon = draft.tendons.get(_object(draft, index))
        return None if tendon is None else [f"{tendon}{suffix}"]

    return components


def _actuator_motion(part: int) -> _Components:
    def components(draft: Draft, index: int) -> list[str] | None:
        motion = draft.actuator_motions.get(_object(draft, index))
        return [motion[part]] if motion else None

    return components


def _actuator_force(draft: Draft, index: int) -> list[str] | None:
    force = draft.actuator_forces.get(_object(draft, index))
    return [force] if force else None


def _frame(draft: Draft, index: int) -> tuple[str, LinkPlace] | None:
    """Return a name for the frame of a sensor, and its pose; None for other objects than frames."""
    model, kinds, number_of_object = draft.model, draft.mujoco.mjtObj, _object(draft, index)
    kind = int(model.sensor_objtype[index])
    if kind == kinds.mjOBJ_SITE:
        return f"site_{draft.written('site', number_of_object) or number_of_object}", site_place(
            draft, number_of_object
        )
    rows: dict[int, tuple[str, int, Sequence[float], Sequence[float] | None]] = {}
    if kind in (kinds.mjOBJ_BODY, kinds.mjOBJ_XBODY):
        inertial = kind == kinds.mjOBJ_BODY
        position = model.body_ipos[number_of_object] if inertial else (0.0, 0.0, 0.0)
        rows[kind] = (
            "inertial" if inertial else "body",
            number_of_object,
            position,
            model.body_iquat[number_of_object] if inertial else None,
        )
    elif kind == kinds.mjOBJ_GEOM:
        body = int(model.geom_bodyid[number_of_object])
        rows[kind] = "geom", body, model.geom_pos[number_of_object], model.geom_quat[number_of_object]
    if kind not in rows:
        return None
    word, body, position, quaternion = rows[kind]
    place = draft.places[body].of(np.array(position), None if quaternion is None else np.array(quaternion))
    return f"{word}_{number_of_object}", place


def _of_frame(vector: Callable[[Draft, str, LinkPlace], Sequence[str]], *, local: bool) -> _Components:
    """Return the components of a vector at a frame, in world axes or in the axes of the frame."""

    def components(draft: Draft, index: int) -> list[str] | None:
        frame = _frame(draft, index)
        if frame is None:
            return None
        center, axes = draft.frame_points(*frame)
        world = vector(draft, center, frame[1])
        if not local:
            return list(world)
        return [
            total([f"{a} * {part}" for a, part in zip(draft.along(center, end), world, strict=True)]) for end in axes
        ]

    return components


def _position(draft: Draft, center: str, place: LinkPlace) -> list[str]:
    return [f"position.{center}[{i}]" for i in range(3)]


def _velocity(draft: Draft, center: str, place: LinkPlace) -> list[str]:
    return [f"velocity.{center}[{i}]" for i in range(3)]


def _angular_velocity(draft: Draft, center: str, place: LinkPlace) -> list[str]:
    return ["0.0"] * 3 if place.body == BASE else [f"angular_velocity.{place.body}[{i}]" for i in range(3)]


def _acceleration(draft: Draft, center: str, place: LinkPlace) -> list[str]:
    gravity = draft.data["gravity"]
    return [f"(acceleration.{center}[{i}] - {number(gravity[i])})" for i in range(3)]


def _magnetic(draft: Draft, center: str, place: LinkPlace) -> list[str]:
    return [number(float(value)) for value in draft.model.opt.magnetic]


def _axis(k: int) -> _Components:
    def components(draft: Draft, index: int) -> list[str] | None:
        frame = _frame(draft, index)
        if frame is None:
            return None
        center, axes = draft.frame_points(*frame)
        return draft.along(center, axes[k])

    return components


def _of_tree(word: str) -> _Components:
    """Return the mean of a quantity of the centres of mass of all bodies of a tree, weighted by mass."""

    def components(draft: Draft, index: int) -> list[str] | None:
        model, root = draft.model, _object(draft, index)
        inside = []
        for body in range(1, model.nbody):
            above = body
            while above not in (0, root):
                above = int(model.body_parentid[above])
            if above == root and float(model.body_mass[body]) > 0.0:
                inside.append(body)
        mass = float(np.sum(model.body_mass[inside]))
        if not mass:
            return None
        centers = []
        for body in inside:
            place = draft.places[body].of(np.array(model.body_ipos[body]), np.array(model.body_iquat[body]))
            centers.append(draft.point(f"inertial_{body}", place))
        shares = [float(model.body_mass[body]) / mass for body in inside]
        return [
            draft.sum_of(word, [times(share, f"{word}.{c}[{i}]") for share, c in zip(shares, centers, strict=True)])
            for i in range(3)
        ]

    return components


def _formula(text: str) -> _Components:
    return lambda draft, index: [text]


_KINDS: dict[str, _Components] = {
    "JOINTPOS": _joint("q", 1),
    "JOINTVEL": _joint("v", 1),
    "BALLQUAT": _joint("q", 4),
    "BALLANGVEL": _joint("v", 3),
    "TENDONPOS": _tendon(""),
    "TENDONVEL": _tendon("_rate"),
    "ACTUATORPOS": _actuator_motion(0),
    "ACTUATORVEL": _actuator_motion(1),
    "ACTUATORFRC": _actuator_force,
    "FRAMEPOS": _of_frame(_position, local=False),
    "FRAMEXAXIS": _axis(0),
    "FRAMEYAXIS": _axis(1),
    "FRAMEZAXIS": _axis(2),
    "FRAMELINVEL": _of_frame(_velocity, local=False),
    "FRAMEANGVEL": _of_frame(_angular_velocity, local=False),
    "FRAMELINACC": _of_frame(_acceleration, local=False),
    "ACCELEROMETER": _of_frame(_acceleration, local=True),
    "VELOCIMETER": _of_frame(_velocity, local=True),
    "GYRO": _of_frame(_angular_velocity, local=True),
    "MAGNETOMETER": _of_frame(_magnetic, local=True),
    "SUBTREECOM": _of_tree("position"),
    "SUBTREELINVEL": _of_tree("velocity"),
    "CLOCK": _formula("t"),
    "E_KINETIC": _formula("energy.kinetic"),
}
