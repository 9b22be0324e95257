"""What a run came to, each part evaluated when it is first asked for: outputs, energies, verdict, error estimate.

A sweep that reads last states alone so pays for no judgement. What a part is evaluated from is the run's own: its rows,
its parameters, and the stepper as it was left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from eomgen.analysis.bending import Bending, largest_bending
from eomgen.analysis.definiteness import linear_range_exceeded
from eomgen.arrays import Array
from eomgen.compiled.initial_state import InitialState
from eomgen.integrators.events import STOPPED
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.solution import Solution
from eomgen.simulation.accuracy.error_estimation import ErrorEstimation, no_estimate
from eomgen.simulation.checkpoint import CheckpointWriter
from eomgen.simulation.judgement.constraint_violation import Violation, largest_violation
from eomgen.simulation.judgement.diagnosis import failure
from eomgen.simulation.judgement.doubtful_calls import doubtful_call
from eomgen.simulation.judgement.end_message import message_of
from eomgen.simulation.judgement.energy_balance import APART, FAILED, REPORTED, Balance, energy_balance
from eomgen.simulation.judgement.fast_laws import fast_laws
from eomgen.simulation.judgement.fast_motions import unresolved_motion
from eomgen.simulation.judgement.impact_starts import impacts_at_start
from eomgen.simulation.judgement.instability import at_rest, unstable_growth
from eomgen.simulation.judgement.momentum import momentum_drift
from eomgen.simulation.judgement.motion_between_rows import untold_between_rows
from eomgen.simulation.judgement.singular_positions import nearest_singular, not_followed, passages, way_through
from eomgen.simulation.judgement.spring_lengths import passed_springs
from eomgen.simulation.judgement.turned_elements import turned_elements
from eomgen.simulation.judgement.unbounded_growth import unbounded_growth
from eomgen.simulation.judgement.unit_quaternions import largest_stretch
from eomgen.simulation.judgement.warnings import (
    LARGE_ERROR,
    run_warnings,
    starts_beyond_limits,
    undefined_outputs,
    unresolved_damping,
    unresolved_states,
)
from eomgen.simulation.run_metadata import run_metadata
from eomgen.simulation.run_model import run_model
from eomgen.simulation.stepping.chunks import Trajectory
from eomgen.simulation.stepping.events import acting, parameters_over, table_of
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.settings import followed_laws
from eomgen.simulation.stepping.states import Prescribed, States, evaluated, prescribed, states_of
from eomgen.simulation.stepping.step_parts import step_parts
from eomgen.simulation.stepping.stepper import Stepper

#: What to try where a run passes over events.
_SHORTER = "try: a step smaller than {step:.3g} s, in each of which events are looked for"


class Beginning(NamedTuple):
    """What there may be to say about the start of a run.

    Attributes
    ----------
    state : where it starts
    equilibrium : whether that is static equilibrium
    doubts : about this equilibrium, and initial values that are not taken
    choice : why the method was chosen, where it was
    notes : on the state that the caller gives
    """

    state: InitialState
    equilibrium: bool
    doubts: Sequence[str]
    choice: str = ""
    notes: Sequence[str] = ()


class Outcome:
    """What a run came to: attributes of its ``Solution``, evaluated when they are first asked for.

    Parameters
    ----------
    stepper : as the run left it
    wall : s, the time that the steps took
    writer : of checkpoints, if any
    estimation : of the discretisation error, if wanted
    beginning : None where a run was resumed
    """

    def __init__(
        self,
        run: Run,
        stepper: Stepper,
        trajectory: Trajectory,
        wall: float,
        writer: CheckpointWriter | None = None,
        estimation: ErrorEstimation | None = None,
        beginning: Beginning | None = None,
    ) -> None:
        self._run, self._stepper, self._trajectory = run, stepper, trajectory
        self._wall, self._writer, self._estimation, self._beginning = wall, writer, estimation, beginning
        self._events = table_of(trajectory, stepper, run.parameters)

    def solution(self, *, at_once: bool) -> Solution:
        """Return the solution; ``at_once``: with all of it evaluated."""
        states, events = states_of(self._trajectory.rows, self._run.model), self._events
        recorded = {
            **states._asdict(),
            "interrupted": self._trajectory.interrupted,
            "events": events,
            "model": run_model(self._run, self._stepper.library, events),
        }
        return Solution.later(recorded, self, at_once=at_once)

    # -- attributes of the solution ------------------------------------------------------------------------------------

    @cached_property
    def outputs(self) -> dict[str, Array]:
        return evaluated("outputs", self._run.model, self._states, self._prescribed, self._present)

    @cached_property
    def energy(self) -> dict[str, Array]:
        return evaluated("energy", self._run.model, self._states, self._prescribed, self._present)

    @cached_property
    def stats(self) -> dict[str, Any]:
        balance = self._balance
        known = {} if balance.error is None else {"energy_error": balance.error}
        return {**self._statistics, **known, "wall_time": self._wall}

    @cached_property
    def success(self) -> bool:
        if not self._complete or self._fault or self._turned:
            return False
        sparse = self._rows_are_sparse  # these may miss a pulse of power
        bending = self._bending
        return (self._balance.gain <= FAILED or (sparse and not self._conservative)) and (
            bending is None or bending.possible
        )

    @cached_property
    def message(self) -> str:
        run, beginning = self._run, self._beginning
        layout = run.model.library.layout
        of_method = run.method.warnings(bool(run.model.multipliers))
        badly_followed = followed_laws(run.model, run.method, run.parameters, run.grid)[1]
        message = "; ".join((self._judged, *layout["warnings"], *of_method, *badly_followed))
        if beginning is None:
            return message
        at_start = (*self._unresolved, *self._beyond_limits, *self._impacts, *beginning.doubts, beginning.choice)
        return "; ".join(filter(None, (message, *at_start)))

    @cached_property
    def metadata(self) -> dict[str, Any]:
        run, beginning = self._run, self._beginning
        model, events = run.model, self._events
        notes = [*model.notes, *run.method.warnings(bool(model.multipliers))]
        if beginning is not None:
            of_scene = starts_beyond_limits(model, model.initial_q, model.parameter_array())
            notes = [*(note for note in notes if note not in of_scene), *self._beyond_limits, *self._impacts]
            notes += [*([beginning.choice] if beginning.choice else []), *beginning.notes]
            notes += doubtful_call(model, run.grid, run.signals.given)
        return {
            **run_metadata(run),
            **({} if events is None else {"events": events.described()}),
            "start": run.begun,
            "corrections": run.corrections,
            "notes": notes,
            "energy_balance": str(self._balance),
        }

    @cached_property
    def error(self) -> ErrorEstimate:
        run, trajectory = self._run, self._trajectory
        if self._estimation is None:
            return no_estimate(run)
        found = self._estimation.of(run, self._stepper.library, trajectory, self._present, self._wall, self._events)
        if not found.available:
            return found
        statistics = self._statistics
        taken = statistics.get("own_steps") or statistics.get("expansions") or max(trajectory.steps, 1)
        average = (float(self._states.t[-1]) - run.grid.start) / taken
        fast = unresolved_motion(run, trajectory.rows, average, self._events, self._changes, self._jumps)
        return replace(found, unresolved=fast)

    # -- what they are made from ---------------------------------------------------------------------------------------

    @cached_property
    def _states(self) -> States:
        return states_of(self._trajectory.rows, self._run.model)

    @cached_property
    def _present(self) -> Array:
        """Parameters at the rows, (np,), or (n, np) where modes change."""
        return parameters_over(self._events, self._run.model, self._run.parameters, self._states.t)

    @cached_property
    def _prescribed(self) -> Prescribed:
        run = self._run
        return prescribed(run.model, self._states.t, self._present, run.signals if run.takes_rows else None)

    @cached_property
    def _last_run(self) -> Run:
        """The run with the parameters at its end."""
        run, t = self._run, self._trajectory.rows[-1, 0]
        return replace(run, parameters=parameters_over(self._events, run.model, run.parameters, t))

    @property
    def _ended(self) -> bool:
        """Whether no step failed."""
        return self._trajectory.status in (0, STOPPED.number)

    @property
    def _complete(self) -> bool:
        return self._ended and not self._trajectory.interrupted and self._trajectory.failure is None

    @cached_property
    def _statistics(self) -> dict[str, int | float]:
        return self._stepper.statistics if self._ended or self._trajectory.steps else {}

    @cached_property
    def _changes(self) -> Array:
        """Times of the events that changed the motion, s."""
        return acting(self._events, self._stepper.layout)

    @cached_property
    def _jumps(self) -> Array:
        """Times at which forces jump, s."""
        t = self._states.t
        known = self._run.model.jumps_between(t, 1e-9 * (float(np.abs(t).max()) + 1.0))
        return np.concatenate([known, self._changes])

    @property
    def _conservative(self) -> bool:
        return bool(self._run.model.library.layout["facts"]["conservative"]) and not len(self._changes)

    @property
    def _rows_are_sparse(self) -> bool:
        """Whether there are steps between the rows."""
        return self._run.every > 1 or self._run.method.chooses_steps

    @cached_property
    def _at_rest(self) -> bool:
        return at_rest(self._run, self._trajectory.rows)

    @cached_property
    def _balance(self) -> Balance:
        single = self._run.model.library.real == "float"
        balance = energy_balance(
            self._states.t,
            self.energy,
            self._jumps,
            conservative=self._conservative,
            sparse=self._rows_are_sparse,
            epsilon=float(np.finfo(np.float32 if single else np.float64).eps),
        )
        off = balance.error is not None and balance.error > REPORTED
        working = off and any(np.any(self.energy[name]) for name in ("power", "base_power"))  # else rows tell all of it
        if working and self._rows_are_sparse and untold_between_rows(self._states, self._run.model.factors):
            return Balance(None, APART)
        return Balance(0.0) if off and self._at_rest else balance

    @cached_property
    def _violation(self) -> Violation | None:
        model, t, q = self._run.model, self._states.t, self._states.q
        largest = self._statistics.get("max_constraint", 0.0)
        found = largest_violation(model, t, q, self._run.parameters, largest), largest_stretch(model, t, q)
        return max(filter(None, found), key=lambda one: one.share, default=None)

    @cached_property
    def _bending(self) -> Bending | None:
        return largest_bending(self._run.model, self._states.t, self._states.q)

    @cached_property
    def _turned(self) -> str:
        return turned_elements(self._run.model, self._states.t, self._states.q, self._run.parameters)

    @cached_property
    def _fault(self) -> str:
        """Why a run that came to its end follows no equations; empty where it may follow them."""
        growth = unstable_growth(self._last_run, self._stepper.library, self._trajectory)
        return failure(growth, self._balance, self.energy, self._run.method, self._violation)

    @property
    def _without_multipliers(self) -> bool:
        """Whether multipliers are zero at all rows, so that rounding is no part of anything."""
        return not np.any(self._states.multipliers)

    @property
    def _longest_part(self) -> float:
        """The longest part of a step, s, however long the steps are: a step longer than that changes nothing."""
        method, times = self._stepper.layout["method"], self._states.t
        parts = step_parts(method, float(times[0]), float(times[-1]), float(self._run.method.order), self._changes)
        return parts.longest(float(self._run.settings["step"]))

    @property
    def _fast_laws(self) -> str:
        """Laws of time that the steps do not resolve."""
        run, times = self._run, self._states.t
        if len(times) < 2:  # no step
            return ""
        order = float(run.method.order)
        parts = step_parts(self._stepper.layout["method"], float(times[0]), float(times[-1]), order, self._changes)
        return fast_laws(run, self._stepper.input_times, parts.ends, self._states, self._present)

    @cached_property
    def _warning(self) -> str:
        run, states = self._run, self._states
        still = len(self._changes) or self._at_rest
        inputs = run.signals if run.takes_rows else None
        moving = (states.t, states.q, states.v, states.z)
        drift = "" if still else momentum_drift(run.model, moving, run.parameters, inputs, states.multipliers)
        has_events = "events" in self._stepper.layout["method"]
        return run_warnings(
            {**self._statistics, "max_rounding": 0.0} if self._without_multipliers else self._statistics,
            self._balance,
            self._longest_part,
            partial(_cause_besides_step, run, states.t, states.q, has_events),
            self._violation,
            self.error,
            drift,
            single=run.model.library.real == "float",
            method=run.name,
        )

    @cached_property
    def _judged(self) -> str:
        """How the run ended, and what is doubtful of it."""
        run = self._run
        message = message_of(self._last_run, self._stepper, self._trajectory, self._events)
        if self._writer is not None and self._ended:
            last = f"; the checkpoint {self._writer.path} holds its last state" if self._trajectory.interrupted else ""
            message += self._writer.problem or last
        if not self._complete:
            return f"{message}; {self._turned}" if self._turned else message
        success = True
        if self._fault:
            success, message = False, f"{message}, but {self._fault}"
        elif self._warning:
            success = self._balance.gain <= FAILED or (self._rows_are_sparse and not self._conservative)
            message = f"{message}{'; ' if success else ', but '}{self._warning}"
        if self._bending is not None and success:
            success = self._bending.possible
            message = f"{message}{'; ' if success else ', but '}{self._bending}"
        if self._turned:
            success, message = False, f"{message}{', but ' if success else '; '}{self._turned}"
        if not self._fault and (growth := unbounded_growth(run, self._states)):
            message = f"{message}; {growth}"
        if success and self.error.unresolved:
            message = f"{message}; {self.error.unresolved}"
        if success and self.error.passed_over and not self.error.relative > LARGE_ERROR:
            message = f"{message}; {self.error.passed_over}; {_SHORTER.format(step=self._run.settings['step'])}"
        states = self._states
        if varied := self._fast_laws:
            message = f"{message}; {varied}"
        if met := passed_springs(run.model, states.t, states.q, run.parameters):
            message = f"{message}; {met}"
        if undefined := undefined_outputs(states.t, self.outputs):
            message = f"{message}; {undefined}"
        if passed := passages(int(self._statistics.get("singular_passages", 0))):
            tolerance = self._run.settings["tolerance"] if self._run.method.chooses_steps else math.inf
            message = f"{message}; {passed}{not_followed(self.error.relative, tolerance)}"
        if self._stepper.controllers is not None and (cost := self._stepper.controllers.cost(self._wall)):
            message = f"{message}; {cost}"
        return message

    @cached_property
    def _beyond_limits(self) -> list[str]:
        """Joints that start beyond their limits."""
        beginning = self._beginning
        if beginning is None or beginning.equilibrium:
            return []
        return starts_beyond_limits(self._run.model, beginning.state.q, self._run.parameters)

    @cached_property
    def _impacts(self) -> list[str]:
        """Impacts that the run starts behind, or rests on."""
        return [] if self._beginning is None else impacts_at_start(self._run, self._beginning.state)

    @cached_property
    def _unresolved(self) -> list[str]:
        """What decays too fast at the start of the run for an explicit method."""
        run = self._run
        limit, t = run.method.real_stability, run.grid.start
        if not limit or self._beginning is None:
            return []
        u = run.signals.rows(np.array([t]))[0] if run.takes_rows else None
        judged = [unresolved_states] if run.model.multipliers else [unresolved_damping, unresolved_states]
        state, step = self._beginning.state, run.settings["step"]
        return [fault(run.model, state, t, u, run.parameters, step, limit) for fault in judged]


def _cause_besides_step(run: Run, t: Array, q: Array, has_events: bool) -> str:
    """Return what a doubtful run suffers from besides too large a step, and what to try; empty where nothing is
    found."""
    if beyond := linear_range_exceeded(run.model, t, q, run.parameters):
        return beyond
    if run.method.chooses_steps:
        finer = f"try: a tolerance smaller than {run.settings['tolerance']:.3g}"
        looks = f", or a step smaller than {run.settings['step']:.3g} s, in each of which events are looked for"
        return f"{finer}{looks if has_events else ''}"
    singular = nearest_singular(run.model, t, q, run.parameters)
    return f"{singular.what}; try: {way_through(run.method, run.settings['step'])}" if singular else ""
