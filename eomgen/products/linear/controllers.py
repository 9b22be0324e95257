"""The way back from a design to a scene: a regulator or output feedback as controllers and states of its nested data.

Inputs that a caller would drive become controllers (or sampled states) of the same names, so that the rest of the
scene changes. Gains of a state are tunable parameters, as of every state feedback.
"""

from __future__ import annotations

import json
import math
import os
import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import NAME_LENGTH, counted, nearest, shown
from eomgen.base.rounding import COMPUTED
from eomgen.compiled.arguments import number_of
from eomgen.errors import Problem, UsageError
from eomgen.formula.units.labels import in_label
from eomgen.products.linear.control.output_feedback import OutputFeedback
from eomgen.products.linear.control.regulator import Regulator
from eomgen.products.linear.eigenvalues import EPSILON, balance
from eomgen.products.linear.state_space import StateSpace
from eomgen.scene.load import data_of

Sections = dict[str, dict[str, Any]]
#: A number in the unit of a signal, or a text with a unit.
Amount = float | str
#: Lower and upper limit of a signal; None for no limit.
Limits = Sequence[Amount | None]
#: Sections whose entries are called by bare names in formulas.
_NAMES = ("parameters", "inputs", "random", "states", "controllers", "curves")
#: Quantities that formulas of controllers cannot use.
_OF_ACCELERATIONS = re.compile(r"\b(?:a|acceleration|reaction|drive_effort)\.")
#: Kinds of outputs whose values formulas call by name.
_QUANTITIES = ("position", "velocity")


@checked_call('a scene and a law, eomgen.with_controller("scene.toml", law)')
def with_controller(
    scene: str | os.PathLike[str] | Mapping[str, Any],
    law: Regulator | OutputFeedback,
    *,
    prefix: str = "estimate",
    limits: Mapping[str, Limits] | None = None,
    quantum: Mapping[str, Amount] | None = None,
    delay: Mapping[str, Amount] | None = None,
) -> dict[str, Any]:
    """Return nested data of a scene with inputs driven by a controller that was designed for the scene.

    ``limits``, ``quantum`` and ``delay`` describe the hardware: actuators by the names of inputs, sensors by the names
    of measured signals (outputs of the linear model; without an observer, its states with gains). Commands and readings
    are limited first, then rounded, then delayed. An observer predicts with the command as limited and rounded.
    Warns of each delay of a sensor, which the design did not know.

    Parameters
    ----------
    scene : path, or mapping like a scene file
        Source of the linear model.
    law : Regulator or OutputFeedback
        In continuous time controllers of type ``state_feedback``, with states for the estimates; sampled controllers
        are sampled states.
    prefix : str
        Before the names of estimates, ``estimate_STATE`` by default.
    limits : mapping, name -> (lower, upper)
        In the unit of the input or signal, or texts with a unit, ``("-2 kN", "2 kN")``; None for no limit. They bound
        the signal itself, the value at the reference of the linear model included.
    quantum : mapping, name -> float or text
        Signals are rounded to whole multiples of it, in the same units, and limits are drawn in to the nearest
        multiples. Sampled laws only.
    delay : mapping, name -> float or text
        S, or a text with a unit. Of an actuator from the sample to the effect of the command, in place of the delay of
        the design; of a sensor from the sample to when its reading can be used. Sampled laws only; whole samples are
        not required, and a reading that arrives between two samples is used at the later one.

    Returns
    -------
    dict
        For ``eomgen.build``, ``eomgen.load`` or ``toml_text``; neither checked nor written to a file. The driven inputs
        are now controllers or states of the same names. Files that the scene names are looked for from the current
        folder. Readings of sensors with a quantum or a delay are states ``sensor_NAME``, commands that take effect with
        a delay ``NAME_asked``.

    Raises
    ------
    UsageError
        A model or a Scene in place of the scene's data; inputs that are not the scene's own, feedback of states
        without names in the scene (shaping filters, coordinates of absolute bodies), measured signals that formulas
        cannot use (accelerations), names that are taken. Limits, quanta or delays of names that are neither inputs
        nor measured; a quantum that is not positive, a negative delay, limits that do not increase or are without the
        value at the reference, or have fewer than two multiples of the quantum between them; a quantum or a delay in
        continuous time.
    FileError, DescriptionError
        A scene file that cannot be read.

    Examples
    --------
    >>> import eomgen
    >>> from eomgen.control import lqr
    >>> cart = {
    ...     "format": 1,
    ...     "name": "cart",
    ...     "inputs": {"push": {"unit": "N"}},
    ...     "bodies": {"cart": {"mass": 2.0}},
    ...     "joints": {"rail": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0]}},
    ...     "efforts": {"motor": {"joint": "rail", "effort": "push"}},
    ... }
    >>> plant = eomgen.build(cart, profile="quick").linearize(at="initial").state_space()
    >>> law = lqr(plant, {"rail": 400.0}, {"push": 0.1}, sample="10 ms")
    >>> closed = eomgen.with_controller(
    ...     cart, law, limits={"push": (-5.0, 5.0)}, quantum={"push": 0.02, "rail": "0.1 mm"}, delay={"push": "2 ms"}
    ... )
    >>> list(closed["states"])
    ['sensor_rail', 'push_asked', 'push']
    >>> closed["states"]["sensor_rail"]["quantum"]
    0.0001
    """
    if not isinstance(scene, str | os.PathLike | Mapping):
        fault = f"the path of a scene file, or its nested data, is needed, not {type(scene).__name__} [E0523]"
        hint = 'with_controller("scene.toml", law), with the file that the model was built from'
        raise UsageError(Problem("with_controller", fault, hint))
    if not isinstance(law, Regulator | OutputFeedback):
        fault = f"a Regulator or an OutputFeedback is needed, not {type(law).__name__} [E0524]"
        raise UsageError(Problem("with_controller", fault, "the result of lqr, place or output_feedback"))
    data = dict(scene) if isinstance(scene, Mapping) else data_of(Path(scene))
    law = _without_rounding(law)
    hardware = _hardware(law, {"limits": limits or {}, "quantum": quantum or {}, "delay": delay or {}})
    writer = _Writer(data, law.space, prefix, hardware)
    added = writer.regulator(law) if isinstance(law, Regulator) else writer.output_feedback(law)
    inputs = {name: entry for name, entry in data.get("inputs", {}).items() if name not in law.space.inputs}
    result = {key: value for key, value in data.items() if key != "inputs"} | ({"inputs": inputs} if inputs else {})
    taken = {name for section in _NAMES for name in result.get(section, {})}
    for section, entries in added.items():
        for name in entries:
            if name in taken:
                fault = f"the scene has the name {name} already [E0525]"
                raise UsageError(Problem("with_controller", fault, "another prefix"))
        result[section] = {**result.get(section, {}), **entries}
    return result


def _without_rounding(law: Regulator | OutputFeedback) -> Regulator | OutputFeedback:
    """Return a law whose gains below rounding are exactly zero. Solutions of Riccati's equation and of placements have
    errors of the size of rounding of their largest entries, so states that a law does not need get gains of 1e-13, say.
    Gains of a row add up in the unit of its signal; states of different units are compared in the scales that balance
    the matrix of the model (B. N. Parlett and C. Reinsch, Balancing a matrix for calculation of eigenvalues and
    eigenvectors, 1969)."""
    scales = np.diag(balance(law.space.A, permute=False)[1])

    def drop_small_gains(gains: Array) -> Array:
        sizes = np.abs(gains * scales)
        return np.where(sizes > len(scales) * EPSILON * np.max(sizes, axis=1, keepdims=True), gains, 0.0)

    if isinstance(law, Regulator):
        return replace(law, gains=drop_small_gains(law.gains))
    regulator = replace(law.regulator, gains=drop_small_gains(law.regulator.gains))
    scales = 1.0 / scales
    observer = replace(law.observer, gains=drop_small_gains(law.observer.gains.T).T)
    return replace(law, regulator=regulator, observer=observer)


@dataclass(frozen=True)
class _Hardware:
    """Limits, rounding and delay of an actuator or a sensor, in the unit of the signal.

    Attributes
    ----------
    lower, upper : limits, whole multiples of the quantum if there is one; infinite for no limit
    quantum : 0.0 for no rounding
    delay : s; None for the delay of the design, or none of a sensor
    """

    lower: float = -math.inf
    upper: float = math.inf
    quantum: float = 0.0
    delay: float | None = None

    @property
    def changes(self) -> bool:
        """Whether values are limited or rounded."""
        return self.quantum > 0.0 or math.isfinite(self.lower) or math.isfinite(self.upper)

    def limit(self, formula: str) -> str:
        """Return the formula (text) with ``min`` and ``max`` around it for the finite limits."""
        formula = f"min({_number(self.upper)}, {formula})" if self.upper < math.inf else formula
        return f"max({_number(self.lower)}, {formula})" if self.lower > -math.inf else formula


def _hardware(law: Regulator | OutputFeedback, tables: Mapping[str, Mapping[str, Any]]) -> dict[str, _Hardware]:
    """Return the hardware by the names of inputs (actuators) and measured signals (sensors) that have some. `tables`
    holds the caller's ``limits``, ``quantum`` and ``delay``, in this order, each by name of a signal. Raises UsageError
    for unknown names, unsuitable values, and a quantum or a delay in continuous time."""
    space = law.space
    sensors = law.observer.measured if isinstance(law, OutputFeedback) else _fed_back(law)
    for argument, entries in tables.items():
        if not isinstance(entries, Mapping):
            example = "(-5.0, 5.0)" if argument == "limits" else "0.01"
            fault = f"a mapping from names to values is needed, not {type(entries).__name__} [E0526]"
            raise UsageError(Problem(argument, fault, f"{argument}={{{space.inputs[0]!a}: {example}}}"))
        for name in entries:
            if name not in (*space.inputs, *sensors):
                fault = f"{shown(name)} is neither an input of the law nor a signal that it measures [E0527]"
                raise UsageError(Problem(argument, fault, nearest(str(name), (*space.inputs, *sensors))))
            if space.sample is None and argument != "limits":
                fault = f"the law is continuous in time, and has no {argument} of {name} [E0528]"
                raise UsageError(Problem(argument, fault, 'a sampled law, as lqr(..., sample="1 ms")'))
    names = [name for name in (*space.inputs, *sensors) if any(name in entries for entries in tables.values())]
    return {
        name: _one_hardware(name, _kind(space, name), space, *(entries.get(name) for entries in tables.values()))
        for name in dict.fromkeys(names)
    }


def _fed_back(law: Regulator) -> tuple[str, ...]:
    """Return the states with gains, inputs that wait for their effect aside."""
    used = np.any(law.gains != 0.0, axis=0).tolist()
    return tuple(name for k, name in enumerate(law.space.states) if used[k] and name not in law.space.waiting)


def _kind(space: StateSpace, name: str) -> str:
    return "inputs" if name in space.inputs else "outputs" if name in space.outputs else "states"


def _one_hardware(name: str, kind: str, space: StateSpace, limits: Any, quantum: Any, delay: Any) -> _Hardware:
    """Return an actuator or a sensor with limits, quantum and delay (None if absent) as the caller gave them. `kind` is
    ``inputs``, ``outputs`` or ``states``. Limits are drawn in to multiples of the quantum. Raises UsageError for values
    that cannot be met, or limits without the value at the reference; warns of late readings."""
    unit = space.unit(kind, name)
    lower, upper = _limits(name, limits, unit)
    step = 0.0 if quantum is None else _amount(f"quantum of {name}", quantum, unit)
    late = None if delay is None else _amount(f"delay of {name}", delay, "s")
    if quantum is not None and step <= 0.0:
        hint = "a positive number, or no quantum for values that are not rounded"
        raise UsageError(Problem(f"quantum of {name}", f"the quantum {step:.6g} is not positive [E0529]", hint))
    if late is not None and late < 0.0:
        fault = f"the delay {late:.6g} s is negative [E0530]"
        raise UsageError(Problem(f"delay of {name}", fault, "a time from zero on"))
    if step:  # a converter has no value between two multiples
        least = math.ceil(lower / step - COMPUTED) if lower > -math.inf else lower
        most = math.floor(upper / step + COMPUTED) if upper < math.inf else upper
        if not least < most:
            fault = f"fewer than two multiples of {step:.6g} lie between {lower:.6g} and {upper:.6g} [E0533]"
            raise UsageError(Problem(f"quantum of {name}", fault, "a smaller quantum, or wider limits"))
        lower, upper = least * step, most * step
    if late and kind != "inputs" and space.sample:
        used = math.ceil(late / space.sample - COMPUTED)
        text = f"delay of {name}: a reading that comes {late:.6g} s late is used {counted(used, 'sample')} later, after"
        text += f" {used * space.sample:.6g} s, which the design did not know"
        warnings.warn(f"{text}; try: sampled_loop().stability of the closed loop [W0045]", RuntimeWarning, stacklevel=6)
    rest = space.reference(kind, name)
    if not math.isnan(rest) and not lower <= rest <= upper:
        ends = f"the limits are {lower:.6g} and {upper:.6g}"
        fault = f"{name} is {rest:.6g} at the reference of the linear model, and {ends} [E0531]"
        raise UsageError(Problem(f"limits of {name}", fault, "wider limits, or a linear model about another reference"))
    return _Hardware(lower, upper, step, late)


def _limits(name: str, limits: Any, unit: str) -> tuple[float, float]:
    """Return the lower and the upper limit in `unit`, infinite if None; both infinite without `limits`. `limits` is the
    caller's pair of numbers, texts with a unit or None. Raises UsageError for other values, and if the lower limit is
    not below the upper one."""
    where, example = f"limits of {name}", "(-5.0, 5.0), or (None, 5.0) for one limit"
    if limits is None:
        return -math.inf, math.inf
    if isinstance(limits, str) or not isinstance(limits, Sequence | np.ndarray) or len(limits) != 2:
        raise UsageError(Problem(where, f"a lower and an upper limit are needed, not {shown(limits)} [E0534]", example))
    free = (-math.inf, math.inf)
    ends = [_amount(where, value, unit) if value not in (None, *free) else None for value in limits]
    lower, upper = (end if value is None else value for value, end in zip(ends, free, strict=True))
    if not lower < upper:
        fault = f"the lower limit {lower:.6g} is not below the upper limit {upper:.6g} [E0535]"
        raise UsageError(Problem(where, fault, example))
    return lower, upper


def _amount(where: str, value: Any, unit: str) -> float:
    """Return a finite number as a float, or a text with a unit ("2 kN") converted into `unit`. Raises UsageError
    for other values."""
    return number_of(where, in_label(where, value, unit) if isinstance(value, str) else value, "number")


class _Writer:
    """Writer of a control law as sections ``controllers`` and ``states`` of a scene's nested data. `space` is the
    linear model of the law, `prefix` stands before names of estimates, `hardware` has actuators and sensors by name.
    Raises UsageError if the scene's `data` lack one of the model's inputs."""

    def __init__(
        self, data: Mapping[str, Any], space: StateSpace, prefix: str, hardware: Mapping[str, _Hardware]
    ) -> None:
        self.data, self.space, self.prefix, self.hardware = data, space, prefix, hardware
        for name in space.inputs:
            entry = data.get("inputs", {}).get(name)
            if entry is None:
                hint = nearest(name, data.get("inputs", {})) or "the scene that the linear model was made of"
                fault = f"the scene has no input {shown(name)} of its own that a controller could replace [E0538]"
                raise UsageError(Problem("with_controller", fault, hint))

    # -- laws ----------------------------------------------------------------------------------------------------------

    def regulator(self, law: Regulator) -> Sections:
        """Return the sections of a state feedback: ``controllers`` in continuous time, sampled ``states`` otherwise.
        States without a gain are left out."""
        used = [k for k in range(len(self.space.states)) if any(law.gains[:, k])]
        sensors: dict[str, Any] = {}
        signals = {k: self._read(self.space.states[k], self._state(self.space.states[k]), sensors) for k in used}
        if self.space.sample is None:
            names = {k: _legal(self.space.states[k]) for k in used}
            rows = [[(names[k], *signals[k], float(row[k])) for k in used if row[k]] for row in law.gains]
            return {"controllers": self._feedbacks(rows)}
        formulas = [[(-float(row[k]), _off(*signals[k])) for k in used] for row in law.gains]
        return {"states": {**sensors, **self._input_states(formulas)}}

    def output_feedback(self, law: OutputFeedback) -> Sections:
        """Return the sections of a feedback of estimates, with the observer as states of the scene. In continuous time:
        ``states`` with the rates of the estimates and ``controllers`` with the inputs; sampled: all as ``states``,
        among them the measured signals and the inputs."""
        controller, states = law.controller, dict[str, Any]()
        estimates = [_fitting(f"{self.prefix}_{_legal(name)}") for name in self.space.states]
        named = enumerate(law.observer.measured)
        measured = [_off(*self._read(name, self._measured_signal(name, k, controller), states)) for k, name in named]
        if self.space.sample is not None:
            names = [_fitting(f"measured_{_legal(name)}") for name in law.observer.measured]
            for name, formula, label in zip(names, measured, controller.units["inputs"], strict=True):
                text = {"unit": label, "description": "measured signal, from rest on"}
                states[name] = self._sampled_state(formula) | text
            measured = names
        A, B, of_commands = self._prediction(law)
        for k, name in enumerate(estimates):
            terms = [*zip(A[k].tolist(), estimates, strict=True), *zip(B[k].tolist(), measured, strict=True)]
            for number, factor in enumerate(of_commands[k].tolist()):
                terms += [(factor, self._command(number)), (-factor * self._rest(number), "1")]
            text = {"unit": controller.units["states"][k]}
            if self.space.sample is None:
                text["description"] = f"estimate of {self.space.states[k]}, from rest on"
                states[name] = {"rate": _sum(terms), **text}
            else:
                text["description"] = f"prediction of {self.space.states[k]} for the next sample, from rest on"
                states[name] = self._sampled_state(_sum(terms)) | {"delay": self.space.sample, **text}
        if self.space.sample is None:
            rows = [
                [(name, name, 0.0, -gain) for name, gain in zip(estimates, row.tolist(), strict=True) if gain]
                for row in controller.C
            ]
            return {"states": states, "controllers": self._feedbacks(rows)}
        formulas = [
            [*zip(of_state.tolist(), estimates, strict=True), *zip(direct.tolist(), measured, strict=True)]
            for of_state, direct in zip(controller.C, controller.D, strict=True)
        ]
        return {"states": {**states, **self._input_states(formulas)}}

    # -- parts ---------------------------------------------------------------------------------------------------------

    def _prediction(self, law: OutputFeedback) -> tuple[Array, Array, Array]:
        """Return the observer's matrices for the estimates (ns, ns), the measured signals (ns, ny) and the commands
        (ns, nu). The products with these vectors add up to the rates of the estimates, or to the next estimates of a
        sampled law. Commands that are limited or rounded differ from the feedback of the estimates, so that the
        observer reads them; the columns of other commands are zero, because the estimates' matrix contains the
        feedback."""
        space, C, D, L = law.space, law.observer.C, law.observer.D, law.observer.gains
        K = law.regulator.gains.copy()
        read = [name in self.hardware and self.hardware[name].changes for name in space.inputs]
        if not any(read):
            return law.controller.A, law.controller.B, np.zeros_like(space.B)
        K[read] = 0.0
        of_commands = np.where(read, space.B, 0.0)
        closed = space.A - space.B @ K
        if space.sample is None:
            return closed - L @ (C - D @ K), L, of_commands - L @ np.where(read, D, 0.0)
        return closed @ (np.eye(len(closed)) - L @ C), closed @ L, of_commands

    def _read(self, name: str, signal: tuple[str, float], sensors: dict[str, Any]) -> tuple[str, float]:
        """Return the formula of a signal as its sensor gives it, and the signal's reference value. `signal` is the
        formula and the reference without a sensor. A sensor with a quantum or a delay is added to `sensors` as a
        sampled state ``sensor_NAME``, whose name is then the formula."""
        sensor, (formula, reference) = self.hardware.get(name), signal
        if sensor is None or name in self.space.inputs:
            return signal
        formula = sensor.limit(formula)
        if not sensor.quantum and not sensor.delay:
            return formula, reference
        state = _fitting(f"sensor_{_legal(name)}")
        kind = _kind(self.space, name)
        text = {"initial": reference, "unit": self.space.unit(kind, name), "description": f"reading of {name}"}
        sensors[state] = self._sampled_state(formula) | _clock(sensor) | text
        return state, reference

    def _command(self, number: int) -> str:
        """Return the name of the state with the command of the input `number` before its delay: ``NAME_asked``, or the
        input's name without a delay."""
        input = self.space.inputs[number]
        return _fitting(f"{input}_asked") if self._delay(input) is not None else input

    def _delay(self, input: str) -> float | None:
        """Return the delay of an actuator, s; None without a state between command and effect."""
        delay = self.hardware[input].delay if input in self.hardware else None
        if not self.space.waiting and not delay:
            return None
        return self.space.input_delay if delay is None else delay

    def _feedbacks(self, rows: list[list[tuple[str, str, float, float]]]) -> dict[str, Any]:
        """Return the ``state_feedback`` controllers by name of input; `rows` has the signals of each input
        (``_feedback``)."""
        return {name: self._feedback(k, row) for k, (name, row) in enumerate(zip(self.space.inputs, rows, strict=True))}

    def _feedback(self, number: int, row: list[tuple[str, str, float, float]]) -> dict[str, Any]:
        """Return the data of the controller of type ``state_feedback`` that gives the input `number`. `row` lists the
        signals fed back as (name, formula, reference, gain). The input's value at the reference is added as the
        feedback of a constant, and the actuator's limits as ``minimum`` and ``maximum``."""
        rest, input = self._rest(number), self.space.inputs[number]
        signals = {name: formula for name, formula, _, _ in row}
        gains = {name: gain for name, _, _, gain in row}
        references = {name: reference for name, _, reference, _ in row if reference}
        if rest or not row:  # the output at rest is feedback of a constant
            signals["rest"], gains["rest"] = _number(rest), -1.0
        entry: dict[str, Any] = {"type": "state_feedback", "signals": signals, "signal_gains": gains}
        entry |= {"unit": self.space.unit("inputs", input), "description": self._description()}
        actuator = self.hardware.get(input, _Hardware())
        limits = {"minimum": actuator.lower, "maximum": actuator.upper}
        entry |= {key: value for key, value in limits.items() if math.isfinite(value)}
        return entry | ({"signal_references": references} if references else {})

    def _input_states(self, formulas: list[list[tuple[float, str]]]) -> dict[str, Any]:
        """Return the sampled states that give the inputs, by name. `formulas` has for each input the (factor, formula)
        terms of its command. With a delay, an input has a state ``NAME_asked`` for the command, the states that wait
        for their effect, and the delayed state of the input's name."""
        space, states = self.space, {}
        for number, (input, terms) in enumerate(zip(space.inputs, formulas, strict=True)):
            rest = self._rest(number)
            formula = _sum([*terms, (rest, "1")] if rest else terms)
            text = {"initial": rest, "unit": space.unit("inputs", input), "description": self._description()}
            actuator, delay = self.hardware.get(input, _Hardware()), self._delay(input)
            command = self._sampled_state(actuator.limit(formula)) | _clock(replace(actuator, delay=None))
            if delay is None:
                states[input] = command | text
                continue
            asked = self._command(number)
            states[asked] = command | text
            for name, (of_input, samples) in space.waiting.items():
                if of_input == input:
                    late = {"delay": samples * float(space.sample or 0.0), "initial": rest, "unit": text["unit"]}
                    states[name] = self._sampled_state(asked) | late
            states[input] = self._sampled_state(asked) | {"delay": delay} | text
        return states

    def _sampled_state(self, formula: str) -> dict[str, Any]:
        return {"sample": self.space.sample, "formula": formula}

    def _rest(self, number: int) -> float:
        """Return the value of an input at the reference of the linear model."""
        references = self.space.references.get("inputs")
        return 0.0 if references is None else float(references[number])

    def _description(self) -> str:
        return "found from the linear model" if self.space.sample is None else "found from the sampled linear model"

    def _state(self, name: str) -> tuple[str, float]:
        """Return the formula (text) of a state of the linear model, and the state's value at the reference.

        Components of joints on groups have the formula of ``error_on_group`` (sin(angle) times the rotation axis, or
        the displacement in the axes of the reference), and the reference 0. Raises UsageError for states that formulas
        cannot use, such as coordinates of absolute bodies.
        """
        reference = self.space.reference("states", name)
        if name in self.space.waiting:
            return name, reference
        match = re.fullmatch(r"(.*)\[(\d+)\]", name)
        if match and match[1] in self.space.orientations:
            return error_on_group(match[1], int(match[2]), self.space.orientations[match[1]]), 0.0
        kind, dot, rest = name.partition(".")
        if math.isnan(reference) or (dot and kind not in ("v", "z")):
            fault = f"the feedback needs {name}, of which formulas of the scene know no value [E0539]"
            hint = "an observer, which estimates it; or joint coordinates"
            raise UsageError(Problem("with_controller", fault, hint))
        return f"q.{name}" if not dot else rest if kind == "z" else name, reference

    def _measured_signal(self, name: str, number: int, controller: StateSpace) -> tuple[str, float]:
        """Return the formula (text) of a measured signal, and the signal's value at the reference of the linear model.
        `name` is an output of the linear model, such as ``name[k]``, or a state, `number` its place among the inputs of
        `controller`. Raises UsageError for outputs that formulas cannot use, such as accelerations."""
        if name not in self.space.outputs:
            return self._state(name)
        reference = float(controller.references["inputs"][number])
        match = re.fullmatch(r"(.*)\[(\d+)\]", name)
        base, component = (match[1], int(match[2])) if match else (name, 0)
        entry = self.data.get("outputs", {}).get(base)
        if entry is None and base in self.data.get("inputs", {}):
            return base, reference
        entry = entry or {}
        for quantity in _QUANTITIES:
            if quantity in entry:
                return f"{quantity}.{entry[quantity]}[{component}]", reference
        formula = entry.get("formula")
        values = formula if isinstance(formula, list | tuple) else [formula]
        if formula is None or math.isnan(reference) or _OF_ACCELERATIONS.search(str(values[component])):
            fault = f"{name} is measured, and formulas of a controller cannot use it [E0540]"
            raise UsageError(Problem("with_controller", fault, "an output with a formula, a position or a velocity"))
        return f"({values[component]})", reference


def _clock(sensor: _Hardware) -> dict[str, Any]:
    """Return the keys ``quantum`` and ``delay`` of a sampled sensor or actuator, each unless it is zero."""
    return {key: value for key, value in (("quantum", sensor.quantum), ("delay", sensor.delay)) if value}


def error_on_group(joint: str, component: int, reference: tuple[float, ...]) -> str:
    """Return the formula (text) of one component of the error of a joint on SO(3) or SE(3) against a reference.

    `component` 0 to 2 is the rotation, 3 to 5 the translation; `reference` is the quaternion (w, x, y, z), and then the
    position. With r = p_0^-1 p, quaternions, the turn is 2 r_w (r_x, r_y, r_z): sin(angle) times the axis (Lee, Leok
    and McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), CDC 2010). This error is the logarithm,
    left-trivialised as coordinates of linear models are, up to the third power of the angle; the logarithm itself has
    no derivative at half a turn, while this error is a polynomial, the same for both signs of p. Travels are R_0^T (x -
    x_0).
    """
    w, x, y, z = reference[:4]
    p = [f"q.{joint}[{k}]" for k in range(4)]
    of_vector = [(-x, w, z, -y), (-y, -z, w, x), (-z, y, -x, w)]
    if component < 3:
        turn, along = (_sum(list(zip(row, p, strict=True))) for row in ((w, x, y, z), of_vector[component]))
        return f"(2 * ({turn}) * ({along}))"
    axes = (
        (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )
    off = [_off(f"q.{joint}[{4 + k}]", reference[4 + k]) for k in range(3)]
    return f"({_sum(list(zip(axes[component - 3], off, strict=True)))})"


def toml_text(data: Mapping[str, Any]) -> str:
    """Return nested data of a scene as the text of a TOML file; numbers read back to the same bits."""
    sections = {name: entries for name, entries in data.items() if isinstance(entries, Mapping)}
    plain = {key: value for key, value in data.items() if key not in sections}
    parts = []
    for heading, entries in [("", plain), *((f"[{_key(name)}]\n", entries) for name, entries in sections.items())]:
        parts.append(heading + "".join(f"{_key(key)} = {_value(value)}\n" for key, value in entries.items()))
    return "\n".join(filter(None, parts))


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _value(name)


def _value(value: Any) -> str:
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False)  # in which TOML writes them, too
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(name)} = {_value(item)}" for name, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return _number(value)


def _number(value: float) -> str:
    return repr(value) if isinstance(value, int) else repr(float(value))


def _sum(terms: list[tuple[float, str]]) -> str:
    """Return the formula (text) of a sum of (factor, name) products without the terms of factor zero. The name ``1``
    stands for a constant. An empty sum is ``0 * t``."""
    text = ""
    for factor, name in terms:
        if factor:
            size = _number(abs(factor)) if name == "1" else f"{_number(abs(factor))} * {name}"
            sign = "-" if factor < 0.0 else "+"
            text += f" {sign} {size}" if text else size if factor > 0.0 else f"-{size}"
    return text or "0 * t"


def _off(formula: str, reference: float) -> str:
    """Return a formula minus a reference."""
    if not reference:
        return formula
    return f"({formula} {'-' if reference > 0.0 else '+'} {_number(abs(reference))})"


def _legal(name: str) -> str:
    """Return the name of a state or a signal as one word, cut to the largest length of names."""
    return _fitting(re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_"))


def _fitting(name: str) -> str:
    return name[:NAME_LENGTH]
