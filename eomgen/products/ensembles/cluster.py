"""Ensembles on a Dask cluster: parts as tasks, as long as measurement says, gathered in the order of the samples.

The caller draws the values of all samples and reduces their results, block by block as without a cluster, so that
statistics do not depend on the worker of a part, nor on its number of samples.
"""

from __future__ import annotations

import importlib
import os
import time
import uuid
import warnings
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.data import dataclass, field, replace
from eomgen.base.files import write_bytes
from eomgen.base.products import optional_package
from eomgen.base.threads import thread_count
from eomgen.base.version import __version__
from eomgen.errors import FileError, Problem, UsageError
from eomgen.products.ensembles.parts import EnsemblePart, Refusal, RemoteSource
from eomgen.products.ensembles.samples import EXTREMES, SampleBlock, SampleRunner

#: Name of a cluster of this machine's own processes.
LOCAL = "dask"
#: Seconds that a part should take: the cost of losing a worker.
_PART = 2.0
#: Number of samples of the first parts, before a time per sample is known; larger parts are multiples of this number,
#: so that lanes are full.
_FIRST = 16
#: Number of parts for each thread of the cluster that are sent before the first part is reduced.
_AHEAD = 3
#: Bytes of the results of a part, and of all parts ahead, at most.
_LARGEST, _ALL_AHEAD = 2**25, 2**30
#: Number of retries of a part after an unexpected error of its worker, and seconds within which a scheduler has to
#: answer.
_RETRIES, _PATIENCE = 3, 15.0
#: Seconds between two questions to the scheduler how many threads there are.
_SELDOM = 2.0
#: Dask's settings return free memory to the system at once, which takes half of the time of samples. The allocator
#: reads its settings at the start of a process: the ``env`` of ``LocalCluster`` comes too late.
_SPAWNED_WITH = "distributed.nanny.pre-spawn-environ"
_ALLOCATION = {"MALLOC_TRIM_THRESHOLD_": 2**27, "MALLOC_MMAP_THRESHOLD_": 2**25, "MALLOC_ARENA_MAX": 1}
#: By default workers sample their stacks every hundredth of a second, without use here.
_QUIET = {"distributed.worker.profile.enabled": False}
_INSTALL = "pip install 'eomgen[dask]'"


@dataclass
class Machines:
    """A cluster that runs samples.

    Attributes
    ----------
    name : for messages
    notes : further notes on the runs, after the end
    how : the ways in which samples were run, of ``SampleRunner``
    """

    client: Any
    name: str
    notes: tuple[str, ...] = ()
    how: set[str] = field(default_factory=set)

    def blocks(self, work: SampleRunner, first: int, total: int) -> Generator[SampleBlock]:
        """Yield the blocks of samples in order, beginning with sample ``first``.

        Raises
        ------
        EomgenError
            A worker cannot run samples, or is lost over and over; the scheduler is lost.
        """
        yield from _ClusterEnsemble(self, work, total).parts(first)


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
        client, name = _client(distributed, cluster, workers, stack)
        _check_versions(client, name)
        yield Machines(client, name)


def _client(distributed: Any, cluster: object, workers: int | None, stack: ExitStack) -> tuple[Any, str]:
    """Return a Dask client for a cluster as in ``connect_cluster``, and a name for messages. Clients and processes that
    are created here are closed with the stack. Raises UsageError or FileError."""
    if isinstance(cluster, distributed.Client):
        if cluster.asynchronous:
            fault = "the client is asynchronous, and this call waits [E0641]"
            raise UsageError(Problem("cluster", fault, "Client(address), without asynchronous=True"))
        return cluster, _cluster_name(cluster)
    options: dict[str, Any] = {"timeout": _PATIENCE, "set_as_default": False}
    if cluster == LOCAL:
        count = thread_count() if workers is None else workers
        made = _start_processes(lambda: processes(count))
        stack.enter_context(made)
        return stack.enter_context(distributed.Client(made, **options)), f"of {count} processes"
    if hasattr(cluster, "scheduler_address"):
        client = stack.enter_context(distributed.Client(cluster, **options))
        return client, _cluster_name(client)
    if not isinstance(cluster, str | os.PathLike) or not str(cluster):
        hint = f"{LOCAL!r}, 'tcp://host:8786', the path of a scheduler file, a Client or a cluster of Dask"
        raise UsageError(Problem("cluster", f"{cluster!r} is not a cluster [E0642]", hint))
    text = os.fspath(cluster)
    if "://" in text:
        return stack.enter_context(_connect_client(text, lambda: distributed.Client(text, **options))), text
    if not Path(text).is_file():
        fault = f"there is no scheduler file {text} [E0640]"
        hint = f"{LOCAL}, an address such as tcp://host:8786, or the file of dask scheduler --scheduler-file"
        raise FileError(Problem("cluster", fault, hint))
    return stack.enter_context(_connect_client(text, lambda: distributed.Client(scheduler_file=text, **options))), text


def processes(count: int) -> Any:
    """Return a cluster of ``count`` processes of this machine, each with one thread. Needs ``distributed``."""
    distributed, settings = importlib.import_module("distributed"), importlib.import_module("dask").config
    standard: dict[str, Any] = settings.get(_SPAWNED_WITH, {})
    for name, number in _ALLOCATION.items():
        by_dask = str(standard.get(name, ""))
        if (
            os.environ.get(name, by_dask) == by_dask
        ):  # clusters leave theirs in this process, which goes before settings
            os.environ[name] = str(number)
    with settings.set({_SPAWNED_WITH: {**standard, **_ALLOCATION}, **_QUIET}):
        return distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            silence_logs=50,
            dashboard_address=None,
            scheduler_kwargs={"dashboard": False},
        )


def _cluster_name(client: Any) -> str:
    return str(client.scheduler.address if client.scheduler is not None else client)


def _start_processes(start: Callable[[], Any]) -> Any:
    """Return the cluster of local processes that `start` makes. Raises UsageError if processes do not start."""
    try:
        return start()
    except (RuntimeError, OSError) as error:
        fault = f"its processes did not start: {_first_line(error)} [E0643]"
        hint = 'if __name__ == "__main__": around the statements of a script, since each process imports the script'
        raise UsageError(Problem(f"cluster {LOCAL}", fault, hint)) from None


def _connect_client(name: str, connect: Callable[[], Any]) -> Any:
    """Return the client that `connect` makes. Raises FileError, with the cluster's `name`, if no scheduler answers."""
    try:
        return connect()
    except (OSError, ValueError, KeyError, TimeoutError) as error:
        fault = f"no scheduler answers: {_first_line(error)} [E0644]"
        hint = "the address that dask scheduler prints, and a network that lets it through"
        raise FileError(Problem(f"cluster {name}", fault, hint)) from None


def _first_line(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0].rstrip(".: ")


def _check_versions(client: Any, name: str) -> None:
    """Raise UsageError if a worker of the client has another version of eomgen, or none; `name` of the cluster is for
    messages."""

    def version_there() -> str:  # sent by value, since it is a local function: a worker may have no such module
        module = "eomgen.base.version"
        try:
            return str(importlib.import_module(module).__version__)
        except ImportError:
            return ""

    for address, version in sorted(client.run(version_there).items()):
        if version != __version__:
            fault = f"its eomgen is {version}, and here it is {__version__} [E0645]"
            if not version:
                fault = f"it has no eomgen, and here it is {__version__} [E0646]"
            hint = f"pip install eomgen=={__version__} where it runs"
            raise UsageError(Problem(f"cluster {name}, worker {address}", fault, hint))


class _ClusterEnsemble:
    """The run of one ensemble's samples on a cluster: sends parts, receives results, and chooses the size of parts by
    measured times."""

    def __init__(self, machines: Machines, work: SampleRunner, total: int) -> None:
        self._machines, self._client, self._work, self._total = machines, machines.client, work, total
        self._shipment = RemoteSource.of(f"eomgen-{uuid.uuid4().hex}", work)
        self._per_sample = 0.0
        self._bytes = 8 * len(work.columns) * (len(work.thinned) + len(EXTREMES))
        self._threads, self._asked, self._lonely = 0, 0.0, False
        self._codes: set[str] = {work.model.library.digest}

    def parts(self, first: int) -> Iterator[SampleBlock]:
        """Yield the blocks of samples in order from sample `first` on; parts run on the cluster ahead. Solutions of
        kept samples are written on the way. After any end, parts left on the cluster are cancelled, and notes are
        set."""
        distributed = importlib.import_module("distributed")
        from eomgen.products.ensembles.worker import SourceDelivery, run_part  # noqa: PLC0415  # Dask is imported if it is asked for

        name = self._shipment.ensemble
        pending: dict[Any, tuple[int, int]] = {}
        finished = distributed.as_completed(loop=self._client.loop, with_results=True, raise_errors=False)
        done: dict[int, EnsemblePart] = {}
        sent, wanted = first, first  # the first samples that were not sent, and that were not given
        try:
            self._client.register_plugin(SourceDelivery(self._shipment), name=name)
            while wanted < self._total:
                while sent < self._total and len(pending) + len(done) < _AHEAD * max(self._count(), 1):
                    count = self._size(self._total - sent)
                    values = np.ascontiguousarray(self._work.design.values(sent, count))
                    future = self._client.submit(
                        run_part, name, sent, values, key=f"{name}-{sent}", pure=False, retries=_RETRIES
                    )
                    pending[future] = (sent, count)
                    finished.add(future)
                    sent += count
                future, result = next(finished)
                begin, count = pending.pop(future)
                done[begin] = self._take_result(begin, count, future.status, result)
                future.release()
                while (part := done.pop(wanted, None)) is not None:
                    for number, data in part.solutions.items():
                        write_bytes(self._work.file(number), data)
                    wanted += len(part.block.values)
                    yield part.block
        finally:
            with suppress(Exception):  # the cluster may be gone
                self._client.cancel(list(pending), force=True)
                self._client.unregister_worker_plugin(name)
            self._machines.notes = self._notes()

    def _count(self) -> int:
        """Return the number of threads of the cluster, asked every two seconds; warns once if there are no workers."""
        if (now := time.monotonic()) - self._asked > _SELDOM or not self._threads:
            self._threads, self._asked = sum(self._client.nthreads().values()), now
            if not self._threads and not self._lonely:
                self._lonely = True
                message = f"cluster {self._machines.name} has no workers: the samples wait for the first one [W0051]"
                warnings.warn(message, RuntimeWarning, stacklevel=2)
        return self._threads

    def _size(self, left: int) -> int:
        """Return the number of samples of the next part, given the number of remaining samples."""
        threads = max(self._threads, 1)
        wanted = _FIRST if not self._per_sample else int(_PART / self._per_sample)
        bytes_each = min(_LARGEST, _ALL_AHEAD // (_AHEAD * threads))
        wanted = min(wanted, -(-left // (2 * threads)), bytes_each // self._bytes)
        return max(1, wanted - wanted % _FIRST if wanted > _FIRST else wanted)

    def _take_result(self, begin: int, count: int, status: str, result: Any) -> EnsemblePart:
        """Return the result of the part with `count` samples from `begin` on, and note its time, code and way. Raises
        the worker's error of eomgen, or FileError if the part has no result; `status` is Dask's."""
        where = f"cluster {self._machines.name}"
        if isinstance(result, Refusal):
            raise result.kind([replace(item, where=f"{where}: {item.where}".rstrip(": ")) for item in result.problems])
        if isinstance(result, EnsemblePart):
            each = result.seconds / count
            self._per_sample = each if not self._per_sample else 0.7 * self._per_sample + 0.3 * each
            self._codes.add(result.code)
            self._machines.how.add(result.how)
            return result
        samples = f"samples {begin} to {begin + count - 1}" if count > 1 else f"sample {begin}"
        error = result[1] if isinstance(result, tuple) else result
        kind = type(error).__name__
        if kind == "KilledWorker":
            fault = f"workers died over and over while they ran {samples} [E0647]"
            hint = "more memory for each worker; finished samples are kept, for resume"
        elif status == "error" and kind == "ModuleNotFoundError":
            fault = f"a worker lacks a part that the ensemble needs: {error} [E0648]"
            hint = "the same packages on all machines"
        elif status == "error":
            fault, hint = f"{samples} cannot be run: {_first_line(error)} [E0650]", "the logs of its workers"
        else:
            fault, hint = "the scheduler, or the connection to it, is lost [E0651]", "resume, when there is one again"
        raise FileError(Problem(where, fault, hint))

    def _notes(self) -> tuple[str, ...]:
        if len(self._codes) == 1:
            return ()
        message = (
            f"the model was compiled to {len(self._codes)} different codes, here and on the workers: the last digits"
        )
        return (f"{message} may depend on which of them ran a sample, but with the profile reproducible [W0052]",)
