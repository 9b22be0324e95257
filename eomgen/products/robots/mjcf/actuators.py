"""Actuators of MJCF: inputs, internal states, and efforts of joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.products.robots.leftovers import Place
from eomgen.products.robots.mjcf import quaternions
from eomgen.products.robots.mjcf.controllers import SIGNALS, Plant, motor_force, nearest, pid_force
from eomgen.products.robots.mjcf.draft import Draft, clipped, odd_power, polynomial, times, total
from eomgen.products.robots.mjcf.muscles import Muscle, activation_rate
from eomgen.products.robots.mjcf.tendons import add_armature, add_tension
from eomgen.products.robots.mjcf.transmissions import Drive, moved_joints, transmission
from eomgen.products.robots.mjcf.tree import HINGE, SLIDE, compensated_by, compensation_on
from eomgen.products.robots.scene_draft import number


def convert_actuators(draft: Draft) -> None:
    """Add the actuators of a file to the scene, then the efforts of joints that several of them drive."""
    model = draft.model
    efforts: dict[int, list[str]] = {}
    first: dict[int, Place] = {}  # actuator of each joint
    off = int(model.opt.disableactuator)
    count = len(model.actuator_trntype)
    for index in range(count):
        place = draft.place("actuator", index, count)
        name = draft.name("signal", draft.written("actuator", index), f"actuator_{index + 1}")
        group = int(model.actuator_group[index])
        actuator = _Actuator(draft, index, name, place)
        if draft.disabled("ACTUATION") or (0 <= group <= 30 and off & (1 << group)):
            draft.leave_out(place, f"not modelled: the actuator {name}, which the file switches off [W0148]")
            actuator.convert_passive()
            continue
        actuator.convert(efforts)
        for joint in list(efforts)[len(first) :]:  # joints that no actuator before drives
            first[joint] = place
    driven = count > 0 and not draft.disabled("ACTUATION")
    for joint in range(model.njnt):
        effort = _effort_on(draft, joint, efforts.get(joint, []), driven=driven)
        if effort:
            name = draft.joints[joint]
            own = draft.name("effort", "", f"{name}_actuation")
            draft.section("efforts")[own] = {"joint": name, "effort": effort}
            draft.lines[f"efforts.{own}"] = str(first.get(joint, draft.place("joint", joint, model.njnt)))


def _effort_on(draft: Draft, joint: int, terms: list[str], *, driven: bool) -> str:
    """Return the effort of the actuators on a joint, within its range; empty for none.

    Of a joint with ``actuatorgravcomp`` the support of gravity that its bodies have goes through the drive: it counts
    for the range, and is lost without a drive in the file.
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
        effort = clipped(total([*terms, *([support] if support else [])]), low, high)
        return f"({effort} - {support})" if support else effort
    return f"(-{support})" if support else total(terms) if terms else ""


class _Actuator:
    """One actuator: force = gain * (control or activation) + bias."""

    def __init__(self, draft: Draft, index: int, name: str, place: Place) -> None:
        self.draft, self.model = draft, draft.model
        self.index, self.name, self.line = index, name, place
        self.length, self.rate, self.period = "0.0", "0.0", 0.0
        # before 4.0 every actuator has one control and one output
        self.address = int(self.model.actuator_ctrladr[index]) if hasattr(self.model, "actuator_ctrladr") else index
        self.output = int(self.model.actuator_outadr[index]) if hasattr(self.model, "actuator_outadr") else index

    def refuse(self, fault: str, hint: str = "a motor, and a controller in a scene that includes the file") -> None:
        self.draft.refuse(self.line, f"actuator {self.name}", fault, hint)

    def is_of(self, kind: str, name: str) -> bool:
        """Return whether a property of the actuator, as ``gain``, has a value that MuJoCo has."""
        values = getattr(self.draft.mujoco, f"mjt{kind.capitalize()}")
        value = getattr(values, f"mj{kind.upper()}_{name}", None)
        fields = {"trn": "trntype", "dyn": "dyntype", "gain": "gaintype", "bias": "biastype"}
        return value is not None and int(getattr(self.model, f"actuator_{fields[kind]}")[self.index]) == int(value)

    def convert(self, efforts: dict[int, list[str]]) -> None:
        """Add the actuator; ``efforts`` are the terms of joints."""
        model, index = self.model, self.index
        if self.is_of("trn", "BODY"):
            note = f"not modelled: the actuator {self.name}, which acts on contacts alone [W0149]"
            self.draft.leave_out(self.line, note)
            return
        if hasattr(model, "actuator_delay") and float(model.actuator_delay[index]) > 0.0:
            self.refuse("a delay of the control is not supported [E1911]", "delay 0")
            return
        gear = [float(value) for value in model.actuator_gear[self.output]]
        drive = Drive(self.draft, self.name, index, gear, efforts)
        if self.is_of("gain", "SO3"):
            self.orient(drive)
            return
        path = transmission(drive)
        if isinstance(path, str):
            self.refuse(f"an actuator with a transmission of type {path} is not supported [E1912]")
            return
        self.length, self.rate, self.period = path.length, path.rate, path.period
        self.draft.actuator_motions[index] = path.length, path.rate
        self.add_inertia_and_damping(drive)
        self.refuse_limits_of_joints(drive)
        force = self.force()
        self.draft.actuator_forces[index] = force
        if force:
            path.load(force)

    def convert_passive(self) -> None:
        """Add the armature and the damping alone, which an actuator without force has in MuJoCo."""
        gear = [float(value) for value in self.model.actuator_gear[self.output]]
        self.add_inertia_and_damping(Drive(self.draft, self.name, self.index, gear, {}))

    def add_inertia_and_damping(self, drive: Drive) -> None:
        """Add the armature and the damping of the actuator to its joint or tendon; others have none in MuJoCo."""
        model, draft, target, square = self.model, self.draft, drive.targets()[0], drive.gear[0] ** 2
        armature = square * float(model.actuator_armature[self.index])
        damping = [float(model.actuator_damping[self.index]), *map(float, model.actuator_dampingpoly[self.index])]
        damping = [0.0 if draft.disabled("DAMPER") else square * c for c in damping]
        if not (armature or any(damping)):
            return
        if self.is_of("trn", "TENDON"):
            if not add_armature(draft, target, armature):
                self.refuse("armature on a tendon of several joints is not supported [E1913]", "armature of the joints")
            if any(damping):
                add_tension(draft, target, [polynomial(f"{draft.tendons[target]}_rate", damping, odd_power)])
        elif self.is_of("trn", "JOINT") or self.is_of("trn", "JOINTINPARENT"):
            if int(model.jnt_type[target]) not in (HINGE, SLIDE):
                self.refuse(
                    "armature or damping on a ball or free joint is not supported [E1914]", "damping of the joint"
                )
                return
            name = draft.joints[target]
            if armature:
                entry = draft.section("joints")[name]
                entry["rotor_inertia"] = entry.get("rotor_inertia", 0.0) + armature
            if any(damping):
                own = draft.name("effort", "", f"{self.name}_damping")
                effort = f"-({polynomial(f'v.{name}', damping, odd_power)})"
                draft.section("efforts")[own] = {"joint": name, "effort": effort}

    def refuse_limits_of_joints(self, drive: Drive) -> None:
        """Report joints with a range of the efforts of all actuators to which this one gives a part of its load."""
        model, draft = self.model, self.draft
        for joint in moved_joints(drive):
            if model.jnt_actfrclimited[joint]:
                fault = (
                    f"actuatorfrcrange of {draft.joints[joint]}, on which a force on bodies acts, is not"
                    f" supported [E2128]"
                )
                self.refuse(fault, "forcerange of the actuators")

    def controls(self) -> dict[str, str]:
        """Add the inputs, and return the controls within their ranges by their words; one control has none."""
        model = self.model
        count = int(model.actuator_ctrlnum[self.index]) if hasattr(model, "actuator_ctrlnum") else 1
        signals = int(model.actuator_ctrlspec[self.index]) if hasattr(model, "actuator_ctrlspec") else 0
        words = [word for word, bit in SIGNALS.items() if signals & bit]
        if len(words) != count:
            words = [""] if count == 1 else ["w", "x", "y", "z"][-count:] if count else []
        return {word: self.control(k, word if count > 1 else "") for k, word in enumerate(words)}

    def control(self, number_of_control: int, word: str) -> str:
        """Add an input, and return the control within its range."""
        model, draft, address = self.model, self.draft, self.address + number_of_control
        name = draft.name("signal", "", f"{self.name}_{word}") if word else self.name
        entry: dict[str, Any] = {"description": f"control of the actuator {self.name}"}
        if draft.key >= 0:
            value = float(model.key_ctrl[draft.key][address])
            entry |= {"formula": value} if value else {}
        draft.section("inputs")[name] = entry
        draft.lines[f"inputs.{name}"] = str(self.line)
        if model.actuator_ctrllimited[address] and not draft.disabled("CLAMPCTRL"):
            return clipped(name, *map(float, model.actuator_ctrlrange[address]))
        return name

    def state(self, word: str, number_of_state: int, rate: str = "") -> str:
        """Add an internal state, and return its name."""
        model, draft = self.model, self.draft
        name = draft.name("signal", "", f"{self.name}_{word}")
        entry: dict[str, Any] = {"rate": rate, "description": f"{word} of the actuator {self.name}"}
        if draft.key >= 0:
            value = float(model.key_act[draft.key][int(model.actuator_actadr[self.index]) + number_of_state])
            entry |= {"initial": value} if value else {}
        draft.section("states")[name] = entry
        early = model.actuator_actearly[self.index] and not self.is_of("dyn", "DCMOTOR")
        if early and not number_of_state:
            note = f"not modelled: actearly of the actuator {self.name}, which acts one step of MuJoCo earlier [W0150]"
            draft.leave_out(self.line, note)
        return name

    def driving(self) -> str:
        """Return the control, or the activation, whose state is added; empty for a fault."""
        model, kinds = self.model, self.draft.mujoco.mjtDyn
        kind = int(model.actuator_dyntype[self.index])
        if not any(self.is_of("dyn", word) for word in ("NONE", "MUSCLE", "INTEGRATOR", "FILTER", "FILTEREXACT")):
            word = kinds(kind).name.removeprefix("mjDYN_").lower()
            self.refuse(f"an actuator with dynamics of type {word} is not supported [E1915]")
            return ""
        control = next(iter(self.controls().values()))
        if kind == kinds.mjDYN_NONE:
            return self.nearest(control)
        name = self.state("activation", 0)
        rate, times_of_change = control, [float(value) for value in model.actuator_dynprm[self.index][:2]]
        if kind != kinds.mjDYN_INTEGRATOR and min(times_of_change[: 2 if kind == kinds.mjDYN_MUSCLE else 1]) <= 0.0:
            self.refuse(
                "a time constant of 0 makes the rate of the activation infinite [E2210]", "a time constant above 0"
            )
            return ""
        if kind == kinds.mjDYN_MUSCLE:
            rate = activation_rate(f"({control})", name, model.actuator_dynprm[self.index])
        elif kind != kinds.mjDYN_INTEGRATOR:
            rate = f"({control} - {name}) / {times_of_change[0]!r}"
        if model.actuator_actlimited[self.index]:
            low, high = (number(float(value)) for value in model.actuator_actrange[self.index])
            rate = f"({rate} if {low} < {name} < {high} else max({rate}, 0) if {name} <= {low} else min({rate}, 0))"
        self.draft.section("states")[name]["rate"] = rate
        return self.nearest(name) if kind == kinds.mjDYN_INTEGRATOR else name

    def nearest(self, setpoint: str) -> str:
        """Return the setpoint of a servo of rotations, as an angle by less than half a turn away."""
        model, gain = self.model, float(self.model.actuator_gainprm[self.index][0])
        servo = self.is_of("gain", "FIXED") and self.is_of("bias", "AFFINE")
        if not (self.period and servo and gain == -float(model.actuator_biasprm[self.index][1])):
            return setpoint
        return f"({self.length} + {nearest(f'({setpoint} - {self.length})', self.period)})"

    def force(self) -> str:
        """Return the formula of the actuator's force; empty for a fault."""
        model, gains, biases = self.model, self.draft.mujoco.mjtGain, self.draft.mujoco.mjtBias
        if self.is_of("gain", "MUSCLE") and self.is_of("bias", "MUSCLE"):
            return self.muscle_force()
        if self.is_of("gain", "PID") or self.is_of("gain", "DCMOTOR"):
            return self.controlled_force()
        affine = self.is_of("gain", "AFFINE")
        known = affine or self.is_of("gain", "FIXED")
        if not known or not (self.is_of("bias", "NONE") or self.is_of("bias", "AFFINE")):
            gain_kind, bias_kind = int(model.actuator_gaintype[self.index]), int(model.actuator_biastype[self.index])
            word = (gains(gain_kind) if not known else biases(bias_kind)).name.rpartition("_")[2].lower()
            self.refuse(f"an actuator of type {word} is not supported [E1916]")
            return ""
        driving = self.driving()
        if not driving:
            return ""
        gain = self.parameters("gain")[: 3 if affine else 1]
        bias = self.parameters("bias")[: 3 if self.is_of("bias", "AFFINE") else 0]
        terms = []
        if any(gain[1:]):
            terms.append(f"{_affine(gain, self.length, self.rate)} * {driving}")
        elif gain[0]:
            terms.append(times(gain[0], driving))
        if any(bias):
            terms.append(_affine(bias, self.length, self.rate))
        return self.limited(total(terms))

    def parameters(self, kind: str) -> list[float]:
        """Return the parameters of the dynamics ``dyn``, the ``gain`` or the ``bias``."""
        return [float(value) for value in getattr(self.model, f"actuator_{kind}prm")[self.index]]

    def controlled_force(self) -> str:
        """Return the force of a PID controller or a DC motor; empty for a fault."""
        model, draft = self.model, self.draft
        if not hasattr(model, "actuator_ctrlspec"):
            self.refuse(
                "a pid or dcmotor of MuJoCo before 3.12 is not supported [E1917]", "pip install -U 'eomgen[mujoco]'"
            )
            return ""
        count = 0

        def state(word: str) -> str:
            nonlocal count
            count += 1
            return self.state(word, count - 1)

        plant = Plant(
            self.controls(),
            self.length,
            self.rate,
            self.period,
            float(model.opt.timestep),
            lambda word, formula: draft.define(f"{self.name}_{word}", formula),
            state,
            lambda name, rate: draft.section("states")[name].update(rate=rate),
        )
        dynamics, gains, biases = (self.parameters(kind) for kind in ("dyn", "gain", "bias"))
        if self.is_of("gain", "PID"):
            return self.limited(pid_force(plant, dynamics, gains, biases))
        if dynamics[5] > 0.0 and min(biases[3:5]) <= 0.0:
            self.refuse(
                "lugre: bristles without friction have an infinite rate [E2211]", "kinetic and static friction above 0"
            )
            return ""
        return motor_force(plant, dynamics, gains, biases, self.limited)

    def limited(self, force: str) -> str:
        """Return a force within the ranges of forces of its tendon and its own."""
        model = self.model
        if self.is_of("trn", "TENDON"):
            force = self.limited_by_tendon(force, int(model.actuator_trnid[self.index][0]))
        if not model.actuator_forcelimited[self.index]:
            return force
        return clipped(force, *map(float, model.actuator_forcerange[self.index]))

    def limited_by_tendon(self, force: str, tendon: int) -> str:
        model = self.model
        if not model.tendon_actfrclimited[tendon]:
            return force
        on_tendons = np.array(model.actuator_trntype) == int(self.draft.mujoco.mjtTrn.mjTRN_TENDON)
        if np.count_nonzero(on_tendons & (np.array(model.actuator_trnid)[:, 0] == tendon)) > 1:
            self.refuse(
                "actuatorfrcrange of a tendon with several actuators is not supported [E1918]", "forcerange of each"
            )
        return clipped(force, *map(float, model.tendon_actfrcrange[tendon]))

    def muscle_force(self) -> str:
        """Return the force of a muscle; empty for a fault."""
        model, draft = self.model, self.draft
        driving = self.driving()
        if not driving:
            return ""
        low, high = (float(value) for value in model.actuator_lengthrange[self.output])
        acceleration = float(model.actuator_acc0[self.output])
        if acceleration <= 0.0 and min(self.parameters(kind)[2] for kind in ("gain", "bias")) < 0.0:
            self.refuse(
                "a muscle that accelerates no coordinate at the start has no force by its scale [E2212]",
                "force of the muscle",
            )
            return ""
        gain, passive = (Muscle(self.parameters(kind)[:9], (low, high), acceleration) for kind in ("gain", "bias"))
        own = draft.define(f"{self.name}_length", gain.length(f"({self.length})"))
        pace = draft.define(f"{self.name}_rate", gain.rate(f"({self.rate})"))
        return self.limited(f"({gain.gain(own, pace)} * {driving} + {passive.passive(own)})")

    def orient(self, drive: Drive) -> None:
        """Add the torque that turns a ball joint to an orientation."""
        model, draft, (target, reference) = self.model, self.draft, drive.targets()
        self.refuse_limits_of_joints(drive)
        if reference >= 0:
            self.refuse("an orientation actuator between sites is not supported [E1919]", "one on a ball joint")
            return
        names = list(self.controls().values())
        if len(names) == 4:
            square = draft.define(f"{self.name}_square", total([f"({name})**2" for name in names]))
            size = draft.define(f"{self.name}_size", f"sqrt({square} if {square} > 0.0 else 1.0)")
            parts = [f"({names[0]} / {size} if {square} > 0.0 else 1.0)", *(f"{x} / {size}" for x in names[1:])]
            wanted = [draft.define(f"{self.name}_{a}", part) for a, part in zip("wxyz", parts, strict=True)]
        else:
            if not self.is_of("dyn", "NONE"):
                if not self.is_of("dyn", "INTEGRATOR"):
                    self.refuse("dynamics of an orientation actuator are not supported [E1920]")
                    return
                names = [self.state(f"activation_{'xyz'[k]}", k, name) for k, name in enumerate(names)]
            wanted = quaternions.exponential(draft, f"{self.name}_wanted", names)
        joint = draft.joints[target]
        now, speeds = [f"q.{joint}[{i}]" for i in range(4)], [f"v.{joint}[{i}]" for i in range(3)]
        error = quaternions.product(draft, f"{self.name}_error", quaternions.inverse(now), wanted)
        turn = quaternions.logarithm(draft, f"{self.name}_turn", error)
        gain, bias = self.parameters("gain")[0], self.parameters("bias")
        forces = [
            draft.define(
                f"{self.name}_torque_{axis}",
                f"{number(gain)} * {e} + {number(bias[0])} + {number(bias[2])} * {speed}",
            )
            for axis, e, speed in zip("xyz", turn, speeds, strict=True)
        ]
        if model.actuator_forcelimited[self.index]:
            bound = number(float(model.actuator_forcerange[self.index][1]))
            square = f"max({total([f'{part}**2' for part in forces])}, {bound}**2)"
            scale = draft.define(f"{self.name}_scale", f"{bound} / sqrt({square})")
            forces = [f"({scale} * {part})" for part in forces]
        for index, part in enumerate(forces):
            own = draft.name("effort", "", f"{self.name}_{'xyz'[index]}")
            draft.section("efforts")[own] = {"joint": joint, "index": index, "effort": part}


def _affine(coefficients: list[float], length: str, rate: str) -> str:
    """Return a + b length + c rate in brackets."""
    terms = [number(coefficients[0])] if coefficients[0] else []
    terms += [times(c, f"({name})") for c, name in zip(coefficients[1:], (length, rate), strict=False) if c]
    text = total(terms)
    return text if len(terms) != 1 else f"({text})"
