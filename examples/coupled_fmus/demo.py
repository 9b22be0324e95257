"""A position servo as two FMUs, plant and controller, coupled by a small master on top of FMPy; its coupling error is
measured against one model of both.

    python examples/coupled_fmus/demo.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import fmpy
import fmpy.fmi2
import numpy as np
from matplotlib.figure import Figure

import eomgen

HERE = Path(__file__).parent / "scenes"
END = 2.0
#: Communication steps, s.
STEPS = (8e-3, 4e-3, 2e-3, 1e-3, 5e-4)


class Part:
    """An FMU of FMI 2.0 in co-simulation, with inputs that are held or linear in time."""

    def __init__(self, file: Path, folder: Path) -> None:
        unzipped = fmpy.extract(str(file), str(folder / file.stem))
        description = fmpy.read_model_description(unzipped)
        self.places = {item.name: item.valueReference for item in description.modelVariables}
        self.fmu = fmpy.fmi2.FMU2Slave(
            guid=description.guid,
            unzipDirectory=unzipped,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=file.stem,
        )
        self.fmu.instantiate()

    def start(self) -> None:
        """Begin a motion at t = 0."""
        self.fmu.reset()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def get(self, *names: str) -> np.ndarray[Any, Any]:
        return np.array(self.fmu.getReal([self.places[name] for name in names]))

    def step(self, t: float, length: float, values: dict[str, float], rates: dict[str, float]) -> None:
        """Go on by a communication step with inputs, and time derivatives of some of them."""
        self.fmu.setReal([self.places[name] for name in values], list(values.values()))
        if rates:
            references = [self.places[name] for name in rates]
            self.fmu.setRealInputDerivatives(references, [1] * len(rates), list(rates.values()))
        self.fmu.doStep(t, length)


def coupled(plant: Part, controller: Part, length: float, *, linear: bool) -> np.ndarray[Any, Any]:
    """Return the angle of the motor at the communication points; both parts step at once (Jacobi).

    Parameters
    ----------
    length : of the communication steps, s
    linear : whether inputs follow the line through their last two values, and are not held
    """
    plant.start()
    controller.start()
    before = None
    angles = [plant.get("angle")[0]]
    for k in range(round(END / length)):
        t = k * length
        now = np.array([*plant.get("angle", "speed"), *controller.get("command")])
        rates = (now - before) / length if linear and before is not None else np.zeros(3)
        before = now
        measured, slopes = dict(zip(("angle", "speed"), now[:2], strict=True)), rates[:2]
        moving = dict(zip(("angle", "speed"), slopes, strict=True)) if linear else {}
        controller.step(t, length, measured, moving)
        plant.step(t, length, {"torque": now[2]}, {"torque": rates[2]} if linear else {})
        angles.append(plant.get("angle")[0])
    return np.array(angles)


def errors() -> list[tuple[float, float, float]]:
    """Return step, error with held and error with linear inputs, rad: largest over the motion, at common times."""
    reference = eomgen.build(HERE / "monolith.toml", profile="reproducible").simulate(END, error_estimate=False)
    assert reference.success, reference.message
    angle = reference.outputs["angle"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = [
            eomgen.fmu(HERE / f"{part}.toml", folder / f"{part}.fmu", version=2, types="cs", reference=False)
            for part in ("plant", "controller")
        ]
        parts = [Part(file, folder) for file in files]
        rows = []
        for length in STEPS:
            every = round(length / 1e-4)
            runs = [coupled(*parts, length, linear=linear) for linear in (False, True)]
            held, line = (float(np.max(np.abs(run - angle[::every][: len(run)]))) for run in runs)
            rows.append((length, held, line))
        for part in parts:
            part.fmu.terminate()
            part.fmu.freeInstance()
    return rows


def draw(rows: list[tuple[float, float, float]], file: Path) -> None:
    """Draw the errors over the communication step."""
    steps, held, line = np.array(rows).T
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.add_subplot()
    axes.loglog(1e3 * steps, held, "o-", label="held inputs, order 1")
    axes.loglog(1e3 * steps, line, "s-", label="linear inputs, order 2")
    axes.set_xticks(1e3 * steps, [f"{1e3 * step:g}" for step in steps])
    axes.set_xticks([], minor=True)
    axes.set_xlabel("communication step, ms")
    axes.set_ylabel("largest error of the motor's angle, rad")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    figure.savefig(file, dpi=120)


def main() -> None:
    rows = errors()
    draw(rows, Path(__file__).with_name("coupled_fmus.png"))
    print("communication step   held inputs   linear inputs     (largest error of the motor's angle, rad)")
    for length, held, line in rows:
        print(f"{length * 1e3:15.1f} ms {held:13.2e} {line:15.2e}")
    (first, held, line), (last, held_last, line_last) = rows[0], rows[-1]
    orders = [np.log(a / b) / np.log(first / last) for a, b in ((held, held_last), (line, line_last))]
    print(f"orders: {orders[0]:.2f} with held inputs, {orders[1]:.2f} with linear ones")


if __name__ == "__main__":
    main()
