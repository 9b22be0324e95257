"""Draw the pictures of the examples into their folders: ``python examples/pictures.py [NAME ...]``, all of them by
default."""

from __future__ import annotations

import runpy
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


def save(figure: plt.Figure, name: str, file: str = "") -> None:
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    path = FOLDER / name / f"{file or name}.png"
    figure.savefig(path, dpi=120)
    plt.close(figure)
    print(path)


def trajectory(axes: plt.Axes, across: np.ndarray, up: np.ndarray, title: str, colour: str = BLUE) -> None:
    axes.plot(across, up, color=colour, linewidth=0.9)
    axes.plot(across[0], up[0], "o", color="black", markersize=4, label="start")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(title, loc="left")
    axes.legend(frameon=False, loc="upper right")


def bouncing_ball() -> None:
    run = simulated("bouncing_ball")
    assert run.events is not None
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    left.plot(run.q[:, 0], run.q[:, 1], color=BLUE, linewidth=1.0)
    for name, label, colour in (
        ("bounce", "impact", VERMILION),
        ("top", "highest", GREEN),
        ("catch", "caught", "black"),
    ):
        found = run.events[name]
        left.plot(found.q[:, 0], found.q[:, 1], "o", color=colour, markersize=4, label=label)
    left.axvline(1.2, color="#888888", linewidth=0.8, linestyle=":")
    left.set(xlabel="distance, m", ylabel="height, m")
    left.set_title("Path of the ball", loc="left")
    left.legend(frameon=False)
    bounces = run.events["bounce"]
    right.vlines(bounces.t, np.abs(bounces.v_before[:, 1]), bounces.v[:, 1], color="#888888", linewidth=0.8)
    right.plot(bounces.t, np.abs(bounces.v_before[:, 1]), "v", color=VERMILION, label="before, downwards")
    right.plot(bounces.t, bounces.v[:, 1], "^", color=BLUE, label="after, upwards")
    right.set(xlabel="time, s", ylabel="speed at the impacts, m/s", ylim=(0.0, None))
    right.set_title("The plate gives and takes", loc="left")
    right.legend(frameon=False)
    save(figure, "bouncing_ball")


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


def elastic_slider_crank() -> None:
    model = eomgen.build(FOLDER / "elastic_slider_crank" / "scene.toml")
    figure, (bending, stretch, ladder) = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
    runs = [
        model.simulate(step=2e-6, method="rk4_partitioned", parameters={"stretch_inertia": factor}, record_every=25)
        for factor in (1.0, 15.0)
    ]
    time = 1e3 * runs[0].t
    lines = ("first sine", 1e3, BLUE, "-"), ("second sine, × 50", 5e4, GREEN, "--")
    for mode, (label, factor, colour, style) in enumerate(lines):
        bending.plot(time, factor * runs[0].outputs["bending"][:, mode], style, color=colour, label=label)
    bending.set(xlabel="time, ms", ylabel="bending, mm", ylim=(-3.5, 4.2))
    bending.legend(frameon=False, loc="upper left", ncols=2, fontsize=8)
    consistent, published = (1e6 * run.outputs["stretch"][:, 1] for run in runs)
    stretch.plot(time, consistent, color=BLUE, label="consistent inertia")
    stretch.plot(
        time, 30.0 * (published - consistent), color=VERMILION, linewidth=0.4, label="published less consistent, × 30"
    )
    stretch.set(xlabel="time, ms", ylabel="stretch at the end, µm", ylim=(-20, 32))
    stretch.legend(frameon=False, loc="upper right", fontsize=8)
    factors = [10.0**decade for decade in range(9)]
    angles, sliders = zip(*(off_the_rigid_mechanism(model, factor) for factor in factors), strict=True)
    ladder.loglog(factors, angles, "o", color=BLUE, markersize=8, fillstyle="none", label="angle of the rod, rad")
    ladder.loglog(factors, sliders, "x", color=VERMILION, markersize=5, label="slider, m")
    ladder.set(xlabel="stiffness, as a multiple", ylabel="off the rigid mechanism, in steps of 1 ms")
    ladder.legend(frameon=False)
    save(figure, "elastic_slider_crank")


def off_the_rigid_mechanism(model: eomgen.Model, factor: float) -> tuple[float, float]:
    """Return the greatest differences of rod angle and slider with a rod that is stiffer by a factor, in steps of 1
    ms."""
    bent = {"position": [0.0, 0.0, 1.03339863e-5 / factor, 1.69327969e-5 / factor], "velocity": [0.0] * 4}
    end = 0.3 + 1.69327969e-5 / factor
    start = {
        "rod": bent,
        "cylinder": {"position": 0.15 + end, "velocity": 0.0},
        "big_end": {"velocity": -22.5 / end - 150.0},
    }
    run = model.simulate(step=1e-3, rho_inf=0.6, parameters={"modulus": 0.2e12 * factor}, initial=start)
    crank, rod = run.outputs["angles"].T
    rigid = -np.arcsin(0.5 * np.sin(crank))
    slider = 0.15 * np.cos(crank) + 0.3 * np.cos(rigid)
    return float(np.abs(rod - rigid).max()), float(np.abs(run.outputs["slider"] - slider).max())


def elastic_vehicle() -> None:
    model = eomgen.build(FOLDER / "elastic_vehicle" / "scene.toml")
    without = dict.fromkeys(model.calibrate(), 0.0)
    runs = (
        ("passive", without, BLUE, "-"),
        ("skyhook", without | {"skyhook": 2000.0}, GREEN, "--"),
        ("LQR", {}, VERMILION, "-"),
    )
    figure, (history, bending, response) = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained")
    frequency = np.geomspace(0.2, 60.0, 1500)
    for name, parameters, colour, style in runs:
        run = model.simulate(6.0, parameters=parameters)
        shown = run.t > 3.0
        history.plot(run.t[shown], run.outputs["acceleration"][shown], style, color=colour, linewidth=0.8, label=name)
        bending.plot(run.t[shown], 1e3 * run.outputs["bending"][shown], style, color=colour, linewidth=0.8, label=name)
        linear = model.linearize(t=100.0, at="initial", parameters=parameters)
        omega = 2 * np.pi * frequency
        front, rear = (linear.frequency_response(omega, road, "acceleration") for road in ("road_front", "road_rear"))
        whole = front + rear * np.exp(-1j * omega * 2.814 / 20.0)
        response.loglog(frequency, np.abs(whole) / omega, style, color=colour, linewidth=0.9, label=name)
    history.set(xlabel="time, s", ylabel="acceleration of the middle, m/s²", xlim=(3, 6), ylim=(-9, 11.5))
    bending.set(xlabel="time, s", ylabel="bending, first mode, mm", xlim=(3, 6), ylim=(-1.0, 1.2))
    response.set(xlabel="frequency, Hz", ylabel="acceleration per road velocity, 1/s", xlim=(0.2, 60))
    response.set_xticks([0.2, 1, 5, 20, 60], ["0.2", "1", "5", "20", "60"])
    for axes in (history, bending):
        axes.legend(frameon=False, loc="upper center", ncols=3, fontsize=8)
    response.legend(frameon=False, loc="lower center", fontsize=8)
    save(figure, "elastic_vehicle")


def elastic_full_car() -> None:
    script = runpy.run_path(str(FOLDER / "elastic_vehicle" / "compare.py"))
    car = script["FULL_CAR"]
    model = eomgen.build(car.scene)
    suspensions = script["suspensions"](model, car)
    stiff = suspensions["passive"] | {"bending_stiffness": 2.5e10, "twisting_stiffness": 6.0e10}
    lines = (
        ("passive, rigid body", stiff, "#777777", ":"),
        ("passive", suspensions["passive"], BLUE, "-"),
        ("skyhook", suspensions["skyhook"], GREEN, "--"),
        ("LQR", suspensions["LQR"], VERMILION, "-"),
    )
    figure, (density, twist, table) = plt.subplots(1, 3, figsize=(11.5, 3.8), layout="constrained")
    frequency = np.geomspace(0.3, 60.0, 1500)
    omega, rough = 2 * np.pi * frequency, 2.0 * script["Road"]("C").velocity_intensity(script["SPEED"])
    late = np.exp(-1j * omega * car.wheelbase / script["SPEED"])
    for label, parameters, colour, style in lines:
        linear = model.linearize(t=script["LATER"], at="initial", parameters=parameters)
        for axes, output, factor in ((density, "acceleration", 1.0), (twist, "twist", 1e3)):
            answers = [[linear.frequency_response(omega, road, output) for road in track] for track in car.tracks]
            squares = sum(np.abs((front + rear * late) / omega) ** 2 for front, rear in answers)
            if axes is density or parameters is not stiff:
                axes.loglog(
                    frequency, factor * np.sqrt(rough * squares), style, color=colour, linewidth=1.0, label=label
                )
    density.set(ylabel="acceleration of the middle, (m/s²)/√Hz", ylim=(1e-4, 4))
    twist.set(ylabel="twist, first mode, mrad/√Hz", ylim=(1e-5, 0.1))
    for axes in (density, twist):
        axes.set(xlabel="frequency, Hz", xlim=(0.3, 60))
        axes.set_xticks([0.3, 1, 3, 10, 30, 60], ["0.3", "1", "3", "10", "30", "60"])
        axes.legend(frameon=False, loc="lower left", fontsize=8)
    places = np.arange(len(car.rows))[::-1]
    passive = script["expected"](model, car, suspensions["passive"])
    for shift, (label, parameters, colour, _) in zip((0.24, 0.0, -0.24), lines[1:], strict=True):
        theory, run = (
            found / passive
            for found in (
                script["expected"](model, car, parameters),
                script["simulated"](model, car, parameters, 100.0),
            )
        )
        table.barh(places + shift, theory, color=colour, height=0.22, alpha=0.75, label=f"{label}, stationary")
        table.plot(
            run, places + shift, "|", color="black", markersize=6, label="simulated, 100 s" if label == "LQR" else None
        )
    table.set_yticks(places, [title.rsplit(",", 1)[0] for _, _, title, _ in car.rows], fontsize=8)
    table.set(xlabel="root mean square, passive = 1", xlim=(0, 1.9), ylim=(-0.6, len(places) + 1.7))
    table.legend(frameon=False, loc="upper right", fontsize=7, ncols=2)
    save(figure, "elastic_vehicle", "full_car")


def elastic_pendulum() -> None:
    run = simulated("elastic_pendulum")
    figure, (paths, bent) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    middle, tip = run.outputs["middle"], run.outputs["tip"]
    # What EXUDYN's beams converge to, as in tests/oracles/elastic_pendulum.py
    exact = np.array(
        [
            [1.42257, 0.90925, -1.07214],
            [-0.41099, 0.07059, -1.95603],
            [-0.57744, -1.16714, -1.51793],
            [1.13140, -0.91340, -1.37311],
        ]
    )
    for axis, colour, style in ((0, BLUE, "-"), (1, VERMILION, "--"), (2, GREEN, "-.")):
        paths.plot(run.t, tip[:, axis], style, color=colour, label="xyz"[axis])
        label = "EXUDYN" if axis == 2 else None
        paths.plot(
            [0.5, 1.0, 1.5, 2.0], exact[:, axis], "o", color="black", markersize=4, fillstyle="none", label=label
        )
    paths.set(xlabel="time, s", ylabel="position of the tip, m", xlim=(0, 2.03), ylim=(-2.2, 3.2))
    paths.legend(frameon=False, ncols=4, loc="upper right", fontsize=8)
    chord = tip / np.linalg.norm(tip, axis=1)[:, np.newaxis]
    along = np.sum(middle * chord, axis=1)[:, np.newaxis]
    bent.plot(run.t, 1e3 * np.linalg.norm(middle - along * chord, axis=1), color=BLUE)
    bent.set(xlabel="time, s", ylabel="middle of the rod off its chord, mm", xlim=(0, 2), ylim=(0, 14))
    save(figure, "elastic_pendulum")


def pi_servo() -> None:
    model = eomgen.build(FOLDER / "pi_servo" / "scene.toml")
    figure, (upper, lower) = plt.subplots(2, 1, figsize=(7, 4.6), layout="constrained", sharex=True)
    for label, tracking, colour, style in (
        ("integral held back", 0.3, BLUE, "-"),
        ("integral winds up", 1e6, VERMILION, "--"),
    ):
        run = model.simulate(parameters={"tracking": tracking})
        upper.plot(run.t, run.outputs["angles"][:, 1], color=colour, linestyle=style, label=label)
        lower.plot(run.t, run.outputs["torques"][:, 0], color=colour, linestyle=style, linewidth=1.0)
    upper.set(ylabel="angle of the load, rad")
    upper.legend(frameon=False, loc="lower right")
    lower.set(xlabel="time, s", ylabel="torque asked for, N m", xlim=(0, run.t[-1]))
    save(figure, "pi_servo")


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


def heavy_top() -> None:
    lasting = eomgen.build(FOLDER / "heavy_top" / "r3xso3.toml").simulate()
    center = lasting.outputs["centre_of_mass"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    trajectory(left, center[:, 0], center[:, 2], "Path of the centre of mass, from the side")
    left.set(xlabel="x, m", ylabel="z, m")
    lines = (
        ("se3", "SE(3), and joint coordinates", VERMILION, "o"),
        ("r3xso3_index3", "R³ x SO(3), index 3", GREEN, "s"),
        ("r3xso3", "R³ x SO(3)", BLUE, "^"),
    )
    exponents, at_1 = range(9, 15), np.array([0.173343964098, 0.640088592070, -0.748490791134])
    for name, label, colour, marker in lines:
        model = eomgen.build(FOLDER / "heavy_top" / f"{name}.toml")
        ends = [model.simulate(1.0, 2.0**-exponent).outputs["centre_of_mass"][-1] for exponent in exponents]
        steps = [2.0**-exponent for exponent in exponents]
        right.loglog(
            steps, np.linalg.norm(np.array(ends) - at_1, axis=1), color=colour, marker=marker, markersize=4, label=label
        )
    right.set(xlabel="step, s", ylabel="error of the position at 1 s, m")
    right.legend(frameon=False)
    save(figure, "heavy_top")


def symmetric_top() -> None:
    run = simulated("symmetric_top")
    axis = run.outputs["axis"]
    figure, axes = plt.subplots(figsize=(4.4, 4.0), layout="constrained")
    trajectory(axes, axis[:, 0], axis[:, 1], "End of the axis, from above")
    axes.set(xlabel="x", ylabel="y")
    save(figure, "symmetric_top")


def slider_crank_planar() -> None:
    run = simulated("slider_crank_planar")
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    turns = run.outputs["angle"] / (2.0 * np.pi)
    left.plot(turns, run.outputs["speed"], color=BLUE)
    left.set(xlabel="turns of the crank", ylabel="angular velocity of the crank, rad/s")
    right.plot(turns, 1e-3 * run.outputs["acceleration"], color=VERMILION, label="acceleration, km/s²")
    right.plot(turns, 100.0 * (run.outputs["piston"][:, 0] - 0.13), color=BLUE, linestyle="--", label="travel, cm")
    right.set(xlabel="turns of the crank", ylabel="of the piston", ylim=(-26, 22))
    right.legend(frameon=False, ncols=2, loc="upper center")
    save(figure, "slider_crank_planar")


def slider_crank_spatial() -> None:
    run = simulated("slider_crank_spatial")
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    left.plot(run.t, run.outputs["slider"][:, 0], color=BLUE)
    left.set(xlabel="time, s", ylabel="position of the slider, m", xlim=(0, run.t[-1]))
    right.plot(run.t, run.outputs["speed"], color=BLUE)
    right.set(xlabel="time, s", ylabel="angular velocity of the crank, rad/s", xlim=(0, run.t[-1]))
    save(figure, "slider_crank_spatial")


def four_bar() -> None:
    run = simulated("four_bar")
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 3.6), layout="constrained")
    pin, end, tracer = (run.outputs[name] for name in ("crank_pin", "rocker_end", "tracer"))
    turn = slice(0, int(np.argmax(run.outputs["angles"][:, 0] > run.outputs["angles"][0, 0] + 2.0 * np.pi)) + 1)
    paths = ((pin, "crank pin", BLUE, "-"), (end, "rocker pin", GREEN, "-"), (tracer, "tracer", VERMILION, "--"))
    for path, label, colour, style in paths:
        left.plot(path[turn, 0], path[turn, 2], color=colour, linestyle=style, linewidth=1.0, label=label)
    left.plot(
        [0, pin[0, 0], end[0, 0], 0.4],
        [0, pin[0, 2], end[0, 2], 0],
        color="black",
        linewidth=2,
        marker="o",
        markersize=4,
    )
    left.set(xlabel="x, m", ylabel="z, m")
    left.set_aspect("equal", adjustable="datalim")
    left.legend(frameon=False, loc="upper left")
    middle.plot(run.t, run.outputs["angles"][:, 1], color=GREEN)
    middle.set(xlabel="time, s", ylabel="angle of the rocker, rad", xlim=(0, run.t[-1]))
    turned = run.outputs["angles"][turn, 0] - run.outputs["angles"][0, 0]
    forces = (
        ("bearing", "on the crank, in its bearing", BLUE, "-"),
        ("pin_force", "on the rocker, in its pin", GREEN, "--"),
    )
    for name, label, colour, style in forces:
        size = np.linalg.norm(run.outputs[name][turn], axis=1)
        right.plot(np.degrees(turned), size, color=colour, linestyle=style, label=label)
    right.set(xlabel="angle that the crank has turned, degrees", ylabel="force, N", xlim=(0, 360), ylim=(0, 330))
    right.set_xticks(range(0, 361, 90))
    right.legend(frameon=False, loc="upper right")
    save(figure, "four_bar")


def cable_net() -> None:
    model = eomgen.build(FOLDER / "cable_net" / "scene.toml")
    run = model.simulate()
    figure = plt.figure(figsize=(9, 6.4), layout="constrained")
    grid = figure.add_gridspec(2, 3, height_ratios=[1.4, 1.0])
    for column, moment in enumerate((0.05, 0.15, 0.3)):
        row = int(np.argmin(np.abs(run.t - moment)))
        knots = run.q[row].reshape(10, 10, 7)[..., 4:]
        axes = figure.add_subplot(grid[0, column], projection="3d")
        for lines, colour in ((knots, BLUE), (knots.transpose(1, 0, 2), "#888888")):
            for line in lines:
                axes.plot(*line.T, color=colour, linewidth=0.8)
        axes.set(xlim=(0.0, 1.1), ylim=(0.0, 1.1), zlim=(-0.35, 0.1), xlabel="x, m", ylabel="y, m")
        axes.set(xticks=(0.0, 0.5, 1.0), yticks=(0.0, 0.5, 1.0), zticks=(-0.3, 0.0))
        axes.set_title(f"{run.t[row]:.2f} s", loc="left")
        axes.view_init(18, -60)
        axes.set_box_aspect((1.0, 1.0, 0.5), zoom=1.15)
    axes = figure.add_subplot(grid[1, :])
    rest = model.equilibrium().q.reshape(10, 10, 7)[..., 4:]
    fallen = run.q.reshape(-1, 10, 10, 7)[..., 6]
    axes.fill_between(
        rest[0, :, 0], fallen.min(axis=(0, 1)), fallen.max(axis=(0, 1)), color=BLUE, alpha=0.15, label="reached in 1 s"
    )
    for cable in rest:
        axes.plot(cable[:, 0], cable[:, 2], "o-", color=VERMILION, markersize=4, linewidth=0.9)
    axes.plot([], [], "o-", color=VERMILION, markersize=4, label="all cables at rest")
    axes.plot([0.0, 1.1], [0.0, 0.0], "ks", label="bars")
    axes.set(xlabel="x, m", ylabel="z, m")
    axes.legend(frameon=False, loc="lower right")
    save(figure, "cable_net")


def hanging_chain() -> None:
    run = simulated("hanging_chain")
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4.0), layout="constrained")
    joints = np.stack([run.outputs[name] for name in ("support", *(f"end{k}" for k in range(1, 10)), "tip")], axis=1)
    for index, moment in enumerate((0.0, 0.5, 1.0, 1.5, 2.0)):
        row = int(np.argmin(np.abs(run.t - moment)))
        for axes, across in ((left, 0), (right, 1)):
            line = {"color": SEVEN[index], "marker": "o", "markersize": 3, "label": f"{moment:g} s"}
            axes.plot(joints[row, :, across], joints[row, :, 2], **line)
    left.set(xlabel="x, m", ylabel="z, m")
    right.set(xlabel="y, m", ylabel="z, m")
    for axes in (left, right):
        axes.set_aspect("equal", adjustable="datalim")
    left.legend(frameon=False, loc="lower right")
    save(figure, "hanging_chain")


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


def active_quarter_car() -> None:
    script = runpy.run_path(str(FOLDER / "active_quarter_car" / "compare.py"))
    model = eomgen.build(script["SCENE"])
    suspensions = script["suspensions"](model)
    figure, axes = plt.subplots(2, 1, figsize=(7.5, 4.8), sharex=True, layout="constrained")
    lines = (("passive", BLUE, "-"), ("clipped", GREEN, "-."), ("LQR", VERMILION, "--"))
    for name, colour, style in lines:
        run = model.simulate(6.0, 1e-3, parameters=suspensions[name])
        axes[0].plot(run.t, run.outputs["body_acceleration"], color=colour, linestyle=style, linewidth=1.0, label=name)
        axes[1].plot(run.t, 1e-3 * run.outputs["tyre_load"], color=colour, linestyle=style, linewidth=0.8)
    axes[0].set(ylabel="body acceleration, m/s²", xlim=(2, 6), ylim=(-5, 6.5))
    axes[0].legend(frameon=False, ncols=3, loc="upper right")
    axes[1].set(ylabel="dynamic tyre load, kN", xlabel="time, s")
    save(figure, "active_quarter_car")


def quarter_car_on_bump() -> None:
    run = simulated("quarter_car_on_bump")
    load, deflection = run.outputs["load"].reshape(-1), run.outputs["deflection"].reshape(-1)
    along = np.clip(10.0 * run.t - 1.0, 0.0, 1.0)
    road = 0.04 * (1.0 - np.cos(2.0 * np.pi * along))
    flying = deflection < 0.0
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    for values, label, colour, style in (
        (road, "road", "black", "-"),
        (run.q[:, 0], "wheel", BLUE, "-"),
        (run.q[:, 1], "body", VERMILION, "--"),
    ):
        left.plot(run.t, 1e3 * values, color=colour, linestyle=style, linewidth=1.1, label=label)
    right.plot(run.t, 1e-3 * load, color=BLUE, linewidth=1.1)
    for axes in (left, right):
        axes.axvspan(run.t[flying][0], run.t[flying][-1], color=GREEN, alpha=0.18, linewidth=0, label="in the air")
        axes.set(xlabel="time, s", xlim=(0.0, 0.8))
    left.set(ylabel="rise from rest, mm")
    left.legend(frameon=False)
    right.set(ylabel="load of the tyre, kN")
    save(figure, "quarter_car_on_bump")


def half_car_on_measured_road() -> None:
    run = simulated("half_car_on_measured_road")
    near = (run.t > 3.5) & (run.t < 6.0)
    distance, road = 10.0 * run.t[near], 1e3 * run.outputs["road"][near]
    body, wheels = run.outputs["body"][near], 1e3 * run.outputs["wheels"][near]
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(7.5, 4.6), sharex=True, layout="constrained")
    top.plot(distance, road[:, 0], color="black", linewidth=0.8, label="road under the front wheel")
    for index, (label, colour) in enumerate((("front wheel", BLUE), ("rear wheel", VERMILION))):
        top.plot(distance, wheels[:, index], color=colour, linestyle=("-", "--")[index], linewidth=1.1, label=label)
    top.set(ylabel="height, mm", xlim=(35, 60), ylim=(-25, 95))
    top.legend(frameon=False, ncols=3, loc="upper right")
    bottom.plot(distance, 1e3 * body[:, 0], color=GREEN, linewidth=1.1, label="heave of the body, mm")
    bottom.plot(
        distance, 1e3 * body[:, 1], color="#CC79A7", linestyle="--", linewidth=1.1, label="pitch of the body, mrad"
    )
    bottom.set(ylim=(-6, 22), ylabel="mm, mrad", xlabel="place of the front wheel on the road, m")
    bottom.legend(frameon=False, ncols=2, loc="upper right")
    save(figure, "half_car_on_measured_road")


def car_in_side_wind() -> None:
    model = eomgen.build(FOLDER / "car_in_side_wind" / "system" / "car.toml")
    figure, axes = plt.subplots(3, 1, figsize=(7.5, 6.0), sharex=True, layout="constrained")
    for gust, label, colour, style in ((20.0, "gust of 20 m/s", VERMILION, "-"), (0.0, "still air", BLUE, "--")):
        run = model.simulate(parameters={"gust": gust})
        drawn = {"color": colour, "linestyle": style, "linewidth": 1.1}
        axes[0].plot(run.t, run.outputs["offset"], label=label, **drawn)
        for ax, column in ((axes[1], 1), (axes[2], 2)):
            for name, axle, width in (("front_tyres", "front", 1.1), ("rear_tyres", "rear", 2.2)):
                values = 1e-3 * run.outputs[name][:, column]
                ax.plot(run.t, values, label=f"{axle}, {label}", **{**drawn, "linewidth": width})
    axes[0].set(ylabel="beside the lane, m")
    axes[1].set(ylabel="side forces, kN")
    axes[2].set(ylabel="loads of axles, kN", xlabel="time, s", xlim=(0.0, run.t[-1]))
    axes[0].legend(frameon=False, loc="upper left")
    axes[1].legend(frameon=False, loc="lower left", ncols=2, fontsize="small")
    save(figure, "car_in_side_wind")


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


def unbalanced_shaft() -> None:
    run = simulated("unbalanced_shaft")
    middle, speed = run.outputs["middle"], run.outputs["speed"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained", width_ratios=(1.5, 1.0))
    left.plot(
        run.t, 1e3 * np.hypot(middle[:, 1], middle[:, 2]), color=BLUE, linewidth=1.0, label="deflection in the middle"
    )
    left.set(xlabel="time, s", ylabel="deflection, mm", ylim=(0.0, None))
    faster = left.twinx()
    faster.plot(run.t, speed, color=VERMILION, linewidth=1.0, label="speed of the motor")
    faster.axhline(57.0, color="#888888", linewidth=0.8, linestyle=":")
    faster.annotate("critical speed", (0.02, 58.5), color="#555555", fontsize=8)
    faster.set(ylabel="speed, rad/s", ylim=(0.0, 105.0))
    lines = [*left.get_lines(), faster.get_lines()[0]]
    left.legend(lines, [str(line.get_label()) for line in lines], frameon=False, loc="upper left")
    left.set_title("Through the critical speed", loc="left")
    for start, end, colour, label in ((0.0, 1.0, GREEN, "before 1 s"), (1.0, 2.5, BLUE, "after 1 s")):
        rows = (run.t >= start) & (run.t <= end)
        right.plot(1e3 * middle[rows, 1], 1e3 * middle[rows, 2], color=colour, linewidth=0.8, label=label)
    right.set_aspect("equal", adjustable="datalim")
    right.set(xlabel="y, mm", ylabel="z, mm")
    right.set_title("The middle", loc="left")
    right.legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.03, 0.98), handlelength=1.2)
    save(figure, "unbalanced_shaft")


def misaligned_four_bar() -> None:
    run = simulated("misaligned_four_bar")
    turned = np.degrees(run.outputs["angles"][0, 0] - run.outputs["angles"][:, 0])
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained")
    left.plot(turned, np.degrees(run.outputs["angles"][:, 0] - np.pi / 2), color=BLUE, label="crank")
    left.plot(turned, np.degrees(run.outputs["angles"][:, 2] - np.pi / 2), color=VERMILION, label="rocker")
    left.set(xlabel="turn of the crank, degrees", ylabel="angle from upright, degrees", xlim=(0, turned[-1]))
    left.set_title("The rocker goes back", loc="left")
    left.legend(frameon=False)
    for series, colour, label in (
        (run.outputs["crank_moment"][:, 0], BLUE, "torque in the crank"),
        (run.outputs["crank_moment"][:, 1], GREEN, "bending of the crank, out of the plane"),
        (run.outputs["rocker_moment"][:, 1], VERMILION, "bending of the rocker, out of the plane"),
    ):
        middle.plot(turned, series, color=colour, linewidth=1.0, label=label)
    middle.set(xlabel="turn of the crank, degrees", ylabel="N m", xlim=(0, turned[-1]), ylim=(None, 280))
    middle.set_title("Section moments at the motor and at the askew hinge", loc="left")
    middle.legend(frameon=False, loc="upper right")
    for time in (0.0, 1.5, 2.5, 4.0, 6.0):
        row = int(np.searchsorted(run.t, time))
        end, pin = 1e3 * run.outputs["coupler_end"][row], 120 * np.exp(1j * run.outputs["angles"][row, 0])
        colour = plt.get_cmap("viridis")(time / 7.0)
        across, up = [0.0, pin.real, end[0], 240.0], [0.0, pin.imag, end[1], 0.0]
        right.plot(across, up, "-o", color=colour, markersize=3, label=f"{time:g} s")
    right.set_aspect("equal", adjustable="datalim")
    right.set(xlabel="x, mm", ylabel="y, mm")
    right.set_title("The linkage", loc="left")
    right.legend(frameon=False, fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.5, -0.02))
    save(figure, "misaligned_four_bar")


def rattleback() -> None:
    model = eomgen.build(FOLDER / "rattleback" / "scene.toml")
    run = model.simulate()
    velocity = run.v[0] * [1, 1, -1, -1, -1, 1]
    other = model.simulate(initial={"q": run.q[0], "v": velocity})
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    for spun, label, colour in ((run, "spun at -5 rad/s", VERMILION), (other, "spun at 5 rad/s", BLUE)):
        left.plot(spun.t, spun["spin"], color=colour, linewidth=0.9, label=label)
        right.plot(spun.t, np.degrees(spun["tilt"]), color=colour, linewidth=0.9, label=label)
    left.axhline(0.0, color="black", linewidth=0.5)
    left.set(xlabel="t, s", ylabel="spin, rad/s")
    left.set_title("Spin about the stone's axis", loc="left")
    left.legend(frameon=False, loc="lower right")
    right.set(xlabel="t, s", ylabel="tilt, degrees", ylim=(0.0, None))
    right.set_title("Angle of the axis to the vertical", loc="left")
    save(figure, "rattleback")


def gear_with_backlash() -> None:
    run = simulated("gear_with_backlash")
    shown = run.t <= 0.5
    figure, (upper, lower) = plt.subplots(2, 1, figsize=(9, 4.2), sharex=True, layout="constrained")
    upper.plot(run.t[shown], np.degrees(run["twist"][shown]), color=BLUE, linewidth=0.9)
    upper.axhspan(-0.3, 0.3, color="black", alpha=0.08, linewidth=0.0, label="play")
    upper.set(ylabel="twist, degrees")
    upper.set_title("Twist of the gear, at the load", loc="left")
    upper.legend(frameon=False, loc="lower right")
    lower.plot(run.t[shown], run["tooth_torque"][shown], color=VERMILION, linewidth=0.9)
    lower.set(xlabel="t, s", ylabel="torque, N m")
    lower.set_title("Torque of the teeth on the load", loc="left")
    save(figure, "gear_with_backlash")


def main() -> int:
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False})
    wanted = set(sys.argv[1:])
    drawings = (
        double_pendulum_on_shaking_base,
        pendulum_on_shaking_base,
        spherical_pendulum,
        heavy_top,
        bouncing_ball,
        symmetric_top,
        slider_crank_planar,
        slider_crank_spatial,
        elastic_slider_crank,
        elastic_vehicle,
        elastic_full_car,
        elastic_pendulum,
        four_bar,
        cable_net,
        hanging_chain,
        free_spinning_body,
        quarter_car,
        active_quarter_car,
        quarter_car_on_bump,
        car_in_side_wind,
        half_car_on_measured_road,
        robot_arm,
        pi_servo,
        unbalanced_shaft,
        misaligned_four_bar,
        rattleback,
        gear_with_backlash,
    )
    for draw in drawings:
        if not wanted or draw.__name__ in wanted:
            draw()
    return 0


if __name__ == "__main__":
    sys.exit(main())
