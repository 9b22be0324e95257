"""Code on the workers of a Dask cluster; imported if an ensemble is run on one, since Dask is optional."""

from __future__ import annotations

import tempfile
import threading
import time
from functools import partial
from pathlib import Path
from typing import cast

from distributed import Worker, WorkerPlugin, get_worker

from eomgen.base.arrays import Array
from eomgen.base.data import fields
from eomgen.base.version import __version__
from eomgen.compiled.model import CompiledModel
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.products.ensembles.designs import Design
from eomgen.products.ensembles.samples import EnsemblePart, SampleRunner
from eomgen.products.ensembles.variations import VariedOptions

#: Fields of ``SampleRunner`` that belong to a process and are made anew in another process.
_OWN = ("model", "design", "options", "folder", "stop")


class SampleWorker(WorkerPlugin):
    """Plugin of Dask that runs samples of an ensemble on each worker, also on workers that join later.

    The plugin is sent with the description of the model, from which a worker makes its own at the first part, compiled
    once for each kind of machine, or from the cache of the machine.
    """

    def __init__(self, name: str, work: SampleRunner) -> None:
        """Keep all that the samples of a runner need elsewhere; `name` is the identity of the ensemble. Raises
        UsageError for a model that was made by hand."""
        make, arguments = work.model.__reduce__()[:2]
        options = work.options
        rest = {item.name: getattr(work, item.name) for item in fields(work) if item.init and item.name not in _OWN}
        self.name, self.version, self.text = name, __version__, work.model.library.fingerprint
        self._make, self._runner = partial(make, *arguments), partial(SampleRunner, **rest)
        self._design = partial(Design, work.design.name, work.design.samples)
        self._options = partial(VariedOptions, items=options.items, common=options.common, rest=options.rest)

    def setup(self, worker: Worker) -> None:
        """Called by a worker that is given the plugin."""
        self._making, self._stop = threading.Lock(), threading.Event()
        self._model: CompiledModel | None = None

    def teardown(self, worker: Worker) -> None:
        """Called by a worker when the ensemble has ended: samples under way are given up."""
        self._stop.set()

    def run(self, first: int, values: Array) -> EnsemblePart | EomgenError | None:
        """Run the samples from number `first` on, with varied quantities (n, d), in this process. Returns the error for
        which the process can run no samples, since another attempt would have the same, and None after the end."""
        try:
            model = self._make_model()
            with tempfile.TemporaryDirectory(prefix="eomgen-runs-") as folder:
                return self._part(model, Path(folder), first, values)
        except EomgenError as error:
            return error

    def _part(self, model: CompiledModel, folder: Path, first: int, values: Array) -> EnsemblePart | None:
        design = self._design(lambda begin, count: values[begin - first :][:count])
        work = self._runner(model=model, design=design, options=self._options(model), folder=folder, stop=self._stop)
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
                if self.version != __version__ or (model := self._make()).library.fingerprint != self.text:
                    fault = f"eomgen is {__version__} here, and makes other C than at the start of the ensemble [E0673]"
                    raise UsageError(Problem("", fault, f"eomgen {self.version}, with its templates, on all machines"))
                self._model = model
            return self._model


def run_part(ensemble: str, first: int, values: Array) -> EnsemblePart | EomgenError | None:
    """Run samples with values (n, d) on this worker; raise LookupError if the plugin is missing."""
    return cast(SampleWorker, get_worker().plugins[ensemble]).run(first, values)
