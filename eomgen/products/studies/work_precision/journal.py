"""Journal of a study: points and reference in a folder, written one by one, from which the study resumes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.base.files import read_arrays, write_arrays
from eomgen.base.journal import Journal as Lines
from eomgen.base.text import finite
from eomgen.base.version import __version__
from eomgen.lie.product import Factor
from eomgen.products.studies.work_precision.formulations import Formulations
from eomgen.products.studies.work_precision.observation import ErrorSize, with_arrays
from eomgen.products.studies.work_precision.reference import Reference
from eomgen.products.studies.work_precision.result import Point
from eomgen.products.studies.work_precision.running import Grid

_POINTS, _REFERENCE = "points.jsonl", "reference.npz"


def identity(
    formulations: Formulations, grid: Grid, parameters: Mapping[str, float] | None, inputs: Mapping[str, Any] | None
) -> str:
    """Return a text by which points of one study are known: points of other scenes, times or parameters are not its
    own."""
    digests = b"".join(scene.digest for scene in formulations.scenes.values())
    own = {
        "scene": hashlib.sha256(digests).hexdigest(),
        "grid": [grid.start, grid.row, grid.rows, grid.coarsest, grid.recorded],
        "parameters": dict(parameters or {}),
        "inputs": {name: repr(value) for name, value in (inputs or {}).items()},
        "version": __version__,
    }
    return json.dumps(own, sort_keys=True)


class Journal:
    """Points that are there already, and the file for new ones.

    Parameters
    ----------
    folder : path or None
        None: no file.
    described : str
        As of ``identity``.
    resume : bool

    Raises
    ------
    FileError
        The folder holds a study, and this is not to go on with it, or is another one.
    """

    def __init__(self, folder: Path | None, described: str, *, resume: bool) -> None:
        self._folder = folder
        self._lines = Lines(
            folder,
            _POINTS,
            "points of a study",
            identity=described,
            others="another scene, other times or other parameters",
            row_of=lambda line: (str(line["key"]), Point.from_dict(line["point"])),
            resume=resume,
        )
        self.points = dict(self._lines.rows)

    def keep(self, key: str, point: Point) -> None:
        """Write a point."""
        self._lines.append({"key": key, "point": finite(point.to_dict())})

    def keep_reference(self, held: Reference) -> None:
        """Write the reference."""
        if self._folder is None:
            return
        observation = held.observation
        metadata = {
            "factors": [[f.group, f.name, f.q_start, f.q_size, f.v_start, f.v_size] for f in observation.factors],
            "units": list(observation.units),
            "rows": list(observation.rows),
            **held.to_dict(),
        }
        write_arrays(self._folder / _REFERENCE, observation.arrays, metadata)

    def reference(self) -> Reference | None:
        """Return the reference of a study that goes on, if it has one."""
        if self._folder is None or not (self._folder / _REFERENCE).exists():
            return None
        arrays, data = read_arrays(self._folder / _REFERENCE, "reference of a study", "another folder")
        factors = tuple(Factor(*factor) for factor in data["factors"])
        observation = with_arrays(arrays, factors, tuple(data["units"]), tuple(data["rows"]))
        uncertainty = {name: ErrorSize(**size) for name, size in data["uncertainty"].items()}
        return Reference(observation, data["by"], data["held against"], uncertainty)
