"""Metadata of a compiled library: the Program without its statements, as JSON types, stored with the library.

The runtime needs only this and the compiled code: no scene, no tape, no SymPy.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

from eomgen.codegen.program import Program
from eomgen.symbolic.operations import Op

#: Fields of a Program that are used only for the text in C.
_OF_THE_TEXT = (
    "functions",
    "loops",
    "shared",
    "curves",
    "series",
    "constants",
    "base_read",
    "base_of_step",
    "external",
    "sources",
    "coordinates",
    "velocities",
    "controller",
    "bounds",
    "uniform",
    "later",
)


def _without_tables(method: Mapping[str, Any]) -> dict[str, Any]:
    """Return method data with nested lists and tables of ``solver`` removed; texts and numbers of ``solver`` remain.
    All other keys of the method stay."""

    def scalars(data: Mapping[str, Any]) -> dict[str, Any]:
        return {
            key: scalars(value) if isinstance(value, Mapping) else value
            for key, value in data.items()
            if isinstance(value, Mapping | str | int | float)
        }

    return {key: scalars(value) if key == "solver" else value for key, value in method.items()}


def stack_bytes(program: Program) -> int:
    """Return an estimate of the stack in bytes for the deepest call of a Program's functions or stepper."""
    of_functions = max((function.workspace for function in program.functions), default=0)
    if not program.method:
        return 8 * of_functions
    states = program.sizes["z"]
    copies = 60 * (program.sizes["v"] + states)  # copies of states, and vectors, in the deepest calls of a stepper
    return 8 * (of_functions + copies + 2 * states**2)  # two matrices of partials of internal states


def loop_operations(program: Program) -> int:
    """Return the number of operations in the bodies of all loops over elements, each body once. The ``operations`` of
    functions do not count these."""
    return sum(_operations(statement.data) for loop in program.loops for statement in loop.statements)


def _operations(data: Any) -> int:
    """Return the number of operations in an expression, or in the data of a statement."""
    if not isinstance(data, tuple):
        return 0
    return sum(map(_operations, data)) + (bool(data) and data[0] in Op.__members__)


def interface_layout(program: Program) -> dict[str, Any]:
    """Return the fields of a Program that the runtime needs, as JSON types; texts of the C and statements are left out.

    Functions are numbered by position; each has ``name, description, inputs, input_sizes, outputs (name, shape, size,
    description), operations, counts``. Each of ``parameters, inputs, states, outputs`` is a list of ``name, member,
    value, size, unit, description``. Added are ``loop_operations``, ``stack`` (bytes) and, for scenes with functions
    in Python, ``python``.
    """
    layout: dict[str, Any] = {
        field.name: getattr(program, field.name)
        for field in dataclasses.fields(program)
        if field.name not in _OF_THE_TEXT
    }
    for key in ("parameters", "inputs", "states", "outputs"):
        layout[key] = [dataclasses.asdict(named) for named in layout[key]]
    layout["method"] = _without_tables(program.method)
    layout["functions"] = [
        {
            "name": function.name,
            "description": function.description,
            "inputs": function.inputs,
            "input_sizes": [program.input_size(block) for block in function.inputs],
            "outputs": [dataclasses.asdict(output) for output in function.outputs],
            "operations": function.operations,
            "counts": function.counts,
        }
        for function in program.functions
    ]
    if functions := [dataclasses.asdict(source.python) for source in program.sources if source.python]:
        layout["python"] = functions
    layout["stack"] = stack_bytes(program)
    layout["loop_operations"] = loop_operations(program)
    plain: dict[str, Any] = json.loads(json.dumps(layout, default=dict, sort_keys=True))
    return plain
