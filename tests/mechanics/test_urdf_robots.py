"""Every URDF of example-robot-data: what is found today is what ``docs/urdf_robots.md`` says."""

from __future__ import annotations

import pytest

from tests.oracles.urdf_robots import COMMAND, PAGE, TOLERANCE, Found, examine, page, robot_files


@pytest.mark.long
def test_the_page_says_what_is_found_and_every_robot_agrees_or_is_refused() -> None:
    found = {name: examine(path) for name, path in robot_files().items()}
    assert page(found) == PAGE.read_text(encoding="utf-8"), f"docs/urdf_robots.md is not what is found; run: {COMMAND}"
    assert len(found) == 69
    assert not {name: item.verdict for name, item in found.items() if item.verdict != "agrees" and not item.refusal}
    assert sum(item.followers for item in found.values()) > 30


@pytest.mark.slow
def test_a_difference_would_be_seen() -> None:
    item = next(item for path in robot_files().values() if (item := examine(path)).verdict == "agrees")
    assert 0.0 < item.error < TOLERANCE
    assert Found(dofs=6, error=2.0 * TOLERANCE).verdict == "**differs** by 2.0e-11, as read by 0.0e+00"
    assert Found(dofs=6, deviation=1e-6).verdict.startswith("**differs**")
    assert page({"one.urdf": Found(dofs=6, error=1.0)}) != page({"one.urdf": Found(dofs=6)})
