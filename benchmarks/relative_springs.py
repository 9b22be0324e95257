"""A chain of masses with one stiff spring between two of them: matrices of steps and runs against 60 digits.

    python -m benchmarks.relative_springs [--quick] [--json out.json]

Masses of 1 kg on one rail, springs of 1 N/m from the ground on, and the middle one of kappa. Of the matrix
M + h^2/4 K, h = 1 s, the relative error of a solution: assembled and solved by NumPy, and as a step of ``rosenbrock``
from rest finds it. Of runs of 10 s in steps of 0.05 s, with a middle spring that is slack at 0.2 m, the largest error
of the positions at the end, in m: ``rosenbrock`` against its own steps in 60 digits, the others against the motion.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mpmath
import numpy as np

import eomgen
from benchmarks.measure import table

STIFFNESSES = (1.0, 1e3, 1e6, 1e9, 1e12, 1e15, 1e18, 1e24, 1e30)
METHODS = ("rosenbrock", "tdg2", "tdg3")
LOADS = (1.0, -2.0, 0.5, 1.0)
MOVED, RATES, LENGTH, STEP, END = (0.1, 0.1, 0.3, 0.37), (0.3, 0.2, 0.2, -0.1), 0.2, 0.05, 10.0
_REST: dict[str, Any] = {"initial": {"q": [0.0] * 4, "v": [0.0] * 4}, "error_estimate": False}


def chain() -> eomgen.Scene:
    """Return the chain, with loads, the middle spring and its length as parameters."""
    builder = eomgen.SceneBuilder("chain", gravity=[0, 0, 0]).parameter("kappa", 1.0, tunable=True)
    builder.parameter("length", 0.0, tunable=True)
    for k in range(4):
        builder.parameter(f"f{k}", 0.0, tunable=True).body(f"m{k}", 1.0)
        builder.joint(f"x{k}", "prismatic", "base", f"m{k}", axis=[1, 0, 0], stiffness=0.0 if k else 1.0)
        builder.effort(f"load{k}", f"x{k}", f"f{k}")
    for k, pull in enumerate(("q.x1 - q.x0", "kappa * (q.x2 - q.x1 - length)", "q.x3 - q.x2")):
        builder.effort(f"forward{k}", f"x{k}", pull).effort(f"back{k}", f"x{k + 1}", f"-({pull})")
    return builder.build()


def stiffness(kappa: float) -> mpmath.matrix:
    """Return K in the digits at hand."""
    K = mpmath.matrix(4, 4)
    K[0, 0] = 1
    for i, size in enumerate((1.0, kappa, 1.0)):
        for row, column, sign in ((i, i, 1), (i + 1, i + 1, 1), (i, i + 1, -1), (i + 1, i, -1)):
            K[row, column] += sign * mpmath.mpf(size)
    return K


def relative(found: Sequence[float], exact: Sequence[mpmath.mpf]) -> float:
    return float(max(abs(mpmath.mpf(float(x)) - y) for x, y in zip(found, exact, strict=True)) / max(map(abs, exact)))


def errors_of_matrices(model: eomgen.Model, kappa: float) -> tuple[float, float]:
    """Return the relative errors of a solution with the assembled matrix, and of a step of ``rosenbrock``."""
    matrix = mpmath.eye(4) + stiffness(kappa) / 4
    exact = list(mpmath.lu_solve(matrix, mpmath.matrix(LOADS)))
    parameters = {"kappa": kappa, **{f"f{k}": load for k, load in enumerate(LOADS)}}
    step = model.simulate(1.0, 1.0, method="rosenbrock", parameters=parameters, **_REST)
    K = np.diag([2.0, 1.0 + kappa, kappa + 1.0, 1.0])
    for i, size in enumerate((1.0, kappa, 1.0)):
        K[i, i + 1] = K[i + 1, i] = -size
    try:
        assembled = relative(np.linalg.solve(np.eye(4) + 0.25 * K, LOADS).tolist(), exact)
    except np.linalg.LinAlgError:
        assembled = float("inf")
    return assembled, relative(step.v[-1].tolist(), exact)


def exact_end(kappa: float, *, steps: bool) -> list[mpmath.mpf]:
    """Return the positions at the end, of the motion by its modes, or of steps with gamma = 1/2."""
    K, f = stiffness(kappa), mpmath.matrix(4, 1)
    f[1], f[2] = -mpmath.mpf(kappa) * mpmath.mpf(LENGTH), mpmath.mpf(kappa) * mpmath.mpf(LENGTH)
    q, v = mpmath.matrix(MOVED), mpmath.matrix(RATES)
    if steps:
        h = mpmath.mpf(STEP)
        inverse = (mpmath.eye(4) + h * h / 4 * K) ** -1
        for _ in range(round(END / STEP)):
            k = inverse * (f - K * q - h / 2 * (K * v))
            q, v = q + h * (v + h / 2 * k), v + h * k
        return list(q)
    squares, modes = mpmath.eigsy(K)
    slack = mpmath.lu_solve(K, f)
    q, v = modes.T * (q - slack), modes.T * v
    omega = [mpmath.sqrt(x) for x in squares]
    y = [q[k] * mpmath.cos(w * END) + v[k] / w * mpmath.sin(w * END) for k, w in enumerate(omega)]
    return list(slack + modes * mpmath.matrix(y))


def error_of_run(model: eomgen.Model, method: str, kappa: float) -> float:
    """Return the largest error of the positions at the end, m."""
    options: dict[str, Any] = {"initial": {"q": MOVED, "v": RATES}, "error_estimate": False}
    run = model.simulate(END, STEP, method=method, parameters={"kappa": kappa, "length": LENGTH}, **options)
    exact = exact_end(kappa, steps=method == "rosenbrock")
    return float(max(abs(mpmath.mpf(float(x)) - y) for x, y in zip(run.q[-1], exact, strict=True)))


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="three stiffnesses")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    model = eomgen.build(chain(), method="rosenbrock")
    rows: list[dict[str, float]] = []
    with mpmath.workdps(60):
        for kappa in STIFFNESSES[::4] if options.quick else STIFFNESSES:
            assembled, step = errors_of_matrices(model, kappa)
            runs = {method: error_of_run(model, method, kappa) for method in METHODS}
            rows.append({"kappa": kappa, "assembled": assembled, "step": step, **runs})
    header = ("kappa, N/m", "h omega", "assembled", "as a step finds it", *(f"run of {name}" for name in METHODS))
    lines = [
        [f"{row['kappa']:.0e}", f"{np.sqrt(2.0 * row['kappa']) * STEP:.0e}"]
        + [f"{row[key]:.1e}" for key in ("assembled", "step", *METHODS)]
        for row in rows
    ]
    print(table(header, lines))
    if options.json:
        options.json.write_text(json.dumps({"rows": rows}, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
