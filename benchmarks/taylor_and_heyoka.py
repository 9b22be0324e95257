"""Taylor steps of eomgen and of heyoka: time per trajectory at the same error, on a fast top and on chains of two and
six rods.

    python -m benchmarks.taylor_and_heyoka [--quick] [--core N] [--json out.json]

Both choose order and steps by a tolerance. For each error that is asked for, each side gets the tolerance, the
equations and, for heyoka, the mode of compilation (straight or compact) with which it gets there first. Then both take
turns on one core, and the median of the rounds is shown. Building and compiling count on neither side. heyoka gets
eomgen's forward dynamics as well as equations in absolute angles. Errors are the largest in q at the end, against
heyoka in long double at 1e-18.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks import tops
from benchmarks.measure import figure, machine, pin_to_core, table
from eomgen.integrators.families.register import method_named
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import derive
from eomgen.simulation.stepping.settings import stepper_settings
from eomgen.simulation.stepping.stepper import Stepper

Array = NDArray[np.float64]
TARGETS = (1e-6, 1e-9, 1e-12)
TOLERANCES = tuple(10.0**-k for k in range(3, 16))
ROUNDS, AT_LEAST = 15, 0.02
LENGTH, MASS, GRAVITY = 1.0, 1.0, 9.81


@dataclass(frozen=True)
class Case:
    """A scene and how long it runs, in s; ``rods`` is the number of a chain's rods, 0 for others."""

    name: str
    scene: eomgen.Scene
    duration: float
    rods: int = 0


@dataclass(frozen=True)
class Contestant:
    """One way to the end: what runs it once, its final q and v, and what it is."""

    label: str
    run: Callable[[], None]
    error: float


def chain(links: int) -> eomgen.Scene:
    """Return a planar chain of rods that starts bent, at rest."""
    builder = eomgen.SceneBuilder(f"chain{links}", gravity=[0, 0, -GRAVITY])
    inertia = MASS * LENGTH**2 / 12
    for k in range(links):
        builder.body(f"rod{k}", MASS, center_of_mass=[0, 0, -LENGTH / 2], inertia=[inertia, inertia, 1e-3])
        position = [0, 0, -LENGTH if k else 0.0]
        initial = {"position": 0.3 if k else 1.2}
        parent = f"rod{k - 1}" if k else "base"
        builder.joint(f"joint{k}", "revolute", parent, f"rod{k}", axis=[0, 1, 0], position=position, initial=initial)
    return builder.build()


def cases() -> list[Case]:
    """Return what is run."""
    top = Case("fast top", tops.scene(), 1.0)
    return [top, Case("double pendulum", chain(2), 5.0, 2), Case("6-link chain", chain(6), 2.0, 6)]


def ours(case: Case, model: Model, exact: Array, tolerance: float) -> Contestant:
    """Return a run of the compiled stepper in one step of its grid: initialization, steps, and the state at the end."""
    method = method_named("taylor", tolerance=tolerance)
    settings = stepper_settings(model.library.layout["method"], case.duration, method, {})
    stepper = Stepper(model.library, settings, model.parameter_array(None))
    record = np.empty((1, stepper.sizes["row"]))

    def run() -> None:
        status = stepper.initialize(0.0, model.initial_q, model.initial_v, None) or stepper.run(1, 1, None, record)[0]
        if status:
            raise RuntimeError(stepper.status_text(status))

    run()
    error = np.abs(record[0, 1 : 1 + model.nq] - exact[: model.nq]).max()
    return Contestant(f"{tolerance:.0e}, order {int(settings['order'])}", run, float(error))


def theirs(case: Case, model: Model, exact: Array, tolerances: Sequence[float]) -> list[Contestant]:
    """Return heyoka's runs: all equations, modes and tolerances."""
    import heyoka  # noqa: PLC0415  # the numbers of this side need it

    from benchmarks import heyoka_equations as equations  # noqa: PLC0415

    start = np.concatenate([model.initial_q, model.initial_v])
    ways: list[tuple[str, Any, Array, Callable[[Array], Array]]] = [
        ("forward dynamics", equations.of_system(derive(case.scene)), start, lambda state: state)
    ]
    if case.rods:
        written = equations.rods(case.rods, LENGTH, MASS, GRAVITY)
        ways.append(("absolute angles", written, equations.absolute(start), equations.between_neighbours))
    found = []
    for name, system, first, back in ways:
        for compact in (False, True):
            for tolerance in tolerances:
                options = {"tol": tolerance, "compact_mode": compact, "high_accuracy": False}
                integrator = heyoka.taylor_adaptive(system, first.copy(), **options)

                def run(integrator: Any = integrator, first: Array = first) -> None:
                    integrator.time = 0.0
                    integrator.state[:] = first
                    integrator.propagate_until(case.duration)

                run()
                error = float(np.abs(back(np.array(integrator.state)) - exact)[: model.nq].max())
                label = f"{tolerance:.0e}, order {integrator.order}, {name}, {'compact' if compact else 'straight'}"
                found.append(Contestant(label, run, error))
    return found


def reference(case: Case, model: Model) -> Array:
    """Return q and v at the end in long double."""
    import heyoka  # noqa: PLC0415  # as above

    from benchmarks import heyoka_equations as equations  # noqa: PLC0415

    start = np.concatenate([model.initial_q, model.initial_v]).astype(np.longdouble)
    integrator = heyoka.taylor_adaptive(
        equations.of_system(derive(case.scene)),
        start,
        tol=np.longdouble(1e-18),
        fp_type=np.longdouble,
        compact_mode=True,
    )
    integrator.propagate_until(np.longdouble(case.duration))
    return np.array(integrator.state)


def fastest(contestants: Sequence[Contestant], target: float) -> Contestant | None:
    """Return the one that reaches an error first, None where none does."""
    there = [one for one in contestants if one.error <= target]
    return min(there, key=lambda one: min(_seconds(one.run, 0.003) for _ in range(5)), default=None)


def _seconds(run: Callable[[], None], at_least: float) -> float:
    calls, began = 0, time.thread_time()
    while not calls or time.thread_time() - began < at_least:
        run()
        calls += 1
    return (time.thread_time() - began) / calls


def measured(pair: Sequence[Contestant], rounds: int) -> list[float]:
    """Return median seconds of each, taken in turns."""
    kept: list[list[float]] = [[] for _ in pair]
    for _ in range(rounds):
        for one, seconds in zip(pair, kept, strict=True):
            seconds.append(_seconds(one.run, AT_LEAST))
    return [statistics.median(seconds) for seconds in kept]


def compare(case: Case, quick: bool) -> list[dict[str, Any]]:
    """Return a row for each error that is asked for."""
    model = eomgen.build(case.scene, method="taylor")
    exact = reference(case, model)
    tolerances = (1e-8, 1e-11, 1e-14) if quick else TOLERANCES
    own = [ours(case, model, exact, tolerance) for tolerance in tolerances]
    other = theirs(case, model, exact, tolerances)
    rows = []
    for target in TARGETS:
        pair = [one for one in (fastest(own, target), fastest(other, target)) if one is not None]
        row: dict[str, Any] = {"case": case.name, "target": target, "reached": len(pair) == 2}
        if len(pair) == 2:
            seconds = [float("nan")] * 2 if quick else measured(pair, ROUNDS)
            row |= {
                "eomgen": seconds[0],
                "heyoka": seconds[1],
                "ratio": seconds[0] / seconds[1],
                "errors": [one.error for one in pair],
                "settings": [one.label for one in pair],
            }
        rows.append(row)
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="errors only, three tolerances")
    parser.add_argument("--core", type=int)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--cases", nargs="*", help="names of cases; all by default")
    options = parser.parse_args(arguments)
    pin_to_core(options.core)
    print(machine())
    rows = [
        row
        for case in cases()
        if not options.cases or case.name in options.cases
        for row in compare(case, options.quick)
    ]
    header = ["case", "error", "eomgen us", "heyoka us", "ratio", "errors reached", "eomgen", "heyoka"]
    lines = []
    for row in rows:
        texts = [row["case"], f"{row['target']:.0e}"]
        if not row["reached"]:
            lines.append([*texts, *["not reached"] * 6])
            continue
        numbers = [figure(1e6 * row[side]) for side in ("eomgen", "heyoka")]
        errors = " and ".join(f"{error:.1e}" for error in row["errors"])
        lines.append([*texts, *numbers, figure(row["ratio"]), errors, *row["settings"]])
    print(table(header, lines))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
