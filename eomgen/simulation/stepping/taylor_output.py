"""States between samples by the method itself: a Taylor step from the sample before, to the tolerance of the run.

A solution keeps rows only. A series from a row is the polynomial of the step that begins there, and if the spacing of
rows is longer than the reach of one series, the stepper goes on to the next one by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import NumericalError
from eomgen.results.dense_output import Index, Rows
from eomgen.results.events import Events
from eomgen.simulation.stepping.controllers import Controllers, called_by
from eomgen.simulation.stepping.events import parameters_over
from eomgen.simulation.stepping.inputs import InputSignals
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.toolchain.library import Library


@dataclass(frozen=True)
class StepsBetween:
    """Steps from rows, with the settings, inputs and parameters of a run, the latter for times, modes among them."""

    library: Library
    settings: Mapping[str, float]
    parameters: Callable[[Array], Array]
    signals: InputSignals | None
    controllers: Controllers | None = None

    def __call__(self, rows: Rows, t: Array, index: Index) -> tuple[Array, Array, Array, Array]:
        """Return q, v, a and z at times t (n,), each by a step from the row of its index.

        Raises
        ------
        NumericalError
            The step cannot be taken.
        """
        stepper = Stepper(self.library, self.settings, self.parameters(rows.t[0]), self.controllers)
        record = np.empty((len(t), stepper.sizes["row"]))
        q, v, a, z = (record[:, stepper.row_places.get(name, slice(0))] for name in ("q", "v", "vdot", "z"))
        for place, (time, before) in enumerate(zip(t, index, strict=True)):
            row = before + 1 if time >= rows.t[before + 1] else before
            start = float(rows.t[row])
            if time <= start:
                q[place], v[place], a[place], z[place] = rows.q[row], rows.v[row], rows.a[row], rows.z[row]
                continue
            stepper.settings[0] = float(time) - start
            present = self.parameters(rows.t[row])
            stepper.parameters[: len(present)] = present
            times = start + stepper.settings[0] * stepper.input_times
            held = stepper.layout["method"]["inputs"] != "sampled"
            table = None if self.signals is None else self.signals.table(np.full(2, start) if held else times)
            status = stepper.initialize(start, rows.q[row], rows.v[row], table, rows.z[row])
            if not status:
                status, _ = stepper.run(1, 1, table, record[place : place + 1])
            if status:
                raise NumericalError(f"no state at t = {time:.9g} s: {stepper.status_text(status)}", "times of rows")
        return q, v, a, z


def between_of(run: Run, library: Library, events: Events | None) -> StepsBetween | None:
    """Return the function of states between the rows of a run with these events; None if they are interpolated."""
    if run.method.dense_output != "steps":
        return None
    called = called_by(library.layout)
    if called and (run.controllers is None or run.controllers.undeclared):
        return None
    present = partial(parameters_over, events, run.model, run.parameters)
    return StepsBetween(library, run.settings, present, run.signals if run.takes_rows else None, run.controllers)
