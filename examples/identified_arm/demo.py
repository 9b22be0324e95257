"""An arm with an unknown payload and unknown friction: 24 parameters from one motion of two seconds.

python examples/identified_arm/demo.py [--seed 0] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import time
import tomllib
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import eomgen
from eomgen.base.arrays import Array

BLUE, VERMILION = "#0072B2", "#D55E00"
FOLDER = Path(__file__).parent
#: Of the joints: N m s/rad, N m; gains of the position controllers, N m/rad and N m s/rad.
VISCOUS, DRY = (1.2, 1.2, 0.9, 0.9, 0.5, 0.5, 0.4), (0.8, 0.8, 0.6, 0.6, 0.4, 0.4, 0.3)
STIFFNESS, DAMPING = (600, 600, 400, 400, 250, 150, 50), (50, 50, 30, 30, 15, 10, 4)
CENTRE = {"x": 0.05, "y": -0.04, "z": 0.08}
INERTIA = {"xx": 0.03, "yy": 0.04, "zz": 0.025, "xy": 0.004, "xz": -0.003, "yz": 0.002}
#: Standard deviations of encoders and torque sensors.
NOISE = {"angle": 1e-3, "torque": 1.0}
STEP, SAMPLED, END = 0.0025, 0.005, 2.0
#: Steps of the measured run between two samples.
FINER = 16


def scene() -> dict[str, Any]:
    """Return the arm of ../robot_arm under position control, with a payload and friction of its joints."""
    data = tomllib.loads((FOLDER.parent / "robot_arm" / "scene.toml").read_text(encoding="utf-8"))
    data |= {"name": "identified_arm", "description": "seven-axis arm under position control with a payload"}
    parameters = data["parameters"] = {}

    def unknown(name: str, value: float, unit: str) -> str:
        parameters[name] = {"value": value, "unit": unit, "tunable": True}
        return name

    data["inputs"], data["efforts"], torques = {}, {}, []
    for k, (viscous, dry, stiffness, damping) in enumerate(zip(VISCOUS, DRY, STIFFNESS, DAMPING, strict=True), 1):
        joint = f"joint{k}"
        data["inputs"] |= {f"target{k}": {"unit": "rad"}, f"rate{k}": {"unit": "rad/s"}}
        torques.append(f"{stiffness} * (target{k} - q.{joint}) + {damping} * (rate{k} - v.{joint})")
        slip = f"{unknown(f'viscous{k}', viscous, 'N m s')} * v.{joint}"
        friction = f"{slip} + {unknown(f'dry{k}', dry, 'N m')} * tanh(v.{joint} / 0.2)"
        data["efforts"][joint] = {"joint": joint, "effort": f"{torques[-1]} - ({friction})"}
    data["bodies"]["payload"] = {
        "mass": unknown("payload_mass", 3.0, "kg"),
        "center_of_mass": [unknown(f"payload_{axis}", value, "m") for axis, value in CENTRE.items()],
        "inertia": {axes: unknown(f"payload_{axes}", value, "kg m^2") for axes, value in INERTIA.items()},
    }
    flange = {"type": "fixed", "parent": "link7", "child": "payload", "position": [0, 0, 0.107]}
    data["joints"]["payload"] = flange
    angles = [f"q.joint{k}" for k in range(1, 8)]
    data["outputs"] = {"angle": {"formula": angles, "unit": "rad"}, "torque": {"formula": torques, "unit": "N m"}}
    data["simulation"] = {"method": "trapezoidal", "step": STEP, "duration": END}
    return data


def motion() -> tuple[Array, Array, Array]:
    """Return sampled times (n,), and targets of the joints with their rates, (n, 7) each: three sines a joint."""
    t = SAMPLED * np.arange(round(END / SAMPLED) + 1)
    rng = np.random.default_rng(11)
    targets, rates = np.tile([0.0, -0.3, 0.0, -1.5, 0.0, 1.5, 0.5], (len(t), 1)), np.zeros((len(t), 7))
    for k in range(7):
        for frequency in (0.4, 0.8, 1.3):
            omega = 2.0 * np.pi * frequency * (1.0 + 0.07 * k)
            amplitude, phase = 2.5 * rng.uniform(0.4, 0.8) / omega, rng.uniform(0.0, 2.0 * np.pi)
            targets[:, k] += amplitude * np.sin(omega * t + phase)
            rates[:, k] += amplitude * omega * np.cos(omega * t + phase)
    return t, targets, rates


class Measurement:
    """A motion of the arm at the true parameters, and what sensors with noise make of it."""

    def __init__(self, model: eomgen.Model) -> None:
        t, targets, rates = motion()
        self.model = model
        self.commands = {f"target{k + 1}": targets[:, k] for k in range(7)}
        self.commands |= {f"rate{k + 1}": rates[:, k] for k in range(7)}
        self.initial = {"q": targets[0], "v": rates[0]}
        fine = SAMPLED / FINER * np.arange(round(END / SAMPLED) * FINER + 1)
        settings = {"rtol": 1e-13, "atol": 1e-15}
        self.run = model.simulate(
            END,
            SAMPLED / FINER,
            inputs={name: np.interp(fine, t, values) for name, values in self.commands.items()},
            initial=self.initial,
            settings=settings,
            record_every=FINER,
            error_estimate=False,
        )

    def data(self, seed: int) -> dict[str, Array]:
        """Return the columns of one measurement."""
        rng = np.random.default_rng(seed)
        columns = {"t": self.run.t, **self.commands}
        for name, noise in NOISE.items():
            table = self.run.outputs[name] + noise * rng.standard_normal((len(self.run.t), 7))
            columns |= {f"{name}[{k}]": table[:, k] for k in range(7)}
        return columns

    def identified(self, seed: int) -> eomgen.Identification:
        """Return what is found from half of all friction and two thirds of the payload."""
        start = {
            name: value * (0.5 if name.startswith(("viscous", "dry")) else 0.67)
            for name, value in self.model.parameters.items()
        }
        return eomgen.identify(
            self.model, self.data(seed), list(start), values=start, deviations=NOISE, initial=self.initial
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=FOLDER)
    given = parser.parse_args()
    model = eomgen.build(scene())
    measurement = Measurement(model)
    measurement.identified(given.seed)  # what derivatives need is compiled at their first call
    before = time.process_time()
    found = measurement.identified(given.seed)
    print(f"{found.message}; {time.process_time() - before:.2f} s of processor time")
    for one in found.estimates:
        true = model.parameters[one.name]
        print(f"{one.name:14} {one.value:9.5f} {one.unit:7} +- {one.deviation:.5f}, true {true:.5f}")

    figure, (values, fit) = plt.subplots(1, 2, figsize=(10, 5.2), layout="constrained")
    names = [one.name for one in found.estimates]
    for k, one in enumerate(found.estimates):
        true = model.parameters[one.name]
        values.plot([(one.low / true - 1.0) * 100.0, (one.high / true - 1.0) * 100.0], [k, k], color=BLUE, linewidth=2)
        values.plot((one.value / true - 1.0) * 100.0, k, "o", color=BLUE, markersize=4)
    values.axvline(0.0, color="black", linewidth=0.8)
    values.set_yticks(range(len(names)), [name.replace("_", " ") for name in names], fontsize="small")
    values.set(xlabel="estimate against the true value, %", title="24 parameters, intervals of 95 %")
    values.invert_yaxis()
    record = found.records[0]
    for k, colour in ((1, BLUE), (3, VERMILION)):
        name = f"torque[{k}]"
        fit.plot(record.t, record.data[name], ".", color=colour, markersize=2, alpha=0.4)
        fit.plot(record.t, record.model[name], color=colour, linewidth=1.2, label=f"joint {k + 1}")
    fit.set(xlabel="time, s", ylabel="torque, N m", title="measured and at the estimates")
    fit.legend(frameon=False)
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    given.out.mkdir(parents=True, exist_ok=True)
    figure.savefig(given.out / "identified_arm.png", dpi=90)


if __name__ == "__main__":
    main()
