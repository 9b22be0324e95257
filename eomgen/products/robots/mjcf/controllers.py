"""Controllers and motors within actuators of MJCF as formulas: setpoints that follow at a limited rate, integrators,
PID, DC motors with winding, heat and friction.

Formulas: MuJoCo's documentation, "XML reference: actuator/pid" and "actuator/dcmotor", and its technical note on DC
motors. A rate limit acts over one step of MuJoCo, so its step is the time constant of the setpoint here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi

from eomgen.base.data import dataclass
from eomgen.products.robots.mjcf.draft import clipped, times, total
from eomgen.products.robots.scene_draft import number

#: Bits of the inputs of an actuator, in the order of its controls.
SIGNALS = {"pos": 1, "vel": 2, "ff": 4, "voltage": 8}


@dataclass
class Plant:
    """The actuator around a controller.

    Attributes
    ----------
    controls : terms by the words of ``SIGNALS``
    length, rate : terms of the transmission
    period : of rotations, rad; 0 of other lengths
    step : of MuJoCo, s
    define, state : add a definition, or a state, and return the name
    set_rate : gives a state its rate
    """

    controls: dict[str, str]
    length: str
    rate: str
    period: float
    step: float
    define: Callable[[str, str], str]
    state: Callable[[str], str]
    set_rate: Callable[[str, str], None]

    def control(self, word: str) -> str:
        return self.controls.get(word, "0.0")

    def limit_rate(self, limit: float) -> None:
        """Let the first control follow at a limited rate, if the limit is positive."""
        if limit <= 0.0 or not self.controls:
            return
        word = next(iter(self.controls))
        own = self.state("setpoint")
        control = self.controls[word]
        if self.period:
            control = f"({own} + {nearest(f'({control} - {own})', self.period)})"
        reach = number(limit * self.step)
        self.controls[word] = self.define("effective", f"max({own} - {reach}, min({own} + {reach}, {control}))")
        self.set_rate(own, f"({self.controls[word]} - {own}) / {number(self.step)}")

    def integral(self, limit: float) -> str:
        """Add the integral of the error of position, which stops at a positive limit."""
        error = f"({self.control('pos')} - {self.length})"
        if self.period:
            error = nearest(error, self.period)
        own = self.state("integral")
        bound = number(limit)
        rate = self.define("error", error)
        if limit > 0.0:
            rate = f"(min({rate}, 0.0) if {own} >= {bound} else max({rate}, 0.0) if {own} <= -{bound} else {rate})"
        self.set_rate(own, rate)
        return own


def nearest(error: str, period: float) -> str:
    """Return the difference of two angles by less than half a period."""
    turns = f"{number(2.0 * pi / period)} * {error}"
    return f"({number(period / (2.0 * pi))} * atan2(sin({turns}), cos({turns})))"


def pid_force(plant: Plant, dynamics: Sequence[float], gains: Sequence[float], biases: Sequence[float]) -> str:
    """Return the force of a PID controller; gains of position and velocity stand in ``biases``."""
    plant.limit_rate(dynamics[1])
    error = f"({plant.control('pos')} - {plant.length})"
    terms = [number(biases[0])] if biases[0] else []
    terms += [times(-biases[1], nearest(error, plant.period) if plant.period else error)] if biases[1] else []
    terms += [times(-biases[2], f"({plant.control('vel')} - {plant.rate})")] if biases[2] else []
    terms += [plant.controls["ff"]] if "ff" in plant.controls else []
    if gains[0] > 0.0:
        terms.append(times(gains[0], plant.integral(dynamics[0])))
    return total(terms)


def motor_force(
    plant: Plant,
    dynamics: Sequence[float],
    gains: Sequence[float],
    biases: Sequence[float],
    limited: Callable[[str], str],
) -> str:
    """Return the force of a DC motor: the electric one within its limits, cogging and the friction of bristles."""
    winding = max(dynamics[0], 0.0)
    resistance, constant = gains[0], gains[1]
    plant.limit_rate(dynamics[7])
    integral = plant.integral(dynamics[8]) if gains[5] > 0.0 else ""
    voltage = plant.define("voltage", _voltage(plant, gains, integral))
    temperature = plant.state("temperature") if dynamics[2] > 0.0 else ""
    friction = _friction(plant, dynamics, biases)
    heated = number(resistance)
    if temperature:
        rise = f"({temperature} + {number(dynamics[4] - gains[3])})"
        heated = plant.define("resistance", f"{heated} * (1.0 + {number(gains[2])} * {rise})")
    back = times(constant, plant.rate)
    if winding:
        current = plant.state("current")
        rate = f"((({voltage} - {back}) / {heated} - {current}) / {number(winding)})"
        plant.set_rate(current, clipped(rate, -dynamics[1], dynamics[1]) if dynamics[1] > 0.0 else rate)
    else:
        current = plant.define("current", f"({voltage} - {back}) / {heated}")
    if temperature:
        cooling = f"{temperature} / {number(dynamics[2])}"
        plant.set_rate(temperature, f"({heated} * {current}**2 - {cooling}) / {number(dynamics[3])}")
    terms = [limited(times(constant, current))]
    if biases[0]:
        terms.append(f"{number(biases[0])} * sin({number(biases[1])} * {plant.length} + {number(biases[2])})")
    return total([*terms, *friction])


def _friction(plant: Plant, dynamics: Sequence[float], biases: Sequence[float]) -> list[str]:
    """Add the deflection of the bristles of LuGre's friction, and return their force; none without stiffness."""
    stiffness, damping = dynamics[5], dynamics[6]
    if stiffness <= 0.0:
        return []
    deflection = plant.state("bristle")
    pace = plant.define("pace", plant.rate)
    kinetic, static, stribeck = biases[3:6]
    level = number(kinetic)  # without a velocity of Stribeck the level at rest holds at rest alone
    if stribeck > 0.0:
        level = f"({level} + {number(static - kinetic)} * exp(-({pace} / {number(stribeck)})**2))"
    rate = plant.define("bristle_rate", f"{pace} - {number(stiffness)} * abs({pace}) / {level} * {deflection}")
    plant.set_rate(deflection, rate)
    return [f"(-({times(stiffness, deflection)} + {times(damping, rate)}))"]


def _voltage(plant: Plant, gains: Sequence[float], integral: str) -> str:
    """Return the voltage at the terminals: of the controller, within its supply, and from outside."""
    terms = []
    if any(word in plant.controls for word in ("pos", "vel", "ff")):
        torques = [times(gains[4], f"({plant.control('pos')} - {plant.length})")] if gains[4] else []
        torques += [times(gains[6], f"({plant.control('vel')} - {plant.rate})")] if gains[6] else []
        torques += [times(gains[5], integral)] if integral else []
        torques += [plant.controls["ff"]] if "ff" in plant.controls else []
        own = f"({number(gains[0] / gains[1])} * {total(torques)} + {times(gains[1], plant.rate)})"
        terms.append(clipped(own, -gains[7], gains[7]) if gains[7] > 0.0 else own)
    if "voltage" in plant.controls:
        terms.append(plant.controls["voltage"])
    return total(terms)
