"""Large batches are shared by threads: the same bits, by as many threads as there are to be."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.compiled import functions
from eomgen.errors import UsageError
from tests.models.scenes import pendulum_scene


@pytest.mark.parametrize("count", [2, 7, 1001])
def test_threads_change_no_bit(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator, count: int) -> None:
    model = eomgen.build(pendulum_scene(), ["inverse_dynamics", "partials"])
    q, v, a = (rng.normal(size=(count, 1)) for _ in range(3))
    u = np.array([0.3])
    expected = model.inverse_dynamics(q, v, a, 0.5, u), *model.partials(q, v, a, 0.5, u)
    seen: set[str] = set()
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
    assert seen and all(name.startswith("eomgen-batch") for name in seen)
    seen.clear()
    monkeypatch.setenv("EOMGEN_THREADS", "1")
    model.inverse_dynamics(q, v, a, 0.5, u)
    assert seen == {threading.current_thread().name}


def test_a_number_of_threads_that_is_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    model = eomgen.build(pendulum_scene(), ["inverse_dynamics", "partials"])
    monkeypatch.setattr(functions, "_SHARE", 1)
    monkeypatch.setenv("EOMGEN_THREADS", "many")
    with pytest.raises(UsageError, match="environment variable EOMGEN_THREADS: 'many' is no number of threads; try: "):
        model.inverse_dynamics(np.zeros((4, 1)), np.zeros(1), np.zeros(1))
