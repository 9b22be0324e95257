"""Half a car whose actuators see a bump ahead: multiple shooting over eomgen's step, solved by CasADi and IPOPT.

python examples/vehicle_with_preview/demo.py [--intervals 160] [--out FOLDER]
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
DURATION, SPEED = 1.6, 8.0
#: The bump: start, length and height, m; distance of the axles, m.
BUMP, AXLES = (3.2, 1.2, 0.08), 1.011 + 1.803
#: Largest forces, N, and strokes, m.
LARGEST_FORCE, LARGEST_STROKE = 4000.0, 0.06
#: Weights of the accelerations of heave and pitch, strokes and deflections of tyres, forces.
WEIGHTS = (1.0, 1.0, 1e2, 1e3, 1e-7)


class Motion(NamedTuple):
    """Times (n + 1,), states (n + 1, 8), forces (n, 2), mean square accelerations of heave and pitch, iterations,
    seconds of the solver, success."""

    t: Array
    x: Array
    u: Array
    heave: float
    pitch: float
    iterations: int
    seconds: float
    success: bool


def road(t: Array) -> Array:
    """Return heights of the road under both wheels, (n, 2)."""
    start, length, height = BUMP
    along = SPEED * t[:, np.newaxis] - start - np.array([0.0, AXLES])
    return np.where((along > 0.0) & (along < length), height / 2.0 * (1.0 - np.cos(2 * np.pi * along / length)), 0.0)


def native_step() -> ca.Function:
    """Return the step of rk4 in CasADi's symbols, from the equations by hand."""
    x, u, p, h = ca.SX.sym("x", 8), ca.SX.sym("u", 4), ca.SX.sym("p"), ca.SX.sym("h")
    front, rear, tyre = 1.011, 1.803, 175500.0

    def rate(x: Any) -> Any:
        q, v = x[:4], x[4:]
        stroke = ca.vertcat(q[0] - front * q[1] - q[2], q[0] + rear * q[1] - q[3])
        speed = ca.vertcat(v[0] - front * v[1] - v[2], v[0] + rear * v[1] - v[3])
        push = u[:2] - 19000.0 * stroke - 3e6 * stroke**3 - p * speed
        on_tyre = tyre * (u[2:] - q[2:])
        body = ca.vertcat((push[0] + push[1]) / 730.0, (-front * push[0] + rear * push[1]) / 1230.0)
        return ca.vertcat(v, body, (on_tyre - push) / ca.DM([40.0, 35.5]))

    k1 = rate(x)
    k2 = rate(x + h / 2 * k1)
    k3 = rate(x + h / 2 * k2)
    k4 = rate(x + h * k3)
    return ca.Function("native_step", [x, u, p, h], [x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])


def driven(step: Callable[..., Any], p: Array, intervals: int = 160, *, active: bool = True) -> Motion:
    """Return the drive over the bump with the forces of least cost, or without forces.

    Parameters
    ----------
    step : function of (x, u, p, h)
    p : (1,) damping, N s/m
    intervals : of constant forces
    """
    h, t = DURATION / intervals, np.linspace(0.0, DURATION, intervals + 1)
    heights = road(t[:-1] + h / 2.0)
    x, u = ca.MX.sym("x", 8, intervals + 1), ca.MX.sym("u", 2, intervals)
    gaps = [step(x[:, k], ca.vertcat(u[:, k], heights[k]), p, h) - x[:, k + 1] for k in range(intervals)]
    accelerations = (x[4:6, 1:] - x[4:6, :-1]) / h
    strokes = ca.vertcat(x[0, :] - 1.011 * x[1, :] - x[2, :], x[0, :] + 1.803 * x[1, :] - x[3, :])
    squares = [ca.sumsqr(accelerations[0, :]), ca.sumsqr(accelerations[1, :]), ca.sumsqr(strokes)]
    squares += [ca.sumsqr(x[2:4, :-1] - heights.T), ca.sumsqr(u)]
    cost = h * sum(weight * square for weight, square in zip(WEIGHTS, squares, strict=True))
    problem = {"x": ca.veccat(x, u), "f": cost, "g": ca.vertcat(*gaps, ca.vec(strokes))}
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-9, "max_iter": 500}}
    solver = ca.nlpsol("driven", "ipopt", problem, options)
    low = np.full((intervals + 1, 8), -np.inf)
    high = -low
    low[0] = high[0] = 0.0
    force, stroke = np.full(2 * intervals, LARGEST_FORCE * active), np.full(2 * (intervals + 1), LARGEST_STROKE)
    stroke = stroke if active else np.full_like(stroke, np.inf)
    none = np.zeros(8 * intervals)
    began = time.process_time()
    result = solver(
        x0=0.0,
        lbx=np.concatenate([low.ravel(), -force]),
        ubx=np.concatenate([high.ravel(), force]),
        lbg=np.concatenate([none, -stroke]),
        ubg=np.concatenate([none, stroke]),
    )
    seconds, statistics = time.process_time() - began, solver.stats()
    states, forces = np.split(np.array(result["x"]).ravel(), [8 * (intervals + 1)])
    states = states.reshape(-1, 8)
    heave, pitch = np.mean((np.diff(states[:, 4:6], axis=0) / h) ** 2, axis=0)
    count, success = int(statistics["iter_count"]), bool(statistics["success"])
    return Motion(t, states, forces.reshape(-1, 2), float(heave), float(pitch), count, seconds, success)


def draw(passive: Motion, active: Motion, file: Path) -> None:
    """Write the picture of both drives."""
    import matplotlib as mpl  # noqa: PLC0415  # for the picture alone

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    figure, panels = plt.subplots(2, 2, figsize=(9.5, 5.4), layout="constrained", sharex=True)
    t, colors = active.t, {"passive": "#888888", "with preview": "#0072B2"}
    heights = road(t)
    panels[0, 0].plot(t, heights[:, 0] * 100, color="#D55E00", label="front wheel")
    panels[0, 0].plot(t, heights[:, 1] * 100, color="#009E73", label="rear wheel")
    panels[0, 0].set(ylabel="road, cm")
    panels[0, 0].set_title("Road under the wheels", loc="left")
    for number, label in enumerate(("front", "rear")):
        color = ("#D55E00", "#009E73")[number]
        panels[0, 1].stairs(active.u[:, number] / 1e3, t, color=color, baseline=None, linewidth=1.3, label=label)
    panels[0, 1].set(ylabel="force, kN")
    panels[0, 1].set_title("Actuators", loc="left")
    for motion, (name, color) in zip((passive, active), colors.items(), strict=True):
        panels[1, 0].plot(t, motion.x[:, 0] * 100, color=color, linewidth=1.4, label=name)
        acceleration = np.diff(motion.x[:, 4]) / np.diff(t)
        panels[1, 1].stairs(acceleration, t, color=color, baseline=None, linewidth=1.3, label=name)
    panels[1, 0].set(xlabel="time, s", ylabel="heave, cm")
    panels[1, 0].set_title("Body", loc="left")
    panels[1, 1].set(xlabel="time, s", ylabel="acceleration, m/s²")
    panels[1, 1].set_title("Vertical acceleration", loc="left")
    for axes in panels.flat:
        axes.grid(alpha=0.3, linewidth=0.5)
        axes.legend(frameon=False, fontsize="small")
    figure.savefig(file, dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, default=160)
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    model = eomgen.build(SCENE)
    p, own = model.parameter_array(), eomgen.casadi(model)["step"]
    passive = driven(own, p, options.intervals, active=False)
    active = driven(own, p, options.intervals)
    native = driven(native_step(), p, options.intervals)
    for name, motion in {"passive": passive, "with preview": active, "the same in CasADi's symbols": native}.items():
        roots = np.sqrt([motion.heave, motion.pitch])
        text = f"{motion.iterations} iterations, {motion.seconds:.3f} s of processor time"
        print(f"{name}: root mean square {roots[0]:.6f} m/s^2 and {roots[1]:.6f} rad/s^2, {text}")
    file = options.out / "vehicle_with_preview.png"
    draw(passive, active, file)
    print(file)
    return 0 if passive.success and active.success else 1


if __name__ == "__main__":
    raise SystemExit(main())
