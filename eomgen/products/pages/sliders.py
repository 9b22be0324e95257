"""Sliders of a live page: tunable parameters, inputs and initial values, each with a range in which the scene's
requirements are met."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.arguments import Requirements
from eomgen.errors import EomgenError
from eomgen.formula.evaluate import evaluate

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.results.solution import Solution

Slider = dict[str, Any]
#: Ends of the range of a parameter as parts of the value, the widest that the requirements allow; distances from the
#: value for zero and for angles.
_FACTORS = ((0.25, 3.0), (0.5, 2.0), (0.7, 1.4), (0.9, 1.1), (0.98, 1.02))
_DISTANCES = (1.0, 0.3, 0.1, 0.03, 0.01)
#: Largest number of sliders of one kind: hundreds would hide the important ones.
_MOST = 60
_GRAVITY = 9.81


def sliders_of(
    model: CompiledModel, solution: Solution, p: Array, held: Mapping[str, float], extent: float
) -> list[Slider]:
    """Return the sliders of a page as JSON types.

    Each has ``kind`` (``parameter``, ``input``, ``position``, ``velocity`` or ``state``), ``index`` in the array,
    ``name``, ``unit``, ``description``, ``low``, ``high`` and ``value``, None for an input that follows the scene's
    formula. Positions have a ``place`` in q, None for turns and shifts of bodies against the scene's start.

    Parameters
    ----------
    p : (np,) parameters of the run
    held : inputs that the run holds
    extent : size of the machine, m
    """
    of_run = (_inputs(model, solution, held, extent), _starts(model, solution, extent), _states(model, solution))
    return [*_parameters(model, p), *chain(*of_run)]


def _parameters(model: CompiledModel, p: Array) -> Iterator[Slider]:
    """Yield sliders for tunable parameters, within the ranges that requirements allow."""
    described = {item.name: item for item in model.description.parameters}
    moved = {name for motion in model.description.motions for name in motion.parameters}
    events = model.library.layout["method"].get("events", {})
    modes = {mode["parameter"] for mode in events.get("modes", ())}
    requirements = Requirements(model.description, tuple(model.parameters))
    count = 0
    for index, name in enumerate(model.parameters):
        item = described.get(name)
        if index in modes or name in moved or item is None:
            continue
        if item.standard_normal:
            low, high = min(-3.0, p[index]), max(3.0, p[index])
        else:

            def allowed(value: float, index: int = index) -> bool:
                values = p.copy()
                values[index] = value
                try:
                    requirements.check(values)
                except EomgenError:
                    return False
                return True

            low, high = range_of(float(p[index]), item.unit, allowed)
        count += 1
        if high > low and count <= _MOST:
            yield _slider("parameter", index, name, item.unit, item.description, float(p[index]), low, high)


def range_of(value: float, unit: str, allowed: Callable[[float], bool]) -> tuple[float, float]:
    """Return the ends of the range of a parameter's slider around ``value``, the widest steps that ``allowed`` accepts.
    An end is ``value`` itself if none is allowed on this side."""
    if value == 0.0 or unit == "rad":
        low = next((value - by for by in _DISTANCES if allowed(value - by)), value)
        high = next((value + by for by in _DISTANCES if allowed(value + by)), value)
        return low, high
    ends = [sorted((value * first, value * second)) for first, second in _FACTORS]
    low = next((low for low, _ in ends if allowed(low)), value)
    high = next((high for _, high in ends if allowed(high)), value)
    return low, high


def _inputs(model: CompiledModel, solution: Solution, held: Mapping[str, float], extent: float) -> Iterator[Slider]:
    """Yield sliders for inputs, from minus to plus twice the largest value of the run; of formulas with the value None.
    Inputs that are zero in the run get a range by unit, from weight and ``extent`` of the machine."""
    layout = {item["name"]: item for item in model.library.layout["inputs"]}
    by_formula = {item.name for item in model.description.inputs if item.given}
    values, weight = model.description.values(dict(model.parameters)), 0.0
    for solid in model.description.drawing.solids:  # but for bodies whose mass has no value
        with contextlib.suppress(ArithmeticError, KeyError):
            weight += _GRAVITY * evaluate(solid.mass, lambda symbol: values[symbol.name])
    for index, name in enumerate(model.inputs[:_MOST]):
        reach = float(np.max(np.abs(solution.inputs[name]), initial=0.0))
        unit = layout[name]["unit"]
        if reach == 0.0:
            reach = {"N": 0.5 * weight, "N m": 0.25 * weight * extent, "m": 0.1 * extent}.get(unit, 0.5)
        reach = _round(2.0 * reach)
        formula = name in by_formula and name not in held
        value = float(held.get(name, 0.0))
        slider = _slider("input", index, name, unit, layout[name]["description"], value, -reach, reach)
        yield {**slider, "value": None} if formula else slider


def _starts(model: CompiledModel, solution: Solution, extent: float) -> Iterator[Slider]:
    """Yield sliders for initial positions and velocities of joints; coordinates of beams and absolute coordinates have
    none."""
    if model.description.joints:
        return
    nodes = {node for beam in model.description.exact_beams for node in beam}
    beams = {item["name"] for item in model.library.layout["axes"]}
    fall = math.sqrt(2.0 * _GRAVITY * extent)
    sizes = {"rad": 1.5, "m": 0.5 * extent, "rad/s": 6.0, "m/s": fall}
    velocities = list[dict[str, Any]]()
    for factor in model.factors:
        if factor.name in beams or factor.name in nodes or factor.name.partition(".")[0] in nodes:
            continue
        for k in range(factor.v_size):
            index = factor.v_start + k
            name = model.v_names[index].removeprefix("v.")
            v, unit = float(solution.v[0, index]), model.v_units[index]
            plain = factor.group == "R"
            of_place = model.q_units[factor.q_start + k] if plain else "rad" if k < 3 and factor.v_size > 1 else "m"
            value = float(solution.q[0, factor.q_start + k]) if plain else 0.0
            moved = f"{'turned' if of_place == 'rad' else 'moved'} {'xyz'[k % 3]}"
            shown = name if plain else f"{name.partition('[')[0]} {moved}"
            reach = sizes.get(of_place, 1.0)
            low, high = _limits(model, model.q_names[factor.q_start + k], value, reach) if plain else (-reach, reach)
            if high > low and len(velocities) < _MOST:
                q_index = factor.q_start + k if plain else None
                yield {**_slider("position", index, shown, of_place, "", value, low, high), "place": q_index}
            most = max(sizes.get(unit, 1.0), 2.0 * abs(v))
            speed = shown.replace(" turned ", " turning ").replace(" moved ", " moving ")
            velocities.append(_slider("velocity", index, speed, unit, "", v, -_round(most), _round(most)))
    yield from velocities[:_MOST]


def _limits(model: CompiledModel, coordinate: str, value: float, reach: float) -> tuple[float, float]:
    """Return the range of a coordinate: ``reach`` on both sides of ``value``, within stops, with ``value``."""
    low, high = value - reach, value + reach
    values = model.description.values(dict(model.parameters))
    for limit in model.description.limits:
        if limit.coordinate == coordinate:
            lower, upper = (
                math.nan if bound is None else evaluate(bound, lambda symbol: values[symbol.name])
                for bound in (limit.lower, limit.upper)
            )
            low, high = max(low, lower), min(high, upper)  # not a number: no bound
    return min(low, value), max(high, value)


def _states(model: CompiledModel, solution: Solution) -> Iterator[Slider]:
    """Yield sliders for continuous internal states; a scene with sampled states has none."""
    if model.library.layout["method"].get("samples"):
        return
    for index, item in enumerate(model.library.layout["states"][:_MOST]):
        value = float(solution.z[0, index])
        most = max(1.5 * abs(value), float(np.max(np.abs(solution.z[:, index]), initial=0.0))) or 1.0
        told = (item["name"], item["unit"], item["description"])
        yield _slider("state", index, *told, value, -_round(most), _round(most))


def _slider(
    kind: str, index: int, name: str, unit: str, description: str, value: float, low: float, high: float
) -> Slider:
    return {
        "kind": kind,
        "index": index,
        "name": name,
        "unit": "" if unit == "1" else unit,
        "description": description,
        "value": value,
        "low": min(low, value),
        "high": max(high, value),
    }


def _round(value: float) -> float:
    """Return a positive number rounded up to one or two digits."""
    power = 10.0 ** math.floor(math.log10(value))
    steps: Sequence[float] = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0)
    return float(power * next(step for step in steps if step * power >= value * (1.0 - 1e-9)))
