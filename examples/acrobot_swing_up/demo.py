"""Swing two links up by the motor between them: multiple shooting over eomgen's step, solved by CasADi and IPOPT.

python examples/acrobot_swing_up/demo.py [--intervals 60] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

import eomgen
from eomgen.base.arrays import Array

FOLDER = Path(__file__).parent
SCENE = FOLDER / "model" / "scene.toml"
#: Length of the motion, s, and bound of the torque, N m.
DURATION, LARGEST_TORQUE = 3.0, 6.0
START, END = (0.0, 0.0, 0.0, 0.0), (np.pi, 0.0, 0.0, 0.0)


class Optimum(NamedTuple):
    """A solved swing-up: states (n + 1, 4), torques (n,), cost in (N m)^2 s, iterations, seconds of the solver,
    success."""

    x: Array
    u: Array
    cost: float
    iterations: int
    seconds: float
    success: bool


def native_rate(x: Any, u: Any, p: Any) -> Any:
    """Return (v, vdot) in CasADi's symbols, from equations of two uniform rods by hand."""
    (m1, m2, l1, l2), (first, second) = (p[k] for k in range(4)), (x[0], x[1])
    w1, w2 = x[2], x[3]
    coupling = m2 * l1 * l2 / 2
    M22 = m2 * l2**2 / 3
    M12 = M22 + coupling * ca.cos(second)
    M11 = m1 * l1**2 / 3 + m2 * l1**2 + M22 + 2 * coupling * ca.cos(second)
    h1 = -coupling * ca.sin(second) * (2 * w1 * w2 + w2**2)
    h2 = coupling * ca.sin(second) * w1**2
    of_lower = m2 * 9.81 * l2 / 2 * ca.sin(first + second)
    of_upper = (m1 / 2 + m2) * 9.81 * l1 * ca.sin(first)
    r1, r2 = -h1 - of_upper - of_lower, u - h2 - of_lower
    determinant = M11 * M22 - M12**2
    return ca.vertcat(w1, w2, (M22 * r1 - M12 * r2) / determinant, (M11 * r2 - M12 * r1) / determinant)


def native_step() -> ca.Function:
    """Return the step of rk4 in CasADi's symbols."""
    x, u, p, h = ca.SX.sym("x", 4), ca.SX.sym("u"), ca.SX.sym("p", 4), ca.SX.sym("h")
    k1 = native_rate(x, u, p)
    k2 = native_rate(x + h / 2 * k1, u, p)
    k3 = native_rate(x + h / 2 * k2, u, p)
    k4 = native_rate(x + h * k3, u, p)
    return ca.Function("native_step", [x, u, p, h], [x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])


def swing_up(step: Callable[..., Any], p: Array, intervals: int = 60, *, exact: bool = True) -> Optimum:
    """Return the motion from hanging to standing with the least integral of the squared torque.

    Parameters
    ----------
    step : function of (x, u, p, h)
    p : (4,) masses, kg, and lengths, m
    intervals : of constant torque
    exact : Hessians by derivatives of the step; else by IPOPT's own approximation
    """
    h = DURATION / intervals
    x, u = ca.MX.sym("x", 4, intervals + 1), ca.MX.sym("u", 1, intervals)
    gaps = [step(x[:, k], u[:, k], p, h) - x[:, k + 1] for k in range(intervals)]
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10, "max_iter": 2000}}
    if not exact:
        options["ipopt"] |= {"hessian_approximation": "limited-memory"}
    problem = {"x": ca.veccat(x, u), "f": ca.sumsqr(u) * h, "g": ca.vertcat(*gaps)}
    solver = ca.nlpsol("swing_up", "ipopt", problem, options)
    part = np.linspace(0.0, 1.0, intervals + 1)
    guess = np.concatenate([np.outer(part, END).ravel(), np.zeros(intervals)])
    low = np.tile([-np.inf] * 4, (intervals + 1, 1))
    high = -low
    low[0] = high[0] = START
    low[-1] = high[-1] = END
    torque = np.full(intervals, LARGEST_TORQUE)
    bounds = {"lbx": np.concatenate([low.ravel(), -torque]), "ubx": np.concatenate([high.ravel(), torque])}
    began = time.process_time()
    result = solver(x0=guess, lbg=0.0, ubg=0.0, **bounds)
    seconds, statistics = time.process_time() - began, solver.stats()
    values, count = np.array(result["x"]).ravel(), int(statistics["iter_count"])
    states = values[:-intervals].reshape(-1, 4)
    success = bool(statistics["success"])
    return Optimum(states, values[-intervals:], float(result["f"]), count, seconds, success)


def draw(best: Optimum, file: Path) -> None:
    """Write the picture of a swing-up."""
    import matplotlib as mpl  # noqa: PLC0415  # for the picture alone

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    parameters = eomgen.build(SCENE).parameters
    first, both = best.x[:, 0], best.x[:, 0] + best.x[:, 1]
    elbow = parameters["upper_length"] * np.stack([np.sin(first), -np.cos(first)], axis=-1)
    tip = elbow + parameters["lower_length"] * np.stack([np.sin(both), -np.cos(both)], axis=-1)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for k in range(len(best.x)):
        shade = 0.15 + 0.85 * k / (len(best.x) - 1)
        rod = np.stack([np.zeros(2), elbow[k], tip[k]])
        left.plot(*rod.T, color="#0072B2", alpha=shade, linewidth=1.1)
    left.plot(*tip.T, color="#D55E00", linewidth=1.0)
    left.set(xlabel="across, m", ylabel="height over the shoulder, m")
    left.set_aspect("equal", adjustable="datalim")
    left.set_title("Links, and path of the end", loc="left")
    times = np.linspace(0.0, DURATION, len(best.u) + 1)
    right.stairs(best.u, times, color="#0072B2", linewidth=1.2)
    right.axhline(0.0, color="#888888", linewidth=0.8)
    right.set(xlabel="time, s", ylabel="torque at the elbow, N m")
    right.set_title(f"Least torque: {best.cost:.4g} (N m)² s, {best.iterations} iterations", loc="left")
    for axes in (left, right):
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(file, dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, default=60)
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    model = eomgen.build(SCENE)
    p = model.parameter_array()
    own = eomgen.casadi(model)["step"]
    cases = {
        "eomgen, exact Hessian": (own, True),
        "CasADi symbols, exact Hessian": (native_step(), True),
        "eomgen, limited-memory Hessian": (own, False),
    }
    optima = {name: swing_up(step, p, options.intervals, exact=exact) for name, (step, exact) in cases.items()}
    for name, best in optima.items():
        print(f"{name}: cost {best.cost:.10f}, {best.iterations} iterations, {best.seconds:.3f} s of processor time")
    best = optima["eomgen, exact Hessian"]
    file = options.out / "acrobot_swing_up.png"
    draw(best, file)
    print(file)
    return 0 if best.success else 1


if __name__ == "__main__":
    raise SystemExit(main())
