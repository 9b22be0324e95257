"""Actuators of MJCF: inputs, internal states, and efforts of joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.mjcf import quaternions
from eomgen.products.robots.mjcf.controllers import SIGNALS, ControlledDrive, motor_force, nearest, pid_force
from eomgen.products.robots.mjcf.draft import MjcfDraft, clip, odd_power, polynomial, times, total
from eomgen.products.robots.mjcf.muscles import Muscle, activation_rate
from eomgen.products.robots.mjcf.tendons import add_armature, add_tension
from eomgen.products.robots.mjcf.transmissions import moved_joints, transmission
from eomgen.products.robots.mjcf.tree import HINGE, SLIDE, compensated_by, compensation_on
from eomgen.products.robots.scene_draft import number


def convert_actuators(draft: MjcfDraft) -> None:
    """Add the actuators of a file to the scene: inputs, states, definitions and forces, then one effort for each joint
    that actuators drive. Actuators that the file switches off are noted."""
    model, efforts = draft.model, draft.efforts
    first: dict[int, ElementPlace] = {}  # actuator of each joint
    off = int(model.opt.disableactuator)
    count = len(model.actuator_trntype)
    for index in range(count):
        location = draft.place("actuator", index, count)
        name = draft.name("signal", draft.element_name("actuator", index), f"actuator_{index + 1}")
        group = int(model.actuator_group[index])
        actuator = _Actuator(draft, name, index, location)
        if draft.is_disabled("ACTUATION") or (0 <= group <= 30 and off & (1 << group)):
            draft.leave_out(location, f"not modelled: the actuator {name}, which the file switches off [W0148]")
            actuator.add_inertia_and_damping()  # an actuator without force has these in MuJoCo
            continue
        actuator.convert()
        for joint in list(efforts)[len(first) :]:  # joints that no actuator before drives
            first[joint] = location
    driven = count > 0 and not draft.is_disabled("ACTUATION")
    for joint in range(model.njnt):
        effort = _effort_on(draft, joint, efforts.get(joint, []), driven=driven)
        if effort:
            name = draft.joints[joint]
            added = draft.add("efforts", "effort", f"{name}_actuation", {"joint": name, "effort": effort})
            draft.lines[f"efforts.{added}"] = str(first.get(joint, draft.place("joint", joint, model.njnt)))


def _effort_on(draft: MjcfDraft, joint: int, terms: list[str], *, driven: bool) -> str:
    """Return the formula of the effort of all actuators on a joint, within the range of efforts; empty for none.

    ``terms`` are the efforts of single actuators, ``driven`` is whether the file has actuators that are on. With
    ``actuatorgravcomp`` the compensation of gravity acts through the actuators, counts for the range, and is subtracted
    without actuators in the file.
    """
    model = draft.model
    moves = int(model.jnt_type[joint]) in (HINGE, SLIDE)
    limited = driven and moves and bool(model.jnt_actfrclimited[joint])
    support = ""
    if model.jnt_actgravcomp[joint] and (limited or not driven):
        if moves:
            support = compensation_on(draft, joint)
        elif not driven and compensated_by(draft, joint):
            name = draft.joints[joint]
            fault = f"actuatorgravcomp of {name}, which has several coordinates and no drive, is not supported [E2208]"
            at = draft.place("joint", joint, model.njnt)
            draft.report.add_place(at.file, at.line, f"joints.{name}", fault, "no actuatorgravcomp there")
    low, high = (float(value) for value in model.jnt_actfrcrange[joint])
    if limited and (terms or support or not low <= 0.0 <= high):
        effort = clip(total([*terms, *([support] if support else [])]), low, high)
        return f"({effort} - {support})" if support else effort
    return f"(-{support})" if support else total(terms) if terms else ""


class _Actuator(ControlledDrive):
    """One actuator: force = gain * (control or activation) + bias; its methods add all parts to the scene."""

    def convert(self) -> None:
        """Add the actuator's inputs, states and loads to the scene; report an actuator that no scene has, and note one
        that acts on contacts alone."""
        model, index = self.model, self.index
        if self.is_of("trn", "BODY"):
            note = f"not modelled: the actuator {self.name}, which acts on contacts alone [W0149]"
            self.draft.leave_out(self.place, note)
            return
        if float(model.actuator_delay[index]) > 0.0:
            self.refuse("a delay of the control is not supported [E1911]", "delay 0")
            return
        if self.is_of("gain", "SO3"):
            self.orient()
            return
        path = transmission(self)
        if isinstance(path, str):
            self.refuse(f"an actuator with a transmission of type {path} is not supported [E1912]")
            return
        self.path = path
        self.draft.actuator_motions[index] = path.length, path.rate
        self.add_inertia_and_damping()
        self.refuse_limits_of_joints()
        force = self.force()
        self.draft.actuator_forces[index] = force
        if force:
            path.load(force)

    def add_inertia_and_damping(self) -> None:
        """Add the armature and the damping of the actuator, times the square of the gear, to the joint or tendon; as in
        MuJoCo, others have none. On ball and free joints both are reported."""
        model, draft, target, square = self.model, self.draft, self.targets()[0], self.gear[0] ** 2
        armature = square * float(model.actuator_armature[self.index])
        damping = [float(model.actuator_damping[self.index]), *map(float, model.actuator_dampingpoly[self.index])]
        damping = [0.0 if draft.is_disabled("DAMPER") else square * c for c in damping]
        if not (armature or any(damping)):
            return
        if self.is_of("trn", "TENDON"):
            if not add_armature(draft, target, armature):
                self.refuse("armature on a tendon of several joints is not supported [E1913]", "armature of the joints")
            if any(damping):
                add_tension(draft, target, [polynomial(f"{draft.tendons[target]}_rate", damping, odd_power)])
        elif self.is_of("trn", "JOINT", "JOINTINPARENT"):
            if int(model.jnt_type[target]) not in (HINGE, SLIDE):
                fault = "armature or damping on a ball or free joint is not supported [E1914]"
                self.refuse(fault, "damping of the joint")
                return
            name = draft.joints[target]
            if armature:
                entry = draft.section("joints")[name]
                entry["rotor_inertia"] = entry.get("rotor_inertia", 0.0) + armature
            if any(damping):
                effort = f"-({polynomial(f'v.{name}', damping, odd_power)})"
                draft.add("efforts", "effort", f"{self.name}_damping", {"joint": name, "effort": effort})

    def refuse_limits_of_joints(self) -> None:
        """Report joints with ``actuatorfrcrange`` on which this actuator acts by forces on bodies, for which no range
        holds."""
        model, draft = self.model, self.draft
        for joint in moved_joints(self):
            if model.jnt_actfrclimited[joint]:
                name = draft.joints[joint]
                fault = f"actuatorfrcrange of {name}, on which a force on bodies acts, is not supported [E2128]"
                self.refuse(fault, "forcerange of the actuators")

    def add_controls(self) -> list[str]:
        """Add the inputs of the actuator, and return the terms of its controls within their ranges; ``controls`` has
        these terms by their words in ``SIGNALS``, by w, x, y, z for several without words, or by an empty word."""
        model = self.model
        count, signals = int(model.actuator_ctrlnum[self.index]), int(model.actuator_ctrlspec[self.index])
        words = [word for word, bit in SIGNALS.items() if signals & bit]
        if len(words) != count:
            words = [""] if count == 1 else ["w", "x", "y", "z"][-count:] if count else []
        first = int(model.actuator_ctrladr[self.index])
        self.controls = {word: self.input(first + k, word if count > 1 else "") for k, word in enumerate(words)}
        return list(self.controls.values())

    def input(self, address: int, word: str) -> str:
        """Add the input with number ``address`` among the controls of the model, with the value in the keyframe, and
        return the term of the control within the range. ``word`` is appended to the name."""
        model, draft = self.model, self.draft
        name = draft.name("signal", "", f"{self.name}_{word}") if word else self.name
        entry: dict[str, Any] = {"description": f"control of the actuator {self.name}"}
        if draft.key >= 0:
            value = float(model.key_ctrl[draft.key][address])
            entry |= {"formula": value} if value else {}
        draft.put("inputs", name, entry, self.place)
        if model.actuator_ctrllimited[address] and not draft.is_disabled("CLAMPCTRL"):
            return clip(name, *map(float, model.actuator_ctrlrange[address]))
        return name

    def driving(self) -> str:
        """Return the term that the gain multiplies: the control, or an activation, which is added as a state with the
        rate. Empty for unknown dynamics or a time constant of 0, which are reported."""
        model, kinds = self.model, self.draft.mujoco.mjtDyn
        kind = int(model.actuator_dyntype[self.index])
        if not self.is_of("dyn", "NONE", "MUSCLE", "INTEGRATOR", "FILTER", "FILTEREXACT"):
            word = kinds(kind).name.removeprefix("mjDYN_").lower()
            return self.refuse(f"an actuator with dynamics of type {word} is not supported [E1915]")
        control = self.add_controls()[0]
        if kind == kinds.mjDYN_NONE:
            return self.nearest(control)
        name = self.state("activation")
        rate, times_of_change = control, [float(value) for value in model.actuator_dynprm[self.index][:2]]
        if kind != kinds.mjDYN_INTEGRATOR and min(times_of_change[: 2 if kind == kinds.mjDYN_MUSCLE else 1]) <= 0.0:
            fault = "a time constant of 0 makes the rate of the activation infinite [E2210]"
            return self.refuse(fault, "a time constant above 0")
        if kind == kinds.mjDYN_MUSCLE:
            rate = activation_rate(f"({control})", name, model.actuator_dynprm[self.index])
        elif kind != kinds.mjDYN_INTEGRATOR:
            rate = f"({control} - {name}) / {times_of_change[0]!r}"
        if model.actuator_actlimited[self.index]:
            low, high = (number(float(value)) for value in model.actuator_actrange[self.index])
            rate = f"({rate} if {low} < {name} < {high} else max({rate}, 0) if {name} <= {low} else min({rate}, 0))"
        self.set_rate(name, rate)
        return self.nearest(name) if kind == kinds.mjDYN_INTEGRATOR else name

    def nearest(self, setpoint: str) -> str:
        """Return the setpoint as the equivalent angle by less than half a turn from the length, for a servo of
        rotations; other setpoints are returned unchanged."""
        model, gain = self.model, float(self.model.actuator_gainprm[self.index][0])
        servo = self.is_of("gain", "FIXED") and self.is_of("bias", "AFFINE")
        if not (self.path.period and servo and gain == -float(model.actuator_biasprm[self.index][1])):
            return setpoint
        return f"({self.path.length} + {nearest(f'({setpoint} - {self.path.length})', self.path.period)})"

    def force(self) -> str:
        """Return the formula of the actuator's force within its ranges, gain times control or activation plus bias;
        empty for a fault, which is reported. Inputs and states are added."""
        model, gains, biases = self.model, self.draft.mujoco.mjtGain, self.draft.mujoco.mjtBias
        if self.is_of("gain", "MUSCLE") and self.is_of("bias", "MUSCLE"):
            return self.muscle_force()
        if self.is_of("gain", "PID", "DCMOTOR"):
            return self.controlled_force()
        affine = self.is_of("gain", "AFFINE")
        known = affine or self.is_of("gain", "FIXED")
        if not known or not self.is_of("bias", "NONE", "AFFINE"):
            gain_kind, bias_kind = int(model.actuator_gaintype[self.index]), int(model.actuator_biastype[self.index])
            word = (gains(gain_kind) if not known else biases(bias_kind)).name.rpartition("_")[2].lower()
            return self.refuse(f"an actuator of type {word} is not supported [E1916]")
        driving = self.driving()
        if not driving:
            return ""
        gain = self.parameters("gain")[: 3 if affine else 1]
        bias = self.parameters("bias")[: 3 if self.is_of("bias", "AFFINE") else 0]
        terms = []
        if any(gain[1:]):
            terms.append(f"{_affine(gain, self.path.length, self.path.rate)} * {driving}")
        elif gain[0]:
            terms.append(times(gain[0], driving))
        if any(bias):
            terms.append(_affine(bias, self.path.length, self.path.rate))
        return self.limit(total(terms))

    def controlled_force(self) -> str:
        """Return the formula of the force of a PID controller or a DC motor; empty for a fault, which is reported.
        Inputs and states are added."""
        self.add_controls()
        if self.is_of("gain", "PID"):
            return self.limit(pid_force(self))
        if self.parameters("dyn")[5] > 0.0 and min(self.parameters("bias")[3:5]) <= 0.0:
            fault = "lugre: bristles without friction have an infinite rate [E2211]"
            return self.refuse(fault, "kinetic and static friction above 0")
        return motor_force(self, self.limit)

    def limit(self, force: str) -> str:
        """Return the formula of a force, limited to the range of forces of its tendon and then to its own range."""
        model, tendon = self.model, self.targets()[0]
        if self.is_of("trn", "TENDON") and model.tendon_actfrclimited[tendon]:
            on_tendons = np.array(model.actuator_trntype) == int(self.draft.mujoco.mjtTrn.mjTRN_TENDON)
            if np.count_nonzero(on_tendons & (np.array(model.actuator_trnid)[:, 0] == tendon)) > 1:
                fault = "actuatorfrcrange of a tendon with several actuators is not supported [E1918]"
                self.refuse(fault, "forcerange of each")
            force = clip(force, *map(float, model.tendon_actfrcrange[tendon]))
        if model.actuator_forcelimited[self.index]:
            force = clip(force, *map(float, model.actuator_forcerange[self.index]))
        return force

    def muscle_force(self) -> str:
        """Return the formula of the force of a muscle within its ranges; empty for a fault, which is reported. The
        control, the activation, and the normalized length and rate are added."""
        model = self.model
        driving = self.driving()
        if not driving:
            return ""
        low, high = (float(value) for value in model.actuator_lengthrange[self.output])
        acceleration = float(model.actuator_acc0[self.output])
        if acceleration <= 0.0 and min(self.parameters(kind)[2] for kind in ("gain", "bias")) < 0.0:
            fault = "a muscle that accelerates no coordinate at the start has no force by its scale [E2212]"
            return self.refuse(fault, "force of the muscle")
        gain, passive = (Muscle(self.parameters(kind)[:9], (low, high), acceleration) for kind in ("gain", "bias"))
        length = self.define("length", gain.length(f"({self.path.length})"))
        pace = self.define("rate", gain.rate(f"({self.path.rate})"))
        return self.limit(f"({gain.gain(length, pace)} * {driving} + {passive.passive(length)})")

    def orient(self) -> None:
        """Add efforts of the torque that turns a ball joint to an orientation, given by controls as a quaternion (4) or
        a rotation vector (3). Between sites the actuator is reported."""
        model, draft, (target, reference) = self.model, self.draft, self.targets()
        self.refuse_limits_of_joints()
        if reference >= 0:
            self.refuse("an orientation actuator between sites is not supported [E1919]", "one on a ball joint")
            return
        names = self.add_controls()
        if len(names) == 4:
            square = self.define("square", total([f"({name})**2" for name in names]))
            size = self.define("size", f"sqrt({square} if {square} > 0.0 else 1.0)")
            parts = [f"({names[0]} / {size} if {square} > 0.0 else 1.0)", *(f"{x} / {size}" for x in names[1:])]
            wanted = draft.define_each(self.name, parts, "wxyz")
        else:
            if self.is_of("dyn", "INTEGRATOR"):
                names = [self.state(f"activation_{x}", name) for x, name in zip("xyz", names, strict=True)]
            wanted = quaternions.exponential(draft, f"{self.name}_wanted", names)
        joint = draft.joints[target]
        now, speeds = [f"q.{joint}[{i}]" for i in range(4)], [f"v.{joint}[{i}]" for i in range(3)]
        error = quaternions.product(draft, f"{self.name}_error", quaternions.inverse(now), wanted)
        turn = quaternions.logarithm(draft, f"{self.name}_turn", error)
        gain, bias = self.parameters("gain")[0], self.parameters("bias")
        forces = [
            f"{number(gain)} * {e} + {number(bias[0])} + {number(bias[2])} * {speed}"
            for e, speed in zip(turn, speeds, strict=True)
        ]
        forces = self.define_each("torque", forces)
        if model.actuator_forcelimited[self.index]:
            bound = number(float(model.actuator_forcerange[self.index][1]))
            square = f"max({total([f'{part}**2' for part in forces])}, {bound}**2)"
            scale = self.define("scale", f"{bound} / sqrt({square})")
            forces = [f"({scale} * {part})" for part in forces]
        for index, part in enumerate(forces):
            effort = {"joint": joint, "index": index, "effort": part}
            draft.add("efforts", "effort", f"{self.name}_{'xyz'[index]}", effort)


def _affine(coefficients: list[float], length: str, rate: str) -> str:
    """Return the formula a + b length + c rate in brackets; ``coefficients`` has a and perhaps b and c."""
    terms = [number(coefficients[0])] if coefficients[0] else []
    terms += [times(c, f"({name})") for c, name in zip(coefficients[1:], (length, rate), strict=False) if c]
    text = total(terms)
    return text if len(terms) != 1 else f"({text})"
