"""A scene with tunable factors: units of length, mass and time, stiffness, damping, gravity, one body's inertia, the
place of the origin.

Every number of a key with a unit is multiplied by the factor of its unit. Formulas are evaluated in the scene's own
units: quantities of the motion in a formula are divided by the factor of the quantity's unit, and the value is
multiplied by the factor of the key. So the same motion in other units follows for any formulas.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from functools import reduce
from itertools import chain
from operator import getitem
from typing import Any, cast

from eomgen.base.data import dataclass
from eomgen.formula.units.parser import read_unit
from eomgen.formula.units.table import measure
from eomgen.scene.document.quantities import SceneQuantity, quantities
from eomgen.scene.document.schema import SceneDocument
from eomgen.scene.document.units import in_si
from eomgen.scene.formula.parser import with_other_quantities
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.report import Report

Data = Mapping[str, Any]

#: Factors: the parameter of each, 1 or 0 for the unchanged scene.
LENGTH, MASS, TIME = "unit_length", "unit_mass", "unit_time"
STIFFNESS, DAMPING, GRAVITY = "factor_of_stiffness", "factor_of_damping", "factor_of_gravity"
RATIO, RATIO_LAST, ORIGIN = "factor_of_first_inertia", "factor_of_last_inertia", "place_of_origin"
UNITS = {"[length]": LENGTH, "[mass]": MASS, "[time]": TIME}
NEUTRAL: Mapping[str, float] = {
    **dict.fromkeys((LENGTH, MASS, TIME, STIFFNESS, DAMPING, GRAVITY, RATIO, RATIO_LAST), 1.0),
    ORIGIN: 0.0,
}
_UNCHANGED = frozenset(["parameters", "initial", "simulation", "curves"])
_KEYS = {"stiffness": STIFFNESS, "damping": DAMPING}
_RATES = {"q": "", "v": "/s", "a": "/s^2"}
_SIDES = ("first", "second")
_OF_POINTS = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}


@dataclass(frozen=True)
class SceneUnits:
    """The sizes of new units of length, mass and time, relative to m, kg and s."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def size(self, unit: str) -> float:
        """Return the factor of a number with a unit string."""
        result = 1.0
        for name, power in _powers(unit).items():
            result *= {LENGTH: self.length, MASS: self.mass, TIME: self.time}[UNITS[name]] ** power
        return result

    @property
    def parameters(self) -> dict[str, float]:
        return {LENGTH: self.length, MASS: self.mass, TIME: self.time}


def with_factors(data: Data, wanted: Sequence[str]) -> dict[str, Any]:
    """Return nested data of a scene in which numbers with units have tunable factors, all neutral (1, or 0 for the
    origin).

    Parameters
    ----------
    data : mapping
        As ``tomllib`` reads a scene file.
    wanted : names of factors, which become tunable parameters
    """
    plain, *_ = in_si(data, Report("scene", {}))
    plain.setdefault("gravity", list(SceneDocument.model_fields["gravity"].default))
    scaled, factors_of = copy.deepcopy(plain), _Factors(plain, frozenset(wanted))
    for quantity in quantities(plain, _UNCHANGED):
        *owner, last = quantity.path
        table = reduce(getitem, owner, cast(Any, scaled))
        table[last] = factors_of.scale(quantity)
    if ORIGIN in wanted:
        _move_origin(scaled)
    if RATIO in wanted:
        _weigh(scaled, RATIO, last=False)
    if RATIO_LAST in wanted:
        _weigh(scaled, RATIO_LAST, last=True)
    factors = {name: {"value": NEUTRAL[name], "tunable": True} for name in wanted}
    return scaled | {"parameters": {**plain.get("parameters", {}), **factors}}


def used_factors(scene: Data, wanted: Sequence[str]) -> frozenset[str]:
    """Return the factors in the numbers of a scene ``with_factors``: absent and zero numbers have none."""
    text = repr({key: value for key, value in scene.items() if key != "parameters"})
    return frozenset(name for name in wanted if name in text)


class _Factors:
    """Formulas for the quantities of one scene, multiplied by the wanted factors of their units."""

    def __init__(self, data: Data, wanted: frozenset[str]) -> None:
        self.wanted = wanted
        self.kinds = {str(name): joint.get("type", "fixed") for name, joint in data.get("joints", {}).items()}
        self.named = {
            str(name): str(entry.get("unit", ""))
            for section in ("inputs", "states")
            for name, entry in data.get(section, {}).items()
            if isinstance(entry, Mapping)
        }

    def scale(self, quantity: SceneQuantity) -> Any:
        """Return the value of a quantity as a formula with factors; unchanged if zero, infinite, or without a factor.
        Quantities of the motion within a formula are divided by the factors of their units first."""
        value = quantity.value
        if isinstance(value, str):
            value = with_other_quantities(value, self.in_own_units)
        elif isinstance(value, bool) or not isinstance(value, int | float) or not value or math.isinf(value):
            return value
        key_factor = _KEYS.get(quantity.field, "") if quantity.owner else GRAVITY if quantity.field == "gravity" else ""
        factors = [
            factor for factor in (self.factor(quantity.unit), key_factor if key_factor in self.wanted else "") if factor
        ]
        return f"({' * '.join(factors)}) * ({value})" if factors else value

    def in_own_units(self, text: str, word: str, name: str, index: int) -> str:
        """Return the text of a quantity in a formula, divided by the factor of its unit. `word` is its kind, such as
        ``q`` or ``position`` (empty for a bare name), `name` and `index` are the parts of `text`."""
        if word in _OF_POINTS:
            unit = _OF_POINTS[word]
        elif word in _RATES:
            row = JOINTS.get(self.kinds.get(name, ""))
            units = row.units if row is not None else ("m",)
            unit = (units[index] if index < len(units) else "rad") + _RATES[word]
        else:
            unit = "" if word else "s" if name == "t" else self.named.get(name, "")
        factor = self.factor(unit)
        return f"({text} / ({factor}))" if factor else text

    def factor(self, unit: str) -> str:
        """Return the formula by which a number with a unit is multiplied; empty for plain numbers and angles."""
        powers = [(UNITS[name], power) for name, power in _powers(unit).items() if UNITS[name] in self.wanted]
        parts = [f"{name}**({power})" if power != 1 else name for name, power in powers if power]
        return " * ".join(parts)


def _powers(unit: str) -> dict[str, float]:

    result = measure(read_unit(unit))[1] if unit not in ("", "1", "rad") else {}
    return {name: power for name, power in result.items() if name in UNITS}


def _move_origin(scene: dict[str, Any]) -> None:
    """Move everything fixed to the base or the world along x by the parameter of the origin, in place."""
    outside = ("base", "world")
    joints = [joint for joint in scene.get("joints", {}).values() if joint.get("parent") == "base"]
    points = chain(scene.get("points", {}).values(), scene.get("frames", {}).values())
    sides = (constraint.get(side) for constraint in scene.get("constraints", {}).values() for side in _SIDES)
    ends = (frame for frame in sides if isinstance(frame, dict))
    for placed in (*joints, *(frame for frame in chain(points, ends) if frame.get("body") in outside)):
        first, *others = placed.get("position", [0.0, 0.0, 0.0])
        placed["position"] = [f"{ORIGIN} + ({first})", *others]


def _weigh(scene: dict[str, Any], factor: str, *, last: bool) -> None:
    """Multiply mass and inertia of the first, or the last, body with a mass by a factor, in place. No change without
    such a body, or for the last if there is only one."""
    bodies = [(name, body) for name, body in scene.get("bodies", {}).items() if body.get("mass") not in (None, 0, 0.0)]
    if not bodies or (last and len(bodies) < 2):
        return
    name, body = bodies[-1 if last else 0]
    heavier = copy.copy(body)
    heavier["mass"] = f"{factor} * ({body['mass']})"
    if "inertia" in body:
        heavier["inertia"] = [f"{factor} * ({entry})" for entry in body["inertia"]]
    scene["bodies"] = {**scene["bodies"], name: heavier}
