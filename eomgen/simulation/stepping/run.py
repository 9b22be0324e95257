"""A validated run: the data for stepping, reporting and resuming it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.arrays import Array
from eomgen.compiled.corrected_start import CORRECTED, corrected_start
from eomgen.compiled.initial_state import InitialState, initial_state
from eomgen.errors import Problem, UsageError
from eomgen.integrators.methods import Method
from eomgen.integrators.stepper_layout import default_settings
from eomgen.simulation.stepping.controllers import Controllers
from eomgen.simulation.stepping.inputs import HeldRows, InputSignals, Signal, jumps_known, read_signals
from eomgen.simulation.stepping.time_grid import TimeGrid, time_grid
from eomgen.toolchain.library import Library

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: The start of a run unless the caller or the scene specifies another.
SCENE_START = "the scene's initial state"


@dataclass(frozen=True)
class Run:
    """What is stepped, how, with what, and from when to when.

    Attributes
    ----------
    name, method, settings : of the stepper
    parameters : (np,) tunable parameters
    signals : what drives the inputs
    grid : the times of the whole run
    every : steps between recorded rows
    corrections : how the initial state was brought onto the constraints
    begun : what the run starts from, in words
    controllers : the caller's functions that samples call; None where there are none
    """

    model: CompiledModel
    name: str
    method: Method
    settings: dict[str, float]
    parameters: Array
    signals: InputSignals
    grid: TimeGrid
    every: int
    corrections: Sequence[str] = ()
    begun: str = SCENE_START
    controllers: Controllers | None = None

    @property
    def takes_rows(self) -> bool:
        """Whether the stepper is handed rows of inputs: the compiled formulas do not say all of them."""
        return bool(self.signals.given or (self.signals.names and self.signals.formulas is None))

    @property
    def driven(self) -> Callable[[Array], Array] | None:
        """Rows of inputs for times; None where the compiled formulas say all of them."""
        if not self.takes_rows:
            return None
        row = self.signals.held
        return self.signals.table if row is None else HeldRows(row)


def scene_inputs(model: CompiledModel, p: Array) -> Callable[[Array], Array] | None:
    """Return what gives the scene's own inputs (n, nu) at times (n,), with parameters (np,) that were checked; None
    where it gives none."""
    if "inputs" not in model.functions:
        return None
    return lambda times: model.evaluator.formula_inputs({"t": times, "p": p})


def stored_run(
    model: CompiledModel,
    data: Mapping[str, Any],
    method: Method,
    library: Library,
    end: float,
    inputs: Mapping[str, Signal],
    controllers: Controllers | None = None,
) -> Run:
    """Return the run that a checkpoint or a solution describes, up to an end in s, with all its inputs."""
    settings = {name: float(data["settings"][name]) for name in default_settings(library.layout["method"])}
    p = model.parameter_array({name: data["parameters"][name] for name in model.parameters})
    start, step = float(data["t_start"]), settings["step"]
    grid = time_grid(start, end, step, library.real)
    given = read_signals(inputs, model.inputs, grid.steps)
    signals = InputSignals(model.inputs, given, scene_inputs(model, p), step, start, jumps_known(library))
    every, corrections = int(data["record_every"]), data.get("corrections", [])
    begun = data.get("start", SCENE_START)
    return Run(model, data["method"], method, settings, p, signals, grid, every, corrections, begun, controllers)


def start_description(*, equilibrium_start: bool, given: bool, chosen: str | None, of_scene: str) -> str:
    """Return what a run starts from in words.

    Parameters
    ----------
    equilibrium_start, given : whether it starts at static equilibrium, and whether initial values were given
    chosen, of_scene : ``start`` of the run, if any, and of the scene
    """
    if equilibrium_start:
        return "equilibrium near the initial values given" if given else "the scene's equilibrium"
    if not given:
        return SCENE_START if of_scene == "initial" else f"{SCENE_START}, not its equilibrium"
    instead = chosen is None and of_scene == "equilibrium"
    return "initial values given, in place of the scene's equilibrium" if instead else "initial values given"


def starts_at_equilibrium(start: str | None, given: bool, of_scene: str) -> bool:
    """Return whether a run starts at static equilibrium.

    Parameters
    ----------
    start, of_scene : of the run, if any, and of the scene
    given : whether an initial state was

    Raises
    ------
    UsageError
        It can start so at neither.
    """
    chosen = start if start is not None else "initial" if given else of_scene
    if chosen not in ("initial", "equilibrium"):
        hint = "initial={...}, for a state" if isinstance(chosen, Mapping) else "initial or equilibrium"
        raise UsageError(Problem("start", f"a run cannot start at {chosen!r}", hint))
    return chosen == "equilibrium"


def start_of(
    run: Run, initial: Mapping[str, Any] | None, *, equilibrium_start: bool, changed: bool
) -> tuple[InitialState, list[str], list[str]]:
    """Return the state a run starts from, a sentence for each change of the one that was asked for, and what is
    doubtful of it.

    Parameters
    ----------
    equilibrium_start : whether positions are those of static equilibrium nearby
    changed : whether the state or the parameters are others than those that the model was built with
    """
    model, p, t = run.model, run.parameters, run.grid.start
    state, sentences = initial_state(model, initial, p), []
    if not initial and p.tolist() == list(model.parameters.values()):
        sentences = [note for note in model.notes if note.startswith(CORRECTED)]
    notes: list[str] = []
    if equilibrium_start:
        inputs = run.driven(np.array([t]))[0] if run.driven else None
        from eomgen.analysis.equilibrium import equilibrium  # noqa: PLC0415  # SciPy comes with it

        found = equilibrium(model, {"q": state.q, "v": state.v, **({"z": state.z} if model.nz else {})}, p, t, inputs)
        v = np.where(found.v != 0.0, found.v, state.v)
        state, sentences = InitialState(found.q, v, found.z), [f"initial position: {found.message}"]
        notes = [f"the start at rest: {note}" for note in found.notes]
    if model.multipliers and (equilibrium_start or changed or t != 0.0):
        consistent = model.consistent(state.q, state.v, t, parameters=p)
        names, units = (model.q_names, model.v_names), (model.q_units, model.v_units)
        changes = corrected_start(consistent, (state.q, state.v), names, units)
        state = InitialState(consistent.q, consistent.v, state.z)
        sentences += [*consistent.corrections(), *changes, *consistent.deviations]
    elif changed:  # all rows may be left out
        sentences += model.check_left_out(state.q, state.v, t, p)
    return state, sentences, notes
