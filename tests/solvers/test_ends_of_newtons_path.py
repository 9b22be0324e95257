"""Newton's path to rest ends: balanced at rest, and unbalanced at states without numbers, after too many steps, and if
no part of a step leads nearer."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.solvers import equilibrium_search
from eomgen.solvers.equilibrium_search import MAX_STEPS, follow_newton


class Trail:
    """A trail that is at rest after some steps, and whose states have numbers up to some step."""

    def __init__(self, rest: int, finite: int) -> None:
        self.steps, self.rest, self.finite = 0, rest, finite
        self.taken: list[object] = []

    @property
    def point(self) -> Any:
        return SimpleNamespace(finite=self.steps < self.finite)

    def has_arrived(self) -> bool:
        return self.steps >= self.rest

    def step(self, nearer: object) -> None:
        self.steps += 1
        self.taken.append(nearer)

    def end(self, *, balanced: bool) -> tuple[int, bool]:
        return self.steps, balanced


@pytest.mark.parametrize(
    ("rest", "finite", "nearer", "ended"),
    [
        (0, 10**9, 10**9, (0, True)),
        (7, 10**9, 10**9, (7, True)),
        (10**9, 3, 10**9, (3, False)),
        (10**9, 10**9, 4, (4, False)),
        (MAX_STEPS, 10**9, 10**9, (MAX_STEPS, True)),
        (MAX_STEPS + 1, 10**9, 10**9, (MAX_STEPS, False)),
    ],
)
def test_paths_end(
    rest: int, finite: int, nearer: int, ended: tuple[int, bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    trail, shares = Trail(rest, finite), []

    def part(statics: object, point: object, change: object, share: float) -> tuple[object, float]:
        shares.append(share)
        return (None if trail.steps == nearer else "nearer"), 0.1

    monkeypatch.setattr(equilibrium_search, "SearchTrail", lambda *_: trail)
    monkeypatch.setattr(equilibrium_search, "newton_right_side", lambda point: None)
    monkeypatch.setattr(equilibrium_search, "newton_step", lambda point, left: None)
    monkeypatch.setattr(equilibrium_search, "share_of_turn", lambda *_: 0.7)
    monkeypatch.setattr(equilibrium_search, "_part", part)
    found = follow_newton(cast(Any, None), np.zeros(1), np.zeros(0))
    assert cast(Any, found) == ended
    assert shares[:2] == [0.7, 0.4][: len(shares)]  # four times the part before, and no more than a turn allows
