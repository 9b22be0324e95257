"""Path, height, speed and load of the hopping leg.

python examples/hopping_leg/hop.py [--picture FILE]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen

SCENE = Path(__file__).parent / "system" / "hopper.toml"
BLUE, VERMILION, GREY = "#0072B2", "#D55E00", "#888888"


def draw(run: eomgen.Solution, path: Path) -> None:
    assert run.events is not None
    tops, hip, foot = run.events["apex"], run.outputs["hip"], run.outputs["foot"]
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, ((along, height), (speed, load)) = plt.subplots(2, 2, figsize=(11, 5.4), layout="constrained")
    for row in range(0, len(run.t), 250):
        along.plot([hip[row, 0], foot[row, 0]], [hip[row, 1], foot[row, 1]], color=GREY, linewidth=0.5)
    along.plot(*hip.T, color=BLUE, linewidth=1.0, label="hip")
    along.plot(*foot.T, color=VERMILION, linewidth=1.0, label="foot")
    along.set(xlabel="distance, m", ylabel="height, m", ylim=(-0.05, 1.05))
    height.plot(run.t, hip[:, 1], color=BLUE, linewidth=0.9)
    height.plot(tops.t, tops.q[:, 1], "o", color=VERMILION, markersize=4, label="top of a hop")
    height.plot(run.t, run.outputs["top"], ":", color="black", linewidth=0.9, label="wanted")
    height.set(xlabel="time, s", ylabel="height of the hip, m")
    speed.plot(run.t, run.outputs["speed"][:, 0], color=BLUE, linewidth=0.9, label="forward speed")
    speed.plot(run.t, run.outputs["speed"][:, 1], ":", color="black", linewidth=0.9, label="wanted")
    speed.set(xlabel="time, s", ylabel="speed, m/s")
    load.plot(run.t, 1e-3 * run.outputs["load"], color=BLUE, linewidth=0.7)
    load.set(xlabel="time, s", ylabel="load of the foot, kN")
    for axes, columns in ((along, 2), (height, 1), (speed, 1)):
        axes.legend(frameon=False, fontsize=8, ncols=columns, loc="upper right" if axes is along else "best")
    for axes in (along, height, speed, load):
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(path, dpi=120)
    print(path)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--picture", type=Path, default=Path(__file__).with_name("hopping_leg.png"))
    run = eomgen.build(SCENE).simulate()
    assert run.events is not None
    print(f"tops of the last hops, m: {np.array2string(run.events['apex'].q[-3:, 1], precision=4)}")
    draw(run, parser.parse_args().picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
