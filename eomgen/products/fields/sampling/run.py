"""Runs of sampling: a warm-up, then samples, with a checkpoint in a folder from which they go on to the same bits."""

from __future__ import annotations

import dataclasses
import math
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.files import make_folder, read_arrays, write_arrays
from eomgen.base.messages import listed, nearest
from eomgen.base.messages import shown as quoted
from eomgen.base.progress import Interrupts, Progress, show_progress
from eomgen.errors import FileError, Problem, UsageError
from eomgen.products.fields.documents.document import FieldSystem
from eomgen.products.fields.documents.field_reading import fields_from_data, load_fields
from eomgen.products.fields.documents.tables import Chains
from eomgen.products.fields.posteriors import Outcome, Sampler
from eomgen.products.fields.sampling.problem import TRAJECTORY, FieldProblem, at_settings, field_problem, start_fields
from eomgen.products.fields.sampling.result import FieldSamples

#: The file of a folder from which a run goes on.
CHECKPOINT = "checkpoint.npz"
#: Settings that may differ if a run goes on.
_OPEN = ("samples", "field")
#: Settings that are arguments of a sampler.
_OF_SAMPLERS = ("method", "step", "duration", "first", "jitter", "guard", "chains", "start", "seed", "bins")


def sample(
    described: FieldSystem | str | os.PathLike[str] | Mapping[str, Any],
    *,
    folder: str | os.PathLike[str] | None = None,
    resume: bool = False,
    mass: str | None = None,
    progress: Progress | bool | None = None,
    checkpoint_every: float = 60.0,
    **settings: Any,
) -> FieldSamples:
    """Sample the fields of a file by Hamiltonian Monte Carlo.

    Ctrl-C ends the run with the results so far (``interrupted``); a second Ctrl-C stops at once.

    Parameters
    ----------
    described : str, Path, mapping or FieldSystem
        Path of a ``.toml`` file with ``kind = "hamiltonian"`` and a ``[mesh]``, or the data of such a file.
    folder : path, optional
        Folder of the checkpoint, ``checkpoint.npz``, which is written every ``checkpoint_every`` seconds, at the end,
        and at an interruption, in place of an earlier one, with ``resume`` or not. The folder is made if missing; None:
        no checkpoint.
    resume : bool
        Go on from the checkpoint of the folder; of all settings only ``samples`` may differ from before, and not below
        the samples there.
    mass : {"fisher", "prior", "unit"}
        Mass matrix of the momenta; the file's by default.
    progress : callable or True
        A function of (trajectories done, all trajectories), or True for a bar; none by default.
    checkpoint_every : float
        Time between checkpoints, s.
    **settings
        In place of the settings in ``[sampling]``: ``method``, ``step`` (0: found by the warm-up; another step is kept,
        and cut by ``guard``), ``duration`` of a trajectory, ``first`` (``random``, ``drift``, ``kick``), ``jitter``,
        ``guard``, ``chains``, ``start`` (``mode``, ``prior``, ``zero``, or the path of a ``.npy`` file with white
        fields, from the current folder), ``warm_up`` and ``samples`` of each chain, ``seed``, ``field``, ``watched``
        (number of cells whose values are kept), ``bins`` of wave numbers, ``transforms`` (``scipy``, or ``fftw`` by the
        package pyfftw) and ``precision`` of gradients (``double``, ``single``).

    Returns
    -------
    FieldSamples
        Samples with diagnostics; chains that do not agree raise no error, but have a sentence in ``message``.

    Raises
    ------
    DescriptionError
        The file is at fault.
    FileError
        A file, the checkpoint or the folder cannot be read or written.
    ModelError
        Memory, operators, data or the file of a start do not fit the mesh, or ``mass`` does not fit the fields.
    NumericalError
        No mode is found, U or its second derivatives are not finite at a chain's place, or U has no lower bound.
    UsageError
        A path, ``mass`` or setting is unknown or cannot be taken, ``resume`` without a folder, or a checkpoint of other
        settings, another posterior or more samples.
    """
    if isinstance(described, FieldSystem):
        system = described
    else:
        system = fields_from_data(described) if isinstance(described, Mapping) else load_fields(described)
    chosen = _settings(system.sampling, settings)
    if resume and folder is None:
        raise UsageError(Problem("resume", "a run goes on from the checkpoint of a folder [E0849]", 'folder="out"'))
    with at_settings(system, settings):
        problem = field_problem(dataclasses.replace(system, sampling=chosen), chosen.chains)
        if (field := problem.watched) not in (known := list(problem.posterior.operators)):
            raise UsageError(Problem("sample: field", f"there is no field {field!r} [E0827]", nearest(field, known)))
        run = _Run(problem, chosen, mass or system.mass, None if folder is None else make_folder(Path(folder)), resume)
    with show_progress(progress, system.name) as bar, Interrupts() as interrupts:
        return run.go(bar, interrupts, checkpoint_every)


def _settings(standard: Chains, options: Mapping[str, Any]) -> Chains:
    """Return the settings of a run: ``standard`` with the given options. Raises UsageError for an unknown name, a wrong
    type, and a count that is too small."""
    known = [*Chains.model_fields]
    for name, value in options.items():
        if name not in known:
            raise UsageError(Problem(f"sample: {name}", "there is no such setting [E0850]", nearest(name, known)))
        wanted = type(getattr(standard, name))
        if isinstance(value, bool) or not isinstance(value, int | float if wanted is float else wanted):
            kind = {int: "a whole number", float: "a number", str: "a text"}[wanted]
            fault = f"{kind} is needed, not {quoted(value)} [E0853]"
            raise UsageError(Problem(f"sample: {name}", fault, f"{getattr(standard, name)!r}"))
    made = standard.model_copy(update=options)
    for key, least in (("samples", 0), ("warm_up", 0), ("chains", 1), ("watched", 1), ("bins", 1)):
        if getattr(made, key) < least:
            raise UsageError(Problem(f"sample: {key}", f"{getattr(made, key)} is invalid [E0819]", f"from {least} on"))
    return made


class _Run:
    """A warm-up and samples, from the start, or with ``resume`` from the checkpoint in ``folder``; None for no
    folder."""

    def __init__(self, problem: FieldProblem, settings: Chains, mass: str, folder: Path | None, resume: bool) -> None:
        self.problem, self.settings, self.mass, self.folder = problem, settings, mass, folder
        self.warm_up = np.full((settings.chains, settings.warm_up, len(TRAJECTORY)), np.nan)
        self.warmed = np.zeros(settings.chains, int)
        self.seconds, self.gradients = 0.0, 0
        stored = self.read(folder) if resume and folder is not None else None
        self.sampler = self.start(stored is not None)
        self.record = self.sampler.record(settings.samples)
        if stored is not None:
            self.take(*stored)

    def start(self, resume: bool) -> Sampler:
        settings = self.settings
        options: Any = {name: value for name, value in vars(settings).items() if name in _OF_SAMPLERS}
        if resume:
            options["start"] = None
        elif Path(settings.start).suffix == ".npy":
            options["start"] = start_fields(Path(settings.start), self.problem, settings.chains)
        size = self.problem.mesh.size
        count = min(settings.watched, size)
        golden = round(size * (math.sqrt(5.0) - 1.0) / 2.0)
        stride = next(step for step in range(golden, 2 * size) if math.gcd(step, size) == 1)
        spread = np.sort(np.arange(count) * stride % size)
        return Sampler(self.problem.posterior, mass=self.mass, watched=spread, **options)

    def go(self, bar: Progress | None, interrupts: Interrupts, every: float) -> FieldSamples:
        """Make the missing trajectories of warm-up and samples, and return the results; end early at an interruption.
        ``bar`` is called with trajectories done and in all; ``every`` is the time between checkpoints, s."""
        began, settings = time.perf_counter(), self.settings
        spent, saved = self.seconds, began

        def stop() -> bool:
            return interrupts.heard

        def show() -> None:
            if bar is not None:
                total = settings.chains * (settings.warm_up + settings.samples)
                bar(int(self.warmed.sum() + self.record.counts.sum()), total)

        def report_sample(_: int, outcome: Outcome, __: float) -> None:
            nonlocal saved
            now = time.perf_counter()
            self.gradients += outcome.gradients
            self.seconds = spent + now - began
            show()
            if self.folder is not None and now - saved > every:
                self.save(self.folder)
                saved = now

        def record_warm_up(chain: int, outcome: Outcome, potential: float) -> None:
            row = (outcome.error, outcome.accepted, outcome.gradients, potential)
            self.warm_up[chain, self.warmed[chain]] = row
            self.warmed[chain] += 1
            report_sample(chain, outcome, potential)

        show()
        whole = True
        if not self.record.counts.any():
            adapt = settings.step == 0.0
            whole = self.sampler.warm_up(settings.warm_up, adapt=adapt, goes_on=True, stop=stop, seen=record_warm_up)
        if whole:
            whole = self.sampler.fill(self.record, self.problem.watched, stop=stop, seen=report_sample)
        self.seconds = spent + time.perf_counter() - began
        if self.folder is not None:
            self.save(self.folder)
        return FieldSamples(
            self.problem,
            settings,
            self.mass,
            self.record.samples(self.sampler.steps),
            self.warm_up[:, : int(self.warmed.min())],
            self.sampler.largest_step,
            self.sampler.frequency,
            self.seconds,
            self.gradients,
            not whole,
        )

    # -- checkpoints -------------------------------------------------------------------------------------------------

    def fixed_settings(self) -> dict[str, Any]:
        """Return the settings, mass, watched field and digest of the posterior, which have to be the same if a run goes
        on."""
        settings = {name: value for name, value in vars(self.settings).items() if name not in _OPEN}
        settings["start"] = Path(self.settings.start).name  # from any folder
        return {**settings, "mass": self.mass, "field": self.problem.watched, "posterior": self.problem.digest}

    def save(self, folder: Path) -> None:
        arrays, metadata = self.sampler.state()
        arrays |= {f"record.{name}": array for name, array in self.record.arrays().items()}
        arrays |= {"warm_up": self.warm_up, "warmed": self.warmed.astype(float)}
        told: dict[str, Any] = {"settings": self.fixed_settings(), "chains": metadata}
        told |= {"seconds": self.seconds, "gradients": self.gradients}
        write_arrays(folder / CHECKPOINT, arrays, told)

    def read(self, folder: Path) -> tuple[dict[str, Array], dict[str, Any]]:
        """Return arrays and JSON data of the checkpoint in a folder. Raises FileError for a file of another kind, and
        UsageError for other settings, another posterior, or more samples than wanted."""
        path = folder / CHECKPOINT
        arrays, told = read_arrays(path, "checkpoint of chains", "a folder of eomgen sample --out")
        missing = [name for name in ("settings", "chains", "seconds", "gradients") if name not in told]
        missing += [name for name in ("warm_up", "warmed", "record.counts") if name not in arrays]
        if missing:
            fault = f"this is not a checkpoint of chains: {listed(missing)} is missing [E0855]"
            raise FileError(Problem(str(path), fault, "a folder of eomgen sample --out"))
        settings, theirs = self.fixed_settings(), told["settings"]
        for name, value in settings.items():
            if name not in theirs or theirs[name] != value:
                fault = f"it belongs to a run with {name} = {theirs.get(name)!r}, and here it is {value!r} [E0857]"
                if name == "posterior":
                    fault = "it belongs to another posterior: the file or its data have changed since [E0858]"
                raise UsageError(Problem(str(path), fault, "the same settings, or another folder"))
        done = int(arrays["record.counts"].max())
        if done > self.settings.samples:
            fault = f"it has {done} samples of each chain, and {self.settings.samples} are asked for [E0856]"
            raise UsageError(Problem(str(path), fault, f"samples from {done} on"))
        return arrays, told

    def take(self, arrays: Mapping[str, Array], told: Mapping[str, Any]) -> None:
        self.sampler.take(arrays, told["chains"], str(self.folder))
        self.record.take({name.removeprefix("record."): values for name, values in arrays.items()})
        self.warm_up, self.warmed = arrays["warm_up"].copy(), arrays["warmed"].astype(int)
        self.seconds, self.gradients = float(told["seconds"]), int(told["gradients"])
