"""The files of a solution: all of it as ``.npz``, which can be read again, and its columns as ``.csv``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.files import read_arrays, write_arrays, write_table
from eomgen.compiled.section_loads import SectionLoads
from eomgen.errors import FileError, Problem
from eomgen.results.columns import STATES
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.events import NO_EVENTS, events_from
from eomgen.results.finding import Finding
from eomgen.results.recorded import Recorded
from eomgen.results.scenery import PosesAndScenery

_OUTCOME = ("stats", "message", "success", "interrupted")
#: Fields with arrays of their own by name.
_GROUPS = ("inputs", "outputs", "events", "energy", "error", "poses", "section_loads")


class Kept(Recorded, Protocol):
    """Contents of the file of a ``Solution``: see there."""

    @property
    def interrupted(self) -> bool: ...


def write_all(solution: Kept, seen: PosesAndScenery | None, loads: Mapping[str, SectionLoads], path: Path) -> None:
    """Write all of a solution, with its poses and the loads of its sections if they are known. Raises FileError."""
    events = solution.events.arrays() if solution.events.counts else {}
    poses = seen.poses if seen else {}
    of_sections = {f"{beam}.{name}": array for beam, item in loads.items() for name, array in item.named().items()}
    groups = (solution.inputs, solution.outputs, events, solution.energy, solution.error.arrays(), poses, of_sections)
    arrays = {name: getattr(solution, name) for name in ("t", *STATES)}
    for group, named in zip(_GROUPS, groups, strict=True):
        arrays |= {f"{group}.{name}": array for name, array in named.items()}
    outcome = {name: getattr(solution, name) for name in _OUTCOME} | {"stats": dict(solution.stats)}
    outcome["findings"] = [finding.described() for finding in solution.findings]
    scenery = {"scenery": seen.scenery} if seen else {}
    write_arrays(path, arrays, {**solution.metadata, **outcome, **scenery, "error": solution.error.described()})


def write_columns(solution: Recorded, path: Path) -> None:
    """Write the columns as a table of text. Raises FileError."""
    columns = solution.columns()
    write_table(path, list(columns), np.stack(list(columns.values()), axis=1))


def read_all(
    path: Path,
) -> tuple[dict[str, Any], dict[str, Array], PosesAndScenery | None, dict[str, SectionLoads]]:
    """Return the attributes of a solution, its inputs, and its poses and loads of sections if the file has them.

    Raises
    ------
    FileError
        The file cannot be read or is not a solution.
    """
    arrays, metadata = read_arrays(path)
    groups: dict[str, dict[str, Array]] = {name: {} for name in _GROUPS}
    plain: dict[str, Array] = {}
    for name, array in arrays.items():
        group, _, member = name.partition(".")
        if member:
            groups.setdefault(group, {})[member] = array
        else:
            plain[name] = array
    no_solution = "this is not a solution written by eomgen"
    try:
        attributes = {name: metadata.pop(name) for name in _OUTCOME}
        states: dict[str, Any] = {name: plain[name] for name in ("t", *STATES)}
        attributes["findings"] = tuple(map(Finding.from_data, metadata.pop("findings", ())))
        events = events_from(metadata["events"], groups["events"]) if "events" in metadata else NO_EVENTS
    except KeyError as error:
        raise FileError(Problem(str(path), f"{no_solution}: {error.args[0]} is missing")) from None
    rows = np.shape(states["t"])
    if any(np.ndim(array) != (1 if name == "t" else 2) or array.shape[:1] != rows for name, array in states.items()):
        raise FileError(Problem(str(path), f"{no_solution}: its arrays do not fit together"))
    wrong = [name for name, array in groups["poses"].items() if array.shape != (*rows, 7)]
    if wrong:
        raise FileError(Problem(str(path), f"{no_solution}: the poses of {wrong[0]} do not fit to its times"))
    scenery, summary = metadata.pop("scenery", None), metadata.pop("error", None)
    if summary is not None:
        attributes["error"] = ErrorEstimate.from_file(groups["error"], summary)
    attributes |= {"outputs": groups["outputs"], "energy": groups["energy"], "metadata": metadata, "events": events}
    seen = None if scenery is None else PosesAndScenery(groups["poses"], scenery)
    return {**states, **attributes}, groups["inputs"], seen, _loads(groups["section_loads"], rows, path)


def _loads(arrays: Mapping[str, Array], rows: tuple[int, ...], path: Path) -> dict[str, SectionLoads]:
    """Return the loads of the sections of each beam. Raises FileError if they do not fit to the times."""
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
            fault = f"this is not a solution written by eomgen: the section loads of {beam} do not fit to its times"
            raise FileError(Problem(str(path), fault))
    return result
