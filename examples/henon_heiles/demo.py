"""The Henon-Heiles system: a section of Poincare, energy errors over 1e6 steps, and errors against work.

python examples/henon_heiles/demo.py --out out/henon_heiles
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

import eomgen
from eomgen.base.csv_tables import write_table

Array = NDArray[np.float64]
SYSTEM = Path(__file__).parent / "system" / "henon_heiles.toml"
#: Of the runs of 1e6 steps: methods, their step, and their colours.
LONG = {
    "leapfrog": "#0072B2",
    "yoshida4": "#D55E00",
    "suzuki4": "#009E73",
    "omf4": "#CC79A7",
    "yoshida6": "#E69F00",
    "blanes_moan6": "#7F7F7F",
    "kahan_li8": "#000000",
}
STEP, STEPS = 0.1, 1_000_000
#: Where motions of the section start: y and p_y at x = 0.
STARTS = ((0.12, 0.12), (0.3, 0.0), (-0.15, 0.0), (0.0, 0.35), (0.55, 0.0), (0.0, 0.02), (0.2, 0.2), (-0.25, 0.1))


def start(y: float, p_y: float, energy: float) -> dict[str, float]:
    """Return a state with x = 0, p_x > 0 and an energy."""
    return {"x": 0.0, "y": y, "p_y": p_y, "p_x": math.sqrt(2 * energy - p_y**2 - y**2 + 2 * y**3 / 3)}


def section(model: Any, y: float, p_y: float, energy: float, t_end: float = 20_000.0) -> Array:
    """Return y and p_y, (points, 2), where a motion passes x = 0 with p_x > 0, by cubics through rows."""
    run = model.simulate(t_end, STEP, method="omf4", initial=start(y, p_y, energy), error_estimate=False)
    names = [*model.q_names, *model.p_names]
    rows = np.hstack([run.q, run.p])
    dH_dq, dH_dp = model.gradient(run.q, run.p)
    rates = np.hstack([dH_dp, -dH_dq])
    x = rows[:, names.index("x")]
    at = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    share = np.zeros(len(at))
    for _ in range(40):  # the root of x within a step, by its cubic
        value, slope = _cubic(rows, rates, at, share, names.index("x"))
        share = np.clip(share - value / slope, 0.0, 1.0)
    return np.stack([_cubic(rows, rates, at, share, names.index(name))[0] for name in ("y", "p_y")], axis=1)


def _cubic(rows: Array, rates: Array, at: Array, share: Array, column: int) -> tuple[Array, Array]:
    """Return Hermite's cubic of a column at a share of the steps from some rows, and its slope."""
    first, last = rows[at, column], rows[at + 1, column]
    slope, other = STEP * rates[at, column], STEP * rates[at + 1, column]
    gain = last - first
    square, cube = 3 * gain - 2 * slope - other, slope + other - 2 * gain
    value = first + share * (slope + share * (square + share * cube))
    return value, slope + share * (2 * square + 3 * share * cube)


def work(model: Any) -> dict[str, list[tuple[float, float]]]:
    """Return the largest energy error over 200 units of time against gradients, by method."""
    found: dict[str, list[tuple[float, float]]] = {}
    for method in (*LONG, "minimum_norm2"):
        found[method] = []
        for halvings in range(8):
            step = 0.8 / 2**halvings
            run = model.simulate(200.0, step, method=method, error_estimate=False)
            if run.success and run.energy_error < 1:
                found[method].append((run.stats["gradients"], max(run.energy_error, 1e-16)))
    return found


def order_seen(model: Any, method: str) -> float:
    """Return the order by which energy errors over 1000 units of time fall from twice the step to the step."""
    errors = [model.simulate(1000.0, h, method=method, error_estimate=False).energy_error for h in (2 * STEP, STEP)]
    return math.log2(errors[0] / errors[1])


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--out", type=Path, default=Path("out/henon_heiles"))
    folder = arguments.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    model: Any = eomgen.build(SYSTEM)
    figure, panels = plt.subplots(2, 2, figsize=(10, 8), layout="constrained")
    for axes, energy in zip(panels[0], (1 / 12, 1 / 8), strict=True):
        for y, p_y in STARTS:
            if 2 * energy - p_y**2 - y**2 + 2 * y**3 / 3 > 0:
                points = section(model, y, p_y, energy)
                axes.plot(points[:, 0], points[:, 1], ".", markersize=1.2)
        axes.set_title(f"x = 0, p_x > 0, E = 1/{round(1 / energy)}", loc="left")
        axes.set_xlabel("y")
        axes.set_ylabel("p_y")
    left, right = panels[1]
    table = []
    for method, colour in LONG.items():
        run = model.simulate(
            STEP * STEPS, STEP, method=method, record_every=100, compensated=True, error_estimate=False
        )
        total = run.energy["total"]
        error = np.maximum.accumulate(np.abs(total / total[0] - 1))
        left.loglog(run.t[1:], error[1:], color=colour, label=method)
        order = order_seen(model, method)
        table.append([order, run.energy_error, run.stats["gradients"], run.stats["wall_time"]])
        print(f"{method:14s} order {order:.2f}, largest |dE/E| over {STEPS} steps of {STEP}: {run.energy_error:.2e},"
              f" {run.stats['gradients']} gradients, {run.stats['wall_time']:.2f} s")  # fmt: skip
    left.set_title(f"1e6 steps of {STEP}: largest energy error so far", loc="left")
    left.set_xlabel("t")
    left.set_ylabel("|dE/E|")
    left.set_ylim(1e-14, 100.0)
    left.legend(frameon=False, fontsize="small", ncols=2, loc="upper left")
    for method, points in work(model).items():
        gradients, errors = np.array(points).T
        right.loglog(gradients, errors, "o-", markersize=3, color=LONG.get(method, "#56B4E9"), label=method)
    right.set_title("largest energy error over 200 units of time", loc="left")
    right.set_xlabel("gradients")
    right.legend(frameon=False, fontsize="small")
    for axes in panels.flat:
        axes.grid(alpha=0.3, linewidth=0.5)
    write_table(folder / "energy_errors.csv", ["order", "energy_error", "gradients", "seconds"], np.array(table, float))
    picture = folder / "henon_heiles.png"
    figure.savefig(picture, dpi=120)
    print(picture)


if __name__ == "__main__":
    main()
