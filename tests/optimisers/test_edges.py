"""Derivatives of formulas at singular points through C, against one-sided differences."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.oracles.edge_formulas import EDGES

EXACT = {"abs": 1e-9, "rel": 1e-9}
Q, V = (np.array([getattr(edge, name) for edge in EDGES]) for name in "xy")


def scene() -> dict[str, Any]:
    """Return a mass of 1 kg on a slide for each formula: x is its coordinate, y its velocity, the force the value."""
    numbers = range(len(EDGES))
    texts = [
        re.sub(r"\b([xy])\b", lambda match, number=number: f"{'qv'['xy'.index(match[1])]}.j{number}", edge.text)
        for number, edge in enumerate(EDGES)
    ]
    return {
        "format": 1,
        "name": "edges",
        "gravity": [0, 0, 0],
        "bodies": {f"b{number}": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]} for number in numbers},
        "joints": {
            f"j{number}": {"type": "prismatic", "parent": "base", "child": f"b{number}", "axis": [1, 0, 0]}
            for number in numbers
        },
        "efforts": {f"e{number}": {"joint": f"j{number}", "effort": text} for number, text in enumerate(texts)},
    }


@pytest.fixture(scope="module")
def wanted() -> Any:
    """Return d/dx, d/dy and d2/dx2 of each formula, (formulas, 3)."""
    return np.array([edge.derivatives() for edge in EDGES])


@pytest.fixture(scope="module")
def model() -> Any:
    return eomgen.build(scene(), profile="quick")


@pytest.mark.long
@pytest.mark.slow
def test_c(model: Any, wanted: Any) -> None:
    n = len(EDGES)
    first = model.derivatives("forward_dynamics", Q, V)
    assert np.diagonal(first[:, :n]) == pytest.approx(wanted[:, 0], **EXACT)
    assert np.diagonal(first[:, n:]) == pytest.approx(wanted[:, 1], **EXACT)
    second = model.hessian("forward_dynamics", np.ones(n), Q, V)
    assert np.diagonal(second)[:n] == pytest.approx(wanted[:, 2], **EXACT)


@pytest.mark.slow
def test_c_of_rates(model: Any, wanted: Any) -> None:
    """The rate of the force along q + v t, with constant v, is the slope in q times v."""
    zero = np.zeros(len(EDGES))
    rate, _ = model.having(("force_rates",)).force_rates(Q, V, zero, zero)
    assert rate == pytest.approx(wanted[:, 0] * V, **EXACT)
