"""Gradients for each independent sample of 32^3 cells with 0.04 objects each, and for each accepted trajectory:
``python -m tests.fields.independent suzuki4 0.7 --samples 20000``; of one object, ``--mean 1 --mass prior``.

Not a test: errors of autocorrelation times go with the root of the samples.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

from eomgen.fields import FieldPosterior, Sampler, autocorrelation_time
from tests.fields.density import counted


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("method")
    arguments.add_argument("steps", type=float, nargs="+")
    arguments.add_argument("--samples", type=int, default=1000)
    arguments.add_argument("--cells", type=int, default=32)
    arguments.add_argument("--mean", type=float, default=0.04)
    arguments.add_argument("--mass", default="fisher")
    arguments.add_argument("--first", default="drift")
    arguments.add_argument("--duration", type=float, default=1.5)
    arguments.add_argument("--seed", type=int, default=1, help="of the data")
    arguments.add_argument("--transforms", default="scipy")
    given = arguments.parse_args()
    made, truth = counted(given.cells, given.mean, given.seed)
    posterior = FieldPosterior(
        made.mesh, made.energy_of_cell, made.operators, made.data, transforms=given.transforms
    )  # fmt: skip
    for step in given.steps:
        sampler = Sampler(
            posterior, method=given.method, step=step, duration=given.duration, first=given.first, mass=given.mass,
            start=[truth], seed=3, watched=range(0, made.mesh.size, 109), guard=math.inf,
        )  # fmt: skip
        samples = sampler.draw(given.samples)
        each, times = float(np.mean(samples.gradients)), autocorrelation_time(samples.power)
        taken = np.exp(-np.maximum(samples.energy_errors, 0.0))
        cost, spread = each / float(taken.mean()), float(taken.std() / taken.mean()) / math.sqrt(taken.size)
        of_cells, worst = samples.gradients_per_sample
        print(
            f"{given.cells}^3 cells, {given.method}, step {step:g}: acceptance {samples.acceptance:.3f}, {each:.2f}"
            f" gradients, {cost:.1f} +- {cost * spread:.1f} for each accepted trajectory; for each independent sample"
            f" {of_cells:.1f} (cells), {each * float(np.nanmean(times)):.1f} (mean of bins of k), {worst:.1f} +-"
            f" {worst * samples.autocorrelation_error:.1f} (worst bin)",
            flush=True,
        )


if __name__ == "__main__":
    main()
