"""Memory of results of batches: used again when it was dropped, and never before."""

from __future__ import annotations

import errno
import mmap
import threading
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.compiled import result_memory
from eomgen.compiled.result_memory import ResultMemory

SHAPE = (1000, 3, 7)
SIZE = 8 * 1000 * 3 * 7


def address(array: Array) -> int:
    return int(array.__array_interface__["data"][0])


def test_what_was_dropped_is_used_again_and_what_is_held_is_not() -> None:
    memory = ResultMemory()
    first = memory.empty(SHAPE, float)
    assert first.shape == SHAPE and first.dtype == float and first.flags.c_contiguous and first.flags.writeable
    place = address(first)
    second = memory.empty(SHAPE, float)
    assert address(second) != place
    views = [first[:, 1, 2], memoryview(first), first.T]
    del first
    while views:
        assert address(memory.empty(SHAPE, float)) != place  # a view of it is held
        views.pop()
    assert address(memory.empty(SHAPE, float)) == place


def test_shapes_and_types_of_one_size_share_memory() -> None:
    memory = ResultMemory()
    place = address(memory.empty(SHAPE, float))
    other = memory.empty((500, 21), np.complex128)
    assert address(other) == place and other.shape == (500, 21) and other.dtype == complex


def test_unused_memory_has_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(result_memory, "_KEPT", 3 * SIZE)
    memory = ResultMemory()
    held = [memory.empty(SHAPE, float) for _ in range(5)]
    places = [address(array) for array in held]
    assert len(set(places)) == 5 and not memory._unused
    while held:
        held.pop(0)
    again = [memory.empty(SHAPE, float) for _ in range(3)]
    assert [address(array) for array in again] == places[:-4:-1]  # the newest first; the oldest was given up
    again.clear()
    assert sum(map(len, memory._unused)) == 3 * SIZE
    memory.empty((1000, 3, 14), float)
    assert sorted(map(len, memory._unused)) == [SIZE, 2 * SIZE]


def refuse(*_: object) -> None:
    raise OSError(errno.EINVAL, "Invalid argument")


def test_large_memory_is_kept_if_the_system_can_take_it_back(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[int] = []

    class Mapping(mmap.mmap):
        def madvise(self, option: int, *bounds: int) -> None:
            taken.append(option)
            super().madvise(option, *bounds)

    monkeypatch.setattr(mmap, "mmap", Mapping)
    memory, shape = ResultMemory(), (2**20,)
    place = address(memory.empty(shape, float))
    assert taken.count(mmap.MADV_FREE) == 1  # when the array was dropped
    array = memory.empty(shape, float)
    array.fill(7.0)
    assert address(array) == place and (array == 7.0).all()
    del array
    monkeypatch.setattr(Mapping, "madvise", refuse)
    array = memory.empty((2**21,), float)
    array.fill(8.0)
    assert (array == 8.0).all()
    del array
    assert [len(kept) for kept in memory._unused] == [2**23]  # not the memory that the kernel cannot take back
    monkeypatch.setattr(result_memory, "_RECLAIMED", False)
    assert memory.empty(shape, float).base is None
    few = memory.empty(SHAPE, float)
    few.fill(3.0)
    assert (few == 3.0).all()


def test_results_that_are_held_stay_as_they_are() -> None:
    model = eomgen.build(Path(__file__).parents[2] / "examples" / "spherical_pendulum" / "scene.toml")
    q = np.repeat(model.initial_q[np.newaxis], 20_000, axis=0)
    v = np.linspace(-1.0, 1.0, 60_000).reshape(20_000, 3)[:, : model.nv]
    one = model.mass(q), model.forward_dynamics(q, v)
    kept = [array.copy() for array in one]
    other = [model.forward_dynamics(q, v + k) for k in range(1, 5)]
    for array, copy in zip(one, kept, strict=True):
        np.testing.assert_array_equal(array, copy)
    assert len({address(array) for array in (*one, *other)}) == 6
    place = address(other.pop())
    assert address(model.forward_dynamics(q, v)) == place


def test_threads_get_memory_of_their_own() -> None:
    memory, wrong = ResultMemory(), []

    def work(number: int) -> None:
        for _ in range(300):
            array = memory.empty(SHAPE, float)
            array.fill(number)
            wrong.extend([number] * bool((array != number).any()))

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
