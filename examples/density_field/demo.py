"""Integrators on the posterior of a density field: gradients for each accepted trajectory, and burn-in.

python examples/density_field/demo.py --out out/density_field
python examples/density_field/demo.py --cells 16,32,64,128 --trajectories 30
python examples/density_field/demo.py --cells 16,32,64 --mean 1 --mass prior
python examples/density_field/demo.py --cells 256 --methods leapfrog,suzuki4 --trajectories 10 --no-burn-in
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import time
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from eomgen.fields import Sampler, Samples
from eomgen.integrators.compositions import composition_named
from eomgen.sampling import FieldProblem, field_problem
from eomgen.scene.hamiltonian.field_reading import load_fields

SYSTEM = Path(__file__).parent / "system" / "density_field.toml"
CELL = 4.8828125  # Mpc/h
#: rms energy error of a trajectory over sqrt(cells) step^order, of about 0.04 objects in a cell: where searches start.
ERRORS = {"leapfrog": 0.2, "suzuki4": 0.0065, "minimum_norm2": 0.0022, "omf4": 4e-4, "yoshida4": 0.07}
COLOURS = {"leapfrog": "#0072B2", "suzuki4": "#D55E00", "minimum_norm2": "#009E73", "omf4": "#CC79A7"}
#: rms energy errors at which chains move farthest for their gradients, by order.
BEST_RMS = {2: 0.905, 4: 0.515}


def problem_of(cells: int, mean: float) -> FieldProblem:
    """Return the problem of the file on another mesh of the same cells, and with another mean of counts."""
    system = load_fields(SYSTEM)
    parameters = tuple(
        dataclasses.replace(item, value=mean if item.name == "mean" else item.value) for item in system.parameters
    )
    changed = dataclasses.replace(system, cells=(cells,) * 3, lengths=(cells * CELL,) * 3, parameters=parameters)
    return field_problem(changed, 1)


def drawn(problem: FieldProblem, method: str, mass: str, step: float, count: int, seed: int) -> tuple[Sampler, Samples]:
    """Return samples of a chain from the truth, which is a sample of the posterior itself."""
    sampler = Sampler(
        problem.posterior, method=method, mass=mass, step=step, start=[problem.truth], seed=seed, first="drift"
    )
    return sampler, sampler.draw(count)


def cost(problem: FieldProblem, method: str, mass: str, trajectories: int) -> dict[str, float]:
    """Return gradients for each accepted trajectory of 1.5 at the best step, which a pilot run finds."""
    began, order = time.perf_counter(), composition_named(method).order
    step = (BEST_RMS[order] / (ERRORS[method] * math.sqrt(problem.mesh.size))) ** (1.0 / order)
    for seed, count in ((1, max(4, trajectories // 5)), (2, max(4, trajectories // 2))):
        sampler, samples = drawn(problem, method, mass, step, count, seed)
        used = samples.steps[0]
        errors = np.clip(samples.energy_errors, -20.0, 20.0)
        rms = max(math.sqrt(float(np.mean(errors**2))), 1e-3)
        step = min(used * min(max((BEST_RMS[order] / rms) ** (1.0 / order), 0.5), 2.0), sampler.largest_step)
    sampler, samples = drawn(problem, method, mass, step, trajectories, 3)
    taken = np.exp(-np.maximum(samples.energy_errors, 0.0))  # probabilities, which vary less than what is drawn by them
    each = float(np.mean(samples.gradients))
    return {
        "step": float(samples.steps[0]),
        "gradients": each,
        "acceptance": float(np.mean(taken)),
        "cost": each / float(np.mean(taken)),
        "spread": each / float(np.mean(taken)) * float(np.std(taken) / np.mean(taken)) / math.sqrt(trajectories),
        "rms": float(np.sqrt(np.mean(samples.energy_errors**2))),
        "largest_frequency": sampler.frequency,
        "seconds": time.perf_counter() - began,
    }


def burn_in(problem: FieldProblem, method: str, first: Any, step: float, level: float, most: int) -> int:
    """Return gradients of a chain from a field of 0 until its potential is at the level of samples."""
    sampler = Sampler(
        problem.posterior, method=method, step=step, start="zero", first=first, jitter=0.2, seed=5, guard=math.inf
    )
    gradients = 0
    while gradients < most:
        found = sampler.draw(1)
        gradients += int(found.gradients[0, 0])
        if found.potential[0, 0] >= level:
            return gradients
    return most


def fastest_burn_in(problem: FieldProblem, method: str, first: str, level: float) -> tuple[int, float]:
    """Return the fewest gradients over steps, and the step."""
    order = composition_named(method).order
    best = (BEST_RMS[order] / (ERRORS[method] * math.sqrt(problem.mesh.size))) ** (1.0 / order)
    found = (2500, 0.0)
    for part in (1.4, 1.0, 0.7, 0.5, 0.35, 0.25, 0.175, 0.125, 0.09, 0.06, 0.04):
        step = min(part * best, 0.9 * composition_named(method).stability_limit / 1.2)
        found = min(found, (burn_in(problem, method, first, step, level, found[0]), step))
    return found


def level_of(problem: FieldProblem) -> float:
    """Return the potential three deviations below its mean over samples."""
    _, samples = drawn(problem, "minimum_norm2", "fisher", 0.0, 60, 4)
    return float(samples.potential.mean() - 3.0 * samples.potential.std())


def draw(table: dict[int, dict[str, dict[str, float]]], burnt: dict[str, tuple[int, float]], title: str) -> plt.Figure:
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained", width_ratios=(1.2, 1.0))
    sizes = sorted(table)
    for method in next(iter(table.values())):
        costs = [table[cells][method]["cost"] for cells in sizes]
        spread = [table[cells][method]["spread"] for cells in sizes]
        left.errorbar([cells**3 for cells in sizes], costs, spread, fmt="o-", markersize=4, capsize=2,
                      color=COLOURS.get(method), label=method)  # fmt: skip
    left.set_xscale("log")
    left.set_yscale("log")
    left.set_xlabel("cells")
    left.set_ylabel("gradients for each accepted trajectory of 1.5")
    left.set_xticks([cells**3 for cells in sizes], [f"{cells}³" for cells in sizes])
    left.minorticks_off()
    ticks = [value for value in (2, 3, 5, 10, 20, 30, 50, 100) if left.get_ylim()[0] <= value <= left.get_ylim()[1]]
    left.set_yticks(ticks, [str(value) for value in ticks])
    left.legend(frameon=False, fontsize="small")
    left.set_title(title, loc="left", fontsize="medium")
    names = list(burnt)
    right.barh(names[::-1], [burnt[name][0] for name in names][::-1],
               color=[COLOURS.get(name.split(",")[0], "#777777") for name in names][::-1], alpha=0.8)  # fmt: skip
    for place, name in enumerate(names[::-1]):
        right.text(burnt[name][0] * 1.05, place, str(burnt[name][0]), va="center", fontsize="small")
    right.set_xscale("log")
    right.margins(x=0.15)
    right.set_xlabel("gradients from a field of 0 to the level of samples")
    right.set_title("burn-in" if names else "", loc="left", fontsize="medium")
    right.set_visible(bool(names))
    for axes in (left, right):
        axes.grid(alpha=0.3, linewidth=0.5)
    return figure


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--out", type=Path, default=Path("out/density_field"))
    arguments.add_argument("--cells", default="16,32,64", help="along each axis, of meshes that are compared")
    arguments.add_argument("--methods", default="leapfrog,suzuki4,minimum_norm2,omf4")
    arguments.add_argument("--trajectories", type=int, default=40, help="of each method on each mesh")
    arguments.add_argument("--mean", type=float, default=0.04, help="objects in a cell")
    arguments.add_argument("--mass", default="fisher", choices=["fisher", "prior"])
    arguments.add_argument("--burn-in", action=argparse.BooleanOptionalAction, default=True, help="on the 32^3 mesh")
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    table: dict[int, dict[str, dict[str, float]]] = {}
    for cells in map(int, given.cells.split(",")):
        problem = problem_of(cells, given.mean)
        print(f"{cells}^3 cells: {problem.memory / 2**30:.3g} GiB at most", flush=True)
        table[cells] = {}
        for method in given.methods.split(","):
            found = table[cells][method] = cost(problem, method, given.mass, given.trajectories)
            print(
                f"  {method:14s} step {found['step']:.4f}, {found['gradients']:.1f} gradients, acceptance"
                f" {found['acceptance']:.3f}: {found['cost']:.1f} +- {found['spread']:.1f} for each accepted"
                f" trajectory; largest frequency {found['largest_frequency']:.2f}, {found['seconds']:.0f} s",
                flush=True,
            )
    burnt: dict[str, tuple[int, float]] = {}
    if given.burn_in:
        problem = problem_of(32, given.mean)
        level = level_of(problem)
        for method, first in (("leapfrog", "kick"), ("leapfrog", "drift"), ("suzuki4", "kick"), ("suzuki4", "drift"),
                              ("minimum_norm2", "drift"), ("omf4", "drift")):  # fmt: skip
            burnt[f"{method}, {first} first"] = found_in = fastest_burn_in(problem, method, first, level)
            print(f"burn-in, {method}, {first} first: {found_in[0]} gradients, step {found_in[1]:.4f}", flush=True)
    title = f"{given.mean:g} objects in a cell, mass {given.mass}"
    figure = draw(table, burnt, title)
    figure.savefig(given.out / "integrators.png", dpi=120)
    (given.out / "integrators.json").write_text(json.dumps({"costs": table, "burn_in": burnt}, indent=2) + "\n")
    print(given.out / "integrators.png")


if __name__ == "__main__":
    main()
