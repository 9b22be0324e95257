"""Integrators on the posterior of a density field: gradients for each accepted trajectory, and burn-in.

python examples/density_field/demo.py --out out/density_field
python examples/density_field/demo.py --out out/density_field --cells 16,32,64,128,256 --transforms fftw
python examples/density_field/demo.py --out out/heavy --mean 1 --mass prior --no-burn-in --no-sample

The second makes the picture of the folder. What the folder has of a run that was stopped is not made again.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import statistics
import time
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from eomgen.fields import Sampler, Samples
from eomgen.integrators.compositions import composition_named
from eomgen.products.fields.documents.field_reading import load_fields
from eomgen.sampling import FieldProblem, FieldSamples, field_problem, sample

SYSTEM = Path(__file__).parent / "system" / "density_field.toml"
CELL = 4.8828125  # Mpc/h
#: By cells along an axis and by method.
Costs = dict[int, dict[str, dict[str, float]]]
#: rms energy error of a trajectory over sqrt(cells) step^order, of about 0.04 objects in a cell: where searches start.
ERRORS = {"leapfrog": 0.2, "suzuki4": 0.0065, "minimum_norm2": 0.0022, "omf4": 4e-4, "yoshida4": 0.07}
COLOURS = {"leapfrog": "#0072B2", "suzuki4": "#D55E00", "minimum_norm2": "#009E73", "omf4": "#CC79A7"}
#: rms energy errors at which chains move farthest for their gradients, by order.
BEST_RMS = {2: 0.905, 4: 0.515}
#: Cells along an axis of meshes that have all trajectories and a search for the step; larger ones have fewer, with the
#: step by the law of the errors above.
SEARCHED = 64
#: Chains by which burn-in is a mean.
CHAINS = 8
#: Time of a trajectory.
DURATION = 1.5


def problem_of(cells: int, mean: float, transforms: str = "scipy") -> FieldProblem:
    """Return the problem of the file on another mesh of the same cells, and with another mean of counts."""
    system = load_fields(SYSTEM)
    parameters = tuple(
        dataclasses.replace(item, value=mean if item.name == "mean" else item.value) for item in system.parameters
    )
    sampling = system.sampling.model_copy(update={"transforms": transforms, "first": "drift"})
    changed = dataclasses.replace(
        system, cells=(cells,) * 3, lengths=(cells * CELL,) * 3, parameters=parameters, sampling=sampling
    )
    return field_problem(changed, 1)


def drawn(problem: FieldProblem, method: str, mass: str, step: float, count: int, seed: int) -> tuple[Sampler, Samples]:
    """Return samples of a chain from the truth, which is a sample of the posterior itself."""
    sampler = Sampler(
        problem.posterior, method=method, mass=mass, step=step, start=[problem.truth], seed=seed, first="drift"
    )
    return sampler, sampler.draw(count)


def cost(problem: FieldProblem, method: str, mass: str, trajectories: int) -> dict[str, float]:
    """Return gradients for each accepted trajectory of 1.5, with the best of three steps about the one that a pilot run
    finds; on large meshes with the step that the law of errors gives, and fewer trajectories."""
    began, order = time.perf_counter(), composition_named(method).order
    step = (BEST_RMS[order] / (ERRORS[method] * math.sqrt(problem.mesh.size))) ** (1.0 / order)
    if (large := problem.mesh.cells[0] / SEARCHED) > 1.0:
        return measured(problem, method, mass, max(3, round(trajectories / large)), step, began)
    sampler, samples = drawn(problem, method, mass, step, max(4, trajectories // 3), 1)
    rms = max(math.sqrt(float(np.mean(np.clip(samples.energy_errors, -20.0, 20.0) ** 2))), 1e-3)
    part = min(max((BEST_RMS[order] / rms) ** (1.0 / order), 0.5), 2.0)
    step = min(float(samples.steps[0]) * part, sampler.largest_step)
    tried = [measured(problem, method, mass, trajectories, step * part, began) for part in (0.75, 1.0, 1.25)]
    return min(tried, key=lambda found: found["cost"]) | {"seconds": time.perf_counter() - began}


def measured(
    problem: FieldProblem, method: str, mass: str, trajectories: int, step: float, began: float
) -> dict[str, float]:
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


def burn_in(
    problem: FieldProblem, method: str, first: Any, step: float, level: float, most: float, vary: bool = False
) -> list[int]:
    """Return the gradients of each chain from a field of 0 until the potential is at the level of samples; none where
    their mean is above ``most``. ``vary``: times of trajectories vary by a fifth, as steps do."""
    found: list[int] = []
    for seed in range(1, CHAINS + 1):
        sampler = Sampler(
            problem.posterior, method=method, step=step, start="zero", first=first, seed=seed, guard=math.inf,
            jitter=0.0 if vary else 0.2,
        )  # fmt: skip
        random = np.random.default_rng(seed)
        gradients = 0
        while sum(found) + gradients < most * CHAINS:
            if vary:
                part = random.uniform(0.8, 1.2)
                sampler.chains[0].step, sampler.duration = part * step, part * DURATION
            sample = sampler.draw(1)
            gradients += int(sample.gradients[0, 0])
            if sample.potential[0, 0] >= level:
                break
        else:
            return []
        found.append(gradients)
    return found


def fastest_burn_in(problem: FieldProblem, method: str, first: str, level: float, vary: bool = False) -> list[float]:
    """Return the fewest gradients over steps: their mean over chains and its standard error, the step, the median."""
    order = composition_named(method).order
    best = (BEST_RMS[order] / (ERRORS[method] * math.sqrt(problem.mesh.size))) ** (1.0 / order)
    least = [5000.0, math.nan, 0.0, math.nan]
    for part in (0.03, 0.04, 0.055, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0, 1.3, 1.6):
        step = min(part * best, 0.9 * composition_named(method).stability_limit / 1.2)
        if found := burn_in(problem, method, first, step, level, 1.5 * least[0], vary):
            error = statistics.stdev(found) / math.sqrt(CHAINS)
            least = min(least, [statistics.mean(found), error, step, statistics.median(found)])
    return least


def level_of(problem: FieldProblem) -> float:
    """Return the potential three deviations below its mean over samples."""
    _, samples = drawn(problem, "minimum_norm2", "fisher", 0.0, 60, 4)
    return float(samples.potential.mean() - 3.0 * samples.potential.std())


def draw(table: Costs, burnt: dict[str, list[float]], given: Any, found: FieldSamples | None) -> plt.Figure:
    """Draw samples of the field where there are some, and below them what integrators cost."""
    figure = plt.figure(figsize=(11, 7.2 if found else 4.0), layout="constrained")
    rows = figure.subfigures(2 if found else 1, 1, squeeze=False)[:, 0]
    if found:
        draw_field(rows[0], found)
    left, right = rows[-1].subplots(1, 2, width_ratios=(1.2, 1.0))
    sizes = sorted(table)
    for method in next(iter(table.values())):
        made = [cells for cells in sizes if method in table[cells]]
        costs = [table[cells][method]["cost"] for cells in made]
        spread = [table[cells][method]["spread"] for cells in made]
        left.errorbar([cells**3 for cells in made], costs, spread, fmt="o-", markersize=4, capsize=2,
                      color=COLOURS.get(method), label=method)  # fmt: skip
    left.set_xscale("log")
    left.set_yscale("log")
    left.set_xlabel("cells")
    left.set_ylabel("gradients of an accepted trajectory")
    left.set_xticks([cells**3 for cells in sizes], [f"{cells}³" for cells in sizes])
    left.minorticks_off()
    low, high = left.get_ylim()
    ticks = [value for value in (2, 3, 5, 10, 20, 30, 50, 100) if low <= value <= high]
    left.set_yticks(ticks, [str(value) for value in ticks])
    left.legend(frameon=False, fontsize="small")
    left.set_title(f"{given.mean:g} objects in a cell, mass {given.mass}", loc="left", fontsize="medium")
    names = list(burnt)[::-1]
    colours = [COLOURS.get(name.split(",")[0], "#777777") for name in names]
    right.barh(names, [burnt[name][0] for name in names], xerr=[burnt[name][1] for name in names], color=colours,
               alpha=0.8, capsize=2, error_kw={"linewidth": 0.8})  # fmt: skip
    for place, name in enumerate(names):
        right.text(
            (burnt[name][0] + burnt[name][1]) * 1.06, place, f"{burnt[name][0]:.0f}", va="center", fontsize="small"
        )
    right.set_xscale("log")
    right.margins(x=0.15)
    right.set_xlabel(f"gradients, mean of {CHAINS} chains")
    right.set_title(f"burn-in from a field of 0, {given.burn_in_cells}³ cells", loc="left", fontsize="medium")
    right.set_visible(bool(names))
    for axes in (left, right):
        axes.grid(alpha=0.3, linewidth=0.5)
    return figure


def draw_field(figure: Any, found: FieldSamples) -> None:
    """Draw a plane of the truth, of the mean and of the deviation of samples, and correlations by scale."""
    truth, samples, length = found.problem.true_field(), found.samples, found.problem.mesh.lengths[0]
    assert truth is not None
    panels = figure.subplots(1, 4, width_ratios=(1.0, 1.0, 1.0, 0.9))
    plane = truth.shape[2] // 2
    high = float(np.quantile(np.abs(truth), 0.99))
    for axes, values, name, colours, limits in (
        (panels[0], truth, "log density: truth", "RdBu_r", (-high, high)),
        (panels[1], samples.mean, "mean of samples", "RdBu_r", (-high, high)),
        (panels[2], samples.deviation, "deviation of samples", "magma", (0.0, float(samples.deviation.max()))),
    ):
        image = axes.imshow(values[:, :, plane].T, origin="lower", extent=(0, length, 0, length), cmap=colours,
                            vmin=limits[0], vmax=limits[1])  # fmt: skip
        figure.colorbar(image, ax=axes, shrink=0.7, location="bottom")
        axes.set_title(name, loc="left", fontsize="medium")
        axes.set_xlabel("x (Mpc/h)")
    panels[0].set_ylabel("y (Mpc/h)")
    scales = found.scales()
    panels[3].plot([one.k for one in scales], [one.correlation for one in scales], "o-", color="#0072B2", markersize=4)
    panels[3].set_ylim(0.0, 1.0)
    panels[3].set_xlabel("k (radians per Mpc/h)")
    panels[3].set_title("correlation of mean and truth", loc="left", fontsize="medium")
    panels[3].grid(alpha=0.3, linewidth=0.5)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--out", type=Path, default=Path("out/density_field"))
    arguments.add_argument("--cells", default="16,32,64", help="along each axis, of meshes that are compared")
    arguments.add_argument("--methods", default="leapfrog,suzuki4,minimum_norm2,omf4")
    arguments.add_argument("--trajectories", type=int, default=40, help="of each method on each mesh")
    arguments.add_argument("--mean", type=float, default=0.04, help="objects in a cell")
    arguments.add_argument("--mass", default="fisher", choices=["fisher", "prior"])
    arguments.add_argument("--burn-in", action=argparse.BooleanOptionalAction, default=True, help="compare it, too")
    arguments.add_argument("--burn-in-cells", type=int, default=32, help="along each axis, of its mesh")
    arguments.add_argument("--sample", action=argparse.BooleanOptionalAction, default=True, help="the file as it is")
    arguments.add_argument("--vary-times", action="store_true", help="of trajectories in burn-in, by a fifth")
    arguments.add_argument("--transforms", default="scipy", choices=["scipy", "fftw"])
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    path = given.out / "integrators.json"
    asked = {"mean": given.mean, "mass": given.mass, "trajectories": given.trajectories, "vary": given.vary_times}
    stored = json.loads(path.read_text()) if path.is_file() else {}
    if stored.get("asked", asked) != asked:
        raise SystemExit(f"{path} is of a run with {stored['asked']}: another --out")
    table: Costs = {int(cells): row for cells, row in stored.get("costs", {}).items()}
    burnt: dict[str, list[float]] = stored.get("burn_in", {})

    def keep() -> None:
        path.write_text(json.dumps({"asked": asked, "costs": table, "burn_in": burnt}, indent=2) + "\n")

    for cells in map(int, given.cells.split(",")):
        problem = problem_of(cells, given.mean, given.transforms)
        print(f"{cells}^3 cells: {problem.memory / 2**30:.3g} GiB at most", flush=True)
        row = table.setdefault(cells, {})
        for method in given.methods.split(","):
            if method not in row:
                row[method] = cost(problem, method, given.mass, given.trajectories)
                keep()
            found = row[method]
            print(
                f"  {method:14s} step {found['step']:.4f}, {found['gradients']:.1f} gradients, acceptance"
                f" {found['acceptance']:.3f}: {found['cost']:.1f} +- {found['spread']:.1f} for each accepted"
                f" trajectory; largest frequency {found['largest_frequency']:.2f}, {found['seconds']:.0f} s",
                flush=True,
            )
    if given.burn_in:
        problem = problem_of(given.burn_in_cells, given.mean, given.transforms)
        level = level_of(problem)
        for method, first in (("leapfrog", "kick"), ("leapfrog", "drift"), ("suzuki4", "kick"), ("suzuki4", "drift"),
                              ("minimum_norm2", "drift"), ("omf4", "drift")):  # fmt: skip
            name = f"{method}, {first} first"
            if name not in burnt:
                burnt[name] = fastest_burn_in(problem, method, first, level, given.vary_times)
                keep()
            fewest = burnt[name]
            print(
                f"burn-in, {name}: {fewest[0]:.0f} +- {fewest[1]:.0f} gradients, median {fewest[3]:.0f}, step"
                f" {fewest[2]:.4f}",
                flush=True,
            )
    found_field = None
    if given.sample:
        goes_on = (given.out / "checkpoint.npz").is_file()
        found_field = sample(SYSTEM, folder=given.out, progress=True, resume=goes_on)
    figure = draw(table, burnt, given, found_field)
    figure.savefig(given.out / "density_field.png", dpi=120)
    print(given.out / "density_field.png")


if __name__ == "__main__":
    main()
