"""Gives every test its own reproducible random numbers, and tests of the second and third tier their marks."""

from __future__ import annotations

import os

# One process of tests for each core: threads of BLAS between them wait for one another, and take half of the time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Most models of tests live for a second: to optimise them takes five times as long as to compile them. Tests that need
# what users get by default say so: each example is built as users build it in compiled/test_examples.py.
os.environ.setdefault("EOMGEN_PROFILE", "quick")

import gc
import zlib

import numpy as np
import pytest

from tests.tiers import is_long, is_slow, stale_entries

# Equations are millions of small objects without circles: to look for circles among them takes a quarter of the time.
gc.set_threshold(50_000, 20, 20)


def pytest_collection_finish() -> None:
    """Leave what is imported by now out of all searches for circles."""
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        if is_slow(item.nodeid):
            item.add_marker(pytest.mark.slow)
        if is_long(item.nodeid):
            item.add_marker(pytest.mark.slow)
            item.add_marker(pytest.mark.long)
    whole_files = not any("::" in argument for argument in config.args)
    if whole_files and (stale := stale_entries([item.nodeid for item in items])):
        raise pytest.UsageError(f"tests/tiers.py names what is not there: {'; '.join(stale)}")


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Return random numbers that depend on the test's name only, so that tests may run alone or in any order."""
    return np.random.default_rng(zlib.crc32(request.node.name.encode()))
