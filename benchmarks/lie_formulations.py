"""The fast heavy top in every formulation and at several steps: errors, Newton iterations, factorizations, time per
step.

    python -m benchmarks.lie_formulations [--exponents 10 11 12 13] [--variants] [--json out.json] [--quick]

Errors are the largest ones at t = j/16 up to 1 s, against RK4 in joint coordinates at 2^-17 s, which is held against 40
digits.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path

import numpy as np

from benchmarks.loops import timed
from benchmarks.measure import figure, machine, pin_to_core, table
from benchmarks.tops import CENTER_AT_1, FORMULATIONS, VARIANTS, Formulation, errors, of_solution, reference

MARKS = 16
NAN = float("nan")


@dataclass(frozen=True)
class Row:
    """A formulation at a step of 2^-exponent s; ``failure`` says why there are no numbers."""

    formulation: str
    exponent: int
    position: float = NAN
    orientation: float = NAN
    multiplier: float = NAN
    newton_iterations: float = NAN
    factorizations: int = 0
    microseconds: float = NAN
    spread: float = 0.0
    failure: str = ""


def measured(formulation: Formulation, exponent: int, rho_inf: float, settings: dict[str, float], repeats: int) -> Row:
    """Return the errors of a run with records, and the time of the same run without."""
    steps = 2**exponent
    model = formulation.model()
    known = settings if "alpha" in formulation.method else {}
    solution = model.simulate(
        1.0,
        1.0 / steps,
        method=formulation.method,
        rho_inf=rho_inf,
        record_every=steps // MARKS,
        settings=known,
        error_estimate=False,
    )
    if not solution.success:
        return Row(formulation.name, exponent, failure=solution.message)
    position, orientation, multiplier = errors(of_solution(model, solution), reference(MARKS))
    loop = timed(
        model, formulation.method, 1.0, steps, rho_inf=rho_inf, settings=settings, repeats=repeats, at_least=0.02
    )
    return Row(
        formulation.name,
        exponent,
        position,
        orientation,
        multiplier,
        loop.per_step("newton_iterations"),
        int(loop.statistics["factorizations"]),
        loop.microseconds,
        loop.spread,
    )


def order(rows: Sequence[Row], what: str) -> float:
    """Return the slope of an error over the step, fitted in logarithms."""
    points = [(row.exponent, math.log2(getattr(row, what))) for row in rows if getattr(row, what) > 0.0]
    if len(points) < 2:
        return NAN
    exponents, logarithms = np.array(points).T
    return -float(np.polyfit(exponents, logarithms, 1)[0])


HEADER = (
    "formulation",
    "step",
    "position, m",
    "orientation, rad",
    "multiplier, N",
    "iterations",
    "factorizations",
    "us per step",
)
ERRORS = ("position", "orientation", "multiplier")


def lines_of(rows: Sequence[Row]) -> list[list[str]]:
    """Return the table's lines, with the orders after each formulation's."""
    lines = []
    for name in dict.fromkeys(row.formulation for row in rows):
        own = [row for row in rows if row.formulation == name]
        for row in own:
            start = [name, f"2^-{row.exponent}"]
            if row.failure:
                lines.append([*start, row.failure, *[""] * (len(HEADER) - 3)])
                continue
            time = f"{figure(row.microseconds)} ±{50 * row.spread:.0f}%"
            found = [f"{getattr(row, what):.2e}" for what in ERRORS]
            lines.append([*start, *found, f"{row.newton_iterations:.2f}", f"{row.factorizations}", time])
        slopes = [order(own, what) for what in ERRORS]
        if not any(map(math.isnan, slopes)):
            lines.append([name, "order", *(f"{slope:.2f}" for slope in slopes), "", "", ""])
    return lines


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.lie_formulations", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--exponents", type=int, nargs="+", default=[10, 11, 12, 13], help="steps of 2^-exponent s")
    parser.add_argument(
        "--variants", action="store_true", help="F1, F2 (increments cut into exponentials) and spatial too"
    )
    parser.add_argument("--rho-inf", type=float, default=0.9)
    parser.add_argument("--rtol", type=float, default=1e-8)
    parser.add_argument("--atol", type=float, default=1e-10)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--core", type=int, help="the core to stay on (the last one by default)")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="steps of 2^-10 s and 2^-11 s, timed once")
    arguments = parser.parse_args(words)
    formulations = (*FORMULATIONS, *(VARIANTS if arguments.variants else ()))
    exponents = [10, 11] if arguments.quick else arguments.exponents
    if min(exponents) < math.log2(MARKS):
        parser.error(f"errors are taken {MARKS} times a second: exponents from {math.log2(MARKS):.0f} on")
    for formulation in formulations:
        formulation.model()  # with both cores, before this process stays on one
    core = None if arguments.quick else pin_to_core(arguments.core)
    settings = {"rtol": arguments.rtol, "atol": arguments.atol}
    repeats = 1 if arguments.quick else arguments.repeats
    rows = [
        measured(one, exponent, arguments.rho_inf, settings, repeats) for one in formulations for exponent in exponents
    ]
    print(f"{machine()}, core {core}")
    print(f"reference off its 40 digits by {np.linalg.norm(reference(MARKS).center[-1] - CENTER_AT_1):.0e} m at 1 s\n")
    print(table(HEADER, lines_of(rows)))
    if arguments.json:
        content = {"date": f"{date.today()}", "machine": machine(), "rho_inf": arguments.rho_inf, **settings}
        text = json.dumps({**content, "rows": [asdict(row) for row in rows]}, indent=1)
        arguments.json.write_text(text + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
