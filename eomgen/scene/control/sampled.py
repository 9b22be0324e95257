"""Sampled controllers: their signals, held values and memory as states, and the C source of the function between."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from eomgen.base.data import dataclass
from eomgen.base.files import read_bytes
from eomgen.base.messages import key_of, shown
from eomgen.errors import FileError
from eomgen.formula.nodes import Symbol
from eomgen.scene.formula.scope import LOAD
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import Values
from eomgen.scene.signals.sampling import HeldValue, held_states, read_clock
from eomgen.system.signals import CONTROLLER_ARGUMENTS, CSource, SampledController, State

if TYPE_CHECKING:
    from eomgen.scene.control.schema import ControllerEntry as Written

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_OWN_HEADER = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"\n]*)"', re.MULTILINE)
_KEYWORDS = re.compile(
    "auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|main|"
    "register|restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while|"
    "a?(?:sin|cos|tan)h?|atan2|exp2?|expm1|log(?:2|10|1p)?|pow|sqrt|cbrt|hypot|f?abs|floor|ceil|round|f?min|f?max|fmod|"
    "erfc?|[lt]gamma|printf|malloc|free|exit|abort|memcpy|memset"
)


@dataclass(frozen=True)
class SampledNames:
    """Names that a sampled controller adds to a scene: outputs in formulas, and states for signals, output values and
    memory."""

    outputs: tuple[str, ...]
    signals: tuple[str, ...]
    values: tuple[str, ...]
    memory: tuple[str, ...]

    @property
    def states(self) -> list[str]:
        return [*self.signals, *self.values, *self.memory]


def sampled_names(name: str, entry: Written) -> SampledNames:
    """Return the names that the controller ``name``, of type ``sampled``, adds to a scene."""
    outputs = tuple(f"{name}_{output}" for output in entry.outputs or ()) or (name,)
    return SampledNames(
        outputs,
        tuple(f"{name}_signal_{signal}" for signal in entry.signals or ()),
        tuple(f"{output}_held" for output in outputs),
        tuple(f"{name}_memory_{k + 1}" for k in range(entry.memory or 0)),
    )


def read_sampled_controller(
    name: str, entry: Written, values: Values, folder: Path
) -> tuple[list[State], SampledController]:
    """Return the states of a sampled controller, for signals, outputs and memory, and the record of the function called
    at the samples; without states for a faulty clock. Faults are reported.

    Parameters
    ----------
    folder : Path
        Folder of the scene file, to which ``source`` is relative.
    """
    key, report = key_of("controllers", name), values.report
    names = sampled_names(name, entry)
    initial = values.constant(f"{key}.initial", entry.initial)
    clock = None if entry.sample is None else read_clock(key, entry, values)
    source = _source(key, entry, folder, report)
    function = entry.function or ""
    called = SampledController(
        name,
        tuple(entry.signals or ()),
        tuple(entry.outputs or (name,)),
        names.signals,
        tuple(f"{value}_sampled" if clock and (clock.whole or clock.rest) else value for value in names.values),
        names.memory,
        entry.memory is not None or entry.source is not None,
        function,
        source,
    )
    states: list[State] = []
    if clock is None:
        return states, called
    plain = read_clock(key, entry.model_copy(update={"delay": None, "quantum": None}), values)
    where = report.where(key)
    for label, state in zip(entry.signals or {}, names.signals, strict=True):
        field = f"{key}.signals.{label}"
        formula = values.formula(field, (entry.signals or {})[label], LOAD)
        text = f"signal {label} of the controller {name}"
        if plain is not None:
            states += held_states(HeldValue(state, formula, 0.0, "", text, key, report.where(field)), plain, values)
    for state in names.values:
        text = f"what the controller {name} gives"
        value = HeldValue(state, Symbol("state", state), initial, entry.unit, text, key, where, name)
        states += held_states(value, clock, values)
    for number, state in enumerate(names.memory):
        text = f"memory[{number}] of the controller {name}"
        value = HeldValue(state, Symbol("state", state), 0.0, "", text, key, where, name)
        if plain is not None:
            states += held_states(value, plain, values)
    return states, called


def text_of(key: str, path: Path, report: Report) -> str | None:
    """Return the text of a file of code; None if the file cannot be read, is too large, or is not UTF-8, which is
    reported at the key that names the file."""
    try:
        return read_bytes(path, 1_000_000).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError:
        report.add(key, "the file is not UTF-8 [E0900]", "the file saved in UTF-8")
    except FileError as error:
        report.add_error(key, error)
    return None


def _source(key: str, entry: Written, folder: Path, report: Report) -> CSource | None:
    """Return the C file of a sampled controller; None if the caller gives the function, and after a fault, which is
    reported."""
    if entry.source is None:
        if entry.function is not None:
            report.add(f"{key}.function", "function is the name of one in a C file [E1421]", 'source = "controller.c"')
        return None
    if entry.function is None:
        message = "the name of the function in the C file is missing [E1422]"
        report.add(f"{key}.source", message, 'function = "controller"')
        return None
    prototype = f"int {entry.function}({CONTROLLER_ARGUMENTS})"
    return c_source(key, entry.source, {"function": (entry.function, prototype)}, folder, report)


def c_source(
    key: str, file: str, functions: Mapping[str, tuple[str, str]], folder: Path, report: Report
) -> CSource | None:
    """Return name and text of a C file that an entry brings along; None after a fault of file or functions, which is
    reported. The file is ``file`` from ``folder``, ``key`` the entry's dotted key; ``functions`` gives by key of the
    entry the name of a function of the file and its prototype."""
    for word, (function, _) in functions.items():
        if not _IDENTIFIER.fullmatch(function) or _KEYWORDS.fullmatch(function) or function.startswith("eomgen"):
            message = f"{shown(function)} cannot be the name of a C function here [E1423]"
            hint = "letters, digits and underscores, no word of C and of its library, not eomgen at its start"
            report.add(f"{key}.{word}", message, hint)
            return None
    path = folder / file
    if (text := text_of(f"{key}.source", path, report)) is None:
        return None
    fault, hint = "", "the path of a C file, from the scene file's folder"
    if path.suffix != ".c":
        fault = f"{shown(file)} does not end in .c [E1424]"
    if not fault and "\0" in text:
        fault = f"{shown(str(path))} holds a zero byte: this is not a text [E1425]"
    if not fault and (header := _OWN_HEADER.search(text)):
        line = text.count("\n", 0, header.start()) + 1
        fault = f'{path.name}:{line} includes "{header[1]}", a file of its own, which would not come along [E1426]'
        hint = "its text in the C file; headers in angle brackets are there"
    for function, prototype in functions.values():
        if not fault and not re.search(rf"\b{function}\s*\(", text):
            fault, hint = f"{path.name} has no function {function} [E0904]", f"{prototype} in it"
    if fault:
        report.add(f"{key}.source", fault, hint)
        return None
    return CSource(path.name, text)
