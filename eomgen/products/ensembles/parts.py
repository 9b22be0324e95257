"""Parts of an ensemble that other processes run: messages to them and back.

Messages have content alone: the description of the model, from which a process makes its own, compiled once for each
kind of machine; never a path of the sender, and never machine code.
"""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, fields
from eomgen.base.version import __version__
from eomgen.compiled.model import CompiledModel
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.products.ensembles.designs import Design
from eomgen.products.ensembles.samples import SampleBlock, SampleRunner
from eomgen.products.ensembles.variations import VariedOptions

#: Fields of ``SampleRunner`` that belong to a process and are made anew in another process.
_OWN = ("model", "design", "options", "folder", "stop")


@dataclass(frozen=True)
class RemoteSource:
    """Source of samples in another process.

    Attributes
    ----------
    ensemble : identity of the ensemble
    make : returns the model, from the cache of the process's machine if the library is there
    text : digest of the C that the sender's model is compiled from
    design : makes the design from the values of its samples
    options : makes the options of samples from the model
    runner : makes the runner of the samples from all else
    """

    ensemble: str
    make: Callable[[], CompiledModel]
    text: str
    design: Callable[[Callable[[int, int], Array]], Design]
    options: Callable[[CompiledModel], VariedOptions]
    runner: Callable[..., SampleRunner]
    version: str = __version__

    @classmethod
    def of(cls, ensemble: str, work: SampleRunner) -> RemoteSource:
        """Return the source of the samples of a runner, to be sent to other processes; `ensemble` is an identity.
        Raises UsageError for a model that was made by hand."""
        make, arguments = work.model.__reduce__()[:2]
        options, text = work.options, work.model.library.fingerprint
        varied = partial(VariedOptions, items=options.items, common=options.common, rest=options.rest)
        design = partial(Design, work.design.name, work.design.samples)
        rest = {item.name: getattr(work, item.name) for item in fields(work) if item.init and item.name not in _OWN}
        return cls(ensemble, partial(make, *arguments), text, design, varied, partial(SampleRunner, **rest))


@dataclass(frozen=True)
class EnsemblePart:
    """Samples that a process has run.

    Attributes
    ----------
    solutions : number of a sample -> the file of the sample's solution, for solutions to be kept
    seconds : that the samples took, without the model's compilation
    code : digest of the compiled model
    how : of ``SampleRunner``
    """

    block: SampleBlock
    solutions: Mapping[int, bytes]
    seconds: float
    code: str
    how: str


class WorkerState:
    """State of a process for one ensemble: the model, made for the first part."""

    def __init__(self, shipment: RemoteSource) -> None:
        self._shipment = shipment
        self._making = threading.Lock()
        self._model: CompiledModel | None = None
        self.stop = threading.Event()

    def run(self, first: int, values: Array) -> EnsemblePart | EomgenError | None:
        """Run the samples from number `first` on, with varied quantities (n, d), in this process. Returns the error for
        which the process can run no samples, since another attempt would have the same, and None if ``stop`` was
        set."""
        try:
            model = self._make_model()
            with tempfile.TemporaryDirectory(prefix="eomgen-runs-") as folder:
                return self._part(model, Path(folder), first, values)
        except EomgenError as error:
            return error

    def _part(self, model: CompiledModel, folder: Path, first: int, values: Array) -> EnsemblePart | None:
        sent = self._shipment
        design = sent.design(lambda begin, count: values[begin - first :][:count])
        work = sent.runner(model=model, design=design, options=sent.options(model), folder=folder, stop=self.stop)
        began = time.perf_counter()
        block = work.block(first, len(values))
        seconds = time.perf_counter() - began
        if block is None:
            return None
        numbers = (number for number in work.keep if first <= number < first + len(values))
        files = {number: work.file(number) for number in numbers}
        solutions = {number: file.read_bytes() for number, file in files.items() if file.exists()}
        return EnsemblePart(block, solutions, seconds, model.library.digest, work.how)

    def _make_model(self) -> CompiledModel:
        """Return the model of the ensemble, made at the first call. Raises EomgenError if the model cannot be made
        here, or if eomgen's version or the C differs from the sender's."""
        with self._making:
            if self._model is None:
                sent = self._shipment
                if sent.version != __version__ or (model := sent.make()).library.fingerprint != sent.text:
                    fault = f"eomgen is {__version__} here, and makes other C than at the start of the ensemble [E0673]"
                    raise UsageError(Problem("", fault, f"eomgen {sent.version}, with its templates, on all machines"))
                self._model = model
            return self._model
