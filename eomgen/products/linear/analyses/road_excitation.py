"""The roads of a scene as an excitation of its linear models: random ones, and measured ones by their spectra."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
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
    wheels, rates, classes = _wheels(model)
    speeds = sorted({wheel.speed for wheel in wheels.values()})
    if speed is None and len(speeds) > 1:
        fault = f"the wheels of the scene have the speeds {', '.join(f'{value:.6g}' for value in speeds)} m/s [E0085]"
        raise UsageError(Problem("road_excitation", fault, "one of them: speed=20.0"))
    if road is None:
        road = _random_road(classes) if classes else _measured_road(wheels.values())
    tracks = {track: float(k) for k, track in enumerate(dict.fromkeys(wheel.track for wheel in wheels.values()))}
    return RoadExcitation(
        road,
        speeds[0] if speed is None else speed,
        {name: wheel.offset for name, wheel in wheels.items()},
        {name: tracks[wheel.track] for name, wheel in wheels.items()},
        "independent",
        rates,
    )


def _wheels(model: CompiledModel) -> tuple[dict[str, _Wheel], dict[str, str], set[str]]:
    """Return the wheels of the scene and the inputs of their rates by input, and the classes of random roads. Raises
    UsageError without wheels."""
    under = {item.name: item.road for item in model.description.inputs if item.road is not None}
    wheels = {name: _Wheel(item.seed, item.speed, item.offset) for name, item in under.items()}
    measured = {} if under else _measured_profile_inputs(model)
    rates: dict[str, str] = {}
    if measured:
        wheels = {name: wheel for name, (wheel, is_rate) in measured.items() if not is_rate}
        for rate in (name for name, (_, is_rate) in measured.items() if is_rate):
            of, _ = measured[rate]
            rates |= {name: rate for name, item in wheels.items() if item.is_under(of)}
        if not wheels:
            fault = f"{listed(measured)} is the rate of a measured road, and no input is its elevation [E0087]"
            raise UsageError(Problem("road_excitation", fault, "an input of the elevation, too"))
    if not wheels:
        fault = "no input of the scene is a road: a random one, or a curve at a speed times t less an offset [E0083]"
        hint = '[inputs] front = { road = { class = "C", speed = 20 } }, or eomgen.spectra.RoadExcitation by hand'
        raise UsageError(Problem("road_excitation", fault, hint))
    return wheels, rates, {item.road_class for item in under.values()}


class _Wheel(NamedTuple):
    """A wheel's way over a road: the track, which is equal for wheels that follow one another, the speed (m/s), the
    offset (m) after the first wheel, and the profile of a measured road."""

    track: Hashable
    speed: float
    offset: float
    curve: Curve | None = None

    def is_under(self, wheel: _Wheel) -> bool:
        """Return whether another wheel is at the same place of the road."""
        return self.track == wheel.track and bool(np.isclose(self.offset, wheel.offset))


def _random_road(classes: set[str]) -> Road:
    """Return the road of the scene's only class. Raises UsageError for several classes."""
    if len(classes) > 1:
        fault = f"the roads of the scene are of the classes {listed(sorted(classes))} [E0084]"
        raise UsageError(Problem("road_excitation", fault, 'one of them: road=eomgen.spectra.Road("C")'))
    return Road(classes.pop())


def _measured_profile_inputs(model: CompiledModel) -> dict[str, tuple[_Wheel, bool]]:
    """Return by name the inputs whose formula is a measured profile (a curve of points) travelled at a constant speed,
    or the rate of one, and whether each is a rate. Offsets count from the first wheel."""
    values = model.description.values({})
    formulas = {item.name: item.formula for item in model.description.inputs if item.formula is not None}
    every = {name: _measured_profile_input(formula, values) for name, formula in formulas.items()}
    passed = {name: item for name, item in every.items() if item is not None}
    ahead = min((wheel.offset for wheel, is_rate in passed.values() if not is_rate), default=0.0)
    return {name: (wheel._replace(offset=wheel.offset - ahead), is_rate) for name, (wheel, is_rate) in passed.items()}


def _measured_profile_input(formula: Formula, values: Mapping[str, float]) -> tuple[_Wheel, bool] | None:
    """Return the wheel of an input that is a measured profile travelled at constant speed, and whether the input is the
    rate of such a profile. None for another formula; `values` are the parameters by name."""
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
            track = np.concatenate([curve.x, curve.y]).tobytes()
            return _Wheel(track, speed, -start, curve), bool(order)
    return None


def _measured_road(wheels: Iterable[_Wheel]) -> MeasuredRoad:
    """Return the measured road of the wheels' common profile; raise UsageError if the wheels run over different
    profiles."""
    first, *others = wheels
    if first.curve is None or any(wheel.track != first.track for wheel in others):
        fault = "the wheels of the scene run over different profiles [E0086]"
        hint = "the spectrum of one of them: road=eomgen.spectra.MeasuredRoad.of_profile(distance, elevation)"
        raise UsageError(Problem("road_excitation", fault, hint))
    x = np.linspace(first.curve.start, first.curve.end, len(first.curve.x))
    return MeasuredRoad.of_profile(x, first.curve(x), source="measured")
