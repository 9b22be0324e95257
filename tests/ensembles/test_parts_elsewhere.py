"""Ensembles in parts on a cluster, by a stand-in for Dask that runs parts at once."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.base.version import __version__
from eomgen.errors import EomgenError, FileError, Problem, UsageError
from eomgen.products.ensembles import cluster
from eomgen.products.ensembles.samples import EnsemblePart
from tests.ensembles.carts import VARY, bits, built_cart, small_blocks

OPTIONS: dict[str, Any] = {"vary": VARY, "samples": 40, "seed": 3}
WORKER = "eomgen.products.ensembles.worker"


class Future:
    """The result of a part, or an error."""

    def __init__(self, made: object, raised: Exception | None = None) -> None:
        self.made, self.raised = made, raised

    def result(self) -> object:
        if self.raised is not None:
            raise self.raised
        return self.made


class Client:
    """A client of two workers with a thread each."""

    asynchronous, scheduler, version, older = False, None, __version__, ""

    def __init__(self, *place: object, **options: object) -> None:
        self.place, self.options = place, options
        self.sizes: list[int] = []
        self.cancelled: list[Future] | None = None
        if options.get("address") == "tcp://nowhere:1":
            raise OSError("Timed out.\nmore")

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def run(self, function: Callable[[], object]) -> dict[str, object]:
        assert function() == __version__
        return {"tcp://here:1": __version__, "tcp://there:1": self.version}

    def nthreads(self) -> dict[str, int]:
        return {"tcp://here:1": 1, "tcp://there:1": 1}

    def register_plugin(self, plugin: Any, name: str) -> None:
        PLUGINS[name] = pickle.loads(pickle.dumps(plugin))
        PLUGINS[name].version = self.older or plugin.version
        PLUGINS[name].setup(None)

    def unregister_worker_plugin(self, name: str) -> None:
        PLUGINS.pop(name).teardown(None)

    def submit(self, function: Callable[..., object], name: str, first: int, values: Any, **options: object) -> Future:
        assert options == {"key": f"{name}-{first}", "pure": False, "retries": 3}
        self.sizes.append(len(values))
        return Future(pickle.loads(pickle.dumps(function(name, first, values))))

    def cancel(self, futures: list[Future], *, force: bool) -> None:
        self.cancelled = futures


#: Plugins of the worker, by name.
PLUGINS: dict[str, Any] = {}


@pytest.fixture(autouse=True)
def dask(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The stand-in; code of workers is imported with it, and forgotten."""
    made: Any = ModuleType("distributed")
    made.Client, made.Worker, made.WorkerPlugin = Client, object, object
    made.get_worker = lambda: SimpleNamespace(plugins=PLUGINS)
    monkeypatch.setitem(sys.modules, "distributed", made)
    before = sys.modules.pop(WORKER, None)
    yield made
    sys.modules.pop(WORKER, None)
    if before is not None:
        sys.modules[WORKER] = before


@pytest.fixture
def client() -> Client:
    return Client()


@pytest.fixture
def cart() -> eomgen.Model:
    return built_cart()


def test_parts_have_the_bits_failures_and_solutions_of_local_runs(
    cart: eomgen.Model, client: Client, tmp_path: Path
) -> None:
    mass = np.linspace(1.0, 2.0, 40)
    mass[17] = -1.0
    table = {"mass": mass, "push": np.full(40, 2.0)}
    with small_blocks():
        here = cart.simulate_many(table=table, folder=tmp_path / "here", keep=[2, 33])
        there = cart.simulate_many(table=table, folder=tmp_path / "there", keep=[2, 33], cluster=client)
    assert bits(there) == bits(here) and there.failed == here.failed and len(there.failed) == 1
    assert (there.how, there.done) == (here.how, 40) and not there.notes == here.notes is None
    assert client.sizes[0] == 10 and sum(client.sizes) == 40  # a quarter of the rest for each of two threads
    assert client.cancelled == [] and not PLUGINS
    for number in (2, 33):
        files = [tmp_path / place / "runs" / f"sample_{number:07d}.npz" for place in ("here", "there")]
        solutions = [eomgen.Solution.load(file) for file in files]
        np.testing.assert_array_equal(solutions[0].q, solutions[1].q)


def test_an_interrupted_ensemble_leaves_nothing_on_the_cluster(cart: eomgen.Model, client: Client) -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    part = cart.simulate_many(**OPTIONS, cluster=client, progress=interrupt)
    assert part.interrupted and 0 < part.done < 40 and not PLUGINS
    assert client.cancelled is not None


def test_other_versions_are_refused(cart: eomgen.Model, client: Client) -> None:
    client.version = "0.0.1"
    fault = f"its eomgen is 0.0.1, and here it is {__version__}; try: pip install eomgen=={__version__}"
    with pytest.raises(UsageError, match=f"worker tcp://there:1: {fault} where it runs"):
        cart.simulate_many(**OPTIONS, cluster=client)
    client.version, client.older = __version__, "0.0.2"
    with pytest.raises(UsageError, match=r"makes other C than at the start of the ensemble; try: eomgen 0\.0\.2, with"):
        cart.simulate_many(**OPTIONS, cluster=client)


def machines(threads: int = 2) -> cluster.Machines:
    return cluster.Machines(SimpleNamespace(nthreads=lambda: {"one": threads}), "here")


@pytest.mark.parametrize(
    ("per_sample", "left", "of_sample", "size"),
    [
        (0.0, 10_000, 8, 16),  # nothing is known of the time of a sample
        (0.0, 30, 8, 8),  # the quarter that each of two threads has of the rest
        (0.0, 1, 8, 1),
        (0.01, 10_000, 8, 192),  # 200 samples of 2 s, in whole lanes
        (0.5, 10_000, 8, 4),
        (10.0, 10_000, 8, 1),
        (1e-6, 10_000, 2**20, 32),  # parts of 32 MiB
    ],
)
def test_parts_take_two_seconds(per_sample: float, left: int, of_sample: int, size: int) -> None:
    made, block = machines(), cast(Any, None)
    if per_sample:
        made._result(0, 4, Future(EnsemblePart(block, {}, 4.0 * per_sample, "code", "alone")))
    assert made._size(2, left, of_sample) == size


@pytest.mark.parametrize(
    ("future", "error", "said"),
    [
        (Future(UsageError(Problem("", "fails"))), UsageError, "cluster here: fails"),
        (
            Future(None, type("KilledWorker", (Exception,), {})()),
            FileError,
            "workers died over and over while they ran",
        ),
        (
            Future(None, ModuleNotFoundError("no module")),
            FileError,
            "a worker lacks a part that the ensemble needs: no",
        ),
        (Future(None, ValueError("wrong.\nmore")), FileError, "samples 8 to 11 cannot be run: ValueError: wrong; try"),
        (Future(None, CancelledError()), FileError, "the scheduler, or the connection to it, is lost; try: resume"),
    ],
)
def test_parts_without_a_result_say_why(future: Future, error: type[EomgenError], said: str) -> None:
    with pytest.raises(error) as caught:
        machines()._result(8, 4, future)
    assert said in str(caught.value) and "cluster here" in str(caught.value)


def test_a_cluster_without_workers_is_waited_for_with_a_warning() -> None:
    with pytest.warns(RuntimeWarning, match="cluster here has no workers: the samples wait for the first one"):
        assert machines(0)._thread_count() == 1


@contextmanager
def connected(given: object, workers: int | None = None) -> Iterator[tuple[Any, str]]:
    with cluster.connect_cluster(given, workers) as made:
        yield made._client, made.name


def test_clusters_are_clients_objects_addresses_files_and_own_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, file = Client(), tmp_path / "scheduler.json"
    file.touch()
    quick = {"timeout": 15.0, "set_as_default": False}
    with connected(own) as (client, _):
        assert client is own
    made = SimpleNamespace(scheduler_address="tcp://here:2")
    with connected(made) as (client, _):
        assert (client.place, client.options) == ((made,), quick)
    for given, word in (("tcp://here:1", "address"), (file, "scheduler_file")):
        with connected(given) as (client, _):
            assert (client.place, client.options) == ((), {word: str(given)} | quick)
    asked: list[int] = []
    monkeypatch.setattr(cluster, "processes", lambda count: asked.append(count) or nullcontext(made))
    monkeypatch.setattr(cluster, "thread_count", lambda: 5)
    for workers in (3, None):
        with connected("dask", workers) as (client, name):
            assert client.place == (made,) and name == "dask"
    assert asked == [3, 5]


def test_without_dask_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(UsageError, match=r"which is not installed; try: pip install 'eomgen\[dask\]'"),
        connected("dask"),
    ):
        pass


def _no_processes(count: int) -> Any:
    raise RuntimeError("bootstrapping\nmore")


@pytest.mark.parametrize(
    ("given", "workers", "error", "said"),
    [
        (SimpleNamespace(), 2, UsageError, "workers: a cluster that is given has its own workers"),
        (7, None, UsageError, "cluster: 7 is not a cluster; try: 'dask', 'tcp://host:8786', the path of"),
        ("", None, UsageError, "cluster: '' is not a cluster"),
        ("nowhere:8786", None, FileError, "cluster: there is no scheduler file nowhere:8786; try: dask, an address"),
        ("tcp://nowhere:1", None, FileError, "cluster tcp://nowhere:1: no scheduler answers: OSError: Timed out; try"),
        ("dask", 1, UsageError, "cluster dask: its processes did not start: RuntimeError: bootstrapping; try: if __n"),
    ],
)
def test_what_is_no_cluster_is_told(
    given: object, workers: int | None, error: type[EomgenError], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "processes", _no_processes)
    with pytest.raises(error) as caught, connected(given, workers):
        pass
    assert said in str(caught.value)
    asynchronous = Client()
    asynchronous.asynchronous = True
    with pytest.raises(UsageError, match="the client is asynchronous, and this call waits"), connected(asynchronous):
        pass
