"""The axes of a study, and the configurations of a scene along them, cut to differences that matter to it."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

from eomgen.base.calls import names_of
from eomgen.base.data import dataclass, field, replace
from eomgen.base.messages import nearest, shown
from eomgen.errors import EomgenError, ModelError, Problem, UsageError
from eomgen.integrators.families.family import Family, MethodName
from eomgen.integrators.families.register import BUILT_IN, check_needs, families_of_others, method_named, row_of
from eomgen.pipeline.model import Model
from eomgen.products.studies.method_facts import MethodFacts, facts_of
from eomgen.system.system import Facts
from eomgen.toolchain.profiles import STANDARD_PROFILE


@dataclass(frozen=True)
class Configuration:
    """All that decides a run's speed and error, but the step or tolerance.

    Attributes
    ----------
    formulation : name of a formulation of the study
    method : public name
    parameters : of the method, if different from the defaults
    policy : name of the settings, empty for the defaults
    settings : of the stepper, if different from the defaults
    real, profile : as of ``eomgen.build``
    """

    formulation: str
    method: str
    parameters: Mapping[str, float] = field(default_factory=dict)
    policy: str = ""
    settings: Mapping[str, float] = field(default_factory=dict)
    real: str = "double"
    profile: str = STANDARD_PROFILE

    @property
    def label(self) -> str:
        """Words for pictures and tables: method, ``parameters``, formulation, then ``policy``, ``real`` and ``profile``
        if different from the defaults; ``settings`` are left out."""
        values = [f"{name} {value:g}" for name, value in self.parameters.items()]
        unusual = [
            self.policy,
            self.real if self.real != "double" else "",
            self.profile if self.profile != STANDARD_PROFILE else "",
        ]
        return ", ".join(filter(None, [" ".join((self.method, *values)), self.formulation, *unusual]))

    @property
    def key(self) -> str:
        """A text that no other configuration has."""
        return json.dumps(self.to_dict(), sort_keys=True)

    def simulation_keys(self) -> dict[str, Any]:
        """Return the keys of a scene's section ``simulation`` besides the method that differ from the defaults."""
        settings = {"settings": dict(self.settings)} if self.settings else {}
        return {**self.parameters, **settings, **({"real": self.real} if self.real != "double" else {})}

    def to_dict(self) -> dict[str, Any]:
        return {**vars(self), "parameters": dict(self.parameters), "settings": dict(self.settings)}


#: The axes of a study; ``fidelity`` is of beams, with errors against the scene described.
AXES = ("formulation", "method", "parameters", "resolution", "policy", "arithmetic", "profile", "fidelity")
#: Axes that are varied only by request.
NAMED = ("fidelity",)
#: The parameter of methods with adaptive steps.
TOLERANCE = "tolerance"
#: Compared values of the tolerance if the method has none in its facts.
COMPARED_TOLERANCES = tuple(10.0**-k for k in range(2, 13))


@dataclass(frozen=True)
class Candidate:
    """A method that runs on a formulation.

    Attributes
    ----------
    family, row : of the register
    method : with default parameters
    tolerances : worth comparing, for adaptive methods
    """

    formulation: str
    family: type[Family]
    row: MethodName
    method: Family
    tolerances: tuple[float, ...]

    @property
    def facts(self) -> MethodFacts:
        """Facts of studies about the method."""
        return facts_of(self.row.name)

    def configuration(self, settings: Mapping[str, float]) -> Configuration:
        """Return the method with one value of each parameter: ``settings``'s, else the usual one."""
        kept = {name: settings[name] for name in self.facts.compared if name in settings}
        return Configuration(self.formulation, self.row.name, kept)

    def configurations(self) -> Iterator[Configuration]:
        """Yield the method with the compared values of its parameters."""
        compared = {name: values for name, values in self.facts.compared.items() if name != TOLERANCE}
        for values in itertools.product(*compared.values()):
            settings = dict(zip(compared, values, strict=True))
            if possible(self.row.name, settings):
                yield Configuration(self.formulation, self.row.name, settings)


def checked_axes(names: Sequence[str], fixed: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the requested axes; if none are named all but ``NAMED``. Raises UsageError, also for ``fixed`` axes,
    which ``eomgen.tune`` does not vary."""
    known = [name for name in AXES if name not in fixed]
    for name in names_of("axes", "axes", names, "policy"):
        if name in fixed:
            fault = f"eomgen.tune does not vary the axis {name} [E2246]"
            raise UsageError(Problem("axes", fault, f"one of {', '.join(known)}; or eomgen.tradeoff, which varies it"))
        if name not in known:
            raise UsageError(Problem("axes", f"there is no axis {shown(name)} [E0735]", nearest(name, known)))
    return tuple(names) or tuple(name for name in known if name not in NAMED)


def candidates(
    formulation: str,
    model: Model,
    methods: Sequence[str],
    refused: dict[str, str],
    chosen: Callable[[MethodFacts], bool] = lambda facts: facts.studied,
) -> tuple[Candidate, ...]:
    """Return the methods that a formulation can be stepped with, as candidates.

    Parameters
    ----------
    formulation, model : name and model of the formulation
    methods : wanted names; all that make a difference to the scene if there are none
    chosen : whether a method is one of the wanted ones, if none are named
    refused : filled with the reasons for which methods cannot run, by formulation and method

    Raises
    ------
    UsageError
        An unknown method.
    """
    facts = Facts(**{name: bool(value) for name, value in model.library.layout["facts"].items()})
    has = {"constraints": bool(model.multipliers), "rotations": any(f.group != "R" for f in model.factors)}
    if methods:
        rows = [row_of(name) for name in methods]
    else:
        families = (*BUILT_IN, *families_of_others())
        rows = [(family, row) for family in families for row in family.names() if chosen(facts_of(row.name))]
    result = []
    for family, row in dict.fromkeys((family, row.name) for family, row in rows):
        name = row_of(row)[1]
        if not methods and not all(has[fact] for fact in name.differs):
            continue
        try:
            method = method_named(row)
            check_needs(method, facts)
        except (ModelError, UsageError) as error:
            if methods or isinstance(error, UsageError):
                refused[f"{row}, {formulation}"] = reason(error)
            continue
        result.append(Candidate(formulation, family, name, method, _tolerances(name)))
    return tuple(result)


def refinements(configuration: Configuration, axes: Collection[str]) -> list[Configuration]:
    """Return a configuration with other settings of its method, in single precision and in other profiles of a build,
    each alone, as far as these axes are varied."""
    policies = facts_of(configuration.method).policies if "policy" in axes else {}
    return [
        *(replace(configuration, policy=name, settings=settings) for name, settings in policies.items()),
        *(replace(configuration, real=name) for name in ("float",) if "arithmetic" in axes),
        *(replace(configuration, profile=name) for name in ("reproducible", "quick") if "profile" in axes),
    ]


def one_of_each(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the first method of each family."""
    first: dict[type, Candidate] = {}
    for candidate in candidates:
        first.setdefault(candidate.family, candidate)
    return list(first.values())


def reason(error: EomgenError) -> str:
    """Return the fault without the remedy."""
    return "; ".join(dict.fromkeys(problem.what for problem in error.problems)) or str(error)


def _tolerances(row: MethodName) -> tuple[float, ...]:
    """Return the tolerances to compare of an adaptive method by one."""
    values = facts_of(row.name).compared.get(TOLERANCE, COMPARED_TOLERANCES) if TOLERANCE in row.parameters else ()
    return tuple(x for x in values if possible(row.name, {TOLERANCE: x}, chooses_steps=True))


def possible(name: str, parameters: Mapping[str, float], *, chooses_steps: bool = False) -> bool:
    """Return whether a method has these parameters, and chooses its steps with them if ``chooses_steps``."""
    try:
        method = method_named(name, **parameters)
    except EomgenError:
        return False
    return method.chooses_steps or not chooses_steps
