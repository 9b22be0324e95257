"""Draw the picture of each example into its folder: ``python examples/pictures.py``."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen

FOLDER = Path(__file__).parent
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"
SEVEN = (BLUE, VERMILION, GREEN, "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito


def simulated(name: str) -> eomgen.Solution:
    """Return the run of an example as its scene file asks for it."""
    run = eomgen.build(FOLDER / name / "scene.toml").simulate()
    if not run.success:
        raise eomgen.NumericalError(f"{name}: {run.message}")
    return run


def save(figure: plt.Figure, name: str) -> None:
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(FOLDER / name / f"{name}.png", dpi=120)
    plt.close(figure)
    print(FOLDER / name / f"{name}.png")


def trajectory(axes: plt.Axes, across: np.ndarray, up: np.ndarray, title: str, colour: str = BLUE) -> None:
    axes.plot(across, up, color=colour, linewidth=0.9)
    axes.plot(across[0], up[0], "o", color="black", markersize=4, label="start")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(title, loc="left")
    axes.legend(frameon=False, loc="upper right")


def double_pendulum_on_shaking_base() -> None:
    run = simulated("double_pendulum_on_shaking_base")
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    tip, angles = run.outputs["tip"], run.outputs["angles"]
    trajectory(left, tip[:, 0], tip[:, 2], "Path of the tip")
    left.set(xlabel="x, m", ylabel="z, m")
    for index, (label, colour) in enumerate((("upper link", BLUE), ("lower link", VERMILION))):
        right.plot(run.t, angles[:, index], color=colour, label=label, linestyle=("-", "--")[index])
    right.set(xlabel="time, s", ylabel="angle from the vertical, rad")
    right.legend(frameon=False)
    save(figure, "double_pendulum_on_shaking_base")


def pendulum_on_shaking_base() -> None:
    run = simulated("pendulum_on_shaking_base")
    fall_time, fall = fallen(eomgen.build(FOLDER / "pendulum_on_shaking_base" / "scene.toml"))
    figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
    axes.plot(run.t, run.outputs["lean"], color=BLUE, linewidth=0.9, label="support shakes by 20 mm at 24 Hz")
    axes.plot(fall_time, fall, color=VERMILION, linestyle="--", label="support at rest: the pendulum falls")
    axes.set(xlabel="time, s", ylabel="angle from upright, rad", ylim=(-0.8, 0.8), xlim=(0, run.t[-1]))
    axes.legend(frameon=False, loc="upper right")
    save(figure, "pendulum_on_shaking_base")


def fallen(model: eomgen.Model) -> tuple[np.ndarray, np.ndarray]:
    """Return the motion over a base at rest, by the compiled forward dynamics in a loop of Python."""
    base = model.base(0.0)
    base[7:] = 0.0  # pose kept, velocities and accelerations gone
    q, v, step, angles = model.initial_q, model.initial_v, 1e-3, []
    for _ in range(600):
        angles.append(float(q[0]) - np.pi)
        v = v + step * model.forward_dynamics(q, v, base=base)
        q = q + step * v
    return step * np.arange(len(angles)), np.array(angles)


def spherical_pendulum() -> None:
    run = simulated("spherical_pendulum")
    bob = run.outputs["bob"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    trajectory(left, bob[:, 0], bob[:, 1], "Path of the bob, from above")
    left.set(xlabel="x, m", ylabel="y, m")
    for index, (label, colour) in enumerate((("x", BLUE), ("y", VERMILION), ("z", GREEN))):
        right.plot(run.t, bob[:, index], color=colour, label=label, linestyle=("-", "--", "-.")[index])
    right.set(xlabel="time, s", ylabel="position of the bob, m", ylim=(-0.7, 0.65))
    right.legend(frameon=False, ncols=3, loc="upper center")
    save(figure, "spherical_pendulum")


def fast_top_joint_coordinates() -> None:
    run = simulated("fast_top_joint_coordinates")
    center = run.outputs["center"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    trajectory(left, center[:, 0], center[:, 1], "Path of the centre of mass, from above")
    left.set(xlabel="x, m", ylabel="y, m")
    right.plot(run.t, center[:, 2], color=BLUE)
    right.set(xlabel="time, s", ylabel="height of the centre of mass, m")
    save(figure, "fast_top_joint_coordinates")


def free_spinning_body() -> None:
    run = simulated("free_spinning_body")
    figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
    names = (("smallest inertia", BLUE), ("middle inertia", VERMILION), ("largest inertia", GREEN))
    for index, (label, colour) in enumerate(names):
        axes.plot(run.t, run.outputs["omega"][:, index], color=colour, label=label, linestyle=("--", "-", "-.")[index])
    axes.set(xlabel="time, s", ylabel="angular velocity, rad/s", xlim=(0, run.t[-1]), ylim=(-7, 10))
    axes.legend(frameon=False, ncols=3, loc="upper center", title="about the axis of")
    save(figure, "free_spinning_body")


def quarter_car() -> None:
    model = eomgen.build(FOLDER / "quarter_car" / "scene.toml")
    passive, active = model.simulate(8.0), model.simulate(8.0, parameters={"skyhook": 2000.0})
    runs = (("passive", passive, BLUE, "-"), ("skyhook 2000 N s/m", active, VERMILION, "--"))
    figure, axes = plt.subplots(2, 1, figsize=(7.5, 4.6), sharex=True, layout="constrained")
    for name, run, colour, style in runs:
        axes[0].plot(run.t, run.outputs["body_acceleration"], color=colour, linestyle=style, linewidth=0.9, label=name)
        axes[1].plot(run.t, 1e3 * run.outputs["suspension_travel"], color=colour, linestyle=style, linewidth=0.9)
    axes[0].set(ylabel="body acceleration, m/s²", xlim=(0, 8), ylim=(-5, 7))
    axes[0].legend(frameon=False, ncols=2, loc="upper right")
    axes[1].set(ylabel="suspension travel, mm", xlabel="time, s")
    save(figure, "quarter_car")


def robot_arm() -> None:
    model = eomgen.build(FOLDER / "robot_arm" / "scene.toml")
    t = np.linspace(0.0, 1.0, 1001)[:, np.newaxis]
    reach, pace = np.array([0.8, 0.5, -0.6, 0.7, 0.6, -0.5, 0.9]), 2.0 * np.pi
    q = model.initial_q + reach * (1.0 - np.cos(pace * t)) / 2.0
    v, a = reach * pace * np.sin(pace * t) / 2.0, reach * pace**2 * np.cos(pace * t) / 2.0
    torque = model.inverse_dynamics(q, v, a)
    run = model.simulate(1.0, 1e-3, method="rk4", inputs={f"torque{k + 1}": torque[:, k] for k in range(7)})
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for k, colour in enumerate(SEVEN):
        left.plot(t, torque[:, k], color=colour, label=f"joint {k + 1}")
    left.set(xlabel="time, s", ylabel="torque, N m", xlim=(0, 1), ylim=(-60, 75))
    left.set_title("Torques for a given motion", loc="left")
    left.legend(frameon=False, ncols=4, loc="upper center", fontsize=8)
    right.semilogy(run.t[1:], np.abs(run.q - q).max(axis=1)[1:], color=BLUE)
    right.set(xlabel="time, s", ylabel="largest deviation of an angle, rad", xlim=(0, 1))
    right.set_title("Motion under these torques", loc="left")
    save(figure, "robot_arm")


def main() -> int:
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False})
    for draw in (
        double_pendulum_on_shaking_base,
        pendulum_on_shaking_base,
        spherical_pendulum,
        fast_top_joint_coordinates,
        free_spinning_body,
        quarter_car,
        robot_arm,
    ):
        draw()
    return 0


if __name__ == "__main__":
    sys.exit(main())
