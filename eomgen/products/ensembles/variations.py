"""Variations of samples, by name: parameters, inputs and their laws, initial states; and the options of their runs.

Laws of inputs that samples differ in without another compiled model: seeds of random roads, and factors.

A law that differs from the scene's is handed to a run as a function of time, as a caller would hand in his own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.base.messages import nearest, shown
from eomgen.base.random_inputs import WAVES, road_harmonics, standard_normals
from eomgen.compiled.arguments import check_finite, numbers
from eomgen.compiled.initial_state import initial_state
from eomgen.compiled.model import CompiledModel
from eomgen.errors import Problem, UsageError
from eomgen.formula.units.labels import several_turns
from eomgen.formula.units.parser import is_quantity
from eomgen.products.ensembles.distributions import Distribution, read_distribution, read_number
from eomgen.simulation.option_types import LawOverTime
from eomgen.simulation.stepping.inputs import signals_by_name
from eomgen.system.signals import Input

#: Properties of a law that may vary: the seed of a random road or process, a factor of the whole law.
LAWS = ("seed", "scale")


def laws_that_vary(model: CompiledModel) -> list[str]:
    """Return the names ``seed.road`` and ``scale.road`` for inputs with such laws."""
    inputs = model.description.inputs
    seeds = [f"seed.{item.name}" for item in inputs if item.road or (item.series and item.series.own_variables)]
    seeds += [f"seed.{waves.name}" for waves in _waves(model) if waves.variables]
    return [*seeds, *(f"scale.{item.name}" for item in inputs if item.given)]


def law_of(model: CompiledModel, name: str, where: str) -> int:
    """Return the index of the input that ``seed.NAME`` or ``scale.NAME`` varies; waves are counted after all inputs.
    Raises UsageError if there is no such law, or if no seed or factor can vary the law.

    Parameters
    ----------
    name : ``seed.NAME`` or ``scale.NAME``
    """
    kind, _, of = name.partition(".")
    inputs, waves = model.description.inputs, {item.name: item for item in _waves(model)}
    index = {item.name: k for k, item in enumerate(inputs)}.get(of)
    if index is None and kind == "seed" and of in waves and waves[of].variables:
        return len(inputs) + list(waves).index(of)
    if index is None:
        raise UsageError(Problem(f"{where} {name}", *_fault_without_input(model, kind, of)))
    item, fault, hint = inputs[index], "", _others(model, kind)
    if kind == "seed" and item.series is not None and item.series.follows:
        fault = f"the random process {of} follows {item.series.follows}, and has its variables [E0690]"
        hint = f"seed.{item.series.follows}"
    elif kind == "seed" and item.road is None and item.series is None:
        fault = f"the input {of} is neither a random road nor a random process, so it has no seed [E0691]"
    elif not item.given:
        fault = f"the scene gives the input {of} no law that could be multiplied [E0692]"
        hint = f"{of}, a value that is constant over a run"
    if fault:
        raise UsageError(Problem(f"{where} {name}", fault, hint))
    return index


def _fault_without_input(model: CompiledModel, kind: str, of: str) -> tuple[str, str]:
    """Return the fault of ``seed.NAME`` or ``scale.NAME`` without an input of this name, and a remedy."""
    if of in [curve.name for curve in getattr(model.scene, "curves", ())]:
        hint = f"a tunable parameter as factor in formulas, factor * {of}(...)"
        if kind == "seed":
            hint = f"a random road as an input, [inputs.{of}] road = {{ class = ..., speed = ... }}"
        return f"{of} is a curve, whose numbers are fixed in the code [E0688]", hint
    if of not in [waves.name for waves in _waves(model)]:
        return f"there is no input {shown(of)} [E0432]", _others(model, kind)
    if kind == "seed":
        return f"{of} are waves, whose numbers are fixed in the code [E0689]", f"variables = true in [waves.{of}]"
    hint = f'height = "height" in the spectrum of [waves.{of}], a tunable parameter, which varies'
    return f"{of} are waves, which are as high as their spectrum says [E0693]", hint


def variables_of_seed(model: CompiledModel, index: int, seed: float) -> dict[str, float]:
    """Return the values of parameters that a seed draws for the random process or the waves at an index of ``law_of``,
    by name. Empty for a road, which has no parameters."""
    inputs, stream = model.description.inputs, WAVES
    names: Sequence[str] = ()
    if index >= len(inputs):
        names = _waves(model)[index - len(inputs)].variables
    elif (process := inputs[index].series) is not None:
        names, stream = process.own_variables, process.name
    return dict(zip(names, standard_normals(int(seed), len(names), stream).tolist(), strict=True))


def _waves(model: CompiledModel) -> tuple[Any, ...]:
    """Return the waves of a model's scene, each with name and variables."""
    return model.description.parts.get("waves", ())


def _others(model: CompiledModel, kind: str) -> str:
    """Return the laws that can vary in this way, as a hint."""
    every = [name for name in laws_that_vary(model) if name.startswith(f"{kind}.")]
    return " or ".join(every[:4])


def check_seeds(name: str, how: Distribution) -> None:
    """Raise UsageError if a distribution of the seeds `name` has other values than whole numbers from 0 on."""
    values = np.array(how.levels) if how.levels else how.quantiles(np.zeros(1))
    if not how.whole or np.min(values) < 0.0:
        fault = f"a seed is a whole number from 0 on, and {how.text} has others [E0694]"
        raise UsageError(Problem(f"vary {name}", fault, f"{name}=integers(0, 999999), or values(1, 2, 3)"))


def check_tracks(model: CompiledModel, seeds: Mapping[str, int]) -> None:
    """Raise UsageError if two seeds, by name with the indices of their inputs, belong to wheels in the same track. A
    track is a class of road with a seed in the scene, and all its wheels follow one seed."""
    of_track: dict[tuple[str, int], str] = {}
    for name, index in seeds.items():
        if model.description.inputs[index].series is not None:
            continue
        track = _track(model.description.inputs[index])
        if (first_name := of_track.setdefault(track, name)) != name:
            fault = f"its wheel runs in the same track as the wheel of {first_name}, and has the same seed [E0695]"
            raise UsageError(Problem(f"vary {name}", fault, f"{first_name}, which all wheels of the track follow"))


def laws_of(
    model: CompiledModel, p: Array, seeds: Mapping[str, float], factors: Mapping[str, float]
) -> dict[str, LawOverTime]:
    """Return by input the laws over time that differ from the scene's by seeds of roads or by factors.

    All wheels of a track have the seed of the track.

    Parameters
    ----------
    p : (np,) ndarray
        Parameters, for formulas of the scene.
    seeds, factors : mapping from str to float
        Seeds of roads and factors of inputs, by the names of varied quantities.
    """
    inputs = model.description.inputs
    by_name = {item.name: item for item in inputs}
    of_track = {_track(by_name[name.partition(".")[2]]): int(seed) for name, seed in seeds.items()}
    of_input = {name.partition(".")[2]: factor for name, factor in factors.items()}
    result = {}
    for index, item in enumerate(inputs):
        seed = None if item.road is None else of_track.get(_track(item))
        if seed is not None or item.name in of_input:
            result[item.name] = _law(model, p, index, seed, of_input.get(item.name, 1.0))
    return result


def _track(item: Input) -> tuple[str, int]:
    if item.road is None:
        fault = "it is not a random road [E0696]"
        raise UsageError(Problem(f"input {item.name}", fault, "an input with a road of a class"))
    return item.road.road_class, item.road.seed


def _law(model: CompiledModel, p: Array, index: int, seed: int | None, factor: float) -> LawOverTime:
    item = model.description.inputs[index]
    if seed is None or item.road is None:
        return LawOverTime(lambda t: factor * _own(model, t, p, index))
    road = item.road
    waves = np.array(
        road_harmonics(road.road_class, road.speed, seed=seed, offset=road.offset, harmonics=len(item.harmonics))
    )
    if item.formula is None:
        return LawOverTime(lambda t: factor * _sum(waves, t))
    before = np.array(item.harmonics)
    return LawOverTime(lambda t: factor * (_own(model, t, p, index) - _sum(before, t) + _sum(waves, t)))


def _own(model: CompiledModel, t: Array, p: Array, index: int) -> Array:
    return np.asarray(model.input_values(t, parameters=p)[:, index])


def _sum(waves: Array, t: Array) -> Array:
    """Return the sum of harmonics (n,) at times t (n,) s; `waves` has rows of amplitude, frequency in rad/s and phase.
    Summed row by row, so that the bits do not depend on the number of rows, and for 64 times together, so that arrays
    stay in the processor's cache."""
    amplitude, frequency, phase = waves.T
    parts = (t[first : first + 64, np.newaxis] for first in range(0, len(t), 64))
    return np.concatenate([(np.cos(part * frequency + phase) * amplitude).sum(axis=1) for part in parts])


@dataclass(frozen=True)
class Variation:
    """A number that samples differ in.

    Attributes
    ----------
    name : as given by the caller
    block : ``parameters``, ``inputs``, ``seed`` or ``scale`` of the law of an input, ``process`` for the seed of a
        random process or of waves, whose variables are parameters, or ``q``, ``v``, ``z`` of the initial state
    place : component of an initial state, index of the input of a law, else 0
    unit : of the number
    """

    name: str
    block: str
    place: int
    unit: str


def find_variation(model: CompiledModel, name: str, where: str = "vary") -> Variation:
    """Return the quantity of a name: a tunable parameter, an input, ``seed.road`` and ``scale.road`` of the law that an
    input has in the scene, ``q.hinge``, ``v.hinge``, an internal state.

    ``where`` is the argument or option with the name, for messages.

    Raises
    ------
    UsageError
        For any other name, and for components of quaternions.
    """
    units = model.evaluator.parameter_units
    if name in model.parameters:
        return Variation(name, "parameters", 0, units.get(name, ""))
    if name in model.inputs:
        return Variation(name, "inputs", 0, model.input_units.get(name, ""))
    of_states = {
        **{label: ("q", k, model.q_units[k]) for k, label in enumerate(model.q_names)},
        **{label: ("v", k, model.v_units[k]) for k, label in enumerate(model.v_names)},
        **{label: ("z", k, model.z_units[k]) for k, label in enumerate(model.states)},
    }
    if name in of_states:
        block, index, unit = of_states[name]
        if block == "q" and unit == "1":
            fault = f"{name} is a component of a unit quaternion, and its parts are not free [E0698]"
            raise UsageError(Problem(f"{where} {name}", fault, "initial=... of all samples, or a joint with an angle"))
        return Variation(name, block, index, unit)
    kind, _, of = name.partition(".")
    if kind in LAWS and of:
        index, inputs = law_of(model, name, where), model.description.inputs
        drawn = index >= len(inputs) or inputs[index].series is not None  # random variables, which are parameters
        return Variation(name, "process" if kind == "seed" and drawn else kind, index, "")
    if name in model.evaluator.fixed_parameters:
        hint = f"{name} = {{ value = ..., tunable = true }} in the scene's [parameters]"
        raise UsageError(Problem(f"{where} {name}", f"the parameter {name} is fixed in the code [E0699]", hint))
    every = [*model.parameters, *model.inputs, *of_states, *laws_that_vary(model)]
    fault = f"there is no parameter, input or initial state {shown(name)} [E0697]"
    none = "NAME = { value = ..., tunable = true } in the scene's [parameters]: nothing of this scene varies yet"
    raise UsageError(Problem(where, fault, nearest(name, every) or none))


def read_varied(
    model: CompiledModel, vary: Mapping[str, str | Distribution]
) -> tuple[list[Variation], list[Distribution]]:
    """Return the varied quantities and their distributions, in the order of a mapping from names to distributions or
    texts. Raises UsageError for unknown names, wrong distributions, wrong seeds, and two seeds of one track."""
    if not isinstance(vary, Mapping):
        fault = f"a mapping from names to distributions is needed, not {type(vary).__name__} [E0700]"
        raise UsageError(Problem("vary", fault, 'vary={"mass": "normal(1, 0.1)"}'))
    result = [find_variation(model, str(name)) for name in vary]
    distributions = []
    for item, how in zip(result, vary.values(), strict=True):
        if isinstance(how, Distribution):
            distributions.append(how)
        elif isinstance(how, str):
            distributions.append(read_distribution(f"vary {item.name}", how, item.unit))
        else:
            fault = f"a distribution is needed, not {type(how).__name__} [E0701]"
            hint = f'"normal(1, 0.1)"; values of each sample: table={{{item.name!r}: [...]}}'
            raise UsageError(Problem(f"vary {item.name}", fault, hint))
        if item.block in ("seed", "process"):
            check_seeds(item.name, distributions[-1])
    check_tracks(model, {item.name: item.place for item in result if item.block == "seed"})
    return result, distributions


def starts_of_several_turns(items: Sequence[Variation], vary: Mapping[str, str | Distribution] | None) -> list[str]:
    """Return a note on each initial angle that a text of plain numbers puts at more than a turn.

    Tails beyond the middle nine tenths of a distribution have no note.
    """
    notes = []
    for item in items:
        text = (vary or {}).get(item.name)
        if item.block != "q" or item.unit != "rad" or not isinstance(text, str):
            continue
        arguments = text.partition("(")[2].rstrip(" )").split(",")
        if any(is_quantity(word.strip()) for word in arguments):
            continue
        ends = read_distribution(f"vary {item.name}", text, item.unit).quantiles(np.array([0.05, 0.95]))
        farthest = float(ends[np.argmax(np.abs(ends))])
        notes.append(several_turns(f"vary {item.name} = {text}: samples start at up to", farthest))
    return list(filter(None, notes))


def read_table(model: CompiledModel, table: Mapping[str, ArrayLike]) -> tuple[list[Variation], Array]:
    """Return the varied quantities and values, (samples, columns), of a mapping or a DataFrame of columns.

    Values are numbers in the scene's units, or texts with units, ``20 g``.

    Raises
    ------
    UsageError
        For columns of different lengths, values that are not finite, and names as of ``find_variation``.
    """
    if not hasattr(table, "keys"):
        fault = f"a mapping from names to columns, or a DataFrame, is needed, not {type(table).__name__} [E0702]"
        raise UsageError(Problem("table", fault, 'table={"mass": [1.0, 1.1, 1.2]}'))
    names = [str(name) for name in table.keys()]  # noqa: SIM118  # a DataFrame iterates over its columns by keys() only
    result = [find_variation(model, name, "table") for name in names]
    columns = [_column(item, table[item.name]) for item in result]
    if not columns or columns[0].ndim != 1 or not len(columns[0]):
        fault = "it has no rows [E0704]"
        raise UsageError(Problem("table", fault, "a column of numbers for each name, a row for each sample"))
    for name, column in zip(names, columns, strict=True):
        if column.shape != columns[0].shape:
            fault = f"{name} has {column.size} values, {names[0]} has {columns[0].size} [E0703]"
            raise UsageError(Problem("table", fault, "as many values in each column"))
        check_finite(f"table {name}", column)
    for item, column in zip(result, columns, strict=True):
        if item.block in ("seed", "process"):
            whole = bool(np.all(column == np.floor(column)))
            check_seeds(item.name, Distribution("the column", np.copy, tuple(column.tolist()), whole))
    check_tracks(model, {item.name: item.place for item in result if item.block == "seed"})
    return result, np.stack(columns, axis=-1)


def _column(item: Variation, values: ArrayLike) -> Array:
    """Return a column of a table, (samples,), in the unit of the varied quantity; texts may have units. Raises
    UsageError."""
    where, array = f"table {item.name}", np.asarray(values)
    if array.ndim == 1 and array.dtype.kind in "OU" and any(isinstance(value, str) for value in array):
        return np.array([read_number(f"{where}[{k}]", str(array[k]), item.unit, "1.5") for k in range(len(array))])
    return numbers(where, array)


def with_scenes_laws(model: CompiledModel, items: Sequence[Variation], common: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the options with the scene's laws of inputs as functions, for inputs whose seed or factor varies.

    Runs without variations then take the same inputs as samples; the options themselves are returned if no law varies.

    Raises
    ------
    UsageError
        An input whose law varies is also given, or also varies; anything but a mapping as inputs.
    """
    inputs = signals_by_name(common.get("inputs"), model.inputs)
    input_names = {*inputs, *(item.name for item in items if item.block == "inputs")}
    for item in items:
        of = item.name.partition(".")[2]
        if item.block in LAWS and of in input_names:
            fault = f"the input {of} is given or varies itself, so the scene's law of it does not count [E0705]"
            raise UsageError(Problem(f"vary {item.name}", fault, f"either {item.name} or {of}"))
    names = {block: [item for item in items if item.block == block] for block in LAWS}
    seeds = {item.name: float(_track(model.description.inputs[item.place])[1]) for item in names["seed"]}
    factors = {item.name: 1.0 for item in names["scale"]}
    if not seeds and not factors:
        return common
    laws = laws_of(model, model.parameter_array(common.get("parameters")), seeds, factors)
    return {**common, "inputs": {**laws, **inputs}}


@dataclass(frozen=True)
class VariedOptions:
    """Options of ``simulate`` for samples: common options, and varied options.

    Attributes
    ----------
    common : of all samples
    rest : options of the start at equilibrium, with the state from which samples look for theirs; empty for other
        starts
    """

    model: CompiledModel
    items: Sequence[Variation]
    common: Mapping[str, Any]
    rest: Mapping[str, Any] = field(default_factory=dict)

    def of(self, values: Array) -> dict[str, Any]:
        """Return the options of ``simulate`` for the sample with values (d,) of the varied quantities, in the order of
        items. Includes parameters, inputs, laws of inputs and the initial state that differ from the common options."""
        by_block: dict[str, dict[str, float]] = {}
        for item, value in zip(self.items, values.tolist(), strict=True):
            by_block.setdefault(item.block, {})[item.name] = value
        for item in self.items:
            if item.block == "process":
                drawn = variables_of_seed(self.model, item.place, by_block[item.block][item.name])
                by_block.setdefault("parameters", {}).update(drawn)
        options = {**self.common, **self.rest}
        for block in ("parameters", "inputs"):
            if block in by_block:
                options[block] = {**self._common_values(block), **by_block[block]}
        if laws := self.laws(values, lambda: self.model.parameter_array(options.get("parameters"))):
            options["inputs"] = {**laws, **(options.get("inputs") or {})}
        if any(block in by_block for block in ("q", "v", "z")):
            p = self.model.parameter_array(options.get("parameters"))
            state = initial_state(self.model, options.get("initial"), p, asked=True)
            parts = {"q": state.q, "v": state.v, "z": state.z}
            for item, value in self.columns(values, *parts):
                parts[item.block][item.place] = value
            options["initial"] = {name: part for name, part in parts.items() if name != "z" or self.model.nz}
        return options

    def columns(self, values: Array, *blocks: str) -> list[tuple[Variation, Any]]:
        """Return varied quantities of some blocks with their values, of a sample (d,) or of several (samples, d)."""
        return [(item, column) for item, column in zip(self.items, values.T, strict=True) if item.block in blocks]

    def laws(self, values: Array, parameters: Callable[[], Array]) -> dict[str, LawOverTime]:
        """Return the laws of inputs that differ from the common laws in a sample with the values (d,) and parameters
        (np,)."""
        seeds, factors = ({item.name: float(x) for item, x in self.columns(values, block)} for block in LAWS)
        return laws_of(self.model, parameters(), seeds, factors) if seeds or factors else {}

    def _common_values(self, block: str) -> Mapping[str, Any]:
        values = self.common.get(block)
        if values is None:
            return {}
        if isinstance(values, Mapping):
            return values
        return dict(zip(self.model.parameters, np.asarray(values).tolist(), strict=True))
