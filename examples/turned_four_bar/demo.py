"""Turn the crank of a four-bar once with the least torque: collocation with the multipliers of its loop as unknowns.

python examples/turned_four_bar/demo.py [--intervals 40] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

import eomgen
from eomgen.base.arrays import Array

FOLDER = Path(__file__).parent
SCENE = FOLDER.parent / "four_bar" / "scene.toml"
#: Time of the turn, s; stages of Radau's method IIA of order 3.
DURATION, STAGES = 1.0, ((5.0 / 12.0, -1.0 / 12.0), (0.75, 0.25))


class Optimum(NamedTuple):
    """A solved turn: angles and speeds (n + 1, 3), multipliers at the ends of intervals (n, 2), torques (n,) on the
    crank, cost in (N m)^2 s, iterations, seconds of the solver, success."""

    q: Array
    v: Array
    multipliers: Array
    torque: Array
    cost: float
    iterations: int
    seconds: float
    success: bool


def native() -> dict[str, Any]:
    """Return residual and constraint in CasADi's symbols: Lagrange's equations of three rods in a plane by hand."""
    q, v, a, lam = (ca.SX.sym(name, n) for name, n in (("q", 3), ("v", 3), ("a", 3), ("lam", 2)))
    ground, lengths, masses, moments = 0.4, (0.1, 0.35, 0.3), (2.0, 0.7, 0.6), (0.02, 0.007, 0.0045)
    angles = (q[0], q[0] + q[1], q[2])
    along = [ca.vertcat(ca.cos(angle), ca.sin(angle)) for angle in angles]
    pin = lengths[0] * along[0]
    starts = (ca.SX.zeros(2), pin, ca.vertcat(ground, 0.0))
    energy = potential = ca.SX(0.0)
    for angle, start, direction, length, mass, moment in zip(
        angles, starts, along, lengths, masses, moments, strict=True
    ):
        center = start + 0.5 * length * direction
        speed, turn = ca.jtimes(center, q, v), ca.jtimes(angle, q, v)
        energy += 0.5 * mass * ca.sumsqr(speed) + 0.5 * moment * turn**2
        potential += 9.81 * mass * center[1]
    gap = pin + lengths[1] * along[1] - starts[2] - lengths[2] * along[2]
    momenta = ca.gradient(energy, v)
    rate = ca.jtimes(momenta, v, a) + ca.jtimes(momenta, q, v)
    forces = ca.gradient(energy - potential, q) - ca.jacobian(gap, q).T @ lam
    return {
        "residual": ca.Function("residual", [q, v, a, lam], [rate - forces]),
        "constraint": ca.Function("constraint", [q], [gap]),
    }


def turned(functions: Any, start: Array, intervals: int = 40) -> Optimum:
    """Return the turn with the least integral of the squared torque, from rest to rest.

    Parameters
    ----------
    functions : residual and constraint, whose unknowns q, v, a and multipliers are those of each stage
    start : (3,) angles that close the loop
    """
    h, residual, constraint = DURATION / intervals, functions["residual"], functions["constraint"]
    q, v, a, lam = (ca.MX.sym(name, n, 2 * intervals) for name, n in (("q", 3), ("v", 3), ("a", 3), ("lam", 2)))
    torque, equations = ca.MX.sym("torque", 1, intervals), []
    for k in range(intervals):
        before = (ca.DM(start), ca.DM.zeros(3)) if k == 0 else (q[:, 2 * k - 1], v[:, 2 * k - 1])
        for stage, weights in enumerate(STAGES):
            place = 2 * k + stage
            moved = [sum(w * x[:, 2 * k + j] for j, w in enumerate(weights)) for x in (v, a)]
            equations += [
                q[:, place] - before[0] - h * moved[0],
                v[:, place] - before[1] - h * moved[1],
                residual(q[:, place], v[:, place], a[:, place], lam[:, place]) - ca.vertcat(torque[k], 0.0, 0.0),
                constraint(q[:, place]),
            ]
    equations += [q[0, -1] - start[0] - 2.0 * np.pi, v[0, -1]]
    unknowns = ca.veccat(q, v, a, lam, torque)
    problem = {"x": unknowns, "f": h * ca.sumsqr(torque), "g": ca.vertcat(*equations)}
    solver = ca.nlpsol("turned", "ipopt", problem, {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes"}})
    guess = np.zeros(unknowns.numel())
    angles = np.tile(start, (2 * intervals, 1))
    angles[:, 0] += np.linspace(0.0, 2.0 * np.pi, len(angles))
    angles[:, 1] -= np.linspace(0.0, 2.0 * np.pi, len(angles))
    guess[: angles.size] = angles.ravel()
    began = time.process_time()
    result = solver(x0=guess, lbg=0.0, ubg=0.0)
    seconds, statistics = time.process_time() - began, solver.stats()
    ends = np.cumsum([6 * intervals, 6 * intervals, 6 * intervals, 4 * intervals])
    parts = np.split(np.array(result["x"]).ravel(), ends)
    angles, speeds = (
        np.concatenate([[first], part.reshape(-1, 3)[1::2]])
        for first, part in zip((start, np.zeros(3)), parts, strict=False)
    )
    multipliers = parts[3].reshape(-1, 2)[1::2]
    count, success = int(statistics["iter_count"]), bool(statistics["success"])
    return Optimum(angles, speeds, multipliers, parts[4], float(result["f"]), count, seconds, success)


def draw(best: Optimum, file: Path) -> None:
    """Write the picture of a turn."""
    import matplotlib as mpl  # noqa: PLC0415  # for the picture alone

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
    for k, (crank, _, rocker) in enumerate(best.q[::2]):
        pin = 0.1 * np.array([np.cos(crank), np.sin(crank)])
        end = np.array([0.4, 0.0]) + 0.3 * np.array([np.cos(rocker), np.sin(rocker)])
        joints = np.stack([np.zeros(2), pin, end, [0.4, 0.0]])
        left.plot(*joints.T, color="#0072B2", alpha=0.15 + 0.85 * 2 * k / len(best.q), linewidth=1.0)
    left.set(xlabel="along the ground, m", ylabel="height, m")
    left.set_aspect("equal", adjustable="datalim")
    left.set_title("Linkage, darker with time", loc="left")
    times = np.linspace(0.0, DURATION, len(best.q))
    middle.stairs(best.torque, times, color="#0072B2", linewidth=1.2)
    middle.set(xlabel="time, s", ylabel="torque on the crank, N m")
    middle.set_title(f"Least torque: {best.cost:.4g} (N m)² s", loc="left")
    right.plot(times[1:], np.linalg.norm(best.multipliers, axis=1), color="#D55E00", linewidth=1.2)
    right.set(xlabel="time, s", ylabel="force in the closing pin, N")
    right.set_title("Size of the multipliers", loc="left")
    for axes in (left, middle, right):
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(file, dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, default=40)
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    start = eomgen.build(SCENE).initial_q
    own = eomgen.casadi(SCENE, ["residual", "constraint"])
    optima = {name: turned(one, start, options.intervals) for name, one in (("eomgen", own), ("CasADi", native()))}
    for name, best in optima.items():
        print(f"{name}: cost {best.cost:.10f}, {best.iterations} iterations, {best.seconds:.3f} s of processor time")
    file = options.out / "turned_four_bar.png"
    draw(optima["eomgen"], file)
    print(file)
    return 0 if optima["eomgen"].success else 1


if __name__ == "__main__":
    raise SystemExit(main())
