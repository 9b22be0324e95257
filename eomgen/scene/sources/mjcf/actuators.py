"""Actuators of MJCF: inputs, internal states, and efforts of joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.scene.sources.draft import Place
from eomgen.scene.sources.mjcf.draft import Draft, clipped, number, odd_power, polynomial, times, total
from eomgen.scene.sources.mjcf.equalities import site_place
from eomgen.scene.sources.mjcf.muscles import Muscle, activation_rate
from eomgen.scene.sources.mjcf.tree import BALL, FREE, HINGE, SLIDE
from eomgen.system.description import BASE

_UNITS = {HINGE: "N m", SLIDE: "N"}


def convert_actuators(draft: Draft) -> None:
    """Add the actuators of a file to the scene, then the efforts of joints that several of them drive."""
    model = draft.model
    efforts: dict[int, list[str]] = {}
    off = int(model.opt.disableactuator)
    count = len(model.actuator_trntype)
    for index in range(count):
        place = draft.place("actuator", index, count)
        name = draft.name("signal", draft.written("actuator", index), f"actuator_{index + 1}")
        group = int(model.actuator_group[index])
        if draft.disabled("ACTUATION") or (0 <= group <= 30 and off & (1 << group)):
            draft.leave_out(place, f"not modelled: the actuator {name}, which the file switches off")
            continue
        _Actuator(draft, index, name, place).convert(efforts)
    for joint, terms in efforts.items():
        name = draft.joints[joint]
        effort = total(terms)
        if model.jnt_actfrclimited[joint]:
            effort = clipped(effort, *map(float, model.jnt_actfrcrange[joint]))
        draft.section("efforts")[draft.name("effort", "", f"{name}_actuation")] = {"joint": name, "effort": effort}


class _Actuator:
    """One actuator: force = gain * (control or activation) + bias."""

    def __init__(self, draft: Draft, index: int, name: str, place: Place) -> None:
        self.draft, self.model = draft, draft.model
        self.index, self.name, self.line = index, name, place
        # before 4.0 every actuator has one control
        self.address = int(self.model.actuator_ctrladr[index]) if hasattr(self.model, "actuator_ctrladr") else index

    def refuse(self, fault: str, hint: str = "a motor, and a controller in a scene that includes the file") -> None:
        self.draft.refuse(self.line, f"actuator {self.name}", fault, hint)

    def convert(self, efforts: dict[int, list[str]]) -> None:
        """Add the actuator; ``efforts`` are the terms of joints."""
        model, index, kinds = self.model, self.index, self.draft.mujoco.mjtTrn
        kind, target = int(model.actuator_trntype[index]), int(model.actuator_trnid[index][0])
        if hasattr(model, "actuator_ctrlnum") and int(model.actuator_ctrlnum[index]) != 1:
            self.refuse("an actuator with several controls is not supported")
            return
        if hasattr(model, "actuator_delay") and float(model.actuator_delay[index]) > 0.0:
            self.refuse("a delay of the control is not supported", "delay 0")
            return
        gear = [float(value) for value in model.actuator_gear[index]]
        in_joint = kind in (kinds.mjTRN_JOINT, kinds.mjTRN_JOINTINPARENT)
        if in_joint and int(model.jnt_type[target]) in (HINGE, SLIDE):
            joint = self.draft.joints[target]
            self.add_to_joint(target, gear[0])
            force = self.force(times(gear[0], f"q.{joint}"), times(gear[0], f"v.{joint}"))
            if force:
                efforts.setdefault(target, []).append(times(gear[0], f"({force})"))
        elif in_joint and (kind == kinds.mjTRN_JOINT or int(model.jnt_type[target]) == BALL):
            self.on_ball_or_free(target, gear, in_parent=kind == kinds.mjTRN_JOINTINPARENT)
        elif kind == kinds.mjTRN_SITE and int(model.actuator_trnid[index][1]) < 0:
            self.on_site(target, gear)
        elif kind == kinds.mjTRN_TENDON and target in self.draft.tendons:
            self.on_tendon(target, gear[0], efforts)
        else:
            word = kinds(kind).name.removeprefix("mjTRN_").lower()
            self.refuse(f"an actuator with a transmission of type {word} is not supported")

    def add_to_joint(self, joint: int, gear: float) -> None:
        """Add the armature and the damping of the actuator to its joint."""
        name = self.draft.joints[joint]
        entry = self.draft.section("joints")[name]
        armature = gear**2 * float(self.model.actuator_armature[self.index])
        if armature:
            entry["rotor_inertia"] = entry.get("rotor_inertia", 0.0) + armature
        damping = [
            float(self.model.actuator_damping[self.index]),
            *map(float, self.model.actuator_dampingpoly[self.index]),
        ]
        if any(damping) and not self.draft.disabled("DAMPER"):
            effort = polynomial(f"v.{name}", [gear**2 * c for c in damping], odd_power)
            own = self.draft.name("effort", "", f"{self.name}_damping")
            self.draft.section("efforts")[own] = {"joint": name, "effort": f"-({effort})"}

    def has_own_inertia(self) -> bool:
        model = self.model
        own = (model.actuator_armature[self.index], model.actuator_damping[self.index])
        return any(own) or bool(np.any(model.actuator_dampingpoly[self.index]))

    def control(self) -> str:
        """Add the input, and return the control within its range."""
        model, draft = self.model, self.draft
        entry: dict[str, Any] = {"description": f"control of the actuator {self.name}"}
        if draft.key >= 0:
            value = float(model.key_ctrl[draft.key][self.address])
            entry |= {"formula": value} if value else {}
        draft.section("inputs")[self.name] = entry
        draft.lines[f"inputs.{self.name}"] = str(self.line)
        if model.actuator_ctrllimited[self.index] and not draft.disabled("CLAMPCTRL"):
            return clipped(self.name, *map(float, model.actuator_ctrlrange[self.index]))
        return self.name

    def driving(self) -> str:
        """Return the control, or the activation, whose state is added; empty for a fault."""
        model, draft, kinds = self.model, self.draft, self.draft.mujoco.mjtDyn
        kind = int(model.actuator_dyntype[self.index])
        if kind == kinds.mjDYN_NONE:
            return self.control()
        muscle = kind == kinds.mjDYN_MUSCLE
        if not muscle and kind not in (kinds.mjDYN_INTEGRATOR, kinds.mjDYN_FILTER, kinds.mjDYN_FILTEREXACT):
            word = kinds(kind).name.removeprefix("mjDYN_").lower()
            self.refuse(f"an actuator with dynamics of type {word} is not supported")
            return ""
        control = self.control()
        name = draft.name("signal", "", f"{self.name}_activation")
        rate = control
        if muscle:
            rate = activation_rate(f"({control})", name, model.actuator_dynprm[self.index])
        elif kind != kinds.mjDYN_INTEGRATOR:
            time = max(float(model.actuator_dynprm[self.index][0]), 1e-15)
            rate = f"({control} - {name}) / {time!r}"
        if model.actuator_actlimited[self.index]:
            low, high = (number(float(value)) for value in model.actuator_actrange[self.index])
            rate = f"({rate} if {low} < {name} < {high} else max({rate}, 0) if {name} <= {low} else min({rate}, 0))"
        entry: dict[str, Any] = {"rate": rate, "description": f"activation of the actuator {self.name}"}
        if draft.key >= 0 and (value := float(model.key_act[draft.key][int(model.actuator_actadr[self.index])])):
            entry["initial"] = value
        draft.section("states")[name] = entry
        if model.actuator_actearly[self.index]:
            note = f"not modelled: actearly of the actuator {self.name}, which acts one step of MuJoCo earlier"
            draft.leave_out(self.line, note)
        return name

    def force(self, length: str, rate: str) -> str:
        """Return the formula of the actuator's force, and keep the formula for sensors; empty for a fault."""
        text = self._force(length, rate)
        self.draft.actuator_forces[self.index] = text
        return text

    def _force(self, length: str, rate: str) -> str:
        model, gains, biases = self.model, self.draft.mujoco.mjtGain, self.draft.mujoco.mjtBias
        gain_kind, bias_kind = int(model.actuator_gaintype[self.index]), int(model.actuator_biastype[self.index])
        if gain_kind == gains.mjGAIN_MUSCLE and bias_kind == biases.mjBIAS_MUSCLE:
            return self.muscle_force(length, rate)
        known = gain_kind in (gains.mjGAIN_FIXED, gains.mjGAIN_AFFINE)
        if not known or bias_kind not in (biases.mjBIAS_NONE, biases.mjBIAS_AFFINE):
            word = (gains(gain_kind) if not known else biases(bias_kind)).name.rpartition("_")[2].lower()
            self.refuse(f"an actuator of type {word} is not supported")
            return ""
        driving = self.driving()
        if not driving:
            return ""
        gain, bias = (
            [float(value) for value in parameters[self.index][: 3 if affine else first]]
            for parameters, affine, first in (
                (model.actuator_gainprm, gain_kind == gains.mjGAIN_AFFINE, 1),
                (model.actuator_biasprm, bias_kind == biases.mjBIAS_AFFINE, 0),
            )
        )
        terms = []
        if any(gain[1:]):
            terms.append(f"{_affine(gain, length, rate)} * {driving}")
        elif gain[0]:
            terms.append(times(gain[0], driving))
        if any(bias):
            terms.append(_affine(bias, length, rate))
        return self.limited(total(terms))

    def limited(self, force: str) -> str:
        """Return a force within the range of forces."""
        model = self.model
        if not model.actuator_forcelimited[self.index]:
            return force
        return clipped(force, *map(float, model.actuator_forcerange[self.index]))

    def muscle_force(self, length: str, rate: str) -> str:
        """Return the force of a muscle; empty for a fault."""
        model, draft = self.model, self.draft
        driving = self.driving()
        if not driving:
            return ""
        low, high = (float(value) for value in model.actuator_lengthrange[self.index])
        gain, passive = (
            Muscle([float(value) for value in parameters[self.index][:9]], (low, high), self.acceleration)
            for parameters in (model.actuator_gainprm, model.actuator_biasprm)
        )
        own, pace = (draft.name("signal", "", f"{self.name}_{word}") for word in ("length", "rate"))
        draft.section("definitions")[own] = {"formula": gain.length(f"({length})")}
        draft.section("definitions")[pace] = {"formula": gain.rate(f"({rate})")}
        return self.limited(f"({gain.gain(own, pace)} * {driving} + {passive.passive(own)})")

    @property
    def acceleration(self) -> float:
        return float(self.model.actuator_acc0[self.index])

    def plain_force(self, element: str) -> str:
        """Return the force of an actuator whose transmission has no length; empty for a fault."""
        model = self.model
        affine = int(model.actuator_biastype[self.index]) == self.draft.mujoco.mjtBias.mjBIAS_AFFINE
        by_gain = int(model.actuator_gaintype[self.index]) == self.draft.mujoco.mjtGain.mjGAIN_AFFINE
        if (affine and any(model.actuator_biasprm[self.index][1:3])) or (
            by_gain and any(model.actuator_gainprm[self.index][1:3])
        ):
            self.refuse(f"an actuator on {element} whose force depends on length or rate is not supported")
            return ""
        if self.has_own_inertia():
            self.refuse(f"an actuator on {element} with armature or damping is not supported")
            return ""
        return self.force("0.0", "0.0")

    def on_ball_or_free(self, joint: int, gear: list[float], *, in_parent: bool) -> None:
        kind = int(self.model.jnt_type[joint])
        if in_parent:
            self.refuse("a torque in the axes of the parent on a ball or free joint is not supported")
            return
        force = self.plain_force("a ball or free joint")
        if not force:
            return
        name = self.draft.joints[joint]
        turning = gear[:3] if kind == BALL else gear[3:]
        for index, part in enumerate(turning):
            if part:
                own = self.draft.name("effort", "", f"{self.name}_{'xyz'[index]}")
                effort = {"joint": name, "index": index, "effort": times(part, f"({force})")}
                self.draft.section("efforts")[own] = effort
        if kind == FREE and any(gear[:3]):
            own = self.draft.name("force", "", f"{self.name}_force")
            components = [times(part, f"({force})") if part else 0.0 for part in gear[:3]]
            self.draft.section("forces")[own] = {"body": self.draft.data["joints"][name]["child"], "force": components}

    def on_site(self, site: int, gear: list[float]) -> None:
        place = site_place(self.draft, site)
        force = self.plain_force("a site")
        if not force:
            return
        if place.body == BASE:
            self.draft.leave_out(self.line, f"not modelled: the actuator {self.name}, which acts on the world")
            return
        pushes, turns = (place.orientation @ np.array(part) for part in (gear[:3], gear[3:]))
        entry: dict[str, Any] = {"body": place.body, "point": place.position.tolist(), "axes": "body"}
        for key, vector in (("force", pushes), ("torque", turns)):
            if vector.any():
                entry[key] = [times(float(part), f"({force})") if part else 0.0 for part in vector]
        self.draft.section("forces")[self.draft.name("force", "", f"{self.name}_wrench")] = entry

    def on_tendon(self, tendon: int, gear: float, efforts: dict[int, list[str]]) -> None:
        if self.has_own_inertia():
            self.refuse("an actuator on a tendon with armature or damping is not supported")
            return
        length = self.draft.tendons[tendon]
        force = self.force(times(gear, length), times(gear, f"{length}_rate"))
        if not force:
            return
        own = self.draft.name("signal", "", f"{self.name}_force")
        self.draft.section("definitions")[own] = {"formula": force}
        if tendon in self.draft.branches:
            self.draft.pulls[tendon].append(times(-gear, own))
            return
        for joint, coefficient in self.draft.tendon_joints[tendon]:
            efforts.setdefault(joint, []).append(times(gear * coefficient, own))


def _affine(coefficients: list[float], length: str, rate: str) -> str:
    """Return a + b length + c rate in brackets."""
    terms = [number(coefficients[0])] if coefficients[0] else []
    terms += [times(c, f"({name})") for c, name in zip(coefficients[1:], (length, rate), strict=False) if c]
    text = total(terms)
    return text if len(terms) != 1 else f"({text})"
