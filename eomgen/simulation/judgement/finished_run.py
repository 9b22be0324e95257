"""FinishedRun: quantities of a run shared by several checks, evaluated at first use; Check: a row of the register, with
the facts that the check needs, such as an error estimate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import EvaluatesOnce, dataclass, replace
from eomgen.base.products import objects_of
from eomgen.base.progress import Progress
from eomgen.base.rounding import SUMMED
from eomgen.compiled.initial_state import InitialState
from eomgen.errors import Message
from eomgen.formula.nodes import Formula
from eomgen.integrators.events import STOPPED
from eomgen.lie.product import Factor
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.events import Events
from eomgen.results.finding import WARNING, Finding, Severity
from eomgen.simulation.stepping.chunks import Trajectory
from eomgen.simulation.stepping.events import acting, parameters_over
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import PrescribedInputs, States, inputs_at_rows, row_values, states_of
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.simulation.stepping.time_grid import StepParts, step_parts

if TYPE_CHECKING:
    from eomgen.base.limits import Limit
    from eomgen.compiled.rest.state_warnings import LargestBending
    from eomgen.simulation.accuracy.fastest_rates import FastestRates
    from eomgen.simulation.judgement.instability import Growth
    from eomgen.simulation.judgement.invariants import EnergyBalance, Violation


def untold_between_rows(states: States, factors: Sequence[Factor]) -> bool:
    """Return whether some joint coordinate moves, between most rows, differently from the integral of the row
    velocities. Each change of the coordinate is compared with the trapezoidal rule. A force of 1 kHz, for instance, has
    the same phase at rows with an interval of 1 ms."""
    duration = np.diff(states.t)
    for factor in factors:
        if factor.group != "R" or not len(duration):
            continue
        q, v = states.q[:, factor.q_start], states.v[:, factor.v_start]
        way = np.diff(q)
        untold = np.median(np.abs(way - 0.5 * duration * (v[1:] + v[:-1])))
        if untold > max(0.5 * float(np.median(np.abs(way))), SUMMED * float(np.max(np.abs(q)))):
            return True
    return False


class RunStart(NamedTuple):
    """Start of a run.

    Attributes
    ----------
    state : initial state
    equilibrium : whether the state is a static equilibrium
    doubts : on this equilibrium, and initial values that are overridden
    choice : reason for the method, if chosen automatically
    notes : on the initial state that the caller gives
    """

    state: InitialState
    equilibrium: bool
    doubts: Sequence[str]
    choice: str = ""
    notes: Sequence[str] = ()


class UnseenLaw(NamedTuple):
    """A law that the steps of a run do not resolve.

    Attributes
    ----------
    finding : on its effect, with the remedy
    law : in words
    step : s, that resolves it; 0 if the equations have no solution there, so that methods with adaptive steps stop
    holds : whether the law holds a velocity or an internal state at a level, so that its effect grows with time
    """

    finding: Finding
    law: str
    step: float
    holds: bool = False


def laws_between_steps(run: Run) -> list[Formula]:
    """Return the formulas of a scene that may act between the steps of a run: narrow or fast laws of time or state.
    Formulas of inputs that the caller gives are left out. The list is kept in the library of the model."""
    laws_by_inputs: dict[tuple[str, ...], list[Formula]] = run.model.library.kept.setdefault("laws between steps", {})
    inputs = tuple(run.signals.given)
    laws = laws_by_inputs.get(inputs)
    if laws is None:
        laws = laws_by_inputs[inputs] = run.model.description.fast_laws(inputs)
    return laws


#: Registers of functions of a run: a law that acts between its steps, a sentence on a fast motion that its steps do not
#: resolve, and a clause on searches that are left out with the error estimate.
UNSEEN_LAWS, UNRESOLVED_MOTIONS, LEFT_OUT = "eomgen.unseen_laws", "eomgen.unresolved_motions", "eomgen.searches"


class NamesCheckpoint(Protocol):
    """Interface of ``checkpoint.CheckpointWriter``."""

    @property
    def path(self) -> Path: ...
    @property
    def problem(self) -> str: ...


@dataclass(eq=False)
class FinishedRun(EvaluatesOnce):
    """A run and the facts that its checks need; the functions for a fact are imported on a request for the fact.

    Attributes
    ----------
    stepper : in the state after the run
    events : with the states before and after each; None if the scene has none
    wall : float
        Duration of the stepping, s.
    writer : of checkpoints; None without any
    estimated : whether the discretisation error is estimated
    progress : called with (steps done, all steps), the steps of the comparison runs included
    beginning : None for a resumed run
    """

    run: Run
    stepper: Stepper
    trajectory: Trajectory
    events: Events | None
    wall: float
    writer: NamesCheckpoint | None = None
    beginning: RunStart | None = None
    estimated: bool = False
    progress: Progress | None = None

    def has(self, facts: Iterable[str]) -> bool:
        """Return whether all of these facts hold."""
        return self._facts.issuperset(facts)

    @cached_property
    def _facts(self) -> frozenset[str]:
        return frozenset([fact for fact, holds in FACTS.items() if holds(self)])

    @property
    def ended(self) -> bool:
        """Whether no step failed."""
        return self.trajectory.status in (0, STOPPED.number)

    @property
    def complete(self) -> bool:
        """Whether the run reached the end, or the event that ends it."""
        return self.ended and not self.trajectory.interrupted and self.trajectory.failure is None

    @cached_property
    def states(self) -> States:
        """Views of long rows, copies of others, which do not change if a caller writes to the solution's own copies."""
        rows = self.trajectory.rows
        return states_of(rows, self.run.model, views=rows.size > 2**20)

    @cached_property
    def checkpoint(self) -> str:
        """Note on the checkpoint; empty if there is none."""
        writer = self.writer
        if writer is None:
            return ""
        last = f"the checkpoint {writer.path} holds its last state" if self.trajectory.interrupted else ""
        return writer.problem or last

    @cached_property
    def present(self) -> Array:
        """Parameters at the rows, (np,), or (n, np) if modes change."""
        return parameters_over(self.events, self.run.model, self.run.parameters, self.states.t)

    @cached_property
    def prescribed(self) -> PrescribedInputs:
        run = self.run
        return inputs_at_rows(run.model, self.states.t, self.present, run.signals if run.takes_rows else None)

    @cached_property
    def outputs(self) -> dict[str, Array]:
        return row_values("outputs", self.run.model, self.states, self.prescribed, self.present)

    @cached_property
    def energy(self) -> dict[str, Array]:
        return row_values("energy", self.run.model, self.states, self.prescribed, self.present)

    @cached_property
    def error(self) -> ErrorEstimate:
        """The estimated errors of the run; a reason without values if the estimate is switched off or cannot be
        made. Evaluation makes the comparison runs. Fast motions that the steps do not resolve are named in
        ``unresolved``."""
        from eomgen.simulation.accuracy.comparison_runs import RecordedRun  # noqa: PLC0415  # on request
        from eomgen.simulation.accuracy.error_estimation import estimate_errors, no_estimate  # noqa: PLC0415  # likewise

        run = self.run
        if not self.estimated:
            left_out = "".join(searches(self) for searches in objects_of(LEFT_OUT))
            return no_estimate(run, f"it was switched off{left_out}")
        rows, library = self.trajectory.rows, self.stepper.library
        taken = RecordedRun(run, library, rows, self.present, self.events, self.statistics)
        at_rows = {"outputs": lambda: self.outputs, "energy": lambda: self.energy}
        of_rates, interrupted = (lambda: self.fastest), self.trajectory.interrupted
        estimate = estimate_errors(
            taken, self.wall, lambda name: at_rows[name](), of_rates, self.progress, interrupted=interrupted
        )
        if not estimate.available:
            return estimate
        return replace(estimate, unresolved="".join(motion(self) for motion in objects_of(UNRESOLVED_MOTIONS)))

    @cached_property
    def last_run(self) -> Run:
        """The run with the parameters at the end."""
        run, t = self.run, self.trajectory.rows[-1, 0]
        p = parameters_over(self.events, run.model, run.parameters, t)
        return run if p is run.parameters else replace(run, parameters=p)

    @cached_property
    def statistics(self) -> dict[str, int | float]:
        return self.stepper.statistics if self.ended or self.trajectory.steps else {}

    @cached_property
    def changes(self) -> Array:
        """Times of the events that changed the motion, s."""
        return acting(self.events, self.stepper.layout)

    def known_jumps(self, order: int) -> Array:
        """Return the times at which forces, or derivatives of forces up to an order, jump, s."""
        from eomgen.simulation.judgement.invariants import same_time  # noqa: PLC0415  # on request

        t = self.states.t
        known = self.run.model.jumps_between(t, same_time(t), order=order)
        return np.concatenate([known, self.changes]) if len(self.changes) else known

    @property
    def single(self) -> bool:
        """Whether the run computes in single precision."""
        return bool(self.run.model.library.real == "float")

    @property
    def conservative(self) -> bool:
        return bool(self.run.model.library.layout["facts"]["conservative"]) and not len(self.changes)

    @property
    def rows_are_sparse(self) -> bool:
        """Whether there are steps between the rows."""
        return self.run.every > 1 or self.run.method.chooses_steps

    @cached_property
    def at_rest(self) -> bool:
        from eomgen.simulation.judgement.instability import at_rest  # noqa: PLC0415  # on request

        return at_rest(self.run, self.trajectory.rows)

    @cached_property
    def growth(self) -> Growth | None:
        """Growth by instability of the method."""
        from eomgen.simulation.judgement.instability import unstable_growth  # noqa: PLC0415  # on request

        return unstable_growth(self.last_run, self.stepper.library, self.trajectory)

    @cached_property
    def balance(self) -> EnergyBalance:
        """The energy balance of the rows; of unknown error if rows are too sparse for the work in between. A
        system at rest counts as balanced."""
        from eomgen.simulation.judgement import invariants  # noqa: PLC0415  # on request

        balance = invariants.energy_balance(
            self.states.t,
            self.energy,
            self.known_jumps(1),
            conservative=self.conservative,
            sparse=self.rows_are_sparse,
            epsilon=float(np.finfo(np.float32 if self.single else np.float64).eps),
        )
        off = balance.error is not None and balance.error > invariants.REPORTED_ENERGY
        working = off and (self._works_between_rows or any(np.any(self.energy[key]) for key in ("power", "base_power")))
        if working and self.rows_are_sparse and untold_between_rows(self.states, self.run.model.factors):
            return invariants.EnergyBalance(None, invariants.APART)
        if working and self._small_error and self.passed_over is None:  # then the power at the rows is off
            return invariants.EnergyBalance(None, invariants.APART)
        return invariants.EnergyBalance(0.0) if off and self.at_rest else balance

    @property
    def _small_error(self) -> bool:
        """Whether the estimated error is small, or the run has no estimate and forces that work between its rows."""
        return self.error.relative < 0.01 or (not self.error.available and self._works_between_rows)

    @property
    def _works_between_rows(self) -> bool:
        """Whether narrow forces may work between rows alone, so that no row shows their power."""
        return self.rows_are_sparse and bool(laws_between_steps(self.run))

    @cached_property
    def fastest(self) -> FastestRates:
        """The fastest rates along the run."""
        from eomgen.simulation.accuracy.fastest_rates import fastest_rates  # noqa: PLC0415  # on request

        return fastest_rates(self.run, self.trajectory.rows, self.present)

    @cached_property
    def passed_over(self) -> UnseenLaw | None:
        """A law that acts between the steps; None if errors are not estimated, or if no product looks for such laws."""
        laws = (law(self) for law in objects_of(UNSEEN_LAWS)) if self.estimated else ()
        return next(filter(None, laws), None)

    @cached_property
    def violation(self) -> Violation | None:
        """Largest violation of a holonomic constraint, or of the unit length of a quaternion; None if all are
        satisfied."""
        from eomgen.simulation.judgement.invariants import largest_stretch, largest_violation  # noqa: PLC0415  # on request

        model, t, q = self.run.model, self.states.t, self.states.q
        largest = self.statistics.get("max_constraint", 0.0)
        result = largest_violation(model, t, q, self.run.parameters, largest), largest_stretch(model, t, q)
        return max(filter(None, result), key=lambda item: item.share, default=None)

    @cached_property
    def bending(self) -> LargestBending | None:
        from eomgen.compiled.rest.state_warnings import largest_bending  # noqa: PLC0415  # on request

        return largest_bending(self.run.model, self.states.t, self.states.q)

    @cached_property
    def parts(self) -> StepParts:
        """Parts into which steps are cut, because forces jump or bend within them."""
        t = self.states.t
        method = self.stepper.layout["method"]
        return step_parts(method, float(t[0]), float(t[-1]), float(self.run.method.order), self.changes)

    @property
    def longest_part(self) -> float:
        """Duration of the longest part of a step, s."""
        return self.parts.longest(float(self.run.settings["step"]))

    @property
    def settings(self) -> Mapping[str, float]:
        return self.run.settings


#: Fact of runs with an error estimate: checks that evaluate the equations again need it.
ESTIMATED = "estimated"
#: Facts that checks may need, as functions of a ``FinishedRun``; all facts are evaluated for the first check.
FACTS: Mapping[str, Callable[[FinishedRun], bool]] = {
    "complete": lambda finished: finished.complete,
    "two rows": lambda finished: len(finished.states.t) > 1,
    "constraints": lambda finished: bool(finished.run.model.multipliers),
    "no constraints": lambda finished: not finished.run.model.multipliers,
    "fixed steps": lambda finished: not finished.run.method.chooses_steps,
    "modal beams": lambda finished: bool(finished.run.model.library.layout["slopes"]),
    "exact beams": lambda finished: bool(finished.run.model.description.exact_beams),
    "lines": lambda finished: bool(finished.run.model.description.drawing.lines),
    "parts": lambda finished: bool(finished.run.model.description.parts),
    "outputs": lambda finished: "outputs" in finished.run.model.functions,
    "controllers": lambda finished: finished.stepper.controllers is not None,
    "checkpoint": lambda finished: bool(finished.checkpoint),
    "begun": lambda finished: finished.beginning is not None,
    "explicit": lambda finished: not finished.run.method.chooses_steps and bool(finished.run.method.real_stability),
    "events": lambda finished: "events" in finished.stepper.layout["method"],
    ESTIMATED: lambda finished: finished.estimated,
}


#: In ``Check.unless``: every check before this one that can fail a run.
ANY_FAILURE = "any failure"


@dataclass(frozen=True)
class Check:
    """One check of a run.

    Attributes
    ----------
    name : str
        Name of the findings; the code at its end is taken off.
    evaluate : callable
        Returns the findings of a run: none, one, or one for each cause. Findings need neither name nor severity.
    needs : tuple of str
        Facts of ``FinishedRun.FACTS``; a run without one of these facts is not checked.
    severity : str
        Severity of the findings. For a check with failures and warnings, ``failure``: a finding is a failure if
        ``fails`` is true.
    unless, after : tuple of str
        Earlier checks: one with a finding makes this check superfluous, or is required for this check.
    continues : str
        Text that joins a finding to the sentence of the previous finding, if both findings have such a text. The joint
        sentence ends with the hint of its last finding.
    alike : bool
        Whether runs at other steps have the same fault, so that a comparison with these shows no error.
    said : bool
        Whether the findings are part of the message.
    fails : callable
        Whether findings of the severity ``failure`` fail a run.
    limits : tuple of Limit
        Thresholds that ``evaluate`` compares with, for the documentation.
    behind : str
        Name of the preceding check, for a check of a product; empty for the one before in the product.
    noted : str
        Place of the findings among the notes of the metadata: ``start`` or ``call``; empty for none.
    """

    name: str
    evaluate: Callable[[FinishedRun], Iterable[Finding]]
    needs: tuple[str, ...] = ("complete",)
    severity: Severity = WARNING
    unless: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    continues: str = ""
    alike: bool = False
    said: bool = True
    fails: Callable[[FinishedRun], bool] = lambda run: True
    limits: tuple[Limit, ...] = ()
    behind: str = ""
    noted: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", Message(self.name))
