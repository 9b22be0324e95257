"""Flying spaghetti: a geometrically exact beam that a force and a torque on its first end throw into space.

    python examples/flying_spaghetti/spaghetti.py [--elements 16] [--model kirchhoff] [--step 0.005] [--picture FILE]

Prints by how much its centre of mass, momentum and energy differ from what mechanics says of free flight, and draws it.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen

LENGTH, MASS_PER_LENGTH = 10.0, 1.0
#: The load rises for half of this time and falls for the other half, s.
THROWN = 5.0
#: Of the load, in N: 1/10 of it pulls along x, and so many m are the arms of the torque.
LOAD = f"80 * min(t, {THROWN} - t) if t < {THROWN} else 0"
#: Strains that the beam does not have, by its model.
WITHOUT = {"cosserat": (), "kirchhoff": ("shear_y", "shear_z"), "inextensible": ("stretch", "shear_y", "shear_z")}
MOMENTS = (0.0, 2.0, 3.0, 3.8, 4.4, 5.0, 5.8, 6.6)


def scene(elements: int, stiffness_damping: float = 0.0, model: str = "kirchhoff") -> dict[str, Any]:
    """Return the scene with so many elements: from (6, 0, 0) to (0, 8, 0), at rest, without gravity."""
    stiffness = dict.fromkeys(("torsion", "bending_y", "bending_z"), 500.0)
    stiffness |= dict.fromkeys(("stretch", "shear_y", "shear_z"), 1e4)
    return {
        "format": 1,
        "name": "flying_spaghetti",
        "gravity": [0, 0, 0],
        "beams": {
            "noodle": {
                "model": model,
                "length": LENGTH,
                "elements": elements,
                "mass_per_length": MASS_PER_LENGTH,
                "rotary_inertia": [10, 10, 10],
                "stiffness": {kind: value for kind, value in stiffness.items() if kind not in WITHOUT[model]},
                "stiffness_damping": stiffness_damping,
            }
        },
        "joints": {
            "flight": {
                "type": "free",
                "parent": "base",
                "child": "noodle",
                "initial": {"position": [6, 0, 0], "rotation": [{"axis": [0, 0, 1], "angle": math.atan2(8.0, -6.0)}]},
            }
        },
        "inputs": {"load": {"formula": LOAD}},
        "forces": {
            "throw": {"body": "noodle", "force": ["0.1 * load", 0, 0], "torque": [0, "-0.5 * load", "-load"]},
        },
        "simulation": {"duration": 15.0, "step": 5e-3, "method": "generalized_alpha", "rho_inf": 0.9},
    }


def axis_of(run: eomgen.Solution, elements: int) -> np.ndarray:
    """Return where the nodes are, (rows, elements + 1, 3), m."""
    names = ["noodle", *(f"noodle.{number}" for number in range(1, elements + 1))]
    return np.stack([run.poses[name][:, 4:] for name in names], axis=1)


def centre_of_mass(nodes: np.ndarray) -> np.ndarray:
    """Return the centre of mass, (rows, 3), m, of nodes that share the mass as elements do."""
    shares = np.ones(nodes.shape[1])
    shares[[0, -1]] = 0.5
    return np.einsum("k,tki->ti", shares / shares.sum(), nodes)


def in_free_flight(t: np.ndarray) -> np.ndarray:
    """Return where the centre of mass is once the load is gone: the impulse of the load is 50 N s, on 10 kg."""
    away = t - THROWN
    return np.stack([15.5 + 5.0 * away, np.full_like(t, 4.0), np.zeros_like(t)], axis=1)


def draw(nodes: np.ndarray, t: np.ndarray, path: Path) -> None:
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, panels = plt.subplots(2, 1, figsize=(9, 6.6), layout="constrained", sharex=True)
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.9, len(MOMENTS)))
    for moment, colour in zip(MOMENTS, colours, strict=True):
        row = int(np.argmin(np.abs(t - moment)))
        for axes, across in zip(panels, (1, 2), strict=True):
            axes.plot(nodes[row, :, 0], nodes[row, :, across], "-", color=colour, linewidth=2, label=f"{moment:g} s")
            axes.plot(nodes[row, 0, 0], nodes[row, 0, across], "o", color=colour, markersize=4)
    for axes, label in zip(panels, ("y, m", "z, m"), strict=True):
        axes.set_ylabel(label)
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid(alpha=0.3, linewidth=0.5)
    panels[1].set_xlabel("x, m")
    panels[0].legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    panels[0].set_title("A beam in flight; the dot is the end that is thrown", loc="left")
    figure.savefig(path, dpi=120)
    print(path)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--elements", type=int, default=16)
    parser.add_argument("--model", choices=WITHOUT, default="kirchhoff")
    parser.add_argument("--step", type=float, default=5e-3)
    parser.add_argument("--picture", type=Path, default=Path(__file__).with_suffix(".png"))
    arguments = parser.parse_args()
    run = eomgen.build(scene(arguments.elements, model=arguments.model)).simulate(
        step=arguments.step, error_estimate=False
    )
    print(run.message)
    nodes = axis_of(run, arguments.elements)
    free = run.t >= THROWN
    gap = np.abs(centre_of_mass(nodes[free]) - in_free_flight(run.t[free])).max()
    energy = np.sum([run.energy[name][free] for name in ("kinetic", "potential")], axis=0)
    print(f"centre of mass in free flight: within {gap:.2g} m")
    print(f"energy in free flight: {energy.min():.6g} J to {energy.max():.6g} J")
    draw(nodes, run.t, arguments.picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
