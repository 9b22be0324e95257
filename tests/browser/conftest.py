"""The browser of these tests, and the cache of their models."""

from __future__ import annotations

import pytest

from tests.browser.chromium import MISSING, Browser, chromium


@pytest.fixture
def browser() -> Browser:
    """Return a headless Chromium; a machine without one fails the test, with what to do about it."""
    command = chromium()
    if command is None:
        pytest.fail(MISSING)
    return Browser(command)
