"""Duffing's oscillator under the square of a Gaussian process: its modes, and the deflection of many samples.

python examples/duffing_random_excitation/demo.py [--samples 2000] [--out FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen
from eomgen.base.random_inputs import standard_normals

BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"  # Okabe and Ito
FOLDER = Path(__file__).parent


def scene() -> eomgen.Scene:
    """Return q'' + 0.2 q' + q + epsilon q^3 = F0 (1 + delta g)^2 with R_g(tau) = exp(-tau^2 / 2), at rest at first."""
    return eomgen.load(FOLDER / "system" / "oscillator.toml")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--samples", type=int, default=2000)
    parser.add_argument("--out", type=Path, default=FOLDER)
    given = parser.parse_args()
    model = eomgen.build(scene())
    process = next(item.series for item in model.description.inputs if item.series is not None)
    print(f"{len(process.modes)} modes capture {100 * process.captured[-1]:.4f} % of the variance")
    found = model.simulate_many(vary={"seed.force": "integers(0, 999999999)"}, samples=given.samples, seed=0)
    last = np.asarray(found.results["output.deflection.final"])
    print(f"deflection after 15 s: mean {last.mean():.3f} m, standard deviation {last.std():.3f} m")

    figure, ((modes, spectrum), (forces, deflections)) = plt.subplots(2, 2, figsize=(10, 6.5), layout="constrained")
    times = np.linspace(0.0, 15.0, 301)
    for mode, colour in zip(process.modes, (BLUE, VERMILION, GREEN), strict=False):
        modes.plot(times, mode(times), color=colour, label=mode.name)
    modes.set(xlabel="time, s", title="the first modes, $\\sqrt{\\lambda_i}\\,\\varphi_i$")
    modes.legend(frameon=False)
    numbers = np.arange(1, len(process.modes) + 1)
    spectrum.semilogy(numbers, process.eigenvalues, "o", color=BLUE, label="eigenvalue, s")
    spectrum.semilogy(numbers, 1.0 - np.array(process.captured), "s", color=VERMILION, label="variance left out")
    spectrum.set(xlabel="mode", title="Karhunen-Loève spectrum")
    spectrum.legend(frameon=False)
    for seed, colour in ((1, BLUE), (2, VERMILION), (3, GREEN)):
        drawn = standard_normals(seed, len(process.modes), process.name)
        run = model.simulate(parameters=dict(zip(process.variables, drawn.tolist(), strict=True)))
        forces.plot(run.t, run.inputs["force"].ravel(), color=colour, label=f"seed {seed}")
        deflections.plot(run.t, run.q[:, 0], color=colour)
    forces.set(xlabel="time, s", ylabel="force, N", title="samples of the force")
    forces.legend(frameon=False)
    deflections.set(xlabel="time, s", ylabel="deflection, m", title="and the deflection")
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    given.out.mkdir(parents=True, exist_ok=True)
    figure.savefig(given.out / "duffing_random_excitation.png", dpi=90)


if __name__ == "__main__":
    main()
