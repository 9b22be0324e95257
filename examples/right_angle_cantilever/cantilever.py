"""Right-angle cantilever of Simo and Vu-Quoc: two geometrically exact beams, pushed out of their plane at the elbow.

    python examples/right_angle_cantilever/cantilever.py [--elements 10] [--step 0.01] [--picture FILE]

Prints what the motion keeps of its energy once the push is over, and draws deflections and section moments.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen

#: Of each leg, m; the push is over after so many s.
LENGTH, PUSHED = 10.0, 2.0
MOMENTS = (0.0, 2.0, 3.6, 5.0, 6.8, 8.6)


def scene(elements: int) -> dict[str, Any]:
    """Return the scene with so many elements in each leg: an arm along x, clamped at 0, and a forearm along y."""
    bending = dict.fromkeys(("torsion", "bending_y", "bending_z"), 1e3)
    leg = {
        "model": "cosserat",
        "length": LENGTH,
        "elements": elements,
        "mass_per_length": 1.0,
        "rotary_inertia": [20, 10, 10],
        "stiffness": {**bending, **dict.fromkeys(("stretch", "shear_y", "shear_z"), 1e6)},
    }
    elbow = {"position": [LENGTH, 0, 0], "rotation": [{"axis": [0, 0, 1], "angle": "pi / 2"}]}
    end = [LENGTH, 0, 0]
    return {
        "format": 1,
        "name": "right_angle_cantilever",
        "gravity": [0, 0, 0],
        "beams": {"arm": leg, "forearm": leg},
        "joints": {
            "clamp": {"type": "fixed", "parent": "base", "child": "arm"},
            "elbow": {"type": "fixed", "parent": "arm", "child": "forearm", **elbow},
        },
        "forces": {"push": {"body": "arm", "point": end, "force": [0, 0, "50 * max(0, 1 - abs(t - 1))"]}},
        "points": {"elbow": {"body": "arm", "position": end}, "tip": {"body": "forearm", "position": end}},
        "outputs": {
            "elbow": {"position": "elbow"},
            "tip": {"position": "tip"},
            "root": {"section_moment": "arm", "at": 0.0},
        },
        "simulation": {"duration": 30.0, "step": 0.01, "method": "generalized_alpha", "rho_inf": 0.9},
    }


def energy_kept(run: eomgen.Solution) -> tuple[float, float]:
    """Return the energy after the push, J, and by how much of it the later motion changes it."""
    free = run.t >= PUSHED
    energy = run.energy["kinetic"][free] + run.energy["potential"][free]
    return float(energy[0]), float(np.ptp(energy) / energy[0])


def draw(run: eomgen.Solution, path: Path) -> None:
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure = plt.figure(figsize=(11, 7), layout="constrained")
    shape = figure.add_subplot(2, 2, 1, projection="3d")
    across, bending, twist = (figure.add_subplot(2, 2, place) for place in (2, 3, 4))
    poses = run.poses
    legs = [[name for name in poses if name.partition(".")[0] == leg] for leg in ("arm", "forearm")]
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.9, len(MOMENTS)))
    for moment, colour in zip(MOMENTS, colours, strict=True):
        row = int(np.argmin(np.abs(run.t - moment)))
        line = np.array([poses[name][row, 4:] for leg in legs for name in leg])
        shape.plot(*line.T, color=colour, linewidth=2, label=f"{moment:g} s")
    shape.set(xlabel="x, m", ylabel="y, m", zlabel="z, m")
    shape.set_aspect("equal")
    shape.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.3, 0.5))
    for name, colour in (("tip", "#0072B2"), ("elbow", "#D55E00")):
        across.plot(run.t, run.outputs[name][:, 2], color=colour, label=name)
    across.set(xlabel="time, s", ylabel="z, m")
    across.legend(frameon=False, ncols=2)
    across.grid(alpha=0.3, linewidth=0.5)
    arm = run.section_loads["arm"]
    for axes, part, what in ((bending, 1, "bending moment about y"), (twist, 0, "torque")):
        size = np.abs(arm.moment[..., part]).max()
        borders = np.append(run.t - 0.5 * run.t[1], run.t[-1])
        drawn = axes.pcolormesh(borders, arm.nodes, arm.moment[..., part].T, cmap="RdBu_r", vmin=-size, vmax=size)
        figure.colorbar(drawn, ax=axes, label=f"{what} of the arm, N m", pad=0.01)
        axes.set(xlabel="time, s", ylabel="x of the arm, m")
    figure.savefig(path, dpi=110)
    print(path)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--elements", type=int, default=10)
    parser.add_argument("--step", type=float, default=0.01)
    parser.add_argument("--picture", type=Path, default=Path(__file__).with_name("right_angle_cantilever.png"))
    arguments = parser.parse_args()
    run = eomgen.build(scene(arguments.elements)).simulate(step=arguments.step, error_estimate=False)
    print(run.message)
    energy, changed = energy_kept(run)
    print(f"energy after the push: {energy:.5g} J, kept to {changed:.2g} of it")
    for name in ("tip", "elbow"):
        z = run.outputs[name][:, 2]
        print(f"{name}: z from {z.min():.4g} m to {z.max():.4g} m")
    print(f"largest moment at the clamp: {np.linalg.norm(run.outputs['root'], axis=1).max():.4g} N m")
    draw(run, arguments.picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
