"""Requirements of scene values, one table for the validation of a scene and of parameters at every call.

A row is a rule for one value (``BOUNDS``, by key) or a relation between several (``RELATIONS``). Readers apply it to
formulas: at the default parameters at once and, if a formula has tunable parameters, by a ``Requirement`` that the
scene keeps. Files of scenes and models store the functions of a row by name, so none of them is nested in another
function or a lambda: a function with data is an instance of a dataclass.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from eomgen.base.arrays import Flags, Numbers
from eomgen.base.data import dataclass
from eomgen.base.random_inputs import FASTEST
from eomgen.scene.inertia import NO_INERTIA, impossible, not_physical, not_positive, tensor


@dataclass(frozen=True)
class Row:
    """A row of the table.

    Attributes
    ----------
    keys : of the values: without names of entries and places in lists, ``joints.limits.lower``
    breaks : returns whether values, numbers or arrays, break the rule; of a module
    words : the fault, with ``{0}``, ``{1}`` ... for the values, or a function of the values
    hint : the remedy
    stage : 0 for a rule for a single value, 1 for a relation
    """

    keys: tuple[str, ...]
    breaks: Callable[..., Flags]
    words: str | Callable[..., str]
    hint: str
    stage: int = 1

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        return self.breaks(*numbers)

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        if not isinstance(self.words, str):
            return self.words(*numbers), self.hint
        return self.words.format(*(f"{number:.6g}" for number in numbers)), self.hint


def _not_positive(number: Numbers) -> Flags:
    return number <= 0.0


def _negative(number: Numbers) -> Flags:
    return number < 0.0


def is_zero(number: Numbers) -> Flags:
    """Return whether numbers are zero."""
    return number == 0.0


def _not_below_one(number: Numbers) -> Flags:
    return np.greater_equal(number, 1.0)


def _no_speed(number: Numbers) -> Flags:
    return np.logical_or(np.less_equal(number, 0.0), np.greater(number, FASTEST))


def _not_both_positive(first: Numbers, second: Numbers) -> Flags:
    return np.logical_or(np.less_equal(first, 0.0), np.less_equal(second, 0.0))


#: Rule for one value: test for values that break the rule, fault and remedy.
Bound = tuple[Callable[[Numbers], Flags], str | Callable[..., str], str]


def above_zero(quantity: str) -> Bound:
    """Return the rule of a quantity that has to be positive.

    Parameters
    ----------
    quantity : str
        Name of the quantity, for messages.

    Returns
    -------
    Bound
        For the ``bounds`` of a section.
    """
    return _not_positive, f"{quantity} is {{0}}", "a number above 0"


def not_below_zero(quantity: str) -> Bound:
    """Return the rule of a quantity that may be zero, and not negative.

    Parameters
    ----------
    quantity : str
        Name of the quantity, for messages.

    Returns
    -------
    Bound
        For the ``bounds`` of a section.
    """
    return _negative, f"{quantity} is {{0}}", "0 or more"


@dataclass(frozen=True)
class Outside:
    """Test for numbers outside a closed interval."""

    lower: float
    upper: float

    def __call__(self, number: Numbers) -> Flags:
        """Return whether numbers lie outside."""
        return np.logical_or(np.less(number, self.lower), np.greater(number, self.upper))


_PITCH: Bound = is_zero, "a screw with a pitch of {0} does not travel [E1771]", 'a pitch in m/rad, or type = "revolute"'
_LENGTH: Bound = _not_positive, "{0} m is not positive [E1772]", "a length in m"
STIFFNESS: Bound = _negative, "the stiffness is negative: {0} [E1773]", "0 or more"
DAMPING: Bound = _negative, "the damping is negative: {0} [E1774]", "0 or more"
_DEFORMATIONS = ("bending_y", "bending_z", "stretch", "torsion")
_STRAINS = (*_DEFORMATIONS, "shear_y", "shear_z")

_OF_SECTIONS: Mapping[str, Bound] = {
    "section.elastic_modulus": above_zero("the elastic modulus [E1744]"),
    "section.density": above_zero("the density [E1745]"),
    "section.area": above_zero("the area of a section [E1746]"),
    **{f"section.{size}": above_zero(f"the {size} of a section [E1746]") for size in ("width", "height", "diameter")},
    "section.thickness": above_zero("the thickness of a wall [E1747]"),
    "section.poisson_ratio": (
        Outside(0.0, 0.5),
        "Poisson's ratio is {0} [E1775]",
        "0 to 0.5, or shear_modulus",
    ),
    "section.second_moments": above_zero("a second moment of area [E1748]"),
    "section.shear_modulus": above_zero("the shear modulus [E1749]"),
    "section.torsion_constant": above_zero("the torsion constant [E1750]"),
    "mass_per_length": above_zero("the mass per length [E1751]"),
    "section.shear_factors": above_zero("the shear factor of a section [E1746]"),
    "rotary_inertia": above_zero("the rotary inertia of a section [E1746]"),
    "stiffness_damping": not_below_zero("the damping of a beam [E1765]"),
    **{
        f"stiffness.{kind}": above_zero(f"the stiffness of {kind.replace('_', ' along ')} [E1752]") for kind in _STRAINS
    },
    **{f"damping.{kind}": not_below_zero("the damping of a beam [E1765]") for kind in _STRAINS},
}

_UNBOUNDED_OF_SECTIONS = (
    "stiffness_matrix", "inertia_matrix", "center_of_mass", *(f"prestrain.{kind}" for kind in _STRAINS),
)  # fmt: skip  # a table
_BOUNDS: Mapping[str, Bound] = {
    "bodies.mass": (_negative, "the mass {0} is negative [E1709]", "a positive number of kg"),
    "joints.pitch": _PITCH,
    "joints.rotor_inertia": (_negative, "the rotor inertia {0} is negative [E1776]", "0 or more"),
    "joints.limits.stiffness": above_zero("the stiffness of a stop [E1752]"),
    "joints.limits.damping": not_below_zero("the damping of a stop [E1766]"),
    "joints.limits.onset": above_zero("the onset of a stop [E1753]"),
    "joints.friction.coulomb": not_below_zero("the Coulomb friction [E1767]"),
    "joints.friction.velocity": above_zero("the regularisation velocity [E1754]"),
    "joints.friction.static": not_below_zero("the static friction [E1768]"),
    "joints.friction.stribeck": above_zero("the Stribeck velocity [E1755]"),
    "constraints.length": _LENGTH,
    "constraints.radius": _LENGTH,
    "constraints.semi_axes": _LENGTH,
    "constraints.tube_radius": _LENGTH,
    "constraints.pitch": _PITCH,
    **{f"beams.{key}": bound for key, bound in _OF_SECTIONS.items()},
    **{f"beams.parts.{key}": bound for key, bound in _OF_SECTIONS.items()},
    "beams.polar_inertia": not_below_zero("the polar inertia [E1769]"),
    **{f"beams.{kind}.stiffness": above_zero(f"the stiffness of {kind} [E1752]") for kind in _DEFORMATIONS},
    **{f"beams.{kind}.stiffness_damping": not_below_zero("the damping of a beam [E1765]") for kind in _DEFORMATIONS},
    **{f"beams.{kind}.inertia_factor": above_zero("the inertia factor [E1756]") for kind in _DEFORMATIONS},
    "inputs.road.speed": (
        _no_speed,
        f"the speed {{0}} m/s is not between 0 and {FASTEST:.0f} [E1024]",
        "a speed such as 20",
    ),
    "controllers.time_constant": (_not_positive, "the time constant {0} s is not positive [E1777]", "0.01"),
    "controllers.tracking": (_not_positive, "the tracking time {0} s is not positive [E1778]", "0.1"),
    "controllers.damping": (_negative, "damping is negative ({0}) [E1779]", "0 or more"),
    "controllers.groundhook": (_negative, "groundhook is negative ({0}) [E1780]", "0 or more"),
    "controllers.minimum_damping": (_negative, "minimum_damping is negative ({0}) [E1781]", "0 or more"),
    "controllers.maximum_damping": (_negative, "maximum_damping is negative ({0}) [E1782]", "0 or more"),
    "controllers.width": (_not_positive, "the width {0} m/s is not positive [E1783]", "0.01, or no width"),
}


def bounds(by_key: Mapping[str, Bound]) -> dict[str, Row]:
    """Return rules for single values as rows of the table."""
    return {key: Row((key,), *bound, stage=0) for key, bound in by_key.items()}


#: Rules for single values of formulas of parameters, by key; rules of force elements are in their sections.
BOUNDS: Mapping[str, Row] = bounds(_BOUNDS)


#: Keys whose single values may be any number: places, rests, preloads, gains, springs and dampers that may push back.
UNBOUNDED = frozenset((
    "gravity", "bodies.center_of_mass", "bodies.inertia", "points.position", "frames.position", "joints.position",
    "joints.stiffness", "joints.damping", "joints.rest", "joints.limits.lower", "joints.limits.upper",
    "joints.mimic.multiplier", "joints.mimic.offset", "constraints.first.position", "constraints.second.position",
    "controllers.proportional", "controllers.integral", "controllers.derivative", "controllers.gain",
    "controllers.lead", "controllers.minimum", "controllers.maximum",
    *(f"beams.{part}{key}" for part in ("", "parts.") for key in _UNBOUNDED_OF_SECTIONS),
))  # fmt: skip  # a table


def _limits(unit: str) -> Row:
    words = f"the lower limit {{0}} {unit} is not below the upper one, {{1}} {unit} [E1784]"
    return Row(("joints.limits.lower", "joints.limits.upper"), operator.ge, words, "lower below upper")


def _not_of_a_body(*entries: Numbers) -> Flags:
    return not_physical(entries, 0.05, rotors=True)


def _impossible_inertia(*entries: float) -> str:
    return impossible(0.0, tensor(entries))


def _not_of_a_section(*moments: Numbers) -> Flags:
    return not_physical([*moments, 0.0, 0.0, 0.0])


def _thicker_than_the_radius(thickness: Numbers, diameter: Numbers) -> Flags:
    return np.greater(np.multiply(2.0, thickness), diameter)


def _thin(*moments: Numbers) -> Flags:
    """Return whether one of several moments of inertia, all above 0, is negligible compared with the other moments."""
    least, largest = np.minimum.reduce(np.broadcast_arrays(*moments)), np.maximum.reduce(np.broadcast_arrays(*moments))
    return np.asarray((least > 0.0) & (least <= NO_INERTIA * largest))


#: Rules for several values. The rule that a joint moves some inertia belongs to each joint of a scene,
#: ``moved_inertia.Movable``.
RELATIONS: Mapping[str, Row] = {
    "inertia": Row(  # moments of measured and rounded inertias exceed the sum of the others by a few parts in a hundred
        ("bodies.inertia",),
        _not_of_a_body,
        _impossible_inertia,
        "the values of {0} about its centre of mass, in its own axes, or check_inertia = false if these are meant",
    ),
    "inertia without its check": Row(
        ("bodies.inertia",),
        not_positive,
        _impossible_inertia,
        "the values of {0} about its centre of mass, in its own axes",
    ),
    "limits in rad": _limits("rad"),
    "limits in m": _limits("m"),
    "static friction": Row(
        ("joints.friction.static", "joints.friction.coulomb"),
        operator.lt,
        "the static friction {0} is below the Coulomb friction {1} [E1787]",
        "static above coulomb",
    ),
    "Stribeck velocity": Row(
        ("joints.friction.stribeck", "joints.friction.velocity"),
        operator.le,
        "the Stribeck velocity {0} is not above the regularisation velocity {1} [E1788]",
        "velocity = stribeck / 10",
    ),
    "limits of an output": Row(
        ("controllers.minimum", "controllers.maximum"),
        operator.ge,
        "the range is empty: minimum {0} is not below maximum {1} [E1789]",
        "a smaller minimum",
    ),
    "limits of a damper": Row(
        ("controllers.minimum_damping", "controllers.maximum_damping"),
        operator.ge,
        "the range is empty: minimum_damping {0} is not below maximum_damping {1} [E1790]",
        "a smaller minimum_damping",
    ),
    "integral time": Row(
        ("controllers.proportional", "controllers.integral"),
        _not_both_positive,
        "limits need a tracking time if proportional/integral = {0}/{1} is none [E1791]",
        "tracking = 0.1",
    ),
    "wall of a tube": Row(
        ("beams.section.thickness", "beams.section.diameter"),
        _thicker_than_the_radius,
        "the wall of {0} m is thicker than half of the diameter {1} m [E1792]",
        "a thinner wall, or a circle",
    ),
    "rotary inertia": Row(
        ("beams.rotary_inertia",),
        _not_of_a_section,
        "no section has the rotary inertia {0} about x with {1} about y and {2} about z: one exceeds the sum of the"
        " others [E1793]",
        "[polar, about y, about z], of which the first is the sum of the others",
    ),
    "length at rest": Row(
        ("beams.prestrain.stretch",),
        _not_below_one,
        "a beam that is stretched by {0} of its length at the start has no length at rest [E1794]",
        "a number below 1: the length at rest is (1 - stretch) times the length of the initial shape",
    ),
    "thin section": Row(
        ("beams.rotary_inertia",),
        _thin,
        "sections with a rotary inertia of {0} kg m about x, {1} about y and {2} about z have none about some axis:"
        f" it is below {NO_INERTIA:g} of the largest [E1795]",
        "a section that is less thin",
    ),
    "inertia of torsion": Row(
        ("beams.polar_inertia",),
        _not_positive,
        "torsion needs the inertia of the sections about the axis, without which it has no inertia [E1796]",
        "polar_inertia, density times polar second moment of area",
    ),
}


def bound_of(key: str, table: Mapping[str, Row]) -> Row | None:
    """Return the rule of a value by key in a scene: ``joints.hinge.limits.stiffness[1]``; None without a rule."""
    plain = re.sub(r"\[\d+\]", "", key) if "[" in key else key
    section, _, rest = plain.partition(".")
    return table.get(f"{section}.{rest.partition('.')[2]}")
