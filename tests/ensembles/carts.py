"""A mass under a force, whose place is known for each sample, and what tells one ensemble of it from another."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

import eomgen
from eomgen.products.ensembles import Ensemble

FILE = Path(__file__).parent / "scenes" / "cart.toml"
CART = FILE.read_text(encoding="utf-8")
VARY = {"mass": "uniform(1, 3)", "push": "normal(4 N, 10 %)", "q.rail": "normal(0, 0.1)", "v.rail": "uniform(-1, 1)"}


@cache
def built_cart() -> eomgen.Model:
    return eomgen.build(FILE)


def bits(found: Ensemble) -> list[bytes]:
    """Return all statistics of an ensemble, and all that is known of its samples, to the bit."""
    samples = [*found.values.values(), *found.results.values()]
    return [array.tobytes() for array in (*found.reduction.arrays().values(), *samples)]


@contextmanager
def small_blocks() -> Iterator[None]:
    """Blocks of a sixteenth of all samples, however short their runs are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("eomgen.products.ensembles.samples._WORTH_A_BLOCK", 0)
        yield
