"""Reading of waves: their components, from a spectrum by seed or one by one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, ClassVar, TypeVar

import numpy as np

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import key_of
from eomgen.base.random_inputs import WAVES, standard_normals
from eomgen.errors import UsageError
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Number
from eomgen.products.waves.formula.fields import WaveComponent, WaveField
from eomgen.products.waves.sea_states.components import Components, divided, frequency_and_group_velocity, wave_number
from eomgen.products.waves.sea_states.nonlinearity import (
    beyond_second_order,
    bound_waves,
    breaking_height,
    low_crest_of_first_order,
    members_of_bound_waves,
    too_steep_together,
)
from eomgen.products.waves.sea_states.spectra import Jonswap, PiersonMoskowitz, Spectrum, SpectrumTable, Spreading
from eomgen.products.waves.section import schema as written
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import Values
from eomgen.system.signals import Parameter, variables_of


@dataclass(frozen=True)
class UnbrokenSea:
    """Rule that the significant height, m, is below the height at which peak waves of k, rad/m, break at a depth, m."""

    k: float
    depth: float
    stage: ClassVar[int] = 1

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        return np.greater(numbers[0], breaking_height(self.k, self.depth))

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        length, most = 2.0 * math.pi / self.k, breaking_height(self.k, self.depth)
        fault = f"at the peak waves of {length:.4g} m break from a height of {most:.4g} m on"
        fault = f"{fault}, and the significant height is {numbers[0]:.4g} m [E1799]"
        return fault, "a smaller height, or a longer period"


#: Keys of each type of spectrum; required keys with an example.
_KEYS = {
    "jonswap": "height=3 period=9 peakedness",
    "pierson_moskowitz": "wind=15 height",
    "points": "points=[[0.4,0],[0.7,2],[1.5,0]] height",
}
#: Free waves whose pairs are taken at most.
MOST_WITH_PAIRS = 100
#: Free waves with variables at most: each has two parameters.
MOST_WITH_VARIABLES = 500
Made = TypeVar("Made")
#: Periods of waves in s: far outside of this range numbers overflow.
PERIODS = (1e-6, 1e9)
#: Keys that are of spectra alone.
_OF_SPECTRA = ("components", "band", "heading", "spreading", "seed", "amplitudes", "variables")


def no_waves(name: str) -> WaveField:
    """Return waves in place of refused waves, so that reading can continue to the next problem."""
    return WaveField(name, (WaveComponent(1.0, 0.0, 1.0, 0.0, 0.0, 0.0),), math.inf, 0.0, 0.0, "none")


def read_waves(name: str, entry: written.SeaWaves, gravity: float, values: Values) -> WaveField:
    """Return the waves of an entry; faults are reported, and waves of amplitude 0 returned.

    Parameters
    ----------
    name, entry : of the waves
    gravity : magnitude, m/s^2
    values : of the scene, which evaluates numbers and takes notes
    """
    key, report = key_of("waves", name), values.report
    before = len(report.noted)
    if (entry.spectrum is None) == (entry.regular is None):
        both = "both spectrum and regular say" if entry.spectrum is not None else "neither spectrum nor regular says"
        hint = 'spectrum = { type = "jonswap", height = 3, period = 9 }'
        report.add(key, f"{both} which waves there are [E1231]", hint)
    numbers: dict[str, float] = {"depth": math.inf} | values.keys(key, entry, "depth", "ramp", "level")
    depth, ramp, level = numbers.values()
    if not gravity > 0.0:
        report.add(key, "waves need gravity, and the scene has none [E1232]", "gravity = [0, 0, -9.81]")
    components: Sequence[WaveComponent] = ()
    factor: Formula | None = None
    if len(report.noted) == before and not math.isnan(depth + ramp + level + gravity):
        if entry.regular is not None:
            components = _regular(key, entry, depth, gravity, values)
        else:
            components, factor = _irregular(key, entry, depth, gravity, values)
    free = len(components)
    if components and len(report.noted) == before:
        values.note(f"{key}: {text}" for text in _steep(components, depth, entry) if text)
    if entry.order == 2 and len(report.noted) == before:
        components = [*components, *_bound(key, components, depth, gravity, values)]
    if len(report.noted) > before or not components:
        return no_waves(name)
    whole = WaveField(name, tuple(components), depth, level, ramp, entry.stretching, free, factor, seed=entry.seed)
    if not entry.variables:
        return whole
    drawn = [(number, -1, 1) for number in range(free)] + (members_of_bound_waves(free) if entry.order == 2 else [])
    return replace(whole, variables=variables_of(name, 2 * free), drawn=tuple(drawn))


def _steep(components: Sequence[WaveComponent], depth: float, entry: written.SeaWaves) -> Iterator[str]:
    """Yield notes on waves that break together, and on crests that first order makes too low; texts may be empty."""
    kx, ky, _, amplitude, _, _ = np.array(components).T
    k, regular = np.hypot(kx, ky), entry.regular is not None
    yield too_steep_together(k, amplitude, depth, alone=regular, unit=entry.variables)
    if regular and entry.order == 1:
        steepest = int(np.argmax(k * amplitude))
        yield low_crest_of_first_order(float(k[steepest]), float(amplitude[steepest]), depth)


def variables_as_parameters(waves: WaveField) -> list[Parameter]:
    """Return the parameters for the variables of waves, with the values of the seed."""
    names = waves.variables
    made = zip(names, standard_normals(waves.seed, len(names), WAVES).tolist(), strict=True)
    return [
        Parameter(name, value, True, "1", f"standard normal variable of wave {k // 2 + 1} of {waves.name}", True)
        for k, (name, value) in enumerate(made)
    ]


def _bound(
    key: str, components: Sequence[WaveComponent], depth: float, gravity: float, values: Values
) -> list[WaveComponent]:
    """Return the bound waves of second order of free waves; none, after a report, for too many waves or two equal ones.
    Water that is too shallow is noted."""
    if len(components) > MOST_WITH_PAIRS:
        count = len(components)
        fault = f"{count} waves have {count**2} bound waves, more than {MOST_WITH_PAIRS**2} [E1233]"
        values.report.add(f"{key}.order", fault, "fewer components or directions, or order = 1")
        return []
    kx, ky, w, amplitude, phase, _ = np.array(components).T
    vectors = np.stack((kx, ky), axis=1)
    if len(np.unique(vectors, axis=0)) < len(vectors):
        fault = "two waves have the same period and heading [E1235]"
        values.report.add(f"{key}.regular", fault, "one with the sum of both")
        return []
    if fault := beyond_second_order(vectors, amplitude, depth):
        values.note([f"{key}: {fault}, or order = 1"])
    waves, frequencies, raised, phases, potentials = bound_waves(vectors, w, amplitude, phase, depth, gravity)
    return _rows(*waves.T, frequencies, raised, phases, potentials)


def _rows(*columns: Array) -> list[WaveComponent]:
    return [WaveComponent(*row) for row in np.array(columns).T.tolist()]


def _regular(key: str, entry: written.SeaWaves, depth: float, gravity: float, values: Values) -> list[WaveComponent]:
    """Return the components of regular waves; faults are reported, and impossible waves left out."""
    report, result = values.report, []
    for word in _OF_SPECTRA:
        if getattr(entry, word) != written.SeaWaves.model_fields[word].default:
            fault = f"{word} belongs to a spectrum, and these waves are given one by one [E1236]"
            report.add(f"{key}.{word}", fault, "without it")
    if not entry.regular:
        report.add(f"{key}.regular", "there are no waves [E1237]", "regular = [{ amplitude = 1, period = 8 }]")
    for number, wave in enumerate(entry.regular or ()):
        path = f"{key}.regular[{number}]"
        amplitude, period, heading, phase = values.keys(path, wave, "amplitude", "period", "heading", "phase").values()
        if report.concerns(path) or math.isnan(amplitude + period + heading + phase):
            continue
        w = 2.0 * math.pi / period
        k = wave_number(w, depth, gravity)
        most = 0.5 * breaking_height(k, depth)
        if amplitude > most:
            fault = f"a wave of {2.0 * math.pi / k:.4g} m breaks from an amplitude of {most:.4g} m on, and this one has"
            hint = "a smaller amplitude, or a longer period"
            report.add(f"{path}.amplitude", f"{fault} {amplitude:.4g} m [E1239]", hint)
        vector = k * math.cos(heading), k * math.sin(heading)
        result.append(WaveComponent(*vector, w, amplitude, phase, amplitude * gravity / w))
    return result


def _check_variables(key: str, entry: written.SeaWaves, report: Report) -> None:
    """Report amplitudes and phases that cannot follow from variables."""
    count = entry.components * (1 if entry.spreading is None else entry.spreading.directions)
    if entry.amplitudes == "fixed":
        fault = "amplitudes are fixed, and variables make amplitudes and phases [E1242]"
        report.add(key, fault, 'amplitudes = "gaussian"')
    elif count > MOST_WITH_VARIABLES:
        fault = f"{count} waves have {2 * count} variables, more than {2 * MOST_WITH_VARIABLES} [E1243]"
        report.add(key, fault, "fewer components or directions")


def _irregular(
    key: str, entry: written.SeaWaves, depth: float, gravity: float, values: Values
) -> tuple[list[WaveComponent], Formula | None]:
    """Return the free waves of a spectrum, and the factor of their amplitudes, a formula, if the height has tunable
    parameters, else None. With ``variables`` amplitudes are standard deviations and phases 0. Without waves after a
    reported fault."""
    report, before = values.report, len(values.report.noted)
    assert entry.spectrum is not None  # checked by ``read_waves``
    spectrum, of_height = _spectrum(f"{key}.spectrum", entry.spectrum, gravity, values)
    height = None if of_height is None else values.value(of_height)
    heading = values.constant(f"{key}.heading", entry.heading)
    low, high = values.constants(f"{key}.band", entry.band)
    spread, spreading = entry.spreading, None
    exponent = 1.0 if spread is None else values.constant(f"{key}.spreading.exponent", spread.exponent)
    if spread is not None and len(report.noted) == before:
        spreading = _attempt(f"{key}.spreading", report, lambda: Spreading(exponent, heading, spread.directions))
    if spectrum is None or len(report.noted) > before or math.isnan(heading):
        return [], None
    shortest, longest = PERIODS
    if not shortest <= (period := 2.0 * math.pi / spectrum.peak) <= longest:
        fault = f"at the peak the period {period:.6g} s is not from {shortest:g} to {longest:g} s [E1246]"
        report.add(f"{key}.spectrum", fault, "period = 8")
    if entry.variables:
        _check_variables(f"{key}.variables", entry, report)
    if len(report.noted) > before:
        return [], None
    options: dict[str, Any] = {"depth": depth, "gravity": gravity, "band": (low, high), "spreading": spreading}
    options |= {"heading": heading, "height": height}
    parts = _attempt(key, report, lambda: divided(spectrum, entry.components, **options))
    if parts is None:
        return [], None
    unbroken = UnbrokenSea(wave_number(spectrum.peak, depth, gravity), depth)
    values.require(f"{key}.spectrum", unbroken, [Number(parts.height) if of_height is None else of_height])
    if report.concerns(f"{key}.spectrum"):
        return [], None
    waves = parts.realisation(entry.seed, entry.amplitudes)
    if entry.variables:
        waves = Components(waves.vectors, np.sqrt(parts.energy), np.zeros(len(parts.energy)))
    numbers = np.hypot(*waves.vectors.T)
    w, _ = frequency_and_group_velocity(numbers, depth, gravity)
    rows = _rows(*waves.vectors.T, w, waves.amplitude, waves.phase, waves.amplitude * gravity / w)
    if of_height is None or height is None:
        return rows, None
    tunable = any(values.names.parameters.get(item.name) for item in symbols(of_height))
    return rows, of_height / height if tunable else None


def _spectrum(
    key: str, entry: written.SeaSpectrum, gravity: float, values: Values
) -> tuple[Spectrum | None, Formula | None]:
    """Return a spectrum and the formula of the significant height for scaling (None: not scaled); None for a spectrum
    with a fault, which is reported."""
    report = values.report
    values.check_kind(key, entry, "type", _KEYS)
    number: dict[str, Any] = values.keys(key, entry, "height", "period", "wind", "peakedness")
    height = number.get("height")
    if height is not None:
        number["height"] = values.value(height)
    if report.concerns(key) or any(map(math.isnan, number.values())):
        return None, None
    if entry.type == "jonswap":
        return _attempt(key, report, lambda: Jonswap(**number)), height
    if entry.type == "pierson_moskowitz":
        return _attempt(key, report, lambda: PiersonMoskowitz(number["wind"], gravity)), height
    points = [values.constants(f"{key}.points[{index}]", pair) for index, pair in enumerate(entry.points or ())]
    if len(points) < 2:
        fault = f"a spectrum needs two points or more, not {len(points)} [E1257]"
        report.add(f"{key}.points", fault, "[[0.4, 0], [0.7, 2], [1.5, 0]]")
        return None, None
    return _attempt(f"{key}.points", report, lambda: SpectrumTable(*np.array(points).T), at_key=True), height


def _attempt(key: str, report: Report, make: Callable[[], Made], *, at_key: bool = False) -> Made | None:
    """Return an object of ``sea_states``; None for a fault, which is reported at the key of the argument with the
    fault, below ``key``, or ``at_key``."""
    try:
        return make()
    except UsageError as error:
        problem = error.problems[0]
        word = problem.where.partition(": ")[2]
        report.add(key if at_key else f"{key}.{word}", problem.what, problem.hint)
        return None
