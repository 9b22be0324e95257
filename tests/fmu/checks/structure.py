"""Rules for the model structure: lists that are complete, dependencies that are knowns, and kinds of dependencies."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tests.fmu.checks.document import Element, Report
from tests.fmu.checks.grammar import integer
from tests.fmu.checks.variables import Variable, Variables

#: Kinds of dependencies.
KINDS = ("dependent", "constant", "fixed", "tunable", "discrete")
#: Kinds of dependencies of initial unknowns.
_INITIAL_KINDS = ("dependent", "constant")
#: Element and list of FMI 2.0 by the element of FMI 3.0.
_LISTS = {"Output": "Outputs", "ContinuousStateDerivative": "Derivatives", "InitialUnknown": "InitialUnknowns"}


class Structure:
    """The lists of a model structure.

    Parameters
    ----------
    root : of the document, or of a manifest with another structure
    """

    def __init__(self, root: Element, variables: Variables, report: Report) -> None:
        self.element, self.variables, self.report = root.first("ModelStructure"), variables, report

    def entries(self, name: str) -> list[tuple[Element, Variable | None]]:
        """Return the entries of a list, named as in FMI 3.0, with the variables."""
        if self.element is None:
            return []
        key = "valueReference" if self.variables.standard.third else "index"
        if self.variables.standard.third:
            elements = self.element.all(name)
        else:
            section = self.element.first(_LISTS.get(name, ""))
            elements = [] if section is None else section.all("Unknown")
        return [(x, self.variables.referred(integer(x.attributes.get(key, "")))) for x in elements]

    def check(self, name: str, expected: Sequence[Variable], rule: str, *, complete: bool = True) -> None:
        """Report entries of no expected variable, entries that repeat, and expected variables without an entry."""
        seen = set[int]()
        wanted = {variable.index for variable in expected}
        for element, variable in self.entries(name):
            if variable is None:
                self.report.add(element, "the entry names no variable", name)
            elif variable.index in seen:
                self.report.add(element, f'"{variable.name}" is listed twice', name)
            elif variable.index not in wanted:
                self.report.add(element, f'"{variable.name}" must not be listed', f"{name}: {rule}")
            seen |= set() if variable is None else {variable.index}
        for variable in expected if complete else ():
            if variable.index not in seen:
                self.report.add(variable.element, f"{name} does not list the variable", f"{name}: {rule}")

    def check_dependencies(self, name: str, known: Callable[[Variable], bool], kinds: Sequence[str]) -> None:
        """Report dependencies on variables that are not known, and kinds without dependencies."""
        for element, unknown in self.entries(name):
            keys, given = element.attributes.get("dependencies"), element.attributes.get("dependenciesKind")
            if keys is None:
                if given is not None:
                    self.report.add(element, "there are kinds and no dependencies", "dependenciesKind")
                continue
            numbers = keys.split()
            for key in sorted({key for key in numbers if numbers.count(key) > 1}):
                self.report.add(element, f"the dependency {key} is listed twice", "dependencies")
            for key in numbers:
                target = self.variables.referred(integer(key))
                if target is None:
                    self.report.add(element, f"the dependency {key} names no variable", "dependencies")
                elif not known(target):
                    cause = f'the dependency {key}, "{target.name}", does not belong to the knowns of this entry'
                    self.report.add(element, cause, f"knowns of {name}")
            if given is not None:
                self._check_kinds(element, unknown, given.split(), len(numbers), kinds)

    def _check_kinds(
        self, element: Element, unknown: Variable | None, given: Sequence[str], count: int, kinds: Sequence[str]
    ) -> None:
        if len(given) != count:
            cause = f"{count} dependencies have {len(given)} kinds"
            self.report.add(element, cause, "dependenciesKind")
        for kind in sorted(set(given) - set(kinds)):
            self.report.add(element, f'the kind "{kind}" is not one of {", ".join(kinds)}', "dependenciesKind")
        if unknown is not None and not unknown.floating and set(given) - {"dependent"}:
            self.report.add(element, f"an unknown of type {unknown.kind} has the kind dependent", "dependenciesKind")


def check_structure(root: Element, variables: Variables, report: Report) -> None:
    """Report faults of the model structure."""
    structure, third = Structure(root, variables, report), variables.standard.third
    outputs = [variable for variable in variables.all if variable.causality == "output"]
    structure.check("Output", outputs, 'all variables with causality="output"')
    rates = [variable for variable in variables.all if variable.derivative is not None]
    exchange = root.first("ModelExchange") is not None
    rule = "all derivatives of states, in the order of the states"
    structure.check("ContinuousStateDerivative", rates, rule, complete=exchange)
    listed = [variable for _, variable in structure.entries("ContinuousStateDerivative") if variable is not None]
    initial = list(_initial_unknowns(variables, listed))
    rule = 'outputs, states and derivatives with initial="approx" or "calculated", and calculated parameters'
    structure.check("InitialUnknown", initial, rule)
    for name in ("Output", "ContinuousStateDerivative"):
        structure.check_dependencies(name, lambda known: is_known(known, variables), KINDS)
    structure.check_dependencies("InitialUnknown", _is_known_initially, _INITIAL_KINDS if third else KINDS)
    if third:
        clocked = [variable for variable in variables.all if "previous" in variable.element.attributes]
        structure.check("ClockedState", clocked, "all variables with previous")
        indicators = [x for x in variables.all if x.floating and x.variability == "continuous"]
        indicators = [x for x in indicators if x.causality in ("local", "output")]
        structure.check("EventIndicator", indicators, "continuous local variables or outputs", complete=False)
        structure.check_dependencies("EventIndicator", lambda known: is_known(known, variables), KINDS)


def _initial_unknowns(variables: Variables, rates: Sequence[Variable]) -> list[Variable]:
    """Return the unknowns of initialization, in the order of the variables."""
    expected = set[int]()
    for variable in variables.all:
        computed = variable.initial in ("approx", "calculated")
        clocked = "clocks" in variable.element.attributes or variable.kind == "Clock"
        if variable.causality == "calculatedParameter" or (variable.causality == "output" and computed and not clocked):
            expected.add(variable.index)
    for rate in rates:
        state = variables.referred(rate.derivative)
        for variable in (rate, *(() if state is None else (state,))):
            if variable.initial in ("approx", "calculated"):
                expected.add(variable.index)
    return [variable for variable in variables.all if variable.index in expected]


def is_known(variable: Variable, variables: Variables) -> bool:
    """Return whether outputs and derivatives may depend on a variable: inputs, states, the independent variable; in FMI
    3.0 parameters and discrete states, too."""
    if variable.causality in ("input", "independent") or variables.is_state(variable):
        return True
    third = variables.standard.third
    return third and (variable.causality in ("parameter", "structuralParameter") or variable.variability == "discrete")


def _is_known_initially(variable: Variable) -> bool:
    """Return whether unknowns of initialization may depend on a variable."""
    return variable.causality in ("input", "independent") or variable.initial == "exact"
