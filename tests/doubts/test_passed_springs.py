"""Springs whose ends pass one another in a run are named, others are not."""

from __future__ import annotations

import re

import pytest

import eomgen


def spring(length: float, start: float, offset: float = 0.0) -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("sprung").body("m", 1.0)
    builder.joint("x", "prismatic", "base", "m", axis=[1, 0, 0], initial={"position": start})
    builder.point("a", "m", [0, 0, 0]).point("o", "base", [0, offset, 0])
    return builder.spring("s", "a", "o", stiffness=10, length=length)


def message(builder: eomgen.SceneBuilder, **options: float) -> str:
    return eomgen.build(builder.build(), method="rk4", profile="quick").simulate(1.0, 1e-3, **options).message


@pytest.mark.parametrize(("length", "start", "offset"), [(0.0, 2.5, 0.0), (1.0, 1.5, 0.0), (1.0, 2.5, 0.2)])
def test_other_springs_are_not(length: float, start: float, offset: float) -> None:
    """Linear from no length on; never as short; past one another at a distance."""
    assert "pass one another" not in message(spring(length, start, offset))


def test_every_spring_that_passes_is_named() -> None:
    builder = spring(1.0, 2.5).point("far", "base", [0.3, 0, 0])
    builder.spring("other", "far", "a", stiffness=1e-9, length=1.0)
    named = r"the ends of the springs s at t = 0\.\d+ s, other at t = 0\.\d+ s pass one another"
    assert re.search(named, message(builder))
