"""Schema of waves, and the keys of waves and hulls in other tools."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Annotated, Literal

from pydantic import Field

from eomgen.scene.formula.scope import FIXED_PARAMETERS
from eomgen.scene.reading.key_metadata import ForeignKeys, Table, key, of_fixed_parameters, of_parameters, optional
from eomgen.scene.reading.kinds import Description, Pair, Value
from eomgen.scene.signals.curve_schema import Seed


class RegularWave(Table):
    """One sinusoidal wave."""

    amplitude: Value = key("half the height from trough to crest", unit="m", names=FIXED_PARAMETERS)
    period: Value = key("time from crest to crest at a place", unit="s", names=FIXED_PARAMETERS)
    heading: Value = key("direction of propagation, from x towards y", 0.0, unit="rad", names=FIXED_PARAMETERS)
    phase: Value = key("phase at the origin at t = 0; 0 for a crest there", 0.0, unit="rad", names=FIXED_PARAMETERS)


class SeaSpectrum(Table):
    """A spectrum of elevations."""

    type: Literal["jonswap", "pierson_moskowitz", "points"] = key("see below")
    height: Value | None = of_parameters(
        "significant height, four standard deviations; of `jonswap`; others are scaled to it", unit="m"
    )
    period: Value | None = of_fixed_parameters("period at the peak of `jonswap`", unit="s")
    peakedness: Value | None = of_fixed_parameters("peakedness of `jonswap`, 1 to 20", shown_default="3.3")
    wind: Value | None = of_fixed_parameters("wind at 19.5 m, for `pierson_moskowitz`", unit="m/s")
    points: Annotated[tuple[Pair, ...], Field(strict=False)] | None = of_fixed_parameters(
        "points: frequencies in rad/s and one-sided densities in m^2 s/rad, linear between them, 0 beyond",
        kind="list of [frequency, density]",
    )


class Spread(Table):
    """Directions of a spectrum: the density over angles is cos^2s of half the angle to the heading."""

    exponent: Value = key("s: 10 for wind waves, 75 for swell", names=FIXED_PARAMETERS)
    directions: Annotated[int, Field(ge=2, le=99)] = key("number of directions", 9, kind="whole number, 2 to 99")


class SeaWaves(Table):
    """Waves, which formulas ask for elevation, slope, velocity and acceleration of the water at a place."""

    spectrum: SeaSpectrum | None = optional("spectrum of an irregular sea")
    regular: Annotated[tuple[RegularWave, ...], Field(strict=False)] | None = optional(
        "waves one by one, in place of a spectrum"
    )
    components: Annotated[int, Field(ge=1, le=2000)] = key(
        "number of frequencies of a spectrum, each a constant factor above the one before",
        40,
        kind="whole number, 1 to 2000",
    )
    band: Pair = key(
        "lowest and highest frequency of a spectrum, in parts of its peak frequency",
        (0.5, 3.0),
        names=FIXED_PARAMETERS,
        kind="[lowest, highest]",
    )
    heading: Value = key(
        "direction of propagation of a spectrum, from x towards y", 0.0, unit="rad", names=FIXED_PARAMETERS
    )
    spreading: Spread | None = optional("spread of a spectrum over directions")
    seed: Seed = key("seed of amplitudes and phases of a spectrum", 0, kind="whole number from 0")
    amplitudes: Literal["gaussian", "fixed"] = key(
        "amplitudes of a spectrum, at random as in a Gaussian sea, or from its energies, with phases alone at random",
        "gaussian",
    )
    variables: bool = key(
        "amplitudes and phases of a spectrum from standard normal variables, two for each wave, which are tunable"
        " parameters",
        False,
    )
    depth: Value | None = of_fixed_parameters("depth of the water", unit="m", shown_default="no bottom")
    level: Value = key("z of the water at rest in the world", 0.0, unit="m", names=FIXED_PARAMETERS)
    ramp: Value = key(
        "time from t = 0 in which the amplitudes grow to their full size", 0.0, unit="s", names=FIXED_PARAMETERS
    )
    order: Literal[1, 2] = key(
        "order; 2 has bound waves that pairs make at the sums and differences of their frequencies", 1, kind="1 or 2"
    )
    stretching: Literal["wheeler", "none"] = key(
        "place of the motion between still water and crest: z - elevation, shrunk to the depth, or z itself",
        "wheeler",
    )
    description: Description = key("text of one line for tables", "")


#: Names of keys in other tools.
_KEYS: Mapping[str, str] = {
    **dict.fromkeys(("hs", "h_s", "hm0", "significant_height"), "height"),
    **dict.fromkeys(("tp", "t_p", "peak_period"), "period"),
    "gamma": "peakedness",
    **dict.fromkeys(("wind_speed", "u19", "u10"), "wind"),
    **dict.fromkeys(("direction", "mean_direction"), "heading"),
    "water_depth": "depth",
    **dict.fromkeys(("cd", "c_d"), "drag"),
    **dict.fromkeys(("ca", "c_a"), "added_mass"),
    **dict.fromkeys(("draft", "draught"), "wet"),
}


def _key_meant(name: str, keys: Collection[str], value: object) -> str:
    """Return the key of waves or hulls for a name from another tool, with the value of an amplitude if ``value`` is a
    height; empty without one."""
    if name == "height" and "amplitude" in keys and isinstance(value, int | float):
        return f"amplitude = {0.5 * value:.6g}, half of the height"
    if name.lower() in ("cm", "c_m") and "added_mass" in keys:
        return "added_mass, which is c_m - 1"
    meant = _KEYS.get(name, _KEYS.get(name.lower(), ""))
    return meant if meant in keys else ""


ELSEWHERE = ForeignKeys(_key_meant)
