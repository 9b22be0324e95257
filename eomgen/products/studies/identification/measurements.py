"""Measured data of one run: times, columns that are compared with outputs, columns that drive inputs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import names_of
from eomgen.base.csv_tables import read_table
from eomgen.base.data import dataclass
from eomgen.base.messages import first_of, listed, nearest, shown
from eomgen.errors import Problem, UsageError
from eomgen.products.studies.defaults import NAMED
from eomgen.system.description import component_names

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

#: A file, or columns by name, including t.
Data = str | os.PathLike[str] | Mapping[str, Any]
MISSING = ("refuse", "drop")


@dataclass(frozen=True)
class Measurements:
    """Measured data of one run, sorted into outputs and inputs of the scene.

    Attributes
    ----------
    name : of the file without the ending, or ``run1``
    t : (n,) s, increasing
    outputs : by component of an output, (n,); nan if a value is missing
    inputs : by name of an input of the scene, (n,)
    """

    name: str
    t: Array
    outputs: Mapping[str, Array]
    inputs: Mapping[str, Array]


def columns_of(data: Data, number: int) -> tuple[str, dict[str, Array]]:
    """Return the name and the columns, arrays (n,) by name, of a CSV file or of a mapping. A mapping is named ``run1``
    for the `number` 0. Raises FileError for a file that cannot be read, UsageError for columns that are not numbers or
    differ in length."""
    if isinstance(data, str | os.PathLike):
        path = Path(data)
        names, table = read_table(path)
        return path.stem, dict(zip(names, table.T, strict=True))
    if not isinstance(data, Mapping):
        fault = f"a file or columns by name are needed, not {type(data).__name__} [E1065]"
        raise UsageError(Problem("data", fault, '"run.csv", or {"t": run.t, "angle": run.outputs["angle"]}'))
    columns = {}
    for name, values in data.items():
        try:
            columns[str(name)] = np.array(values, dtype=float)
            fits = columns[str(name)].ndim == 1 and not np.iscomplexobj(values)
        except (TypeError, ValueError):
            fits = False
        if not fits:
            kind = "complex" if np.iscomplexobj(values) else type(values).__name__
            fault = f"the column {name} is {kind}, not one number for each time [E1068]"
            raise UsageError(Problem("data", fault, f"an array (n,); components as columns {name}[0], {name}[1]"))
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        fault = f"columns differ in length: {', '.join(f'{name} {length}' for name, length in lengths.items())} [E1066]"
        raise UsageError(Problem("data", fault, "one number for each time, nan for missing ones"))
    return f"run{number + 1}", columns


def measurements(model: Model, data: Data, number: int, chosen: Sequence[str] | None, missing: str) -> Measurements:
    """Return the data of one run, sorted into outputs and inputs of a model.

    Parameters
    ----------
    data : path of a CSV file, or columns by name, with the times t
    number : of the run, from 0
    chosen : outputs or components of outputs that are compared; all columns that are outputs by default
    missing : ``refuse`` or ``drop``

    Raises
    ------
    FileError, UsageError
        A file that cannot be read; unknown columns, no outputs, missing values that are refused.
    """
    name, columns = columns_of(data, number)
    t = times_of(name, columns)
    layout = model.library.layout["outputs"]
    known = [label for item in layout for label in component_names("", str(item["name"]), int(item["size"]))]
    wanted = None if chosen is None else _choose_components(chosen, known)
    outputs, inputs = dict[str, Array](), dict[str, Array]()
    for column, values in columns.items():
        short = column.removeprefix("output.")
        driven = column.removeprefix("input.")
        if column == "t":
            continue
        if short in known and (wanted is None or short in wanted):
            outputs[short] = values
        elif driven in model.inputs:
            inputs[driven] = values
        elif wanted is None and short not in known and not _belongs_to_solution(model, column):
            hint = nearest(column, [*known, *model.inputs]) or '[outputs.angle] formula = "q.hinge" in the scene'
            where = f"{name}, column {shown(column)}"
            raise UsageError(Problem(where, "it is neither an output nor an input of the scene [E1069]", hint))
    if not outputs:
        fault = f"no column is an output of the scene: {listed(columns)} [E1070]"
        hint = (
            f"columns named {first_of(known, NAMED)}" if known else '[outputs.angle] formula = "q.hinge" in the scene'
        )
        raise UsageError(Problem(name, fault, hint))
    absent = [item for item in wanted or () if item not in outputs]
    if absent:
        raise UsageError(Problem(name, f"there is no column {absent[0]} [E0669]", f"outputs among {listed(columns)}"))
    return _without_gaps(name, t, outputs, inputs, missing)


def times_of(name: str, columns: Mapping[str, Array]) -> Array:
    """Return the column ``t``, (n,) in s. Raises UsageError if absent, does not increase, or has fewer than two
    rows."""
    if "t" not in columns:
        hint = nearest("t", columns) if any(key.lower() in ("t", "time") for key in columns) else listed(columns)
        raise UsageError(Problem(name, "there is no column t of times in s [E1071]", f"t in place of one of {hint}"))
    t = columns["t"]
    bad = np.flatnonzero(~np.isfinite(t))
    if len(bad):
        fault = f"{len(bad)} of {len(t)} times are not numbers, the first in row {bad[0] + 1} [E1072]"
        raise UsageError(Problem(name, fault, "rows with their times"))
    if len(t) < 2:
        raise UsageError(Problem(name, f"there are {len(t)} rows, and a run has two at least [E1074]", "more data"))
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if len(back):
        row = int(back[0])
        fault = f"time does not increase: {t[row + 1]:.9g} s in row {row + 2} follows {t[row]:.9g} s [E1073]"
        raise UsageError(Problem(name, fault, "rows in the order of their times; several runs as several files"))
    return t


def _choose_components(chosen: Sequence[str], known: Sequence[str]) -> list[str]:
    """Return the components of outputs that are chosen, by names of outputs or of components. Raises UsageError for an
    unknown name, or anything but a list of names."""
    result = []
    for name in names_of("outputs", "outputs", chosen, "angle"):
        labels = [label for label in known if label == name or label.partition("[")[0] == name]
        if not labels:
            raise UsageError(Problem("outputs", f"there is no output {shown(name)} [E0204]", nearest(str(name), known)))
        result += labels
    return result


def _belongs_to_solution(model: Model, column: str) -> bool:
    """Return whether a column of a solution is not an output but a state, an energy, a multiplier."""
    states = (*model.q_names, *model.v_names, *model.z_names, *(f"a{name[1:]}" for name in model.v_names))
    return column in (*states, *model.multipliers) or column.startswith(("energy.", "multipliers"))


def check_choice(argument: str, value: str, choices: Sequence[str]) -> None:
    """Raise UsageError for a value of an argument that is none of the choices."""
    if value not in choices:
        raise UsageError(Problem(argument, f"{shown(value)} is none of the choices [E1077]", " or ".join(choices)))


def _without_gaps(
    name: str, t: Array, outputs: dict[str, Array], inputs: dict[str, Array], missing: str
) -> Measurements:
    """Return the measured data with inputs interpolated at missing values, and nan for missing outputs. Raises
    UsageError if values are missing and `missing` is ``refuse``, for an input without values, and for values above
    1e100."""
    for column, values in (outputs | inputs).items():
        largest = float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
        if largest > 1e100:
            fault = f"{largest:.3g} is too large a value: squares of differences to it overflow [E1079]"
            hint = "values in the unit of the column, and empty cells for missing ones"
            raise UsageError(Problem(f"{name}, column {column}", fault, hint))
    gaps = {column: int(np.count_nonzero(~np.isfinite(values))) for column, values in (outputs | inputs).items()}
    if any(gaps.values()) and missing == "refuse":
        rows = ~np.all(np.isfinite(np.stack([*outputs.values(), *inputs.values()])), axis=0)
        named = ", ".join(f"{column} {gap}" for column, gap in gaps.items() if gap)
        every = np.concatenate([*outputs.values(), *inputs.values()])
        kinds = [kind for kind, some in (("missing", np.isnan(every)), ("infinite", np.isinf(every))) if some.any()]
        fault = f"{np.count_nonzero(rows)} of {len(t)} rows have {' or '.join(kinds)} values ({named}) [E1078]"
        raise UsageError(Problem(name, fault, 'missing="drop", --missing drop: those values are left out'))
    filled = {}
    for column, values in inputs.items():
        there = np.isfinite(values)
        if not there.any():
            raise UsageError(
                Problem(f"{name}, column {column}", "it has no value [E1080]", "without it: the scene's input")
            )
        filled[column] = np.interp(t, t[there], values[there])
    outputs = {column: np.where(np.isfinite(values), values, np.nan) for column, values in outputs.items()}
    return Measurements(name, t, outputs, filled)
