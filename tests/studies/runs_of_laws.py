"""Runs of studies whose errors and times follow laws, in place of compiled models: errors of c h^order or c tolerance,
times by the number of steps."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np

from eomgen.errors import ModelError
from eomgen.integrators.families.register import method_named
from eomgen.lie.product import Factor
from eomgen.products.studies.work_precision.axes import Configuration
from eomgen.products.studies.work_precision.formulations import Formulations
from eomgen.products.studies.work_precision.observation import Observation
from eomgen.products.studies.work_precision.running import REACHED, ComparedRun, Grid
from eomgen.simulation.accuracy.motion_size import RunNames
from eomgen.system.description import Simulation

T = np.linspace(0.0, 1.0, 11)
NAMES = RunNames((Factor("R", "slide", 0, 1, 0, 1),), ("q.slide",), ("m",), ("m/s",), (), (), {"way": "m"})


def motion(error: float, start: float = 0.0, speed: float = 1.0) -> Observation:
    """Return a motion of one coordinate from its start on by 1, wrong by a part at its end."""
    q = (start + T * (1.0 + error * T))[:, None]
    none = np.zeros((11, 0))
    return Observation(T, q, np.full((11, 1), speed), none, none, NAMES, (), {}, {}, {"way": q})


@dataclass(frozen=True)
class Law:
    """Law of a method's runs.

    Attributes
    ----------
    size : error with one step in a row, or with the tolerance 1
    order : of the error in the step; for tolerances, steps go as tolerance^(-1/(order + 1))
    step : s, of one step
    """

    size: float
    order: int
    step: float

    def error(self, per_row: Fraction | int, tolerance: float | None) -> float:
        return self.size * (float(per_row) ** -self.order if tolerance is None else tolerance)

    def steps(self, rows: int, per_row: Fraction | int, tolerance: float | None) -> float:
        return float(rows * per_row) if tolerance is None else 10.0 * tolerance ** (-1.0 / (self.order + 1.0))


@dataclass
class Repeated:
    """A run that can be repeated for its time; each time is as the last."""

    time: float
    taken: int = 0

    def seconds(self) -> float:
        self.taken += 1
        return self.time


def model_of(**facts: Any) -> Any:
    """Return the facts of a model that methods and conditions ask for."""
    layout = {
        "facts": dict.fromkeys(("constant_mass", "velocity_forces", "smooth", "moving_base"), True),
        "built_method": "rk4",
        "defaults": {},
    }
    description = SimpleNamespace(simulation=Simulation(), outputs=(SimpleNamespace(name="way"),), laws=(), formulas=())
    return SimpleNamespace(**{
        "name": "law", "multipliers": (), "nz": 0, "nv": 1, "factors": NAMES.factors, "parameters": {}, "inputs": (),
        "functions": (), "library": SimpleNamespace(layout=layout), "description": description,
    } | facts)  # fmt: skip  # a table


@dataclass
class LawRunner:
    """What studies ask of a ``Runner``, with runs by laws.

    Attributes
    ----------
    law : of a configuration; None: the run is refused, a text: its model cannot be built
    harder : factor of errors of runs by their start
    """

    law: Callable[[Configuration], Law | str | None]
    grid: Grid
    scenes: tuple[str, ...] = ("joint",)
    simplified: tuple[str, ...] = ()
    models: Mapping[str, Any] = field(default_factory=dict)
    own: Configuration = field(default_factory=lambda: Configuration("joint", "rk4"))
    harder: Callable[[float], float] = lambda start: 1.0
    limit: float = 1e9
    parameters: Mapping[str, float] | None = None
    inputs: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        described = model_of().description
        scenes: dict[str, Any] = dict.fromkeys(self.scenes)
        self.formulations = Formulations(scenes, {}, self.simplified)
        vars(self.formulations)["description"] = described
        self.compiled: dict[str, float] = {}
        self.building = 0.0
        self.made: list[tuple[Configuration, float, dict[str, Any]]] = []
        self.repeated: list[Repeated] = []

    def model(self, name: str, real: str = "double", profile: str = "") -> Any:
        found = self.models.get(name, model_of())
        if isinstance(found, str):
            raise ModelError(found)
        return found

    def own_method(self) -> str:
        return self.own.method

    def own_configuration(self) -> Configuration:
        return self.own

    def method(self, configuration: Configuration, tolerance: float | None = None) -> Any:
        return method_named(configuration.method)

    def build_name(self, configuration: Configuration) -> str:
        return " ".join((configuration.formulation, configuration.real, configuration.profile, configuration.method))

    def prepare(self, configuration: Configuration) -> None:
        law = self.law(configuration)
        if isinstance(law, str):
            raise ModelError(law)
        self.compiled.setdefault(self.build_name(configuration), 1.0)

    def run(
        self,
        configuration: Configuration,
        per_row: Fraction | int = 1,
        tolerance: float | None = None,
        **given: Any,
    ) -> ComparedRun:
        self.made.append((configuration, float(per_row) if tolerance is None else tolerance, given))
        law = self.law(configuration)
        if not isinstance(law, Law):
            return ComparedRun("refused", law or f"{configuration.method} is refused")
        error = law.error(per_row, tolerance)
        start = 0.0
        if (initial := given.get("initial")) is not None:
            start = float(initial["q"][0])
            error *= self.harder(start)
        steps = law.steps(self.grid.rows, per_row, tolerance)
        time = law.step * steps
        self.repeated.append(Repeated(time))
        return ComparedRun(
            REACHED,
            "",
            motion(error, start),
            {"steps": steps},
            self.repeated[-1] if given.get("timed", True) else None,
            time,
        )


def cheapest(law: Law, rows: int, demand: float, coarsest: int) -> tuple[float, float]:
    """Return (resolution, seconds) of the coarsest whole steps that meet a demand, by trying one after another."""
    numbers = itertools.chain((Fraction(1, k) for k in range(coarsest, 1, -1)), map(Fraction, itertools.count(1)))
    found = next(number for number in numbers if law.error(number, None) <= demand)
    return float(found), law.step * law.steps(rows, found, None)
