"""States of a run: its start (initial values or static equilibrium, brought onto the constraints), and states at its
rows, with compiled functions evaluated at them in batches: outputs and energies.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.equations import motion_values
from eomgen.compiled.initial_state import (
    InitialState,
    corrected_start,
    initial_state,
    kept_components,
    starts_of,
)
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.model import consistent as consistent_state
from eomgen.errors import Message, Problem, UsageError
from eomgen.lie.product import turned
from eomgen.results.dense_output import BATCH
from eomgen.simulation.stepping.inputs import InputSignals
from eomgen.simulation.stepping.run import Run
from eomgen.system.description import CORRECTED, LOST, OVERRIDDEN, STRAINED


class States(NamedTuple):
    """States at rows: t (n,) s, q (n, nq), v (n, nv), a (n, nv), multipliers (n, rows of constraints), z (n, nz)."""

    t: Array
    q: Array
    v: Array
    a: Array
    multipliers: Array
    z: Array


class PrescribedInputs(NamedTuple):
    """Inputs u (n, nu) and the state of the base (n, 19) at rows; None if there are none."""

    u: Array | None
    base: Array | None


def states_of(rows: Array, model: CompiledModel, *, views: bool = False) -> States:
    """Return the states in rows (n, width) of a run, each in a separate array, or as views, which take no memory."""
    sizes, width = model.functions.sizes, rows.shape[1]
    nv, v = sizes["v"], 1 + sizes["q"]
    a, multipliers, z = v + nv, v + 2 * nv, width - sizes["z"]
    parts = (rows[:, 0], rows[:, 1:v], rows[:, v:a], rows[:, a:multipliers], rows[:, multipliers:z], rows[:, z:])
    if views:
        return States(*parts)
    t, positions, velocities, accelerations, lam, states = parts  # without a loop, which costs a call
    return States(t.copy(), positions.copy(), velocities.copy(), accelerations.copy(), lam.copy(), states.copy())


def inputs_at_rows(model: CompiledModel, t: Array, p: Array, signals: InputSignals | None) -> PrescribedInputs:
    """Return inputs and the base at times (n,); evaluated once, since a road of many harmonics costs more than all else
    of a row.

    Parameters
    ----------
    p : (np,) or (n, np) parameters
    signals : signals of the inputs; None: the scene's formulas
    """
    u, drivers = None, {"t": t, "p": p}  # parameters of the run, checked at its beginning
    if model.nu:
        u = model.evaluator.formula_inputs(drivers) if signals is None else signals.rows(t)
    return PrescribedInputs(u, model.evaluator.functions("base", drivers)[0] if model.evaluator.moving_base else None)


def row_values(name: str, model: CompiledModel, states: States, inputs: PrescribedInputs, p: Array) -> dict[str, Array]:
    """Return the outputs, or the energies, at all rows by name, (n, ...); empty if the model was built without the
    term.

    Parameters
    ----------
    name : ``outputs`` or ``energy``
    inputs : inputs and base at the rows
    p : (np,) or (n, np) parameters
    """
    if name not in model.functions:
        return {}
    result: list[Mapping[str, Array]] = []
    t, q, v, a, multipliers, z = states
    blocks = {"t": t, "q": q, "v": v, "a": a, "lam": multipliers, "z": z, "u": inputs.u, "base": inputs.base, "p": p}
    for start in range(0, len(t), BATCH):
        part = slice(start, start + BATCH)
        whole = {"p": p} if p.ndim == 1 else {}
        there = {name: block[part] for name, block in blocks.items() if block is not None} | whole
        result.append(motion_values(model, name, there))
    if len(result) == 1:
        return dict(result[0])
    return {key: np.concatenate([batch[key] for batch in result]) for key in result[0]} if result else {}


def starts_at_equilibrium(start: str | None, has_state: bool, of_scene: str) -> bool:
    """Return whether a run starts at static equilibrium.

    Parameters
    ----------
    start, of_scene : of the run, if any, and of the scene
    has_state : whether an initial state was given

    Raises
    ------
    UsageError
        The run can start at neither.
    """
    chosen = start if start is not None else "initial" if has_state else of_scene
    if not isinstance(chosen, str) or chosen not in ("initial", "equilibrium"):
        hint = "initial={...}, for a state" if isinstance(chosen, Mapping) else "initial or equilibrium"
        raise UsageError(Problem("start", f"a run cannot start at {chosen!r} [E2077]", hint))
    return chosen == "equilibrium"


def start_of(
    run: Run, initial: Mapping[str, Any] | None, *, equilibrium_start: bool, changed: bool
) -> tuple[InitialState, list[Message], list[str]]:
    """Return the initial state of a run on the constraints, a message for each change, and notes on doubts.

    Parameters
    ----------
    initial : values by name that the caller gives; None for the scene's
    equilibrium_start : whether to start at static equilibrium nearby
    changed : whether the state or the parameters differ from the values that the model was built with
    """
    model, p, t = run.model, run.parameters, run.grid.start
    is_scene_start = not initial and p.tolist() == list(model.parameters.values())
    state, sentences = initial_state(model, initial, p, asked=not (is_scene_start or equilibrium_start)), list[str]()
    if is_scene_start:
        sentences = [note for note in model.notes if note.code in (CORRECTED, LOST, STRAINED)]
    notes: list[str] = []
    if equilibrium_start:
        inputs = run.driven(np.array([t]))[0] if run.driven else None
        from eomgen.compiled.rest.equilibrium import equilibrium  # noqa: PLC0415  # SciPy comes with it

        rest = equilibrium(model, {"q": state.q, "v": state.v, **({"z": state.z} if model.nz else {})}, p, t, inputs)
        v = np.where(rest.v != 0.0, rest.v, turned(model.factors, state.v, state.q, rest.q))
        state, sentences = InitialState(rest.q, v, rest.z), [f"initial position: {rest.message}"]
        notes = [f"the start at rest: {Message(note).line}" for note in rest.notes]
    if model.multipliers and (equilibrium_start or changed or t != 0.0):
        starts = () if equilibrium_start else starts_of(model, initial)
        components = kept_components(model.factors, starts)
        consistent = consistent_state(model, state.q, state.v, t, p, kept=components)
        names, units = (model.q_names, model.v_names), (model.q_units, model.v_units)
        freedoms = model.nv - len(model.multipliers)
        guess = (state.q, state.v)
        changes = corrected_start(consistent, guess, names, units, freedoms=freedoms, starts=starts)
        state = InitialState(consistent.q, consistent.v, state.z)
        sentences += [*consistent.corrections(given=bool(initial)), *changes, *consistent.deviations]
    elif changed:  # all rows may be left out
        sentences += model.check_left_out(state.q, state.v, t, p)
    corrections = [*map(Message, sentences)]
    return state, corrections, [*notes, *(text for text in corrections if text.code in (LOST, OVERRIDDEN, STRAINED))]
