"""A solution in formats of others: tables of pandas, data sets of xarray, files of MATLAB."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from eomgen.base.files import write_bytes
from eomgen.errors import Problem, UsageError
from eomgen.results.columns import STATES
from eomgen.results.events import BLOCKS, Events
from eomgen.results.recorded import Recorded

if TYPE_CHECKING:
    import pandas
    import xarray

T = TypeVar("T")

#: Letters of a name in MATLAB's files.
_MATLAB_NAME = 31


def to_pandas(solution: Recorded) -> pandas.DataFrame:
    """Return all columns over ``t``; see ``Solution.to_pandas``."""
    columns = solution.columns()
    time = columns.pop("t")
    package = _package("pandas", "to_pandas")
    frame: pandas.DataFrame = package.DataFrame(columns, index=package.Index(time, name="t"))
    frame.attrs |= {"units": solution.units(), "scene": _scene(solution), "message": solution.message}
    return frame


def to_xarray(solution: Recorded) -> xarray.Dataset:
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


def write_matlab(solution: Recorded, path: Path) -> None:
    """Write a file of MATLAB's version 5. Raises FileError if it cannot be written."""
    from scipy.io import savemat  # noqa: PLC0415  # slow to import

    stream = io.BytesIO()
    arrays = {name: getattr(solution, name) for name in ("t", *STATES)}
    described = {
        "names": {letter: np.array(list_, dtype=object) for letter, list_ in _names(solution).items()},
        "units": {
            **{letter: np.array(list_, dtype=object) for letter, list_ in _units(solution).items()},
            **{name: _struct(labels) for name, labels in _labels(solution).items()},
        },
        "message": solution.message,
        "scene": _scene(solution),
    }
    savemat(
        stream,  # type: ignore[arg-type]  # the stubs do not know that it takes streams
        {
            **arrays,
            "inputs": _struct(solution.inputs),
            "outputs": _struct(solution.outputs),
            "energy": _struct(solution.energy),
            **({"events": _events(solution.events)} if solution.events.counts else {}),
            **described,
        },
        oned_as="column",
    )
    write_bytes(path, stream.getvalue())


def write_parquet(solution: Recorded, path: Path) -> None:
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


def _labels(solution: Recorded) -> dict[str, dict[str, str]]:
    """Return the units of inputs, outputs and energies by their names."""
    units = solution.units()
    of_outputs = solution.metadata.get("units", {}).get("outputs", {})
    return {
        "inputs": {name: units.get(f"input.{name}", "") for name in solution.inputs},
        "outputs": {name: of_outputs.get(name, "") for name in solution.outputs},
        "energy": {name: units.get(f"energy.{name}", "") for name in solution.energy},
    }


def _events(events: Events) -> dict[str, Any]:
    """Return events as one struct of blocks, with a row for each; ``counts`` includes events that are only counted."""
    blocks = {name: getattr(events, name) for name in ("t", *BLOCKS)}
    return {"names": np.array(events.names, dtype=object), **blocks, "counts": _struct(events.counts)}


def _struct(arrays: Mapping[str, T]) -> dict[str, T]:
    """Return values by names that MATLAB takes as fields."""
    named: dict[str, T] = {}
    for name, array in arrays.items():
        field = re.sub(r"\W", "_", name)[:_MATLAB_NAME]
        named[field if field[0].isalpha() else f"f{field}"[:_MATLAB_NAME]] = array
    return named


def _names(solution: Recorded) -> dict[str, list[str]]:
    """Return the names of the components of each block, as ``columns`` has them."""
    every = [name for name in solution.columns() if name != "t"]
    names: dict[str, list[str]] = {}
    start = 0
    for letter in STATES:
        size = getattr(solution, letter).shape[1]
        names[letter] = every[start : start + size]
        start += size
    return names


def _units(solution: Recorded) -> dict[str, list[str]]:
    units = solution.units()
    return {letter: [units.get(name, "") for name in names] for letter, names in _names(solution).items()}


def _scene(solution: Recorded) -> str:
    return str(solution.metadata.get("scene", ""))


def _package(name: str, call: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise UsageError(Problem(call, f"{name} is not installed", f"pip install {name}")) from None
