"""Skyhook and groundhook control of a spring as formulas: ideal, or clipped to the range of a damper.

``tests.oracles.semi_active`` has the same laws, with their sources.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Mapping

from eomgen.base.text import key_of, nearest, shown
from eomgen.formula.nodes import Formula, Number, Operation, Symbol
from eomgen.scene.control.schema import Controller as Written
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import UNKNOWN, Values

_LIMITS = ("minimum_damping", "maximum_damping", "width")


def read_skyhook(name: str, entry: Written, values: Values, ends: Mapping[str, tuple[str, str]]) -> Formula:
    """Return the tension that a skyhook controller asks for; ``ends`` are the points of every spring."""
    key, report = key_of("controllers", name), values.report
    if entry.spring is None:
        report.add(key, "a skyhook controller needs spring", 'spring = "suspension"')
        return UNKNOWN
    if entry.spring not in ends:
        hint = nearest(entry.spring, ends) or "a [springs] section"
        report.add(f"{key}.spring", f"there is no spring {shown(entry.spring)}", hint)
        return UNKNOWN
    if entry.damping is None and entry.groundhook is None:
        report.add(key, "a skyhook controller needs damping or groundhook", "damping = 2000")
        return UNKNOWN
    given = {
        field: getattr(entry, field)
        for field in ("damping", "groundhook", *_LIMITS)
        if getattr(entry, field) is not None
    }
    numbers = {field: values.formula(f"{key}.{field}", value, PARAMETERS) for field, value in given.items()}
    if not entry.clipped:
        for field in _LIMITS:
            if field in given:
                report.add(
                    f"{key}.{field}", f"{field} has no meaning for a skyhook that is not clipped", "clipped = true"
                )
    elif "maximum_damping" not in given:
        report.add(
            key, "a clipped skyhook needs maximum_damping: no damper is infinitely hard", "maximum_damping = 4000"
        )
        return UNKNOWN
    first, second = ends[entry.spring]
    wanted: list[Formula] = []
    if "damping" in numbers:
        wanted.append(numbers["damping"] * _along(entry.spring, first, second, second))
    if "groundhook" in numbers:
        wanted.append(-(numbers["groundhook"] * _along(entry.spring, first, second, first)))
    tension = functools.reduce(operator.add, wanted)
    if not entry.clipped:
        return tension
    least, most = numbers.get("minimum_damping", Number(0.0)), numbers["maximum_damping"]
    field = "minimum_damping" if "minimum_damping" in given else "maximum_damping"
    values.require(f"{key}.{field}", RELATIONS["limits of a damper"], [least, most])
    rate = Symbol("rate", entry.spring)
    if "width" not in numbers:
        return _clipped(tension, rate, least, most)
    return _rounded(tension, rate, least, most, numbers["width"])


def _along(spring: str, first: str, second: str, point: str) -> Formula:
    """Return the velocity of a point along a spring, from its first to its second point positive."""
    reach = [Symbol("position", second, axis) - Symbol("position", first, axis) for axis in range(3)]
    parts = [Symbol("velocity", point, axis) * part for axis, part in enumerate(reach)]
    return functools.reduce(operator.add, parts) / Symbol("length", spring)


def _clipped(wanted: Formula, rate: Formula, least: Formula, most: Formula) -> Formula:
    """Return the wanted tension, limited to the range between the softest and the hardest damper."""
    soft, hard = least * rate, most * rate
    high = Operation("max", (soft, hard))
    return Operation("max", (Operation("min", (soft, hard)), Operation("min", (high, wanted))))


def _rounded(wanted: Formula, rate: Formula, least: Formula, most: Formula, width: Formula) -> Formula:
    """Return the same with round corners, see ``tests.oracles.semi_active.rounded``."""
    half, mean = 0.5 * (most - least), 0.5 * (least + most)
    beside = wanted - mean * rate
    floor = mean * width * (mean * width)
    first, second = (_root(side * side + floor) for side in (beside + half * rate, beside - half * rate))
    share = 2.0 * beside / (first + second) * (rate / _root(rate * rate + width * width))
    return rate * (mean + half * share)


def _root(x: Formula) -> Formula:
    return Operation("sqrt", (x,))
