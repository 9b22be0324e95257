"""Muscles of MJCF: activation, and force over length and rate, as formulas.

Curves: MuJoCo's documentation, "Modeling: Muscle actuators"; rates of activation: Millard, Uchida, Seth and Delp, J.
Biomech. Eng. 135 (2013) 021005.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.base.data import dataclass
from eomgen.products.robots.scene_draft import number


def activation_rate(control: str, activation: str, parameters: Sequence[float]) -> str:
    """Return the formula of the rate of the activation of a muscle, 1/s.

    Parameters
    ----------
    control, activation : str
        Names, or parts of formulas in brackets.
    parameters : sequence of float
        Times of activation and deactivation, s, above 0, and the width of the excitation over which one changes to the
        other.
    """
    rise, fall, width = (float(value) for value in parameters[:3])
    excess = f"(max(0.0, min(1.0, {control})) - {activation})"
    pace = f"(0.5 + 1.5 * max(0.0, min(1.0, {activation})))"
    fast, slow = f"{number(rise)} * {pace}", f"{number(fall)} / {pace}"
    if width <= 0.0:
        return f"({excess} / ({fast} if {excess} > 0.0 else {slow}))"
    x = f"max(0.0, min(1.0, {excess} / {number(width)} + 0.5))"
    share = f"({x})**3 * (3.0 * ({x}) * (2.0 * ({x}) - 5.0) + 10.0)"
    return f"({excess} / ({slow} + ({fast} - {slow}) * ({share})))"


@dataclass(frozen=True)
class Muscle:
    """A muscle with a range of lengths, m, and the acceleration that a unit force gives, 1/kg.

    Attributes
    ----------
    parameters : of MuJoCo: range of lengths (2), force, scale, lmin, lmax, vmax, fpmax, fvmax
    """

    parameters: Sequence[float]
    range_of_length: tuple[float, float]
    acceleration: float

    @property
    def _strength(self) -> float:
        force, scale = self.parameters[2], self.parameters[3]
        return scale / self.acceleration if force < 0.0 else force

    @property
    def _optimum(self) -> float:
        low, high = self.parameters[:2]
        return (self.range_of_length[1] - self.range_of_length[0]) / (high - low)

    def length(self, length: str) -> str:
        """Return the length by the optimum length."""
        start = self.range_of_length[0]
        return f"({number(self.parameters[0])} + ({length} - {number(start)}) / {number(self._optimum)})"

    def rate(self, rate: str) -> str:
        """Return the rate of length by the largest rate of shortening."""
        return f"({rate} / {number(self._optimum * self.parameters[6])})"

    def gain(self, length: str, rate: str) -> str:
        """Return the formula of force per activation (negative: a pull), over normalized length and rate, which are
        names."""
        return f"{number(-self._strength)} * {self._force_length(length)} * {self._force_velocity(rate)}"

    def passive(self, length: str) -> str:
        """Return the formula of the passive force (negative: a pull) over the normalized length ``length``, which is a
        name."""
        middle, largest = 0.5 * (1.0 + self.parameters[5]), self.parameters[7]
        span = number(middle - 1.0)
        parabola = f"0.5 * (({length} - 1.0) / {span})**2"
        line = f"0.5 + ({length} - {number(middle)}) / {span}"
        share = f"(0.0 if {length} <= 1.0 else {parabola} if {length} <= {number(middle)} else {line})"
        return f"{number(-self._strength * largest)} * {share}"

    def _force_length(self, length: str) -> str:
        low, high = self.parameters[4], self.parameters[5]
        before, behind = 0.5 * (low + 1.0), 0.5 * (1.0 + high)
        pieces = (
            (before, low, before - low, False),
            (1.0, 1.0, 1.0 - before, True),
            (behind, 1.0, behind - 1.0, True),
            (high, high, high - behind, False),
        )
        text = f"(0.0 if {length} < {number(low)}"
        for end, origin, width, top in pieces:
            parabola = f"0.5 * (({length} - {number(origin)}) / {number(width)})**2"
            text += f" else {'1.0 - ' if top else ''}{parabola} if {length} <= {number(end)}"
        return f"{text} else 0.0)"

    def _force_velocity(self, rate: str) -> str:
        largest = self.parameters[8]
        end = largest - 1.0
        text = f"(0.0 if {rate} <= -1.0 else ({rate} + 1.0)**2 if {rate} <= 0.0"
        if end > 0.0:
            parabola = f"{number(largest)} - ({number(end)} - {rate})**2 / {number(end)}"
            text += f" else {parabola} if {rate} <= {number(end)}"
        return f"{text} else {number(largest)})"
