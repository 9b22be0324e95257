"""Solutions of runs: outcome attributes, evaluated at first use; a description of the run; rows of a motion that a
caller steps.

A sweep that reads last states alone so pays for no judgement. Every attribute follows from the run: rows, parameters,
and the stepper after the last step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.errors import Message
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.finding import Finding
from eomgen.results.solution import Solution
from eomgen.simulation.judgement.finished_run import FinishedRun
from eomgen.simulation.motions import Motions
from eomgen.simulation.run_model import RunModel, run_model
from eomgen.simulation.stepping.inputs import kind_of
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import states_of

if TYPE_CHECKING:
    from eomgen.simulation.judgement.register import Verdict


def run_metadata(run: Run) -> dict[str, Any]:
    """Return the part of a solution's ``metadata`` that is known before the run, as JSON data. Keys: scene, version,
    method, its parameters, kinds or numbers of inputs, settings, time grid, parameters, names and units of all columns,
    outputs, factors of the configuration, fingerprint and profile of the library."""
    model, layout = run.model, run.model.library.layout
    return {
        **run.summary,
        "version": layout["version"],
        "inputs": {
            name: kind_of(signal) if callable(signal) or isinstance(signal, np.ndarray) else signal
            for name, signal in run.signals.given.items()
        },
        "dense_output": run.method.dense_output,
        "step": run.settings["step"],
        **({"bounded_for": run.bounded_for} if run.bounded_for else {}),
        "names": {
            "q": model.q_names,
            "v": model.v_names,
            "a": [f"a{name[1:]}" for name in model.v_names],
            "multipliers": list(model.multipliers),
            "z": model.z_names,
        },
        "units": {
            "q": model.q_units,
            "v": model.v_units,
            "z": model.z_units,
            "inputs": {item["name"]: item["unit"] for item in layout["inputs"]},
            "outputs": {o["name"]: o["unit"] for o in layout["outputs"]},
        },
        "outputs": {
            output.name: {"description": output.description, "quantity": output.quantity}
            for output in model.description.outputs
        },
        "factors": [[f.group, f.q_start, f.q_size, f.v_start, f.v_size] for f in model.factors],
        "fingerprint": layout.get("fingerprint", ""),
        "profile": model.library.profile,
    }


class JudgedRun(FinishedRun):
    """A finished run with the attributes that its ``Solution`` has: stats, findings, success, message and metadata,
    each evaluated at first use by the checks of the register."""

    def solution(self, *, at_once: bool) -> Solution:
        """Return the run's Solution, whose outputs and judgement are evaluated at first use, or now if ``at_once``."""
        recorded = {
            **states_of(self.trajectory.rows, self.run.model)._asdict(),
            "interrupted": self.trajectory.interrupted,
            "events": self.events,
            "model": run_model(self.run, self.stepper.library, self.events, lambda: self._verdict.alike),
        }
        return Solution.later(recorded, self, at_once=at_once)

    @cached_property
    def _verdict(self) -> Verdict:
        from eomgen.simulation.judgement.register import Verdict  # noqa: PLC0415  # all checks, on request

        return Verdict(self)

    @cached_property
    def stats(self) -> dict[str, Any]:
        known = {} if self.balance.error is None else {"energy_error": self.balance.error}
        return {**self.statistics, **known, "wall_time": self.wall}

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        return self._verdict.findings

    @cached_property
    def success(self) -> bool:
        return self._verdict.success

    @cached_property
    def message(self) -> str:
        return self._verdict.message

    @cached_property
    def metadata(self) -> dict[str, Any]:
        """The description of the run: model, method, parameters, start, events, notes and energy balance."""
        from eomgen.simulation.judgement.register import UNCHECKED  # noqa: PLC0415  # on request
        from eomgen.simulation.judgement.starts import starts_beyond_limits  # noqa: PLC0415  # likewise

        run, beginning, events = self.run, self.beginning, self.events
        model = run.model
        notes = [*model.notes, *run.method.warnings(bool(model.multipliers))]
        if beginning is not None:
            of_scene = [*map(Message, starts_beyond_limits(model, model.initial_q, model.parameter_array()))]
            notes = [note for note in notes if note not in of_scene]
            at_start, of_call = (map(str, self._verdict.notes(label)) for label in ("start", "call"))
            notes += [*at_start, *beginning.notes, *of_call, *UNCHECKED]
        profile = self.stepper.library.profile
        return {
            **run_metadata(run),
            "profile": profile,
            **({} if events is None else {"events": events.to_dict()}),
            "corrections": run.corrections,
            "notes": [*map(Message, notes)],
            "energy_balance": str(self.balance),
        }


class RecordedRow(NamedTuple):
    """A row that a caller of a Simulator recorded: time in s, state, multipliers, inputs u (nu,) and parameters p
    (np,)."""

    t: float
    q: Array
    v: Array
    a: Array
    z: Array
    multipliers: Array
    u: Array
    p: Array


def recorded_solution(
    run: Run, rows: Sequence[RecordedRow], statistics: Mapping[str, Any], notes: Sequence[str], stopped: str
) -> Solution:
    """Return rows that a caller of a Simulator recorded as a Solution, with outputs and energies evaluated at the rows.
    Inputs are linear between rows, and there is no error estimate. `statistics` are the counts of the stepper, `notes`
    go into the metadata, and `stopped` describes the event that stopped the motion, or is empty."""
    model = run.model
    t, q, v, a, z, multipliers, u, p = map(np.array, zip(*rows, strict=True))
    base = model.base(t, parameters=p) if model.evaluator.moving_base else None
    arguments: dict[str, Any] = {"z": z, "multipliers": multipliers if model.multipliers else None}
    arguments |= {"parameters": p, "base": base}
    inputs = u if model.nu else None
    between = {name: partial(np.interp, xp=t, fp=u[:, k]) for k, name in enumerate(model.inputs)}
    signals = replace(run.signals, given=between)
    metadata = run_metadata(replace(run, parameters=p[-1], signals=signals))
    metadata |= {"start": "a caller's", "corrections": (), "notes": list(notes), "energy_balance": "not looked at"}
    last = f"{len(t)} recorded rows to t = {t[-1]:.6g} s"
    return Solution(
        *(t, q, v, a, z, multipliers),
        outputs=model.outputs(q, v, a, t, inputs, **arguments) if "outputs" in model.functions else {},
        energy=model.energy(q, v, a, t, inputs, **arguments) if "energy" in model.functions else {},
        stats=dict(statistics),
        message=f"{last}; the motion was {stopped}" if stopped else last,
        metadata=metadata,
        model=RunModel(model, p[-1], signals if model.nu else None, None, motions=Motions(model).between(t, p)),
        error=ErrorEstimate.missing("a motion that a caller steps is not run a second time"),
    )
