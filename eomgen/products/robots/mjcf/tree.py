"""Bodies, joints and sites of a compiled MJCF as a draft, and forces of joints that drafts do not have.

Several joints of a body are a chain of links without mass. A joint of MuJoCo turns about its anchor in the body; in a
scene the joint is at the origin of its child, so an anchor elsewhere gives a link with its origin there, to which the
body is fixed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.lie.numeric import rotation_matrix
from eomgen.products.robots.draft import WORLD_FRAME, Axis, DraftFrame, DraftJoint, DraftLink, DraftModel, WrittenPose
from eomgen.products.robots.draft import Draft as Bodies
from eomgen.products.robots.leftovers import ElementPlace, Leftovers
from eomgen.products.robots.mjcf.draft import MjcfDraft, cross, dot, odd_power, plain_power, polynomial
from eomgen.products.robots.scene_draft import LinkPlace, number
from eomgen.scene.inertia import NOTHING, Inertia
from eomgen.system.description import BASE

FREE, BALL, SLIDE, HINGE = range(4)
_TYPES = {FREE: "free", BALL: "spherical", SLIDE: "prismatic", HINGE: "revolute"}
_WORDS = {FREE: "free", BALL: "ball", SLIDE: "slide", HINGE: "hinge"}


class BodyReader:
    """Makes a draft of the bodies, joints and sites of a compiled model. ``keys`` has the key in the draft of the link
    of each body that is added, by number in the model; 0 is the world."""

    def __init__(self, scene: MjcfDraft) -> None:
        self.scene, self.model = scene, scene.model
        location = ElementPlace(scene.report.file, 1)
        self.world = DraftModel("", location, WrittenPose(location))
        self.keys = {0: WORLD_FRAME}

    def draft(self, name: str, notes: list[str]) -> Bodies:
        """Return the draft of the whole model, with the given name and notes; names of bodies, joints and sites are
        made legal in the scene. Gravity is 0 if the file switches it off."""
        scene, model = self.scene, self.model
        for body in range(1, model.nbody):
            self.add(body)
        for site in range(model.nsite):
            if written := scene.element_name("site", site):
                at = scene.place("site", site, model.nsite)
                pose = self.pose(at, model.site_pos[site], model.site_quat[site], int(model.site_bodyid[site]))
                frame = DraftFrame(scene.name("body", written, ""), at, pose, pose.relative_to)
                self.world.frames[f"site {written}"] = frame
        gravity = [0.0] * 3 if scene.is_disabled("GRAVITY") else model.opt.gravity.tolist()
        return Bodies(name, self.world, Leftovers({}), gravity, notes=notes, legal=True)

    def pose(self, location: ElementPlace, position: Array, quaternion: Array, body: int) -> WrittenPose:
        """Return the pose in the link of a body, by position (3,), m, and quaternion (4,), w first; ``body`` is the
        number."""
        return WrittenPose(location, rotation_matrix(np.array(quaternion)), np.array(position), self.keys[body])

    def attach(
        self,
        name: str,
        pose: WrittenPose,
        inertia: Inertia,
        joint: DraftJoint | None = None,
        *,
        pulled: bool = True,
        kept: bool = False,
    ) -> str:
        """Add a link at a pose in the link that the pose names, on a fixed joint if no other joint is given; return the
        key. ``pulled`` is whether gravity acts; a ``kept`` link is a body of its own even on a fixed joint."""
        key, location = f"body {name}", pose.place  # keys differ from names of sites
        self.world.links[key] = DraftLink(name, location, inertia, pose, pulled, kept=kept)
        if joint is None:
            joint_name = self.scene.name("joint", "", f"{name}_fixed") if kept else name
            joint = DraftJoint(joint_name, location, WrittenPose(location), "fixed", "fixed", "", "")
        self.world.joints[f"joint of {name}"] = replace(joint, parent=pose.relative_to, child=key)
        return key

    def add(self, body: int) -> None:
        """Add a body by number in the model, with all joints, as a chain of links. Each joint but the last one moves a
        link without mass, and the last one the body; if its anchor is not at the origin of the body, another link
        without mass, to which the body is fixed. A mocap body moves by motions from outside, or rests, with a note."""
        scene, model = self.scene, self.model
        name = scene.name("body", scene.element_name("body", body), f"body_{body}")
        location = scene.place("body", body, model.nbody)
        turned = rotation_matrix(np.array(model.body_iquat[body]))
        about = turned @ np.diag(model.body_inertia[body]) @ turned.T
        inertia = Inertia(float(model.body_mass[body]), np.array(model.body_ipos[body]), 0.5 * (about + about.T))
        pose = self.pose(location, model.body_pos[body], model.body_quat[body], int(model.body_parentid[body]))
        target = model.body_mocapid[body] >= 0
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        joints = [self.joint(joint, name) for joint in range(first, first + count)]
        if target and scene.moving_targets:
            joints = self.drives(body, name, location)
        elif target:
            note = f"the mocap body {name}, which rests at its place; mocap=True moves it [W0157]"
            scene.leave_out(location, f"not modelled: the motion of {note}")
        if joints and (target or joints[0][0].type == "free"):
            pose = WrittenPose(location, relative_to=pose.relative_to)
        before = np.zeros(3)
        for index, (joint, anchor) in enumerate(joints, 1):
            carries = index == len(joints) and not anchor.any()
            link = name if carries else scene.name("body", "", joint.name if target else f"{name}_{joint.name}")
            at = replace(pose, position=pose.position + pose.orientation @ (anchor - before))
            pose = WrittenPose(location, relative_to=self.attach(link, at, inertia if carries else NOTHING, joint))
            before = anchor
        key = f"body {name}"
        if key not in self.world.links:
            self.attach(name, replace(pose, position=pose.position - before), inertia, kept=bool(joints))
        self.keys[body] = key
        for which in range(first, first + count):
            self.add_armature(which, key)

    def joint(self, joint: int, body: str) -> tuple[DraftJoint, Array]:
        """Return the joint of the draft for MJCF joint number ``joint``, and the anchor (3,) in the body, m. Name,
        start, dynamics and stops are of the compiled model; ``body`` is the name of the body in the scene."""
        scene, model, kind = self.scene, self.model, int(self.model.jnt_type[joint])
        name = scene.joints[joint] = scene.name("joint", scene.element_name("joint", joint), f"{body}_{_WORDS[kind]}")
        start, rate = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        location = scene.place("joint", joint, model.njnt)
        q, v = scene.qpos[start:], scene.qvel[rate:]
        stiffness, damping = coefficients(scene, joint)
        limited = bool(model.jnt_limited[joint]) and not scene.is_disabled("LIMIT") and kind != FREE
        axis = Axis(
            location,
            tuple(model.jnt_axis[joint].tolist()),
            damping=damping[0],
            friction=0.0 if scene.is_disabled("FRICTIONLOSS") else float(model.dof_frictionloss[rate]),
            limited=("position",) if limited else (),
        )
        result = DraftJoint(name, location, WrittenPose(location), _TYPES[kind], _WORDS[kind], "", "")
        if kind in (FREE, BALL):
            of_turn = q[3:7] if kind == FREE else q[:4]
            quaternion = of_turn / np.linalg.norm(of_turn)
            initial = {"position": quaternion.tolist(), "velocity": v[:3].tolist()}
            if kind == FREE:
                velocity = np.array([*v[3:6], *(rotation_matrix(quaternion).T @ v[:3])])
                initial = {"position": q[:3].tolist(), "orientation": quaternion.tolist()}
                initial |= {"velocity": velocity.tolist()} if velocity.any() else {}
            return replace(result, around=axis, entry={"initial": initial}), _anchor(model, joint)
        entry: dict[str, Any] = {"initial": {"position": [float(q[0])], "velocity": [float(v[0])]}}
        if model.dof_armature[rate]:
            entry["rotor_inertia"] = float(model.dof_armature[rate])
        axis = replace(axis, stiffness=stiffness[0], rest=float(model.qpos_spring[start]))
        if limited:
            low, high = (float(value) for value in model.jnt_range[joint])
            axis = replace(axis, lower=low, upper=high, stop=_stop(model, joint))
        return replace(result, axes=(axis,), entry=entry, reference=float(model.qpos0[start])), _anchor(model, joint)

    def drives(self, body: int, name: str, location: ElementPlace) -> list[tuple[DraftJoint, Array]]:
        """Return six joints, each with the anchor 0, of a mocap body whose motion is an input: three travels in the
        axes of the world, then turns about z, y and x. The inputs, named ``NAME_x`` to ``NAME_roll``, are added with
        their start."""
        scene, model, which = self.scene, self.model, int(self.model.body_mocapid[body])
        position, quaternion = model.body_pos[body], model.body_quat[body]
        if scene.key >= 0:
            position, quaternion = model.key_mpos[scene.key][3 * which :], model.key_mquat[scene.key][4 * which :]
        R = rotation_matrix(np.array(quaternion[:4]) / np.linalg.norm(quaternion[:4]))
        angles = [np.arctan2(R[1, 0], R[0, 0]), -np.arcsin(np.clip(R[2, 0], -1.0, 1.0)), np.arctan2(R[2, 1], R[2, 2])]
        result: list[tuple[DraftJoint, Array]] = []
        words = ("x", "y", "z", "yaw", "pitch", "roll")
        for word, letter, value in zip(words, "xyzzyx", [*position[:3], *angles], strict=True):
            motion = scene.name("signal", "", f"{name}_{word}")
            scene.section("inputs")[motion] = {"motion": True, "initial": float(value)}
            axis = Axis(location, tuple(float(letter == direction) for direction in "xyz"))
            kind = "prismatic" if len(result) < 3 else "revolute"
            joint_name, pose = scene.name("joint", "", f"{name}_{word}"), WrittenPose(location)
            joint = DraftJoint(joint_name, location, pose, kind, kind, "", "", (axis,), entry={"drive": motion})
            result.append((joint, np.zeros(3)))
        return result

    def add_armature(self, joint: int, body: str) -> None:
        """Add a link, fixed to the link ``body``, with the kinetic energy of the armature of a free or ball joint on
        all components: for a free joint a mass at the body's origin, not pulled by gravity, and an isotropic inertia;
        for a ball joint the inertia alone. Other joints, and an armature of 0, add none."""
        scene, model, kind = self.scene, self.model, int(self.model.jnt_type[joint])
        armature = float(model.dof_armature[int(model.jnt_dofadr[joint])])
        if armature and kind in (FREE, BALL):
            name = scene.name("body", "", f"{scene.joints[joint]}_armature")
            pose = WrittenPose(scene.place("joint", joint, model.njnt), relative_to=body)
            inertia = Inertia(armature if kind == FREE else 0.0, np.zeros(3), armature * np.eye(3))
            self.attach(name, pose, inertia, pulled=False, kept=True)


def _anchor(model: Any, joint: int) -> Array:
    return np.array(model.jnt_pos[joint]) if int(model.jnt_type[joint]) in (HINGE, BALL) else np.zeros(3)


def coefficients(scene: MjcfDraft, joint: int) -> tuple[list[float], list[float]]:
    """Return the coefficients of a joint's spring and damper, for powers of coordinate and velocity from 1 on; zeros if
    the file switches springs or dampers off."""
    model, rate = scene.model, int(scene.model.jnt_dofadr[joint])
    stiffness = [float(model.jnt_stiffness[joint]), *map(float, model.jnt_stiffnesspoly[joint])]
    damping = [float(model.dof_damping[rate]), *map(float, model.dof_dampingpoly[rate])]
    off = scene.is_disabled("SPRING"), scene.is_disabled("DAMPER")
    return [0.0] * len(stiffness) if off[0] else stiffness, [0.0] * len(damping) if off[1] else damping


def _stop(model: Any, joint: int) -> tuple[float, float]:
    """Return stiffness and damping of a stop as hard as MuJoCo's in the configuration of the file.

    MuJoCo demands the acceleration -b v - k d r of a limit that is passed by r, with the impedance d at the end of its
    curve; the force is d times this one, divided by the inverse inertia felt there.
    """
    time, ratio = (float(value) for value in model.jnt_solref[joint])
    full = float(np.clip(model.jnt_solimp[joint][1], 1e-4, 0.9999))
    felt = full / float(model.dof_invweight0[int(model.jnt_dofadr[joint])])
    if time > 0.0:
        return felt / (full * (time * ratio) ** 2), 2.0 * felt / (full * time)
    return felt * -time / full, felt * -ratio / full


def add_forces(scene: MjcfDraft) -> None:
    """Add springs and dampers of higher order, springs of ball and free joints, and forces of gravity compensation;
    report joints whose forces no scene has. Mocap bodies without mass get 1 kg, so that the equations of their drives
    can be solved."""
    model = scene.model
    for joint, name in scene.joints.items():
        kind, entry = int(model.jnt_type[joint]), scene.data["joints"][name]
        stiffness, damping = coefficients(scene, joint)

        def refuse(fault: str, hint: str, joint: int = joint) -> None:
            scene.refuse(scene.place("joint", joint, model.njnt), f"joints.{scene.joints[joint]}", fault, hint)

        if kind in (FREE, BALL):
            for word, values in (("damping", damping), ("stiffness", stiffness)):
                if any(values[1:]):
                    fault = f"a {_WORDS[kind]} joint with {word} of higher order is not supported [E1931]"
                    refuse(fault, f"one coefficient of {word}")
            if kind == BALL and entry["parent"] != BASE and model.dof_armature[int(model.jnt_dofadr[joint])]:
                fault = "a ball joint with armature on a body that moves is not supported [E1933]"
                refuse(fault, "armature 0, and the inertia in the body")
            if stiffness[0]:
                _add_bushing(scene, joint, entry, stiffness[0])
            continue
        rest = number(float(model.qpos_spring[int(model.jnt_qposadr[joint])]))
        terms = {"spring": (f"(q.{name} - {rest})", stiffness, plain_power)}
        terms["damper"] = (f"v.{name}", damping, odd_power)
        for word, (variable, values, power) in terms.items():
            if any(values[1:]):
                effort = polynomial(variable, [0.0, *values[1:]], power)
                effort = f"-{effort}" if effort.startswith("(") else f"-({effort})"
                scene.add("efforts", "effort", f"{name}_{word}", {"joint": name, "effort": effort})
        if model.jnt_springyield[joint] and any(stiffness):
            fault = "springyield makes the spring plastic, and no scene has such springs [E1929]"
            refuse(fault, "springyield 0")
    for target in np.flatnonzero(model.body_mocapid >= 0) if scene.moving_targets else ():
        name = scene.places[int(target)].body
        if not scene.data["bodies"][name].get("mass"):
            scene.data["bodies"][name] |= {"mass": 1.0, "inertia": [1.0, 1.0, 1.0]}
            note = f"the mocap body {name} has no mass in the file; its 1 kg here loads its drives alone [W0164]"
            scene.notes.append(note)
    for body, (at, force) in _gravity_compensation(scene).items():
        entry = {"body": at.body, "point": at.position.tolist(), "force": force.tolist()}
        scene.add("forces", "force", f"gravity_compensation_{scene.element_name('body', body) or body}", entry)


def _add_bushing(scene: MjcfDraft, joint: int, entry: dict[str, Any], stiffness: float) -> None:
    """Add the spring of a ball or free joint as a bushing between the axes at rest, in the parent, and the axes of the
    child. ``entry`` is the joint's entry in the scene; ``stiffness`` in N m/rad, and for a free joint also in N/m."""
    rest = scene.model.qpos_spring[int(scene.model.jnt_qposadr[joint]) :]
    free = entry["type"] == "free"
    placed = LinkPlace(entry["parent"], np.array(entry["orientation"]), np.array(entry["position"]))
    at_rest = placed.of(np.array(rest[:3]), rest[3:7]) if free else placed.of(np.zeros(3), rest[:4])
    second = {"body": entry["child"], "axis": [0.0, 0.0, 1.0], "x_axis": [1.0, 0.0, 0.0]}
    bushing = {"first": at_rest.end(), "second": second, "rotational_stiffness": [stiffness] * 3}
    bushing |= {"stiffness": [stiffness] * 3} if free else {}
    scene.add("bushings", "bushing", f"{scene.joints[joint]}_spring", bushing)


def _gravity_compensation(draft: MjcfDraft) -> dict[int, tuple[LinkPlace, Array]]:
    """Return, by number of each body that ``gravcomp`` holds up, the place of the centre of mass and the force (3,) on
    it, N, in world axes. Bodies on the base are left out."""
    model, gravity = draft.model, np.array(draft.data["gravity"])
    if draft.without_passive_forces or not gravity.any():
        return {}
    result = {}
    for body in range(1, model.nbody):
        part, placement = float(model.body_gravcomp[body]), draft.places[body]
        if part and placement.body != BASE:
            force = -part * float(model.body_mass[body]) * gravity
            result[body] = placement.of(np.array(model.body_ipos[body])), force
    return result


def compensated_by(draft: MjcfDraft, joint: int) -> list[tuple[LinkPlace, Array]]:
    """Return the places of the centres of mass, and the forces (3,) on them, N, in world axes, of the bodies that
    ``gravcomp`` holds up and that the joint carries."""
    carrier = int(draft.model.jnt_bodyid[joint])
    return [pair for body, pair in _gravity_compensation(draft).items() if carrier in bodies_above(draft.model, body)]


def compensation_on(draft: MjcfDraft, joint: int) -> str:
    """Return the formula of the effort of a hinge or slide by ``gravcomp`` of the bodies on it; empty without such
    bodies. Points and definitions are added to the scene."""
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
        return dot(axis, [number(float(part)) for part in whole])
    moments: list[list[str]] = [[], [], []]
    for at, force in held:
        arm = draft.along(start, draft.point(f"weight_{at.body}_{len(draft.frame_origins)}", at))
        for parts, part in zip(moments, cross(arm, [number(float(part)) for part in force]), strict=True):
            parts.append(part)
    return dot(axis, draft.define_each(f"{name}_support", [draft.sum_of(name, parts) for parts in moments]))


def bodies_above(model: Any, body: int) -> list[int]:
    """Return a body and the bodies that carry it, without the world."""
    chain = []
    while body:
        chain.append(body)
        body = int(model.body_parentid[body])
    return chain
