"""``Simulator``: a compiled stepper that a caller steps, with inputs, parameters and states that may jump between
steps."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, count_of
from eomgen.base.calls import NamedAttributes, NamedResults, ReadOnly, UnknownAttribute, checked_call, checked_calls
from eomgen.base.data import replace
from eomgen.compiled.arguments import check_finite, check_name, number_of, numbers
from eomgen.compiled.initial_state import InitialState, angles_of_several_turns
from eomgen.errors import EomgenError, Message, ModelError, NumericalError, Problem, UsageError
from eomgen.integrators.events import AT_EVENTS, STOPPED
from eomgen.integrators.stepper_layout import INPUT_NOT_FINITE
from eomgen.results.solution import Solution
from eomgen.simulation.checkpoint import SimulatorState
from eomgen.simulation.judgement.diagnosis import failed_step
from eomgen.simulation.judgement.starts import doubts_of_start
from eomgen.simulation.motions import Motions, Target, read_target, refuse_as_inputs
from eomgen.simulation.outcome import RecordedRow, recorded_solution
from eomgen.simulation.stepping.chunks import CompiledSteps, between
from eomgen.simulation.stepping.events import ending
from eomgen.simulation.stepping.inputs import CheckedSignal, InputRows, Signal, check_held, read_signals
from eomgen.simulation.stepping.run import Run, scene_inputs
from eomgen.simulation.stepping.settings import check_span
from eomgen.simulation.stepping.states import start_of
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.simulation.stepping.time_grid import TimeGrid, time_grid
from eomgen.system.events import mode_parameter
from eomgen.toolchain.library import Library

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Number of steps for which prescribed motions and curves are checked ahead at first, unless the run is shorter; each
#: following check covers four times as many.
_AHEAD = 1024
_DOUBLE = np.dtype(np.float64)

#: Inputs of a step: an array of all inputs in order, a number for a single input, a mapping from names of some inputs,
#: or None.
StepInputs = ArrayLike | Mapping[str, Signal] | None


class StepEvent(NamedTuple):
    """An event of a step: name, and time in s."""

    name: str
    t: float


def _no_assignment(name: str) -> UnknownAttribute:
    """Return the error raised if a caller assigns to a quantity of a Simulator that ``set_state`` changes: `name`, q, v
    or t."""
    hint = "set_state(t=...)" if name == "t" else f'set_state({{"{name}": ...}})'
    return UnknownAttribute(Problem("", f"{name} of a Simulator is read, and not assigned to [E2029]", hint))


@checked_calls(
    "model.start(...), which makes one",
    inputs="u",
    steps="n",
    t_end="t",
    **dict.fromkeys(
        ("dt", "step", "h", "step_size", "timestep"), "model.start(step=...), which sets the size of steps"
    ),
)
class Simulator(NamedAttributes):
    """A motion stepped by its caller: ``run = model.start(...)``, then ``run.step(u)`` as often as wanted.

    The inputs of a step act from the beginning of the step. If inputs or parameters differ from the values at the end
    of the last step, all quantities carried from step to step (accelerations, algorithmic accelerations, chosen steps,
    series) are evaluated anew from q and v, so that the order of the method is kept over jumps. Arrays of results are
    copies; arrays of states are read-only: ``set_state`` puts the motion into another state.

    Quantities are named as in ``Solution``, for one state: ``q`` (nq,), ``v`` (nv,), ``a`` (nv,), ``z`` (nz,),
    ``multipliers`` (rows,), SI units. ``a`` and the multipliers are the values at the end of the last step.

    A failed step raises and leaves the last good state.
    """

    def __init__(self, run: Run, library: Library, motions: Motions) -> None:
        """Make the stepper of a run without a state; ``begin`` initialises the motion. `run` has the method, settings,
        parameters (np,) and inputs, `library` the compiled stepper. The scene's prescribed `motions` are kept and
        changed by later steps."""
        method = library.layout["method"]
        self._run, self._library = run, library
        self._stepper = Stepper(library, run.settings, run.parameters, run.controllers)
        self._memory, self._places = self._stepper.state, self._stepper.places
        names = [name for name, _ in method["row"]]
        self._now = {name: self._memory[self._places[name]] for name in names}
        self._rows_have_corrections = bool(method["hooks"]["row"])
        self._linear = method["inputs"] == "sampled"
        self._events = [row["name"] for row in method["events"]["rows"]] if "events" in method else []
        modes, known = method["events"]["modes"] if "events" in method else [], list(run.model.parameters)
        self._modes = [known.index(mode_parameter(mode["name"])) for mode in modes]
        self._compiled = CompiledSteps(library, self._stepper, run.model.nu)
        self._u, self._one, self._free = self._compiled.u, self._compiled.one, self._compiled.free
        self._shape = self._u.shape
        self._by_formulas = run.driven is None
        self._signals, self._given = run.signals, False  # of the last step
        self._cleared, self._ahead, self._stopped = 0, _AHEAD, ""
        self._found: tuple[StepEvent, ...] = ()
        self._begun: InitialState | None = None
        self._advanced: float | None = None  # to when the last advance went
        self._recorded: list[RecordedRow] = []
        self.notes: tuple[str, ...] = ()
        self._motions, self._moved = motions, bool(motions)

    def __repr__(self) -> str:
        return f"<Simulator of {self.model.name} by {self.method}: t = {self.t:.9g} s, steps of {self.step_size:.9g} s>"

    # -- steps ---------------------------------------------------------------------------------------------------------

    def step(
        self,
        u: StepInputs = None,
        n: int = 1,
        *,
        end: StepInputs = None,
        motions: Mapping[str, Target] | None = None,
    ) -> None:
        """Take n steps with the same inputs; an event that stops the motion ends the steps early, and ``stopped``
        describes it.

        Parameters
        ----------
        u : (nu,) array, number or mapping
            Inputs of this call alone, held over the steps; a number for a single input. A mapping has some inputs by
            name, each a number, or a function of t that is followed; all other inputs, and without ``u`` all inputs,
            are given by ``start``, by the scene's formulas, or are zero. No size of a step: that is the ``step`` of
            ``start``, and ``advance(t)`` goes to a time.
        n : int, optional
            Number of steps, at least 1.
        end : (nu,) array, number or mapping
            Inputs at the end of the last step: inputs are linear in time from u to ``end``, and both give all inputs.
        motions : mapping
            Of the scene's motions by name: position, rate and acceleration at the end of the last step, to which each
            goes by one polynomial of degree 5; or a function of t that gives these three, which is met at the end of
            every step. Without one, a motion at rest rests.

        Raises
        ------
        UsageError
            Unknown names; inputs of another shape or that are not finite; ``end`` for a method that holds its inputs,
            functions of t as inputs of ``taylor``; an event has stopped the motion; curves or prescribed motions end; a
            motion under way without a target; motions with an adaptive method; a function of the caller fails.
        ModelError
            Rows of constraints that were left out do not follow from the others at the new positions of motions; the
            state is unchanged.
        NumericalError
            A step failed; the state is the last good state, after the earlier steps of the call.

        Warns
        -----
        RuntimeWarning
            ``u`` of the first step is a number equal to the size of a step, and may have been meant as this size.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> run = model.start(step=1e-3)
        >>> run.step({"road": 0.01})
        >>> run.step(n=9)
        >>> run.t, run.q.shape
        (0.01, (2,))
        """
        plain = end is None and n == 1 and self._cleared > 0 and motions is None and not self._moved
        if plain and type(u) is np.ndarray and u.dtype is _DOUBLE and u.shape == self._shape:
            self._u[:] = u
            self._given = True
            self._cleared -= 1
            if status := self._one():
                self._judge(status)
        elif plain and u is None and self._by_formulas:
            self._signals, self._given = self._run.signals, False
            self._cleared -= 1
            if status := self._free():
                self._judge(status)
        elif motions is None and not self._moved:
            self._steps(u, count_of("n", n), end)
        else:
            count = count_of("n", n)
            with self._moving(motions, count * self._stepper.step_size) as functions:
                self._go_on(u, count, end, functions)

    def advance(
        self,
        t: float,
        u: StepInputs = None,
        *,
        end: StepInputs = None,
        motions: Mapping[str, Target] | None = None,
    ) -> None:
        """Step to a time in s: whole steps, and a shorter last step for the rest.

        An event that stops the motion ends the steps before this time; ``stopped`` describes the event.

        Parameters
        ----------
        t : float, s
            Not before the time of the state.
        u : array_like or mapping, optional
            Inputs of this call alone, held, as in ``step``.
        end : array_like or mapping, optional
            Inputs at t, to which all inputs go linearly from u, as in ``step``.
        motions : mapping, optional
            Targets at t of the scene's motions, as in ``step``.

        Raises
        ------
        As of ``step``, and UsageError if t lies before the time of the state.

        Warns
        -----
        RuntimeWarning
            ``t`` is the present time and was the target of the last call, ``advance`` as well: the argument may have
            been meant as a time span. Also as of ``step``.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> run = model.start(step=1e-3)
        >>> run.advance(0.0125)
        >>> run.t
        0.0125
        """
        now, target = self.t, number_of("t", t)
        if target < now:
            fault = f"{target:.9g} s lies before the time of the state, {now:.9g} s [E2030]"
            raise UsageError(Problem("t", fault, "a later time, or restore(state) of an earlier one"))
        if target == now == self._advanced:
            warnings.warn(
                f"advance({target:.9g}) takes the time to go to, and the motion is there already: it stays "
                f"there; try: advance(run.t + {target:.9g}) for a time span [W0205]",
                RuntimeWarning,
                stacklevel=3,
            )
        self._advanced = target
        grid = time_grid(now, target, self.step_size, self._library.real)
        between = end
        if grid.rest and end is not None and grid.whole:
            share = grid.whole * grid.step / (target - now)
            first, last = self._inputs_of("u", u), self._inputs_of("end", end)
            between = (1.0 - share) * first + share * last
        with self._moving(motions, target - now) as functions:
            if grid.whole:
                self._go_on(u, grid.whole, between, functions)
            if grid.rest and not self._stopped:
                self._stepper.settings[0] = self._stepper.step_size = grid.rest
                try:
                    self._go_on(between if end is not None and grid.whole else u, 1, end, functions)
                finally:
                    self._stepper.settings[0] = self._stepper.step_size = grid.step
                if not self._stopped:
                    self._memory[self._places["t"]] = grid.end

    @checked_call('set_parameter("load", 0.5), or set_parameters({"load": 0.5}) for several')
    def set_parameter(self, name: str, value: float) -> None:
        """Change a tunable parameter from now on; a mode of the scene's events by name, too.

        Parameters
        ----------
        name : str
            Tunable parameter, or mode.
        value : float
            SI units.

        Raises
        ------
        UsageError
            An unknown name, or a value that the scene would refuse.
        ModelError
            Rows of constraints that were left out at the scene's parameters do not follow from the other rows.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> run = model.start(step=1e-3)
        >>> run.set_parameter("m2", 0.8)
        """
        self.set_parameters({name: value})

    def set_parameters(self, values: Mapping[str, float]) -> None:
        """Change several tunable parameters from now on, also modes of the scene's events; all other parameters keep
        their values.

        q, v and z stay as they are, even if constraints depend on the parameters; ``set_state`` brings the state onto
        the constraints. The state is kept if an error is raised.

        Parameters
        ----------
        values : mapping
            Name -> value, SI units.

        Raises
        ------
        UsageError
            An unknown name, or a value that the scene would refuse.
        ModelError
            Rows of constraints that were left out at the scene's parameters do not follow from the remaining rows.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> run = model.start(step=1e-3)
        >>> run.set_parameters({"m2": 0.8})
        """
        model = self.model
        if not isinstance(values, Mapping):
            fault = f"a mapping from names to numbers is needed, not {type(values).__name__} [E2031]"
            raise UsageError(Problem("parameters", fault, 'run.set_parameters({"load": 0.5})'))
        for name in values:
            check_name("parameter", name, tuple(model.parameters), model.evaluator.fixed_parameters)
        present = dict(zip(model.parameters, self._present().tolist(), strict=True))
        p = model.parameter_array({**present, **values})
        model.check_left_out(self.q, self.v, self.t, p)
        if not np.array_equal(p[self._motions.columns], self._stepper.parameters[self._motions.columns]):
            self._motions.reached.clear()
        self._stepper.parameters[: len(p)] = p
        if self._stepper.modes is not None:
            self._memory[self._places["mode"]] = p[self._modes]
        self._rule(p)

    def set_state(self, state: Mapping[str, Any] | None = None, *, t: float | None = None) -> None:
        """Put the motion into another state; the motion and the counts of steps and events start anew; recorded rows,
        parameters, and the present values of prescribed motions stay.

        Parameters
        ----------
        state : mapping
            As ``initial`` of ``simulate``: ``{"q": q, "v": v}``, ``{"hinge": {"velocity": 1.0}}``; variables that are
            not given stay as they are. The state is brought onto the constraints; ``notes`` says how.
        t : float
            Time of the new state, s, also an earlier one; the present time by default.

        Raises
        ------
        UsageError
            As of ``simulate``: an unknown name, or values of a wrong number or that are not finite.
        ModelError, NumericalError
            The state cannot be brought onto the constraints, or has no finite accelerations; the former state stays.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> run = model.start(step=1e-3)
        >>> run.set_state({"elbow": {"position": 0.2, "velocity": 1.0}}, t=0.0)
        >>> run.q, run.v
        (array([0.8, 0.2]), array([0., 1.]))
        """
        if state is not None and not isinstance(state, Mapping):
            fault = f"a mapping is needed, not {type(state).__name__} [E0090]"
            raise UsageError(Problem("state", fault, 'set_state({"q": q, "v": v}), or {"joint": position}'))
        time = self.t if t is None else number_of("t", t)
        p = self._motions.later(self._present(), time - self.t)
        now = {"q": self.q, "v": self.v, **({"z": self.z} if self.model.nz else {})}
        grid = TimeGrid(time, time, self.step_size, 0, 0.0)
        begun = replace(self._run, parameters=p, grid=grid)
        start, notes, _ = start_of(begun, {**now, **(state or {})}, equilibrium_start=False, changed=True)
        doubts = [*angles_of_several_turns(self.model, state), *doubts_of_start(begun, start)]
        before = self._stepper.parameters.copy()
        self._stepper.parameters[: len(p)] = p
        try:
            self.begin(time, start, [*notes, *doubts])
        except EomgenError:
            self._stepper.parameters[:] = before
            raise
        if self._moved:
            self._rule(p)

    def begin(self, t: float, state: InitialState, notes: Sequence[str]) -> None:
        """Initialise the motion at a state that meets the constraints, and clear the found events, the stop and the
        counts.

        ``start`` and ``set_state`` call this method last. The stepper keeps its former memory if the state is refused.

        Parameters
        ----------
        t : float
            Time, s.
        state : InitialState
            q, v and z that meet the constraints.
        notes : sequence of str
            Kept as ``notes``.

        Raises
        ------
        UsageError
            The stepper refuses its settings.
        NumericalError
            The motion cannot start at this state.
        """
        before = self._stepper.memory
        try:
            self._initialize(t, state, self._u, self._u)
        except EomgenError:
            self._stepper.restore(*before)
            raise
        self.notes, self._stopped, self._cleared, self._found = tuple(map(Message, notes)), "", 0, ()
        self._advanced = None
        self._begun = state

    def _initialize(self, t: float, state: InitialState, first: Array, last: Array) -> None:
        """Initialise the compiled stepper at a state and time `t` in s, with the inputs at the times of a first step.
        Inputs that the caller gave to the last step go linearly from `first` to `last`, both (nu,), over the step;
        otherwise functions and formulas of inputs are evaluated, and `first` and `last` are not used. Raises UsageError
        if the stepper refuses its settings, and NumericalError if the motion cannot start."""
        stepper, table = self._stepper, None
        if self._given:
            shares = stepper.input_times[:, np.newaxis]
            table = np.ascontiguousarray((1.0 - shares) * first + shares * last)
        elif driven := self._input_rows:
            table = np.ascontiguousarray(driven(t + stepper.step_size * stepper.input_times))
        status = stepper.initialize(t, state.q, state.v, table, state.z)
        if status:
            text = stepper.status_text(status)
            self._run.check_settings(status, text)
            fault = f"the motion cannot start at t = {t:.9g} s: {text} [E2036]"
            raise NumericalError(Problem("start", fault, "another state, other parameters or inputs"))

    # -- present state ------------------------------------------------------------------------------------------------

    @property
    def model(self) -> CompiledModel:
        return self._run.model

    @property
    def method(self) -> str:
        """Name of the method."""
        return self._run.name

    @property
    def step_size(self) -> float:
        """Size of a step, s."""
        return self._run.settings["step"]

    @property
    def t(self) -> float:
        """Time of the state, s."""
        return float(self._memory[0])

    @t.setter
    def t(self, value: object) -> None:
        raise _no_assignment("t")

    @property
    def q(self) -> Array:
        q = self._now["q"].copy()
        q.flags.writeable = False
        return q

    @q.setter
    def q(self, value: object) -> None:
        raise _no_assignment("q")

    @property
    def v(self) -> Array:
        return self._part("v")

    @v.setter
    def v(self, value: object) -> None:
        raise _no_assignment("v")

    @property
    def a(self) -> Array:
        return self._part("vdot")

    @property
    def z(self) -> Array:
        """Internal states, (nz,)."""
        return self._now["z"].copy() if self.model.nz else np.zeros(0)

    @property
    def multipliers(self) -> Array:
        """Constraint forces, by ``model.multipliers``."""
        return self._part("lam") if self.model.multipliers else np.zeros(0)

    @property
    def inputs(self) -> Array:
        """Inputs (nu,) at the time of the state."""
        return self._u.copy() if self._given else self._signals.rows(np.array([self.t]))[0]

    @property
    def motions(self) -> dict[str, Array]:
        """Position, rate and acceleration (3,) of the scene's motions by name."""
        p, t = self._present(), self.t
        return NamedResults("motion", {name: self._motions.now(name, p, t).copy() for name in self._motions})

    @property
    def outputs(self) -> dict[str, Array]:
        """The scene's outputs at the present state by name, () or (size,) each; empty if the model has no outputs, or
        was built without them. Accelerations, multipliers and inputs that were given are the values at the end of the
        last step, also after a change of parameters; inputs by the scene's formulas follow this change."""
        model = self.model
        if "outputs" not in model.functions:
            return NamedResults("output", {})
        p, z = self._present(), self.z
        held = {"multipliers": self.multipliers} if model.multipliers else {}
        return model.outputs(self.q, self.v, self.a, self.t, self.inputs, z=z, parameters=p, **held)

    @property
    def parameters(self) -> Mapping[str, float]:
        """Present tunable parameters, with modes of events."""
        now = zip(self.model.parameters, self._present().tolist(), strict=True)
        return ReadOnly("parameter", dict(now), "set_parameter(name, value), which changes one from now on")

    @property
    def events(self) -> tuple[StepEvent, ...]:
        """The events within the last call of ``step`` or ``advance``, those aside that are only counted."""
        return self._found

    @property
    def event_counts(self) -> dict[str, int]:
        """How often each event came since the motion was started."""
        counts = self._memory[self._places["event_count"]].astype(int).tolist() if self._events else []
        return dict(zip(self._events, counts, strict=True))

    @property
    def stopped(self) -> str:
        """Description of the event that stopped the motion, in a sentence; empty while the motion goes on."""
        return self._stopped

    @property
    def statistics(self) -> dict[str, int | float]:
        """Counts of the stepper since the motion was started."""
        return self._stepper.statistics

    # -- recorded rows -------------------------------------------------------------------------------------------------

    def record(self) -> None:
        """Keep the present state, inputs and parameters as a row of ``solution``; the new row replaces rows at this
        time or later. Steps by themselves record no rows.

        Examples
        --------
        >>> run = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml").start(step=1e-3)
        >>> run.record()
        >>> run.step(n=10)
        >>> run.record()
        >>> run.solution().t
        array([0.  , 0.01])
        """
        while self._recorded and self._recorded[-1].t >= self.t:
            self._recorded.pop()
        row = RecordedRow(self.t, self.q, self.v, self.a, self.z, self.multipliers, self.inputs, self._present())
        self._recorded.append(row)

    def solution(self) -> Solution:
        """Return the recorded rows as a Solution, with plots, files and evaluations like the solution of a run.

        Between rows, inputs are linear. There is no estimate of errors (``error.available`` is False), energies are not
        compared, and no check of a run is made: there are no findings, and ``success`` is True. Events are not in the
        solution; ``metadata`` has the parameters of the last row, which ``outputs_at`` and poses take at all times.

        Returns
        -------
        Solution
            The recorded rows, with outputs and energies by the parameters of each row, if the model has these terms;
            ``stats`` are the counts of the stepper since the motion was started.

        Raises
        ------
        UsageError
            There are no recorded rows.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> run = model.start(step=1e-3)
        >>> run.record()
        >>> run.step(n=5)
        >>> run.record()
        >>> run.solution().t
        array([0.   , 0.005])
        """
        if not self._recorded:
            fault = "there are no rows: a simulator keeps the states that it is asked to record [E2037]"
            raise UsageError(Problem("solution", fault, "run.record() at the start and after steps"))
        return recorded_solution(self._run, self._recorded, self.statistics, self.notes, self._stopped)

    # -- copies --------------------------------------------------------------------------------------------------------

    @property
    def state(self) -> SimulatorState:
        """Copies of all data that later steps depend on, except inputs given to ``start`` and the caller's functions of
        time and of controllers; ``restore`` takes this state. Recorded rows, ``notes`` and ``stopped`` are not in it.
        """
        stepper = self._stepper
        memory, workspace = stepper.memory
        return SimulatorState(
            t=self.t,
            q=self.q,
            v=memory[self._places["v"]],
            z=self.z,
            parameters=stepper.parameters[:-1].copy(),
            u=self.inputs if self._given or self._signals.given is not self._run.signals.given else None,
            begun=self._begun,
            memory=memory,
            workspace=workspace,
            settings=stepper.settings.copy(),
            scene=self.model.name,
            fingerprint=self._library.fingerprint,
            build=self._library.digest,
            motions=dict(self._motions.reached),
        )

    def restore(self, state: SimulatorState) -> None:
        """Go back to a state, to the same bits.

        Parameters, step size, and counts of steps and events go back, too; recorded rows, ``notes``, inputs given to
        ``start`` and the caller's functions stay, and ``stopped`` and ``events`` are empty.

        Parameters
        ----------
        state : SimulatorState
            A ``state`` of this simulator, or of another one of the same model and method.

        Raises
        ------
        UsageError
            Anything else than a ``state``; a controller's function whose memory the scene does not declare.
        ModelError
            The state belongs to another model, method or compilation.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> run = model.start(step=1e-3)
        >>> before = run.state
        >>> run.step(n=5)
        >>> run.restore(before)
        >>> run.t
        0.0
        """
        if not isinstance(state, SimulatorState):
            hint = "run.state of before, or set_state({'q': q, 'v': v})"
            fault = f"a state of a simulator is needed, not {type(state).__name__} [E2038]"
            raise UsageError(Problem("state", fault, hint))
        state.check(self.model.name, self._library)
        if self._run.controllers is not None and (names := self._run.controllers.undeclared_names):
            fault = f"the function of {names} may keep something that no state holds [E2039]"
            hint = "memory = 0, or how many numbers it keeps, in the scene's controller"
            raise UsageError(Problem("state", fault, hint))
        stepper = self._stepper
        stepper.restore(state.memory, state.workspace)
        stepper.parameters[:-1] = state.parameters
        stepper.settings[:] = state.settings
        settings = dict(zip(self._run.settings, state.settings.tolist(), strict=True))
        stepper.step_size = settings["step"]
        self._run = replace(self._run, settings=settings)
        self._signals, self._given = self._run.signals, state.u is not None
        if state.u is not None:
            self._u[:] = state.u
        self._motions.reached = dict(state.motions)
        self._rule(state.parameters)
        self._stopped, self._found, self._begun, self._advanced = "", (), state.begun, None

    def copy(self) -> Simulator:
        """Return an independent simulator of the same model in the same state, which continues to the same bits.

        Returns
        -------
        Simulator
            Shares the compiled functions and the caller's functions, and no state; has the rows recorded until now.

        Raises
        ------
        UsageError
            A controller's function whose memory the scene does not declare.

        Examples
        --------
        >>> run = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml").start(step=1e-3)
        >>> other = run.copy()
        >>> other.step(n=10)
        >>> run.t, other.t
        (0.0, 0.01)
        """
        duplicate = Simulator(self._run, self._library, Motions(self.model))
        duplicate.restore(self.state)
        duplicate._signals, duplicate._given, duplicate._stopped = self._signals, self._given, self._stopped
        duplicate.notes, duplicate._recorded = self.notes, list(self._recorded)
        return duplicate

    __copy__ = copy

    # -- inside --------------------------------------------------------------------------------------------------------

    def _part(self, name: str) -> Array:
        if self._rows_have_corrections:
            row: Array = self._stepper.row[self._stepper.row_places[name]]
        else:
            row = self._now[name].copy()
        row.flags.writeable = False
        return row

    def _present(self) -> Array:
        """Present parameters (np,), with the modes."""
        p = self._stepper.parameters[:-1].copy()
        modes = self._stepper.modes
        if modes is not None:
            p[self._modes] = modes
        return p

    def _rule(self, p: Array) -> None:
        """Set the parameters (np,) with which the scene's formulas of inputs are evaluated, in the run and its input
        signals. Prescribed laws of time are checked again before the next step. The stepper's own parameters are not
        changed."""
        formulas = scene_inputs(self.model, p.copy())
        self._signals = replace(self._signals, formulas=formulas)
        self._run = replace(self._run, parameters=p.copy(), signals=replace(self._run.signals, formulas=formulas))
        self._cleared = 0

    @property
    def _input_rows(self) -> InputRows | None:
        return replace(self._run, signals=self._signals).driven

    def _inputs_of(self, name: str, u: StepInputs) -> Array:
        """Return the inputs as an array of finite numbers (nu,), from an array, a number for one input, or a mapping of
        all names. Raises UsageError, with the argument's `name`, if inputs are missing, of another shape or not
        finite."""
        if isinstance(u, Mapping):
            signals: Any = self._checked_signals(u)
            u = [signals[key] for key in self.model.inputs] if len(signals) == self.model.nu else None
        if u is None:
            hint = f"u and end as lists of {self.model.nu}, in the order of model.inputs, or both by all names"
            raise UsageError(Problem(name, "inputs that move linearly need all of them at both ends [E2040]", hint))
        array = numbers(name, u)
        if array.ndim == 0 and self._shape == (1,):
            array = array.reshape(1)
        if array.ndim == 0 and not self._shape[0]:
            fault = f"these are inputs, and the scene has none; a step is {self.step_size:.9g} s long [E2041]"
            raise UsageError(Problem(name, fault, "step() or step(n=...); the size of steps is set by start(step=...)"))
        if array.shape != self._shape:
            names = ", ".join(self.model.inputs) or "none: the scene has no inputs"
            fault = f"the shape is {array.shape}, {self._shape} is needed: {names} [E2042]"
            raise UsageError(Problem(name, fault, "one number for each input, or a mapping from names"))
        check_finite(name, array, self.model.inputs)
        return array

    def _steps(self, u: StepInputs, n: int, end: StepInputs) -> None:
        """Take n steps with the caller's inputs `u`, held, or linear to `end` at the end of the last step. With u =
        None, the inputs follow the signals of the start; a mapping replaces some of these. The first steps after a
        start initialise the stepper anew if u is given. Sets the found events. Raises UsageError after a stop, for
        inputs that are wrong, or for `end` if the method holds its inputs, and NumericalError for a failed step."""
        if self._stopped:
            hint = "restore(state) of before, or set_state"
            raise UsageError(Problem("step", f"the motion was {self._stopped} [E2043]", hint))
        if end is not None and not self._linear:
            fault = f"{self.method} holds its inputs over each step [E2044]"
            raise UsageError(Problem("end", fault, "shorter steps with held inputs, or another method"))
        held = None if u is None or isinstance(u, Mapping) else self._inputs_of("u", u)
        last = None if end is None else self._inputs_of("end", end)
        first = self._inputs_of("u", u) if last is not None else held
        if self._begun is not None and isinstance(u, float) and u == self.step_size:
            warnings.warn(
                f"step({u:.9g}) takes {u:.9g} as the input {self.model.inputs[0]}, not as the size of the step: "
                "that is set by start(step=...), and step() without inputs takes one [W0206]",
                RuntimeWarning,
                stacklevel=4,
            )
        signals = self._run.signals
        if isinstance(u, Mapping):
            signals = replace(signals, given={**signals.given, **self._checked_signals(u)})
        self._look_ahead(n, signals.given if first is None else dict.fromkeys(self.model.inputs, 0.0))
        self._signals, self._given, self._found = signals, first is not None, ()
        if self._begun is not None and (u is not None or self._moved):  # the start was with other inputs
            begin = self._u if first is None else first
            self._initialize(self.t, self._begun, begin, between(begin, last, 1.0 / n))
        self._begun = None
        steps = self._compiled
        try:
            status = steps.follow(n, self._input_rows) if first is None else steps.move(n, first, last)
        finally:
            self._found = tuple(StepEvent(self._events[k], t) for k, t in steps.events)
        if status:
            self._judge(status)

    @contextmanager
    def _moving(self, motions: Mapping[str, Target] | None, duration: float) -> Iterator[Mapping[str, Target]]:
        """Set the parameters of prescribed motions so that motions reach their targets after `duration` in s: a context
        manager. The body of the context takes the steps; the yielded mapping has the targets that are functions of t,
        by name. Afterwards the values at the targets are kept for the next call, unless an event stopped the motion.
        Raises UsageError for wrong targets, or for targets with an adaptive method. Raises ModelError and restores the
        former state if rows of constraints that were left out do not follow from the others any more."""
        moves = self._motions
        if not moves:
            moves.check(motions)
            yield {}
            return
        targets = moves.check(motions)
        if targets and self._run.method.chooses_steps:
            fault = f"{self.method} chooses its steps, which lie ahead of the time to which motions are known [E2045]"
            raise UsageError(Problem("motions", fault, "generalized_alpha, or another method with steps of one size"))
        before = self.state if self._library.layout["left_out"] else None
        self._take(moves.begin(self._present(), self.t, duration, targets))
        moves.reached.clear()
        yield {name: target for name, target in targets.items() if callable(target)}
        if self._stopped:
            moves.reached.clear()
        else:
            moves.reached |= {name: read_target(name, at) for name, at in targets.items() if not callable(at)}
        if before is not None:
            try:
                self.model.check_left_out(self.q, self.v, self.t, self._present())
            except ModelError:
                self.restore(before)
                raise

    def _go_on(self, u: StepInputs, n: int, end: StepInputs, functions: Mapping[str, Target]) -> None:
        """Take n steps with inputs `u` and `end` as in ``_steps``: one by one if motions follow functions of time.
        `functions` has these motions, name -> function of t; each motion goes to its value at the end of every step.
        The events of all steps are collected, and a stop by an event ends the steps."""
        if not functions:
            self._steps(u, n, end)
            return
        first, last = (None, None) if end is None else (self._inputs_of("u", u), self._inputs_of("end", end))
        events: tuple[StepEvent, ...] = ()
        for k in range(n):
            moved, ends = self._motions.go_on(self._present(), self.t, self._stepper.step_size, functions)
            self._take(moved)
            if first is None or last is None:
                self._steps(u, 1, None)
            else:
                self._steps(between(first, last, k / n), 1, between(first, last, (k + 1) / n))
            events += self._found
            if self._stopped:
                break
            self._motions.reached.update(ends)
        self._found = events

    def _take(self, p: Array) -> None:
        """Set the parameters of the motions, in the stepper and its state, to the values in parameters (np,). Position,
        rate and acceleration of a motion are continuous, so that methods that carry accelerations from step to step
        need no new evaluation. Laws of time stay checked unless a law that follows a motion may jump or bend."""
        columns = self._motions.columns
        self._stepper.parameters[columns] = p[columns]
        if "p" in self._places:
            self._memory[self._places["p"]][columns] = p[columns]
        cleared = self._cleared
        self._rule(p)
        self._cleared = 0 if self._motions.rough else cleared

    def _checked_signals(self, u: Mapping[str, Signal]) -> dict[str, CheckedSignal]:
        refuse_as_inputs(u, tuple(self._motions))
        read = read_signals(u, self.model.inputs, 0, self.model.input_units)
        for name, signal in read.items():
            if isinstance(signal, np.ndarray):
                fault = "a table does not say to which steps it belongs [E2046]"
                raise UsageError(Problem(f"input {name}", fault, "a number, or a function of t"))
        if self._run.method.inputs == "series":
            check_held(self.method, read)
        return read

    def _look_ahead(self, n: int, inputs: Mapping[str, CheckedSignal]) -> None:
        """Check that curves and prescribed laws of time last for the next n steps, with the inputs `inputs` by name.
        Many further steps are checked in advance if the laws last longer; then the next calls only count these down.
        Raises UsageError if a law does not last for n steps."""
        if self._cleared >= n:
            self._cleared -= n
            return
        run, t, step = self._run, self.t, self._stepper.step_size
        rough = self._motions.rough
        p = run.parameters if rough else self._motions.at_rest(run.parameters)
        signals = replace(run.signals, given=inputs)
        for many in (n,) if rough else (n + self._ahead, n):
            grid = TimeGrid(t, t + many * step, step, many, 0.0)
            try:
                check_span(replace(run, parameters=p, grid=grid, signals=signals), self._library)
            except UsageError:
                if many == n:
                    raise
            else:
                self._cleared = many - n if not self._events else 0
                self._ahead = min(4 * self._ahead, 1024 * _AHEAD)
                return

    def _judge(self, status: int) -> None:
        """Raise the error of a step that ended with a stepper status other than 0: NumericalError with the diagnosis.
        An exception of a controller's function is raised instead, and UsageError for inputs that are not finite. A stop
        by an event raises no error: its description is kept as ``stopped``."""
        if self._stepper.controllers is not None:
            self._stepper.controllers.raise_failure()
        if status == INPUT_NOT_FINITE:
            self._cleared += 1
            check_finite("u", self._u, self.model.inputs)
        if status == STOPPED.number:
            self._stopped, self._cleared = Message(ending(status, self._stepper)), 0
            return
        self._cleared = 0
        if status in AT_EVENTS:
            raise NumericalError(ending(status, self._stepper), "another state, or other parameters of the event")
        inputs = dict(zip(self.model.inputs, self._u.tolist(), strict=True)) if self._given else {}
        signals = replace(self._signals, given={**self._signals.given, **inputs})
        run = replace(self._run, parameters=self._present(), signals=signals)
        raise NumericalError(failed_step(run, self._stepper, (self.t, self.q, self.v, self.a, self.z), status))
