"""Columns of a solution, (nt,) each, by name, and their units."""

from __future__ import annotations

import difflib
from collections.abc import Mapping

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import UnknownName
from eomgen.base.text import shown
from eomgen.errors import Problem
from eomgen.results.recorded import Recorded
from eomgen.system.description import component_names

#: Blocks of a state, each (nt, components).
STATES = ("q", "v", "a", "z", "multipliers")


def columns_of(solution: Recorded) -> dict[str, Array]:
    """Return all columns; see ``Solution.columns``."""
    names: Mapping[str, list[str]] = solution.metadata.get("names", {})
    columns = {"t": solution.t}
    for letter in STATES:
        array = getattr(solution, letter)
        labels = names.get(letter) or component_names("", letter, array.shape[1])
        if len(labels) != array.shape[1]:
            labels = [f"{letter}[{index}]" for index in range(array.shape[1])]
        columns |= {label: array[:, index] for index, label in enumerate(labels)}
    columns |= {f"input.{name}": array for name, array in solution.inputs.items()}
    for name, array in solution.outputs.items():
        table = array[:, np.newaxis] if array.ndim == 1 else array
        columns |= {
            label: table[:, index] for index, label in enumerate(component_names("output", name, table.shape[1]))
        }
    return columns | {f"energy.{name}": array for name, array in solution.energy.items()}


def column_named(solution: Recorded, name: str) -> Array:
    """Return a column, or an output, (nt,) or (nt, size). Raises UnknownName."""
    if name in solution.outputs:
        return solution.outputs[name]
    columns = solution.columns()
    if name not in columns:
        close = difflib.get_close_matches(str(name), [*columns, *solution.outputs], n=3, cutoff=0.5)
        hint = " or ".join(map(repr, close)) or f"one of {', '.join(list(columns)[:8])}, ...: solution.columns()"
        if isinstance(name, int):
            hint = "t, q and v by their names: solution.q[0] is the first row, solution.q[:, 0] the first coordinate"
        raise UnknownName(Problem("", f"there is no column {shown(name)}", hint))
    return columns[name]


def units_of(solution: Recorded) -> dict[str, str]:
    """Return the units of the columns; see ``Solution.units``."""
    known = solution.metadata.get("units", {})
    of_v = list(known.get("v", []))
    blocks = {
        "q": known.get("q", []),
        "v": of_v,
        "a": [_per_second(unit) for unit in of_v],
        "z": known.get("z", []),
    }
    names = solution.metadata.get("names", {})
    units = {"t": "s"}
    for letter, of_block in blocks.items():
        units |= dict(zip(names.get(letter, []), of_block, strict=False))
    units |= {f"input.{name}": known.get("inputs", {}).get(name, "") for name in solution.inputs}
    for name, array in solution.outputs.items():
        size = 1 if array.ndim == 1 else array.shape[1]
        units |= dict.fromkeys(component_names("output", name, size), known.get("outputs", {}).get(name, ""))
    return units | {f"energy.{name}": "W" if "power" in name else "J" for name in solution.energy}


def _per_second(unit: str) -> str:
    """Return the unit of a rate: ``m/s`` -> ``m/s^2``, ``rad`` -> ``rad/s``."""
    return f"{unit}^2" if unit.endswith("/s") else f"{unit}/s"
