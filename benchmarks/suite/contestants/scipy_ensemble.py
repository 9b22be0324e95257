"""Ensembles by SciPy's solve_ivp, one trajectory after the other, with rates in Python's floats."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from problems import DUFFING, END, cheapest, duffing, pendulum, starts
from serve import Prepared, serve


def prepare(task: dict[str, Any]) -> Prepared:
    from scipy.integrate import solve_ivp

    first = starts(task["problem"], task["samples"])

    def rates(t: float, y: Any) -> Any:
        state = y.tolist()
        return duffing(t, state, math.cos) if task["problem"] == DUFFING else pendulum(state, math.sin, math.cos)

    def way(tolerance: float) -> tuple[str, Callable[[int], Any]]:
        def run(samples: int) -> Any:
            options = {"method": "DOP853", "rtol": tolerance, "atol": tolerance}
            return np.array([solve_ivp(rates, (0.0, END), y, **options).y[:, -1] for y in first[:samples]])

        return f"DOP853, tolerance {tolerance:.0e}", run

    if task.get("as_reference"):
        note, exact = way(1e-13)
        return Prepared(list, 1, lambda: exact(len(first)), ["scipy"], note)
    tolerances = (task["target"] * 10.0**-k for k in range(5))
    note, run = cheapest([map(way, tolerances)], np.load(task["reference"]), len(first), task["target"])
    return Prepared(run, len(first), run, ["scipy"], f"{note}, {len(first)} trajectories")


if __name__ == "__main__":
    serve(prepare)
