"""A mass under a force, whose place is known for each sample, and what tells one ensemble of it from another."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

import pytest

from eomgen.products.ensembles import Ensemble

CART = """
format = 1
name = "cart"
gravity = [0, 0, 0]
[parameters]
mass = { value = 2.0, unit = "kg", tunable = true }
[inputs.push]
unit = "N"
[bodies.cart]
mass = "mass"
inertia = [1, 1, 1]
[joints.rail]
type = "prismatic"
parent = "base"
child = "cart"
axis = [1, 0, 0]
initial = { position = [0.0], velocity = [0.0] }
[efforts.motor]
joint = "rail"
effort = "push"
[outputs.place]
formula = "q.rail"
unit = "m"
[simulation]
duration = 2.0
step = 0.05
"""
VARY = {"mass": "uniform(1, 3)", "push": "normal(4 N, 10 %)", "q.rail": "normal(0, 0.1)", "v.rail": "uniform(-1, 1)"}


def bits(found: Ensemble) -> list[bytes]:
    """Return all statistics of an ensemble, and all that is known of its samples, to the bit."""
    samples = [*found.values.values(), *found.results.values()]
    return [array.tobytes() for array in (*found.reduction.arrays().values(), *samples)]


@contextmanager
def small_blocks() -> Iterator[None]:
    """Blocks of a sixteenth of all samples, however short their runs are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(import_module("eomgen.products.ensembles.simulate_many"), "_WORTH_A_BLOCK", 0)
        yield
