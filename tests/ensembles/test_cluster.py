"""Ensembles on a Dask cluster of separate processes: the bits of local runs, whatever happens to a worker."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import distributed
import numpy as np
import pytest

import eomgen
from eomgen.products.ensembles import Ensemble, cluster
from tests.ensembles.carts import CART, VARY, bits, small_blocks

pytestmark = pytest.mark.slow

#: Prints how many pages a worker fetches for arrays like one that it has dropped.
FAULTS = """
import distributed

from eomgen.products.ensembles import cluster


def faults():
    import resource

    import numpy as np

    np.ones(2**18)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(8):
        np.ones(2**18)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


if __name__ == "__main__":
    with cluster.processes(1) as one, distributed.Client(one, set_as_default=False) as client:
        (found,) = client.run(faults).values()
    print(found)
"""
OPTIONS: dict[str, Any] = {"vary": VARY, "samples": 40, "seed": 3}


@pytest.fixture(scope="module", autouse=True)
def several_blocks() -> Iterator[None]:
    with small_blocks():
        yield


@pytest.fixture(scope="module")
def cart(tmp_path_factory: pytest.TempPathFactory) -> eomgen.Model:
    path = tmp_path_factory.mktemp("cart") / "cart.toml"
    path.write_text(CART, encoding="utf-8")
    model = eomgen.build(eomgen.load(path))
    path.unlink()  # what workers are sent must not need it
    return model


@contextmanager
def two_workers(**environment: str) -> Iterator[Any]:
    """Two processes with one thread each, and a client."""
    with (
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            dashboard_address=None,
            scheduler_kwargs={"dashboard": False},
            silence_logs=50,
            env=environment,
        ) as processes,
        distributed.Client(processes, set_as_default=False) as made,
    ):
        yield made


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    with two_workers() as made:
        yield made


@pytest.fixture(scope="module")
def local(cart: eomgen.Model) -> Ensemble:
    return cart.simulate_many(**OPTIONS)


@pytest.mark.long
def test_a_killed_worker_costs_its_part_alone(
    cart: eomgen.Model, local: Ensemble, client: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "PART", 1e-9)  # parts that divide no block
    one, other = client.run(os.getpid).values()
    killed: list[int] = []

    def kill(done: int, total: int) -> None:
        if not killed:
            os.kill(one, signal.SIGKILL)
            killed.append(done)

    found = cart.simulate_many(**OPTIONS, cluster=client, progress=kill)
    assert killed and killed[0] < 40 and found.done == 40 and not found.failed and bits(found) == bits(local)
    pids = set(client.run(os.getpid).values())
    assert other in pids and one not in pids  # another worker may have come in place of it
    assert set(client.run(_rooms).values()) == {0}


@pytest.mark.long
def test_a_machine_without_the_model_compiles_it_once(cart: eomgen.Model, local: Ensemble, tmp_path: Path) -> None:
    with two_workers(EOMGEN_CACHE=str(tmp_path / "cache")) as client:
        assert bits(cart.simulate_many(**OPTIONS, cluster=client)) == bits(local)
    made = [folder for folder in (tmp_path / "cache").iterdir() if (folder / "layout.json").is_file()]
    assert len(made) == 1


def _rooms(dask_worker: Any) -> int:
    """Return how many ensembles a worker holds."""
    return sum(name.startswith("eomgen-") for name in dask_worker.plugins)


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="the settings are those of the GNU allocator")
def test_processes_of_this_machine_keep_the_memory_that_samples_need_again(tmp_path: Path) -> None:
    """In a process of its own: another cluster of this one that starts a worker anew sets what workers begin with."""
    script = tmp_path / "faults.py"
    script.write_text(FAULTS, encoding="utf-8")
    ran = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    assert int(ran.stdout) < 256  # of 8 times 512 pages


def test_failures_and_solutions_come_back(cart: eomgen.Model, client: Any, tmp_path: Path) -> None:
    table = {"mass": [1.0, -1.0, 2.0], "push": [2.0, 2.0, 2.0]}
    here = cart.simulate_many(table=table, folder=tmp_path / "here", keep=[2])
    there = cart.simulate_many(table=table, folder=tmp_path / "there", keep=[2], cluster=client)
    assert there.how == here.how and "side by side" in here.how
    assert there.failed == here.failed and there.failed[0].number == 1 and bits(there) == bits(here)
    kept = [eomgen.Solution.load(tmp_path / place / "runs" / "sample_0000002.npz") for place in ("here", "there")]
    np.testing.assert_array_equal(kept[0].q, kept[1].q)
