"""Another distribution: the section ``drags`` of scenes, quadratic drag at a point, with its law in ``law``, and the
section ``winds`` with the word of formulas ``wind_speed.NAME(z)``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from eomgen.extending import (
    FIXED_PARAMETERS,
    PARAMETERS,
    SPRING_FORCE,
    Array,
    ElementSection,
    ForceElement,
    Formula,
    FormulaVector,
    Reading,
    Section,
    Site,
    Symbol,
    Table,
    Triple,
    Value,
    Word,
    above_zero,
    key,
    key_of,
    not_below_zero,
)


class DragEntry(Table):
    """A drag on a point, against its velocity relative to the wind."""

    point: str = key("on which it acts", refers="points")
    coefficient: Value = key("force per squared velocity", unit="kg/m", names=PARAMETERS)
    wind: Triple = key("velocity of the air, in world axes", (0.0, 0.0, 0.0), unit="m/s", names=SPRING_FORCE)


@dataclass(frozen=True)
class Drag(ForceElement):
    """Drag -c v |v| on a point, with v relative to the wind in world axes."""

    section: ClassVar[str] = "drags"
    law: ClassVar[str] = "tests.models.drags_for_eomgen.law:LAW"

    point: str
    coefficient: Formula
    wind: FormulaVector

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        yield from ((formula, 0) for formula in self.wind)

    def passive(self) -> None:
        return None


def read_drag(name: str, entry: DragEntry, site: Site) -> Drag:
    """Return a checked drag."""
    place, values = key_of("drags", name), site.values
    values.point(f"{place}.point", entry.point)
    coefficient = values.formula(f"{place}.coefficient", entry.coefficient, PARAMETERS)
    return Drag(name, entry.point, coefficient, values.vector(f"{place}.wind", entry.wind, SPRING_FORCE))


DRAGS = ElementSection(
    key="drags",
    entry=DragEntry,
    model=Drag,
    reader=read_drag,
    bounds={"coefficient": not_below_zero("the coefficient of a drag")},
    offers={"drag": "element"},
    positional=("point", "coefficient"),
)


class WindEntry(Table):
    """A wind over the ground, by a power law of the height, that grows from rest."""

    speed: Value = key("at a height of 10 m", unit="m/s", names=FIXED_PARAMETERS)
    exponent: Value = key("of the height", 0.2, names=FIXED_PARAMETERS)
    time: Value = key("in which it grows to 63 %", 1.0, unit="s", names=FIXED_PARAMETERS)


@dataclass(frozen=True)
class Wind:
    """A wind by a power law; speed in m/s at 10 m, time in s."""

    name: str
    speed: float
    exponent: float
    time: float

    def speed_at(self, word: str, component: int, z: Array, t: Array) -> Array:
        """Return the speed at heights and times, m/s."""
        return self.speed * (1.0 - np.exp(-t / self.time)) * np.maximum(z, 0.0) ** self.exponent / 10.0**self.exponent


class _Winds(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"entries": {"winds": {}}}

    def read_entry(self, name: str, entry: WindEntry, reading: Reading) -> Wind:
        key, values = key_of("winds", name), reading.values
        numbers = {
            word: values.constant(f"{key}.{word}", getattr(entry, word)) for word in ("speed", "exponent", "time")
        }
        wind: Wind = reading.tables["entries"]["winds"].setdefault(name, Wind(name, **numbers))
        return wind


WINDS = _Winds(key="winds", entry=WindEntry, before=("bodies",), bounds={"time": above_zero("the time of a wind")})
WIND_SPEED = Word(
    "wind_speed",
    "winds",
    ("z",),
    Wind.speed_at,
    "tests.models.drags_for_eomgen.law:wind_speed",
    added=lambda wind: (Symbol("time"),),
    unit="m/s",
)
