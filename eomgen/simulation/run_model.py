"""The model of a solution, with a run's inputs and parameters: outputs, linear models, poses, states between rows.

A run hands the model to its solution. A solution from a file or from another process gets the model back by ``attach``.

A solution keeps rows only. A series from a row is the polynomial of the step that begins there, and if the spacing of
rows is longer than the reach of one series, the stepper goes on to the next one by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.base.data import dataclass
from eomgen.compiled.beams import SectionLoads, section_loads
from eomgen.compiled.coordinates import StateArrays
from eomgen.compiled.model import CompiledModel
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.integrators.families.register import method_named
from eomgen.results.dense_output import Between, Index, Rows
from eomgen.results.events import Events
from eomgen.results.poses import PosesAndScenery, poses_and_scenery
from eomgen.results.solution import Solution
from eomgen.simulation.motions import RecordedMotions
from eomgen.simulation.stepping.controllers import CallerControllers, called_by
from eomgen.simulation.stepping.events import parameters_over
from eomgen.simulation.stepping.inputs import InputSignals, Signal, signals_by_name
from eomgen.simulation.stepping.run import Run, stored_run
from eomgen.simulation.stepping.settings import stepper_library
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.toolchain.library import Library

if TYPE_CHECKING:
    from eomgen.results.finding import Finding


@dataclass(frozen=True)
class StepsBetween:
    """Function of states between the rows of a run: each state is the end of one step from the row before.

    Attributes
    ----------
    library : with the compiled stepper
    settings : of the stepper, by name
    parameters : function from times to parameters, (..., np), with the modes of events
    signals : inputs of the run; None if the compiled code evaluates all inputs
    controllers : the caller's functions; None without any
    """

    library: Library
    settings: Mapping[str, float]
    parameters: Callable[[Array], Array]
    signals: InputSignals | None
    controllers: CallerControllers | None = None

    def __call__(self, rows: Rows, t: Array, index: Index) -> tuple[Array, Array, Array, Array]:
        """Return q, v, a and z at times t (n,) in s, with shapes (n, nq), (n, nv), (n, nv) and (n, nz).

        Each state comes from a step that starts at the last row before its time; `index` (n,) has the rows before the
        times, except that a time on the next row has that row's values. Times up to the row's time have the row's
        values.

        Raises
        ------
        NumericalError
            The step cannot be taken.
        """
        stepper = Stepper(self.library, self.settings, self.parameters(rows.t[0]), self.controllers)
        record = np.empty((len(t), stepper.sizes["row"]))
        q, v, a, z = (record[:, stepper.row_places.get(name, slice(0))] for name in ("q", "v", "vdot", "z"))
        for k, (time, before) in enumerate(zip(t, index, strict=True)):
            row = before + 1 if time >= rows.t[before + 1] else before
            start = float(rows.t[row])
            if time <= start:
                q[k], v[k], a[k], z[k] = rows.q[row], rows.v[row], rows.a[row], rows.z[row]
                continue
            stepper.settings[0] = float(time) - start
            present = self.parameters(rows.t[row])
            stepper.parameters[: len(present)] = present
            times = start + stepper.settings[0] * stepper.input_times
            is_constant = stepper.layout["method"]["inputs"] != "sampled"
            table = None if self.signals is None else self.signals.table(np.full(2, start) if is_constant else times)
            status = stepper.initialize(start, rows.q[row], rows.v[row], table, rows.z[row])
            if not status:
                status, _ = stepper.run(1, 1, table, record[k : k + 1])
            if status:
                fault = f"no state at t = {time:.9g} s: {stepper.status_text(status)} [E2023]"
                raise NumericalError(fault, "times of rows")
        return q, v, a, z


def between_of(run: Run, library: Library, events: Events | None) -> StepsBetween | None:
    """Return the function of states between the rows of a run with these events. None if the method's states between
    rows are interpolated, or if a controller's function of the caller is not there or keeps memory that the scene does
    not declare."""
    if run.method.dense_output != "steps":
        return None
    called = called_by(library.layout)
    if called and (run.controllers is None or run.controllers.undeclared_names):
        return None
    present = partial(parameters_over, events, run.model, run.parameters)
    return StepsBetween(library, run.settings, present, run.signals if run.takes_rows else None, run.controllers)


@dataclass(frozen=True)
class RunModel:
    """A model with the data of one run, by which a solution evaluates outputs, poses and states between rows.

    Attributes
    ----------
    parameters : (np,) of the run
    signals : inputs of the run; None if formulas of the scene give all inputs
    between : function of states between rows; None: interpolation
    events : recorded events, which change modes among the parameters
    motions : motions that a caller prescribed from step to step; their parameters depend on time
    alike : returns the findings that runs with other steps share
    """

    model: CompiledModel
    parameters: Array
    signals: InputSignals | None
    between: Between | None
    events: Events | None = None
    motions: RecordedMotions | None = None
    alike: Callable[[], Sequence[Finding]] = tuple

    @property
    def has_poses(self) -> bool:
        """Whether the model's library has the function of poses, so that no compilation is needed."""
        return "poses" in self.model.functions

    def poses_and_scenery(self, t: Array, q: Array) -> PosesAndScenery:
        """Return poses at times (nt,) and configurations (nt, nq), with the scenery of a picture."""
        p = self.parameters if self.motions is None else self.motions(t)
        return poses_and_scenery(self.model, t, q, p, self.inputs)

    def inputs(self, t: Array) -> dict[str, Array]:
        """Return the inputs at times (nt,), name -> (nt,)."""
        model = self.model
        if not model.nu:
            return {}
        p = self.present(t)
        table = model.input_values(t, parameters=p) if self.signals is None else self.signals.rows(t)
        return dict(zip(model.inputs, np.ascontiguousarray(table.T), strict=True))

    def given_at(self, state: StateArrays) -> tuple[Array | None, Array]:
        """Return inputs (..., nu) and parameters, both at the times (...) of a state; inputs are None if formulas give
        all."""
        if self.signals is None:
            return None, self.present(state.t)
        u = self.signals.rows(state.t.ravel()).reshape(*state.t.shape, self.model.nu)
        return u, self.present(state.t)

    def outputs(self, state: StateArrays) -> dict[str, Array]:
        """Return the outputs of a state at times (...), with the inputs of the run at these times."""
        u, p = self.given_at(state)
        return self.model.outputs(state.q, state.v, state.a, state.t, u, z=state.z, parameters=p)

    def section_loads(self, state: StateArrays, multipliers: Array) -> Mapping[str, SectionLoads]:
        """Return strains and loads along the geometrically exact beams by name, at states with constraint multipliers
        (nt, rows)."""
        u, p = self.given_at(state)
        arguments = {"a": state.a, "z": state.z, "multipliers": multipliers, "parameters": p}
        return section_loads(self.model, state.q, state.v, state.t, u, **arguments)

    def present(self, t: Array) -> Array:
        """Return the parameters at times, with modes."""
        if self.motions is not None:
            return self.motions(t)
        return parameters_over(self.events, self.model, self.parameters, t)


def run_model(
    run: Run, library: Library, events: Events | None, alike: Callable[[], Sequence[Finding]] = tuple
) -> RunModel:
    """Return the model of a run whose steps a library takes."""
    signals = run.signals if run.takes_rows else None
    return RunModel(run.model, run.parameters, signals, between_of(run, library, events), events, alike=alike)


@checked_call(u="inputs", run="solution")
def attach(model: CompiledModel, solution: Solution, inputs: Mapping[str, Signal] | None = None) -> Solution:
    """Return a copy of a solution that has this model, so that outputs, poses and linear models can be evaluated again.

    Parameters
    ----------
    solution : Solution
        From a file or from another process.
    inputs : mapping
        The functions of t and the tables that drove the run; a solution holds the numbers.

    Returns
    -------
    Solution
        The same rows, with ``outputs_at``, ``linearize`` and poses.

    Raises
    ------
    ModelError
        The solution is one of another model.
    UsageError
        Inputs that are missing, or that the run did not have; a solution that ``simulate`` did not make.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> path = model.simulate(0.1, 1e-3).save("run.npz")
    >>> run = model.attach(eomgen.Solution.load(path))
    >>> run.outputs_at(0.05)["tip"].shape
    (3,)
    """
    if not isinstance(solution, Solution):
        fault = f"a solution is needed, not {type(solution).__name__} [E2170]"
        raise UsageError(Problem("attach", fault, "model.attach(eomgen.Solution.load(path))"))
    data = solution.metadata
    missing = [name for name in ("scene", "fingerprint", "method_parameters", "inputs") if name not in data]
    if missing:
        fault = f"the solution does not say of which run it is ({missing[0]} is missing): by hand, or older [E2024]"
        raise UsageError(Problem("attach", fault, "a solution of simulate"))
    if data["fingerprint"] != model.library.layout.get("fingerprint"):
        origin = f"another model {model.name!r}: the scene or eomgen changed"
        if data["scene"] != model.name:
            origin = f"the scene {data['scene']!r}, the model is {model.name!r}"
        fault = f"this is a solution of {origin} [E2025]"
        raise ModelError(Problem("attach", fault, "the model that made it, or a new run"))
    method = method_named(data["method"], **data["method_parameters"])
    library = stepper_library(model, data["method"], method)
    signals = _inputs(data["inputs"], signals_by_name(inputs, model.inputs))
    run = stored_run(model, data, method, library, float(data["t_end"]), signals)
    return solution.with_model(run_model(run, library, solution.events if solution.events.counts else None))


def _inputs(run_inputs: Mapping[str, Any], caller_inputs: Mapping[str, Any]) -> dict[str, Signal]:
    """Return the inputs of a run by name, from the solution and from the caller. `run_inputs` has, by name, the number
    that the solution holds, or the kind (``function`` or ``table``) of an input that the caller has to give again in
    `caller_inputs`. Raises UsageError for all inputs that are missing, differ from the run's number, or were left to
    the scene in the run."""
    problems = []
    for name, value in run_inputs.items():
        if isinstance(value, str) and name not in caller_inputs:
            fault = f"the run had a {value} here, which a solution does not hold [E2026]"
            problems.append(Problem(f"input {name}", fault, f"the same again: inputs={{{name!r}: ...}}"))
        elif not isinstance(value, str) and name in caller_inputs and not np.array_equal(caller_inputs[name], value):
            problems.append(Problem(f"input {name}", f"the run had {value:.9g} here [E2027]", "leave it out"))
    of_scene = [name for name in caller_inputs if name not in run_inputs]
    fault = "the run followed the scene here [E2008]"
    problems += [Problem(f"input {name}", fault, "leave it out") for name in of_scene]
    if problems:
        raise UsageError(problems)
    return {**{name: value for name, value in run_inputs.items() if not isinstance(value, str)}, **caller_inputs}
