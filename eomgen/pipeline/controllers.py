"""The way back from a design to a scene: a regulator or output feedback as controllers and states of its nested data.

Inputs that a caller would drive become controllers (or sampled states) of the same names, so that the rest of the
scene changes. Gains of a state are tunable parameters, as of every state feedback.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.base.messages import NAME_LENGTH, nearest, shown
from eomgen.errors import Problem, UsageError
from eomgen.linear.control.output_feedback import OutputFeedback
from eomgen.linear.control.regulator import Regulator
from eomgen.linear.state_space import StateSpace
from eomgen.scene.load import data_of

Sections = dict[str, dict[str, Any]]
#: Sections whose entries are called by bare names in formulas.
_NAMES = ("parameters", "inputs", "random", "states", "controllers", "curves")
#: Quantities that formulas of controllers cannot use.
_OF_ACCELERATIONS = re.compile(r"\b(?:a|acceleration|reaction|drive_effort)\.")
#: Kinds of outputs whose values formulas call by name.
_QUANTITIES = ("position", "velocity")


def with_controller(
    scene: str | os.PathLike[str] | Mapping[str, Any], law: Regulator | OutputFeedback, *, prefix: str = "estimate"
) -> dict[str, Any]:
    """Return nested data of a scene with inputs driven by a controller that was designed for the scene.

    Parameters
    ----------
    scene : path, or mapping like a scene file
        Source of the linear model.
    law : Regulator or OutputFeedback
        In continuous time controllers of type ``state_feedback``, with states for the estimates; sampled controllers
        are sampled states.
    prefix : str
        Before the names of estimates.

    Returns
    -------
    dict
        For ``eomgen.build``, ``eomgen.load`` or ``toml_text``. Files that the scene names are looked for from the
        current folder.

    Raises
    ------
    UsageError
        A model or a Scene in place of the scene's data; inputs that are not the scene's own, feedback of states
        without names in the scene (shaping filters, coordinates of absolute bodies), measured signals that formulas
        cannot use (accelerations), names that are taken.
    FileError, DescriptionError
        A scene file that cannot be read.
    """
    if not isinstance(scene, str | os.PathLike | Mapping):
        fault = f"the path of a scene file, or its nested data, is needed, not {type(scene).__name__}"
        hint = 'with_controller("scene.toml", law), with the file that the model was built from'
        raise UsageError(Problem("with_controller", fault, hint))
    if not isinstance(law, Regulator | OutputFeedback):
        fault = f"a Regulator or an OutputFeedback is needed, not {type(law).__name__}"
        raise UsageError(Problem("with_controller", fault, "the result of lqr, place or output_feedback"))
    data = dict(scene) if isinstance(scene, Mapping) else data_of(Path(scene))
    writer = _Writer(data, law.space, prefix)
    added = writer.regulator(law) if isinstance(law, Regulator) else writer.output_feedback(law)
    inputs = {name: entry for name, entry in data.get("inputs", {}).items() if name not in law.space.inputs}
    result = {key: value for key, value in data.items() if key != "inputs"} | ({"inputs": inputs} if inputs else {})
    taken = {name for section in _NAMES for name in result.get(section, {})}
    for section, entries in added.items():
        for name in entries:
            if name in taken:
                raise UsageError(Problem("with_controller", f"the scene has the name {name} already", "another prefix"))
        result[section] = {**result.get(section, {}), **entries}
    return result


class _Writer:
    """Writes laws for a model of a scene."""

    def __init__(self, data: Mapping[str, Any], space: StateSpace, prefix: str) -> None:
        self.data, self.space, self.prefix = data, space, prefix
        for name in space.inputs:
            entry = data.get("inputs", {}).get(name)
            if entry is None:
                hint = nearest(name, data.get("inputs", {})) or "the scene that the linear model was made of"
                fault = f"the scene has no input {shown(name)} of its own that a controller could replace"
                raise UsageError(Problem("with_controller", fault, hint))

    # -- laws ----------------------------------------------------------------------------------------------------------

    def regulator(self, law: Regulator) -> Sections:
        """Return the sections of a feedback of the state."""
        used = [k for k in range(len(self.space.states)) if any(law.gains[:, k])]
        signals = {k: self._state(self.space.states[k]) for k in used}
        if self.space.sample is None:
            names = {k: _legal(self.space.states[k]) for k in used}
            rows = [[(names[k], *signals[k], float(row[k])) for k in used if row[k]] for row in law.gains]
            return {
                "controllers": dict(zip(self.space.inputs, map(self._feedback, range(len(rows)), rows), strict=True))
            }
        formulas = []
        for row in law.gains:
            terms = [(-float(row[k]), _off(*signals[k])) for k in used]
            formulas.append(terms)
        return {"states": self._held(formulas)}

    def output_feedback(self, law: OutputFeedback) -> Sections:
        """Return the sections of a feedback of estimates."""
        controller, states = law.controller, {}
        estimates = [self._estimate(name) for name in self.space.states]
        signals = [self._measured(name, k, controller) for k, name in enumerate(law.observer.measured)]
        measured = [_off(*signal) for signal in signals]
        if self.space.sample is not None:
            names = [_fitting(f"measured_{_legal(name)}") for name in law.observer.measured]
            for name, formula, label in zip(names, measured, controller.units["inputs"], strict=True):
                states[name] = self._sampled(formula) | {"unit": label, "description": "measured signal, from rest on"}
            measured = names
        for k, name in enumerate(estimates):
            terms = [*zip(controller.A[k].tolist(), estimates, strict=True)]
            terms += zip(controller.B[k].tolist(), measured, strict=True)
            label = controller.units["states"][k]
            text = {"unit": label, "description": f"estimate of {self.space.states[k]}, from rest on"}
            if self.space.sample is None:
                states[name] = {"rate": _sum(terms), **text}
            else:
                text["description"] = f"prediction of {self.space.states[k]} for the next sample, from rest on"
                states[name] = self._sampled(_sum(terms)) | {"delay": self.space.sample, **text}
        if self.space.sample is None:
            rows = [
                [(name, name, 0.0, -gain) for name, gain in zip(estimates, row.tolist(), strict=True) if gain]
                for row in controller.C
            ]
            feedback = map(self._feedback, range(len(rows)), rows)
            return {"states": states, "controllers": dict(zip(self.space.inputs, feedback, strict=True))}
        formulas = [
            [*zip(of_state.tolist(), estimates, strict=True), *zip(direct.tolist(), measured, strict=True)]
            for of_state, direct in zip(controller.C, controller.D, strict=True)
        ]
        return {"states": {**states, **self._held(formulas)}}

    # -- parts ---------------------------------------------------------------------------------------------------------

    def _feedback(self, number: int, row: list[tuple[str, str, float, float]]) -> dict[str, Any]:
        """Return a state feedback of signals (name, formula, reference, gain) that gives an input."""
        rest, input = self._rest(number), self.space.inputs[number]
        signals = {name: formula for name, formula, _, _ in row}
        gains = {name: gain for name, _, _, gain in row}
        references = {name: reference for name, _, reference, _ in row if reference}
        if rest or not row:  # the output at rest is feedback of a constant
            signals["rest"], gains["rest"] = _number(rest), -1.0
        entry = {
            "type": "state_feedback",
            "signals": signals,
            "signal_gains": gains,
            "unit": self.space.unit("inputs", input),
            "description": self._description(),
        }
        return entry | ({"signal_references": references} if references else {})

    def _held(self, formulas: list[list[tuple[float, str]]]) -> dict[str, Any]:
        """Return the sampled states of the inputs, late if the model has a delay."""
        space, states = self.space, {}
        for number, (input, terms) in enumerate(zip(space.inputs, formulas, strict=True)):
            rest = self._rest(number)
            formula = _sum([*terms, (rest, "1")] if rest else terms)
            text = {"initial": rest, "unit": space.unit("inputs", input), "description": self._description()}
            if not space.waiting:
                states[input] = self._sampled(formula) | text
                continue
            asked = _fitting(f"{input}_asked")
            states[asked] = self._sampled(formula) | text
            for name, (of_input, samples) in space.waiting.items():
                if of_input == input:
                    late = {"delay": samples * float(space.sample or 0.0), "initial": rest, "unit": text["unit"]}
                    states[name] = self._sampled(asked) | late
            states[input] = self._sampled(asked) | {"delay": space.input_delay} | text
        return states

    def _sampled(self, formula: str) -> dict[str, Any]:
        return {"sample": self.space.sample, "formula": formula}

    def _rest(self, number: int) -> float:
        """Return the value of an input at the reference of the linear model."""
        references = self.space.references.get("inputs")
        return 0.0 if references is None else float(references[number])

    def _description(self) -> str:
        return "found from the linear model" if self.space.sample is None else "found from the sampled linear model"

    def _estimate(self, state: str) -> str:
        return _fitting(f"{self.prefix}_{_legal(state)}")

    def _state(self, name: str) -> tuple[str, float]:
        """Return the formula of a state, and the value of the state at the reference of the linear model."""
        reference = self.space.reference("states", name)
        if name in self.space.waiting:
            return name, reference
        match = re.fullmatch(r"(.*)\[(\d+)\]", name)
        if match and match[1] in self.space.orientations:
            return error_on_group(match[1], int(match[2]), self.space.orientations[match[1]]), 0.0
        kind, dot, rest = name.partition(".")
        if math.isnan(reference) or (dot and kind not in ("v", "z")):
            fault = f"the feedback needs {name}, of which formulas of the scene know no value"
            hint = "an observer, which estimates it; or joint coordinates"
            raise UsageError(Problem("with_controller", fault, hint))
        return f"q.{name}" if not dot else rest if kind == "z" else name, reference

    def _measured(self, name: str, number: int, controller: StateSpace) -> tuple[str, float]:
        """Return the formula of a measured signal, and the value of the signal at the reference of the linear model."""
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
            fault = f"{name} is measured, and formulas of a controller cannot use it"
            raise UsageError(Problem("with_controller", fault, "an output with a formula, a position or a velocity"))
        return f"({values[component]})", reference


def error_on_group(joint: str, component: int, reference: tuple[float, ...]) -> str:
    """Return the formula of the distance of a joint on SO(3) or SE(3) from the reference, along one component.

    With r = p_0^-1 p, quaternions, the turn is 2 r_w (r_x, r_y, r_z): sin(angle) times the axis (Lee, Leok and
    McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), CDC 2010). This error is the logarithm,
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
    plain = {key: value for key, value in data.items() if not isinstance(value, Mapping)}
    parts = ["\n".join(f"{_key(key)} = {_value(value)}" for key, value in plain.items())] if plain else []
    for section, entries in data.items():
        if not isinstance(entries, Mapping):
            continue
        flat = {name: entry for name, entry in entries.items() if not isinstance(entry, Mapping) or not entry}
        if flat:
            rows = "\n".join(f"{_key(name)} = {_value(entry)}" for name, entry in flat.items())
            parts.append(f"[{_key(section)}]\n{rows}")
        for name, entry in entries.items():
            if name not in flat:
                rows = "\n".join(f"{_key(key)} = {_value(value)}" for key, value in entry.items())
                parts.append(f"[{_key(section)}.{_key(name)}]\n{rows}")
    return "\n\n".join(parts) + "\n"


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _value(name)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "\\t")
        return f'"{escaped}"'
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(name)} = {_value(item)}" for name, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return _number(value)


def _number(value: float) -> str:
    return repr(value) if isinstance(value, int) else repr(float(value))


def _sum(terms: list[tuple[float, str]]) -> str:
    """Return a sum of products as a formula; terms of zero are left out."""
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
    """Return the name of a state or a signal as one word."""
    return _fitting(re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_"))


def _fitting(name: str) -> str:
    return name[:NAME_LENGTH]
