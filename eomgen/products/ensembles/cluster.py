"""Ensembles on a Dask cluster: parts as tasks, as long as measurement says, gathered in the order of the samples.

The caller draws the values of all samples and reduces their results, block by block as without a cluster, so that
statistics do not depend on the worker of a part, nor on its number of samples.
"""

from __future__ import annotations

import importlib
import os
import uuid
import warnings
from collections import deque
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, cast

import numpy as np

from eomgen.base.data import replace
from eomgen.base.files import write_bytes
from eomgen.base.products import optional_package
from eomgen.base.threads import thread_count
from eomgen.base.version import __version__
from eomgen.errors import EomgenError, FileError, Problem, UsageError
from eomgen.products.ensembles.samples import EXTREMES, EnsemblePart, SampleBlock, SampleRunner

#: Name of a cluster of this machine's own processes.
LOCAL = "dask"
#: Seconds that a part should take: by the loss of a worker, or by Ctrl-C, so much work is lost.
PART = 2.0
#: Dask's settings return free memory to the system at once, which takes half of the time of samples. The allocator
#: reads its settings at the start of a process: the ``env`` of ``LocalCluster`` comes too late.
_SPAWNED_WITH = "distributed.nanny.pre-spawn-environ"
_ALLOCATION = {"MALLOC_TRIM_THRESHOLD_": 2**27, "MALLOC_MMAP_THRESHOLD_": 2**25, "MALLOC_ARENA_MAX": 1}
_INSTALL = "pip install 'eomgen[dask]'"


@contextmanager
def connect_cluster(cluster: object, workers: int | None) -> Iterator[Machines]:
    """Yield the machines of a cluster, connected for the body of the context.

    `cluster` is ``dask`` for processes of this machine, as many as `workers`, the address or the file of a scheduler, a
    client, or a cluster object that gives a client. Workers must have the same eomgen.

    Raises
    ------
    UsageError
        Dask is not installed, an object is not a cluster, or workers have another version of eomgen.
    FileError
        No scheduler answers.
    """
    fault = "an ensemble is run on a cluster by the package distributed of Dask, which is not installed [E0639]"
    distributed = optional_package("distributed", Problem("cluster", fault, _INSTALL))
    if workers is not None and cluster != LOCAL:
        fault = "a cluster that is given has its own workers [E0638]"
        raise UsageError(Problem("workers", fault, f"without it, or the cluster {LOCAL!r} of so many processes"))
    with ExitStack() as stack:
        client = _client(distributed, cluster, workers, stack)
        address = client.scheduler.address if client.scheduler is not None else client
        machines = Machines(client, LOCAL if cluster == LOCAL else str(address))
        machines.check_versions()
        yield machines


def _client(distributed: Any, cluster: object, workers: int | None, stack: ExitStack) -> Any:
    """Return a Dask client for a cluster as in ``connect_cluster``. Clients and processes that are created here are
    closed with the stack. Raises UsageError or FileError."""
    if isinstance(cluster, distributed.Client):
        if cluster.asynchronous:
            fault = "the client is asynchronous, and this call waits [E0641]"
            raise UsageError(Problem("cluster", fault, "Client(address), without asynchronous=True"))
        return cluster
    options: dict[str, Any] = {"timeout": 15.0, "set_as_default": False}
    if cluster == LOCAL:
        try:
            cluster = stack.enter_context(processes(thread_count() if workers is None else workers))
        except (RuntimeError, OSError) as error:
            fault = f"its processes did not start: {_first_line(error)} [E0643]"
            hint = 'if __name__ == "__main__": around the statements of a script, since each process imports the script'
            raise UsageError(Problem(f"cluster {LOCAL}", fault, hint)) from None
    if hasattr(cluster, "scheduler_address"):
        return stack.enter_context(distributed.Client(cluster, **options))
    if not isinstance(cluster, str | os.PathLike) or not str(cluster):
        hint = f"{LOCAL!r}, 'tcp://host:8786', the path of a scheduler file, a Client or a cluster of Dask"
        raise UsageError(Problem("cluster", f"{cluster!r} is not a cluster [E0642]", hint))
    text = os.fspath(cluster)
    keyword = "address" if "://" in text else "scheduler_file"
    if keyword == "scheduler_file" and not Path(text).is_file():
        hint = f"{LOCAL}, an address such as tcp://host:8786, or the file of dask scheduler --scheduler-file"
        raise FileError(Problem("cluster", f"there is no scheduler file {text} [E0640]", hint))
    try:
        return stack.enter_context(distributed.Client(**{keyword: text}, **options))
    except (OSError, ValueError, KeyError, TimeoutError) as error:
        fault = f"no scheduler answers: {_first_line(error)} [E0644]"
        hint = "the address that dask scheduler prints, and a network that lets it through"
        raise FileError(Problem(f"cluster {text}", fault, hint)) from None


def processes(count: int) -> Any:
    """Return a cluster of ``count`` processes of this machine, each with one thread. Needs ``distributed``."""
    distributed, settings = importlib.import_module("distributed"), importlib.import_module("dask").config
    standard: dict[str, Any] = settings.get(_SPAWNED_WITH, {})
    for name, number in _ALLOCATION.items():
        by_dask = str(standard.get(name, ""))
        # clusters leave theirs in this process, which goes before settings
        if os.environ.get(name, by_dask) == by_dask:
            os.environ[name] = str(number)
    quiet = {"distributed.worker.profile.enabled": False}  # which samples stacks every hundredth of a second
    with settings.set({_SPAWNED_WITH: {**standard, **_ALLOCATION}, **quiet}):
        return distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            silence_logs=50,
            dashboard_address=None,
            scheduler_kwargs={"dashboard": False},
        )


def _first_line(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0].rstrip(".: ")


class Machines:
    """A cluster that runs samples: sends parts, receives results, and chooses the size of parts by measured times.

    Attributes
    ----------
    name : for messages
    notes : further notes on the runs, after the end
    how : the ways in which samples were run, of ``SampleRunner``
    """

    def __init__(self, client: Any, name: str) -> None:
        self._client, self.name = client, name
        self.notes: tuple[str, ...] = ()
        self.how: set[str] = set()
        self._per_sample = 0.0
        self._codes: set[str] = set()

    def check_versions(self) -> None:
        """Raise UsageError if a worker has another version of eomgen, or none."""

        def version_there() -> str:  # sent by value, since it is a local function: a worker may have no such module
            module = "eomgen.base.version"
            try:
                return str(importlib.import_module(module).__version__)
            except ImportError:
                return "not installed"

        for address, version in sorted(self._client.run(version_there).items()):
            if version != __version__:
                fault = f"its eomgen is {version}, and here it is {__version__} [E0645]"
                hint = f"pip install eomgen=={__version__} where it runs"
                raise UsageError(Problem(f"cluster {self.name}, worker {address}", fault, hint))

    def blocks(self, work: SampleRunner, first: int, total: int) -> Generator[SampleBlock]:
        """Yield the blocks of samples in order from sample `first` on; three parts for each thread run ahead on the
        cluster. Solutions of kept samples are written on the way. After any end, parts left on the cluster are
        cancelled, and notes are set.

        Raises
        ------
        EomgenError
            A worker cannot run samples, or is lost over and over; the scheduler is lost.
        """
        from eomgen.products.ensembles.worker import SampleWorker, run_part  # noqa: PLC0415  # Dask is imported if it is asked for

        name, of_sample = f"eomgen-{uuid.uuid4().hex}", 8 * len(work.columns) * (len(work.thinned) + len(EXTREMES))
        self._codes = {work.model.library.digest}
        waiting: deque[tuple[int, int, Any]] = deque()
        sent = first
        try:
            self._client.register_plugin(SampleWorker(name, work), name=name)
            while sent < total or waiting:
                while sent < total and len(waiting) < 3 * (threads := self._thread_count()):
                    count = self._size(threads, total - sent, of_sample)
                    values = np.ascontiguousarray(work.design.values(sent, count))
                    options = {"key": f"{name}-{sent}", "pure": False, "retries": 3}
                    waiting.append((sent, count, self._client.submit(run_part, name, sent, values, **options)))
                    sent += count
                part = self._result(*waiting.popleft())
                for number, data in part.solutions.items():
                    write_bytes(work.file(number), data)
                yield part.block
        finally:
            with suppress(Exception):  # the cluster may be gone
                self._client.cancel([future for *_, future in waiting], force=True)
                self._client.unregister_worker_plugin(name)
            if (count := len(self._codes)) > 1:
                note = f"the model was compiled to {count} different codes, whose last digits may differ but with the"
                self.notes = (f"{note} profile reproducible [W0052]",)

    def _thread_count(self) -> int:
        """Return the number of threads of the cluster, 1 with a warning if there are no workers."""
        threads = int(sum(self._client.nthreads().values()))
        if not threads:
            message = f"cluster {self.name} has no workers: the samples wait for the first one [W0051]"
            warnings.warn(message, RuntimeWarning, stacklevel=2)
        return max(threads, 1)

    def _size(self, threads: int, left: int, of_sample: int) -> int:
        """Return the size of the next part in samples, 16 before times are known, from the remaining samples and the
        bytes of one sample: a part has 32 MB at most."""
        wanted = int(PART / self._per_sample) if self._per_sample else 16
        wanted = min(wanted, -(-left // (2 * threads)), 2**25 // of_sample)
        return max(1, wanted if wanted < 16 else wanted - wanted % 16)  # whole lanes

    def _result(self, begin: int, count: int, future: Any) -> EnsemblePart:
        """Return the result of the part with `count` samples from `begin` on, and note its time, code and way. Raises
        the worker's error of eomgen, or FileError if the part has no result; `future` is Dask's."""
        where, result = f"cluster {self.name}", cast("object", None)
        try:
            result = future.result()
        except Exception as error:  # of a worker, or of Dask
            result = error
        if isinstance(result, EnsemblePart):
            self._per_sample = result.seconds / count
            self._codes.add(result.code)
            self.how.add(result.how)
            return result
        if isinstance(result, EomgenError):
            problems = [replace(item, where=f"{where}: {item.where}".rstrip(": ")) for item in result.problems]
            raise type(result)(problems)
        samples = f"samples {begin} to {begin + count - 1}" if count > 1 else f"sample {begin}"
        kind = type(result).__name__
        if kind == "KilledWorker":
            fault = f"workers died over and over while they ran {samples} [E0647]"
            hint = "more memory for each worker; finished samples are kept, for resume"
        elif kind == "ModuleNotFoundError":
            fault = f"a worker lacks a part that the ensemble needs: {result} [E0648]"
            hint = "the same packages on all machines"
        elif isinstance(result, Exception) and "Cancelled" not in kind:
            fault, hint = f"{samples} cannot be run: {_first_line(result)} [E0650]", "the logs of its workers"
        else:
            fault, hint = "the scheduler, or the connection to it, is lost [E0651]", "resume, when there is one again"
        raise FileError(Problem(where, fault, hint))
