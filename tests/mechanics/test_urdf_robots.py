"""Every URDF of example-robot-data: what is found today is what ``docs/urdf_robots.md`` says."""

from __future__ import annotations

import pytest

from tests.oracles.urdf_robots import COMMAND, PAGE, examine, page, robot_files


@pytest.mark.long
def test_the_page_says_what_is_found_and_every_robot_agrees_or_is_refused() -> None:
    found = {name: examine(path) for name, path in robot_files().items()}
    assert page(found) == PAGE.read_text(encoding="utf-8"), f"docs/urdf_robots.md is not what is found; run: {COMMAND}"
    assert len(found) == 69
    assert not {name: item.verdict for name, item in found.items() if item.verdict != "agrees" and not item.refusal}
    assert sum(item.followers for item in found.values()) > 30
