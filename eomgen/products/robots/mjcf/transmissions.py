"""Transmissions of MJCF's actuators: the length and the rate that an actuator measures, and the loads of its force.

Definitions: MuJoCo's documentation, "Computation: Actuation model, transmission", and the attributes ``gear``,
``refsite``, ``jointinparent``, ``cranksite`` of "XML reference: actuator/general". The rate is the power of a unit
force, which is the derivative of the length of all transmissions but of ball joints and rotations between sites.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi
from typing import Any

import numpy as np

from eomgen.base.data import dataclass
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.mjcf import quaternions
from eomgen.products.robots.mjcf.draft import MjcfDraft, cross, dot, times, total
from eomgen.products.robots.mjcf.equalities import site_place
from eomgen.products.robots.mjcf.tree import BALL, HINGE, SLIDE, bodies_above
from eomgen.products.robots.scene_draft import LinkPlace, number
from eomgen.system.description import BASE


@dataclass
class MjcfTransmission:
    """A transmission of an actuator.

    Attributes
    ----------
    length, rate : formulas, m or rad, and m/s or rad/s
    load : function that adds the loads of a force, given as a formula, to the scene
    period : of the length after which rotations repeat, rad; 0 of others
    """

    length: str
    rate: str
    load: Callable[[str], None]
    period: float = 0.0


class ActuatorParts:
    """An actuator, with the parts that it adds to the scene.

    Parameters
    ----------
    name, index : of the actuator, in the scene and in the compiled model
    place : for messages

    Attributes
    ----------
    gear : six numbers
    path : its transmission
    controls : terms by the words of ``controllers.SIGNALS``; one control has an empty word
    states : number of its internal states so far
    """

    def __init__(self, draft: MjcfDraft, name: str, index: int, location: ElementPlace) -> None:
        self.draft, self.model, self.efforts = draft, draft.model, draft.efforts
        self.name, self.index, self.place = name, index, location
        self.output = int(self.model.actuator_outadr[index])
        self.gear = [float(value) for value in self.model.actuator_gear[self.output]]
        self.path = MjcfTransmission("0.0", "0.0", lambda force: None)
        self.controls: dict[str, str] = {}
        self.states = 0

    def refuse(self, fault: str, hint: str = "a motor, and a controller in a scene that includes the file") -> str:
        """Report a fault of the actuator; return the empty formula."""
        self.draft.refuse(self.place, f"actuator {self.name}", fault, hint)
        return ""

    def is_of(self, kind: str, *names: str) -> bool:
        """Return whether a property of the actuator, as ``gain``, has one of some values."""
        values = getattr(self.draft.mujoco, f"mjt{kind.capitalize()}")
        wanted = [getattr(values, f"mj{kind.upper()}_{name}") for name in names]
        return int(getattr(self.model, f"actuator_{kind}type")[self.index]) in wanted

    def define(self, word: str, formula: str) -> str:
        """Return the name of a definition, which is added."""
        return self.draft.define(f"{self.name}_{word}", formula)

    def define_each(self, word: str, formulas: Sequence[str], letters: str = "xyz") -> list[str]:
        """Return the names of the components of a vector or a quaternion, which are added as definitions."""
        return self.draft.define_each(f"{self.name}_{word}", formulas, letters)

    def add_load(self, body: str, word: str, **entry: Any) -> None:
        """Add forces and torques on a body, unless the body is the base; the name ends with ``word``, ``entry`` has
        further keys."""
        if body != BASE:
            self.draft.add("forces", "force", f"{self.name}_{word}", {"body": body, **entry})

    def add_pair(self, places: Sequence[LinkPlace], axis: Sequence[str], pull: str, **reaction: Any) -> None:
        """Add a force at the first of two places, and the reaction at the second, perhaps with a torque. ``axis`` has
        formulas of the direction in world axes, ``pull`` the formula of the force, ``reaction`` further keys of the
        reaction."""
        for placement, word, sign, more in zip(places, ("push", "reaction"), ("", "-"), ({}, reaction), strict=True):
            force = [f"{sign}{part} * {pull}" for part in axis]
            self.add_load(placement.body, word, point=placement.position.tolist(), force=force, **more)

    def targets(self) -> list[int]:
        return [int(number_of_target) for number_of_target in self.model.actuator_trnid[self.index]]

    def parameters(self, kind: str) -> list[float]:
        """Return the parameters of the dynamics ``dyn``, the ``gain`` or the ``bias``."""
        return [float(value) for value in getattr(self.model, f"actuator_{kind}prm")[self.index]]

    @property
    def turns(self) -> bool:
        return any(self.gear[3:])


def transmission(drive: ActuatorParts) -> MjcfTransmission | str:
    """Return the transmission of an actuator, by the type in the compiled model; the name of the type if no scene has
    it."""
    draft, kinds = drive.draft, drive.draft.mujoco.mjtTrn
    kind = int(draft.model.actuator_trntype[drive.index])
    target, second = drive.targets()
    if kind in (kinds.mjTRN_JOINT, kinds.mjTRN_JOINTINPARENT):
        joint = int(draft.model.jnt_type[target])
        if joint in (HINGE, SLIDE):
            return _on_joint(drive, target)
        in_parent = kind == kinds.mjTRN_JOINTINPARENT
        return _on_ball(drive, target, in_parent) if joint == BALL else _on_free(drive, target, in_parent)
    if kind == kinds.mjTRN_TENDON and target in draft.tendons:
        return _on_tendon(drive, target)
    if kind == kinds.mjTRN_SITE:
        return _on_site(drive, target) if second < 0 else _between_sites(drive, target, second)
    if kind == kinds.mjTRN_SLIDERCRANK:
        return _slider_crank(drive, target, second)
    return str(kinds(kind).name.removeprefix("mjTRN_").lower())


def _on_joint(drive: ActuatorParts, joint: int) -> MjcfTransmission:
    name, gear = drive.draft.joints[joint], drive.gear[0]

    def load(force: str) -> None:
        drive.efforts.setdefault(joint, []).append(times(gear, f"({force})"))

    return MjcfTransmission(times(gear, f"q.{name}"), times(gear, f"v.{name}"), load)


def _on_tendon(drive: ActuatorParts, tendon: int) -> MjcfTransmission:
    draft, gear = drive.draft, drive.gear[0]
    length = draft.tendons[tendon]

    def load(force: str) -> None:
        pull = drive.define("force", force)
        if tendon in draft.branches:
            draft.pulls[tendon].append(times(-gear, pull))
            return
        for joint, coefficient in draft.tendon_joints[tendon]:
            drive.efforts.setdefault(joint, []).append(times(gear * coefficient, pull))

    return MjcfTransmission(times(gear, length), times(gear, f"{length}_rate"), load)


def _add_efforts(drive: ActuatorParts, joint: str, force: str, parts: Sequence[str], first: int = 0) -> None:
    """Add the efforts ``part * force`` on the coordinates of a joint from the coordinate ``first`` on; empty parts add
    none."""
    for index, part in enumerate(parts, first):
        if part not in ("0.0", ""):
            effort = {"joint": joint, "index": index, "effort": f"{part} * ({force})"}
            drive.draft.add("efforts", "effort", f"{drive.name}_{'xyz'[index % 3]}", effort)


def _on_ball(drive: ActuatorParts, joint: int, in_parent: bool) -> MjcfTransmission:
    """Return a transmission on a ball joint: the rotation vector along the gear, in child axes or, ``in_parent``,
    parent axes."""
    draft, name, gear = drive.draft, drive.draft.joints[joint], drive.gear[:3]
    quaternion = [f"q.{name}[{i}]" for i in range(4)]
    vector = quaternions.logarithm(draft, f"{drive.name}_turn", quaternion)
    axis = [number(value) if value else "" for value in gear]
    if in_parent:
        axis = drive.define_each("axis", quaternions.turned_back(quaternion, gear))
    # the rotation vector has the same components in the axes of both bodies
    return MjcfTransmission(
        drive.define("length", total([f"{a} * {x}" for a, x in zip(axis, vector, strict=True) if a])),
        total([f"{a} * v.{name}[{i}]" for i, a in enumerate(axis) if a]),
        lambda force: _add_efforts(drive, name, force, axis),
        2.0 * pi * float(np.linalg.norm(gear)),
    )


def _on_free(drive: ActuatorParts, joint: int, in_parent: bool) -> MjcfTransmission:
    """Return a transmission on a free joint, with the gear's force at the origin, in world axes, and the gear's torque,
    in child axes or, ``in_parent``, parent axes. The length is 0."""
    draft, name = drive.draft, drive.draft.joints[joint]
    pushes, turns = drive.gear[:3], drive.gear[3:]
    child = draft.data["joints"][name]["child"]
    axis = [number(value) if value else "" for value in turns]
    if in_parent and drive.turns:
        axis = drive.define_each("axis", quaternions.turned_back([f"q.{name}[{i}]" for i in range(4)], turns))
    rates = [f"{a} * v.{name}[{i}]" for i, a in enumerate(axis) if a]
    if any(pushes):
        center = draft.point(f"{name}_origin", LinkPlace(child, np.eye(3), np.zeros(3)))
        rates += [times(c, f"velocity.{center}[{i}]") for i, c in enumerate(pushes) if c]

    def load(force: str) -> None:
        _add_efforts(drive, name, force, axis)
        if any(pushes):
            drive.add_load(child, "push", force=[times(c, f"({force})") if c else 0.0 for c in pushes])

    return MjcfTransmission("0.0", total(rates), load)


def _on_site(drive: ActuatorParts, site: int) -> MjcfTransmission:
    """Return a transmission on a site, with the gear's force and torque in axes of the site. The length is 0."""
    draft, placement = drive.draft, site_place(drive.draft, site)
    center, ends = draft.frame_points(f"site_{draft.element_name('site', site) or site}", placement)
    rates = []
    for k, end in enumerate(ends):
        for factor, word in (
            (drive.gear[k], f"velocity.{center}"),
            (drive.gear[k + 3], f"angular_velocity.{placement.body}"),
        ):
            if factor and placement.body != BASE:
                rates.append(times(factor, dot(draft.along(center, end), [f"{word}[{i}]" for i in range(3)])))

    def load(force: str) -> None:
        pushes, turns = (placement.orientation @ np.array(part) for part in (drive.gear[:3], drive.gear[3:]))
        entry: dict[str, Any] = {"point": placement.position.tolist(), "axes": "body"}
        for key, vector in (("force", pushes), ("torque", turns)):
            if vector.any():
                entry[key] = [times(float(part), f"({force})") if part else 0.0 for part in vector]
        drive.add_load(placement.body, "wrench", **entry)

    return MjcfTransmission("0.0", total(rates), load)


def _spin(body: str) -> list[str]:
    return ["0.0"] * 3 if body == BASE else [f"angular_velocity.{body}[{i}]" for i in range(3)]


def _between_sites(drive: ActuatorParts, site: int, reference: int) -> MjcfTransmission:
    """Return the transmission of a site relative to the site ``reference``, in whose axes the gear stands. Motions of
    the last body that carries both sites do not count, so this body takes the moment of the offset of both forces."""
    draft = drive.draft
    places = [site_place(draft, site), site_place(draft, reference)]
    words = [f"site_{draft.element_name('site', end) or end}" for end in (site, reference)]
    lengths: list[str] = []
    rates: list[str] = []
    axis: list[str] = []
    turn: list[str] = []
    center = draft.point(words[0], places[0])
    origin, ends = draft.frame_points(words[1], places[1])
    common = _common_body(draft, site, reference)
    if any(drive.gear[:3]):
        offset = drive.define_each("offset", draft.along(origin, center))
        axis = _in_world(drive, "direction", origin, ends, drive.gear[:3])
        lengths.append(dot(offset, axis))
        relative = [f"(velocity.{center}[{i}] - velocity.{origin}[{i}])" for i in range(3)]
        relative = [f"({speed} - {turn})" for speed, turn in zip(relative, cross(_spin(common), offset), strict=True)]
        rates.append(dot(axis, relative))
    if drive.turns:
        turn = _in_world(drive, "turn_axis", origin, ends, drive.gear[3:])
        _, near_ends = draft.frame_points(words[0], places[0])
        near_axes, axes = (
            [draft.along(center, end) for end in near_ends],
            [draft.along(origin, end) for end in ends],
        )
        vector = _relative_turn(drive, axes, near_axes)
        lengths.append(total([times(c, x) for c, x in zip(drive.gear[3:], vector, strict=True) if c]))
        spins = [f"({a} - {b})" for a, b in zip(_spin(places[0].body), _spin(places[1].body), strict=True)]
        rates.append(dot(turn, spins))

    def load(force: str) -> None:
        if axis:
            drive.add_pair(places, axis, f"({force})")
            drive.add_load(common, "balance", torque=[f"{part} * ({force})" for part in cross(axis, offset)])
        for placement, word, sign in zip(places, ("torque", "counter_torque"), ("", "-"), strict=True) if turn else ():
            drive.add_load(placement.body, word, torque=[f"{sign}{a} * ({force})" for a in turn])

    period = 0.0 if any(drive.gear[:3]) else 2.0 * pi * float(np.linalg.norm(drive.gear[3:]))
    return MjcfTransmission(drive.define("length", total(lengths)), total(rates), load, period)


def _relative_turn(drive: ActuatorParts, axes: Sequence[Sequence[str]], others: Sequence[Sequence[str]]) -> list[str]:
    """Return the names of the components of the rotation vector, below half a turn, from ``axes`` to ``others``, each
    three unit vectors of formulas in world axes; the definitions are added. The components are equal in both axes."""
    cosines = [[dot(axis, second) for second in others] for axis in axes]
    pairs = ((2, 1), (0, 2), (1, 0))
    sines = drive.define_each("sine", [f"0.5 * ({cosines[i][j]} - {cosines[j][i]})" for i, j in pairs])
    size = drive.define("size", f"sqrt(max({dot(sines, sines)}, 1e-32))")
    cosine = f"0.5 * ({total([cosines[i][i] for i in range(3)])} - 1.0)"
    factor = drive.define("factor", f"atan2({size}, {cosine}) / {size}")
    return drive.define_each("turn", [f"{factor} * {sine}" for sine in sines])


def _in_world(drive: ActuatorParts, word: str, origin: str, ends: Sequence[str], vector: Sequence[float]) -> list[str]:
    """Return names of definitions for the world components of a constant vector in the axes of a frame. The frame is
    given by names of points: ``origin``, and three ``ends`` 1 m along the axes. Names contain ``word``."""
    axes = [drive.draft.along(origin, end) for end in ends]
    parts = [total([times(c, axis[i]) for c, axis in zip(vector, axes, strict=True) if c]) for i in range(3)]
    return drive.define_each(word, parts)


def _chain(draft: MjcfDraft, body: int) -> list[int]:
    """Return the bodies from a body to the world, without the world; welded ones by the body that carries them."""
    return [int(draft.model.body_weldid[above]) for above in bodies_above(draft.model, body)]


def _common_body(draft: MjcfDraft, site: int, reference: int) -> str:
    """Return the name of the last moving body of the scene that carries both sites; the base without one."""
    chains = [_chain(draft, int(draft.model.site_bodyid[end])) for end in (site, reference)]
    shared = [body for body in chains[0] if body in chains[1]]
    return draft.places[shared[0]].body if shared else BASE


def moved_joints(drive: ActuatorParts) -> list[int]:
    """Return the numbers of the joints on which an actuator acts by loads of bodies or on several coordinates; none for
    one that drives a hinge, a slide or a fixed tendon."""
    draft, model, kinds = drive.draft, drive.draft.model, drive.draft.mujoco.mjtTrn
    kind, (target, second) = int(model.actuator_trntype[drive.index]), drive.targets()
    if kind in (kinds.mjTRN_SITE, kinds.mjTRN_SLIDERCRANK):
        bodies = [int(model.site_bodyid[site]) for site in (target, second) if site >= 0]
    elif kind == kinds.mjTRN_TENDON:
        bodies = _bodies_of_path(draft, target) if target in draft.branches else []
    else:
        return [] if int(model.jnt_type[target]) in (HINGE, SLIDE) else [target]
    chains = [set(_chain(draft, body)) for body in bodies]
    shared = set(chains[0]).intersection(*chains) if len(chains) > 1 else set[int]()
    moved = {body for chain in chains for body in chain} - shared
    return [joint for joint in range(model.njnt) if int(model.jnt_bodyid[joint]) in moved]


def _bodies_of_path(draft: MjcfDraft, tendon: int) -> list[int]:
    """Return the numbers of the bodies of all sites and geoms along a spatial tendon, in the order of the path."""
    model, kinds = draft.model, draft.mujoco.mjtWrap
    first = int(model.tendon_adr[tendon])
    bodies = []
    for k in range(first, first + int(model.tendon_num[tendon])):
        kind, target = int(model.wrap_type[k]), int(model.wrap_objid[k])
        if kind != kinds.mjWRAP_PULLEY:
            owners = model.site_bodyid if kind == kinds.mjWRAP_SITE else model.geom_bodyid
            bodies.append(int(owners[target]))
    return bodies


def _slider_crank(drive: ActuatorParts, crank: int, slider: int) -> MjcfTransmission:
    """Return the transmission of a rod between the site ``crank`` and a slider along z of the site ``slider``: the
    length is the travel of the slider. A rod that does not reach the axis counts as perpendicular to it."""
    draft, model = drive.draft, drive.draft.model
    places = [site_place(draft, crank), site_place(draft, slider)]
    center = draft.point(f"site_{draft.element_name('site', crank) or crank}", places[0])
    origin, ends = draft.frame_points(f"site_{draft.element_name('site', slider) or slider}", places[1])
    rod, gear = float(model.actuator_cranklength[drive.index]), drive.gear[0]
    offset = drive.define_each("offset", draft.along(origin, center))
    axis = drive.define_each("slide", draft.along(origin, ends[2]))
    along = drive.define("along", dot(offset, axis))
    square = drive.define("square", f"{along}**2 + {number(rod**2)} - {dot(offset, offset)}")
    root = drive.define("root", f"sqrt({square} if {square} > 0.0 else 1.0)")
    length = drive.define("length", times(gear, f"({along} - ({root} if {square} > 0.0 else 0.0))"))
    share = drive.define("share", f"(1.0 - {along} / {root} if {square} > 0.0 else 1.0)")
    push = drive.define_each(
        "direction",
        [f"{share} * {a} + ({x} / {root} if {square} > 0.0 else 0.0)" for a, x in zip(axis, offset, strict=True)],
    )
    moment = [f"({share} * {part})" for part in cross(axis, offset)]
    relative = [f"(velocity.{center}[{i}] - velocity.{origin}[{i}])" for i in range(3)]
    rate = f"({dot(push, relative)} + {dot(moment, _spin(places[1].body))})"

    def load(force: str) -> None:
        pull = times(gear, f"({force})")
        drive.add_pair(places, push, pull, torque=[f"{part} * {pull}" for part in moment])

    return MjcfTransmission(length, times(gear, rate), load)
