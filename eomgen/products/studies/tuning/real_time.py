"""Real time: the most accurate fixed-step configuration whose work within each cycle ends in time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.files import write_text
from eomgen.errors import EomgenError, ModelError, NumericalError, Problem, UsageError
from eomgen.products.studies.tuning.result import with_settings
from eomgen.products.studies.work_precision.axes import Configuration, candidates, one_of_each, reason
from eomgen.products.studies.work_precision.formulations import Formulations
from eomgen.products.studies.work_precision.observation import Observation, check_output, errors
from eomgen.products.studies.work_precision.reference import RunReference, reference
from eomgen.products.studies.work_precision.running import REACHED, Grid, Runner, machine
from eomgen.simulation.timing import RepeatedRun, one_core

#: The part of cycles that end in time, and how many are measured.
PART, CYCLES = 0.9999, 10_000
#: Steps in a cycle at most, and times of the run that are compared.
MOST_STEPS, MOST_ROWS = 256, 20_000
#: Settings that bound the work of a step of an implicit method.
ITERATIONS, HALVINGS = "max_iterations", "max_halvings"
#: The part of the budget for the reference, and the required accuracy of the reference.
REFERENCE_SHARE, KNOWN = 0.2, 1e-9


@dataclass(frozen=True)
class RealTime:
    """Configuration for the time of a cycle.

    Attributes
    ----------
    cycle : s
    span : s of motion, over which errors are
    steps : in a cycle
    step : s
    late : processor's time that a part ``PART`` of the cycles stays below, s
    longest, mean : of all cycles, s
    iterations : of one step at most, bounded by the settings; 0 without iterations
    error : reached error, of ``quantity`` in ``measure``, at the ends of cycles, at which a controller reads the state
    uncertainty : of the reference
    tried : all measured configurations: label, steps in a cycle, late, error
    refused : configurations without bounded time, and the reasons
    """

    scene: str
    quantity: str
    measure: str
    cycle: float
    span: float
    configuration: Configuration
    steps: int
    step: float
    late: float
    longest: float
    mean: float
    iterations: int
    error: float
    uncertainty: float
    tried: tuple[tuple[str, int, float, float], ...]
    refused: Mapping[str, str]
    machine: Mapping[str, str]
    simulation: Mapping[str, Any]
    source: Path | None = None

    @property
    def why(self) -> str:
        """One line: the configuration, and the measured times with the processor."""
        bound = f", {self.iterations} iterations a step at most" if self.iterations else ""
        return (
            f"{self.configuration.label}, step {self.step:.4g} s ({self.steps} in a cycle{bound}): "
            f"{100.0 * PART:g} % of the cycles take less than {1e6 * self.late:.4g} us of {1e6 * self.cycle:.6g} us, "
            f"the longest {1e6 * self.longest:.4g} us; error {self.error:.1e} of {self.quantity} at ends of cycles, "
            f"over the first {self.span:.4g} s; "
            f"measured on {self.machine['processor']}, {self.machine['compiler']}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return all attributes as JSON data.

        Returns
        -------
        dict
            JSON types.
        """
        own = {name: value for name, value in vars(self).items() if name not in ("configuration", "source")}
        return {**own, **self.configuration.to_dict(), "why": self.why}

    def save(self, path: str | Path) -> Path:
        """Write the scene's file with these settings and the comments of the file. Raises UsageError, FileError.

        Parameters
        ----------
        path : path
            New ``.toml`` file.

        Returns
        -------
        Path
            The file.
        """
        write_text(Path(path), with_settings(self.source, self.simulation, "", ""))
        return Path(path)


def real_time(
    formulations: Formulations,
    cycle: float,
    *,
    output: str,
    measure: str,
    methods: Sequence[str],
    t_end: float | None,
    parameters: Mapping[str, float] | None,
    inputs: Mapping[str, Any] | None,
    iterations: int | None,
    budget: float,
    say: Callable[[str], None],
    source: Path | None,
) -> RealTime:
    """Return the most accurate configuration of a scene's own formulation whose cycles end in time.

    Parameters
    ----------
    cycle : s of motion that are to be computed within as many seconds
    iterations : bound on Newton's iterations of a step; by default the run's largest number

    Raises
    ------
    UsageError
        A cycle that is not positive or longer than the run.
    NumericalError
        No configuration ends in time, or none converges within the bound: with the needed iterations.
    """
    defaults = formulations.simulation
    end = defaults.duration if t_end is None else t_end
    if not (math.isfinite(cycle) and 0.0 < cycle <= end):
        raise UsageError(
            Problem("real_time", f"a cycle lies within the run of {end:g} s, not {cycle:g} s [E1116]", "1e-3")
        )
    rows = min(math.floor(end / cycle + 1e-9), MOST_ROWS)
    runner = Runner(formulations, Grid(cycle, rows), parameters, inputs, limit=max(1.0, 0.3 * budget))
    name = formulations.own
    model = runner.model(name)
    check_output("output", output, model)
    refused: dict[str, str] = {}
    every = candidates(name, model, methods, refused)
    fixed = [c for c in one_of_each(every) if not c.method.chooses_steps]
    if not fixed:
        fault = "no method with steps of equal work runs on this scene [E1117]"
        raise ModelError(Problem("real_time", fault, "methods that do not choose their steps"))
    held = reference(runner, every, REFERENCE_SHARE * budget, say, settled=KNOWN, count=1, first_steps=1)
    work = _Work(runner, held, output, measure, iterations, refused, say, time.perf_counter() + budget)
    usual = {"rho_inf": defaults.rho_inf}
    bought = work.bought([c.configuration(usual) for c in fixed], cycle)
    best = work.proven([one for one in bought if one.late <= cycle], cycle)
    if best is None:
        raise NumericalError(_nothing(bought, refused, cycle))
    interval = defaults.step * defaults.record_every
    step = cycle / best.steps
    keys = {"method": best.configuration.method, "step": step, "record_every": max(1, round(interval / step))}
    return RealTime(
        scene=model.name,
        quantity=output,
        measure=measure,
        cycle=cycle,
        span=rows * cycle,
        configuration=best.configuration,
        steps=best.steps,
        step=step,
        late=best.late,
        longest=best.longest,
        mean=best.mean,
        iterations=best.iterations,
        error=best.error,
        uncertainty=held.bar(output, measure),
        tried=tuple((one.configuration.label, one.steps, one.late, one.error) for one in bought),
        refused=refused,
        machine=machine(),
        simulation=keys | best.configuration.of_scene(),
        source=source,
    )


@dataclass(frozen=True)
class _Bought:
    configuration: Configuration
    steps: int
    late: float
    longest: float
    mean: float
    iterations: int
    error: float


@dataclass
class _Work:
    """Measures the costs of configurations in each cycle."""

    runner: Runner
    held: RunReference
    quantity: str
    measure: str
    bound: int | None
    refused: dict[str, str]
    say: Callable[[str], None]
    until: float

    def bought(self, configurations: Sequence[Configuration], cycle: float) -> list[_Bought]:
        """Return errors of configurations with 1, 2, 4, ... steps in a cycle, each until cycles end late; all
        configurations run once over the whole span."""
        opened = [configuration for configuration in configurations if self._prepared(configuration)]
        result: list[_Bought] = []
        steps, floor = 1, max(KNOWN, self.held.bar(self.quantity, self.measure))
        while opened and steps <= MOST_STEPS and time.perf_counter() < self.until:
            for configuration in list(opened):
                self.say(f"{configuration.label}, {steps} in a cycle")
                made = self._measured(configuration, steps)
                if made is not None:
                    result.append(made)
                    if 0.5 * made.late > cycle or made.error <= floor:
                        opened.remove(configuration)
            steps *= 2
        return result

    def _prepared(self, configuration: Configuration) -> bool:
        self.say(f"building: {configuration.label}")
        try:
            self.runner.prepare(configuration)
        except EomgenError as error:
            self.refused[configuration.label] = reason(error)
            return False
        return True

    def _measured(self, configuration: Configuration, steps: int) -> _Bought | None:
        label = f"{configuration.label}, {steps} in a cycle"
        run = self._run(configuration, steps, label)
        if run is None:
            return None
        times, needed = _cycles(run[1], steps, 1)
        if needed:
            allowed = needed if self.bound is None else self.bound
            settings = {**configuration.settings, ITERATIONS: float(allowed), HALVINGS: 0.0}
            configuration = configuration.varied(settings=settings)
            run = self._run(configuration, steps, label)
            if run is None:
                self.refused[label] = f"{allowed} iterations a step do not converge: {needed} are needed"
                return None
            times, needed = _cycles(run[1], steps, 1)
        size = errors(run[0], self.held.observation)[self.quantity]
        late = float(np.quantile(times, PART, method="higher"))
        error = float(getattr(size, self.measure))
        return _Bought(configuration, steps, late, float(times.max()), float(times.mean()), needed, error)

    def proven(self, able: Sequence[_Bought], cycle: float) -> _Bought | None:
        """Return the most accurate configuration that ends in time over ``CYCLES`` cycles, too."""
        for one in sorted(able, key=lambda one: (max(one.error, self.held.bar(self.quantity, self.measure)), one.late)):
            self.say(f"{one.configuration.label}, {one.steps} in a cycle: {CYCLES} cycles")
            run = self._run(one.configuration, one.steps, one.configuration.label)
            if run is None:
                continue
            times, needed = _cycles(run[1], one.steps, CYCLES)
            late = float(np.quantile(times, PART, method="higher"))
            if late <= cycle:
                own = (one.configuration, one.steps, late, float(times.max()), float(times.mean()), needed, one.error)
                return _Bought(*own)
        return None

    def _run(self, configuration: Configuration, steps: int, label: str) -> tuple[Observation, RepeatedRun] | None:
        outcome = self.runner.run(configuration, steps, estimated=False)
        if outcome.ended != REACHED or outcome.observation is None or outcome.repeated is None:
            self.refused[label] = outcome.said
            return None
        return outcome.observation, outcome.repeated


def _cycles(repeated: RepeatedRun, steps: int, count: int) -> tuple[Array, int]:
    """Return the seconds of each cycle, of at least ``count`` cycles, and the largest number of iterations of a
    step."""
    cycles: list[Array] = []
    most = 0
    with one_core():
        while sum(len(times) for times in cycles) < count:
            times, iterations = repeated.seconds_of_steps()
            whole = len(times) // steps * steps
            cycles.append(times[:whole].reshape(-1, steps).sum(axis=1))
            most = max(most, iterations)
    return np.concatenate(cycles), most


def _nothing(bought: Sequence[_Bought], refused: Mapping[str, str], cycle: float) -> Problem:
    if bought:
        first = min(bought, key=lambda one: one.late)
        fault = (
            f"nothing ends in time: the fastest, {first.configuration.label}, takes {1e6 * first.late:.3g} us of "
            f"{1e6 * cycle:.3g} us [E1118]"
        )
        return Problem("real_time", fault, "a longer cycle, another formulation, or a faster processor")
    reasons = "; ".join(f"{name}: {why}" for name, why in list(refused.items())[:4])
    return Problem(
        "real_time", f"nothing runs in bounded time: {reasons} [E1119]", "more iterations, or a shorter cycle"
    )
