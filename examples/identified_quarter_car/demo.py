"""A quarter car on a test rig: its masses, stiffnesses and damper from noisy measurements, with confidence intervals.

python examples/identified_quarter_car/demo.py [--seed 0] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen
from eomgen.base.arrays import Array

BLUE, GREY = "#0072B2", "#707070"
FOLDER = Path(__file__).parent
#: The unknowns, and where the search for them starts: a third off.
UNKNOWN = {"sprung_mass": 320.0, "unsprung_mass": 24.0, "spring": 11000.0, "damper": 1300.0, "tyre": 210000.0}
#: Standard deviations of an accelerometer, a displacement transducer, and the load cell below the wheel.
NOISE = {"body_acceleration": 0.1, "suspension_travel": 0.001, "tyre_load": 40.0}
STEP, SAMPLED, END = 0.0005, 0.005, 4.0


def scene() -> dict[str, Any]:
    """Return the quarter car of ../quarter_car with five tunable parameters, its wheel on a plate that is moved."""
    data = tomllib.loads((FOLDER.parent / "quarter_car" / "scene.toml").read_text(encoding="utf-8"))
    data |= {"name": "identified_quarter_car", "description": "quarter car on a test rig"}
    for name in UNKNOWN:
        data["parameters"][name]["tunable"] = True
    del data["parameters"]["approach"]
    data["inputs"] = {"plate": {"unit": "m", "description": "height of the plate below the wheel"}}
    data["efforts"] = {"plate": {"joint": "wheel", "effort": "tyre * plate"}}
    data["outputs"]["tyre_load"]["formula"] = "tyre * (plate - q.wheel)"
    data["simulation"] = {"method": "trapezoidal", "step": STEP, "duration": END}
    return data


def plate(t: Array) -> Array:
    """Return the height of the plate, m: a sweep from 0.5 to 15 Hz, faded in."""
    frequency, rate = 0.5, 14.5 / END
    return np.asarray(0.01 * np.sin(2.0 * np.pi * (frequency * t + 0.5 * rate * t**2)) * (1.0 - np.exp(-4.0 * t)))


def measured(model: eomgen.Model, seed: int) -> dict[str, Array]:
    """Return what instruments with noise record of a run at the true parameters, at times off the grid of steps."""
    t = np.arange(0.0, END, SAMPLED)
    step = 0.25 * STEP
    fine = step * np.arange(round(END / step) + 1)
    heights = np.interp(fine, t, plate(t))  # as it is recorded, linear between samples
    run = model.simulate(END, step, inputs={"plate": heights}, error_estimate=False)
    rng = np.random.default_rng(seed)
    rows = np.rint(t / step).astype(int)
    return {"t": t, "plate": plate(t)} | {
        name: run.outputs[name][rows] + noise * rng.standard_normal(len(t)) for name, noise in NOISE.items()
    }


def identified(model: eomgen.Model, data: dict[str, Array]) -> eomgen.Identification:
    return eomgen.identify(model, data, list(UNKNOWN), values=UNKNOWN, step=STEP)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=FOLDER)
    given = parser.parse_args()
    model = eomgen.build(scene())
    data = measured(model, given.seed)
    found = identified(model, data)
    print(found.message)
    for one in found.estimates:
        true = model.parameters[one.name]
        print(f"{one.name:14} {one.value:10.6g} {one.unit:6}  {one.low:.6g} to {one.high:.6g}, true {true:.6g}")
    motions = {name: values for name, values in data.items() if name != "tyre_load"}
    print("without the load cell:")
    for part in identified(model, motions).combinations:
        print(f"  {part.text} = {part.value:.6g}, {part.low:.6g} to {part.high:.6g}")

    figure, rows = plt.subplots(3, 2, figsize=(10, 6.5), layout="constrained", sharex=True, width_ratios=(3, 2))
    record = found.records[0]
    for column, (compared, left) in zip(found.columns, rows, strict=True):
        compared.plot(record.t, record.data[column.name], ".", color=GREY, markersize=3, label="measured")
        compared.plot(record.t, record.model[column.name], color=BLUE, linewidth=1.0, label="model")
        compared.set_ylabel(f"{column.name.replace('_', ' ')}, {column.unit}")
        left.plot(record.t, record.residuals[column.name] / column.deviation, ".", color=BLUE, markersize=2)
        left.set_ylim(-5, 5)
    rows[0][0].legend(frameon=False, loc="upper left")
    rows[0][0].set_title("sweep of the plate from 0.5 to 15 Hz")
    rows[0][1].set_title("residuals in standard deviations")
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    for axes in rows[-1]:
        axes.set_xlabel("time, s")
    given.out.mkdir(parents=True, exist_ok=True)
    figure.savefig(given.out / "identified_quarter_car.png", dpi=90)


if __name__ == "__main__":
    main()
