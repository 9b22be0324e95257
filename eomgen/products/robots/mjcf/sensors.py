"""Sensors of MJCF as outputs: of joints, tendons, actuators, frames and trees of bodies.

Quantities as MuJoCo's documentation has them, "XML reference: sensor"; accelerations of frames include gravity, as an
accelerometer measures them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.messages import listed
from eomgen.products.robots.mjcf.draft import MjcfDraft, clip, times, total
from eomgen.products.robots.mjcf.equalities import site_place
from eomgen.products.robots.mjcf.tree import bodies_above
from eomgen.products.robots.scene_draft import LinkPlace, number
from eomgen.system.description import BASE


def convert_sensors(draft: MjcfDraft) -> None:
    """Add the sensors of a file as outputs of their names, limited by their cutoff; list the sensors that no scene has,
    or that the file switches off, in a note."""
    model = draft.model
    if model.nsensor and draft.is_disabled("SENSOR"):
        location = draft.place("sensor", 0, model.nsensor)
        draft.leave_out(location, f"not modelled: sensors ({model.nsensor}), which the file switches off [W0252]")
        return
    absent = []
    for index in range(model.nsensor):
        kind = draft.mujoco.mjtSensor(int(model.sensor_type[index])).name.removeprefix("mjSENS_")
        components = _KINDS[kind](draft, index) if kind in _KINDS and _is_plain(draft, index) else None
        written = draft.element_name("sensor", index)
        if components is None:
            absent.append(written or kind.lower())
            continue
        bound = float(model.sensor_cutoff[index])
        if bound > 0.0 and int(model.sensor_datatype[index]) == int(draft.mujoco.mjtDataType.mjDATATYPE_REAL):
            components = [clip(component, -bound, bound) for component in components]
        name = draft.name("output", written, f"sensor_{index + 1}")
        formula = components if len(components) > 1 else components[0]
        draft.put("outputs", name, {"formula": formula}, draft.place("sensor", index, model.nsensor))
    if absent:
        location = draft.place("sensor", 0, model.nsensor)
        draft.leave_out(location, f"not modelled: sensors ({len(absent)}: {listed(absent)}) [W0155]")


def _is_plain(draft: MjcfDraft, index: int) -> bool:
    """Return whether a sensor measures against the world, at once and at all times."""
    model = draft.model
    late = np.any(model.sensor_delay[index]) or np.any(model.sensor_interval[index])
    return bool(model.sensor_refid[index] < 0 and not late)


#: The components of a sensor; None for one that no scene has.
_Components = Callable[[MjcfDraft, int], list[str] | None]


def _object(draft: MjcfDraft, index: int) -> int:
    return int(draft.model.sensor_objid[index])


def _joint(letter: str, size: int) -> _Components:
    def components(draft: MjcfDraft, index: int) -> list[str]:
        name = draft.joints[_object(draft, index)]
        return [f"{letter}.{name}"] if size == 1 else [f"{letter}.{name}[{k}]" for k in range(size)]

    return components


def _part(parts: Callable[[MjcfDraft], Mapping[int, Any]], component: Callable[[Any], str]) -> _Components:
    """Return a function that gives the formula of a sensor, by ``component`` from the object in the mapping that
    ``parts`` takes of the draft; None for an object that is not there."""

    def components(draft: MjcfDraft, index: int) -> list[str] | None:
        part = parts(draft).get(_object(draft, index))
        return [component(part)] if part else None

    return components


class _Frame(NamedTuple):
    """Names of the points at the origin of a frame and 1 m along its axes, and its pose."""

    center: str
    ends: Sequence[str]
    pose: LinkPlace


def _frame(draft: MjcfDraft, index: int) -> _Frame | None:
    """Return the frame of a sensor, with points at the origin and along the axes, which are added; None for other
    objects."""
    model, kinds, target = draft.model, draft.mujoco.mjtObj, _object(draft, index)
    kind = int(model.sensor_objtype[index])
    if kind == kinds.mjOBJ_SITE:
        name, placement = f"site_{draft.element_name('site', target) or target}", site_place(draft, target)
    elif kind == kinds.mjOBJ_XBODY:
        name, placement = f"body_{target}", draft.places[target].of(np.zeros(3))
    elif kind == kinds.mjOBJ_BODY:
        name, placement = f"inertial_{target}", _inertial_place(draft, target)
    elif kind == kinds.mjOBJ_GEOM:
        carrier = draft.places[int(model.geom_bodyid[target])]
        name, placement = f"geom_{target}", carrier.of(np.array(model.geom_pos[target]), model.geom_quat[target])
    else:
        return None
    return _Frame(*draft.frame_points(name, placement), placement)


def _inertial_place(draft: MjcfDraft, body: int) -> LinkPlace:
    return draft.places[body].of(np.array(draft.model.body_ipos[body]), draft.model.body_iquat[body])


def _frame_components(vector: Callable[[MjcfDraft, _Frame], Sequence[str]], *, local: bool) -> _Components:
    """Return a function that gives the formulas of the components of a vector at a sensor's frame, in world axes or,
    ``local``, in the axes of the frame; None for a sensor without a frame. ``vector`` gives world components."""

    def components(draft: MjcfDraft, index: int) -> list[str] | None:
        frame = _frame(draft, index)
        if frame is None:
            return None
        world = vector(draft, frame)
        if not local:
            return list(world)
        axes = [draft.along(frame.center, end) for end in frame.ends]
        return [total([f"{a} * {part}" for a, part in zip(axis, world, strict=True)]) for axis in axes]

    return components


def _motion(word: str) -> Callable[[MjcfDraft, _Frame], list[str]]:
    return lambda draft, frame: [f"{word}.{frame.center}[{i}]" for i in range(3)]


def _angular_velocity(draft: MjcfDraft, frame: _Frame) -> list[str]:
    body = frame.pose.body
    return ["0.0"] * 3 if body == BASE else [f"angular_velocity.{body}[{i}]" for i in range(3)]


def _acceleration(draft: MjcfDraft, frame: _Frame) -> list[str]:
    gravity = draft.data["gravity"]
    return [f"(acceleration.{frame.center}[{i}] - {number(gravity[i])})" for i in range(3)]


def _magnetic(draft: MjcfDraft, frame: _Frame) -> list[str]:
    return [number(float(value)) for value in draft.model.opt.magnetic]


def _axis(k: int) -> _Components:
    return _frame_components(lambda draft, frame: draft.along(frame.center, frame.ends[k]), local=False)


def _subtree_mean(word: str) -> _Components:
    """Return a function that gives three formulas: the mean, weighted by mass, of a quantity such as ``position`` over
    the centres of mass in the subtree below a sensor's body. None for a subtree without mass."""

    def components(draft: MjcfDraft, index: int) -> list[str] | None:
        model, root = draft.model, _object(draft, index)
        massive = np.flatnonzero(model.body_mass > 0.0).tolist()
        inside = [body for body in massive if body and root in (0, *bodies_above(model, body))]
        mass = float(np.sum(model.body_mass[inside]))
        if not mass:
            return None
        centers = [draft.point(f"inertial_{body}", _inertial_place(draft, body)) for body in inside]
        shares = [float(model.body_mass[body]) / mass for body in inside]
        return [
            draft.sum_of(word, [times(share, f"{word}.{c}[{i}]") for share, c in zip(shares, centers, strict=True)])
            for i in range(3)
        ]

    return components


_KINDS: dict[str, _Components] = {
    "JOINTPOS": _joint("q", 1),
    "JOINTVEL": _joint("v", 1),
    "BALLQUAT": _joint("q", 4),
    "BALLANGVEL": _joint("v", 3),
    "TENDONPOS": _part(lambda draft: draft.tendons, str),
    "TENDONVEL": _part(lambda draft: draft.tendons, "{}_rate".format),
    "ACTUATORPOS": _part(lambda draft: draft.actuator_motions, itemgetter(0)),
    "ACTUATORVEL": _part(lambda draft: draft.actuator_motions, itemgetter(1)),
    "ACTUATORFRC": _part(lambda draft: draft.actuator_forces, str),
    "FRAMEPOS": _frame_components(_motion("position"), local=False),
    "FRAMEXAXIS": _axis(0),
    "FRAMEYAXIS": _axis(1),
    "FRAMEZAXIS": _axis(2),
    "FRAMELINVEL": _frame_components(_motion("velocity"), local=False),
    "FRAMEANGVEL": _frame_components(_angular_velocity, local=False),
    "FRAMELINACC": _frame_components(_acceleration, local=False),
    "ACCELEROMETER": _frame_components(_acceleration, local=True),
    "VELOCIMETER": _frame_components(_motion("velocity"), local=True),
    "GYRO": _frame_components(_angular_velocity, local=True),
    "MAGNETOMETER": _frame_components(_magnetic, local=True),
    "SUBTREECOM": _subtree_mean("position"),
    "SUBTREELINVEL": _subtree_mean("velocity"),
    "CLOCK": lambda draft, index: ["t"],
    "E_KINETIC": lambda draft, index: ["energy.kinetic"],
}
