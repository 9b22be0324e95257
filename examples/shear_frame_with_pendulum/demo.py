"""Steps of one factorization beside iterated and explicit ones on a frame that shakes: four studies and a figure.

python examples/shear_frame_with_pendulum/demo.py --out out/shear_frame_with_pendulum
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

import eomgen

FOLDER = Path(__file__).parent
#: What is changed against the scene: ground that shakes near the first frequency, and a first storey like rock.
CASES: dict[str, dict[str, float]] = {"weak": {}, "strong": {"frequency": 4.0}, "stiff": {"first_storey": 2e11}}
#: Method, colour and marker.
METHODS = {
    "rosenbrock": ("#0072B2", "o"),
    "lsrt2": ("#009E73", "s"),
    "trapezoidal": ("#CC79A7", "+"),
    "rk4": ("#D55E00", "^"),
}
END = 10.0  # s
STEPS = tuple(0.04 / 2**k for k in range(6))


def state(run: eomgen.Solution) -> NDArray[np.float64]:
    """Return q and v at the end of a run; not a number where it stopped before."""
    end = np.concatenate([run.q[-1], run.v[-1]])
    return end if run.success else np.full_like(end, np.nan)


def errors(model: eomgen.Model, case: str) -> dict[str, list[float]]:
    """Return for each method the errors at 10 s, one for each of STEPS.

    Each coordinate and velocity is measured by its largest magnitude on the way. The stiff storey is left out: its
    motion of a tenth of a micrometre is that of K q = F. The reference takes Taylor's steps, or 10^6 of rk4, where
    these would be too many.
    """
    changed = CASES[case]
    slow = slice(1, None) if case == "stiff" else slice(None)
    if case == "stiff":
        fine = model.simulate(END, 1e-5, method="rk4", parameters=changed, record_every=1000, error_estimate=False)
    else:
        fine = model.simulate(END, 0.01, method="taylor", tolerance=1e-14, parameters=changed)
    sizes = [np.abs(part).max(axis=0)[slow] for part in (fine.q, fine.v)]
    found: dict[str, list[float]] = {}
    for method in METHODS:
        for step in STEPS:
            every = round(END / step)
            run = model.simulate(END, step, method=method, parameters=changed, record_every=every, error_estimate=False)
            ends = zip(np.split(state(run), 2), (fine.q[-1], fine.v[-1]), sizes, strict=True)
            error = max(float(np.max(np.abs(end - exact)[slow] / size)) for end, exact, size in ends)
            found.setdefault(method, []).append(error)
    return found


def draw_errors(axes: plt.Axes, found: dict[str, list[float]], title: str) -> None:
    for method, (colour, marker) in METHODS.items():
        good = [(step, error) for step, error in zip(STEPS, found[method], strict=True) if np.isfinite(error)]
        if good:
            axes.loglog(*zip(*good, strict=True), color=colour, marker=marker, markersize=5, label=method)
        else:
            axes.plot([], [], color=colour, marker=marker, markersize=5, label=f"{method}: no step ends")
    axes.set(xlabel="step, s", ylabel="error at 10 s, relative")
    axes.set_title(title, loc="left")
    axes.set_xticks(STEPS, [f"{step:g}" for step in STEPS])
    axes.minorticks_off()
    axes.legend(frameon=False, loc="lower right")


def draw(runs: dict[str, eomgen.Solution], found: dict[str, dict[str, list[float]]], path: Path) -> None:
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False})
    figure, ((floors, angle), (weak, stiff)) = plt.subplots(2, 2, figsize=(9.4, 6.2), layout="constrained")
    run = runs["weak"]
    for number, (label, colour) in enumerate((("first", "#56B4E9"), ("second", "#0072B2"), ("third", "#000000"))):
        floors.plot(run.t, 1e3 * run.outputs["floors"][:, number], color=colour, linewidth=1.0, label=label)
    floors.set(xlabel="time, s", ylabel="displacement, mm", xlim=(0, END), ylim=(-200, 290))
    floors.set_title("Floors, ground at 7 rad/s", loc="left")
    floors.legend(frameon=False, ncols=3, loc="upper right")
    for case, colour, style in (("weak", "#0072B2", "-"), ("strong", "#D55E00", "--")):
        angle.plot(
            runs[case].t,
            runs[case].outputs["angle"],
            style,
            color=colour,
            linewidth=1.0,
            label=f"{CASES[case].get('frequency', 7.0):g} rad/s",
        )
    for turn in np.pi * np.arange(-5.0, 2.0, 2.0):
        angle.axhline(turn, color="#AAAAAA", linewidth=0.6)
    angle.set(xlabel="time, s", ylabel="angle of the pendulum, rad", xlim=(0, END))
    angle.set_title("Pendulum; grey: upright", loc="left")
    angle.legend(title="ground", frameon=False, loc="lower left")
    draw_errors(weak, found["weak"], "Error, all storeys alike")
    draw_errors(stiff, found["stiff"], "Error, first storey stiffer by 1e6")
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def run(out: Path) -> None:
    """Do all of it, and say where everything is."""
    model = eomgen.build(FOLDER / "scene.toml")
    eomgen.generate(FOLDER / "scene.toml", out / "c")
    runs = {case: model.simulate(END, parameters=CASES[case]) for case in ("weak", "strong")}
    for case, solution in runs.items():
        if not solution.success:
            raise eomgen.NumericalError(f"{case}: {solution.message}")
        solution.save(out / f"{case}.npz")
    found = {case: errors(model, case) for case in ("weak", "stiff")}
    with (out / "errors.csv").open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["case", "method", *(f"{step:g} s" for step in STEPS)])
        table.writerows([case, method, *values] for case, rows in found.items() for method, values in rows.items())
    draw(runs, found, out / "shear_frame_with_pendulum.png")
    print(f"{'error at 10 s, step':<24}" + "".join(f"{step:>10g} s" for step in STEPS))
    for case, rows in found.items():
        for method, values in rows.items():
            cells = "".join(f"{value:>12.1e}" if np.isfinite(value) else f"{'stopped':>12}" for value in values)
            print(f"{case + ', ' + method:<24}{cells}")
    print(f"\nC code    {out / 'c'}\nsolutions {', '.join(str(out / f'{case}.npz') for case in runs)}")
    print(f"table     {out / 'errors.csv'}\nfigure    {out / 'shear_frame_with_pendulum.png'}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    help_text = "folder for C code, solutions, table and figure"
    parser.add_argument("--out", type=Path, default=Path("out/shear_frame_with_pendulum"), help=help_text)
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
