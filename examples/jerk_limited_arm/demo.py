"""Jerk-limited motion that respects torque-rate limits: the time derivative of inverse dynamics plans it and drives it.

    python examples/jerk_limited_arm/demo.py --out out/jerk_limited_arm

The arm moves from rest to rest along a straight line of joint space, as a cycloid in time. How fast it may go is
decided by jerk, torque and rate of torque at every instant; the actuators' lag is taken out by command = tau + lag
tau_dot.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen

FOLDER = Path(__file__).parent
START = np.array([0.0, -0.6, 0.2, -2.2, 0.3, 1.8, 0.5])
REACH = np.array([1.2, 0.9, -0.6, 0.9, 0.8, -0.7, 1.0])
TORQUE = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0])
JERK = np.array([7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0])
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"


def profile(x: np.ndarray) -> list[np.ndarray]:
    """Return the cycloid s(x) from 0 to 1 over 0 <= x <= 1 and its three derivatives; the third is continuous
    inside."""
    turn = 2.0 * np.pi
    angle = turn * np.clip(x, 0.0, 1.0)
    return [(angle - np.sin(angle)) / turn, 1.0 - np.cos(angle), turn * np.sin(angle), turn**2 * np.cos(angle)]


@dataclass(frozen=True)
class Move:
    """The move in a given time (s), and what it asks of the actuators."""

    links: eomgen.Model
    duration: float

    def at(self, t: np.ndarray) -> list[np.ndarray]:
        """Return q, v, a, j at times (n,), (n, 7) each."""
        shapes = profile(np.asarray(t) / self.duration)
        return [START * (k == 0) + np.multiply.outer(shape, REACH) / self.duration**k for k, shape in enumerate(shapes)]

    def torques(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return tau and tau_dot at times (n,), (n, 7) each."""
        tau, tau_dot = self.links.rates(*self.at(t), order=1)
        return tau, tau_dot

    def load(self, rate: np.ndarray) -> dict[str, float]:
        """Return the largest jerk, torque and rate of torque as parts of their limits."""
        inside = (np.arange(2000) + 0.5) / 2000
        tau, tau_dot = self.torques(inside * self.duration)
        jerk = np.abs(self.at(inside * self.duration)[3])
        return {
            "jerk": float(np.max(jerk / JERK)),
            "torque": float(np.max(np.abs(tau) / TORQUE)),
            "rate of torque": float(np.max(np.abs(tau_dot) / rate)),
        }


def fastest(links: eomgen.Model, rate: np.ndarray, ignored: tuple[str, ...] = ()) -> Move:
    """Return the shortest move that keeps to all limits, or to all but the ignored ones, to 0.1 ms."""
    slow, quick = 5.0, 0.05
    while slow - quick > 1e-4:
        middle = 0.5 * (slow + quick)
        load = Move(links, middle).load(rate)
        if max(value for name, value in load.items() if name not in ignored) > 1.0:
            quick = middle
        else:
            slow = middle
    return Move(links, slow)


def driven(arm: eomgen.Model, move: Move, lag: float, t_end: float) -> tuple[eomgen.Solution, np.ndarray]:
    """Return a run of the arm under the move's commands, no feedback, and the largest deviation of an angle at each
    time."""

    @cache
    def command(t: float) -> np.ndarray:
        tau, tau_dot = move.torques(np.array(t))
        return tau + lag * tau_dot

    inputs = {f"command{k + 1}": lambda t, k=k: float(command(t)[k]) for k in range(7)}
    start = {"q": START, "v": np.zeros(7), "z": move.torques(np.array(0.0))[0]}
    run = arm.simulate(t_end, move.duration / 4000, method="rk4", inputs=inputs, initial=start)
    if not run.success:
        raise eomgen.NumericalError(run.message)
    return run, np.abs(run.q - move.at(run.t)[0]).max(axis=1)


def draw(moves: dict[str, tuple[Move, eomgen.Solution, np.ndarray]], rate: np.ndarray, file: Path) -> None:
    """Draw rates of torque against their limits, and deviations from the plan, for each plan."""
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False})
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for (name, (move, run, deviation)), colour, style in zip(
        moves.items(), (VERMILION, BLUE), ("--", "-"), strict=True
    ):
        t = np.linspace(0.0, move.duration, 1501)[:-1] + 1e-9
        left.plot(
            t, np.abs(move.torques(t)[1] / rate).max(axis=1), color=colour, linestyle=style, linewidth=1.0, label=name
        )
        right.semilogy(run.t[1:], deviation[1:], color=colour, linestyle=style, label=name)
    left.axhline(1.0, color="black", linewidth=0.8)
    left.text(0.62, 1.08, "limit", fontsize=8)
    left.set(xlabel="time, s", ylabel="largest rate of torque / its limit", xlim=(0, None), ylim=(0, None))
    right.set(xlabel="time, s", ylabel="largest deviation of an angle, rad", xlim=(0, None))
    left.set_title("What the plans ask of the actuators", loc="left")
    right.set_title("Motion without any feedback", loc="left")
    right.legend(frameon=False, loc="center right")
    for axes in (left, right):
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(file, dpi=120)
    plt.close(figure)


def run(out: Path) -> None:
    """Plan with and without the limit of the rate of torque, drive both, and say what came out."""
    arm = eomgen.build(FOLDER / "scene.toml", method="rk4")
    links = eomgen.build(FOLDER.parent / "sea_arm" / "links.toml", terms=["inverse_dynamics", "rates_1"])
    p = arm.parameters
    rate = np.array([p["arm_rate"]] * 4 + [p["wrist_rate"]] * 3)
    lag = next(item.value for item in eomgen.load(FOLDER / "scene.toml").parameters if item.name == "lag")
    moves = {}
    for name, ignored in (("limit of rate ignored", ("rate of torque",)), ("limit of rate kept", ())):
        move = fastest(links, rate, ignored)
        solution, deviation = driven(arm, move, lag, move.duration)
        moves[name] = (move, solution, deviation)
        load = ", ".join(f"{key} {100 * value:.0f} %" for key, value in move.load(rate).items())
        print(f"{name:22s} {move.duration:.3f} s; of the limits: {load}; largest deviation {deviation.max():.1e} rad")
    draw(moves, rate, out / "jerk_limited_arm.png")
    print(f"figure {out / 'jerk_limited_arm.png'}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/jerk_limited_arm"), help="folder for the figure")
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
