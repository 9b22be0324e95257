"""The cost of derivatives of a run against that of the run: a seven-axis arm, 24 parameters; or closed loops.

    python -m benchmarks.sensitivities [--steps 2000] [--repeats 7] [--method trapezoidal] [--loop car] [--quick]

Processor time of this process (user), medians of what is run alternately: the run alone, a gradient by adjoints, all
tangents, a Hessian. The gradient is held against the tangents first.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import sys
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import eomgen
from benchmarks.build_scenes import seven_bodies, wishbone_car
from eomgen.pipeline.model import Model

SCENE = Path(__file__).parents[1] / "examples" / "robot_arm" / "scene.toml"
STEP = 0.001


def arm() -> Model:
    """Return the arm with the masses and moments of its seven links tunable, 24 parameters."""
    data: dict[str, Any] = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    parameters: dict[str, Any] = data.setdefault("parameters", {})

    def tunable(name: str, value: float) -> str:
        parameters[name] = {"value": value, "tunable": True}
        return name

    for number, (name, body) in enumerate(data["bodies"].items()):
        body["mass"] = tunable(f"mass_{name}", body["mass"])
        for k, axis in enumerate("xyz"):
            if 3 * number + k < 17:
                body["center_of_mass"][k] = tunable(f"center_{axis}_{name}", body["center_of_mass"][k])
    return eomgen.build(data)


def loops(name: str) -> Model:
    """Return Andrews' mechanism in joint coordinates (``tree``) or of absolute bodies, or a four-bar linkage
    (``four_bar``), with the masses of three bodies tunable; or a car on wishbones with 3 parameters (``car``)."""
    four_bar = SCENE.parents[1] / "four_bar" / "scene.toml"
    made = {"car": wishbone_car, "four_bar": lambda: tomllib.loads(four_bar.read_text(encoding="utf-8"))}
    data: dict[str, Any] = made.get(name, seven_bodies)()
    if name != "car":
        data.setdefault("parameters", {})
        for body in list(data["bodies"])[:3]:
            data["parameters"][f"mass_{body}"] = {"value": data["bodies"][body]["mass"], "tunable": True}
            data["bodies"][body]["mass"] = f"mass_{body}"
    if name == "tree":
        del data["coordinates"]
    speed = "v.car[2]" if name == "car" else "v.crank_pin"
    return eomgen.build(data | {"outputs": {"flange": {"formula": [speed] * 3}}})


def seconds(call: Callable[[], object]) -> float:
    """Return the user time of a call."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    call()
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime - before


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--method", default="generalized_alpha")
    parser.add_argument("--quick", action="store_true", help="few steps, no times")
    parser.add_argument("--loop", choices=("tree", "absolute", "car", "four_bar"), help="closed loops instead")
    given = parser.parse_args(words)
    model = loops(given.loop) if given.loop else arm()
    steps = 40 if given.quick else given.steps
    size = model.library.layout["defaults"]["step"] if given.loop else STEP
    end = steps * size
    options: dict[str, Any] = {"method": given.method}
    if not given.loop:
        options["initial"] = {"v": [0.1, 0.2, 0.1, -0.2, 0.1, 0.3, 0.1]}
    off = difference(model, end, size, options)
    print(f"{len(model.parameters)} parameters: gradient and tangents differ by {off:.1e}")
    if given.quick:
        return 0
    calls: dict[str, Callable[[], object]] = {
        "run": lambda: model.simulate(end, size, error_estimate=False, **options).q,
        "gradient": lambda: model.sensitivities(end, size, **options).gradient("integral(flange[2])"),
        "tangents": lambda: model.sensitivities(end, size, **options).derivatives,
        "Hessian": lambda: model.sensitivities(end, size, **options).hessian("integral(flange[2])"),
    }
    if given.loop:  # starts that follow from parameters have no second derivatives
        del calls["Hessian"]
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(given.repeats):
        for name, call in calls.items():
            times[name].append(seconds(call))
    run = statistics.median(times["run"])
    print(f"{steps} steps, user time, medians of {given.repeats}")
    for name, values in times.items():
        median = statistics.median(values)
        print(f"{name:15} {1e6 * median / steps:8.2f} us/step   {median / run:6.2f} x the run")
    return 0


def difference(model: Model, end: float, step: float, options: dict[str, Any]) -> float:
    """Return how far the gradient of the last height is from the tangents' last row, by the largest of these."""
    found = model.sensitivities(end, step, **options)
    tangents = found.derivatives["flange"][-1, 2]
    return float(np.abs(found.gradients(["final(flange[2])"])[0] - tangents).max() / np.abs(tangents).max())


if __name__ == "__main__":
    sys.exit(main())
