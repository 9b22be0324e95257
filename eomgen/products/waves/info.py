"""Output of ``eomgen info`` for the waves and the hulls of a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from eomgen.cli.info import InfoPart
from eomgen.cli.printing import console, print_table
from eomgen.products.waves.hulls.section import Hull

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene


def described_waves(scene: Scene) -> list[dict[str, Any]]:
    """Return, for each sea of a scene, a mapping in JSON types: number of waves, four standard deviations of elevation
    as ``height``, periods, wave lengths, depth, and the parameters that vary the amplitudes."""
    result = []
    for sea in scene.parts.get("waves", ()):
        free = sea.components[: sea.free]
        # amplitudes of 1 that are multiplied by two standard normal variables have twice the variance of a sinusoid
        share = 1.0 if sea.variables else 0.5
        periods = [2.0 * math.pi / wave.frequency for wave in free]
        lengths = [2.0 * math.pi / math.hypot(wave.kx, wave.ky) for wave in free]
        row = {
            "name": sea.name,
            "waves": len(free),
            "bound_waves": len(sea.components) - len(free),
            "height": 4.0 * math.sqrt(share * sum(wave.amplitude**2 for wave in free)),
            "periods": [min(periods), max(periods)],
            "lengths": [min(lengths), max(lengths)],
            "depth": sea.depth if math.isfinite(sea.depth) else None,
            "level": sea.level,
            "ramp": sea.ramp,
            "variables": list(sea.variables),
        }
        result.append(row)
    return result


def described_hulls(scene: Scene) -> list[dict[str, Any]]:
    """Return name, body, waves, number of stations and added water of each hull, as JSON types."""
    return [
        {
            "name": item.name,
            "body": item.body,
            "waves": None if item.waves is None else item.waves.name,
            "stations": item.stations,
            "moves_water": bool(item.adds_mass_to),
        }
        for item in scene.elements
        if isinstance(item, Hull)
    ]


def print_waves(data: Mapping[str, Any]) -> None:
    """Print a table of seas, and one of hulls."""
    for title in ("waves", "hulls"):
        if rows := data[title]:
            console().print()
            header = [key.replace("_", " ") for key in rows[0]]
            print_table(title.capitalize(), header, [[_as_text(value) for value in row.values()] for row in rows])


def _as_text(value: object) -> str:
    """Return a value of a row in words, of a list its ends."""
    if isinstance(value, list):
        return " to ".join(dict.fromkeys(map(_as_text, value[:: max(len(value) - 1, 1)])))
    return "none" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


SEAS = InfoPart(
    lambda scene: {"waves": described_waves(scene), "hulls": described_hulls(scene)},
    print_waves,
    lambda data: (name for item in data["waves"] for name in item["variables"]),
)
