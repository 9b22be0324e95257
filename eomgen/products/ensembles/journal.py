"""The folder of an ensemble: saved samples block by block with reduced statistics, resumed and checked for damaged
blocks."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.base.files import make_folder, read_arrays, read_file, write_arrays, write_text
from eomgen.base.json_text import finite
from eomgen.errors import FileError, Problem
from eomgen.products.ensembles.samples import FailedSample, SampleBlock
from eomgen.products.ensembles.statistics import Reduction

_DESCRIBED, _REDUCED, _BLOCKS = "ensemble.json", "reduced.npz", "samples"
_KIND = "part of an ensemble"


class BlockJournal:
    """The finished blocks of an ensemble, in a folder or, without one, in memory.

    Parameters
    ----------
    described : inputs of the samples; samples of another description are not resumed
    resume : whether to go on with the samples of the folder

    Attributes
    ----------
    done : number of finished samples
    failed : the failed ones among them
    reduction : statistics read from the folder; None for a new ensemble
    notes : on damaged files

    Raises
    ------
    FileError
        The folder contains an ensemble without ``resume``, or another ensemble.
    """

    def __init__(self, folder: Path | None, described: Mapping[str, Any], *, resume: bool) -> None:
        """Open the journal in a folder, with earlier blocks on ``resume``; without a folder blocks stay in
        memory."""
        self._folder = folder
        self._kept: list[SampleBlock] = []
        self.done = 0
        self.reduction: Reduction | None = None
        self.failed: list[FailedSample] = []
        self.notes: list[str] = []
        self._parts: list[tuple[int, int]] = []
        if folder is None:
            return
        make_folder(folder)
        make_folder(folder / _BLOCKS)
        path, text = folder / _DESCRIBED, json.dumps(finite(described), indent=2, sort_keys=True) + "\n"
        if path.exists():
            if not resume:
                fault = f"holds an ensemble, {_DESCRIBED} [E0670]"
                raise FileError(Problem(str(folder), fault, "--resume, which goes on with it, or another folder"))
            self._check(path, text)
            self._read(folder)
        else:
            write_text(path, text)

    def _check(self, path: Path, text: str) -> None:
        try:
            before = json.loads(read_file(path))
        except (OSError, ValueError) as error:
            fault = f"cannot be read: {error} [E0115]"
            raise FileError(Problem(str(path), fault, "another folder")) from None
        now = json.loads(text)
        if before != now:
            differ = sorted(name for name in {*before, *now} if before.get(name) != now.get(name))
            differ = [name for name in differ if name != "block"] or differ  # block sizes follow from other inputs
            fault = f"holds an ensemble with other {', '.join(differ)} [E0671]"
            raise FileError(Problem(str(path.parent), fault, "the same options again, or another folder"))

    def _read(self, folder: Path) -> None:
        path = folder / _REDUCED
        if not path.exists():
            return
        try:
            arrays, data = read_arrays(path, _KIND, "another folder")
            self.reduction = Reduction.from_arrays(arrays)
            self._parts = [(int(first), int(count)) for first, count in arrays["parts"]]
        except (FileError, KeyError):  # as by a full disk, or by another version
            self.notes.append(f"{_REDUCED} was cut short or damaged: all samples are run again [W0053]")
            self.reduction = None
            return
        self.done = int(data["done"])
        self.failed = [FailedSample(**item) for item in data["failed"]]

    def keep(self, block: SampleBlock) -> None:
        """Append a finished block: its values, extremes and failures go to a file of the folder, or stay in memory.
        Rows over time, which are reduced, are not kept."""
        if self._folder is None:
            self._kept.append(replace(block, rows=block.rows[:0].copy()))  # which would grow with the samples
        else:
            self._write_part(block)
        self.failed += block.failed
        self._parts.append((block.first, len(block.values)))
        self.done = block.first + len(block.values)

    def mend(self, run: Callable[[int, int], SampleBlock | None]) -> None:
        """Write the file of each part that is missing, cut short or damaged anew, and note that its samples, which are
        in the statistics already, were run again. `run` takes the number of the first sample, and how many follow."""
        for first, count in self._parts if self._folder else ():
            if self._is_whole(first, count) or (block := run(first, count)) is None:
                continue
            self._write_part(block)
            said = f"samples {first} to {first + count - 1} were run again"
            self.notes.append(f"{said}: their part of the folder was cut short or damaged [W0054]")

    def _is_whole(self, first: int, count: int) -> bool:
        """Return whether the file of the block with `count` samples from number `first` on can be read; checksums are
        compared."""
        try:
            arrays, data = read_arrays(self._path(first), _KIND, "another folder")
            return data["first"] == first and len(arrays["values"]) == len(arrays["extremes"]) == count
        except (FileError, KeyError):
            return False

    def _path(self, first: int) -> Path:
        return (self._folder or Path()) / _BLOCKS / f"{first:09d}.npz"

    def _write_part(self, block: SampleBlock) -> None:
        write_arrays(
            self._path(block.first), {"values": block.values, "extremes": block.extremes}, {"first": block.first}
        )

    def write(self, reduction: Reduction) -> None:
        """Write the statistics of all kept blocks, with numbers of samples and failures, to the folder, if there is
        one."""
        if self._folder is None:
            return
        failed = [dict(vars(sample), values=dict(sample.values)) for sample in self.failed]
        arrays: dict[str, NDArray[Any]] = {
            **reduction.arrays(),
            "parts": np.array(self._parts, np.int64).reshape(-1, 2),
        }
        write_arrays(self._folder / _REDUCED, arrays, {"done": self.done, "failed": finite(failed)})

    def samples(self, done: int, varied: int, columns: int) -> tuple[Array, Array]:
        """Return values (done, varied) and extremes (done, columns, 3) of all samples; files are read one by one."""
        values, extremes = np.empty((done, varied)), np.empty((done, columns, 3))
        blocks = [(block.first, vars(block)) for block in self._kept]
        paths = [] if self._folder is None else sorted((self._folder / _BLOCKS).glob("*.npz"))
        read = (read_arrays(path, _KIND, "another folder") for path in paths)
        for first, arrays in itertools.chain(blocks, ((int(data["first"]), arrays) for arrays, data in read)):
            if first < done:
                part = slice(first, first + len(arrays["values"]))
                values[part], extremes[part] = arrays["values"], arrays["extremes"]
        return values, extremes
