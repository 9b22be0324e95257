"""Controllers and motors within actuators of MJCF as formulas: setpoints that follow at a limited rate, integrators,
PID, DC motors with winding, heat and friction.

Formulas: MuJoCo's documentation, "XML reference: actuator/pid" and "actuator/dcmotor", and its technical note on DC
motors. A rate limit acts over one step of MuJoCo, so its step is the time constant of the setpoint here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi
from typing import Any

from eomgen.products.robots.mjcf.draft import clip, times, total
from eomgen.products.robots.mjcf.transmissions import ActuatorParts
from eomgen.products.robots.scene_draft import number

#: Bits of the inputs of an actuator, in the order of its controls.
SIGNALS = {"pos": 1, "vel": 2, "ff": 4, "voltage": 8}


class ControlledDrive(ActuatorParts):
    """An actuator with a controller; methods return terms of setpoints, errors and internal states, and add the
    states."""

    def control(self, word: str) -> str:
        return self.controls.get(word, "0.0")

    def state(self, word: str, rate: str = "") -> str:
        """Add an internal state with the formula of the rate, which may follow later, and return the name, which ends
        with ``word``. The start is the value in the keyframe."""
        model, draft = self.model, self.draft
        entry: dict[str, Any] = {"rate": rate, "description": f"{word} of the actuator {self.name}"}
        if draft.key >= 0:
            value = float(model.key_act[draft.key][int(model.actuator_actadr[self.index]) + self.states])
            entry |= {"initial": value} if value else {}
        if model.actuator_actearly[self.index] and not (self.is_of("dyn", "DCMOTOR") or self.states):
            note = f"not modelled: actearly of the actuator {self.name}, which acts one step of MuJoCo earlier [W0150]"
            draft.leave_out(self.place, note)
        self.states += 1
        return draft.add("states", "signal", f"{self.name}_{word}", entry)

    def set_rate(self, state: str, rate: str) -> None:
        """Give a state its rate."""
        self.draft.section("states")[state]["rate"] = rate

    def limit_rate(self, limit: float) -> None:
        """Replace the first control by a setpoint that follows at most at the rate ``limit``, 1/s; none if this is not
        positive. The setpoint is a state, whose time constant is MuJoCo's step."""
        if limit <= 0.0 or not self.controls:
            return
        word = next(iter(self.controls))
        goal, step = self.state("setpoint"), float(self.model.opt.timestep)
        control = self.controls[word]
        if self.path.period:
            control = f"({goal} + {nearest(f'({control} - {goal})', self.path.period)})"
        reach = number(limit * step)
        self.controls[word] = self.define("effective", f"max({goal} - {reach}, min({goal} + {reach}, {control}))")
        self.set_rate(goal, f"({self.controls[word]} - {goal}) / {number(step)}")

    def error(self) -> str:
        """Return the distance of the position from its setpoint."""
        error = f"({self.control('pos')} - {self.path.length})"
        return nearest(error, self.path.period) if self.path.period else error

    def integral(self, limit: float) -> str:
        """Add the integral of the error of position as a state, and return the name; the integral stops at +-``limit``,
        if this is positive."""
        state = self.state("integral")
        bound = number(limit)
        rate = self.define("error", self.error())
        if limit > 0.0:
            rate = f"(min({rate}, 0.0) if {state} >= {bound} else max({rate}, 0.0) if {state} <= -{bound} else {rate})"
        self.set_rate(state, rate)
        return state


def nearest(error: str, period: float) -> str:
    """Return the formula of the difference ``error`` of two angles, shifted by whole periods to less than half a
    period."""
    turns = f"{number(2.0 * pi / period)} * {error}"
    return f"({number(period / (2.0 * pi))} * atan2(sin({turns}), cos({turns})))"


def pid_force(drive: ControlledDrive) -> str:
    """Return the formula of the force of a PID controller, with setpoint and integral as states. Gains of position and
    velocity stand in the parameters of the bias."""
    dynamics, gains, biases = (drive.parameters(kind) for kind in ("dyn", "gain", "bias"))
    drive.limit_rate(dynamics[1])
    terms = [number(biases[0])] if biases[0] else []
    terms += [times(-biases[1], drive.error())] if biases[1] else []
    terms += [times(-biases[2], f"({drive.control('vel')} - {drive.path.rate})")] if biases[2] else []
    terms += [drive.controls["ff"]] if "ff" in drive.controls else []
    if gains[0] > 0.0:
        terms.append(times(gains[0], drive.integral(dynamics[0])))
    return total(terms)


def motor_force(drive: ControlledDrive, limited: Callable[[str], str]) -> str:
    """Return the formula of the force of a DC motor: the electric one, to which ``limited`` applies limits, cogging and
    the friction of bristles. Current, temperature and bristles are added as states if the motor has them."""
    dynamics, gains, biases = (drive.parameters(kind) for kind in ("dyn", "gain", "bias"))
    winding = max(dynamics[0], 0.0)
    resistance, constant = gains[0], gains[1]
    drive.limit_rate(dynamics[7])
    integral = drive.integral(dynamics[8]) if gains[5] > 0.0 else ""
    voltage = drive.define("voltage", _voltage(drive, gains, integral))
    temperature = drive.state("temperature") if dynamics[2] > 0.0 else ""
    friction = _friction(drive, dynamics, biases)
    heated = number(resistance)
    if temperature:
        rise = f"({temperature} + {number(dynamics[4] - gains[3])})"
        heated = drive.define("resistance", f"{heated} * (1.0 + {number(gains[2])} * {rise})")
    back = times(constant, drive.path.rate)
    if winding:
        current = drive.state("current")
        rate = f"((({voltage} - {back}) / {heated} - {current}) / {number(winding)})"
        drive.set_rate(current, clip(rate, -dynamics[1], dynamics[1]) if dynamics[1] > 0.0 else rate)
    else:
        current = drive.define("current", f"({voltage} - {back}) / {heated}")
    if temperature:
        cooling = f"{temperature} / {number(dynamics[2])}"
        drive.set_rate(temperature, f"({heated} * {current}**2 - {cooling}) / {number(dynamics[3])}")
    terms = [limited(times(constant, current))]
    if biases[0]:
        terms.append(f"{number(biases[0])} * sin({number(biases[1])} * {drive.path.length} + {number(biases[2])})")
    return total([*terms, *friction])


def _friction(drive: ControlledDrive, dynamics: Sequence[float], biases: Sequence[float]) -> list[str]:
    """Add the deflection of the bristles of LuGre's friction as a state, and return the formula of their force in a
    list; an empty list without stiffness. ``dynamics`` and ``biases`` are parameters of MuJoCo."""
    stiffness, damping = dynamics[5], dynamics[6]
    if stiffness <= 0.0:
        return []
    deflection = drive.state("bristle")
    pace = drive.define("pace", drive.path.rate)
    kinetic, static, stribeck = biases[3:6]
    level = number(kinetic)  # without a velocity of Stribeck the level at rest holds at rest alone
    if stribeck > 0.0:
        level = f"({level} + {number(static - kinetic)} * exp(-({pace} / {number(stribeck)})**2))"
    rate = drive.define("bristle_rate", f"{pace} - {number(stiffness)} * abs({pace}) / {level} * {deflection}")
    drive.set_rate(deflection, rate)
    return [f"(-({times(stiffness, deflection)} + {times(damping, rate)}))"]


def _voltage(drive: ControlledDrive, gains: Sequence[float], integral: str) -> str:
    """Return the formula of the voltage at the terminals: of the controller, limited by the supply, plus the control of
    voltage. ``gains`` are MuJoCo's parameters, ``integral`` the name of the integral's state or empty."""
    terms = []
    if any(word in drive.controls for word in ("pos", "vel", "ff")):
        torques = [times(gains[4], f"({drive.control('pos')} - {drive.path.length})")] if gains[4] else []
        torques += [times(gains[6], f"({drive.control('vel')} - {drive.path.rate})")] if gains[6] else []
        torques += [times(gains[5], integral)] if integral else []
        torques += [drive.controls["ff"]] if "ff" in drive.controls else []
        voltage = f"({number(gains[0] / gains[1])} * {total(torques)} + {times(gains[1], drive.path.rate)})"
        terms.append(clip(voltage, -gains[7], gains[7]) if gains[7] > 0.0 else voltage)
    if "voltage" in drive.controls:
        terms.append(drive.controls["voltage"])
    return total(terms)
