"""A cantilever spun up beyond its first bending frequency: from the scene files to C, four runs, a table and a figure.

python examples/spin_up_beam/demo.py --out out/spin_up_beam
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen

FOLDER = Path(__file__).parent
#: Scene file, what it is called, colour.
RUNS = {
    "scene": ("set A", "#0072B2"),
    "set_b": ("set B", "#009E73"),
    "with_stretch": ("set A, with stretch", "#CC79A7"),
    "without_stiffening": ("set A, no stiffening", "#D55E00"),
}
RISE = 15.0  # s


def simulated(out: Path) -> dict[str, eomgen.Solution]:
    """Run every scene and save its solution; the C of set A is written too."""
    eomgen.generate(eomgen.load(FOLDER / "scene.toml"), out / "c")
    runs = {}
    for name, (title, _) in RUNS.items():
        run = runs[name] = eomgen.build(FOLDER / f"{name}.toml").simulate()
        if not run.success and name != "without_stiffening":  # which shows how it fails
            raise eomgen.NumericalError(f"{title}: {run.message}")
        run.save(out / f"{name}.npz")
    return runs


def summary(runs: dict[str, eomgen.Solution]) -> list[tuple[str, float, float, float | None]]:
    """Return title, greatest deflection (m), its time (s), and the amplitude after the spin-up (m)."""
    rows = []
    for name, run in runs.items():
        tip = run.outputs["tip_deflection"]
        peak = int(np.abs(tip).argmax())
        late = np.abs(tip[run.t >= RISE])
        rows.append((RUNS[name][0], float(tip[peak]), float(run.t[peak]), float(late.max()) if late.size else None))
    return rows


def draw(runs: dict[str, eomgen.Solution], path: Path) -> None:
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False})
    figure, ((whole, failure), (late, axial)) = plt.subplots(2, 2, figsize=(9.0, 6.2), layout="constrained")
    for name, style in (("scene", "-"), ("set_b", "--")):
        run, (title, colour) = runs[name], RUNS[name]
        tip = run.outputs["tip_deflection"]
        whole.plot(run.t, tip, style, color=colour, label=title)
        after = run.t >= RISE
        late.plot(run.t[after], 1e3 * tip[after], style, color=colour, label=title, linewidth=1.0)
    whole.axvline(RISE, color="#777777", linewidth=0.8)
    whole.annotate("steady rate", (RISE, -0.3), (RISE + 0.4, -0.3), color="#555555")
    whole.set(ylabel="tip deflection, m", xlabel="time, s", xlim=(0, 20), title="Spin-up")
    whole.legend(frameon=False, loc="lower right")
    for name, style in (("scene", "-"), ("without_stiffening", "--")):
        run, (title, colour) = runs[name], RUNS[name]
        failure.semilogy(run.t[1:], np.abs(run.outputs["tip_deflection"][1:]), style, color=colour, label=title)
    failure.axhline(10.0, color="#777777", linewidth=0.8)
    failure.annotate("length of the beam", (0.3, 13.0), color="#555555")
    failure.set(
        ylabel="|tip deflection|, m", xlabel="time, s", xlim=(0, 12), ylim=(1e-4, 1e6), title="Stiffening left out"
    )
    failure.legend(frameon=False, loc="lower right")
    late.set(
        ylabel="tip deflection, mm",
        xlabel="time, s",
        xlim=(RISE, 20),
        ylim=(-10, 13),
        title="Vibration after the spin-up",
    )
    late.legend(frameon=False, loc="upper right", ncols=2)
    run, (title, colour) = runs["with_stretch"], RUNS["with_stretch"]
    axial.plot(run.t, 1e3 * run.outputs["tip_elongation"], color=colour, label=title)
    axial.axhline(0.5142857, color="black", linestyle=":", linewidth=1.0, label="ρA Ω² L³ / (3 EA)")
    axial.set(ylabel="elongation, mm", xlabel="time, s", xlim=(0, 20), title="Stretch")
    axial.legend(frameon=False, loc="lower right")
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def run(out: Path) -> None:
    """Do all of it, and say where everything is."""
    began = time.perf_counter()
    runs = simulated(out)
    ran = time.perf_counter()
    rows = summary(runs)
    with (out / "peaks.csv").open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["run", "greatest_deflection_m", "at_s", "amplitude_after_spin_up_m"])
        table.writerows(rows)
    draw(runs, out / "spin_up_beam.png")
    print(f"{'spin-up of a cantilever':<24}{'greatest deflection, m':>24}{'at, s':>9}{'left after 15 s, mm':>22}")
    for title, peak, moment, late in rows:
        left = "ran away" if late is None else f"{1e3 * late:.2f}"
        print(f"{title:<24}{peak:>24.5g}{moment:>9.3f}{left:>22}")
    first = runs["scene"].stats
    print(f"\n{ran - began:.1f} s to derive, generate, compile and run all four; ", end="")
    print(f"the {first['steps']} steps of set A took {1e3 * float(first['wall_time']):.0f} ms")
    print(f"C code    {out / 'c'}\nsolutions {', '.join(str(out / f'{name}.npz') for name in RUNS)}")
    print(f"table     {out / 'peaks.csv'}\nfigure    {out / 'spin_up_beam.png'}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    help_text = "folder for C code, solutions, table and figure"
    parser.add_argument("--out", type=Path, default=Path("out/spin_up_beam"), help=help_text)
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
