"""Columns and files of a solution: ``.npz``, which can be read again, ``.csv``, pandas tables, xarray data sets, and
MATLAB files."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import UnknownName
from eomgen.base.csv_tables import write_table
from eomgen.base.files import FEWER_ROWS, read_arrays, write_arrays, write_bytes
from eomgen.base.messages import close_names, shown
from eomgen.base.products import optional_package
from eomgen.compiled.beams import SectionLoads
from eomgen.errors import FileError, Problem
from eomgen.results.error_estimate import ErrorEstimate, array_groups
from eomgen.results.events import BLOCKS, NO_EVENTS, events_from
from eomgen.results.finding import Finding
from eomgen.results.poses import PosesAndScenery
from eomgen.results.recorded import RecordedSolution
from eomgen.system.description import component_names

if TYPE_CHECKING:
    import pandas
    import xarray


#: Blocks of a state, each (nt, components).
STATES = ("q", "v", "a", "z", "multipliers")


def columns_of(solution: RecordedSolution) -> dict[str, Array]:
    """Return all columns; see ``Solution.columns``."""
    columns = {"t": solution.t}
    for letter, labels in _names(solution).items():
        columns |= dict(zip(labels, getattr(solution, letter).T, strict=True))
    columns |= {f"input.{name}": array for name, array in solution.inputs.items()}
    for name, array in solution.outputs.items():
        table = array[:, np.newaxis] if array.ndim == 1 else array
        columns |= {
            label: table[:, index] for index, label in enumerate(component_names("output", name, table.shape[1]))
        }
    return columns | {f"energy.{name}": array for name, array in solution.energy.items()}


def column_named(solution: RecordedSolution, name: str) -> Array:
    """Return a column (nt,) or an output, (nt,) or (nt, size), by name; components of outputs also without ``output.``.

    Raises
    ------
    UnknownName
        No column or output of that name.
    """
    if name in solution.outputs:
        return solution.outputs[name]
    columns = solution.columns()
    if name not in columns and f"output.{name}" in columns:
        return columns[f"output.{name}"]
    if name not in columns:
        close = close_names(str(name), [*columns, *solution.outputs], cutoff=0.5)
        hint = " or ".join(map(repr, close)) or f"one of {', '.join(list(columns)[:8])}, ...: solution.columns()"
        if isinstance(name, int):
            hint = "t, q and v by their names: solution.q[0] is the first row, solution.q[:, 0] the first coordinate"
        raise UnknownName(Problem("", f"there is no column {shown(name)} [E0669]", hint))
    return columns[name]


def units_of(solution: RecordedSolution) -> dict[str, str]:
    """Return the units of the columns; see ``Solution.units``."""
    known = solution.metadata.get("units", {})
    blocks = {**known, "a": [f"{unit}^2" if unit.endswith("/s") else f"{unit}/s" for unit in known.get("v", ())]}
    units = {"t": "s"}
    for letter, labels in _names(solution).items():
        units |= dict(zip(labels, blocks.get(letter, ()), strict=False))
    units |= {f"input.{name}": known.get("inputs", {}).get(name, "") for name in solution.inputs}
    for name, array in solution.outputs.items():
        size = 1 if array.ndim == 1 else array.shape[1]
        units |= dict.fromkeys(component_names("output", name, size), known.get("outputs", {}).get(name, ""))
    return units | {f"energy.{name}": "W" if "power" in name else "J" for name in solution.energy}


_OUTCOME = ("stats", "message", "success", "interrupted")
#: Fields with separate arrays by name.
_GROUPS = ("inputs", "outputs", "events", "energy", "error", "section_loads")
#: One array of the poses of all bodies (nt, bodies, 7), as a member of the archive for each of 10 000 bodies takes
#: seconds to read, and the key of the bodies' names in the metadata.
_POSES, _POSED = "poses", "posed"


class SavedSolution(RecordedSolution, Protocol):
    """Interface of a ``Solution`` for its files."""

    @property
    def interrupted(self) -> bool: ...


def write_all(
    solution: SavedSolution, seen: PosesAndScenery | None, loads: Mapping[str, SectionLoads], path: Path
) -> None:
    """Write a solution as ``.npz``: states, outcome, metadata, and poses `seen` and section `loads` by beam if known.
    Raises FileError."""
    events = solution.events.arrays() if solution.events.counts else {}
    poses = seen.poses if seen else {}
    of_sections = {f"{beam}.{name}": array for beam, item in loads.items() for name, array in item.named().items()}
    groups = (solution.inputs, solution.outputs, events, solution.energy, solution.error.arrays(), of_sections)
    arrays = {name: getattr(solution, name) for name in ("t", *STATES)}
    for group, named in zip(_GROUPS, groups, strict=True):
        arrays |= {f"{group}.{name}": array for name, array in named.items()}
    if poses:
        arrays[_POSES] = np.stack(list(poses.values()), axis=1)
    outcome = {name: getattr(solution, name) for name in _OUTCOME} | {"stats": dict(solution.stats)}
    outcome["findings"] = [finding.to_dict() for finding in solution.findings]
    scenery = {"scenery": seen.scenery, _POSED: list(poses)} if seen else {}
    write_arrays(
        path, arrays, {**solution.metadata, **outcome, **scenery, "error": solution.error.described()}, FEWER_ROWS
    )


def write_columns(solution: RecordedSolution, path: Path) -> None:
    """Write the columns as a table of text. Raises FileError."""
    columns = solution.columns()
    write_table(path, list(columns), np.stack(list(columns.values()), axis=1))


def read_all(
    path: Path,
) -> tuple[dict[str, Any], dict[str, Array], PosesAndScenery | None, dict[str, SectionLoads]]:
    """Return attributes of the stored solution by name, its inputs, poses with scenery or None, and section loads by
    beam.

    Raises
    ------
    FileError
        The file cannot be read or is not a solution.
    """
    arrays, metadata = read_arrays(path)
    groups: dict[str, Any] = {**{name: {} for name in (*_GROUPS, _POSES)}, **array_groups(arrays)}
    no_solution = "this is not a solution written by eomgen"
    try:
        attributes = {name: metadata.pop(name) for name in _OUTCOME}
        states: dict[str, Any] = {name: groups[name] for name in ("t", *STATES)}
        attributes["findings"] = tuple(map(Finding.from_data, metadata.pop("findings", ())))
        events = events_from(metadata["events"], groups["events"]) if "events" in metadata else NO_EVENTS
    except KeyError as error:
        raise FileError(Problem(str(path), f"{no_solution}: {error.args[0]} is missing [E1301]")) from None
    rows = np.shape(states["t"])
    if any(np.ndim(array) != (1 if name == "t" else 2) or array.shape[:1] != rows for name, array in states.items()):
        raise FileError(Problem(str(path), f"{no_solution}: its arrays do not fit together [E1302]"))
    posed = metadata.pop(_POSED, ())
    if _POSES in arrays:  # files of earlier versions have an array for each body
        if np.ndim(arrays[_POSES]) != 3 or arrays[_POSES].shape[1] != len(posed):
            raise FileError(Problem(str(path), f"{no_solution}: its arrays do not fit together [E1302]"))
        groups[_POSES] = {name: arrays[_POSES][:, index] for index, name in enumerate(posed)}
    wrong = [name for name, array in groups[_POSES].items() if array.shape != (*rows, 7)]
    if wrong:
        raise FileError(Problem(str(path), f"{no_solution}: the poses of {wrong[0]} do not fit to its times [E1303]"))
    scenery, summary = metadata.pop("scenery", None), metadata.pop("error", None)
    if summary is not None:
        attributes["error"] = ErrorEstimate.from_file(groups["error"], summary)
    attributes |= {"outputs": groups["outputs"], "energy": groups["energy"], "metadata": metadata, "events": events}
    seen = None if scenery is None else PosesAndScenery(groups[_POSES], scenery)
    return {**states, **attributes}, groups["inputs"], seen, _loads(groups["section_loads"], rows, path)


def _loads(arrays: Mapping[str, Array], rows: tuple[int, ...], path: Path) -> dict[str, SectionLoads]:
    """Return the section loads of each beam from the arrays ``beam.field`` of a file. Raises FileError if their first
    dimension is not `rows`, the shape of the times."""
    beams: dict[str, dict[str, Array]] = {}
    for name, array in arrays.items():
        beam, _, field = name.rpartition(".")
        beams.setdefault(beam, {})[field] = array
    result = {}
    for beam, parts in beams.items():
        try:
            result[beam] = SectionLoads(**parts)
            fits = all(array.shape[:1] == rows for name, array in parts.items() if name != "x")
        except TypeError:
            fits = False
        if not fits:
            fault = f"not a solution written by eomgen: the section loads of {beam} do not fit to its times [E1304]"
            raise FileError(Problem(str(path), fault))
    return result


T = TypeVar("T")


def to_pandas(solution: RecordedSolution) -> pandas.DataFrame:
    """Return all columns over ``t``; see ``Solution.to_pandas``."""
    columns = solution.columns()
    time = columns.pop("t")
    package = _package("pandas", "to_pandas")
    frame: pandas.DataFrame = package.DataFrame(columns, index=package.Index(time, name="t"))
    frame.attrs |= {"units": solution.units(), "scene": _scene(solution), "message": solution.message}
    return frame


def to_xarray(solution: RecordedSolution) -> xarray.Dataset:
    """Return the solution over ``t``; see ``Solution.to_xarray``."""
    package = _package("xarray", "to_xarray")
    units = solution.units()
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {"t": ("t", solution.t, {"units": "s"})}
    names = _names(solution)
    for letter in STATES:
        array = getattr(solution, letter)
        if array.shape[1]:
            along = f"{letter}_component"
            variables[letter] = (("t", along), array)
            coordinates[along] = names[letter]
            coordinates[f"{letter}_units"] = (along, [units.get(name, "") for name in names[letter]])
    for name, array in solution.inputs.items():
        variables[f"input.{name}"] = ("t", array, {"units": units[f"input.{name}"]})
    of_outputs = solution.metadata.get("units", {}).get("outputs", {})
    for name, array in solution.outputs.items():
        dimensions = ("t",) if array.ndim == 1 else ("t", f"{name}_component")
        variables[f"output.{name}"] = (dimensions, array, {"units": of_outputs.get(name, "")})
    for name, array in solution.energy.items():
        variables[f"energy.{name}"] = ("t", array, {"units": units[f"energy.{name}"]})
    attributes = {"scene": _scene(solution), "message": solution.message, "success": int(solution.success)}
    dataset: xarray.Dataset = package.Dataset(variables, coordinates, attributes)
    return dataset


def write_matlab(solution: RecordedSolution, path: Path) -> None:
    """Write states, inputs, outputs, energies, events, names and units as a MATLAB file of version 5. Raises
    FileError."""
    from scipy.io import savemat  # noqa: PLC0415  # slow to import

    stream = io.BytesIO()
    names, units = _names(solution), solution.units()
    of_components = {letter: [units.get(label, "") for label in labels] for letter, labels in names.items()}
    groups = {"inputs": solution.inputs, "outputs": solution.outputs, "energy": solution.energy}
    content: dict[str, Any] = {
        **{name: getattr(solution, name) for name in ("t", *STATES)},
        **{group: _struct(arrays) for group, arrays in groups.items()},
        "names": {letter: np.array(labels, dtype=object) for letter, labels in names.items()},
        "units": {
            **{letter: np.array(labels, dtype=object) for letter, labels in of_components.items()},
            **{name: _struct(labels) for name, labels in _labels(solution).items()},
        },
        "message": solution.message,
        "scene": _scene(solution),
    }
    if (events := solution.events).counts:
        blocks = {name: getattr(events, name) for name in ("t", *BLOCKS)}
        named = {"names": np.array(events.names, dtype=object), "counts": _struct(events.counts)}
        content["events"] = {**blocks, **named}
    savemat(stream, content, oned_as="column")  # type: ignore[arg-type]  # the stubs do not know that it takes streams
    write_bytes(path, stream.getvalue())


def write_parquet(solution: RecordedSolution, path: Path) -> None:
    """Write the columns as a Parquet file, ``t`` first, with units, scene and message as metadata.

    Raises
    ------
    UsageError
        ``pyarrow`` is not installed.
    FileError
        The file cannot be written.
    """
    arrow = _package("pyarrow", "save")
    parquet = _package("pyarrow.parquet", "save")
    units = solution.units()
    columns = solution.columns()
    fields = [arrow.field(name, arrow.float64(), metadata={"unit": units.get(name, "")}) for name in columns]
    about = {"scene": _scene(solution), "message": solution.message, "success": str(solution.success)}
    schema = arrow.schema(fields, metadata=about)
    table = arrow.table([np.ascontiguousarray(array, dtype=float) for array in columns.values()], schema=schema)
    stream = io.BytesIO()
    parquet.write_table(table, stream)
    write_bytes(path, stream.getvalue())


def _labels(solution: RecordedSolution) -> dict[str, dict[str, str]]:
    """Return the units of inputs, outputs and energies: ``inputs``, ``outputs`` and ``energy`` -> name -> unit."""
    units = solution.units()
    of_outputs = solution.metadata.get("units", {}).get("outputs", {})
    return {
        "inputs": {name: units.get(f"input.{name}", "") for name in solution.inputs},
        "outputs": {name: of_outputs.get(name, "") for name in solution.outputs},
        "energy": {name: units.get(f"energy.{name}", "") for name in solution.energy},
    }


def _struct(arrays: Mapping[str, T]) -> dict[str, T]:
    """Return a mapping with its names changed to valid names of MATLAB's fields: letters, digits, underscores, 31 at
    most."""
    named: dict[str, T] = {}
    for name, array in arrays.items():
        field = re.sub(r"\W", "_", name)
        named[(field if field[0].isalpha() else f"f{field}")[:31]] = array
    return named


def _names(solution: RecordedSolution) -> dict[str, list[str]]:
    """Return the names of the components of q, v, a, multipliers and z by letter or word."""
    known: Mapping[str, list[str]] = solution.metadata.get("names", {})
    names = {}
    for letter in STATES:
        size = getattr(solution, letter).shape[1]
        labels = known.get(letter) or component_names("", letter, size)
        names[letter] = labels if len(labels) == size else [f"{letter}[{index}]" for index in range(size)]
    return names


def _scene(solution: RecordedSolution) -> str:
    return str(solution.metadata.get("scene", ""))


def _package(name: str, call: str) -> Any:
    return optional_package(name, Problem(call, f"{name} is not installed [E1305]", f"pip install {name}"))
