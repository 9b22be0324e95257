"""Nested data from Python may hold values that are in no scene file."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from eomgen import DescriptionError
from eomgen.scene.load import from_data


def pendulum(**changes: Any) -> dict[str, Any]:
    hinge = {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, 1, 0]}
    body = {"mass": 1.0, "inertia": [1.0, 1.0, 1.0]}
    return {"format": 1, "name": "pendulum", "bodies": {"rod": body}, "joints": {"hinge": hinge}, **changes}


def test_an_absent_base_may_be_none() -> None:
    assert from_data(pendulum(base=None, gravity=[0, 0, -9.81])).base == from_data(pendulum()).base


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gravity": 10**400}, "(gravity): a list of 3 entries is needed here"),
        ({"base": {"rotation": [10**400, 0, 0]}}, "(base.rotation[0]): a table is needed here"),
        ({"joints": {"hinge": {"type": np.arange(3)}}}, "(joints.hinge.type): array([0, 1, 2]) is not known here"),
    ],
)
def test_values_of_other_types_are_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)):
        from_data(pendulum(**changes))
