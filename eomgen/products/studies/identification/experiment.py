"""The model of one measured run: unknowns with start values and bounds, the simulated outputs at the measured times,
and derivatives in the unknowns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import close_names, shown
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.compiled.arguments import check_name, number_of
from eomgen.compiled.initial_state import InitialState
from eomgen.errors import Problem, UsageError
from eomgen.lie.product import tangent, update
from eomgen.products.derivatives.functionals import component
from eomgen.products.derivatives.linearise import newton_settings
from eomgen.products.studies.identification.estimation import ranges_of
from eomgen.products.studies.identification.measurements import Measurements
from eomgen.products.studies.identification.result import Record

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model


@dataclass(frozen=True)
class CubicInterpolation:
    """Values at n times from values at the ends of steps: a cubic through the four nearest ends, of order 4 in the
    step.

    Attributes
    ----------
    steps : number of steps of the run
    places : (n, 4) rows of the run
    weights : (n, 4)
    """

    steps: int
    places: Array
    weights: Array

    @classmethod
    def of(cls, t: Array, start: float, step: float) -> CubicInterpolation:
        """Return the interpolation at times t (n,), s, of a run from ``start`` with a fixed step, s. A time within 1e-6
        of a step from the end of a step counts as this end."""
        position = (t - start) / step
        near = np.rint(position)
        position = np.where(np.abs(position - near) < WRITTEN, near, position)
        steps = max(3, int(np.ceil(position[-1])))
        first = np.clip(np.floor(position).astype(int) - 1, 0, steps - 3)
        s = position - first
        nodes = np.arange(4.0)
        weights = np.empty((len(t), 4))
        for k in range(4):
            others = nodes[nodes != k]
            weights[:, k] = np.prod((s[:, np.newaxis] - others) / (k - others), axis=1)
        return cls(steps, first[:, np.newaxis] + np.arange(4), weights)

    def at(self, table: Array) -> Array:
        """Return values (n, ...) from a table of all rows (rows, ...)."""
        return np.asarray(np.einsum("nk,nk...->n...", self.weights, table[self.places]))


class Experiment:
    """The simulation of one measured run, with derivatives in unknown parameters and initial states; callable.

    Parameters
    ----------
    model, data : the model, and times with measured outputs and inputs
    parameters : names of unknown parameters
    states : unknown components of the initial state; without any, the start follows from parameters as in any run
    initial : the given initial values, if any, and the whole state that follows, with starts of unknown components
    step : s
    start : time at which the run begins, s; None for the first measured time
    options : of ``sensitivities``
    """

    def __init__(
        self,
        model: Model,
        data: Measurements,
        parameters: Sequence[str],
        states: Sequence[str],
        initial: tuple[Mapping[str, Any] | None, InitialState],
        step: float,
        start: float | None,
        options: Mapping[str, Any],
    ) -> None:
        """Check the measured data against the model and choose the unknown states. Raises UsageError."""
        self.model, self.data, self.states = model, data, tuple(states)
        self._start = float(data.t[0]) if start is None else start
        if data.t[0] < self._start - WRITTEN * step:
            fault = f"{data.name} begins at t = {data.t[0]:.9g} s, before the run at {self._start:.9g} s [E1055]"
            raise UsageError(Problem("t_start", fault, f"t_start = {data.t[0]:.9g}, or none"))
        self.step, (self._given, self._initial) = step, initial
        self._rows = CubicInterpolation.of(data.t, self._start, step)
        self._parameters = tuple(parameters)
        known = [*(f"q{name[1:]}" for name in model.v_names), *model.v_names, *model.z_names]
        for name in states:
            if name not in known:
                hint = " or ".join(close_names(str(name), known)) or f"one of {', '.join(known[:8])}"
                fault = f"there is no component {shown(name)} of the initial state [E1056]"
                raise UsageError(Problem("states", fault, hint))
        self._places = [known.index(name) for name in states]
        self._by = (*parameters, *self._directions(known))
        self._known = known
        self._labels = tuple(data.outputs)
        self.present = np.stack([np.isfinite(values) for values in data.outputs.values()])
        self._options = dict(options)
        self._options["inputs"] = {**(self._options.get("inputs") or {}), **self._interpolate_inputs()} or None
        method = self._options["method"] = options.get("method") or model.library.layout["built_method"]  # never auto
        tight = newton_settings(model, method)
        self._options["settings"] = {**tight, **(self._options.get("settings") or {})} or None

    @property
    def starts(self) -> Array:
        """Start values of the unknown states, (states,): the numbers of the initial state, and 0 for the rotations of a
        joint."""
        model, state = self.model, self._initial
        q = np.zeros(model.nv)
        for factor in model.factors:
            if factor.group == "R":
                q[factor.v] = state.q[factor.q]
        result: Array = np.concatenate([q, state.v, state.z])[self._places]
        return result

    @property
    def units(self) -> list[str]:
        """Units of the estimated components of the initial state, in the order of ``states``, without parameters."""
        model = self.model
        of_q = [unit.removesuffix("/s") for unit in model.v_units]
        every = [*of_q, *model.v_units, *model.z_units]
        return [every[position] for position in self._places]

    def __call__(self, parameters: Mapping[str, float], states: Array) -> tuple[Array, Array]:
        """Return outputs (outputs, n) at the measured times, and derivatives (outputs, n, parameters + states).

        `parameters` are values by name, `states` (states,) the values of unknown initial components.

        Raises
        ------
        EomgenError
            The run fails.
        """
        initial, of_states = self._initial_at(states)
        start = initial if self.states else self._given
        names = list(dict.fromkeys(label.partition("[")[0] for label in self._labels))
        derivatives = self.model.sensitivities(
            self._start + self._rows.steps * self.step,
            self.step,
            by=list(self._by),
            of=names,
            parameters=dict(parameters),
            initial=start,
            t_start=self._start,
            record_every=1,
            **self._options,
        )
        values = np.stack([component(derivatives.outputs, label) for label in self._labels])
        slopes = np.stack([component(derivatives.derivatives, label) for label in self._labels])
        if derivatives.by != self._by:
            slopes = slopes[..., [derivatives.by.index(name) for name in self._by]]
        if self.states:
            count = len(self._parameters)
            slopes = np.concatenate([slopes[..., :count], slopes[..., count:] @ of_states], axis=-1)
        at = self._rows.at
        return np.stack([at(value) for value in values]), np.stack([at(slope) for slope in slopes])

    def initial_state(self, parameters: Mapping[str, float], states: Array) -> dict[str, Array]:
        """Return ``q``, ``v`` and ``z`` (if any) at the start of the run for values of the unknowns. Without unknown
        states the initial state is taken from a simulation."""
        if self.states:
            return self._initial_at(states)[0]
        end, start = self._start + self._rows.steps * self.step, self._start
        run = self.model.simulate(
            end,
            self.step,
            initial=self._given,
            parameters=dict(parameters),
            t_start=start,
            error_estimate=False,
            **self._options,
        )
        return {name: getattr(run, name)[0] for name in ("q", "v", *("z" for _ in range(bool(self.model.nz))))}

    def _initial_at(self, states: Array) -> tuple[dict[str, Array], Array]:
        """Return the initial state (``q``, ``v``, ``z``) at values of the unknown components, and its derivatives.
        Derivatives (directions, states) are by the unknown components, for the directions of ``sensitivities``."""
        model, nv = self.model, self.model.nv
        whole = np.zeros(2 * nv + model.nz)
        whole[self._places] = np.asarray(states) - self.starts
        theta = whole[:nv]
        q = update(model.factors, self._initial.q, theta)
        initial = {"q": q, "v": self._initial.v + whole[nv : 2 * nv]}
        if model.nz:
            initial["z"] = self._initial.z + whole[2 * nv :]
        turned = np.eye(len(whole))
        turned[:nv, :nv] = tangent(model.factors, theta)
        rows = [self._known.index(name) for name in self._by[len(self._parameters) :]]
        return initial, turned[np.ix_(rows, self._places)]

    def _directions(self, known: Sequence[str]) -> list[str]:
        """Return the names of the initial components in which derivatives are needed: the unknown ones, and all
        components of a joint that rotates if one of them is unknown."""
        places = set(self._places)
        for factor in self.model.factors:
            components = range(factor.v_start, factor.v_start + factor.v_size)
            if factor.group != "R" and places & set(components):
                places |= set(components)
        return [known[position] for position in sorted(places)]

    def _interpolate_inputs(self) -> dict[str, Array]:
        """Return measured inputs by name on the grid of the steps, linear between samples, and constant before the
        first and after the last sample.
        """
        times = self._start + self.step * np.arange(self._rows.steps + 1)
        return {name: np.interp(times, self.data.t, values) for name, values in self.data.inputs.items()}


@dataclass(frozen=True)
class ExperimentUnknowns:
    """Unknowns of several measured runs in one vector: parameters, then the initial states of each run.

    Attributes
    ----------
    parameters, states : names of unknowns
    experiments : the runs
    held : values that the user gives to parameters, among them start values of unknown ones; other parameters have, or
        start with, the values of the model
    """

    model: Model
    parameters: tuple[str, ...]
    states: tuple[str, ...]
    experiments: Sequence[Experiment]
    held: Mapping[str, float]

    @property
    def names(self) -> list[str]:
        several = len(self.experiments) > 1
        return [
            *self.parameters,
            *(
                f"{name} of {experiment.data.name}" if several else name
                for experiment in self.experiments
                for name in self.states
            ),
        ]

    @property
    def units(self) -> list[str]:
        known = {item.name: item.unit for item in self.model.description.parameters}
        return [known.get(name, "") for name in self.parameters] + [
            u for experiment in self.experiments for u in experiment.units
        ]

    @property
    def start(self) -> Array:
        values = {**self.model.parameters, **self.held}
        return np.concatenate(
            [
                np.array([float(values[name]) for name in self.parameters]),
                *(experiment.starts for experiment in self.experiments),
            ]
        )

    @property
    def labels(self) -> list[str]:
        """Measured columns of all runs."""
        return list(dict.fromkeys(label for experiment in self.experiments for label in experiment.data.outputs))

    @property
    def data(self) -> Array:
        """(rows,) measured values, run by run and column by column."""
        parts = [
            np.stack(list(experiment.data.outputs.values()))[experiment.present] for experiment in self.experiments
        ]
        return np.concatenate(parts)

    @property
    def columns(self) -> Array:
        """(rows,) places of columns among ``labels``."""
        labels = self.labels
        return np.concatenate(
            [
                np.full(int(np.count_nonzero(row)), labels.index(label))
                for experiment in self.experiments
                for label, row in zip(experiment.data.outputs, experiment.present, strict=True)
            ]
        )

    @property
    def column_units(self) -> dict[str, str]:
        """Units of the measured columns."""
        units = {item.name: item.unit for item in self.model.description.outputs}
        return {label: units.get(label.partition("[")[0], "") for label in self.labels}

    def records(self, x: Array, values: Array) -> tuple[Record, ...]:
        """Return the data of each run with the model's values (rows,) at the unknowns x (n,)."""
        records, first = [], 0
        for number, experiment in enumerate(self.experiments):
            model, data = np.full(experiment.present.shape, np.nan), experiment.data
            count = int(np.count_nonzero(experiment.present))
            model[experiment.present] = values[first : first + count]
            first += count
            start = experiment.initial_state(self.values_of(x), self.states_of(x, number))
            by_name = dict(zip(data.outputs, model, strict=True))
            records.append(Record(data.name, data.t, dict(data.outputs), by_name, start))
        return tuple(records)

    def states_of(self, x: Array, number: int) -> Array:
        count = len(self.states)
        first = len(self.parameters) + number * count
        return x[first : first + count]

    def values_of(self, x: Array) -> dict[str, float]:
        return {**self.held, **dict(zip(self.parameters, x.tolist(), strict=False))}

    def predict(self, x: Array) -> tuple[Array, Array]:
        """Return the model's values (rows,) and derivatives (rows, n) at the unknowns x (n,), for all rows with
        measurements."""
        count, parts, slopes = len(self.parameters), [], []
        for number, experiment in enumerate(self.experiments):
            values, derivatives = experiment(self.values_of(x), self.states_of(x, number))
            block = np.zeros((*values.shape, len(x)))
            first = count + number * len(self.states)
            block[..., :count] = derivatives[..., :count]
            block[..., first : first + len(self.states)] = derivatives[..., count:]
            parts.append(values[experiment.present])
            slopes.append(block[experiment.present])
        return np.concatenate(parts), np.concatenate(slopes)


def bounds_of(unknowns: ExperimentUnknowns, bounds: Mapping[str, tuple[float, float]] | None) -> tuple[Array, Array]:
    """Return the lower and the upper bounds (n,) of the unknowns, infinite by default. `bounds` are pairs by name; a
    name of a state stands for all runs. Raises UsageError for an unknown name, unsuitable pairs, and a start value
    outside."""
    names, x = unknowns.names, unknowns.start
    low, high = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    if bounds is not None and not isinstance(bounds, Mapping):
        fault = f"bounds by name are needed, not {shown(bounds)} [E1057]"
        raise UsageError(Problem("bounds", fault, f'bounds={{"{names[0]}": (0.1, 10.0)}}'))
    for name, limits in (bounds or {}).items():
        places = [k for k, known in enumerate(names) if name == known or known.startswith(f"{name} of ")]
        if not places:
            check_name("unknown", name, names)
        try:
            first, last = (float(bound) for bound in limits)
            if math.isnan(first) or math.isnan(last):
                raise ValueError
        except (TypeError, ValueError):
            fault = f"{limits!r} are not two numbers [E1061]"
            hint = "(0.1, 10.0), with -inf or inf for an open end (--bounds NAME=0.1:)"
            raise UsageError(Problem(f"bounds of {name}", fault, hint)) from None
        if not first < last:
            fault = f"{first:.6g} is not below {last:.6g} [E1059]"
            hint = f"({last:.6g}, {first:.6g}), or without it among the unknowns, for a value that is held"
            raise UsageError(Problem(f"bounds of {name}", fault, hint))
        for k in places:
            if not first <= x[k] <= last:
                fault = f"the search starts at {x[k]:.6g}, outside {first:.6g} to {last:.6g} [E1060]"
                hint = "another start within them, by values= (--set) or initial= (--initial)"
                raise UsageError(Problem(f"bounds of {name}", fault, hint))
            low[k], high[k] = first, last
    return low, high


def deviations_of(labels: Sequence[str], deviations: Mapping[str, float] | float | None) -> Array | None:
    """Return the standard deviations (columns,) of the measured columns; None if they are to be estimated. `deviations`
    is a number for all, or numbers by the name of a column or of an output. Raises UsageError for an unknown name, a
    missing column or a number that is not positive."""
    if deviations is None:
        return None
    if not isinstance(deviations, Mapping):
        deviations = dict.fromkeys(
            labels, number_of("deviations", deviations, "number, or one for each column by name,")
        )
    every = {label: deviations.get(label, deviations.get(label.partition("[")[0])) for label in labels}
    for name in deviations:
        if name not in labels and not any(label.partition("[")[0] == name for label in labels):
            check_name("measured column", name, labels)
    absent = [label for label, value in every.items() if value is None]
    if absent:
        fault = f"the deviation of {', '.join(absent)} is missing [E1062]"
        raise UsageError(Problem("deviations", fault, "deviations of all columns, or of none: then they are estimated"))
    kind = "number"
    result = np.array([number_of(f"deviations of {label}", value, kind) for label, value in every.items()])
    if not (np.isfinite(result).all() and (result > 0.0).all()):
        fault = "standard deviations are positive numbers [E1063]"
        raise UsageError(Problem("deviations", fault, f'deviations={{"{labels[0]}": 0.01}}'))
    return result


def check_effect(
    unknowns: ExperimentUnknowns, predict: Callable[[Array], tuple[Array, Array] | None], x: Array, sigma: Array | None
) -> None:
    """Raise UsageError for an unknown without effect on the measurements at the start of the search."""
    first = predict(x)
    if first is None:
        return  # the search says why
    columns = unknowns.columns
    weights = (ranges_of(unknowns.data, columns) if sigma is None else sigma)[columns]
    effect = np.linalg.norm(first[1] / weights[:, np.newaxis], axis=0) * np.where(x != 0.0, np.abs(x), 1.0)
    lost = [name for name, size in zip(unknowns.names, effect, strict=True) if size < COMPUTED * np.sqrt(len(columns))]
    if lost:
        fault = f"no measurement depends on {', '.join(lost)} at the initial guess [E1064]"
        raise UsageError(Problem("parameters", fault, "other outputs, other start values, or without them"))
