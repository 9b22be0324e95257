"""Schema of curves through points, tables, waves, bumps and roads, and of inputs made of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from eomgen.formula import curves
from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS, TIME
from eomgen.scene.reading.key_metadata import ANY_UNIT, Table, key, label_of, of_fixed_parameters, optional
from eomgen.scene.reading.kinds import Description, Finite, Pair, Unit, Value

RoadClass = Literal["A", "B", "C", "D", "E", "F", "G", "H"]
Seed = Annotated[int, Field(ge=0, le=2**63 - 1)]
Harmonics = Annotated[int, Field(ge=1, le=2000)]
Column = Annotated[int, Field(ge=0, le=9999)] | Annotated[str, Field(max_length=200)]
_CLASS = "roughness: A is a good motorway, C an average road; each class is twice as rough in amplitude"
_COLUMN = "title or number from 0"


class TableFile(Table):
    """Two columns of a CSV file."""

    file: Annotated[str, Field(min_length=1, max_length=1000)] = key("path from the folder of the file", path=True)
    argument: Column = key("column of the argument, which increases from row to row", 0, kind=_COLUMN)
    value: Column = key("column of the value", 1, kind=_COLUMN)
    argument_unit: Unit = key("unit that the argument's column is in: `ms`", "", column="argument")
    value_unit: Unit = key("unit that the value's column is in, to be brought to SI: `mm`", "", column="value")
    argument_scale: Finite = key("factor on the argument", 1.0)
    value_scale: Finite = key("factor on the value", 1.0)
    delimiter: Literal["comma", "semicolon", "tab", "space"] | None = optional(
        "mark between columns", shown_default="the first of tab, semicolon, comma, space that is in the first row"
    )
    decimal: Literal[".", ","] = key("mark in numbers", ".", kind="`.` or `,`")


class Wave(Table):
    """A periodic signal with corners."""

    shape: Literal["square", "triangle", "sawtooth"] = key("square: high, low; triangle: up, down; sawtooth: up")
    period: Value = key("period of the argument", unit=ANY_UNIT, names=FIXED_PARAMETERS, column="argument")
    low: Value = key("lowest value", 0.0, unit=ANY_UNIT, names=FIXED_PARAMETERS, column="value")
    high: Value = key("highest value", 1.0, unit=ANY_UNIT, names=FIXED_PARAMETERS, column="value")
    start: Value = key("start of a period", 0.0, unit=ANY_UNIT, names=FIXED_PARAMETERS, column="argument")
    duty: Value = key("share of the period that a square is high, or a triangle rises", 0.5, names=FIXED_PARAMETERS)


class BumpEntry(Table):
    """A single haversine bump: height/2 (1 - cos(2 pi x/length)) over its length, zero elsewhere."""

    length: Value = key("distance from its beginning to its end", unit="m", names=FIXED_PARAMETERS)
    height: Value = key("height of the bump, negative for a hole", unit="m", names=FIXED_PARAMETERS)
    position: Value = key("x of its start", 0.0, unit="m", names=FIXED_PARAMETERS)


class ProfileEntry(Table):
    """A random road over distance, with the spectrum of ISO 8608."""

    road_class: RoadClass = key(_CLASS, alias="class", kind="`A` to `H`")
    seed: Seed = key("seed of the random phases", 0, kind="whole number from 0")
    harmonics: Harmonics = key("number of harmonics between 0.011 and 2.83 cycles/m", 200)


class ShapeEntry(Table):
    """An entry with points, listed or from a table."""

    table: TableFile | None = optional("points from a CSV file")
    points: Annotated[tuple[Pair, ...], Field(strict=False)] | None = of_fixed_parameters(
        "points in order",
        unit=ANY_UNIT,
        column=("argument", "value"),
        kind="list of [argument, value], any unit that fits",
    )
    interpolation: Literal["quintic", "linear", "steps"] | None = optional(
        "method between points", shown_default=f"`{curves.Curve.interpolation}`", kind="`quintic`, `linear` or `steps`"
    )
    outside: Literal["error", "hold", "periodic"] | None = optional(
        "continuation beyond the points",
        shown_default="`error`; `hold` for `points` that are `linear` or `steps`",
        kind="`error`, `hold` or `periodic`",
    )


class CurveEntry(ShapeEntry):
    """A function of one number that formulas use by its name."""

    wave: Wave | None = optional("a periodic signal")
    bump: BumpEntry | None = optional("a single bump")
    road: ProfileEntry | None = optional("a random road over distance in m")
    argument_unit: Unit | None = optional(
        "unit of its argument, in SI; formulas that give it another quantity are refused",
        column="argument",
        shown_default="as its points or its table say",
    )
    unit: Unit = key("label", "")
    description: Description = key("text of one line for tables", "")

    @classmethod
    def column_labels(cls, data: Mapping[str, Any]) -> tuple[str, str] | None:
        return label_of(data.get("argument_unit")), label_of(data.get("unit"))


class RoadEntry(ShapeEntry):
    """The elevation under a wheel over time: a profile of ISO 8608, a bump, or points over distance, at a speed."""

    road_class: RoadClass | None = optional(_CLASS, alias="class", kind="`A` to `H`")
    bump: BumpEntry | None = optional("a single bump")
    speed: Value = key("speed of the vehicle, up to 10 000", unit="m/s", names=PARAMETERS)
    seed: Seed = key("seed of the random phases of a class", 0, kind="whole number from 0")
    offset: Value = key("distance to the wheel with offset 0", 0.0, unit="m", names=FIXED_PARAMETERS)
    harmonics: Harmonics = key("number of harmonics of a class between 0.011 and 2.83 cycles/m", 200)

    @classmethod
    def column_labels(cls, data: Mapping[str, Any]) -> tuple[str, str] | None:
        return "m", "m"


class InputEntry(ShapeEntry):
    """A signal u(t) that formulas use by its name: the sum of the parts given by its keys."""

    formula: Value | None = optional("a formula", unit=ANY_UNIT, names=TIME)
    wave: Wave | None = optional("a periodic signal")
    road: RoadEntry | None = optional("a road at a speed")
    motion: bool | None = optional(
        "it has rate and acceleration, which its caller gives with it, see [motions](inputs.md#motions-from-outside)",
        kind="`true`",
        shown_default="`false`",
    )
    initial: Finite | None = optional("value of a motion at rest at the start", unit=ANY_UNIT, shown_default="0")
    unit: Unit = key("label", "")
    description: Description = key("text of one line for tables", "")

    @classmethod
    def column_labels(cls, data: Mapping[str, Any]) -> tuple[str, str] | None:
        return "s", label_of(data.get("unit"))
