"""Stepping of multibody systems beside EXUDYN and MuJoCo: the fast top with its joint, ten hinges, chains of any
length.

    python -m benchmarks.multibody_stepping [--parts top hinges lengths] [--json out.json] [--quick]

CPU time of the compiled loops, nothing recorded. A peer that is not installed is left out.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path

import numpy as np

import eomgen
from benchmarks import chains, multibody_peers, tops
from benchmarks.chain_lengths import lengths
from benchmarks.loops import Loop, timed
from benchmarks.measure import figure, machine, pin_to_core, table

TARGET = 1e-5  # m, of the fast top's center at 1 s
DEFAULT, LOOSE = "default", "1e-6"
TOLERANCES: Mapping[str, Mapping[str, float]] = {DEFAULT: {}, LOOSE: {"rtol": 1e-6, "atol": 1e-8}}
#: Tolerance and rho_inf of our runs of the top; EXUDYN's are given as many radii.
OWN_WAYS = ((DEFAULT, 0.9), (LOOSE, 0.9), (LOOSE, 0.8), (LOOSE, 0.6))
TOPS = (*tops.FORMULATIONS, *(one for one in tops.VARIANTS if one.method.endswith(("f1", "spatial"))))
#: Steps per second that are tried for the top: 2^(k/8) thousand.
TRIED = tuple(round(1000 * 2 ** (k / 8)) for k in range(57))
PARTS = ("top", "hinges", "lengths")


# -- the fast top with its joint ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TopRun:
    """The run with the fewest steps that meets the target; ``steps`` is 0 when there is none."""

    contestant: str
    steps: int
    error: float
    milliseconds: float
    microseconds: float
    note: str = ""


def first_that_meets(run: Callable[[int], float], target: float) -> int:
    """Return the fewest steps of those tried that meet the target, and so do the next ones tried; 0 when there are
    none.

    The second condition rejects errors that pass through zero by chance.
    """
    met = 0
    for steps in TRIED:
        if run(steps) > target:
            met = 0
        elif met:
            return met
        else:
            met = steps
    return 0


def own_tops(repeats: int) -> list[TopRun]:
    """Return the runs of all formulations, with tolerances by default and with looser ones."""
    found = []
    for formulation in TOPS:
        ways = OWN_WAYS if "alpha" in formulation.method else OWN_WAYS[:1]
        found += [_own_top(formulation, tolerance, rho_inf, repeats) for tolerance, rho_inf in ways]
    return found


def _own_top(formulation: tops.Formulation, tolerance: str, rho_inf: float, repeats: int) -> TopRun:
    model, settings = formulation.model(), TOLERANCES[tolerance]
    name = f"eomgen {formulation.name}"
    if "alpha" in formulation.method:
        name += f", {rho_inf}, tolerance {tolerance}"

    def error_of(loop: Loop) -> float:
        if loop.failure:
            return float("inf")
        state = loop.state
        found = tops.motion(model, state["q"], state["v"], state["vdot"], state.get("lam"))
        return float(np.linalg.norm(found.center - tops.CENTER_AT_1))

    def error(steps: int) -> float:
        return error_of(timed(model, formulation.method, 1.0, steps, rho_inf=rho_inf, settings=settings, repeats=1))

    steps = first_that_meets(error, TARGET)
    if not steps:
        return TopRun(name, 0, float("nan"), float("nan"), float("nan"), f"more than {TRIED[-1]} steps")
    loop = timed(
        model, formulation.method, 1.0, steps, rho_inf=rho_inf, settings=settings, repeats=repeats, at_least=0.02
    )
    note = ""
    if loop.statistics["newton_iterations"]:
        note = (
            f"{loop.per_step('newton_iterations'):.2f} iterations, {loop.per_step('factorizations'):.2g} factorizations"
            " a step"
        )
    return TopRun(name, steps, error_of(loop), loop.seconds * 1e3, loop.microseconds, note)


def exudyn_tops(repeats: int) -> list[TopRun]:
    """Return the runs of EXUDYN's implicit solvers."""
    found = []
    for method in multibody_peers.TOP_METHODS:

        def error(steps: int, method: multibody_peers.ExudynMethod = method) -> float:
            try:
                value = multibody_peers.exudyn_top(method, steps, 1)[1]
            except multibody_peers.NotConvergedError:
                return float("inf")
            return value if np.isfinite(value) else float("inf")

        steps = first_that_meets(error, TARGET)
        name = f"EXUDYN {method.name}"
        if not steps:
            found.append(TopRun(name, 0, float("nan"), float("nan"), float("nan"), "never"))
            continue
        seconds, reached = multibody_peers.exudyn_top(method, steps, repeats)
        found.append(TopRun(name, steps, reached, seconds * 1e3, seconds / steps * 1e6))
    return found


def top_table(runs: Sequence[TopRun]) -> str:
    """Return the table, fastest first, in units of EXUDYN's fastest."""
    peers = [run.milliseconds for run in runs if run.contestant.startswith("EXUDYN") and run.steps]
    best = min(peers, default=float("nan"))
    met, unmet = [run for run in runs if run.steps], [run for run in runs if not run.steps]
    lines = [
        [
            run.contestant,
            f"{run.steps}",
            f"{run.error:.1e}",
            figure(run.milliseconds),
            figure(run.microseconds),
            f"{run.milliseconds / best:.3f}",
            run.note,
        ]
        for run in sorted(met, key=lambda run: run.milliseconds)
    ]
    lines += [[run.contestant, "-", "-", "-", "-", "-", run.note] for run in unmet]
    return table(("contestant", "steps", "error, m", "ms", "us per step", "of EXUDYN's best", "note"), lines)


@dataclass(frozen=True)
class StepRun:
    """Time of a step of the fast top at 1 ms and at a tenth of it."""

    formulation: str
    steps: int
    tolerance: str
    microseconds: float
    spread: float
    newton_iterations: float
    factorizations: float
    failure: str = ""


def top_steps(formulations: Sequence[tops.Formulation], tried: Sequence[int], repeats: int) -> list[StepRun]:
    """Return the time per step of the formulations, over 1 s cut into so many steps."""
    found = []
    for formulation in formulations:
        for steps in tried:
            for tolerance, settings in TOLERANCES.items():
                loop = timed(
                    formulation.model(),
                    formulation.method,
                    1.0,
                    steps,
                    settings=settings,
                    repeats=repeats,
                    at_least=0.02,
                )
                found.append(
                    StepRun(
                        formulation.name,
                        steps,
                        tolerance,
                        loop.microseconds,
                        loop.spread,
                        loop.per_step("newton_iterations"),
                        loop.per_step("factorizations"),
                        loop.failure,
                    )
                )
    return found


def step_table(runs: Sequence[StepRun]) -> str:
    lines = [
        [
            run.formulation,
            f"{1 / run.steps:g}",
            run.tolerance,
            run.failure or f"{figure(run.microseconds)} ±{50 * run.spread:.0f}%",
            f"{run.newton_iterations:.2f}",
            f"{run.factorizations:.3g}",
        ]
        for run in runs
    ]
    return table(("formulation", "step, s", "tolerance", "us per step", "iterations", "factorizations"), lines)


# -- ten hinges --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class HingeRun:
    contestant: str
    step: float
    error: float
    microseconds: float
    note: str = ""


def hinge_runs(repeats: int, peers: Sequence[str]) -> list[HingeRun]:
    """Return time and error of a chain of ten hinges after 0.5 s, in joint coordinates."""
    found = []
    scene = chains.scene("joint", "hinge", 10)
    for steps in (500, 2000):
        for method, tolerance in (("generalized_alpha", DEFAULT), ("generalized_alpha", LOOSE), ("rk4", DEFAULT)):
            model = eomgen.build(scene, method=method)
            loop = timed(
                model, method, 0.5, steps, rho_inf=0.8, settings=TOLERANCES[tolerance], repeats=repeats, at_least=0.02
            )
            if loop.failure:
                raise RuntimeError(f"{method}: {loop.failure}")
            tip = model.point("rod9", [chains.LENGTH, 0, 0], loop.state["q"]).position
            error = float(np.linalg.norm(tip - chains.tip_at_the_end(10)))
            implicit = method != "rk4"
            name = f"eomgen generalized-alpha, tolerance {tolerance}" if implicit else "eomgen RK4"
            note = f"{loop.per_step('newton_iterations'):.2f} iterations" if implicit else ""
            found.append(HingeRun(name, 0.5 / steps, error, loop.microseconds, note))
        if "exudyn" in peers:
            for solver in multibody_peers.CHAIN_METHODS:
                seconds, error = multibody_peers.exudyn_chain(solver, 10, 0.5, steps, repeats)
                found.append(HingeRun(f"EXUDYN KinematicTree {solver.name}", 0.5 / steps, error, seconds / steps * 1e6))
        if "mujoco" in peers:
            for integrator in ("implicitfast", "RK4"):
                seconds, error = multibody_peers.mujoco_chain(integrator, 10, 0.5, steps, repeats)
                found.append(HingeRun(f"MuJoCo {integrator}", 0.5 / steps, error, seconds / steps * 1e6))
    return found


def hinge_table(runs: Sequence[HingeRun]) -> str:
    lines = [[run.contestant, f"{run.step:g}", f"{run.error:.1e}", figure(run.microseconds), run.note] for run in runs]
    return table(("contestant", "step, s", "error of the tip, m", "us per step", "note"), lines)


# -- all of it ---------------------------------------------------------------------------------------------------------


def quick() -> int:
    """Go through every part once, small and without peers; return the exit status."""
    print(step_table(top_steps([tops.R3XSO3], [1000], 1)))
    run = _own_top(tops.R3XSO3, LOOSE, 0.9, 1)
    print(f"{run.contestant}: {run.error:.1e} m in {run.steps} steps")
    print(hinge_table(hinge_runs(1, ())))
    print(lengths([("absolute", "hinge")], (1, 2), 120.0)[0][0])
    return 0


def main(words: Sequence[str] | None = None) -> int:
    description = (__doc__ or "").partition("\n")[0]
    parser = argparse.ArgumentParser(prog="python -m benchmarks.multibody_stepping", description=description)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--links", type=int, nargs="+", default=[10, 20, 50, 100, 200])
    parser.add_argument("--coordinates", nargs="+", choices=["joint", "absolute"], default=["joint", "absolute"])
    parser.add_argument("--kinds", nargs="+", choices=["hinge", "ball"], default=["hinge"])
    parser.add_argument("--limit", type=float, default=900.0, help="seconds after which a chain counts as not built")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--core", type=int, help="the core to stay on (the last one by default)")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="a small piece of every part, without peers")
    arguments = parser.parse_args(words)
    if arguments.quick:
        return quick()
    print(machine())
    content: dict[str, object] = {"date": f"{date.today()}", "machine": machine()}
    peers = [name for name in ("exudyn", "mujoco") if multibody_peers.missing(name) is None]
    for name in ("exudyn", "mujoco"):
        if lacking := multibody_peers.missing(name):
            print(lacking)
    if "lengths" in arguments.parts:
        cases = [(coordinates, kind) for coordinates in arguments.coordinates for kind in arguments.kinds]
        texts, data = lengths(cases, arguments.links, arguments.limit)
        print("\n" + "\n\n".join(texts), flush=True)
        content["lengths"] = data
    if "top" in arguments.parts:
        for formulation in TOPS:
            formulation.model()  # with both cores, before this process stays on one
    pin_to_core(arguments.core)
    if "top" in arguments.parts:
        constrained = [one for one in tops.FORMULATIONS if one.group]
        steps = top_steps(constrained, (1000, 10000), arguments.repeats)
        print(f"\nThe fast top, time of a step\n\n{step_table(steps)}", flush=True)
        runs = own_tops(arguments.repeats) + (exudyn_tops(arguments.repeats) if "exudyn" in peers else [])
        print(f"\nThe fast top, time to {TARGET:g} m at 1 s\n\n{top_table(runs)}", flush=True)
        content |= {"steps": [asdict(one) for one in steps], "top": [asdict(run) for run in runs]}
    if "hinges" in arguments.parts:
        hinges = hinge_runs(arguments.repeats, peers)
        print(f"\nTen hinges, 0.5 s\n\n{hinge_table(hinges)}", flush=True)
        content["hinges"] = [asdict(one) for one in hinges]
    if arguments.json:
        arguments.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
