"""Flatness-based feedforward of a series elastic arm: motor torques from the second time derivative of inverse
dynamics.

    python examples/sea_arm/demo.py --out out/sea_arm

The springs must carry tau(q, v, a) of the rigid links, so the rotors must be at theta = q + tau / K, and the motors
need u = tau + B a + B tau_ddot / K: the motion up to its fourth derivative, and no feedback (Spong 1987; De Luca and
Book 2016).
"""

from __future__ import annotations

import argparse
import sys
from functools import lru_cache
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen

FOLDER = Path(__file__).parent
STIFFNESS = np.array([1e4, 1e4, 1e4, 1e4, 4e3, 4e3, 4e3])
ROTORS = np.array([0.6, 0.6, 0.6, 0.6, 0.2, 0.2, 0.2])
#: The exciting trajectory of Kumar and Mueller's Panda example, q = amplitude cos(frequency t).
AMPLITUDES = np.array(
    [
        -1.2943753211777664,
        0.7175341454355011,
        -0.5691380764966176,
        0.5848944158627155,
        1.6216297151633214,
        -0.9187855709752027,
        0.4217605991935227,
    ]
)
FREQUENCIES = np.array(
    [
        1.7073873117335832,
        3.079992797637052,
        2.1084514453622774,
        3.5903916041026207,
        1.4183262544423447,
        2.285625793808507,
        5.927533308659986,
    ]
)
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"


def motion(t: float) -> list[np.ndarray]:
    """Return the wanted q, v, a, j, s at time t, (7,) each."""
    phase = FREQUENCIES * t
    return [AMPLITUDES * FREQUENCIES**k * np.cos(phase + 0.5 * np.pi * k) for k in range(5)]


class Feedforward:
    """Motor torques and the rotors' state for the wanted motion, from the rates of the rigid links.

    ``complete = False`` leaves the second derivative of the springs' torque out, as a controller for a rigid arm would.
    """

    def __init__(self, links: eomgen.Model, complete: bool = True) -> None:
        self.links = links
        self.complete = complete
        self.torques = lru_cache(maxsize=None)(self._torques)

    def _torques(self, t: float) -> np.ndarray:
        q, v, a, j, s = motion(t)
        tau, _, tau_ddot = self.links.rates(q, v, a, j, s)
        u: np.ndarray = tau + ROTORS * a
        return u + ROTORS * tau_ddot / STIFFNESS if self.complete else u

    def start(self) -> dict[str, np.ndarray]:
        """Return the state at t = 0 that the motion needs, rotors first, as ``simulate`` takes it."""
        q, v, a, j, s = motion(0.0)
        tau, tau_dot, _ = self.links.rates(q, v, a, j, s)
        return {"q": np.concatenate([q + tau / STIFFNESS, q]), "v": np.concatenate([v + tau_dot / STIFFNESS, v])}

    def inputs(self) -> dict[str, object]:
        """Return the seven motor torques as functions of time."""
        return {f"torque{k + 1}": lambda t, k=k: float(self.torques(t)[k]) for k in range(7)}


def tracked(arm: eomgen.Model, feedforward: Feedforward, step: float) -> tuple[eomgen.Solution, np.ndarray]:
    """Return a run of 1 s without any feedback, and the largest deviation of an angle from the wanted motion at each
    time."""
    run = arm.simulate(1.0, step, method="rk4", inputs=feedforward.inputs(), initial=feedforward.start())
    if not run.success:
        raise eomgen.NumericalError(run.message)
    wanted = np.array([motion(t)[0] for t in run.t])
    return run, np.abs(run.q[:, 7:] - wanted).max(axis=1)


def draw(complete: tuple[eomgen.Solution, np.ndarray], without: tuple[eomgen.Solution, np.ndarray], file: Path) -> None:
    """Draw the springs' deflections and both deviations."""
    plt.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False})
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    run, deviation = complete
    for k, colour in enumerate((BLUE, VERMILION, GREEN, "#CC79A7", "#E69F00", "#56B4E9", "#000000")):
        left.plot(run.t, 1e3 * (run.q[:, k] - run.q[:, 7 + k]), color=colour, linewidth=1.0, label=f"joint {k + 1}")
    left.set(xlabel="time, s", ylabel="deflection of the spring, mrad", xlim=(0, 1))
    low, high = left.get_ylim()
    left.set_ylim(low, high + 0.35 * (high - low))
    left.legend(frameon=False, ncols=4, loc="upper center", fontsize=8)
    left.set_title("What the springs do", loc="left")
    right.semilogy(
        without[0].t[1:], without[1][1:], color=VERMILION, linestyle="--", label="without the second derivative"
    )
    right.semilogy(run.t[1:], deviation[1:], color=BLUE, label="complete feedforward")
    right.set(xlabel="time, s", ylabel="largest deviation of an angle, rad", xlim=(0, 1))
    right.legend(frameon=False, loc="center right")
    right.set_title("Motion without any feedback", loc="left")
    for axes in (left, right):
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.savefig(file, dpi=120)
    plt.close(figure)


def run(out: Path, step: float) -> None:
    """Do all of it, and say what came out."""
    arm = eomgen.build(FOLDER / "scene.toml", method="rk4")
    links = eomgen.build(FOLDER / "links.toml", terms=["inverse_dynamics", "rates"])
    complete = tracked(arm, Feedforward(links), step)
    without = tracked(arm, Feedforward(links, complete=False), step)
    draw(complete, without, out / "sea_arm.png")
    complete[0].save(out / "sea_arm.npz")
    print(
        f"{arm.name}: {arm.nv} degrees of freedom, seven motors, {complete[0].stats['steps']} steps of {step:g} s, no"
        " feedback"
    )
    print(f"largest deviation with the complete feedforward         {complete[1].max():.1e} rad")
    print(f"largest deviation without the second derivative of tau  {without[1].max():.1e} rad")
    print(f"figure   {out / 'sea_arm.png'}\nsolution {out / 'sea_arm.npz'}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/sea_arm"), help="folder for solution and figure")
    parser.add_argument("--step", type=float, default=1e-4, help="step of the Runge-Kutta method, s")
    arguments = parser.parse_args()
    try:
        arguments.out.mkdir(parents=True, exist_ok=True)
        run(arguments.out, arguments.step)
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
