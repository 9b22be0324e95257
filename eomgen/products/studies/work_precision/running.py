"""Runs of a study: models of its configurations, built once each, and results, costs and messages of runs; the
machine that they are measured on."""

from __future__ import annotations

import platform
import time
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.version import __version__
from eomgen.errors import EomgenError, ToolchainError
from eomgen.integrators.families.family import Family
from eomgen.integrators.families.register import row_of
from eomgen.integrators.methods import method_named, method_parameters
from eomgen.pipeline import pipeline
from eomgen.pipeline.model import Model
from eomgen.products.studies.work_precision.axes import Configuration
from eomgen.products.studies.work_precision.formulations import Formulations, same_start
from eomgen.products.studies.work_precision.observation import Observation, observed
from eomgen.simulation.automatic_method import method_of
from eomgen.simulation.timing import Repeated, one_core
from eomgen.toolchain.compiler import find_compiler
from eomgen.toolchain.profiles import STANDARD_PROFILE


def machine() -> dict[str, str]:
    """Return processor, system, compiler and versions by name."""
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


#: How a run may end: at its end, before it, not begun, or given up because it took too long.
REACHED, STOPPED, REFUSED, TOO_LONG = "reached", "stopped", "refused", "too long"


class _TooLong(Exception):
    """A run that took longer than it may."""


@dataclass(frozen=True)
class Grid:
    """The times at which a reference is known: runs are compared at all of them that they record.

    Attributes
    ----------
    row : s between two of them
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
class Outcome:
    """Result of one run.

    Attributes
    ----------
    ended : how, one of the words above
    said : message of the run besides that it reached its end; reason for which it did not
    observation : None if it did not reach its end
    stats : counts of the stepper
    repeated : for timing, None if there is no step to time
    seconds : of the whole call of ``simulate``
    """

    ended: str
    said: str
    observation: Observation | None = None
    stats: Mapping[str, float] = field(default_factory=dict)
    repeated: Repeated | None = None
    seconds: float = 0.0


class Runner:
    """Builds models and runs them over one grid of times.

    Parameters
    ----------
    formulations : Formulations
    grid : Grid
    parameters, inputs : as of ``simulate``
    limit : float
        Seconds that a run may take.
    """

    def __init__(
        self,
        formulations: Formulations,
        grid: Grid,
        parameters: Mapping[str, float] | None = None,
        inputs: Mapping[str, Any] | None = None,
        limit: float = 10.0,
    ) -> None:
        self.formulations = formulations
        self.grid = grid
        self.parameters = dict(parameters or {}) or None
        self.inputs = dict(inputs or {}) or None
        self.limit = limit
        #: Seconds of building, by model, and by model and method; short if the cache had it.
        self.compiled: dict[str, float] = {}
        self._models: dict[tuple[str, str, str], Model] = {}
        #: The processor's seconds of building in this process.
        self.building = 0.0
        self._starts: dict[tuple[Any, ...], dict[str, Any] | None] = {}

    def model(self, formulation: str, real: str = "double", profile: str = STANDARD_PROFILE) -> Model:
        """Return the model of a formulation. Raises EomgenError."""
        key = (formulation, real, profile)
        if key not in self._models:
            with self._building(" ".join(key)), warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                self._models[key] = pipeline.build(self.formulations.scenes[formulation], real=real, profile=profile)
        return self._models[key]

    def own_method(self) -> str:
        """Return the scene's method; in place of ``auto`` the one that its run takes."""
        model = self.model(self.formulations.own)
        p = model.parameter_array(self.parameters)
        chosen, _ = method_of(model, None, None, p, self.grid.start, model.description.simulation.step)
        return chosen or str(model.library.layout["built_method"])

    def own_configuration(self) -> Configuration:
        """Return the scene's own configuration, with the parameters that its method takes, and settings of the method
        that the scene is built with."""
        own, method = self.formulations.own, self.own_method()
        model = self.model(own)
        simulation, built = model.description.simulation, str(model.library.layout["built_method"])
        taken = [name for name in row_of(method)[1].parameters if name in ("alpha", "beta", "gamma")]
        given = {name: value for name in taken if (value := getattr(simulation, name))}
        settings = dict(simulation.settings) if method == built else {}
        return Configuration(own, method, given, settings=settings, real=simulation.real)

    def method(self, configuration: Configuration, tolerance: float | None = None) -> Family:
        """Return the method of a configuration. Raises EomgenError."""
        given = {**configuration.parameters, **({} if tolerance is None else {"tolerance": tolerance})}
        model = self.model(configuration.formulation, configuration.real, configuration.profile)
        defaults = model.library.layout["defaults"]
        return method_named(configuration.method, **method_parameters(configuration.method, given, defaults))

    def build_name(self, configuration: Configuration) -> str:
        """Return the key of the build of a configuration's method in ``compiled``."""
        return " ".join((configuration.formulation, configuration.real, configuration.profile, configuration.method))

    def prepare(self, configuration: Configuration) -> None:
        """Build the model of a configuration, so that runs themselves build none. Raises EomgenError."""
        key = (configuration.formulation, configuration.real, configuration.profile)
        name = self.build_name(configuration)
        model = self.model(*key)
        if name not in self.compiled:
            with self._building(name):
                model.stepper(configuration.method)

    @contextmanager
    def _building(self, name: str) -> Iterator[None]:
        """Take the time of a build; one that fails has taken the processor's, too."""
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
        """Return the initial state of a formulation: the scene's own if requested, None for the scene's default, for
        others the state of the own one.

        Loops are closed from guesses, each formulation's in a way of its own.
        """
        name = self.formulations.own
        if formulation == name:
            return initial
        given = None if initial is None else tuple(np.asarray(part, dtype=float).tobytes() for part in initial.values())
        key = (formulation, start, given, tuple((parameters or {}).items()))
        if key not in self._starts:
            own, other = self.model(name), self.model(formulation)
            if formulation in self.formulations.simplified:
                return None if initial is None else _shortened(own, other, initial)
            able = "poses" in own.functions and "twists" in own.functions
            h = 1e-6 * self.grid.row
            first = own.simulate(
                start + h, h, t_start=start, initial=initial, parameters=parameters, inputs=inputs, error_estimate=False
            )
            state = first.q[0], first.v[0]
            same = same_start(own, *state, other, start, parameters) if able else None
            self._starts[key] = same if same is None or not other.nz else {**same, "z": first.z[0]}
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
    ) -> Outcome:
        """Return the results of a configuration with so many steps in a row of the grid, or with a tolerance.

        Parameters
        ----------
        per_row : p/q: p steps in q rows; not used with a tolerance
        dense : whether all rows are recorded, in place of the rows that a run of the scene's file would record:
            ``Grid.recorded`` apart, or every step if these are not whole steps
        initial : of this run, ``q`` and ``v`` of the scene's own formulation, for any formulation that runs
        parameters, inputs : of this run, in place of the study's
        later : rows of the grid by which this run begins later; it ends with the others
        timed : whether the run may be repeated for its time
        estimated : whether it estimates its error, which it may then speak of
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
                raise _TooLong

        given: dict[str, Any] = {**configuration.parameters, **({} if tolerance is None else {"tolerance": tolerance})}
        try:
            self.prepare(configuration)
            model = self.model(configuration.formulation, configuration.real, configuration.profile)
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
                    **given,
                )
            took = time.perf_counter() - began
            if not solution.success:
                return Outcome(STOPPED, solution.message, stats=counts(solution.stats), seconds=took)
            observation = observed(model, solution)
            if len(solution.t) != recorded + 1 or not np.all(np.isfinite(observation.q)):
                return Outcome(STOPPED, "its rows are not at the times of the grid, or not finite", seconds=took)
            repeated = Repeated(model, solution, self.method(configuration, tolerance), inputs) if timed else None
            said = solution.message.partition("; ")[2]
            return Outcome(REACHED, said, observation, counts(solution.stats), repeated, took)
        except _TooLong:
            return Outcome(TOO_LONG, f"more than {self.limit:g} s of computation", seconds=time.perf_counter() - began)
        except EomgenError as error:
            return Outcome(REFUSED, str(error))


def _shortened(own: Model, other: Model, initial: Mapping[str, Any]) -> dict[str, Any]:
    """Return an initial state with the components that a scene of less fidelity has: the first of each factor."""
    q, v = np.array(other.initial_q, dtype=float), np.zeros(other.nv)
    places = {factor.name: factor for factor in own.factors}
    for there in other.factors:
        if (here := places.get(there.name)) is not None:
            q[there.q] = np.asarray(initial["q"])[here.q][: there.q_size]
            v[there.v] = np.asarray(initial["v"])[here.v][: there.v_size]
    return {"q": q, "v": v}


def counts(stats: Mapping[str, Any]) -> dict[str, float]:
    """Return counts and measurements of a stepper, without times."""
    return {name: value for name, value in stats.items() if name != "wall_time" and isinstance(value, int | float)}


def timed(repeated: Repeated, repeats: int) -> list[float]:
    """Return the processor's seconds for all steps of a run, so many times, on one core."""
    with one_core():
        return [repeated.seconds() for _ in range(repeats)]
