"""Rules for single variables, units and types of a model description.

The table of causality, variability and initial stands in FMI 2.0 (2.2.7) and in FMI 3.0 (definition of initial);
both differ in inputs, which have no ``initial`` in FMI 2.0, and in structural parameters.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from eomgen.base.data import dataclass
from tests.fmu.checks.document import Element, Report
from tests.fmu.checks.grammar import FLOATS, Standard, integer, number, of_type

_EXACT, _COMPUTED, _ANY = ("exact",), ("calculated", "approx"), ("calculated", "exact", "approx")
#: Allowed values of ``initial`` by causality and variability, the default first; None: not given.
_COMBINATIONS: Mapping[tuple[str, str], tuple[str | None, ...]] = {
    **{("parameter", variability): _EXACT for variability in ("fixed", "tunable")},
    **{("structuralParameter", variability): _EXACT for variability in ("fixed", "tunable")},
    **{("calculatedParameter", variability): _COMPUTED for variability in ("fixed", "tunable")},
    **{("input", variability): _EXACT for variability in ("discrete", "continuous")},
    **{(causality, "constant"): _EXACT for causality in ("output", "local")},
    **{("local", variability): _COMPUTED for variability in ("fixed", "tunable")},
    **{(c, variability): _ANY for c in ("output", "local") for variability in ("discrete", "continuous")},
    ("independent", "continuous"): (None,),
}
_PARAMETERS = ("parameter", "structuralParameter", "calculatedParameter")

_NONDIGIT, _UNSIGNED = "[_a-zA-Z]", r"\d+"
_QUOTED = r"'(?:[_a-zA-Z0-9!#$%&()*+,\-./:;<>=?@\[\]^{}| ~]|\\['\"?\\abfnrtv])+'"
_PART = rf"(?:{_NONDIGIT}[_a-zA-Z0-9]*|{_QUOTED})(?:\[{_UNSIGNED}(?:,{_UNSIGNED})*\])?"
_IDENTIFIER = rf"{_PART}(?:\.{_PART})*"
_STRUCTURED = re.compile(rf"{_IDENTIFIER}|der\({_IDENTIFIER}(?:,{_UNSIGNED})?\)")
_DERIVATIVE = re.compile(r"der\((?P<name>.*?)(?:,(?P<order>\d+))?\)")
_BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass
class Variable:
    """One variable.

    Attributes
    ----------
    element : of the variable
    values : element with type, start and range: a child in FMI 2.0, the same in FMI 3.0
    index : from 1
    standard : whose defaults hold
    """

    element: Element
    values: Element
    index: int
    standard: Standard

    @property
    def name(self) -> str:
        """The name."""
        return self.element.attributes.get("name", "")

    @property
    def kind(self) -> str:
        """The type, such as Real or Float64."""
        return self.values.tag

    @cached_property
    def reference(self) -> int | None:
        """The value reference, None without one."""
        return integer(self.element.attributes.get("valueReference", ""))

    @cached_property
    def causality(self) -> str:
        """The causality."""
        return self.element.attributes.get("causality", "local")

    @cached_property
    def variability(self) -> str:
        """The variability."""
        given = self.element.attributes.get("variability")
        if given is not None:
            return given
        if not self.standard.third:
            return "continuous"
        if self.causality in _PARAMETERS:
            return "fixed"
        return "continuous" if self.floating else "discrete"

    @cached_property
    def initial(self) -> str | None:
        """The value of initial, by default of the table."""
        given = self.element.attributes.get("initial")
        allowed = _COMBINATIONS.get((self.causality, self.variability), (None,))
        return given if given is not None else allowed[0]

    @property
    def floating(self) -> bool:
        """Whether values are floating-point numbers."""
        return self.kind in FLOATS

    @cached_property
    def derivative(self) -> int | None:
        """The index or value reference of the state, None for other variables."""
        return integer(self.values.attributes.get("derivative", ""))

    @property
    def is_array(self) -> bool:
        """Whether the variable has dimensions."""
        return self.values.first("Dimension") is not None

    @property
    def size(self) -> int | None:
        """Number of values; None if a structural parameter gives a dimension."""
        sizes = [integer(element.attributes.get("start", "")) for element in self.values.all("Dimension")]
        return None if None in sizes else math.prod(size for size in sizes if size is not None)


class Variables:
    """The variables of a model description, and references to variables."""

    def __init__(self, root: Element, standard: Standard) -> None:
        self.standard, listed = standard, root.first("ModelVariables")
        self.all: list[Variable] = []
        for index, element in enumerate(listed.children if listed is not None else (), start=1):
            values = element
            if not standard.third:
                values = next((x for x in element.children if x.tag != "Annotations"), element)
            self.all.append(Variable(element, values, index, standard))
        if standard.third:
            self._referred = {x.reference: x for x in reversed(self.all) if x.reference is not None}
        else:
            self._referred = {x.index: x for x in self.all}

    def referred(self, key: int | None) -> Variable | None:
        """Return the variable that an index (FMI 2.0) or a value reference (FMI 3.0) names, None for no variable."""
        return self._referred.get(key) if key is not None else None

    def key(self, variable: Variable) -> int | None:
        """Return the index or value reference by which others refer to a variable."""
        return variable.reference if self.standard.third else variable.index

    @cached_property
    def derivatives(self) -> dict[int, Variable]:
        """Variables that are time derivatives, by the index or value reference of the state."""
        return {x.derivative: x for x in self.all if x.derivative is not None}

    def is_state(self, variable: Variable) -> bool:
        """Return whether another variable is the derivative of this one."""
        return self.key(variable) in self.derivatives


def check_variables(root: Element, variables: Variables, report: Report) -> None:
    """Report variables that break a rule of single variables, names and references."""
    convention = root.attributes.get("variableNamingConvention", "flat")
    names, references = dict[str, Variable](), dict[tuple[str, int], Variable]()
    for variable in variables.all:
        for element in (variable.element, *variable.values.all("Alias")):
            name = element.attributes.get("name", "")
            if name in names:
                report.add(element, f'the name "{name}" is taken by line {names[name].element.line}', "unique names")
            names.setdefault(name, variable)
            _check_name(element, name, convention, report)
        if variable.reference is not None:
            space = "" if variables.standard.third else variable.kind
            other = references.setdefault((space, variable.reference), variable)
            if other is not variable:
                cause = f'the value reference {variable.reference} belongs to "{other.name}"'
                report.add(variable.element, cause, "unique value references")
        _check_combination(variable, report)
        _check_values(variable, report)
        _check_references(variable, variables, report)
        _check_derivative(variable, variables, convention, report)
    _check_independent(variables, report)


def _check_name(element: Element, name: str, convention: str, report: Report) -> None:
    if convention == "structured" and not _STRUCTURED.fullmatch(name):
        cause = f'the name "{name}" does not fit the grammar of structured names'
        report.add(element, cause, 'variableNamingConvention="structured"')
    elif any(character in name for character in "\r\n\t"):
        report.add(element, "the name has a tab or an end of line", "names of variables")


def _check_combination(variable: Variable, report: Report) -> None:
    """Report causality, variability and initial that do not go together."""
    row, given = (variable.causality, variable.variability), variable.element.attributes.get("initial")
    structural = variable.causality == "structuralParameter"
    if row not in _COMBINATIONS or (structural and not variable.standard.third):
        cause = f'causality="{row[0]}" with variability="{row[1]}" is not allowed'
        report.add(variable.element, cause, "table of causality and variability")
        return
    if variable.kind == "Clock":
        if variable.variability != "discrete" or variable.causality in _PARAMETERS:
            report.add(variable.element, "a clock is a discrete input, output or local variable", "variability")
        return
    if variable.variability == "continuous" and not variable.floating:
        cause = f"a variable of type {variable.kind} cannot be continuous"
        report.add(variable.element, cause, "variability")
    allowed = _COMBINATIONS[row]
    if variable.causality == "input" and not variable.standard.third:
        allowed = (None,)
    if given is not None and given not in allowed:
        words = " or ".join(str(value) for value in allowed if value) or "no value"
        cause = f'initial="{given}", and a variable with causality="{row[0]}" and variability="{row[1]}" has {words}'
        report.add(variable.element, cause, "table of initial")


def _starts(variable: Variable) -> list[str] | None:
    """Return the texts of the start values, None without any."""
    if variable.kind in ("String", "Binary") and variable.standard.third:
        elements = variable.values.all("Start")
        return [element.attributes.get("value", "") for element in elements] or None
    text = variable.values.attributes.get("start")
    if text is None:
        return None
    return text.split() if variable.standard.third else [text]


def _check_values(variable: Variable, report: Report) -> None:
    """Report start values that are missing, superfluous, of another type or out of range."""
    element, starts = variable.element, _starts(variable)
    settable = variable.initial in ("exact", "approx") or variable.causality == "input"
    if variable.kind == "Clock":
        settable, starts = False, None
    if starts == [] and variable.size != 0:
        report.add(element, 'start="" has no value', "start")
    elif settable and starts is None:
        report.add(element, "there is no start value", f'start of causality="{variable.causality}"')
    if starts is not None and variable.causality == "independent":
        report.add(element, "the independent variable has a start value", "start")
    elif starts is not None and not settable:
        report.add(element, 'there is a start value, and initial is "calculated"', "start")
    _check_range(variable, report)
    _check_starts(variable, starts or (), report)


def _check_range(variable: Variable, report: Report) -> None:
    """Report ranges without a value, and nominal values that are zero or no number."""
    element = variable.element
    low, high = (number(variable.values.attributes.get(key, "")) for key in ("min", "max"))
    if low is not None and high is not None and low > high:
        report.add(element, f"min {low:g} is above max {high:g}", "min and max")
    for key in ("min", "max", "nominal"):
        if math.isnan(number(variable.values.attributes.get(key, "")) or 0.0):
            report.add(element, f"{key} is not a number", key)
    if number(variable.values.attributes.get("nominal", "")) == 0.0:
        report.add(element, "the nominal value is zero", "nominal")


def _check_starts(variable: Variable, starts: Sequence[str], report: Report) -> None:
    """Report start values of another number or type, and out of range."""
    element = variable.element
    if len(starts) > 1 and not variable.is_array:
        report.add(element, f"a scalar has {len(starts)} start values", "start")
    elif variable.is_array and starts and variable.size not in (None, len(starts)) and len(starts) > 1:
        report.add(element, f"an array of {variable.size} values has {len(starts)} start values", "start")
    low, high = (number(variable.values.attributes.get(key, "")) for key in ("min", "max"))
    lowest, highest = -math.inf if low is None else low, math.inf if high is None else high
    for start in starts:
        value = number(start)
        if not of_type(variable.kind, start):
            report.add(element, f'the start value "{start}" is not a finite {variable.kind}', "start")
        elif value is not None and not lowest <= value <= highest:
            report.add(element, f"the start value {start} is outside min and max", "start")


def _check_references(variable: Variable, variables: Variables, report: Report) -> None:
    """Report references to dimensions, clocks and previous values that name no such variable."""
    for dimension in variable.values.all("Dimension"):
        own = dimension.attributes
        if ("start" in own) == ("valueReference" in own):
            report.add(dimension, "a dimension has a start or a value reference", "Dimension")
        size = integer(own.get("start", ""))
        if size == 0:
            report.add(dimension, "the size of a dimension is zero", "Dimension")
        if "valueReference" in own:
            target = variables.referred(integer(own["valueReference"]))
            if target is None or target.kind != "UInt64" or target.causality not in ("structuralParameter", "local"):
                report.add(dimension, "the size names no structural parameter of type UInt64", "Dimension")
    if not variable.standard.third:
        return
    for key in variable.element.attributes.get("clocks", "").split():
        target = variables.referred(integer(key))
        if target is None or target.kind != "Clock":
            report.add(variable.element, f"clocks names {key}, which is not a clock", "clocks")
    previous = variable.element.attributes.get("previous")
    if previous is not None:
        target = variables.referred(integer(previous))
        if target is None or target.kind != variable.kind:
            cause = f"previous names {previous}, which is not a variable of type {variable.kind}"
            report.add(variable.element, cause, "previous")
        if variable.variability != "discrete" or "clocks" not in variable.element.attributes:
            report.add(variable.element, "a clocked state is discrete and has clocks", "ClockedState")


def _check_derivative(variable: Variable, variables: Variables, convention: str, report: Report) -> None:
    """Report derivatives of variables other than states."""
    element, key = variable.element, variable.derivative
    named = _DERIVATIVE.fullmatch(variable.name) if convention == "structured" else None
    by = "value reference" if variable.standard.third else "index"
    if key is None:
        if named is not None:
            report.add(element, "the name is a derivative's, and derivative is missing", "derivative")
        if variable.values.attributes.get("reinit") == "true" and not variables.is_state(variable):
            report.add(element, "reinit belongs to a state, and no variable is the derivative", "reinit")
        return
    if variable.values.attributes.get("reinit") == "true" and not variables.is_state(variable):
        report.add(element, "reinit belongs to a state, and the variable is a derivative", "reinit")
    state = variables.referred(key)
    if state is None or state is variable:
        report.add(element, f"derivative names the {by} {key}, which is not another variable", "derivative")
        return
    if not (state.floating and state.variability == variable.variability == "continuous"):
        report.add(element, f'derivative and "{state.name}" are not both continuous', "derivative")
    if state.causality not in ("local", "output"):
        report.add(
            element, f'derivative names "{state.name}", which is neither a local variable nor an output', "derivative"
        )
    if state.size != variable.size:
        report.add(element, f'derivative names "{state.name}", which has another size', "derivative")
    if variables.derivatives[key] is not variable:
        report.add(element, f'"{state.name}" has two derivatives', "derivative")
    if named is not None and (named["order"] or "1") == "1" and named["name"] != state.name:
        cause = f'derivative names "{state.name}" ({by} {key}), and the name says "{named["name"]}"'
        report.add(element, cause, "derivative")


def _check_independent(variables: Variables, report: Report) -> None:
    independent = [variable for variable in variables.all if variable.causality == "independent"]
    for variable in independent:
        if not variable.floating:
            report.add(variable.element, "the independent variable is not a floating-point number", "independent")
    if len(independent) > 1 or (variables.standard.third and not independent):
        element = independent[1].element if independent else None
        most = "exactly one" if variables.standard.third else "at most one"
        report.add(element, f"{len(independent)} variables are independent; {most} must be", "independent")


class Units:
    """The units of a model description."""

    def __init__(self, root: Element) -> None:
        section = root.first("UnitDefinitions")
        self.elements = [] if section is None else section.all("Unit")
        self.by_name = {unit.attributes.get("name", ""): unit for unit in self.elements}
        self.used: set[str] = set()

    def base(self, name: str | None) -> dict[str, float] | None:
        """Return exponents and factor of a unit, None without these."""
        unit = self.by_name.get(name) if name is not None else None
        base = None if unit is None else unit.first("BaseUnit")
        if base is None:
            return None
        exponents = {key: number(base.attributes.get(key, "0")) or 0.0 for key in _BASE}
        return {**exponents, "factor": number(base.attributes.get("factor", "1")) or 0.0}


def check_units_and_types(root: Element, variables: Variables, report: Report) -> None:
    """Report units and types that are not defined, defined twice or used by no variable."""
    units = Units(root)
    _check_unit_definitions(units, report)
    sections = {element.attributes.get("name", ""): element for element in _types(root, variables.standard, report)}
    types = {name: element if variables.standard.third else element.children[0] for name, element in sections.items()}
    own: dict[int, str | None] = {}
    for element in types.values():
        _check_unit_of(element, element.attributes.get("unit"), units, report)
    used = set[str]()
    names = {variable.name for variable in variables.all}
    for name, element in sections.items():
        if name in names:
            report.add(element, f'the type "{name}" has the name of a variable', "names of types")
    for variable in variables.all:
        declared, unit = variable.values.attributes.get("declaredType"), variable.values.attributes.get("unit")
        if declared is not None:
            used.add(declared)
            definition = types.get(declared)
            if definition is None:
                report.add(variable.element, f'the type "{declared}" is not defined', "declaredType")
            elif definition.tag not in (variable.kind, f"{variable.kind}Type"):
                report.add(variable.element, f'the type "{declared}" is of another kind', "declaredType")
            elif unit is None:
                unit = definition.attributes.get("unit")
        own[variable.index] = unit
        _check_unit_of(variable.values, unit, units, report)
    for name in sorted(set(types) - used):
        report.add(sections[name], f'no variable has the type "{name}"', "eomgen defines used types alone")
    for name in sorted(set(units.by_name) - units.used):
        cause = f'no variable has the unit "{name}"'
        report.add(units.by_name[name], cause, "eomgen defines used units alone")
    for variable in variables.all:
        state = variables.referred(variable.derivative)
        if state is not None:
            _check_unit_of_rate(variable, units.base(own[state.index]), units.base(own[variable.index]), report)


def _check_unit_definitions(units: Units, report: Report) -> None:
    seen = set[str]()
    for unit in units.elements:
        name = unit.attributes.get("name", "")
        if name in seen:
            report.add(unit, f'the unit "{name}" is defined twice', "unique names of units")
        seen.add(name)
        shown = [display.attributes.get("name", "") for display in unit.all("DisplayUnit")]
        for display in sorted({other for other in shown if shown.count(other) > 1}):
            report.add(unit, f'the display unit "{display}" is defined twice', "unique names of display units")
        for element in (*unit.all("BaseUnit"), *unit.all("DisplayUnit")):
            factor, offset = (number(element.attributes.get(key, "1")) for key in ("factor", "offset"))
            if factor == 0.0:
                report.add(element, "the factor is zero", "factor of units")
            for key, value in (("factor", factor), ("offset", offset)):
                if value is not None and not math.isfinite(value):
                    report.add(element, f"the {key} {value:g} is not finite", f"{key} of units")


def _types(root: Element, standard: Standard, report: Report) -> Iterator[Element]:
    """Yield the types that have a kind."""
    section, seen = root.first("TypeDefinitions"), set[str]()
    for element in section.children if section is not None else ():
        name = element.attributes.get("name", "")
        if name in seen:
            report.add(element, f'the type "{name}" is defined twice', "unique names of types")
        seen.add(name)
        kinds = [element] if standard.third else element.children[:1]
        items = [integer(item.attributes.get("value", "")) for kind in kinds for item in kind.all("Item")]
        if len(items) != len(set(items)):
            report.add(element, "two items have the same value", "Item")
        if kinds:
            yield element
        else:
            report.add(element, "the type has no kind", "SimpleType")


def _check_unit_of(element: Element, unit: str | None, units: Units, report: Report) -> None:
    if unit is not None:
        units.used.add(unit)
        if unit not in units.by_name:
            report.add(element, f'the unit "{unit}" is not defined', "unit")
    for of in (element, *element.all("Alias")):
        shown = of.attributes.get("displayUnit")
        if shown is None:
            continue
        definition = units.by_name.get(unit) if unit is not None else None
        known = [] if definition is None else [x.attributes.get("name") for x in definition.all("DisplayUnit")]
        if shown not in known:
            report.add(of, f'the display unit "{shown}" is not one of the unit {unit!r}', "displayUnit")


def _check_unit_of_rate(
    rate: Variable, of_state: Mapping[str, float] | None, of_rate: Mapping[str, float] | None, report: Report
) -> None:
    if of_state is None or of_rate is None:
        return
    expected = {**of_state, "s": of_state["s"] - 1}
    if expected != of_rate:
        wrong = ", ".join(key for key in expected if expected[key] != of_rate[key])
        cause = f"the unit is not the state's over a second: other values of {wrong}"
        report.add(rate.element, cause, "unit of a derivative")
