"""One cache of compiled models for all tests of a machine, outside the user's own."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(scope="session", autouse=True)
def shared_cache() -> Iterator[Path]:
    """Point EOMGEN_CACHE to a folder of the tests; workers and later runs share what is compiled there."""
    folder = Path(tempfile.gettempdir()) / f"eomgen-tests-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    with pytest.MonkeyPatch.context() as patch:
        if "EOMGEN_CACHE" not in os.environ:
            patch.setenv("EOMGEN_CACHE", str(folder))
        yield folder
