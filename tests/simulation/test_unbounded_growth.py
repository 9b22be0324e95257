"""Growth without end is told from velocities and travel, of motions by closed form that begin at any time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.simulation.judgement.instability import unbounded_growth
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import States


def _found(size: float, rate: float, begin: float, place: float = 0.0, rows: int = 400) -> Any:
    """Examine q = place + size exp(rate (t - begin)), over ten seconds."""
    t = np.linspace(begin, begin + 10.0, rows)
    q = size * np.exp(rate * (t - begin))[:, np.newaxis]
    library = SimpleNamespace(layout={"method": {}})
    names = {"q_units": ["m"], "v_units": ["m/s"], "v_names": ["v.slide"]}
    run = SimpleNamespace(model=SimpleNamespace(nv=1, library=library, **names))
    none = np.zeros((rows, 0))
    return unbounded_growth(cast(Run, run), States(t, place + q, rate * q, rate**2 * q, none, none))


@pytest.mark.parametrize("begin", [0.0, 1e7, -1e7])
def test_a_body_that_hardly_travels_does_not_grow_without_end(begin: float) -> None:
    """Its velocity grows by exp(20): the travel of the last quarter is below 1000 times the largest place of the
    first one only if the rate is low."""
    assert _found(1e-3, 2.0, begin) is not None
    assert _found(1e-3, 0.9, begin) is None


@pytest.mark.parametrize("begin", [0.0, 1e7, -1e7])
def test_travel_counts_and_not_the_time_on_the_clock(begin: float) -> None:
    """Velocities grow by 1e6 and more, while a place of 1 km changes by less than itself."""
    assert _found(1e-9, 2.0, begin, place=1e3) is None


@pytest.mark.parametrize("rate", [2.0, 3.0])
def test_its_factor_is_that_of_the_quarters(rate: float) -> None:
    found = _found(1e-3, rate, 0.0)
    assert found is not None and float(found.value) == pytest.approx(np.exp(7.5 * rate), rel=0.05 * rate)
    assert "without end: v.slide by a factor of" in found.text
