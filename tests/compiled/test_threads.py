"""Large batches are shared by threads: the same bits, by as many threads as there are to be; small matrices are left
to one thread."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg  # noqa: F401  # brings a library of its own along

import eomgen
from eomgen.base.threads import _openblas, one_thread_of_algebra, share, variables
from eomgen.compiled import functions
from eomgen.errors import UsageError
from tests.models.scenes import pendulum_scene


@pytest.mark.parametrize("count", [2, 7, 1001])
def test_threads_change_no_bit(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator, count: int) -> None:
    model = eomgen.build(pendulum_scene(), ["inverse_dynamics", "partials"])
    q, v, a = (rng.normal(size=(count, 1)) for _ in range(3))
    u = np.array([0.3])
    expected = model.inverse_dynamics(q, v, a, 0.5, u), *model.partials(q, v, a, 0.5, u)
    seen, own = set[str](), threading.current_thread().name
    plain = model.library.call

    def noted(*arguments: object) -> None:
        seen.add(threading.current_thread().name)
        plain(*arguments)

    monkeypatch.setattr(functions, "_SHARE", 1)
    monkeypatch.setattr(model.library, "call", noted)
    monkeypatch.setenv("EOMGEN_THREADS", "3")
    found = model.inverse_dynamics(q, v, a, 0.5, u), *model.partials(q, v, a, 0.5, u)
    for one, other in zip(expected, found, strict=True):
        np.testing.assert_array_equal(one, other)
    assert seen and seen <= {own, "eomgen-batch_1", "eomgen-batch_2"}
    seen.clear()
    monkeypatch.setenv("EOMGEN_THREADS", "1")
    model.inverse_dynamics(q, v, a, 0.5, u)
    assert seen == {own}


def test_a_number_of_threads_that_is_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    model = eomgen.build(pendulum_scene(), ["inverse_dynamics", "partials"])
    monkeypatch.setattr(functions, "_SHARE", 1)
    monkeypatch.setenv("EOMGEN_THREADS", "many")
    with pytest.raises(
        UsageError, match="environment variable EOMGEN_THREADS: 'many' is not a number of threads; try: "
    ):
        model.inverse_dynamics(np.zeros((4, 1)), np.zeros(1), np.zeros(1))


def test_pieces_are_called_side_by_side_each_once() -> None:
    met, found = threading.Barrier(3), []

    def call(begin: int, end: int) -> None:
        if begin < 3:
            met.wait(20)  # all three threads have a piece
        found.append((begin, end))

    share(call, [(k, k + 1) for k in range(20)], 3)
    assert sorted(found) == [(k, k + 1) for k in range(20)]


@pytest.mark.parametrize("bad", [0, 19])
def test_what_a_piece_raises_is_raised_after_all_threads_are_done(bad: int) -> None:
    def call(begin: int, end: int) -> None:
        if begin == bad:
            raise MemoryError(f"piece {begin}")

    before = threading.active_count()
    with pytest.raises(MemoryError, match=f"piece {bad}"):
        share(call, [(k, k + 1) for k in range(20)], 3)
    assert threading.active_count() == before


@pytest.mark.skipif(sys.platform != "linux", reason="loaded libraries are listed by Linux alone")
def test_small_matrices_are_left_to_one_thread_until_all_have_ended() -> None:
    """The number before is set again, also after an error, and if two threads of Python leave in another order."""

    def numbers() -> list[int]:
        return [read() for read, _ in _openblas(of_scipy=True)]

    libraries = _openblas(of_scipy=True)
    own = numbers()
    count = len(own)
    assert count >= 2  # NumPy and SciPy, and every package of another test that brings a copy
    try:
        for _, write in libraries:
            write(2)
        with one_thread_of_algebra(2000):
            assert numbers() == [2] * count
        first, second = one_thread_of_algebra(3), one_thread_of_algebra(3)
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert numbers() == [1] * count
        second.__exit__(None, None, None)
        assert numbers() == [2] * count
        with pytest.raises(ZeroDivisionError), one_thread_of_algebra(3):
            1 / 0  # noqa: B018
        assert numbers() == [2] * count
    finally:
        for (_, write), number in zip(libraries, own, strict=True):
            write(number)


def test_variables_are_set_within_a_block_and_those_of_the_user_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EOMGEN_GIVEN", "1")
    monkeypatch.setattr(threading, "active_count", lambda: 1)  # libraries of other tests have threads
    with variables(EOMGEN_GIVEN="2", EOMGEN_ADDED="3"):
        assert (os.environ["EOMGEN_GIVEN"], os.environ["EOMGEN_ADDED"]) == ("1", "3")
    assert (os.environ["EOMGEN_GIVEN"], "EOMGEN_ADDED" in os.environ) == ("1", False)


def test_no_variable_is_set_while_other_threads_run() -> None:
    ended = threading.Event()
    other = threading.Thread(target=ended.wait)
    other.start()
    with variables(EOMGEN_ADDED="3"):
        added = "EOMGEN_ADDED" in os.environ
    ended.set()
    other.join()
    assert not added


_NOTED = """
import os, sys
noted = []
class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "numpy":
            noted.append(os.environ.get("OPENBLAS_THREAD_TIMEOUT"))
sys.meta_path.insert(0, Finder)
import eomgen
eomgen.Scene
print(noted, "OPENBLAS_THREAD_TIMEOUT" in os.environ)
"""


@pytest.mark.slow
def test_threads_of_algebra_sleep_soon_after_the_import_of_numpy(tmp_path: Path) -> None:
    """They waited busily through the import, 30 to 60 ms of the processor."""
    ran = subprocess.run([sys.executable, "-c", _NOTED], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert ran.stdout == "['20'] False\n"
