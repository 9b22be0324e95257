"""Laws of inputs that samples differ in without another compiled model: seeds of random roads, and factors.

A law that differs from the scene's is handed to a run as a function of time, as a caller would hand in his own.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.random_roads import road_harmonics
from eomgen.base.standard_normals import WAVES, standard_normals
from eomgen.base.text import shown
from eomgen.compiled.model import CompiledModel
from eomgen.errors import Problem, UsageError
from eomgen.products.ensembles.distributions import Distribution
from eomgen.simulation.option_types import LawOverTime
from eomgen.system.signals import Input

#: Properties of a law that may vary: the seed of its random road or process, a factor of all of it.
LAWS = ("seed", "scale")
_SMALLEST = 2.0**-54
#: Times at which harmonics are summed together: their arrays stay in the processor's cache.
_TOGETHER = 64
#: Laws that a hint names.
_NAMED = 4


def laws_that_vary(model: CompiledModel) -> list[str]:
    """Return the names ``seed.road`` and ``scale.road`` of the inputs that have them."""
    seeds = [f"seed.{item.name}" for item in model.description.inputs if item.road is not None or _own_variables(item)]
    seeds += [f"seed.{waves.name}" for waves in model.description.waves if waves.variables]
    return [*seeds, *(f"scale.{item.name}" for item in model.description.inputs if item.given)]


def law_of(model: CompiledModel, name: str, where: str) -> int:
    """Return the index of the input of ``seed.road`` or ``scale.road``, waves after all inputs. Raises
    UsageError if there is none whose law so varies."""
    kind, _, of = name.partition(".")
    place = {item.name: k for k, item in enumerate(model.description.inputs)}.get(of)
    label = f"{where} {name}"
    curves = [curve.name for curve in getattr(model.scene, "curves", ())]
    if place is None and of in curves:
        fault = f"{of} is a curve, whose numbers are fixed in the code"
        hint = f"a tunable parameter as factor in formulas, factor * {of}(...)"
        if kind == "seed":
            hint = (
                f"a random road as an input, [inputs.{of}] road = {{ class = ..., speed = ... }}; or a model per seed"
            )
        raise UsageError(Problem(label, fault, hint))
    if place is None and of in (seas := [waves.name for waves in model.description.waves]):
        number = seas.index(of)
        if kind == "seed" and model.description.waves[number].variables:
            return len(model.description.inputs) + number
        fault, hint = f"{of} are waves, whose numbers are fixed in the code", f"variables = true in [waves.{of}]"
        if kind != "seed":
            fault = f"{of} are waves, which are as high as their spectrum says"
            hint = f'height = "height" in the spectrum of [waves.{of}], a tunable parameter, which varies'
        raise UsageError(Problem(label, fault, hint))
    if place is None:
        fault = f"there is no input {shown(of)}"
        raise UsageError(Problem(label, fault, _others(model, kind)))
    item = model.description.inputs[place]
    if kind == "seed" and item.random is not None and item.random.follows:
        leader = item.random.follows
        fault = f"the random process {of} follows {leader}, and has its variables"
        raise UsageError(Problem(label, fault, f"seed.{leader}"))
    if kind == "seed" and item.road is None and item.random is None:
        fault = f"the input {of} is no random road and no random process, so it has no seed"
        raise UsageError(Problem(label, fault, _others(model, kind)))
    if not item.given:
        fault = f"the scene gives the input {of} no law that could be multiplied"
        raise UsageError(Problem(label, fault, f"{of}, a value that is constant over a run"))
    return place


def has_variables(model: CompiledModel, place: int) -> bool:
    """Return whether the law at an index of ``law_of`` has random variables, which are parameters."""
    inputs = model.description.inputs
    return place >= len(inputs) or inputs[place].random is not None


def variables_of_seed(model: CompiledModel, place: int, seed: float) -> dict[str, float]:
    """Return the values that a seed gives the parameters of the random process or the waves at a place, as of
    ``law_of``; none of a road, which has no parameters."""
    inputs = model.description.inputs
    if place >= len(inputs):
        names = model.description.waves[place - len(inputs)].variables
        return dict(zip(names, standard_normals(int(seed), len(names), WAVES).tolist(), strict=True))
    process = inputs[place].random
    if process is None:
        return {}
    own = process.own_variables
    return dict(zip(own, standard_normals(int(seed), len(own), process.name).tolist(), strict=True))


def _own_variables(item: Input) -> bool:
    return item.random is not None and bool(item.random.own_variables)


def _others(model: CompiledModel, kind: str) -> str:
    """Return a hint: the laws that so vary."""
    every = [name for name in laws_that_vary(model) if name.startswith(f"{kind}.")]
    return " or ".join(every[:_NAMED])


def is_whole(values: Array) -> bool:
    """Return whether all numbers are whole."""
    return bool(np.all(values == np.floor(values)))


def check_seeds(name: str, how: Distribution) -> None:
    """Raise UsageError if seeds are not whole numbers from 0 on."""
    least = how.quantiles(np.array([_SMALLEST])) if not how.levels else np.array(how.levels)
    if not how.whole or np.min(least) < 0.0:
        fault = f"a seed is a whole number from 0 on, and {how.text} has others"
        raise UsageError(Problem(f"vary {name}", fault, f"{name}=integers(0, 999999), or values(1, 2, 3)"))


def check_tracks(model: CompiledModel, seeds: Mapping[str, int]) -> None:
    """Raise UsageError if seeds, by name with the places of their inputs, are of wheels in the same track."""
    of_track: dict[tuple[str, int], str] = {}
    for name, place in seeds.items():
        if model.description.inputs[place].random is not None:
            continue
        track = _track(model.description.inputs[place])
        if (other := of_track.setdefault(track, name)) != name:
            fault = f"its wheel runs in the same track as the wheel of {other}, and has the same seed"
            raise UsageError(Problem(f"vary {name}", fault, f"{other} alone, which all wheels of the track follow"))


def laws_of(
    model: CompiledModel, p: Array, seeds: Mapping[str, float], factors: Mapping[str, float]
) -> dict[str, LawOverTime]:
    """Return the laws of the inputs that seeds and factors, by their names, make others than the scene's, at parameters
    p. All wheels of a track have its seed."""
    inputs = model.description.inputs
    by_name = {item.name: item for item in inputs}
    of_track = {_track(by_name[name.partition(".")[2]]): int(seed) for name, seed in seeds.items()}
    of_input = {name.partition(".")[2]: factor for name, factor in factors.items()}
    result = {}
    for place, item in enumerate(inputs):
        seed = None if item.road is None else of_track.get(_track(item))
        if seed is not None or item.name in of_input:
            result[item.name] = _law(model, p, place, seed, of_input.get(item.name, 1.0))
    return result


def own_seed(model: CompiledModel, place: int) -> int:
    """Return the seed that the scene gives the road of an input."""
    return _track(model.description.inputs[place])[1]


def _track(item: Input) -> tuple[str, int]:
    if item.road is None:
        raise UsageError(Problem(f"input {item.name}", "it is no random road", "an input with a road of a class"))
    return item.road.road_class, item.road.seed


def _law(model: CompiledModel, p: Array, place: int, seed: int | None, factor: float) -> LawOverTime:
    item = model.description.inputs[place]
    if seed is None or item.road is None:
        return LawOverTime(lambda t: factor * _own(model, t, p, place))
    road = item.road
    waves = np.array(
        road_harmonics(road.road_class, road.speed, seed=seed, offset=road.offset, harmonics=len(item.harmonics))
    )
    if item.formula is None:
        return LawOverTime(lambda t: factor * _sum(waves, t))
    before = np.array(item.harmonics)
    return LawOverTime(lambda t: factor * (_own(model, t, p, place) - _sum(before, t) + _sum(waves, t)))


def _own(model: CompiledModel, t: Array, p: Array, place: int) -> Array:
    return np.asarray(model.input_values(t, parameters=p)[:, place])


def _sum(waves: Array, t: Array) -> Array:
    """Return a sum of harmonics, (n,), at times t (n,): row by row, so that its bits do not depend on how many there
    are."""
    amplitude, frequency, phase = waves.T
    values, room = np.empty(len(t)), np.empty((_TOGETHER, len(amplitude)))
    for first in range(0, len(t), _TOGETHER):
        times = t[first : first + _TOGETHER]
        terms = np.multiply.outer(times, frequency, out=room[: len(times)])
        terms += phase
        np.cos(terms, out=terms)
        terms *= amplitude
        terms.sum(axis=1, out=values[first : first + _TOGETHER])
    return values
