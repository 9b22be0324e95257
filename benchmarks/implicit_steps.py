"""Methods for Hamiltonian systems that are not separable: time and gradients to an error, on a double pendulum.

    python -m benchmarks.implicit_steps [--core N] [--json out.json]

For each error of the angles at the end that is asked for, each method gets the fewest steps of a series, or the largest
tolerance, with which it gets there. The least time of five runs is shown. Places are held against ``gauss12`` in 8000
compensated steps.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import eomgen
from benchmarks.measure import figure, machine, pin_to_core, table

#: Two unit masses on two unit rods, in canonical momenta.
PENDULUM: dict[str, Any] = {
    "format": 1,
    "kind": "hamiltonian",
    "name": "double_pendulum",
    "hamiltonian": "(p_a**2 + 2*p_b**2 - 2*p_a*p_b*cos(a - b))/(2*(1 + sin(a - b)**2)) - g*(2*cos(a) + cos(b))",
    "parameters": {"g": 9.81},
    "coordinates": {"a": {"initial": [0.6, 0.0]}, "b": {"initial": [-0.3, 0.0]}},
}
T_END, ERRORS = 20.0, (1e-4, 1e-7, 1e-10)
METHODS = ("implicit_midpoint", "suzuki4", "gauss4", "gauss6", "gauss8", "gauss12", "kahan_li8", "rk45")
STEPS = tuple(int(20 * 2 ** (k / 2)) for k in range(24))
TOLERANCES = tuple(10.0**-k for k in range(3, 14))


def _options(method: str) -> Iterator[dict[str, Any]]:
    """Yield the runs of a method, the fastest first."""
    if method == "rk45":
        for tolerance in TOLERANCES:
            yield {"method": method, "step": T_END, "tolerance": tolerance, "record_every": 1}
    else:
        for steps in STEPS:
            yield {"method": method, "step": T_END / steps, "record_every": steps}


def measured() -> list[dict[str, Any]]:
    """Return a row for each method and error."""
    model: Any = eomgen.build(PENDULUM)  # type: ignore[call-overload]
    options: dict[str, Any] = {"error_estimate": False}
    exact = model.simulate(T_END, T_END / 8000, method="gauss12", compensated=True, **options).q[-1]
    rows = []
    for method in METHODS:
        left = list(ERRORS)
        for given in _options(method):
            run = model.simulate(T_END, **given, **options)
            error = float(np.abs(run.q[-1] - exact).max()) if run.success else np.inf
            while left and error <= left[0]:
                times = [model.simulate(T_END, **given, **options).stats["wall_time"] for _ in range(5)]
                gradients = run.stats["gradients"]
                row = {"method": method, "asked": left.pop(0), "reached": error, "s": min(times)}
                rows.append(row | {"gradients": gradients, "products": run.stats["products"]})
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--core", type=int, default=None)
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args(arguments)
    pin_to_core(given.core)
    rows = measured()
    header = list(rows[0])
    print(machine())
    shown = [[figure(row[name]) if isinstance(row[name], float) else str(row[name]) for name in header] for row in rows]
    print(table(header, shown))
    if given.json is not None:
        given.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
