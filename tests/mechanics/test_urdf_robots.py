"""Every URDF of example-robot-data: what is found today is what ``docs/urdf_robots.md`` says."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.oracles.urdf_robots import COMMAND, PAGE, TOLERANCE, Found, examine, page, robot_files


@cache
def examined(name: str) -> Found:
    return examine(robot_files()[name])


def found() -> dict[str, Found]:
    return {name: examined(name) for name in robot_files()}


@pytest.mark.long
def test_the_page_says_what_is_found() -> None:
    assert page(found()) == PAGE.read_text(encoding="utf-8"), (
        f"docs/urdf_robots.md is not what is found; run: {COMMAND}"
    )


@pytest.mark.long
def test_every_robot_agrees_or_is_refused() -> None:
    assert len(found()) == 69
    wrong = {name: item.verdict for name, item in found().items() if item.verdict != "agrees" and not item.refusal}
    assert not wrong
    assert sum(item.followers for item in found().values()) > 30


@pytest.mark.slow
def test_a_difference_would_be_seen() -> None:
    item = next(item for name in robot_files() if (item := examined(name)).verdict == "agrees")
    assert 0.0 < item.error < TOLERANCE
    assert Found(dofs=6, error=2.0 * TOLERANCE).verdict == "**differs** by 2.0e-11, as read by 0.0e+00"
    assert Found(dofs=6, deviation=1e-6).verdict.startswith("**differs**")
    assert page({"one.urdf": Found(dofs=6, error=1.0)}) != page({"one.urdf": Found(dofs=6)})


@pytest.mark.slow
@pytest.mark.parametrize("name", ["romeo_description/urdf/romeo.urdf", "talos_data/robots/talos_full_v2.urdf"])
def test_followers_of_followers_are_among_them(name: str) -> None:
    item = examined(name)
    assert item.refusal or item.followers >= 12
    assert np.isfinite(item.error)
