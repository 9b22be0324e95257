"""Weave and wobble of a motorcycle: frequency and damping over the speed, and a kick at the handlebar.

python examples/motorcycle/weave_and_wobble.py [--picture FILE]
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

SCENE = Path(__file__).parent / "system" / "motorcycle.toml"
#: Below 7 m/s weave is not a separate mode, see README.md.
SPEEDS = np.linspace(7.5, 60.0, 43)
#: Values of the steering damper, N m s/rad, with their colours.
DAMPERS = {6.0: "#0072B2", 0.0: "#D55E00"}
LINES = {"weave": "-", "wobble": "--"}


def weave_and_wobble(model: eomgen.Model, damper: float, speeds: np.ndarray = SPEEDS) -> dict[str, np.ndarray]:
    """Return the eigenvalues, 1/s, of both modes over increasing speeds; NaN if a mode does not oscillate."""
    diagram = model.campbell("x", speeds, coordinates={"y": 0.0}, orders=(), parameters={"damper": damper, "kick": 0.0})
    damping = -diagram.eigenvalues.real / np.abs(diagram.eigenvalues)
    least = np.argsort(np.nan_to_num(damping[-1], nan=1.0))[:2]  # at the highest speed both are the least damped modes
    slow, fast = sorted(least, key=lambda mode: float(diagram.frequencies[-1, mode]))
    return {"weave": diagram.eigenvalues[:, slow], "wobble": diagram.eigenvalues[:, fast]}


def draw(model: eomgen.Model, path: Path) -> None:
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, (frequency, damping, kicked) = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained")
    for damper, colour in DAMPERS.items():
        for name, roots in weave_and_wobble(model, damper).items():
            shown = {"linestyle": LINES[name], "color": colour, "label": f"{name}, {damper:g} N m s/rad"}
            frequency.plot(SPEEDS, roots.imag / (2.0 * np.pi), **shown)
            damping.plot(SPEEDS, -roots.real / np.abs(roots), **shown)
        run = model.simulate(parameters={"damper": damper})
        kicked.plot(run.t, np.rad2deg(run.outputs["steer"]), color=colour, linewidth=0.9, label=f"{damper:g} N m s/rad")
    damping.axhline(0.0, color="#888888", linewidth=0.8)
    frequency.set(xlabel="speed, m/s", ylabel="frequency, Hz", ylim=(0, None))
    damping.set(xlabel="speed, m/s", ylabel="damping ratio", ylim=(-0.12, 0.8))
    kicked.set(xlabel="time, s", ylabel="steering angle, deg", title="A kick at the handlebar at 40 m/s")
    for axes in (frequency, damping, kicked):
        axes.legend(frameon=False, fontsize=8, title="steering damper", title_fontsize=8)
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(path, dpi=120)
    print(path)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--picture", type=Path, default=Path(__file__).with_name("motorcycle.png"))
    model = eomgen.build(SCENE)
    for name, roots in weave_and_wobble(model, 6.0, np.array([38.0, 40.0])).items():
        root = roots[-1]
        print(f"{name} at 40 m/s: {root.imag / (2 * np.pi):.2f} Hz, damping ratio {-root.real / abs(root):.3f}")
    draw(model, parser.parse_args().picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
