"""Steps of eomgen alone: of one trajectory, or of an ensemble with and without vector lanes."""

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from serve import Prepared, serve

from benchmarks import beam_simulations, generation_time, loops

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


def one_trajectory(task: dict[str, Any]) -> Prepared:
    import eomgen

    model = eomgen.build(EXAMPLES / task["example"] / "scene.toml", method="generalized_alpha")
    steps, step = task["steps"], task["step"]
    found = loops.timed(model, "generalized_alpha", steps * step, steps, repeats=1)
    if found.failure:
        raise RuntimeError(found.failure)

    def taken() -> float:
        return loops.timed(model, "generalized_alpha", steps * step, steps, repeats=1).seconds

    note = f"{steps} steps of {step:g} s, {found.per_step('newton_iterations'):.2f} iterations"
    return Prepared(list, steps, lambda: np.isfinite(found.state["q"]), ["eomgen"], note, taken)


def ensemble(task: dict[str, Any]) -> Prepared:
    import eomgen

    os.environ["EOMGEN_LANES"] = task["lanes"]
    model = eomgen.build(EXAMPLES / task["example"] / "scene.toml", method="generalized_alpha")
    samples, steps, step = task["samples"], task["steps"], task["step"]
    start = task["around"] * np.linspace(0.9, 1.0, samples)

    def run() -> Any:
        return model.simulate_many(
            steps * step, step, table={task["varied"]: start}, method="generalized_alpha", points=2, workers=1,
            columns=[task["column"]],
        )  # fmt: skip  # options of one call

    found = run()
    if found.failed:
        raise RuntimeError(f"{len(found.failed)} samples failed")
    results = found.results[f"{task['column']}.final"]
    note = f"{samples} samples, {steps} steps"
    return Prepared(run, samples * steps, lambda: results, ["eomgen"], note)


def first_build(_: dict[str, Any]) -> Prepared:
    """Seconds of the clock from a URDF to a loaded library with partials and stepper, from an empty cache."""
    case = generation_time.CASES["panda-partials"]

    def taken() -> float:
        with tempfile.TemporaryDirectory() as folder:
            told = {"what": "first build", "case": case, "cache": Path(folder), "profile": "fast"}
            generation_time.in_process(**told, mark="warm")  # the wrapper that all models share
            return generation_time.in_process(**told, mark="measured")["wall"]

    return Prepared(list, 1, lambda: [1.0], ["eomgen"], taken=taken)


def beam_simulation(task: dict[str, Any]) -> Prepared:
    """Seconds of the clock of the command ``simulate`` on a beam, from an empty cache or with its library there."""

    def taken() -> float:
        return beam_simulations.first_and_second(task["elements"])[task["case"]]["wall, s"]

    return Prepared(list, 1, lambda: [1.0], ["eomgen"], taken=taken)


WORK = {"one": one_trajectory, "ensemble": ensemble, "build": first_build, "simulate": beam_simulation}


if __name__ == "__main__":
    serve(lambda task: WORK[task["work"]](task))
