"""Journal of a study: its points and its reference in a folder, written as they come, from which it goes on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.errors import FileError, Problem
from eomgen.files import make_folder, read_arrays, write_arrays, write_text
from eomgen.lie.product import Factor
from eomgen.studies.work_precision.formulations import Formulations
from eomgen.studies.work_precision.measured import Point
from eomgen.studies.work_precision.observation import ErrorSize, with_arrays
from eomgen.studies.work_precision.reference import Reference
from eomgen.studies.work_precision.running import Grid
from eomgen.text import finite
from eomgen.version import __version__

_POINTS, _REFERENCE = "points.jsonl", "reference.npz"


def identity(
    found: Formulations,
    grid: Grid,
    parameters: Mapping[str, float] | None,
    inputs: Mapping[str, Any] | None,
) -> str:
    """Return a text by which points of one study are known: those of other scenes, times or parameters are not its
    own."""
    digests = b"".join(scene.digest for scene in found.scenes.values())
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
        self.points: dict[str, Point] = {}
        self._folder = folder
        if folder is None:
            return
        make_folder(folder)
        self._path = folder / _POINTS
        if self._path.exists():
            if not resume:
                what = f"holds the points of a study, {_POINTS}"
                raise FileError(Problem(str(folder), what, "--resume, which goes on with it, or another folder"))
            self._read(described)
        else:
            self._append({"study": described})

    def _read(self, described: str) -> None:
        try:
            text = self._path.read_text(encoding="utf-8")
            whole = text[: text.rfind("\n") + 1]  # a study may be killed in the middle of a line
            lines = [json.loads(line) for line in whole.splitlines()]
            if lines[0]["study"] != described:
                what = "holds the points of a study of another scene, other times or other parameters"
                raise FileError(Problem(str(self._folder), what, "another folder"))
            self.points = {line["key"]: Point.from_dict(line["point"]) for line in lines[1:]}
            if whole != text:
                write_text(self._path, whole)
        except OSError as error:
            what = f"cannot be read: {error.strerror or error}"
            raise FileError(Problem(str(self._path), what, "another folder")) from None
        except (ValueError, KeyError, IndexError, TypeError):
            what = "these are not the points of a study"
            raise FileError(Problem(str(self._path), what, "another folder")) from None

    def keep(self, key: str, point: Point) -> None:
        """Write a point."""
        self._append({"key": key, "point": finite(point.to_dict())})

    def _append(self, line: Mapping[str, Any]) -> None:
        if self._folder is None:
            return
        try:
            with self._path.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(line) + "\n")
        except OSError as error:
            what = f"cannot be written: {error.strerror or error}"
            raise FileError(Problem(str(self._path), what, "another folder")) from None

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
