"""The fastest motion of a Panda between two poses within the limits of its joints: multiple shooting over a step.

python examples/fastest_panda/demo.py [--intervals 60] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib.metadata
import time
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

import eomgen
from eomgen.base.arrays import Array
from eomgen.formula.nodes import Symbol
from eomgen.scene.forces.forces import Effort
from eomgen.system.signals import Input

FOLDER = Path(__file__).parent
ROBOT = "cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf"
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
#: From a pose at one side to a pose at the other, rad.
START = np.array([-1.5, -0.6, 0.3, -2.4, 0.2, 1.6, 0.8])
END = np.array([1.2, 0.6, -0.4, -1.2, -0.5, 2.2, -0.6])
#: Seconds that the motion may take longer if torques sink from their limits to zero: joints with time left go gently.
WEIGHT = 0.02


class Limits(NamedTuple):
    """Of each joint: lowest and highest angle, rad, largest speed, rad/s, largest torque, N m."""

    low: Array
    high: Array
    speed: Array
    torque: Array


class Optimum(NamedTuple):
    """A solved motion: times (n + 1,), states (n + 1, 14), torques (n, 7), iterations, seconds, success."""

    t: Array
    x: Array
    u: Array
    iterations: int
    seconds: float
    success: bool


def urdf() -> Path:
    """Return the file of the robot, from the package example-robot-data."""
    return Path(str(importlib.metadata.distribution("example-robot-data").locate_file(ROBOT)))


def arm() -> eomgen.Scene:
    """Return the arm with locked fingers and a torque at each joint."""
    read = eomgen.load(urdf(), lock=FINGERS)
    names = [joint.name for joint in read.joints]
    motors = tuple(Effort(f"motor_{name}", name, Symbol("input", f"torque_{name}"), 0) for name in names)
    inputs = tuple(Input(f"torque_{name}") for name in names)
    return dataclasses.replace(read, inputs=(*read.inputs, *inputs), elements=(*read.elements, *motors))


def limits() -> Limits:
    """Return the limits of the joints of the arm in its file."""
    limited = [joint.find("limit") for joint in ET.parse(urdf()).getroot().iter("joint")]
    keys = "lower", "upper", "velocity", "effort"
    rows = [[float(limit.attrib[key]) for key in keys] for limit in limited if limit is not None]
    return Limits(*np.array(rows[:7]).T)


def fastest(step: Any, of: Limits, intervals: int = 60, *, exact: bool = True) -> Optimum:
    """Return the motion of least time from rest at one pose to rest at the other.

    Parameters
    ----------
    step : function of (x, u, h)
    intervals : of equal length and constant torques
    exact : Hessians by derivatives of the step; else by IPOPT's own approximation
    """
    x, u, end = ca.MX.sym("x", 14, intervals + 1), ca.MX.sym("u", 7, intervals), ca.MX.sym("end")
    gaps = [step(x[:, k], u[:, k], end / intervals) - x[:, k + 1] for k in range(intervals)]
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-8, "max_iter": 3000}}
    if not exact:
        options["ipopt"] |= {"hessian_approximation": "limited-memory"}
    cost = end + WEIGHT * ca.sumsqr(u / of.torque) / intervals
    problem = {"x": ca.veccat(x, u, end), "f": cost, "g": ca.vertcat(*gaps)}
    solver = ca.nlpsol("fastest", "ipopt", problem, options)
    part, still = np.linspace(0.0, 1.0, intervals + 1)[:, np.newaxis], np.zeros(7)
    guess = np.concatenate([START + part * (END - START), np.tile((END - START) / 1.5, (intervals + 1, 1))], axis=1)
    low = np.tile(np.concatenate([of.low, -of.speed]), (intervals + 1, 1))
    high = np.tile(np.concatenate([of.high, of.speed]), (intervals + 1, 1))
    low[0] = high[0] = np.concatenate([START, still])
    low[-1] = high[-1] = np.concatenate([END, still])
    torque = np.tile(of.torque, intervals)
    began = time.process_time()
    result = solver(
        x0=np.concatenate([guess.ravel(), np.zeros(7 * intervals), [1.5]]),
        lbx=np.concatenate([low.ravel(), -torque, [0.2]]),
        ubx=np.concatenate([high.ravel(), torque, [5.0]]),
        lbg=0.0,
        ubg=0.0,
    )
    seconds, statistics = time.process_time() - began, solver.stats()
    values = np.array(result["x"]).ravel()
    states, torques, length = np.split(values, [14 * (intervals + 1), len(values) - 1])
    times = np.linspace(0.0, float(length[0]), intervals + 1)
    count, success = int(statistics["iter_count"]), bool(statistics["success"])
    return Optimum(times, states.reshape(-1, 14), torques.reshape(-1, 7), count, seconds, success)


def draw(best: Optimum, of: Limits, file: Path) -> None:
    """Write the picture of a motion: angles, speeds and torques as parts of their limits."""
    import matplotlib as mpl  # noqa: PLC0415  # for the picture alone

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    figure, panels = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained", sharex=True)
    middle, half = (of.high + of.low) / 2.0, (of.high - of.low) / 2.0
    curves = (best.x[:, :7] - middle) / half, best.x[:, 7:] / of.speed, best.u / of.torque
    titles = "Angles in their ranges", "Speeds by their limits", "Torques by their limits"
    colors = plt.get_cmap("viridis")(np.linspace(0.0, 0.92, 7))
    for axes, values, title in zip(panels, curves, titles, strict=True):
        for joint in range(7):
            style = {"color": colors[joint], "linewidth": 1.3, "label": f"joint {joint + 1}"}
            if len(values) < len(best.t):
                axes.stairs(values[:, joint], best.t, baseline=None, **style)
            else:
                axes.plot(best.t, values[:, joint], **style)
        for bound in (-1.0, 1.0):
            axes.axhline(bound, color="#888888", linewidth=0.9, linestyle="--")
        axes.set(xlabel="time, s", ylim=(-1.1, 1.1))
        axes.set_title(title, loc="left")
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=7, frameon=False)
    figure.savefig(file, dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, default=60)
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    step = eomgen.casadi(arm(), ["forward_dynamics"])["step"]
    best = fastest(step, limits(), options.intervals)
    text = f"{best.iterations} iterations, {best.seconds:.2f} s of processor time"
    print(f"least time {best.t[-1]:.6f} s, {text}, {'solved' if best.success else 'not solved'}")
    file = options.out / "fastest_panda.png"
    draw(best, limits(), file)
    print(file)
    return 0 if best.success else 1


if __name__ == "__main__":
    raise SystemExit(main())
