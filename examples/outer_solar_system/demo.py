"""The outer solar system: orbits, and errors of energy and angular momentum over 2e6 days and more.

python examples/outer_solar_system/demo.py --out out/outer_solar_system
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen

SYSTEM = Path(__file__).parent / "system" / "outer_solar_system.toml"
PLANETS = ("sun", "Jupiter", "Saturn", "Uranus", "Neptune", "Pluto")
#: Methods with steps in days that cost about the same, and their colours.
METHODS = {"leapfrog": 20.0, "yoshida4": 60.0, "suzuki4": 100.0, "omf4": 100.0, "yoshida6": 180.0}
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
#: Days of the long runs: 27 000 years, 1e6 gradients of forces or half of that.
DAYS = 9_900_000.0


#: Methods of the table of orders, with their steps in days; errors over 1e6 steps of the first.
ORDERS = {
    "leapfrog": (100.0, 50.0),
    "minimum_norm2": (100.0, 50.0),
    "yoshida4": (100.0, 50.0),
    "suzuki4": (100.0, 50.0),
    "omf4": (100.0, 50.0),
    "yoshida6": (100.0, 50.0),
    "blanes_moan6": (100.0, 50.0),
    "kahan_li8": (200.0, 100.0),
}


def orders(model: Any) -> None:
    """Print the orders of energy errors over 1e6 days, and the largest error over 1e6 steps."""
    options: Any = {"compensated": True, "error_estimate": False}
    for method, steps in ORDERS.items():
        errors = [
            model.simulate(1e6, h, method=method, record_every=round(1000 / h), **options).energy_error for h in steps
        ]
        long = model.simulate(1e6 * steps[0], steps[0], method=method, record_every=100, **options)
        print(f"{method:13s} order {np.log2(errors[0] / errors[1]):.2f} from {steps[0]:g} to {steps[1]:g} d,"
              f" largest |dE/E| over 1e6 steps of {steps[0]:g} d {long.energy_error:.2e},"
              f" {long.stats['wall_time']:.2f} s")  # fmt: skip


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--out", type=Path, default=Path("out/outer_solar_system"))
    folder = arguments.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    model: Any = eomgen.build(SYSTEM)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained")
    run = model.simulate(record_every=1, error_estimate=False)
    for body, name in enumerate(PLANETS):
        place = run.q[:, 3 * body : 3 * body + 2] - run.q[:, :2]
        left.plot(place[:, 0], place[:, 1], "o" if body == 0 else "-", markersize=4, linewidth=0.7, label=name)
    left.set_aspect("equal")
    left.set_title("548 years about the sun (au)", loc="left")
    left.legend(frameon=False, fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    for (method, step), colour in zip(METHODS.items(), COLOURS, strict=True):
        long = model.simulate(
            DAYS, step, method=method, record_every=max(1, round(9000 / step)), compensated=True, error_estimate=False
        )
        total, momentum = long.energy["total"], long.outputs["angular_momentum"]
        error = np.abs(total / total[0] - 1)
        lost = np.abs(momentum / momentum[0] - 1).max()
        largest = np.maximum.accumulate(error)
        right.loglog(long.t[1:] / 365.25, largest[1:], color=colour, label=f"{method}, {step:g} d")
        print(f"{method:9s} {step:5g} d: largest |dE/E| {error.max():.2e}, of angular momentum {lost:.1e},"
              f" {long.stats['gradients']} gradients, {long.stats['wall_time']:.2f} s")  # fmt: skip
    right.set_title("largest |dE/E| so far, at equal cost", loc="left")
    right.set_xlabel("years")
    right.set_ylim(1e-8, 1e-2)
    right.legend(frameon=False, fontsize="small", ncols=2, loc="upper left")
    for axes in (left, right):
        axes.grid(alpha=0.3, linewidth=0.5)
    orders(model)
    picture = folder / "outer_solar_system.png"
    figure.savefig(picture, dpi=120)
    print(picture)


if __name__ == "__main__":
    main()
