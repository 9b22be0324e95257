"""Drive the manoeuvres of ``system``, print their figures and draw their reports: ``python demo.py [NAME ...] [--car
FILE] [--speed KM/H] [--out FOLDER]``, all manoeuvres by default."""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import eomgen

Array = NDArray[np.float64]
FOLDER = Path(__file__).parent / "system"
BLUE, VERMILION, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#888888"
WHEELS = (("front left", BLUE), ("front right", VERMILION), ("rear left", GREEN), ("rear right", PURPLE))
#: Size of the body in the plane, m.
LENGTH, WIDTH = 4.1, 1.7


def built(name: str, car: str, speed: float | None = None) -> eomgen.Model:
    """Return the model of a manoeuvre with the car of a file in ``system``, at its speed or another one, km/h."""
    if car == "car.toml" and speed is None:
        return eomgen.build(FOLDER / f"{name}.toml")
    data = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    data["include"]["car"]["file"] = str(FOLDER / car)
    if speed is not None:
        data["parameters"]["speed"]["value"] = f"{speed} km/h"
    for controller in data.get("controllers", {}).values():
        if "source" in controller:
            controller["source"] = str(FOLDER / controller["source"])
    return eomgen.build(data)


def panels(rows: int, columns: int = 1, **options: float | str) -> tuple[Figure, list[Axes]]:
    """Return a figure and its axes, row by row."""
    size = (9.0, 1.3 + 1.7 * rows) if columns == 1 else (9.0, 0.6 + 2.2 * rows)
    figure, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **options)
    for axis in axes.flat:
        axis.grid(alpha=0.3, linewidth=0.5)
    return figure, list(axes.flat)


def passage(t: Array, values: Array, level: float) -> float:
    """Return the first time at which values reach a level, between rows by a straight line."""
    row = int(np.argmax(values >= level))
    return float(np.interp(level, values[row - 1 : row + 1], t[row - 1 : row + 1]))


def step_response(t: Array, wheel: Array, values: Array) -> dict[str, float]:
    """Return the figures of ISO 7401: steady value of the last half second, time from half of the steering to 90 % of
    it, time to the peak, s, and overshoot."""
    steady = float(values[t > t[-1] - 0.5].mean())
    start, peak = passage(t, wheel, wheel[-1] / 2), int(np.argmax(values))
    times = {"response": passage(t, values, 0.9 * steady) - start, "peak": float(t[peak]) - start}
    return {"steady": steady, **times, "overshoot": float(values[peak]) / steady - 1}


def step_steer(model: eomgen.Model) -> Figure:
    run = model.simulate()
    t, wheel = run.t, run.inputs["hand"].ravel()
    figure, axes = panels(3, sharex=True)
    rows = (
        ("yaw_rate", "yaw rate, deg/s", 180 / np.pi, BLUE),
        ("lateral_acceleration", "lateral acceleration, m/s²", 1.0, VERMILION),
        ("sideslip", "sideslip angle, deg", 180 / np.pi, GREEN),
    )
    print("step steer         steady   response time   peak time   overshoot")
    for axis, (name, label, factor, colour) in zip(axes, rows, strict=True):
        values = factor * run[name].ravel()
        axis.plot(t, values, color=colour)
        axis.set(ylabel=label, xlim=(0.5, 4.0))
        if name != "sideslip":
            found = step_response(t, wheel, values)
            print(
                f"{label:27}{found['steady']:7.3f}{found['response']:10.3f} s"
                f"{found['peak']:10.3f} s{100 * found['overshoot']:9.1f} %"
            )
            start = passage(t, wheel, wheel[-1] / 2)
            axis.axhline(0.9 * found["steady"], color=GREY, linewidth=0.8, linestyle=":")
            axis.axvspan(start, start + found["response"], color="black", alpha=0.08, linewidth=0.0)
            axis.plot(start + found["peak"], values.max(), "o", color="black", markersize=4)
            axis.set_title(
                f"response time {found['response']:.3f} s (grey; dotted: 90 %), peak after {found['peak']:.3f} s,"
                f" overshoot {100 * found['overshoot']:.1f} %",
                loc="left",
                fontsize=9,
            )
    right = axes[0].twinx()
    right.plot(t, np.degrees(wheel), color=GREY, linewidth=0.9)
    right.set_ylabel("steering wheel, deg", color=GREY)
    axes[-1].set_xlabel("time, s")
    return figure


def ramp_steer(model: eomgen.Model) -> Figure:
    run = model.simulate()
    moving = run.t > 1.5
    lateral = run["lateral_acceleration"].ravel()[moving]
    excess = np.degrees(run["turned"] - run["needed"]).ravel()[moving]
    linear = (lateral > 0.5) & (lateral < 3.0)
    gradient, offset = np.polyfit(lateral[linear], excess[linear], 1)
    print(f"understeer gradient {gradient:.4f} deg s²/m, largest lateral acceleration {lateral.max():.2f} m/s²")
    figure, (left, right) = panels(1, 2)
    left.plot(excess, lateral, color=BLUE)
    left.plot(gradient * lateral + offset, lateral, color=GREY, linewidth=0.8, linestyle="--")
    left.set(
        xlim=(-0.2, 4.0),
        ylim=(0.0, 9.0),
        xlabel="steer angle beyond wheelbase / radius, deg",
        ylabel="lateral acceleration, m/s²",
    )
    left.set_title(f"understeer gradient {gradient:.3f} deg s²/m (dashed)", loc="left", fontsize=9)
    for name, colour in (("sideslip", GREEN), ("roll", VERMILION)):
        right.plot(lateral, np.degrees(run[name]).ravel()[moving], color=colour, label=name)
    right.plot(lateral, np.degrees(run["steering_wheel"]).ravel()[moving] / 20, color=GREY, label="steering wheel / 20")
    right.set(xlabel="lateral acceleration, m/s²", ylabel="deg")
    right.legend(frameon=False)
    return figure


def sine_with_dwell(model: eomgen.Model) -> Figure:
    figure, axes = panels(3, sharex=True)
    end = 1.0 + 1.0 / 0.7 + 0.5
    print("sine with dwell    yaw rate after 1.00 s, 1.75 s by its second peak    displacement after 1.07 s")
    for angle, colour in ((50.0, GREEN), (100.0, BLUE), (150.0, PURPLE), (270.0, VERMILION)):
        run = model.simulate(parameters={"angle": np.radians(angle)})
        t, rate = run.t, np.degrees(run["yaw_rate"]).ravel()
        peak = rate[(t > 1.0 + 0.5 / 0.7) & (t < end)].min()
        late = [np.interp(end + wait, t, rate) / peak for wait in (1.0, 1.75)]
        beginning = 1.0 + np.arcsin(5.0 / angle) / (2.0 * np.pi * 0.7)  # the steering wheel is at 5 degrees
        moved = np.interp(beginning + 1.07, t, run["place"][:, 1])
        print(f"{angle:10.0f} deg{100 * late[0]:18.1f} %{100 * late[1]:8.1f} %{moved:36.2f} m")
        axes[0].plot(t, np.degrees(run.inputs["hand"]).ravel(), color=colour, label=f"{angle:.0f} deg")
        axes[1].plot(t, rate, color=colour)
        axes[2].plot(t, np.degrees(run["sideslip"]).ravel(), color=colour)
        axes[1].plot([end + 1.0, end + 1.75], np.multiply(late, peak), "o", color=colour, markersize=3)
    for wait, share in ((1.0, 0.35), (1.75, 0.2)):
        axes[1].axvline(end + wait, color=GREY, linewidth=0.8, linestyle=":")
        limit = f"at most {100 * share:.0f} %\nof the second peak"
        axes[1].annotate(limit, (end + wait + 0.03, 12.0), fontsize=8)
    axes[0].legend(frameon=False, ncols=4)
    for axis, label in zip(axes, ("steering wheel, deg", "yaw rate, deg/s", "sideslip angle, deg"), strict=True):
        axis.set(ylabel=label, xlim=(0.5, 6.0))
    axes[-1].set_xlabel("time, s")
    return figure


def lanes() -> list[tuple[float, float, float, float]]:
    """Return the lanes of ISO 3888-1:2018 for the width of the car: first and last x, right and left limit, m."""
    first, second, third = (part * WIDTH + 0.25 for part in (1.1, 1.2, 1.3))
    right = -first / 2
    return [
        (0.0, 15.0, right, right + first),
        (45.0, 70.0, right + 3.5, right + 3.5 + second),
        (95.0, 125.0, right, right + third),
    ]


def corners(run: eomgen.Solution) -> list[tuple[Array, Array]]:
    """Return the paths of the four corners of the car, x and y from the first lane on."""
    x, y, heading = run["place"][:, 0] - 20.0, run["place"][:, 1], run["heading"].ravel()
    return [
        (
            x + ahead * np.cos(heading) - left * np.sin(heading),
            y + ahead * np.sin(heading) + left * np.cos(heading),
        )
        for ahead in (LENGTH / 2, -LENGTH / 2)
        for left in (WIDTH / 2, -WIDTH / 2)
    ]


def clearance(run: eomgen.Solution) -> float:
    """Return the least distance of the car to the limits of the lanes, m; negative if a cone falls."""
    least = np.inf
    for x, y in corners(run):
        for first, last, right, left in lanes():
            inside = y[(x >= first) & (x <= last)]
            least = min(least, inside.min() - right, left - inside.max())
    return float(least)


def lane_change(model: eomgen.Model) -> Figure:
    run = model.simulate()
    print(f"lane change: {clearance(run):.2f} m to the cones at the least, {run['ground_speed'].min():.2f} m/s")
    figure, axes = panels(4, sharex=True)
    x = run["place"][:, 0] - 20.0
    for place, path in enumerate(corners(run)):
        axes[0].plot(*path, color=BLUE, linewidth=0.6, label=None if place else "corners of the body")
    axes[0].plot(x, run["place"][:, 1], color="black", linewidth=0.9, label="centre of mass")
    for first, last, right, left in lanes():
        for limit in (right, left):
            cones = np.linspace(first, last, 1 + round((last - first) / 5.0))
            axes[0].plot(cones, np.full(len(cones), limit), "^-", color=VERMILION, markersize=4, linewidth=0.8)
    axes[0].plot([], "^-", color=VERMILION, markersize=4, linewidth=0.8, label="cones")
    axes[0].set(ylabel="y, m", ylim=(-1.5, 7.5))
    axes[0].set_title(f"{clearance(run):.2f} m to the cones at the least", loc="left", fontsize=9)
    axes[0].legend(frameon=False, loc="upper right", ncols=3)
    rows = (
        ("steering_wheel", "steering wheel, deg", 180 / np.pi),
        ("lateral_acceleration", "lateral acc., m/s²", 1.0),
        ("sideslip", "sideslip, deg", 180 / np.pi),
    )
    for axis, (name, label, factor) in zip(axes[1:], rows, strict=True):
        axis.plot(x, factor * run[name].ravel(), color=GREEN)
        axis.set_ylabel(label)
    axes[-1].set(xlabel="x, m", xlim=(-20.0, 150.0))
    return figure


def split_braking(model: eomgen.Model) -> Figure:
    figure, axes = panels(4, 2, sharex="col", sharey="row")
    for column, control in enumerate((1.0, 0.0)):
        run = model.simulate(parameters={"control": control})
        shown = run.t < 3.0 if control == 0.0 else run.t > -1.0
        t = run.t[shown]
        rows = axes[column::2]
        for wheel, (name, colour) in enumerate(WHEELS):
            for row, output in zip(rows, ("rolling", "torque"), strict=False):
                line = "--" if wheel % 2 else "-"
                row.plot(t, run[output][shown, wheel], line, color=colour, linewidth=0.8, label=name)
        rows[0].plot(t, run["ground_speed"].ravel()[shown], color="black", linewidth=1.0, label="car")
        heading = np.degrees(np.unwrap(run["heading"].ravel()))
        rows[2].plot(t, heading[shown], color=BLUE)
        rows[3].plot(t, np.degrees(run["steering_wheel"].ravel()[shown]), color=BLUE)
        rows[0].set_title(("with control of the brakes", "without control, first 3 s")[column], loc="left", fontsize=9)
        rows[-1].set_xlabel("time, s")
        way = run["place"][-1, 0] - np.interp(0.5, run.t, run["place"][:, 0])
        print(
            f"braking with control {control:.0f}: {way:.1f} m in {run.t[-1] - 0.5:.2f} s,"
            f" to {run['ground_speed'].ravel()[-1]:.1f} m/s, turned by {np.abs(heading).max():.0f} deg"
        )
    for axis, label in zip(
        axes[::2], ("speed, m/s", "torque, N m", "heading, deg", "steering wheel, deg"), strict=True
    ):
        axis.set_ylabel(label)
    axes[0].legend(frameon=False, fontsize=7)
    return figure


def rough_road(model: eomgen.Model) -> Figure:
    run = model.simulate()
    figure, (left, right) = panels(1, 2)
    for component, axis_name, weighting, colour in ((2, "vertical", "Wk", BLUE), (1, "lateral", "Wd", GREEN)):
        name = f"seat[{component}]"
        felt = run.rms(name, weighting=weighting, start=5.0)
        print(f"seat, {axis_name}: {run.rms(name, start=5.0):.3f} m/s², weighted by {weighting} {felt:.3f} m/s²")
        spectrum = run.psd(name, start=5.0, segments=30)
        label = f"{axis_name}, {felt:.2f} m/s² by {weighting}"
        left.loglog(spectrum.frequencies, spectrum.density, color=colour, linewidth=0.9, label=label)
    left.set(xlabel="frequency, Hz", ylabel="acceleration of the seat, (m/s²)²/Hz", xlim=(0.3, 25.0), ylim=(1e-6, 2.0))
    left.legend(frameon=False)
    for wheel, (name, colour) in enumerate(WHEELS[::2]):
        right.plot(run.t, run["loads"][:, 2 * wheel] / 1e3, color=colour, linewidth=0.7, label=name)
    right.set(xlabel="time, s", ylabel="load of a tyre, kN", xlim=(20.0, 24.0), ylim=(0.0, 8.0))
    right.legend(frameon=False, ncols=2)
    return figure


MANOEUVRES: Mapping[str, Callable[[eomgen.Model], Figure]] = {
    "step_steer": step_steer,
    "ramp_steer": ramp_steer,
    "sine_with_dwell": sine_with_dwell,
    "lane_change": lane_change,
    "split_braking": split_braking,
    "rough_road": rough_road,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*MANOEUVRES, "all"], default="all")
    parser.add_argument("--car", default="car.toml", help="file of the car in system")
    parser.add_argument("--speed", type=float, help="in km/h; the manoeuvre's by default")
    parser.add_argument("--out", type=Path, default=Path("out/driving_car"))
    arguments = parser.parse_args()
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False})
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in MANOEUVRES if "all" in arguments.names else arguments.names:
        figure = MANOEUVRES[name](built(name, arguments.car, arguments.speed))
        # the picture of the example itself is its last manoeuvre with a course
        for file in (name, *(["driving_car"] if name == "lane_change" else [])):
            figure.savefig(arguments.out / f"{file}.png", dpi=120)
        plt.close(figure)


if __name__ == "__main__":
    main()
