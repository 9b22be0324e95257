"""Swing a pole up with the least force: multiple shooting over eomgen's step, solved by CasADi and IPOPT.

python examples/cart_pole_swing_up/demo.py [--intervals 40] [--out FOLDER]
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
#: Ends of the motion, s, of the force, N, and of the rail, m.
DURATION, LARGEST_FORCE, RAIL = 2.0, 20.0, 2.0
START, END = (0.0, 0.0, 0.0, 0.0), (1.0, np.pi, 0.0, 0.0)


class Optimum(NamedTuple):
    """A solved swing-up: states (n + 1, 4), forces (n,), cost in N^2 s, iterations, seconds of the solver, success."""

    x: Array
    u: Array
    cost: float
    iterations: int
    seconds: float
    success: bool


def native_rate(x: Any, u: Any, p: Any) -> Any:
    """Return (v, vdot) in CasADi's symbols, from equations of a cart and a point mass on a rod by hand."""
    cart, pole, length = p[0], p[1], p[2]
    angle, speed = x[1], x[3]
    # M11 a1 + M12 a2 = force + pole length sin speed^2, M12 a1 + M22 a2 = -pole g length sin
    M11, M12, M22 = cart + pole, pole * length * ca.cos(angle), pole * length**2
    first = u + pole * length * ca.sin(angle) * speed**2
    second = -pole * 9.81 * length * ca.sin(angle)
    determinant = M11 * M22 - M12**2
    return ca.vertcat(
        x[2], speed, (M22 * first - M12 * second) / determinant, (M11 * second - M12 * first) / determinant
    )


def native_step() -> ca.Function:
    """Return the step of rk4 in CasADi's symbols."""
    x, u, p, h = ca.SX.sym("x", 4), ca.SX.sym("u"), ca.SX.sym("p", 3), ca.SX.sym("h")

    def rate(x: Any) -> Any:
        return native_rate(x, u, p)

    k1 = rate(x)
    k2 = rate(x + h / 2 * k1)
    k3 = rate(x + h / 2 * k2)
    k4 = rate(x + h * k3)
    return ca.Function("native_step", [x, u, p, h], [x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])


def swing_up(step: Callable[..., Any], p: Array, intervals: int = 40, *, exact: bool = True) -> Optimum:
    """Return the motion from hanging to standing with the least integral of the squared force.

    Parameters
    ----------
    step : function of (x, u, p, h)
    p : (3,) masses of cart and pole, kg, and length, m
    intervals : of constant force
    exact : Hessians by derivatives of the step; else by IPOPT's own approximation
    """
    h = DURATION / intervals
    x, u = ca.MX.sym("x", 4, intervals + 1), ca.MX.sym("u", 1, intervals)
    cost = ca.sumsqr(u) * h
    gaps = [step(x[:, k], u[:, k], p, h) - x[:, k + 1] for k in range(intervals)]
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10}}
    if not exact:
        options["ipopt"] |= {"hessian_approximation": "limited-memory", "max_iter": 1000}
    unknowns = ca.veccat(x, u)
    solver = ca.nlpsol("swing_up", "ipopt", {"x": unknowns, "f": cost, "g": ca.vertcat(*gaps)}, options)
    part = np.linspace(0.0, 1.0, intervals + 1)
    guess = np.concatenate([np.outer(part, END).ravel(), np.zeros(intervals)])
    low = np.tile([-RAIL, -np.inf, -np.inf, -np.inf], (intervals + 1, 1))
    high = -low
    low[0] = high[0] = START
    low[-1] = high[-1] = END
    force = np.full(intervals, LARGEST_FORCE)
    bounds = {"lbx": np.concatenate([low.ravel(), -force]), "ubx": np.concatenate([high.ravel(), force])}
    began = time.process_time()
    result = solver(x0=guess, lbg=0.0, ubg=0.0, **bounds)
    seconds, statistics = time.process_time() - began, solver.stats()
    values = np.array(result["x"]).ravel()
    return Optimum(
        values[:-intervals].reshape(-1, 4),
        values[-intervals:],
        float(result["f"]),
        int(statistics["iter_count"]),
        seconds,
        bool(statistics["success"]),
    )


def draw(best: Optimum, file: Path) -> None:
    """Write the picture of a swing-up."""
    import matplotlib as mpl  # noqa: PLC0415  # for the picture alone

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    length = eomgen.build(SCENE).parameters["pole_length"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    tip = np.stack([best.x[:, 0] + length * np.sin(best.x[:, 1]), -length * np.cos(best.x[:, 1])], axis=-1)
    for k in range(len(best.x)):
        shade = 0.2 + 0.8 * k / (len(best.x) - 1)
        left.plot([best.x[k, 0], tip[k, 0]], [0.0, tip[k, 1]], color="#0072B2", alpha=shade, linewidth=1.2)
    left.plot(tip[:, 0], tip[:, 1], color="#D55E00", linewidth=1.0)
    left.axhline(0.0, color="#888888", linewidth=0.8)
    left.set(xlabel="along the rail, m", ylabel="height, m")
    left.set_aspect("equal", adjustable="datalim")
    left.set_title("Pole and path of its mass", loc="left")
    times = np.linspace(0.0, DURATION, len(best.u) + 1)
    right.stairs(best.u, times, color="#0072B2", linewidth=1.2)
    right.set(xlabel="time, s", ylabel="force on the cart, N")
    right.set_title(f"Least force: {best.cost:.4g} N² s, {best.iterations} iterations", loc="left")
    for axes in (left, right):
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(file, dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, default=40)
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    model = eomgen.build(SCENE)
    p = model.parameter_array()
    cases = {
        "eomgen, exact Hessian": (eomgen.casadi(model)["step"], True),
        "CasADi symbols, exact Hessian": (native_step(), True),
        "eomgen, limited-memory Hessian": (eomgen.casadi(model)["step"], False),
    }
    optima = {name: swing_up(step, p, options.intervals, exact=exact) for name, (step, exact) in cases.items()}
    for name, best in optima.items():
        print(f"{name}: cost {best.cost:.10f}, {best.iterations} iterations, {best.seconds:.3f} s of processor time")
    best = optima["eomgen, exact Hessian"]
    file = options.out / "cart_pole_swing_up.png"
    draw(best, file)
    print(file)
    return 0 if best.success else 1


if __name__ == "__main__":
    raise SystemExit(main())
