"""Slider-crank whose crank and rod are geometrically exact beams, spun up and then turned on at the rate it has.

    python examples/flexible_slider_crank/crank.py [--elements 4] [--step 0.005] [--picture FILE]

Prints what the motor and the sections have to bear, and draws shapes, the rod's deflection and its bending moments.
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

#: Lengths in m; the crank turns by 3 pi/50 t^2 for three quarters of a turn, and on at the rate that it has then.
CRANK, ROD = 10.0, 20.0
ANGLE = "3 * pi / 50 * t**2 if t < 5 else 3 * pi / 2 + 3 * pi / 5 * (t - 5)"
SHOWN = (0.0, 3.0, 4.5, 5.6, 6.6, 8.0)
#: N, N m^2, kg/m and kg m by the section's axes.
STIFFNESS = {
    "stretch": 112e8, "shear_y": 149.3e8, "shear_z": 149.3e8, "torsion": 149.3e4, "bending_y": 149.3e6,
    "bending_z": 149.3e6,
}  # fmt: skip  # a table
MASS, INERTIA = 432.0, [11.5182, 5.7591, 5.7591]


def scene(elements: int) -> dict[str, Any]:
    """Return the scene with so many elements in the crank, and twice as many in the rod."""

    def beam(length: float, count: int) -> dict[str, Any]:
        section = {"mass_per_length": MASS, "rotary_inertia": INERTIA, "stiffness": STIFFNESS}
        return {"model": "cosserat", "length": length, "elements": count, **section}

    hinge = {"type": "revolute", "axis": [0, 0, 1]}
    return {
        "format": 1,
        "name": "flexible_slider_crank",
        "gravity": [0, 0, 0],
        "beams": {"crank": beam(CRANK, elements), "rod": beam(ROD, 2 * elements)},
        "joints": {
            "motor": {**hinge, "parent": "base", "child": "crank", "drive": ANGLE},
            "pin": {**hinge, "parent": "crank", "child": "rod", "position": [CRANK, 0, 0]},
        },
        "constraints": {
            "guide": {
                "type": "point_on_line",
                "first": {"body": "base", "axis": [1, 0, 0]},
                "second": {"body": "rod", "position": [ROD, 0, 0]},
            }
        },
        "points": {
            "pin": {"body": "crank", "position": [CRANK, 0, 0]},
            "middle": {"body": "rod", "position": [ROD / 2, 0, 0]},
            "slider": {"body": "rod", "position": [ROD, 0, 0]},
        },
        "outputs": {
            "pin": {"position": "pin"},
            "middle": {"position": "middle"},
            "slider": {"position": "slider"},
            "motor": {"formula": "drive_effort.motor", "unit": "N m"},
            "root": {"section_moment": "crank", "at": 0.0},
        },
        "simulation": {"duration": 10.0, "step": 0.005, "method": "generalized_alpha", "rho_inf": 0.5},
    }


def deflection(run: eomgen.Solution) -> np.ndarray:
    """Return how far the middle of the rod is from its chord, (nt,), m, to the left of it."""
    chord = run.outputs["slider"] - run.outputs["pin"]
    chord /= np.linalg.norm(chord, axis=1, keepdims=True)
    off = run.outputs["middle"] - run.outputs["pin"]
    return np.asarray(chord[:, 0] * off[:, 1] - chord[:, 1] * off[:, 0])


def draw(run: eomgen.Solution, path: Path) -> None:
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, ((shape, across), (effort, bending)) = plt.subplots(2, 2, figsize=(11, 7), layout="constrained")
    poses = run.poses
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.9, len(SHOWN)))
    for moment, colour in zip(SHOWN, colours, strict=True):
        row = int(np.argmin(np.abs(run.t - moment)))
        for beam in ("crank", "rod"):
            line = np.array([pose[row, 4:6] for name, pose in poses.items() if name.partition(".")[0] == beam])
            shape.plot(*line.T, color=colour, linewidth=2, label=f"{moment:g} s" if beam == "rod" else None)
    shape.set(xlabel="x, m", ylabel="y, m")
    shape.set_aspect("equal")
    shape.legend(frameon=False, fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    across.plot(run.t, deflection(run), color="#0072B2")
    across.set(xlabel="time, s", ylabel="middle of the rod off its chord, m")
    effort.plot(run.t, 1e-6 * run.outputs["motor"], color="#D55E00")
    effort.set(xlabel="time, s", ylabel="torque of the motor, MN m")
    for axes in (across, effort):
        axes.grid(alpha=0.3, linewidth=0.5)
    rod = run.section_loads["rod"]
    moments = 1e-6 * rod.moment[..., 2]
    size = np.abs(moments).max()
    borders = np.append(run.t - 0.5 * run.t[1], run.t[-1])
    drawn = bending.pcolormesh(borders, rod.nodes, moments.T, cmap="RdBu_r", vmin=-size, vmax=size)
    figure.colorbar(drawn, ax=bending, label="bending moment of the rod, MN m", pad=0.01)
    bending.set(xlabel="time, s", ylabel="x of the rod, m")
    figure.savefig(path, dpi=110)
    print(path)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--elements", type=int, default=4)
    parser.add_argument("--step", type=float, default=0.005)
    parser.add_argument("--picture", type=Path, default=Path(__file__).with_name("flexible_slider_crank.png"))
    arguments = parser.parse_args()
    run = eomgen.build(scene(arguments.elements)).simulate(step=arguments.step, error_estimate=False)
    print(run.message)
    off = deflection(run)
    print(f"middle of the rod off its chord: {off.min():.4g} m to {off.max():.4g} m")
    print(f"torque of the motor: {run.outputs['motor'].min():.4g} N m to {run.outputs['motor'].max():.4g} N m")
    print(f"slider at the end: {run.outputs['slider'][-1, 0]:.5g} m")
    draw(run, arguments.picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
