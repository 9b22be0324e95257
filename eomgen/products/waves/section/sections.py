"""The section of waves."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from eomgen.formula.evaluate import symbols
from eomgen.products.waves.section.level_water import level_gravity
from eomgen.products.waves.section.reading import PERIODS, no_waves, read_waves, variables_as_parameters
from eomgen.scene.reading.requirements import Outside
from eomgen.scene.section import Entries, Reading, Section, UnusedEntries, fault_of_variables

if TYPE_CHECKING:
    from eomgen.products.waves.section.schema import SeaWaves


class _Waves(Section):
    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        entries: Mapping[str, SeaWaves] = document.section("waves")
        if name not in entries or not entries[name].variables:
            return "", ""
        if name in document.section("random"):
            fault = f"the name {name} is both a random process and waves with variables of their own [E1461]"
            return fault, "another name for one of them"
        sea = entries[name]
        count = 2 * sea.components * (1 if sea.spreading is None else sea.spreading.directions)
        return fault_of_variables("sea", name, count, document, rows)

    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"entries": {"waves": {}}}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        document, values, fields = reading.document, reading.values, reading.tables["entries"]["waves"]
        if document.section("waves"):
            gravity, magnitude = level_gravity(reading)
            if any(reading.names.parameters.get(symbol.name) for part in gravity for symbol in symbols(part)):
                values.note(["waves have the gravity of the default parameters, even if a run has another"])
            for name, entry in document.section("waves").items():
                fields[name] = read_waves(name, entry, magnitude, values)
                reading.add_parameters(variables_as_parameters(fields[name]))
        fields |= {name: no_waves(name) for name in sorted(reading.refused["waves"])}
        return {name: fields[name] for name in document.section("waves")}

    def plain_angles(self, entries: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
        for name, sea in entries.items():
            angles = [(f"the waves {name} run to", sea.get("heading"))]
            for number, wave in enumerate(sea.get("regular") or ()):
                angles.append((f"regular[{number}] of the waves {name} runs to", wave.get("heading")))
            for subject, value in angles:
                if isinstance(value, int | float):
                    yield subject, value

    def unused(self, reading: Reading) -> UnusedEntries:
        mentioned = reading.values.mentioned
        names = [name for name in reading.document.section("waves") if ("waves", name) not in mentioned]
        return UnusedEntries("sea", "seas", names)

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"parts": {"waves": tuple(reading.items["waves"].values())}}


_POSITIVE = Outside(math.ulp(0.0), math.inf)

WAVES = _Waves(
    key="waves",
    entry="eomgen.products.waves.section.schema:SeaWaves",
    method="waves",
    bounds={
        "spectrum.height": (_POSITIVE, "the height {0} is not positive [E1258]", "3"),
        "depth": (_POSITIVE, "the depth {0} m is not positive [E1229]", "no depth for water without a bottom"),
        "ramp": (Outside(0.0, math.inf), "the time {0} s is negative [E1230]", "ramp = 20"),
        "regular.amplitude": (Outside(0.0, math.inf), "the amplitude {0} m is negative [E1191]", "the phase + pi"),
        "regular.period": (
            Outside(*PERIODS),
            f"the period {{0}} s is not from {PERIODS[0]:g} to {PERIODS[1]:g} s [E1245]",
            "period = 8",
        ),
    },
    after=("random",),
    before=("bodies", "definitions"),
    documentation="""
    Add waves, of a ``spectrum`` or ``regular`` ones, which formulas ask for elevation, slope, velocity and
    acceleration of the water.""",
)
