"""Growth by the method is told from growth by the equations: motions by closed form, whose repetition in smaller steps
is given."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.simulation.judgement import instability
from eomgen.simulation.judgement.instability import (
    _FINER,
    _FINER_OF_SLOW,
    Growth,
    _by_method,
    _diverges,
    _refined_size,
    own_growth,
)
from tests.oracles.evaluation import Array

STEP = 0.01
RUN: Any = SimpleNamespace(
    model=SimpleNamespace(
        nq=2, nv=2, nz=1, q_units=("m", "rad"), v_units=("m/s", "rad/s"), v_names=("v.slide", "v.turn"),
        z_names=("z.level",), z_units=("1",),
    ),
    settings={"step": STEP},
)  # fmt: skip  # names
LIBRARY: Any = None


def rows_of(times: Array, size: Callable[[Array], Array], component: int = 1) -> Array:
    """Return rows t, q, v, a, z in which one component of (v, z) has a size, and all others rest."""
    rows = np.zeros((len(times), 8))
    rows[:, 0], rows[:, 1] = times, 1.0
    rows[:, (3, 4, 7)[component]] = size(times)
    if component < 2:
        rows[:, 5 + component] = size(times)
    return rows


@pytest.fixture
def repeated(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[int]]:
    """Return a function that states how the motion goes on from a row at a rate by the number of parts of a step;
    without a rate the repetition fails. The parts that are asked for are listed."""

    def state(rate: Callable[[int], float | None], component: int = 1) -> list[int]:
        asked: list[int] = []

        def again(run: object, library: object, row: Array, steps: int, parts: int) -> Array | None:
            asked.append(parts)
            grows, size = rate(parts), row[(3, 4, 7)[component]]
            times = row[0] + STEP * np.arange(1, steps + 1)
            return None if grows is None else rows_of(times, lambda t: size * np.exp(grows * (t - row[0])), component)

        monkeypatch.setattr(instability, "_again", again)
        return asked

    return state


def examined(finer: tuple[int, ...] = _FINER, rate: float = 10.0, component: int = 1) -> Growth | None:
    """Examine a motion that has grown at a rate over 0.5 s, from 0.3 s before on."""
    window = rows_of(2.0 + STEP * np.arange(51), lambda t: 1e-3 * np.exp(rate * (t - 2.0)), component)
    before = rows_of(2.0 + STEP * np.arange(-30, 1), lambda t: 1e-3 * np.exp(rate * (t - 2.0)), component)
    return _by_method(RUN, LIBRARY, window, before, np.array([component]), finer)


@pytest.mark.parametrize(
    ("component", "name", "unit"), [(0, "v.slide", "m/s"), (1, "v.turn", "rad/s"), (2, "z.level", "1")]
)
def test_what_stays_in_smaller_steps_has_grown_by_the_method(
    component: int, name: str, unit: str, repeated: Callable[..., list[int]]
) -> None:
    asked = repeated(lambda parts: 0.0, component)
    found = examined(component=component)
    assert found is not None and (found.name, found.unit) == (name, unit)
    assert (found.start, found.end) == pytest.approx((2.0, 2.5))
    assert (found.before, found.after) == pytest.approx((1e-3, 1e-3 * math.exp(5.0)))
    assert (found.finer, found.finer_after) == pytest.approx((STEP / 2, 1e-3))
    assert asked == [2, 2, 4]
    assert f", and to 0.001{'' if unit == '1' else ' ' + unit} in steps of 0.005 s" in str(found)


def test_the_coarsest_cut_that_is_near_the_next_is_told(repeated: Callable[..., list[int]]) -> None:
    """A method that is stable from a sixteenth of the step on."""
    asked = repeated(lambda parts: {2: 10.0, 4: 9.0}.get(parts, 0.0))
    found = examined()
    assert found is not None and (found.finer, found.finer_after) == pytest.approx((STEP / 16, 1e-3))
    assert asked == [2, 4, 16, 16, 64]
    window = rows_of(2.0 + STEP * np.arange(11), lambda t: 0.0 * t + 1.0)
    repeated(float)
    assert _refined_size(RUN, LIBRARY, window, 1, (2, 4, 16), 0.1) == (16, pytest.approx(math.exp(1.6)))
    assert _refined_size(RUN, LIBRARY, window, 1, (2, 4, 16), 0.25) == (2, pytest.approx(math.exp(0.2)))
    repeated(lambda parts: None)
    with np.errstate(invalid="ignore"):
        assert _refined_size(RUN, LIBRARY, window, 1, (2, 4), 0.1) == (4, math.inf)


def test_growth_that_smaller_steps_agree_on_is_the_motion(repeated: Callable[..., list[int]]) -> None:
    asked = repeated(lambda parts: 10.0)
    assert examined() is None and asked == [2, 4, 16]
    asked = repeated(lambda parts: 9.6)  # 4 % of the logarithm
    assert examined() is None and asked == [2, 4, 16]
    assert examined(rate=1.9) is None  # grows by less than e


def test_sizes_that_do_not_settle_are_the_methods(repeated: Callable[..., list[int]]) -> None:
    rates = {2: 10.0, 4: 14.0, 16: 10.0, 64: 14.0, 512: 10.0}
    asked = repeated(rates.__getitem__)
    found = examined()
    assert found is not None and (found.finer, found.finer_after) == (STEP / 512, math.inf)
    assert asked == list(_FINER) and "beyond the finite numbers in steps of" in str(found)
    assert examined(_FINER_OF_SLOW) is None
    repeated(lambda parts: None)
    assert examined() is not None and examined(_FINER_OF_SLOW) is None


@pytest.mark.parametrize(("rate", "grown"), [(30.0, True), (20.0, False), (40.0, False), (None, False)])
def test_own_growth_is_the_same_in_smaller_steps(
    rate: float | None, grown: bool, repeated: Callable[..., list[int]]
) -> None:
    rows = rows_of(STEP * np.arange(100), lambda t: 1e-6 * np.exp(30.0 * t))
    asked = repeated(lambda parts: rate)
    found = own_growth(RUN, LIBRARY, rows)
    assert (found is not None) == grown
    if found is not None:
        assert asked == list(_FINER_OF_SLOW) and found.name == "v.turn"
        assert found.finer == STEP / 4 and found.finer_after == pytest.approx(found.after, rel=1e-9)
        last = 1e-6 * math.exp(30.0 * rows[-1, 0])
        assert last / 3.0 / math.exp(0.3) < found.after <= last / 3.0  # the last row a third below the end
        assert found.after / found.before == pytest.approx(math.exp(30.0 * (found.end - found.start)), rel=1e-9)
        assert 10.0 <= found.after / found.before < 10.0 * math.exp(0.3)


def test_a_power_of_time_is_no_growth(repeated: Callable[..., list[int]]) -> None:
    asked = repeated(lambda parts: 10.0)
    rows = rows_of(STEP * np.arange(1, 101), lambda t: t**3)
    assert own_growth(RUN, LIBRARY, rows) is None and asked == []
    rest = rows_of(STEP * np.arange(100), lambda t: 0.0 * t + 1.0)
    assert own_growth(RUN, LIBRARY, rest) is None and asked == []
    times = np.linspace(1.0, 3.0, 50)
    assert _diverges(times, np.exp(times)) and _diverges(times, 1.0 / (3.1 - times))
    for power in (1, 3, 5):
        assert not _diverges(times[:40] - 0.9, (times[:40] - 0.9) ** power)


def test_steps_are_repeated_in_equal_parts_from_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []

    class Repeated:
        def __init__(self, library: object, settings: dict[str, float], *_: object) -> None:
            assert settings["step"] == STEP / 4
            self.sizes = {"row": 8}

        def initialize(self, t: float, q: Array, v: Array, table: None, z: Array) -> int:
            calls.append((t, q.tolist(), v.tolist(), z.tolist()))
            return 0

        def run(self, steps: int, every: int, table: None, record: Array) -> tuple[int, int]:
            calls.append((steps, every))
            record[:] = 5.0
            return 0, steps // every - (steps == 8)

    monkeypatch.setattr(instability, "Stepper", Repeated)
    run: Any = SimpleNamespace(**vars(RUN), controllers=None, driven=None, parameters=np.zeros(0))
    row = np.arange(8.0)
    again = instability._again(run, LIBRARY, row, 3, 4)
    assert again is not None and again.shape == (3, 8) and np.all(again == 5.0)
    assert calls == [(0.0, [1.0, 2.0], [3.0, 4.0], [7.0]), (12, 4)]
    assert instability._again(run, LIBRARY, row, 2, 4) is None  # a step fails
