"""The roads of a scene as an excitation of its linear models: random ones, and measured ones by their spectra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from eomgen.base.messages import listed
from eomgen.errors import Problem, UsageError
from eomgen.formula.curves import Curve
from eomgen.formula.discontinuities import affine, applications
from eomgen.formula.evaluate import evaluate_batch
from eomgen.formula.nodes import Formula, Symbol
from eomgen.products.linear.spectra import MeasuredRoad, Road, RoadExcitation

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def road_excitation(model: CompiledModel, road: Road | None = None, speed: float | None = None) -> RoadExcitation:
    """Return the random or measured roads of the scene's inputs as an excitation of linear models.

    Wheels of the same seed, or on the same profile, run in the same track, each with an offset behind the first wheel;
    different tracks are independent. The spectrum of a profile is by Welch's method, see ``MeasuredRoad``; speeds are
    taken at the default parameters.

    Parameters
    ----------
    road, speed : Road of ``eomgen.spectra``, m/s
        In place of the scene's.

    Returns
    -------
    RoadExcitation
        Power spectral densities of the elevations under the wheels, for responses of a ``Linearization``.

    Raises
    ------
    UsageError
        No input is a road, or the roads differ in class, profile or speed and no other is given.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> model.road_excitation().speed
    20.0
    """
    under = {item.name: item.road for item in model.description.inputs if item.road is not None}
    if not under and (measured := _measured_profile_inputs(model)):
        return _over_profile(measured, road, speed)
    if not under:
        fault = "no input of the scene is a road: a random one, or a curve at a speed times t less an offset [E0083]"
        hint = '[inputs] front = { road = { class = "C", speed = 20 } }, or eomgen.spectra.RoadExcitation by hand'
        raise UsageError(Problem("road_excitation", fault, hint))
    classes = {item.road_class for item in under.values()}
    if road is None and len(classes) > 1:
        fault = f"the roads of the scene are of the classes {listed(sorted(classes))} [E0084]"
        raise UsageError(Problem("road_excitation", fault, 'one of them: road=eomgen.spectra.Road("C")'))
    speed = _one_speed([item.speed for item in under.values()]) if speed is None else speed
    tracks = {seed: float(k) for k, seed in enumerate(dict.fromkeys(item.seed for item in under.values()))}
    return RoadExcitation(
        Road(classes.pop()) if road is None else road,
        speed,
        {name: item.offset for name, item in under.items()},
        {name: tracks[item.seed] for name, item in under.items()},
        "independent",
    )


class _MeasuredProfileInput(NamedTuple):
    """An input that is a measured profile under a wheel, or the rate of the profile, at the default parameters."""

    curve: Curve
    speed: float
    offset: float
    is_rate: bool


def _measured_profile_inputs(model: CompiledModel) -> dict[str, _MeasuredProfileInput]:
    """Return by name the inputs whose formula is a measured profile (a curve of points) travelled at a constant
    speed."""
    values = model.description.values({})
    result = {
        item.name: _measured_profile_input(item.formula, values)
        for item in model.description.inputs
        if item.formula is not None
    }
    return {name: passed for name, passed in result.items() if passed is not None}


def _measured_profile_input(formula: Formula, values: Mapping[str, float]) -> _MeasuredProfileInput | None:
    """Return curve, speed (m/s) and offset (m) of an input that is a measured profile travelled at constant speed. Also
    for the rate of such a profile. None for another formula; `values` are the parameters by name."""
    at = applications(formula)
    if len(at) != 1 or not isinstance(at[0].curve, Curve):
        return None
    travelled, curve = affine(at[0].argument, lambda symbol: values.get(symbol.name)), at[0].curve
    if travelled is None or not travelled[0] > 0.0:
        return None
    speed, start = travelled
    t = (np.linspace(curve.start, curve.end, 17)[1:-1] - start) / speed

    def value_of(symbol: Symbol) -> object:
        return t if symbol.kind == "time" else values[symbol.name]

    distance = evaluate_batch(formula, value_of, along_motion=True)  # type: ignore[arg-type]  # numbers and an array
    for order in (0, 1):
        expected = speed**order * curve(speed * t + start, order)
        if np.allclose(distance, expected, rtol=1e-9, atol=1e-12 * float(np.abs(expected).max())):
            return _MeasuredProfileInput(curve, speed, -start, bool(order))
    return None


def _measured_road(curves: Sequence[Curve]) -> MeasuredRoad:
    """Return the measured road of the wheels' common profile; raise UsageError if the wheels run over different
    profiles."""
    first = curves[0]
    if not all(_alike(curve, first) for curve in curves):
        fault = "the wheels of the scene run over different profiles [E0086]"
        hint = "the spectrum of one of them: road=eomgen.spectra.MeasuredRoad.of_profile(distance, elevation)"
        raise UsageError(Problem("road_excitation", fault, hint))
    x = np.linspace(first.start, first.end, len(first.x))
    gap = float(np.diff(first.breaks).max())
    return MeasuredRoad.of_profile(x, first(x), widest=gap, source="measured")


def _over_profile(
    measured: Mapping[str, _MeasuredProfileInput], road: Road | None, speed: float | None
) -> RoadExcitation:
    """Return the excitation by a measured road under the wheels among the inputs `measured`. Inputs with the rate of a
    profile become rates of their wheels. `road` and `speed` (m/s) replace the scene's unless None. Raises UsageError
    without an input of an elevation, or for different speeds or profiles."""
    wheels = {name: passed for name, passed in measured.items() if not passed.is_rate}
    rates = {
        wheel: name
        for wheel, under in wheels.items()
        for name, passed in measured.items()
        if passed.is_rate and _alike(passed.curve, under.curve) and np.isclose(passed.offset, under.offset)
    }
    if not wheels:
        fault = f"{listed(measured)} is the rate of a measured road, and no input is its elevation [E0087]"
        raise UsageError(Problem("road_excitation", fault, "an input of the elevation, too"))
    speed = _one_speed([passed.speed for passed in wheels.values()]) if speed is None else speed
    road = _measured_road([passed.curve for passed in wheels.values()]) if road is None else road
    tracks: dict[str, float] = {}
    known: list[Curve] = []
    for name, passed in wheels.items():
        number = next((k for k, curve in enumerate(known) if _alike(curve, passed.curve)), len(known))
        known += [passed.curve] if number == len(known) else []
        tracks[name] = float(number)
    ahead = min(passed.offset for passed in wheels.values())
    offsets = {name: passed.offset - ahead for name, passed in wheels.items()}
    return RoadExcitation(road, speed, offsets, tracks, "independent", rates)


def _one_speed(of_wheels: Sequence[float]) -> float:
    """Return the speed of all wheels. Raises UsageError for different ones."""
    if len(set(of_wheels)) > 1:
        speeds = ", ".join(f"{value:.6g}" for value in sorted(set(of_wheels)))
        fault = f"the wheels of the scene have the speeds {speeds} m/s [E0085]"
        raise UsageError(Problem("road_excitation", fault, "one of them: speed=20.0"))
    return of_wheels[0]


def _alike(first: Curve, second: Curve) -> bool:
    return np.array_equal(first.x, second.x) and np.array_equal(first.y, second.y)
