"""The picture of the rooms is that of the code."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.rooms import drawing

pytestmark = pytest.mark.slow

PAGE = Path(__file__).parents[2] / "docs" / "rooms.svg"


def test_the_picture_of_the_rooms_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == drawing(), "run: python -m tests.rooms docs/rooms.svg"
