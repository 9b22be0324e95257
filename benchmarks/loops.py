"""CPU time of compiled time loops alone: the state is set before, nothing is recorded, and a run that stops says so."""

from __future__ import annotations

import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eomgen.integrators.stepper_layout import default_settings
from eomgen.pipeline.model import Model
from eomgen.simulation.stepping.stepper import Stepper

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Loop:
    """A timed run of the compiled loop.

    Attributes
    ----------
    steps : int
    seconds : CPU seconds of the loop, median of the repeats.
    spread : range of the repeats in units of the median.
    statistics : what the stepper counted.
    state : ``t, q, v, vdot`` and ``lam`` at the end.
    failure : why the run stopped early, empty when it did not.
    """

    steps: int
    seconds: float
    spread: float
    statistics: Mapping[str, int | float]
    state: Mapping[str, Array]
    failure: str = ""

    @property
    def microseconds(self) -> float:
        """CPU time per step."""
        return self.seconds / self.steps * 1e6

    def per_step(self, name: str) -> float:
        return float(self.statistics[name]) / self.steps


def stepper_of(model: Model, method: str, step: float, rho_inf: float, settings: Mapping[str, float]) -> Stepper:
    """Return the stepper of a method; ``settings`` that it does not know (an explicit method's tolerances) are left
    out."""
    library = model.library if model.library.layout["built_method"] == method else model.stepper(method)
    values = default_settings(library.layout["method"])
    given = {**settings, "step": step, "rho_inf": rho_inf}
    values |= {name: value for name, value in given.items() if name in values}
    return Stepper(library, values, model.parameter_array())


def timed(
    model: Model,
    method: str,
    duration: float,
    steps: int,
    *,
    rho_inf: float = 0.9,
    settings: Mapping[str, float] | None = None,
    repeats: int = 5,
    at_least: float = 0.0,
) -> Loop:
    """Run the loop ``repeats`` times, each of them again and again for ``at_least`` seconds."""
    stepper = stepper_of(model, method, duration / steps, rho_inf, settings or {})
    record = np.empty((2, stepper.sizes["row"]))
    found = []
    for _ in range(repeats):
        total, calls = 0.0, 0
        while not calls or total < at_least:
            status = stepper.initialize(0.0, model.initial_q, model.initial_v, None)
            start = time.thread_time()
            status = status or stepper.run(steps, steps + 1, None, record)[0]
            total, calls = total + time.thread_time() - start, calls + 1
            if status:
                done = int(stepper.state[stepper.places["count"]][0])
                text = f"stopped after {done} of {steps} steps: {stepper.status_text(status)}"
                return Loop(steps, float("nan"), 0.0, stepper.statistics, {}, text)
        found.append(total / calls)
    middle = statistics.median(found)
    row = stepper.row
    state = {name: row[place] for name, place in stepper.row_places.items()}
    return Loop(steps, middle, (max(found) - min(found)) / middle, stepper.statistics, state)
