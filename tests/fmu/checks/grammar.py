"""Elements and attributes of model descriptions, by version of the standard, with the form of each value.

The tables follow the schemas of FMI 2.0 and FMI 3.0: children in order, attributes with types, ``!`` after a
type for a required one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence

from eomgen.base.data import dataclass
from tests.fmu.checks.document import Element, Report

#: Types of variables that may be continuous.
FLOATS = ("Real", "Float32", "Float64")
#: Integers with the number of bits, negative for types with a sign.
_INTEGERS = {"Int8": -8, "UInt8": 8, "Int16": -16, "UInt16": 16, "Int32": -32, "UInt32": 32, "Int64": -64, "UInt64": 64}
#: Variables of FMI 3.
KINDS = ("Float32", "Float64", *_INTEGERS, "Boolean", "String", "Binary", "Enumeration", "Clock")

_ENUMERATIONS: Mapping[str, tuple[str, ...]] = {
    "convention": ("flat", "structured"),
    "causality": ("parameter", "calculatedParameter", "input", "output", "local", "independent"),
    "causality3": (
        *("parameter", "calculatedParameter", "input", "output", "local", "independent"),
        "structuralParameter",
    ),
    "variability": ("constant", "fixed", "tunable", "discrete", "continuous"),
    "initial": ("exact", "approx", "calculated"),
    "interval": ("constant", "fixed", "tunable", "changing", "countdown", "triggered"),
}
_DATE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?(Z|[+-]\d\d:\d\d)?")
_INTEGER = re.compile(r"[+-]?\d+")


def integer(text: str) -> int | None:
    """Return the integer that a text is, None for another text."""
    return int(text) if _INTEGER.fullmatch(text.strip()) else None


def number(text: str) -> float | None:
    """Return the number that a text is, None for another text."""
    try:
        return float(text.strip().replace("INF", "inf"))
    except ValueError:
        return None


def is_count(text: str) -> bool:
    """Return whether a text is an integer of 32 bits without sign, as value references and indices are."""
    value = integer(text)
    return value is not None and 0 <= value < 2**32


def of_type(kind: str, text: str) -> bool:
    """Return whether a text is one value of a type of variables."""
    if kind in FLOATS:
        value = number(text)
        return value is not None and math.isfinite(value)
    if kind == "Boolean":
        return text in ("true", "false", "0", "1")
    if kind in ("String", "Binary"):
        return True
    bits = _INTEGERS.get(kind, -32 if kind == "Integer" else -64)
    low, high = (-(2 ** (-bits - 1)), 2 ** (-bits - 1)) if bits < 0 else (0, 2**bits)
    whole = integer(text)
    return whole is not None and low <= whole < high


def _one_of(words: Sequence[str]) -> tuple[Callable[[str], bool], str]:
    """Return the test of one of several words."""
    return (lambda text: text in words), f"one of {', '.join(words)}"


#: For each form of an attribute: the test of a text, and the words of a finding.
_FORMS: Mapping[str, tuple[Callable[[str], bool], str]] = {
    "text": (lambda _: True, "a text"),
    "words": (lambda text: bool(text.strip()), "a text that is not empty"),
    "bool": (lambda text: text in ("true", "false", "0", "1"), "true or false"),
    "int": (lambda text: integer(text) is not None, "an integer"),
    "count": (is_count, "an integer from 0 to 4294967295"),
    "real": (lambda text: number(text) is not None, "a number"),
    "counts": (lambda text: all(map(is_count, text.split())), "a list of integers from 0 to 4294967295"),
    "date": (lambda text: bool(_DATE.fullmatch(text)), "a date as 2026-11-25T08:00:00Z"),
    **{name: _one_of(words) for name, words in _ENUMERATIONS.items()},
}


def _attributes(text: str) -> dict[str, str]:
    """Return the forms of attributes by name, from ``name:form`` and ``name`` for texts."""
    return {name: form or "text" for name, _, form in (word.partition(":") for word in text.split())}


@dataclass(frozen=True)
class Standard:
    """A version of the standard.

    Attributes
    ----------
    name : with the version
    attributes : forms of the attributes of each element, of ``parent/element`` if elements share a name
    children : names of the elements within each element, in order
    required : children that an element must have
    """

    name: str
    attributes: Mapping[str, Mapping[str, str]]
    children: Mapping[str, tuple[str, ...]]
    required: Mapping[str, tuple[str, ...]]

    @property
    def third(self) -> bool:
        """Whether variables are named by value references in the model structure, as since FMI 3.0."""
        return self.name.startswith("FMI 3")


_ROOT = (
    "modelName:words! description author version copyright license generationTool generationDateAndTime:date"
    " variableNamingConvention:convention"
)
_NUMERIC = "quantity unit displayUnit relativeQuantity:bool unbounded:bool min:real max:real nominal:real"
_INTERFACE = "modelIdentifier:words! needsExecutionTool:bool canBeInstantiatedOnlyOncePerProcess:bool"
_BASE_UNIT = "kg:int m:int s:int A:int K:int mol:int cd:int rad:int factor:real offset:real"
_UNKNOWN = "dependencies:counts dependenciesKind"
_EXPERIMENT = "startTime:real stopTime:real tolerance:real stepSize:real"

_SECOND_INTERFACE = (
    f"{_INTERFACE} canNotUseMemoryManagementFunctions:bool canGetAndSetFMUstate:bool canSerializeFMUstate:bool"
    " providesDirectionalDerivative:bool"
)
FMI2 = Standard(
    "FMI 2.0",
    {
        name: _attributes(text)
        for name, text in {
            "fmiModelDescription": f"fmiVersion:words! guid:words! numberOfEventIndicators:count {_ROOT}",
            "ModelExchange": f"{_SECOND_INTERFACE} completedIntegratorStepNotNeeded:bool",
            "CoSimulation": f"{_SECOND_INTERFACE} canHandleVariableCommunicationStepSize:bool canInterpolateInputs:bool"
            " maxOutputDerivativeOrder:count canRunAsynchronuously:bool",
            "SourceFiles": "",
            "File": "name:words!",
            "UnitDefinitions": "",
            "Unit": "name:words!",
            "BaseUnit": _BASE_UNIT,
            "DisplayUnit": "name:words! factor:real offset:real",
            "TypeDefinitions": "",
            "SimpleType": "name:words! description",
            "SimpleType/Real": _NUMERIC,
            "SimpleType/Integer": "quantity min:int max:int",
            "SimpleType/Boolean": "",
            "SimpleType/String": "",
            "SimpleType/Enumeration": "quantity",
            "Item": "name:words! value:int! description",
            "LogCategories": "",
            "Category": "name:words! description",
            "DefaultExperiment": _EXPERIMENT,
            "VendorAnnotations": "",
            "ModelVariables": "",
            "ScalarVariable": "name:words! valueReference:count! description causality:causality"
            " variability:variability initial:initial canHandleMultipleSetPerTimeInstant:bool",
            "Real": f"declaredType {_NUMERIC} start derivative:count reinit:bool",
            "Integer": "declaredType quantity min:int max:int start",
            "Boolean": "declaredType start",
            "String": "declaredType start",
            "Enumeration": "declaredType:words! quantity min:int max:int start",
            "ModelStructure": "",
            "Outputs": "",
            "Derivatives": "",
            "InitialUnknowns": "",
            "Unknown": f"index:count! {_UNKNOWN}",
        }.items()
    },
    {
        "fmiModelDescription": (
            *("ModelExchange", "CoSimulation", "UnitDefinitions", "TypeDefinitions", "LogCategories"),
            *("DefaultExperiment", "VendorAnnotations", "ModelVariables", "ModelStructure"),
        ),
        "ModelExchange": ("SourceFiles",),
        "CoSimulation": ("SourceFiles",),
        "SourceFiles": ("File",),
        "UnitDefinitions": ("Unit",),
        "Unit": ("BaseUnit", "DisplayUnit"),
        "TypeDefinitions": ("SimpleType",),
        "SimpleType": ("Real", "Integer", "Boolean", "String", "Enumeration"),
        "SimpleType/Enumeration": ("Item",),
        "LogCategories": ("Category",),
        "ModelVariables": ("ScalarVariable",),
        "ScalarVariable": ("Real", "Integer", "Boolean", "String", "Enumeration", "Annotations"),
        "ModelStructure": ("Outputs", "Derivatives", "InitialUnknowns"),
        **dict.fromkeys(("Outputs", "Derivatives", "InitialUnknowns"), ("Unknown",)),
    },
    {"fmiModelDescription": ("ModelVariables", "ModelStructure"), "ModelVariables": ("ScalarVariable",)},
)

_THIRD_INTERFACE = (
    f"{_INTERFACE} canGetAndSetFMUState:bool canSerializeFMUState:bool providesDirectionalDerivatives:bool"
    " providesAdjointDerivatives:bool providesPerElementDependencies:bool"
)
_VARIABLE = (
    "name:words! valueReference:count! description causality:causality3 variability:variability"
    " canHandleMultipleSetPerTimeInstant:bool clocks:counts declaredType"
)
_ARRAYABLE = f"{_VARIABLE} intermediateUpdate:bool previous:count initial:initial"
_TYPE = "name:words! description"
_CLOCK = (
    "canBeDeactivated:bool priority:count intervalVariability:interval! intervalDecimal:real shiftDecimal:real"
    " supportsFraction:bool resolution:count intervalCounter:count shiftCounter:count"
)


def _kinds() -> dict[str, str]:
    """Return the attributes of variables and of types of FMI 3."""
    ranges: dict[str, str] = dict.fromkeys(("Float32", "Float64"), _NUMERIC)
    ranges |= dict.fromkeys((*_INTEGERS, "Enumeration"), "quantity min:int max:int")
    ranges |= {"Boolean": "", "String": "", "Binary": "mimeType maxSize:count", "Clock": _CLOCK}
    made = {}
    for kind, range_of in ranges.items():
        own = f"{_VARIABLE if kind == 'Clock' else _ARRAYABLE} {range_of}"
        own += " derivative:count reinit:bool" if kind in FLOATS else ""
        own += " start" if kind not in ("String", "Binary", "Clock") else ""
        made[kind] = own.replace("declaredType", "declaredType:words!") if kind == "Enumeration" else own
        made[f"{kind}Type"] = f"{_TYPE} {range_of}"
    return made


FMI3 = Standard(
    "FMI 3.0",
    {
        name: _attributes(text)
        for name, text in {
            "fmiModelDescription": f"fmiVersion:words! instantiationToken:words! {_ROOT}",
            "ModelExchange": f"{_THIRD_INTERFACE} needsCompletedIntegratorStep:bool"
            " providesEvaluateDiscreteStates:bool",
            "CoSimulation": f"{_THIRD_INTERFACE} canHandleVariableCommunicationStepSize:bool fixedInternalStepSize:real"
            " maxOutputDerivativeOrder:count recommendedIntermediateInputSmoothness:int"
            " providesIntermediateUpdate:bool mightReturnEarlyFromDoStep:bool"
            " canReturnEarlyAfterIntermediateUpdate:bool hasEventMode:bool providesEvaluateDiscreteStates:bool",
            "ScheduledExecution": _THIRD_INTERFACE,
            "UnitDefinitions": "",
            "Unit": "name:words!",
            "BaseUnit": _BASE_UNIT,
            "DisplayUnit": "name:words! factor:real offset:real inverse:bool",
            "TypeDefinitions": "",
            "Item": "name:words! value:int! description",
            "LogCategories": "",
            "Category": "name:words! description",
            "DefaultExperiment": _EXPERIMENT,
            "ModelVariables": "",
            "Alias": "name:words! description displayUnit",
            "Dimension": "start:count valueReference:count",
            "Start": "value",
            "ModelStructure": "",
            **dict.fromkeys(
                ("Output", "ContinuousStateDerivative", "ClockedState", "InitialUnknown", "EventIndicator"),
                f"valueReference:count! {_UNKNOWN}",
            ),
            **_kinds(),
        }.items()
    },
    {
        "fmiModelDescription": (
            *("ModelExchange", "CoSimulation", "ScheduledExecution", "UnitDefinitions", "TypeDefinitions"),
            *("LogCategories", "DefaultExperiment", "ModelVariables", "ModelStructure", "Annotations"),
        ),
        "UnitDefinitions": ("Unit",),
        "Unit": ("BaseUnit", "DisplayUnit", "Annotations"),
        "TypeDefinitions": tuple(f"{kind}Type" for kind in KINDS),
        "EnumerationType": ("Item",),
        "LogCategories": ("Category",),
        "ModelVariables": KINDS,
        **{
            kind: ("Annotations", "Dimension", *(("Start",) if kind in ("String", "Binary") else ()), "Alias")
            for kind in KINDS
        },
        "ModelStructure": ("Output", "ContinuousStateDerivative", "ClockedState", "InitialUnknown", "EventIndicator"),
    },
    {"fmiModelDescription": ("ModelVariables", "ModelStructure")},
)
#: Elements whose children may stand in any order.
_UNORDERED = ("TypeDefinitions", "ModelVariables")


def check_form(root: Element, standard: Standard, report: Report) -> None:
    """Report elements and attributes that the standard has not, and values of another form."""
    skipped = set[int]()
    for element, parent in root.walk():
        if parent is not None and id(parent) in skipped:
            skipped.add(id(element))
            continue
        if element.tag in ("Annotations", "VendorAnnotations"):
            skipped.add(id(element))
            continue
        key = _key(element, parent, standard.attributes)
        if key not in standard.attributes:
            report.add(element, f"the element {element.tag} is not in the schema", "elements of the schema")
            skipped.add(id(element))
            continue
        _check_attributes(element, standard.attributes[key], report)
        _check_children(element, _key(element, parent, standard.children), standard, report)


def _key(element: Element, parent: Element | None, table: Mapping[str, object]) -> str:
    """Return the row of an element."""
    within = f"{parent.tag}/{element.tag}" if parent is not None else ""
    return within if within in table else element.tag


def _check_attributes(element: Element, forms: Mapping[str, str], report: Report) -> None:
    for name, form in forms.items():
        if form.endswith("!") and name not in element.attributes:
            report.add(element, f"the attribute {name} is missing", f"attributes of {element.tag}")
    for name, text in element.attributes.items():
        if ":" in name or name == "xmlns":
            continue
        if name not in forms:
            report.add(element, f"the attribute {name} is not in the schema", f"attributes of {element.tag}")
            continue
        test, words = _FORMS[forms[name].rstrip("!")]
        if not test(text):
            report.add(element, f'{name}="{text}" is not {words}', f"attributes of {element.tag}")


def _check_children(element: Element, key: str, standard: Standard, report: Report) -> None:
    allowed = standard.children.get(key, ())
    for name in standard.required.get(key, ()):
        if element.first(name) is None:
            report.add(element, f"the element {name} is missing", f"elements of {element.tag}")
    last = 0
    for child in element.children:
        if child.tag not in allowed:
            if child.tag in standard.attributes:
                report.add(child, f"{child.tag} must not be within {element.tag}", f"elements of {element.tag}")
            continue
        place = allowed.index(child.tag)
        if {element.tag, child.tag} <= {"fmiModelDescription", "ModelExchange", "CoSimulation"} and not standard.third:
            place = 0
        if place < last and element.tag not in _UNORDERED:
            report.add(child, f"{child.tag} follows {allowed[last]}", f"order of elements of {element.tag}")
        last = max(last, place)
