"""Ensembles by heyoka: Taylor series, as many trajectories side by side as suits it."""

from collections.abc import Callable
from typing import Any

import numpy as np
from problems import DUFFING, END, cheapest, duffing, pendulum, starts
from serve import Prepared, serve


def prepare(task: dict[str, Any]) -> Prepared:
    import heyoka

    if task["problem"] == DUFFING:
        names = heyoka.make_vars("x", "v")
        rates = duffing(heyoka.time, names, heyoka.cos)
    else:
        names = heyoka.make_vars("a", "b", "u", "w")
        rates = pendulum(names, heyoka.sin, heyoka.cos)
    system, first = list(zip(names, rates, strict=True)), starts(task["problem"], task["samples"])

    def way(batch: int, tolerance: float) -> tuple[str, Callable[[int], Any]]:
        integrator = heyoka.taylor_adaptive_batch(system, np.zeros((first.shape[1], batch)), tol=tolerance)

        def run(samples: int) -> Any:
            padded = np.resize(first[:samples], (-(-samples // batch) * batch, first.shape[1]))
            ends = np.empty_like(padded)
            for start in range(0, len(padded), batch):
                integrator.set_time(0.0)
                integrator.state[:] = padded[start : start + batch].T
                integrator.propagate_until(END)
                ends[start : start + batch] = integrator.state.T
            return ends[:samples]

        return f"batches of {batch}, tolerance {tolerance:.0e}", run

    best = int(heyoka.recommended_simd_size())
    if task.get("as_reference"):
        note, exact = way(best, float(np.finfo(np.float64).eps))
        return Prepared(list, 1, lambda: exact(len(first)), ["heyoka"], note)
    tolerances = [10.0**-k for k in range(5, 16)]
    ways = (map(way, [batch] * len(tolerances), tolerances) for batch in sorted({1, best, 8}))
    note, run = cheapest(ways, np.load(task["reference"]), len(first), task["target"])
    return Prepared(run, len(first), run, ["heyoka"], note)


if __name__ == "__main__":
    serve(prepare)
