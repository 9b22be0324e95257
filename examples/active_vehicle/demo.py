"""A car on a rough road, passive and with skyhook suspension: from the scene file to C, two runs, a figure and a table.

python examples/active_vehicle/demo.py --out out/active_vehicle
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import welch

import eomgen

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Table = list[tuple[str, str, float, float, float]]

SCENE = Path(__file__).with_name("scene.toml")
PASSIVE = {"skyhook": 0.0}
SETTLED = 2.0  # s; the roughness has faded in and the start has died out
BLUE, VERMILION = "#0072B2", "#D55E00"  # two colours that all kinds of colour vision tell apart

#: Title, output, component (all for None), factor to the unit shown, that unit.
ROWS = (
    ("Body acceleration, centre of mass", "body_acceleration", None, 1.0, "m/s²"),
    ("Body acceleration, driver's seat", "driver_acceleration", None, 1.0, "m/s²"),
    ("Pitch acceleration", "pitch_acceleration", None, 1.0, "rad/s²"),
    ("Roll acceleration", "roll_acceleration", None, 1.0, "rad/s²"),
    ("Suspension travel, front left", "suspension_travel", 0, 1e3, "mm"),
    ("Suspension travel, front right", "suspension_travel", 1, 1e3, "mm"),
    ("Suspension travel, rear left", "suspension_travel", 2, 1e3, "mm"),
    ("Suspension travel, rear right", "suspension_travel", 3, 1e3, "mm"),
    ("Dynamic tyre load, front left", "tyre_load", 0, 1.0, "N"),
    ("Dynamic tyre load, front right", "tyre_load", 1, 1.0, "N"),
    ("Dynamic tyre load, rear left", "tyre_load", 2, 1.0, "N"),
    ("Dynamic tyre load, rear right", "tyre_load", 3, 1.0, "N"),
)


def signal(solution: eomgen.Solution, output: str, component: int | None, factor: float) -> np.ndarray:
    values = solution.outputs[output]
    return factor * (values if component is None else values[:, component])


def rms_table(passive: eomgen.Solution, active: eomgen.Solution) -> Table:
    """Return title, unit, both root mean squares after ``SETTLED``, and the change in per cent."""
    table = []
    for title, output, component, factor, unit in ROWS:
        first, second = (
            float(np.sqrt(np.mean(signal(run, output, component, factor)[run.t > SETTLED] ** 2)))
            for run in (passive, active)
        )
        table.append((title, unit, first, second, 100.0 * (second / first - 1.0)))
    return table


def print_table(table: Table) -> None:
    print(f"{'root mean square':<36}{'unit':<8}{'passive':>9}{'active':>9}{'change':>9}")
    for title, unit, first, second, change in table:
        digits = 3 if first < 10 else 1
        print(f"{title:<36}{unit:<8}{first:>9.{digits}f}{second:>9.{digits}f}{change:>+8.1f}%")


def draw(passive: eomgen.Solution, active: eomgen.Solution, table: Table, path: Path) -> None:
    """Draw passive and active side by side on the same scales, their spectra, and what has changed."""
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False})
    figure = plt.figure(figsize=(9.0, 9.4), layout="constrained")
    histories, summary = figure.subfigures(2, 1, height_ratios=[2.35, 1.0], hspace=0.03)
    grid = histories.add_gridspec(3, 2)
    runs = (("passive", passive, BLUE), ("active", active, VERMILION))
    shown = (
        (1, "Driver's seat\nacceleration"),
        (4, "Suspension travel\nfront left"),
        (8, "Dynamic tyre load\nfront left"),
    )
    for row, (number, label) in enumerate(shown):
        _, output, component, factor, unit = ROWS[number]
        bound = 1.12 * max(np.abs(signal(run, output, component, factor)).max() for _, run, _ in runs)
        for column, (name, run, colour) in enumerate(runs):
            axes = histories.add_subplot(grid[row, column])
            axes.plot(run.t, signal(run, output, component, factor), color=colour, linewidth=0.7)
            axes.set(xlim=(0, run.t[-1]), ylim=(-bound, bound), xticks=np.arange(0.0, run.t[-1] + 1.0, 5.0))
            axes.grid(alpha=0.3, linewidth=0.5)
            value = table[number][2 + column]
            axes.set_title(f"rms {value:.3g} {unit}", loc="right", fontsize=9, color=colour)
            if row == 0:
                axes.set_title(f"{name.capitalize()} suspension", loc="left", fontweight="bold", color=colour)
            if column == 0:
                axes.set_ylabel(f"{label}, {unit}")
            else:
                axes.tick_params(labelleft=False)
            if row == len(shown) - 1:
                axes.set_xlabel("time, s")
            else:
                axes.tick_params(labelbottom=False)
    histories.align_ylabels()
    below = summary.add_gridspec(1, 2)
    draw_spectra(summary.add_subplot(below[0, 0]), runs)
    draw_changes(summary.add_subplot(below[0, 1]), table)
    figure.suptitle("Seven degrees of freedom on an ISO 8608 class C road at 20 m/s", fontsize=11)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def draw_spectra(axes: Axes, runs: tuple[tuple[str, eomgen.Solution, str], ...]) -> None:
    for (name, run, colour), style in zip(runs, ("-", "--"), strict=True):
        settled = run.outputs["driver_acceleration"][run.t > SETTLED]
        frequency, density = welch(settled, fs=1.0 / (run.t[1] - run.t[0]), nperseg=4096)
        axes.loglog(frequency[1:], np.sqrt(density[1:]), color=colour, linestyle=style, linewidth=1.3, label=name)
    axes.set(xlim=(0.3, 20), ylim=(5e-3, 3), xlabel="frequency, Hz", ylabel="Driver's seat\nacceleration, (m/s²)/√Hz")
    axes.set_xticks([0.3, 1, 3, 10, 20], ["0.3", "1", "3", "10", "20"])
    axes.grid(alpha=0.3, linewidth=0.5, which="both")
    axes.set_title("Spectrum", loc="left")
    axes.legend(frameon=False, loc="upper right")


def draw_changes(axes: Axes, table: Table) -> None:
    places = np.arange(len(table))[::-1]
    changes = [change for *_, change in table]
    axes.barh(places, changes, color=[VERMILION if change < 0 else "#777777" for change in changes], height=0.7)
    for place, change in zip(places, changes, strict=True):
        text, side = f"{change:+.0f} %".replace("-", "−"), "right" if change < 0 else "left"
        axes.text(change + (-1.0 if change < 0 else 1.0), place, text, va="center", ha=side, fontsize=8)
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_yticks(places, [title.replace("Body acceleration", "Acceleration") for title, *_ in table], fontsize=8)
    axes.set(xlim=(min(changes) - 14, max(4.0, max(changes) + 12)), xlabel="change of rms by the skyhook, %")
    axes.set_title("Active against passive", loc="left")


def run(out: Path) -> None:
    """Do all of it, and say where everything is."""
    began = time.perf_counter()
    scene = eomgen.load(SCENE)
    written = eomgen.generate(scene, out / "c")
    model = eomgen.build(scene)
    ready = time.perf_counter()
    passive, active = model.simulate(parameters=PASSIVE), model.simulate()
    simulated = time.perf_counter()
    for name, solution in (("passive", passive), ("active", active)):
        if not solution.success:
            raise eomgen.NumericalError(f"{name} car: {solution.message}")
        solution.save(out / f"{name}.npz")
    table = rms_table(passive, active)
    with (out / "rms.csv").open("w", encoding="utf-8", newline="") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow(["quantity", "unit", "passive_rms", "active_rms", "change_percent"])
        rows.writerows(table)
    draw(passive, active, table, out / "active_vehicle.png")

    gain = model.parameters["skyhook"]
    print(
        f"{model.name}: {model.nv} degrees of freedom, {passive.stats['steps']} steps of"
        f" {passive.metadata['step']:g} s,"
    )
    print(
        f"once with skyhook = 0 and once with skyhook = {gain:g} N s/m; root mean squares are those after {SETTLED:g}"
        " s.\n"
    )
    print_table(table)
    least = min(float(np.min(run.outputs["tyre_load"] + static_loads(scene))) for run in (passive, active))
    print(f"\nleast tyre load {least:.0f} N: no wheel leaves the road, so linear tyres are a fair model here")
    print(f"{ready - began:.1f} s to derive, generate and compile, {simulated - ready:.2f} s for both runs, ", end="")
    print(f"{time.perf_counter() - simulated:.1f} s to save and draw")
    print(f"C code    {out / 'c'} ({len(written)} files)\nsolutions {out / 'passive.npz'}, {out / 'active.npz'}")
    print(f"table     {out / 'rms.csv'}\nfigure    {out / 'active_vehicle.png'}")


def static_loads(scene: eomgen.Scene) -> np.ndarray:
    """Return the static tyre loads, N: front left, front right, rear left, rear right."""
    p = {parameter.name: parameter.value for parameter in scene.parameters}
    share = np.array([p["rear"], p["rear"], p["front"], p["front"]]) / (2.0 * (p["front"] + p["rear"]))
    return p["g"] * (p["body_mass"] * share + p["wheel_mass"])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    help_text = "folder for C code, solutions, table and figure"
    parser.add_argument("--out", type=Path, default=Path("out/active_vehicle"), help=help_text)
    out: Path = parser.parse_args().out
    try:
        out.mkdir(parents=True, exist_ok=True)
        run(out)
    except eomgen.EomgenError as error:
        print(f"demo: {error}", file=sys.stderr)
        return error.exit_code
    except OSError as error:
        print(
            f"demo: {error.filename}: {error.strerror}; try: --out with a folder that can be written", file=sys.stderr
        )
        return 7
    return 0


if __name__ == "__main__":
    sys.exit(main())
