"""Runs side by side that break constraints or gain energy, at both sides of the limits."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.products.ensembles import side_by_side


@pytest.mark.parametrize(
    ("units", "extent", "bounds"),
    [
        (["m", "m"], 0.2, 0.2), (["m", "1"], 0.2, 0.2), (["m", "1"], 5.0, 1.0), (["m", "m/s"], 5.0, 5.0),
        (["1", "1/s"], 5.0, 1.0), (["m"], 0.0, 1.0), ([], 5.0, 1.0),
    ],
)  # fmt: skip
def test_lanes_break_constraints_beyond_a_part_of_the_machine(units: list[str], extent: float, bounds: float) -> None:
    """Of a machine: lengths by its extent, angles by one radian, both by the smaller one."""
    rows, parameters = np.arange(2 * 5 * 4, dtype=float).reshape(2, 5, 4), np.array([[7.0], [8.0]])

    def evaluate(function: str, q: np.ndarray, t: np.ndarray, parameters: np.ndarray) -> dict[str, np.ndarray]:
        looked = rows[:, [0, 2, 4]].reshape(-1, 4)
        assert function == "constraint_size" and parameters[:, 0].tolist() == [7.0] * 3 + [8.0] * 3
        assert t.tolist() == looked[:, 0].tolist() and q.tolist() == looked[:, 1:3].tolist()
        return {"extent": np.array([0.0, 1.0, 0.5, 1.0, 0.25, 0.0]) * extent}

    model = SimpleNamespace(
        multipliers=("a",) * len(units), nq=2, functions={"constraint_size": None}, evaluate=evaluate,
        library=SimpleNamespace(layout={"row_units": units}),
    )  # fmt: skip
    lanes: Any = SimpleNamespace(model=model)
    limit = 1e-4 * bounds
    for share, broken in ((0.999, False), (1.001, bool(units)), (np.nan, bool(units))):
        largest = np.array([[share * limit], [0.0]])
        result = side_by_side.SideBySide._breaks_constraints(lanes, rows, parameters, largest)
        assert result.tolist() == [broken, False]
    none = side_by_side.SideBySide._breaks_constraints(lanes, rows, parameters, np.zeros((2, 0)))
    assert none.tolist() == [False, False]
