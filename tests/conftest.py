"""Gives every test its own reproducible random numbers."""

from __future__ import annotations

import zlib

import numpy as np
import pytest


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Return random numbers that depend on the test's name only, so that tests may run alone or in any order."""
    return np.random.default_rng(zlib.crc32(request.node.name.encode()))
