"""Entries of a race: one method of each family first, then neighbours of the winner, then other formulations."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from eomgen.errors import EomgenError
from eomgen.products.studies.method_facts import facts_of
from eomgen.products.studies.tuning.race import Contender, Race
from eomgen.products.studies.work_precision.axes import (
    TOLERANCE,
    Candidate,
    Configuration,
    candidates,
    one_of_each,
    reason,
)
from eomgen.products.studies.work_precision.times import whole_steps
from eomgen.system.description import Simulation

#: The first run of a contender has steps this many times the scene's.
FIRST_STEP = 8.0
#: Methods that choose their steps begin with a tolerance of the demand, those below this order with a larger one.
FULL_ORDER = 5
#: The largest tolerance to begin with.
COARSEST = 0.1
#: Single precision is tried for demands from this on.
SINGLE = 1e-5
#: Another formulation whose step takes this many times the winner's, or more, runs no more, nor do others of its kind.
DEARER = 3.0


@dataclass
class Entries:
    """Enters contenders into a race.

    Attributes
    ----------
    own : candidates of the scene's own formulation
    others : names of other formulations, ones of less fidelity first
    axes : along which configurations may vary
    defaults : of the scene
    """

    race: Race
    own: Sequence[Candidate]
    others: Sequence[str]
    axes: Sequence[str]
    methods: tuple[str, ...]
    defaults: Simulation
    say: Callable[[str], None]

    def raced(self) -> list[Contender]:
        """Return all contenders when their race is over."""
        usual = {"rho_inf": self.defaults.rho_inf}
        contenders = [self._contender(c, c.configuration(usual)) for c in one_of_each(self.own)]
        best = self.varied(contenders, self.race.run(contenders))
        for name in self.others:
            best = self._also(contenders, best, self._formulated(name, best))
            if name in self.race.runner.formulations.simplified:
                continue
            if best is not None and any(self._dearer(c, best) for c in contenders if c.candidate.formulation == name):
                rest = self.others[self.others.index(name) + 1 :]
                why = f"a step on {name} takes more than {DEARER:g} times as long as the best one's"
                self.race.left_out.update(dict.fromkeys(rest, why))
                break
        return contenders

    def varied(self, contenders: list[Contender], best: Contender | None) -> Contender | None:
        """Return the best when its neighbours have raced: relatives first, then settings; entries that have are left
        out."""
        for near in (self._relatives, self._settings):
            entered = {contender.configuration.key for contender in contenders}
            best = self._also(contenders, best, [c for c in near(best) if c.configuration.key not in entered])
        return best

    def _also(self, contenders: list[Contender], best: Contender | None, added: list[Contender]) -> Contender | None:
        """Return the best with others in the race."""
        reached = math.inf if best is None else best.seconds(self.race.demand)
        better = self.race.run(added, reached) if added else None
        contenders += added
        return better if better is not None and better.seconds(self.race.demand) < reached else best

    def _contender(self, candidate: Candidate, configuration: Configuration) -> Contender:
        if candidate.method.chooses_steps:
            return Contender(
                candidate, configuration, TOLERANCE, 1.0 / first_tolerance(candidate.method.order, self.race.demand)
            )
        grid = self.race.runner.grid
        first = whole_steps(grid.row / (FIRST_STEP * self.defaults.step), grid.coarsest)
        return Contender(candidate, configuration, "step", first, grid.coarsest)

    def _near(self, best: Contender, candidate: Candidate, configuration: Configuration) -> Contender:
        """Return a contender that begins with the winner's resolution."""
        contender = self._contender(candidate, configuration)
        reached = best.best(self.race.demand)
        if reached is not None and contender.kind == best.kind:
            contender.start = reached.resolution
        return contender

    def _relatives(self, best: Contender | None) -> list[Contender]:
        """Return other methods of the winner's family, and other values of its parameters.

        Methods that are another one of the family with a parameter's value are left to that one.
        """
        if best is None or "parameters" not in self.axes:
            return []
        result = []
        for candidate in self.own:
            row = candidate.row
            if candidate.family is not best.candidate.family or not (candidate.facts.compared or row.differs):
                continue
            for configuration in candidate.configurations(parameters=True, own={}):
                if configuration.key != best.configuration.key:
                    result.append(self._near(best, candidate, configuration))
        return result

    def _settings(self, best: Contender | None) -> list[Contender]:
        """Return the winner with other settings of its iteration, and in single precision."""
        if best is None:
            return []
        policies = facts_of(best.configuration.method).policies
        varied = []
        if "policy" in self.axes:
            varied += [best.configuration.varied(policy=name, settings=s) for name, s in policies.items()]
        if "arithmetic" in self.axes and self.race.demand >= SINGLE:
            varied.append(best.configuration.varied(real="float"))
        return [self._near(best, best.candidate, configuration) for configuration in varied]

    def _formulated(self, name: str, best: Contender | None) -> list[Contender]:
        """Return contenders on another formulation: the winner's family if it runs there, else one of each."""
        self.say(f"building: {name}")
        try:
            there = candidates(name, self.race.runner.model(name), self.methods, self.race.left_out)
        except EomgenError as error:
            self.race.left_out[name] = reason(error)
            return []
        first = one_of_each(there)
        same = [c for c in first if best is not None and c.family is best.candidate.family]
        usual = {"rho_inf": self.defaults.rho_inf}
        result = []
        for candidate in same or first:
            configuration = candidate.configuration(usual)
            if best is not None and candidate.family is best.candidate.family:
                result.append(self._near(best, candidate, configuration))
            else:
                result.append(self._contender(candidate, configuration))
        return result

    def _dearer(self, there: Contender, best: Contender) -> bool:
        """Return whether a step there takes so much longer than the best one's that others of its kind need not run."""
        reached = best.best(self.race.demand)
        if reached is None or not reached.steps:
            return False
        per_step = [run.seconds / run.steps for run in there.runs if run.steps]
        return bool(per_step) and min(per_step) > DEARER * reached.seconds / reached.steps


def first_tolerance(order: int, demand: float) -> float:
    """Return the tolerance at which a method takes about as many steps as one of ``FULL_ORDER`` takes at the demand.

    Steps are as many as tolerance^(-1/(order + 1)): of order 2, a demand of 1e-8 would take hundreds of thousands.
    """
    return float(min(COARSEST, demand ** min(1.0, (order + 1) / (FULL_ORDER + 1))))
