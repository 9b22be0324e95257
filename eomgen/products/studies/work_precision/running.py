"""Runs of a study: models of its configurations, built once each, with results, costs and messages of runs; the
times at which runs are compared; the machine that they are measured on."""

from __future__ import annotations

import math
import platform
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.data import dataclass, field
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.base.version import __version__
from eomgen.compiled.arguments import check_name, number_of
from eomgen.errors import EomgenError, Problem, ToolchainError, UsageError
from eomgen.integrators.families.family import Family
from eomgen.integrators.families.register import method_named, method_parameters, row_of
from eomgen.pipeline import pipeline
from eomgen.pipeline.model import Model
from eomgen.products.studies.work_precision.axes import Configuration
from eomgen.products.studies.work_precision.formulations import Formulations, same_start
from eomgen.products.studies.work_precision.observation import Observation, observe
from eomgen.results.finding import WARNING
from eomgen.simulation.request import RunRequest
from eomgen.simulation.timing import RepeatedRun, one_core
from eomgen.toolchain.compiler import find_compiler
from eomgen.toolchain.profiles import STANDARD_PROFILE


def machine() -> dict[str, str]:
    """Return processor, system, compiler, and versions of Python and eomgen as a mapping; ``unknown`` without a
    compiler."""
    try:
        compiler = find_compiler().version
    except ToolchainError:
        compiler = "unknown"
    return {
        "processor": _processor(),
        "system": f"{platform.system()} {platform.release()}",
        "compiler": compiler,
        "python": platform.python_version(),
        "eomgen": __version__,
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())


#: Ends of a run: at the end time, before it, not begun, or given up after too long a time.
REACHED, STOPPED, REFUSED, TOO_LONG = "reached", "stopped", "refused", "too long"


class _BeyondTimeLimit(Exception):
    """A run beyond the time limit."""


@dataclass(frozen=True)
class Grid:
    """The times at which a reference is known: runs are compared at all recorded times.

    Attributes
    ----------
    row : s between two rows
    rows : how many there are besides the start
    start : s
    coarsest : rows in the coarsest step
    recorded : rows between two that a run of the scene's file records
    """

    row: float
    rows: int
    start: float = 0.0
    coarsest: int = 1
    recorded: int = 1

    @property
    def end(self) -> float:
        return self.start + self.row * self.rows


@dataclass(frozen=True)
class ComparedRun:
    """Result of one run.

    Attributes
    ----------
    ended : how, one of the words above
    said : warnings of the run; reason for an earlier end
    observation : None for a run that did not reach the end
    unresolved : finding on a fault that runs at other steps have as well; empty without one
    stats : counts of the stepper
    repeated : for timing, None if there is no step to time
    seconds : of the whole call of ``simulate``
    """

    ended: str
    said: str
    observation: Observation | None = None
    stats: Mapping[str, float] = field(default_factory=dict)
    repeated: RepeatedRun | None = None
    seconds: float = 0.0
    unresolved: str = ""

    @property
    def reference(self) -> Observation | None:
        """The observation of a run to the end, if a reference can be made of it; runs with equal errors would confirm
        each other."""
        return None if self.unresolved or self.ended != REACHED else self.observation


@dataclass
class Runner:
    """Builds models and runs them over a common grid of times.

    Attributes
    ----------
    formulations : Formulations
    grid : Grid
    parameters, inputs : as of ``simulate``
    limit : float
        Seconds that a run may take.
    compiled : seconds of building, by model, and by model and method; short for cached builds
    building : the processor's seconds of building in this process

    Raises
    ------
    UsageError
        There is no tunable parameter or no input of a name.
    """

    formulations: Formulations
    grid: Grid
    parameters: Mapping[str, float] | None = None
    inputs: Mapping[str, Any] | None = None
    limit: float = 10.0
    compiled: dict[str, float] = field(default_factory=dict)
    building: float = 0.0
    _models: dict[tuple[str, str, str], Model] = field(default_factory=dict)
    _starts: dict[tuple[Any, ...], dict[str, Any] | None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the names of parameters and inputs. Raises UsageError."""
        described = self.formulations.description
        tunable = [item.name for item in described.parameters if item.tunable]
        signals, fixed = [item.name for item in described.inputs], tuple(described.fixed)
        kinds = (("parameter", self.parameters, tunable, fixed), ("input", self.inputs, signals, ()))
        for kind, values, names, constants in kinds:
            if not isinstance(values, Mapping | None):
                fault = f"a mapping from the names of {kind}s is needed, not {type(values).__name__} [E2245]"
                raise UsageError(Problem(f"{kind}s", fault, f'{kind}s={{"{names[0] if names else "name"}": value}}'))
            for name, value in (values or {}).items():
                check_name(kind, name, names, constants)
                if isinstance(value, float):
                    number_of(f"{kind} {name}", value, "number")
        self.parameters, self.inputs = dict(self.parameters or {}) or None, dict(self.inputs or {}) or None

    def model(self, formulation: str, real: str = "double", profile: str = STANDARD_PROFILE) -> Model:
        """Return the model of a formulation, in an arithmetic (``double`` or ``float``) and a build profile, built
        once. Raises EomgenError if it cannot be built."""
        key = (formulation, real, profile)
        if key not in self._models:
            with self._building(" ".join(key)), warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                self._models[key] = pipeline.build(self.formulations.scenes[formulation], real=real, profile=profile)
        return self._models[key]

    def own_method(self) -> str:
        """Return the scene's method; in place of ``auto`` the automatic choice."""
        model = self.model(self.formulations.own)
        p = model.parameter_array(self.parameters)
        chosen, _ = RunRequest(model, model.description.simulation.step, self.grid.start, p).method(None, {})
        return chosen or str(model.library.layout["built_method"])

    def own_configuration(self) -> Configuration:
        """Return the scene's configuration, with the parameters of the method, and settings of the method in the
        scene's model."""
        formulation, method = self.formulations.own, self.own_method()
        model = self.model(formulation)
        simulation, built = model.description.simulation, str(model.library.layout["built_method"])
        taken = [name for name in row_of(method)[1].parameters if name in ("alpha", "beta", "gamma")]
        simulation_settings = {name: value for name in taken if (value := getattr(simulation, name))}
        settings = dict(simulation.settings) if method == built else {}
        return Configuration(formulation, method, simulation_settings, settings=settings, real=simulation.real)

    def method(self, configuration: Configuration, tolerance: float | None = None) -> Family:
        """Return the method of a configuration. Raises EomgenError."""
        options = _options(configuration, tolerance)
        model = self._model_of(configuration)
        defaults = model.library.layout["defaults"]
        return method_named(configuration.method, **method_parameters(configuration.method, options, defaults))

    def build_name(self, configuration: Configuration) -> str:
        """Return the key of the build of a configuration's method in ``compiled``."""
        return " ".join((configuration.formulation, configuration.real, configuration.profile, configuration.method))

    def prepare(self, configuration: Configuration) -> None:
        """Build the model of a configuration, so that runs need no build. Raises EomgenError."""
        name, model = self.build_name(configuration), self._model_of(configuration)
        if name not in self.compiled:
            with self._building(name):
                model.stepper(configuration.method)

    def _model_of(self, configuration: Configuration) -> Model:
        return self.model(configuration.formulation, configuration.real, configuration.profile)

    @contextmanager
    def _building(self, name: str) -> Iterator[None]:
        """Return a context that keeps the seconds of a build under a name in ``compiled``. The processor's time is
        added to ``building``, also of a build that fails."""
        began, processor = time.perf_counter(), time.process_time()
        try:
            yield
            self.compiled[name] = time.perf_counter() - began
        finally:
            self.building += time.process_time() - processor

    def _start(
        self,
        formulation: str,
        start: float,
        initial: Mapping[str, Any] | None,
        parameters: Mapping[str, float] | None,
        inputs: Mapping[str, Any] | None,
    ) -> Mapping[str, Any] | None:
        """Return the initial state of a formulation: the scene's state if requested, None for the scene's default, for
        other formulations the state with the same poses and twists.

        Loops are closed from guesses, differently for each formulation.
        """
        name = self.formulations.own
        if formulation == name:
            return initial
        numbers = tuple(np.asarray(part, dtype=float).tobytes() for part in (initial or {}).values())
        key = (formulation, start, numbers, tuple((parameters or {}).items()))
        if key not in self._starts:
            source, target = self.model(name), self.model(formulation)
            if formulation in self.formulations.simplified:
                return None if initial is None else _shorten_state(source, target, initial)
            self._starts[key] = None
            if "poses" in source.functions and "twists" in source.functions:
                h = 1e-6 * self.grid.row
                first = source.simulate(
                    start + h,
                    h,
                    t_start=start,
                    initial=initial,
                    parameters=parameters,
                    inputs=inputs,
                    error_estimate=False,
                )
                same = same_start(source, first.q[0], first.v[0], target, start, parameters)
                self._starts[key] = {**same, "z": first.z[0]} if target.nz else same
        return self._starts[key]

    def run(
        self,
        configuration: Configuration,
        per_row: Fraction | int = 1,
        tolerance: float | None = None,
        *,
        initial: Mapping[str, Any] | None = None,
        parameters: Mapping[str, float] | None = None,
        inputs: Mapping[str, Any] | None = None,
        later: int = 0,
        dense: bool = False,
        timed: bool = True,
        estimated: bool = True,
    ) -> ComparedRun:
        """Run a configuration with a number of steps in a row of the grid, or with a tolerance, and return the result.

        A run that is refused, ends early or takes longer than the limit is a result, too, not an error.

        Parameters
        ----------
        configuration : formulation, method, parameters, settings, arithmetic and profile
        per_row : p/q: p steps in q rows; not used with a tolerance
        tolerance : of a method that chooses steps
        dense : whether all rows are recorded, in place of the rows that a run of the scene's file would record:
            every ``Grid.recorded`` rows, or every step if these are not whole steps
        initial : of this run, ``q`` and ``v`` of the scene's own formulation, for any formulation that runs
        parameters, inputs : of this run, in place of the study's
        later : rows of the grid by which this run begins later; the end is unchanged
        timed : whether the run may be repeated for its time
        estimated : whether the run estimates the error, which the message may then mention
        """
        began = time.perf_counter()
        grid = self.grid
        between = 1 if dense else grid.recorded
        steps, every = (1, between) if tolerance is not None else Fraction(per_row).as_integer_ratio()
        if between % every == 0:
            steps, every = steps * between // every, between
        recorded = (grid.rows - later) // every
        start = grid.start + later * grid.row
        parameters, inputs = parameters or self.parameters, inputs or self.inputs

        def look(done: int, total: int) -> None:
            if time.perf_counter() - began > self.limit:
                raise _BeyondTimeLimit

        try:
            self.prepare(configuration)
            model = self._model_of(configuration)
            began = time.perf_counter()
            with warnings.catch_warnings(), one_core():
                warnings.simplefilter("ignore", RuntimeWarning)
                solution = model.simulate(
                    start + grid.row * (recorded * every),
                    grid.row * every / steps,
                    method=configuration.method,
                    record_every=steps,
                    t_start=start,
                    settings=configuration.settings or None,
                    parameters=parameters,
                    inputs=inputs,
                    initial=self._start(configuration.formulation, start, initial, parameters, inputs),
                    progress=look,
                    error_estimate=estimated,
                    **_options(configuration, tolerance),
                )
            took = time.perf_counter() - began
            if not solution.success:
                return ComparedRun(STOPPED, solution.message, stats=counts(solution.stats), seconds=took)
            observation = observe(model, solution)
            if len(solution.t) != recorded + 1 or not np.all(np.isfinite(observation.q)):
                return ComparedRun(STOPPED, "its rows are not at the times of the grid, or not finite", seconds=took)
            repeated = RepeatedRun(model, solution, self.method(configuration, tolerance), inputs) if timed else None
            said = "; ".join(str(finding) for finding in solution.findings if finding.severity == WARNING)
            alike = next(map(str, () if solution.model is None else solution.model.alike()), "")
            return ComparedRun(REACHED, said, observation, counts(solution.stats), repeated, took, alike)
        except _BeyondTimeLimit:
            return ComparedRun(
                TOO_LONG, f"more than {self.limit:g} s of computation", seconds=time.perf_counter() - began
            )
        except EomgenError as error:
            return ComparedRun(REFUSED, str(error))


def _options(configuration: Configuration, tolerance: float | None) -> dict[str, Any]:
    return {**configuration.parameters, **({} if tolerance is None else {"tolerance": tolerance})}


def _shorten_state(source: Model, target: Model, initial: Mapping[str, Any]) -> dict[str, Any]:
    """Return `initial` (``q``, ``v`` of `source`) with the components that a model of less fidelity has. These are the
    first components of each factor of the same name; further factors keep the target's initial q, and v = 0."""
    q, v = np.array(target.initial_q, dtype=float), np.zeros(target.nv)
    places = {factor.name: factor for factor in source.factors}
    for there in target.factors:
        if (here := places.get(there.name)) is not None:
            q[there.q] = np.asarray(initial["q"])[here.q][: there.q_size]
            v[there.v] = np.asarray(initial["v"])[here.v][: there.v_size]
    return {"q": q, "v": v}


def counts(stats: Mapping[str, Any]) -> dict[str, float]:
    """Return counts and measurements of a stepper, without times."""
    return {name: value for name, value in stats.items() if name != "wall_time" and isinstance(value, int | float)}


def measure_seconds(repeated: RepeatedRun, repeats: int) -> list[float]:
    """Return the processor's seconds for all steps of a run, measured ``repeats`` times on one core."""
    with one_core():
        return [repeated.seconds() for _ in range(repeats)]


#: Least number of coarsest steps in the run, if the scene's step allows.
LEAST_ROWS = 50
#: Least and largest number of times at which the reference is known.
LEAST_TIMES, MOST_TIMES = 4_000, 20_000
#: Largest number of doublings from the scene's step to the coarsest step.
MOST_DOUBLINGS = 6


def ladder_grid(end: float, step: float, interval: float, steps: Sequence[float]) -> Grid:
    """Return the grid of runs with a ladder of steps, all of which end together: with the last whole coarsest step
    before ``end``.

    The grid has 4000 rows or more, unless the given steps would need more than 20000.

    Parameters
    ----------
    end : of the runs, which begin at 0, s
    step, interval : the scene's step, and time between recorded rows, s
    steps : requested steps, if any, s

    Raises
    ------
    UsageError
        The run is shorter than one step.
    """
    if steps:
        row = max(steps)
    else:
        doublings = math.floor(math.log2(max(end / (LEAST_ROWS * step), 1.0)))
        row = step * 2.0 ** min(doublings, MOST_DOUBLINGS)
    rows = math.floor(end / row * (1.0 + SUMMED) + COMPUTED)
    if rows < 1:
        fault = f"the coarsest step, {row:.4g} s, does not fit into a run of {end:.4g} s [E1138]"
        raise UsageError(Problem("steps", fault, "smaller steps, or a later end"))
    coarse = Grid(row, rows)
    parts = 1
    for count in per_coarsest(coarse, steps):
        both = math.lcm(parts, count)
        if both * rows > MOST_TIMES:
            continue
        if steps or parts * rows < LEAST_TIMES or row / parts > interval * (1.0 + COMPUTED):
            parts = both
    while parts * rows < LEAST_TIMES:
        parts *= 2
    recorded = min(parts, max(1, round(interval * parts / row)))
    return Grid(row / parts, rows * parts, 0.0, parts, recorded)


def tuning_grid(end: float, step: float, interval: float) -> Grid:
    """Return the grid of runs with any step: the times include all rows recorded by the scene's runs, unless there are
    too many.

    Parameters
    ----------
    end, step, interval : end of runs from 0, the scene's step, and time between recorded rows, s

    Raises
    ------
    UsageError
        The run is shorter than one step.
    """
    if end < step * (1.0 - COMPUTED):
        fault = f"a step of {step:.4g} s does not fit into a run of {end:.4g} s [E1139]"
        raise UsageError(Problem("t_end", fault, f"{10.0 * step:.4g}"))
    row = min(interval, end)
    while end / row < LEAST_TIMES:
        row /= 2.0
    while end / row > MOST_TIMES * (1.0 + COMPUTED):
        row *= 2.0
    rows = math.floor(end / row + 1e-9)
    coarsest = max(1, min(rows // LEAST_ROWS, math.floor(step * 2.0**MOST_DOUBLINGS / row + COMPUTED)))
    return Grid(row, rows, 0.0, coarsest, max(1, round(min(interval, end) / row)))


def whole_steps(resolution: float, coarsest: int = 1) -> float:
    """Return the next number of steps in a row of the grid, not below ``resolution``, whose rows are all on the grid: a
    whole number, or one step in a whole number of rows."""
    if resolution > 1.0:
        return float(math.ceil(resolution * (1.0 - COMPUTED)))
    return 1.0 / max(1, min(coarsest, math.floor(1.0 / resolution * (1.0 + COMPUTED))))


def fraction_of(resolution: float) -> Fraction:
    """Return steps in a row of the grid, in the form of ``Runner.run``."""
    return Fraction(round(resolution)) if resolution > 1.0 else Fraction(1, round(1.0 / resolution))


def per_coarsest(coarse: Grid, steps: Sequence[float]) -> tuple[int, ...]:
    """Return the numbers of steps in a row of this grid, the coarsest step, coarsest first. They are 1 to 4096 by
    doubling without given `steps` (s). Raises UsageError for steps that do not divide the coarsest."""
    if not steps:
        return tuple(2**k for k in range(13))
    result = []
    for step in sorted(set(steps), reverse=True):
        count = round(coarse.row / step)
        if abs(coarse.row / step - count) > COMPUTED * count:
            fault = f"the step {step:.6g} s is not a whole part of the coarsest, {coarse.row:.6g} s [E1140]"
            hint = f"{coarse.row / math.ceil(coarse.row / step):.6g}, or steps each half of the one before"
            raise UsageError(Problem("steps", fault, hint))
        result.append(count)
    return tuple(result)
