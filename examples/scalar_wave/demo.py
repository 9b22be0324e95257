"""A pulse and a shock on an elastic bar: errors of methods against exact waves, two tables and a figure.

python examples/scalar_wave/demo.py --out out/scalar_wave
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from bar import Bar
from numpy.typing import NDArray

import eomgen

Array = NDArray[np.float64]
ELEMENTS = 200
#: End of the pulse's run, s, and numbers of linear solves that it may take.
PULSE_END = 1.5
SOLVES = (300, 600, 1200, 2400, 4800)
#: End of the shock's run, s, and its step in the time that a wave takes through an element.
SHOCK_END = 8.0
COURANT = 2.0


@dataclass(frozen=True)
class Compared:
    """A method with its parameters, the linear solves of one of its steps, and how it is drawn."""

    method: str
    solves: int
    colour: str
    marker: str
    parameters: Mapping[str, float] = field(default_factory=dict)

    def run(self, model: eomgen.Model, end: float, step: float, record_every: int = 1) -> eomgen.Solution:
        """Return a run. Raises NumericalError where it stopped."""
        options = {"record_every": record_every, "error_estimate": False, **self.parameters}
        run = model.simulate(end, step, method=self.method, **options)
        if not run.success:
            raise eomgen.NumericalError(f"{self.method}: {run.message}")
        return run


METHODS = {
    "trapezoidal": Compared("trapezoidal", 1, "#CC79A7", "+"),
    "generalized_alpha 0.5": Compared("generalized_alpha", 1, "#0072B2", "o", {"rho_inf": 0.5}),
    "rosenbrock": Compared("rosenbrock", 1, "#E69F00", "x"),
    "lsrt2": Compared("lsrt2", 2, "#009E73", "s"),
    "tdg1": Compared("tdg1", 4, "#56B4E9", "v"),
    "tdg2": Compared("tdg2", 12, "#D55E00", "D"),
    "tdg3": Compared("tdg3", 24, "#000000", "^"),
}


def pulse(elements: int = ELEMENTS) -> Bar:
    """Return a bar with consistent mass, both ends held, bent up to a narrow hill."""
    x = np.arange(1, elements) / elements
    return Bar("pulse", tuple(np.exp(-((x - 0.4) ** 2) / (2.0 * 0.03**2)).tolist()))


def shock(elements: int = ELEMENTS) -> Bar:
    """Return a bar with lumped mass at rest, whose free end is pulled from t = 0 on."""
    return Bar("shock", (0.0,) * elements, "lumped", free_end=True)


class ExactPulse:
    """The motion of the nodes themselves: with consistent mass they have the modes sin(k pi x) and the frequencies

    omega_k^2 = 6/s^2 (1 - cos k pi s)/(2 + cos k pi s),  s = 1/elements,

    and a motion has in each mode the energy of an oscillator.
    """

    def __init__(self, bar: Bar) -> None:
        n, s = bar.elements, 1.0 / bar.elements
        k = np.arange(1, n)
        cosine = np.cos(np.pi * k * s)
        self.modes = np.sin(np.pi * np.outer(k, k) * s)
        self.mass = s * (2.0 + cosine) / 3.0 * (n / 2.0)
        self.frequencies = np.sqrt(6.0 * (1.0 - cosine) / (2.0 + cosine)) / s
        self.start = self.amplitudes(np.array(bar.displacements))

    def amplitudes(self, u: Array) -> Array:
        """Return amplitudes of the modes."""
        return self.modes @ u * (2.0 / (len(u) + 1))

    def error(self, run: eomgen.Solution) -> float:
        """Return the energy of a run's error at its end, relative to all energy, as its root."""
        angle = self.frequencies * run.t[-1]
        q = self.amplitudes(run.q[-1]) - self.start * np.cos(angle)
        v = self.amplitudes(run.v[-1]) + self.start * self.frequencies * np.sin(angle)
        energy = self.mass @ (v**2 + (self.frequencies * q) ** 2)
        return float(np.sqrt(energy / (self.mass @ (self.frequencies * self.start) ** 2)))


def exact_shock(t: Array) -> Array:
    """Return the velocity in the middle of the bar: the wave arrives, comes back from the held end, and so on."""
    place = np.mod(t, 4.0)
    return np.where((place > 0.5) & (place < 1.5), 1.0, np.where((place > 2.5) & (place < 3.5), -1.0, 0.0))


def middle(run: eomgen.Solution) -> Array:
    """Return the velocity of the node in the middle of the bar."""
    return run.v[:, run.v.shape[1] // 2 - 1]


def measures(run: eomgen.Solution) -> dict[str, float]:
    """Return how far the velocity in the middle is from that of the shock; exact are 0, 0 and 4."""
    v = middle(run)
    late = v[run.t >= SHOCK_END / 2.0 - 1e-9]
    return {
        "overshoot": float(np.abs(v).max() - 1.0),
        "mean error": float(np.abs(v - exact_shock(run.t)).mean()),
        "total variation": float(np.abs(np.diff(late)).sum()),
    }


def draw(
    hills: Mapping[str, eomgen.Solution],
    exact: ExactPulse,
    errors: Mapping[str, Sequence[float]],
    shocks: Mapping[str, eomgen.Solution],
    path: Path,
) -> None:
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False})
    figure, ((hill, work), (first, second)) = plt.subplots(2, 2, figsize=(9.4, 6.2), layout="constrained")
    x = np.arange(1, ELEMENTS) / ELEMENTS
    end = exact.modes @ (exact.start * np.cos(exact.frequencies * PULSE_END))
    hill.plot(x, end, color="#000000", linewidth=2.2, alpha=0.35, label="exact, of the nodes")
    for name in ("trapezoidal", "tdg1", "tdg3"):
        hill.plot(x, hills[name].q[-1], color=METHODS[name].colour, linewidth=1.0, label=name)
    hill.set(xlabel="place, m", ylabel="displacement, m", xlim=(0, 1))
    hill.set_title(f"Pulse at {PULSE_END:g} s, {SOLVES[0]} solves", loc="left")
    for name, found in errors.items():
        compared = METHODS[name]
        work.loglog(SOLVES, found, color=compared.colour, marker=compared.marker, markersize=5, label=name)
    work.set(xlabel="linear solves", ylabel="error, energy norm")
    work.set_title("Pulse, error at the end", loc="left")
    work.set_xticks(SOLVES, [f"{solves}" for solves in SOLVES])
    work.minorticks_off()
    for axes, names in ((first, ("trapezoidal", "tdg3")), (second, ("lsrt2", "tdg1"))):
        t = shocks[names[0]].t
        axes.plot(t, exact_shock(t), color="#000000", linewidth=2.2, alpha=0.35, label="exact")
        for name in names:
            axes.plot(t, middle(shocks[name]), color=METHODS[name].colour, linewidth=0.9, label=name)
        axes.set(xlabel="time, s", ylabel="velocity in the middle, m/s", xlim=(0, SHOCK_END), ylim=(-1.5, 2.3))
        axes.set_title(f"Shock, step of {COURANT:g} elements", loc="left")
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    hill.legend(frameon=False, loc="upper center")
    work.legend(frameon=False, loc="lower left")
    for axes in (first, second):
        axes.legend(frameon=False, loc="upper right", ncols=3, columnspacing=1.0, handlelength=1.5)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def run(out: Path) -> None:
    """Do all of it, and say where everything is."""
    models = {"pulse": eomgen.build(pulse()), "shock": eomgen.build(shock())}
    eomgen.generate(pulse(), out / "c")
    exact = ExactPulse(pulse())
    errors: dict[str, list[float]] = {}
    hills: dict[str, eomgen.Solution] = {}
    for name, compared in METHODS.items():
        for solves in SOLVES:
            steps = solves // compared.solves
            ended = compared.run(models["pulse"], PULSE_END, PULSE_END / steps, steps)
            errors.setdefault(name, []).append(exact.error(ended))
            if solves == SOLVES[0]:
                hills[name] = ended
    shocks = {name: item.run(models["shock"], SHOCK_END, COURANT / ELEMENTS) for name, item in METHODS.items()}
    found = {name: measures(run) for name, run in shocks.items()}
    header = ["overshoot", "mean error", "total variation"]
    tables = {
        "pulse": [
            ["method", *(f"{solves} solves" for solves in SOLVES)],
            *([name, *row] for name, row in errors.items()),
        ],
        "shock": [["method", *header], *([name, *row.values()] for name, row in found.items())],
    }
    for name, rows in tables.items():
        with (out / f"{name}.csv").open("w", encoding="utf-8", newline="") as stream:
            csv.writer(stream, lineterminator="\n").writerows(rows)
        print(f"{name + ', ' + rows[0][0]:<24}" + "".join(f"{text:>17}" for text in rows[0][1:]))
        for first, *values in rows[1:]:
            print(f"{first:<24}" + "".join(f"{value:>17.3g}" for value in values))
        print()
    draw(hills, exact, errors, shocks, out / "scalar_wave.png")
    print(f"C code    {out / 'c'}\ntables    {', '.join(str(out / f'{name}.csv') for name in tables)}")
    print(f"figure    {out / 'scalar_wave.png'}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    help_text = "folder for C code, tables and figure"
    parser.add_argument("--out", type=Path, default=Path("out/scalar_wave"), help=help_text)
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
