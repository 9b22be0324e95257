"""Roll-up: a moment at the end of a cantilever bends it to a circle, and twice as much to two.

    python examples/roll_up/roll_up.py [--elements 8] [--picture FILE]

Prints how far the ends of circles are apart, and draws shapes and bending moments at rest.
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

LENGTH, BENDING = 10.0, 500.0
#: Circles that the beam is rolled up to.
TURNS = (0.0, 0.25, 0.5, 0.75, 1.0, 2.0)


def scene(elements: int) -> dict[str, Any]:
    """Return the scene: a beam along x, clamped at 0, with a moment about -y that bends it upwards."""
    return {
        "format": 1,
        "name": "roll_up",
        "gravity": [0, 0, 0],
        "parameters": {"turns": {"value": 1.0, "tunable": True}},
        "beams": {
            "strip": {
                "model": "cosserat",
                "length": LENGTH,
                "elements": elements,
                "mass_per_length": 1.0,
                "rotary_inertia": [0.02, 0.01, 0.01],
                "stiffness": {
                    **dict.fromkeys(("torsion", "bending_y", "bending_z"), BENDING),
                    **dict.fromkeys(("stretch", "shear_y", "shear_z"), 1e4),
                },
            }
        },
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "strip"}},
        "forces": {
            "roll": {
                "body": "strip",
                "point": [LENGTH, 0, 0],
                "torque": [0, f"-{2.0 * math.pi * BENDING / LENGTH!r} * turns", 0],
            }
        },
        "points": {"end": {"body": "strip", "position": [LENGTH, 0, 0]}},
        "outputs": {"end": {"position": "end"}},
    }


def at_rest(model: eomgen.Model, turns: float) -> np.ndarray:
    """Return the configuration at rest."""
    return np.asarray(model.equilibrium(parameters={"turns": turns}).q)


def end_of(model: eomgen.Model, q: np.ndarray) -> np.ndarray:
    """Return where the end of the strip is, (3,), m."""
    return np.asarray(model.outputs(q, np.zeros(model.nv))["end"])


def circle(turns: float, x: np.ndarray) -> np.ndarray:
    """Return places, (n, 2), x and z, of the exact shape."""
    if not turns:
        return np.stack([x, 0.0 * x], axis=1)
    radius = LENGTH / (2.0 * math.pi * turns)
    return radius * np.stack([np.sin(x / radius), 1.0 - np.cos(x / radius)], axis=1)


def draw(model: eomgen.Model, path: Path) -> None:
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, (shape, moments) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.9, len(TURNS)))
    for turns, colour in zip(TURNS, colours, strict=True):
        q = at_rest(model, turns)
        pose = model.evaluate("poses", q)["pose"]
        shape.plot(*circle(turns, np.linspace(0.0, LENGTH, 300)).T, color=colour, linewidth=1.5, label=f"{turns:g}")
        shape.plot(pose[:, 4], pose[:, 6], "o", color=colour, markersize=4)
        loads = model.section_loads(q)["strip"]
        x = np.repeat(loads.nodes, 2)[1:-1]
        moments.plot(x, loads.moment_at_ends[..., 1].ravel(), color=colour)
    shape.set_aspect("equal")
    shape.set(xlabel="x, m", ylabel="z, m", title="Circles, and nodes at rest, by turns")
    shape.legend(frameon=False, ncols=2)
    moments.set(xlabel="x along the strip, m", ylabel="bending moment about y, N m", title="What its sections bear")
    for axes in (shape, moments):
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(path, dpi=120)
    print(path)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--elements", type=int, default=8)
    parser.add_argument("--picture", type=Path, default=Path(__file__).with_suffix(".png"))
    arguments = parser.parse_args()
    model = eomgen.build(scene(arguments.elements))
    for turns in (1.0, 2.0):
        gap = np.linalg.norm(end_of(model, at_rest(model, turns)))
        print(f"{turns:g} turns: the ends are {gap:.2g} m apart")
    draw(model, arguments.picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
