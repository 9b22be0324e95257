"""Bodies and joints of MJCF: several joints of a body become a chain of massless links, bodies without joints are
merged into the body that carries them and kept as frames.

A joint of MuJoCo turns about its anchor in the body, by its coordinate less its value in the file's configuration
(``ref``). Here the joint is at the origin of the child's frame, so an anchor elsewhere gives a link with its origin
there, to which the body is fixed; and the coordinate is MuJoCo's own.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import listed
from eomgen.lie.numeric import rotation_matrix
from eomgen.products.robots.mjcf.draft import Draft, cross, dot, odd_power, plain_power, polynomial
from eomgen.products.robots.scene_draft import LinkPlace, body_entry, matrix
from eomgen.scene.inertia import Inertia, combined
from eomgen.scene.rotations import about_axis
from eomgen.system.description import BASE

FREE, BALL, SLIDE, HINGE = range(4)
TYPES = {FREE: "free", BALL: "spherical", SLIDE: "prismatic", HINGE: "revolute"}
_WORDS = {FREE: "free", BALL: "ball", SLIDE: "slide", HINGE: "hinge"}
#: Penetration of a stop and speed of sticking, as of URDF files.
STICKING = {SLIDE: 0.001, HINGE: 0.01}


def convert_tree(draft: Draft, *, limits: bool, friction: bool) -> None:
    """Add the bodies, joints and frames of a file to the scene."""
    model = draft.model
    parts: dict[str, list[Inertia]] = {}
    draft.places[0] = LinkPlace(BASE, np.eye(3), np.zeros(3))
    names = {0: BASE}
    merged = []
    for body in range(1, model.nbody):
        written = draft.written("body", body)
        name = names[body] = draft.name("body", written, f"body_{body}")
        draft.lines[f"bodies.{name}"] = str(draft.place("body", body, model.nbody))
        carrier = draft.places[int(model.body_parentid[body])]
        rest = carrier.of(model.body_pos[body].copy(), model.body_quat[body])
        if draft.moving_targets and model.body_mocapid[body] >= 0:
            _add_moved(draft, body, name)
        elif model.body_jntnum[body]:
            _Chain(draft, body, name, limits=limits, friction=friction).attach(rest)
        else:
            draft.places[body] = rest
            draft.section("frames")[name] = rest.entry
            draft.lines[f"frames.{name}"] = draft.lines[f"bodies.{name}"]
            merged.append(name)
            if model.body_mocapid[body] >= 0:
                note = (
                    f"not modelled: the motion of the mocap body {name}, which rests at its place; mocap=True moves"
                    f" it [W0157]"
                )
                draft.leave_out(draft.place("body", body, model.nbody), note)
        place = draft.places[body]
        parts.setdefault(place.body, []).append(_inertia(model, body).moved(place.orientation, place.position))
    for link, of_link in parts.items():
        if link != BASE:
            draft.section("bodies")[link] |= body_entry(combined(of_link))
        else:
            draft.carry_mass(body_entry(combined(of_link)))
    if draft.moving_targets:
        _add_mass_of_moved(draft)
    if merged:
        draft.notes.append(
            f"bodies without joints are parts of the ones that carry them, kept as frames: {listed(merged)} [W0163]"
        )
    _compensate_gravity(draft)


def _inertia(model: Any, body: int) -> Inertia:
    """Return the mass properties of a body in its frame."""
    turned = rotation_matrix(np.array(model.body_iquat[body]))
    about = turned @ np.diag(model.body_inertia[body]) @ turned.T
    return Inertia(float(model.body_mass[body]), np.array(model.body_ipos[body]), 0.5 * (about + about.T))


def _add_moved(draft: Draft, body: int, name: str) -> None:
    """Add a mocap body on a chain of joints that motions from outside drive: three travels in the axes of the world,
    then turns about z, y and x."""
    model, which = draft.model, int(draft.model.body_mocapid[body])
    position, quaternion = model.body_pos[body], model.body_quat[body]
    if draft.key >= 0:
        position, quaternion = model.key_mpos[draft.key][3 * which :], model.key_mquat[draft.key][4 * which :]
    R = rotation_matrix(np.array(quaternion[:4]) / np.linalg.norm(quaternion[:4]))
    angles = [np.arctan2(R[1, 0], R[0, 0]), -np.arcsin(np.clip(R[2, 0], -1.0, 1.0)), np.arctan2(R[2, 1], R[2, 2])]
    parent = BASE
    rows = (*(("prismatic", axis) for axis in "xyz"), *(("revolute", axis) for axis in "zyx"))
    words = ("x", "y", "z", "yaw", "pitch", "roll")
    for word, (kind, axis), value in zip(words, rows, [*position[:3], *angles], strict=True):
        motion = draft.name("signal", "", f"{name}_{word}")
        joint = draft.name("joint", "", f"{name}_{word}")
        link = name if word == "roll" else draft.name("body", "", f"{name}_{word}")
        draft.section("inputs")[motion] = {"motion": True, "initial": float(value)}
        draft.section("bodies")[link] = {"mass": 0.0}
        draft.section("joints")[joint] = {
            "type": kind,
            "parent": parent,
            "child": link,
            "axis": [float(axis == letter) for letter in "xyz"],
            "drive": motion,
        }
        draft.lines[f"joints.{joint}"] = draft.lines[f"bodies.{name}"]
        parent = link
    draft.places[body] = LinkPlace(name, np.eye(3), np.zeros(3))


def _add_mass_of_moved(draft: Draft) -> None:
    """Give mocap bodies without mass some, so that the equations of their drives can be solved."""
    for body in np.flatnonzero(draft.model.body_mocapid >= 0):
        name = draft.places[int(body)].body
        if not draft.section("bodies")[name].get("mass"):
            draft.section("bodies")[name] |= {"mass": 1.0, "inertia": [1.0, 1.0, 1.0]}
            draft.notes.append(
                f"the mocap body {name} has no mass in the file; its 1 kg here loads its drives alone [W0164]"
            )


class _Chain:
    """The joints of one body."""

    def __init__(self, draft: Draft, body: int, name: str, *, limits: bool, friction: bool) -> None:
        self.draft, self.body, self.name = draft, body, name
        self.limits, self.friction = limits, friction
        self.model = draft.model
        self.after: list[tuple[str, dict[str, Any]]] = []

    def attach(self, rest: LinkPlace) -> None:
        """Add the joints, each with the link that it carries; ``rest`` is the pose of the body in the file."""
        first, count = int(self.model.body_jntadr[self.body]), int(self.model.body_jntnum[self.body])
        place = rest
        for joint in range(first, first + count):
            kind = int(self.model.jnt_type[joint])
            default = f"{self.name}_{_WORDS[kind]}"
            name = self.draft.joints[joint] = self.draft.name("joint", self.draft.written("joint", joint), default)
            line = self.draft.place("joint", joint, self.model.njnt)
            self.draft.lines[f"joints.{name}"] = str(line)
            anchor = np.array(self.model.jnt_pos[joint]) if kind in (HINGE, BALL) else np.zeros(3)
            last = joint == first + count - 1 and not anchor.any()
            link = self.name if last else self.draft.name("body", "", f"{self.name}_{name}")
            self.draft.section("bodies")[link] = {"mass": 0.0}
            self.draft.section("joints")[name] = self.entry(joint, kind, place, link, anchor)
            place = LinkPlace(link, np.eye(3), -anchor)
        if place.body != self.name:
            fixed = self.draft.name("joint", "", f"{self.name}_fixed")
            self.draft.section("bodies")[self.name] = {"mass": 0.0}
            self.draft.section("joints")[fixed] = {
                "type": "fixed",
                "parent": place.body,
                "child": self.name,
                "position": place.position.tolist(),
            }
        self.draft.section("joints").update(self.after)
        self.draft.places[self.body] = LinkPlace(self.name, np.eye(3), np.zeros(3))

    def entry(self, joint: int, kind: int, place: LinkPlace, link: str, anchor: Array) -> dict[str, Any]:
        """Return the joint of the scene; ``place`` is the pose of the body before the joint moves it."""
        entry: dict[str, Any] = {"type": TYPES[kind], "parent": place.body, "child": link}
        start, rate = int(self.model.jnt_qposadr[joint]), int(self.model.jnt_dofadr[joint])
        qpos, qvel = self.draft.qpos[start:], self.draft.qvel[rate:]
        if kind == FREE:
            position, quaternion = qpos[:3], qpos[3:7] / np.linalg.norm(qpos[3:7])
            velocity = [*qvel[3:6], *(rotation_matrix(quaternion).T @ qvel[:3])]
            entry["initial"] = {"position": position.tolist(), "orientation": quaternion.tolist()}
            entry["initial"] |= {"velocity": np.array(velocity).tolist()} if np.any(velocity) else {}
            self.of_several_coordinates(joint, kind, entry, LinkPlace(BASE, np.eye(3), np.zeros(3)))
            return entry
        placed = place.of(anchor)
        turn, shift = np.eye(3), np.zeros(3)
        if kind == BALL:
            quaternion = qpos[:4] / np.linalg.norm(qpos[:4])
            entry["initial"] = {"position": quaternion.tolist(), "velocity": qvel[:3].tolist()}
            self.of_several_coordinates(joint, kind, entry, placed)
        else:
            axis, reference = np.array(self.model.jnt_axis[joint]), float(self.model.qpos0[start])
            if kind == HINGE:
                turn = about_axis(axis, -reference)
            else:
                shift = -reference * axis
            entry |= {"axis": axis.tolist(), "initial": {"position": [float(qpos[0])], "velocity": [float(qvel[0])]}}
            self.of_one_coordinate(joint, kind, entry)
        entry["position"] = (placed.position + placed.orientation @ shift).tolist()
        entry["orientation"] = matrix(placed.orientation @ turn)
        return entry

    def of_one_coordinate(self, joint: int, kind: int, entry: dict[str, Any]) -> None:
        """Add spring, damper, armature and, if asked for, stops and dry friction."""
        model, draft = self.model, self.draft
        start, rate, name = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]), draft.joints[joint]
        line = draft.place("joint", joint, model.njnt)
        if model.dof_armature[rate]:
            entry["rotor_inertia"] = float(model.dof_armature[rate])
        rest = float(model.qpos_spring[start])
        stiffness = [float(model.jnt_stiffness[joint]), *map(float, model.jnt_stiffnesspoly[joint])]
        damping = [float(model.dof_damping[rate]), *map(float, model.dof_dampingpoly[rate])]
        if draft.disabled("SPRING"):
            stiffness = [0.0] * len(stiffness)
        if draft.disabled("DAMPER"):
            damping = [0.0] * len(damping)
        if stiffness[0]:
            entry |= {"stiffness": stiffness[0], "rest": rest}
        if damping[0]:
            entry["damping"] = damping[0]
        terms = {"spring": (f"(q.{name} - {_number(rest)})", stiffness, plain_power)}
        terms["damper"] = (f"v.{name}", damping, odd_power)
        for word, (variable, coefficients, power) in terms.items():
            if any(coefficients[1:]):
                effort = polynomial(variable, [0.0, *coefficients[1:]], power)
                draft.section("efforts")[draft.name("effort", "", f"{name}_{word}")] = {
                    "joint": name,
                    "effort": f"-{effort}" if effort.startswith("(") else f"-({effort})",
                }
        if model.jnt_springyield[joint] and any(stiffness):
            draft.refuse(
                line,
                f"joints.{name}",
                "springyield makes the spring plastic, and no scene has such springs [E1929]",
                "springyield 0",
            )
        self.friction_of(rate, kind, entry, name)
        self.limits_of(joint, rate, entry, name)

    def friction_of(self, rate: int, kind: int, entry: dict[str, Any], name: str) -> None:
        loss = 0.0 if self.draft.disabled("FRICTIONLOSS") else float(self.model.dof_frictionloss[rate])
        if loss and self.friction:
            entry["friction"] = {"coulomb": loss, "velocity": STICKING[kind]}
        elif loss:
            self.draft.left_out("dry friction (frictionloss)", name)

    def limits_of(self, joint: int, rate: int, entry: dict[str, Any], name: str) -> None:
        """Add a stop as hard as MuJoCo's in the configuration of the file.

        MuJoCo demands the acceleration -b v - k r of a limit that is passed by r, with the impedance d at the end of
        its curve; at rest the force is d k r divided by the inverse inertia felt there.
        """
        model = self.model
        if not model.jnt_limited[joint] or self.draft.disabled("LIMIT"):
            return
        if not self.limits:
            self.draft.left_out("limits of position (range)", name)
            return
        time, ratio = (float(value) for value in model.jnt_solref[joint])
        full = float(np.clip(model.jnt_solimp[joint][1], 1e-4, 0.9999))
        felt = full / float(model.dof_invweight0[rate])
        if time > 0.0:
            stiffness, damping = felt / (full * time * ratio) ** 2, 2.0 * felt / (full * time)
        else:
            stiffness, damping = felt * -time / full**2, felt * -ratio / full
        low, high = (float(value) for value in model.jnt_range[joint])
        entry["limits"] = {"lower": low, "upper": high, "stiffness": stiffness, "damping": damping}

    def of_several_coordinates(self, joint: int, kind: int, entry: dict[str, Any], placed: LinkPlace) -> None:
        """Add springs and dampers of a ball or a free joint, which are equal in all directions; refuse the rest."""
        model, draft, name = self.model, self.draft, self.draft.joints[joint]
        rate, line = int(model.jnt_dofadr[joint]), draft.place("joint", joint, model.njnt)
        damping = [float(model.dof_damping[rate]), *map(float, model.dof_dampingpoly[rate])]
        if any(damping[1:]):
            fault = f"a {_WORDS[kind]} joint with damping of higher order is not supported [E1931]"
            draft.refuse(line, f"joints.{name}", fault, "one coefficient of damping")
        elif damping[0] and not draft.disabled("DAMPER"):
            for index in range(3 if kind == BALL else 6):
                effort = {"joint": name, "index": index, "effort": f"-{damping[0]!r} * v.{name}[{index}]"}
                draft.section("efforts")[draft.name("effort", "", f"{name}_damper_{index}")] = effort
        if any(model.jnt_stiffnesspoly[joint]):
            fault = f"a {_WORDS[kind]} joint with stiffness of higher order is not supported [E1932]"
            draft.refuse(line, f"joints.{name}", fault, "one coefficient of stiffness")
        elif model.jnt_stiffness[joint] and not draft.disabled("SPRING"):
            self.add_bushing(joint, kind, entry, placed)
        if model.dof_armature[rate]:
            self.armature_of(float(model.dof_armature[rate]), joint, kind, entry)
        if model.dof_frictionloss[rate] and not draft.disabled("FRICTIONLOSS"):
            draft.left_out("dry friction (frictionloss)", name)
        if kind == BALL and model.jnt_limited[joint] and not draft.disabled("LIMIT"):
            draft.left_out("limits of position (range)", name)

    def add_bushing(self, joint: int, kind: int, entry: dict[str, Any], placed: LinkPlace) -> None:
        """Add the spring of a ball or a free joint, a bushing between the axes at rest and the axes of the child."""
        rest = self.model.qpos_spring[int(self.model.jnt_qposadr[joint]) :]
        stiffness = [float(self.model.jnt_stiffness[joint])] * 3
        at_rest = placed.of(np.array(rest[:3]), rest[3:7]) if kind == FREE else placed.of(np.zeros(3), rest[:4])
        bushing = {
            "first": {
                "body": entry["parent"],
                "position": at_rest.position.tolist(),
                "axis": at_rest.orientation[:, 2].tolist(),
                "x_axis": at_rest.orientation[:, 0].tolist(),
            },
            "second": {"body": entry["child"], "axis": [0.0, 0.0, 1.0], "x_axis": [1.0, 0.0, 0.0]},
            "rotational_stiffness": stiffness,
        }
        if kind == FREE:
            bushing["stiffness"] = stiffness
        name = self.draft.name("bushing", "", f"{self.draft.joints[joint]}_spring")
        self.draft.section("bushings")[name] = bushing

    def armature_of(self, armature: float, joint: int, kind: int, entry: dict[str, Any]) -> None:
        """Add a body with the kinetic energy of an armature of all components: of a free joint a mass at the origin of
        the body, which gravity does not pull, and an isotropic inertia; of a ball joint on the base the inertia
        alone."""
        draft, name = self.draft, self.draft.joints[joint]
        if kind == BALL and entry["parent"] != BASE:
            fault = "a ball joint with armature on a body that moves is not supported [E1933]"
            hint = "armature 0, and the inertia in the body"
            draft.refuse(draft.place("joint", joint, self.model.njnt), f"joints.{name}", fault, hint)
            return
        link = draft.name("body", "", f"{name}_armature")
        mass = armature if kind == FREE else 0.0
        draft.section("bodies")[link] = {"mass": mass, "inertia": [armature] * 3}
        self.after.append((draft.name("joint", "", link), {"type": "fixed", "parent": entry["child"], "child": link}))
        gravity = np.array(draft.data["gravity"])
        if mass and gravity.any():
            force = {"body": link, "force": (-mass * gravity).tolist()}
            draft.section("forces")[draft.name("force", "", f"{link}_weight")] = force


def _number(value: float) -> str:
    return f"({value!r})" if value < 0.0 else repr(value)


def _gravity_compensation(draft: Draft) -> dict[int, tuple[LinkPlace, Array]]:
    """Return the centre of mass, and the force there, of each body that ``gravcomp`` holds up."""
    model, gravity = draft.model, np.array(draft.data["gravity"])
    if draft.without_passive_forces or not gravity.any():
        return {}
    parts = {body: float(model.body_gravcomp[body]) for body in range(1, model.nbody)}
    return {
        body: (
            draft.places[body].of(np.array(model.body_ipos[body])),
            -part * float(model.body_mass[body]) * gravity,
        )
        for body, part in parts.items()
        if part and draft.places[body].body != BASE
    }


def _compensate_gravity(draft: Draft) -> None:
    """Add the forces by which ``gravcomp`` holds bodies up."""
    for body, (at, force) in _gravity_compensation(draft).items():
        name = draft.name("force", "", f"gravity_compensation_{draft.written('body', body) or body}")
        draft.section("forces")[name] = {"body": at.body, "point": at.position.tolist(), "force": force.tolist()}


def compensated_by(draft: Draft, joint: int) -> list[tuple[LinkPlace, Array]]:
    """Return the centres of mass, and the forces there, of the bodies on a joint that ``gravcomp`` holds up."""
    carrier = int(draft.model.jnt_bodyid[joint])
    return [pair for body, pair in _gravity_compensation(draft).items() if carrier in bodies_above(draft.model, body)]


def compensation_on(draft: Draft, joint: int) -> str:
    """Return the formula of the share that ``gravcomp`` has in the effort of a hinge or a slide; empty without one."""
    held = compensated_by(draft, joint)
    if not held:
        return ""
    name = draft.joints[joint]
    entry = draft.section("joints")[name]
    foot = LinkPlace(entry["child"], np.eye(3), np.zeros(3))
    start = draft.point(f"{name}_foot", foot)
    axis = draft.along(start, draft.point(f"{name}_axis", foot.of(np.array(entry["axis"]))))
    whole = np.sum([force for _, force in held], axis=0)
    if int(draft.model.jnt_type[joint]) == SLIDE:
        return dot(axis, [_number(float(part)) for part in whole])
    moments: list[list[str]] = [[], [], []]
    for at, force in held:
        arm = draft.along(start, draft.point(f"weight_{at.body}_{len(draft.frame_origins)}", at))
        for parts, part in zip(moments, cross(arm, [_number(float(part)) for part in force]), strict=True):
            parts.append(part)
    return dot(
        axis, [draft.define(f"{name}_support_{x}", draft.sum_of(name, m)) for x, m in zip("xyz", moments, strict=True)]
    )


def bodies_above(model: Any, body: int) -> list[int]:
    """Return a body and the bodies that carry it, without the world."""
    chain = []
    while body:
        chain.append(body)
        body = int(model.body_parentid[body])
    return chain
