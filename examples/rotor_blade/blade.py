"""Blade of a wind turbine by the 6 x 6 stiffness and inertia of its section: frequencies over the speed of the rotor.

    python examples/rotor_blade/blade.py [--elements 8] [--picture FILE]

Prints frequencies at rest and at 1 rad/s, each the limit of two meshes, and draws them over the speed.
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
from numpy.typing import NDArray

import eomgen

LENGTH = 60.0
#: Of the section, forces first: stretch, shear along y and z (N), torsion, bending about y and z (N m^2).
STIFFNESS = np.array(
    [
        [2.389e9, 1.524e6, 6.734e6, -3.382e7, -2.627e7, -4.736e8],
        [1.524e6, 4.334e8, -3.741e6, -2.935e5, 1.527e7, 3.835e5],
        [6.734e6, -3.741e6, 2.743e7, -4.592e5, -6.869e5, -4.742e6],
        [-3.382e7, -2.935e5, -4.592e5, 2.167e7, -6.279e5, 1.430e6],
        [-2.627e7, 1.527e7, -6.869e5, -6.279e5, 1.970e7, 1.209e7],
        [-4.736e8, 3.835e5, -4.742e6, 1.430e6, 1.209e7, 4.406e8],
    ]
)
#: The same of its inertia, about the axis: mass (kg/m), products of mass and place (kg), rotary inertia (kg m).
INERTIA = np.array(
    [
        [258.053, 0.0, 0.0, 0.0, 7.07839, -71.6871],
        [0.0, 258.053, 0.0, -7.07839, 0.0, 0.0],
        [0.0, 0.0, 258.053, 71.6871, 0.0, 0.0],
        [0.0, -7.07839, 71.6871, 48.59, 0.0, 0.0],
        [7.07839, 0.0, 0.0, 0.0, 2.172, 0.0],
        [-71.6871, 0.0, 0.0, 0.0, 0.0, 46.418],
    ]
)
_ROTATIONS_FIRST = np.ix_([3, 4, 5, 0, 1, 2], [3, 4, 5, 0, 1, 2])
#: Names of the lowest modes at rest, by what they move most.
MODES = ("first flap", "first lag", "second flap", "third flap", "second lag")


def scene(elements: int) -> dict[str, Any]:
    """Return the scene with so many elements: x along the blade, z along the axis of the rotor."""
    return {
        "format": 1,
        "name": "rotor_blade",
        "gravity": [0, 0, 0],
        "parameters": {"speed": {"value": 0.0, "unit": "rad/s", "tunable": True}},
        "base": {"rotation": [{"axis": [0, 0, 1], "angle": "speed * t"}]},
        "beams": {
            "blade": {
                "model": "cosserat",
                "length": LENGTH,
                "elements": elements,
                "stiffness_matrix": STIFFNESS[_ROTATIONS_FIRST].tolist(),
                "inertia_matrix": INERTIA[_ROTATIONS_FIRST].tolist(),
            }
        },
        "joints": {"root": {"type": "fixed", "parent": "base", "child": "blade"}},
    }


def frequencies(model: eomgen.Model, speed: float) -> NDArray[np.float64]:
    """Return the frequencies of the lowest modes of the blade that turns steadily, rad/s."""
    linear = model.linearize(parameters={"speed": speed})
    if speed and linear.reference.what != "steady motion":
        raise eomgen.NumericalError(f"no steady motion is found at {speed:g} rad/s, but an {linear.reference.what}")
    return np.asarray(linear.modes().angular_frequency[: len(MODES)])


def limits(elements: int, speeds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return frequencies by speed and mode, from two meshes, the finer with so many elements, by their order, 2."""
    coarse, fine = (
        np.array([frequencies(model, float(speed)) for speed in speeds])
        for model in (eomgen.build(scene(n), profile="quick") for n in (elements // 2, elements))
    )
    return np.asarray((4.0 * fine - coarse) / 3.0)


def draw(speeds: NDArray[np.float64], found: NDArray[np.float64], path: Path) -> None:
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(figsize=(7, 4.2), layout="constrained")
    colours = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
    for name, colour, line in zip(MODES, colours, found.T, strict=True):
        axes.plot(speeds, line, color=colour, marker=".", markersize=4, label=name)
    for order in (1, 3, 6):
        axes.plot(speeds, order * speeds, color="#888888", linewidth=0.8, linestyle=":")
        axes.annotate(
            f"{order} per turn", (speeds[-1], order * speeds[-1]), color="#666666", fontsize=8, ha="right", va="bottom"
        )
    axes.set(xlabel="speed of the rotor, rad/s", ylabel="frequency, rad/s", xlim=(0, speeds[-1]), ylim=(0, None))
    axes.legend(frameon=False, ncols=5, loc="upper center", bbox_to_anchor=(0.5, 1.1))
    axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(path, dpi=120)
    print(path)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--elements", type=int, default=8)
    parser.add_argument("--picture", type=Path, default=Path(__file__).with_name("rotor_blade.png"))
    arguments = parser.parse_args()
    speeds = np.linspace(0.0, 1.0, 5)
    found = limits(arguments.elements, speeds)
    for name, line in zip(MODES, found.T, strict=True):
        print(f"{name}: {line[0]:.4f} rad/s at rest, {line[-1]:.4f} rad/s at {speeds[-1]:g} rad/s")
    draw(speeds, found, arguments.picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
