"""The check of FMUs that eomgen writes: FMPy's by the schemas of both standards, and rules that FMPy does not know.

The check reads the files alone, and shares no code with the writer, so that mistakes of the writer stay visible.
"""

from __future__ import annotations

import io
import math
import re
import zipfile
from collections.abc import Iterator, Mapping
from xml.etree import ElementTree as ET

from fmpy.validation import validate_fmu

_C_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_RESERVED = re.compile(
    r"auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|"
    r"restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while|"
    r"_Bool|_Complex|_Imaginary"
)
#: Attributes that eomgen has in FMI 3.0, whose schema allows any.
_ATTRIBUTES = re.compile(
    "A|K|author|canGetAndSetFMUState|canHandleVariableCommunicationStepSize|canSerializeFMUState|causality|copyright|"
    "declaredType|dependencies|dependenciesKind|derivative|description|factor|fixedInternalStepSize|fmiVersion|"
    "generationTool|initial|instantiationToken|kg|license|m|max|min|modelIdentifier|modelName|name|"
    "needsCompletedIntegratorStep|providesAdjointDerivatives|providesDirectionalDerivatives|quantity|rad|reinit|s|"
    "start|startTime|stepSize|stopTime|tolerance|unit|valueReference|variability|variableNamingConvention|version"
)


def findings(files: Mapping[str, str | bytes]) -> list[str]:
    """Return a sentence for each fault of the description in an archive, whose files are given by path. Where FMPy has
    findings, the other rules do not apply."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as target:
        for name in ("modelDescription.xml", "sources/buildDescription.xml"):
            if name in files:
                target.writestr(name, files[name])
    if faults := validate_fmu(archive):
        return [f"FMPy: {fault}" for fault in faults]
    model = Description(ET.fromstring(files["modelDescription.xml"]))
    rules = (_of_variables, _of_structure, _of_interfaces, _of_experiment)
    return [fault for rule in rules for fault in rule(model)]


class Description:
    """A model description: its variables, their elements with types, and references among them."""

    def __init__(self, root: ET.Element) -> None:
        self.root, self.third = root, root.get("fmiVersion") == "3.0"
        self.variables = list(root.iterfind("ModelVariables/*"))
        self.typed = {variable: variable if self.third else variable[0] for variable in self.variables}
        self.keys = {x: x.get("valueReference", "") if self.third else str(k) for k, x in enumerate(self.variables, 1)}
        self.by_key = {key: variable for variable, key in self.keys.items()}
        of_states = ((typed.get("derivative"), variable) for variable, typed in self.typed.items())
        self.rates = {key: variable for key, variable in of_states if key is not None}
        self.interfaces = [element for tag in ("ModelExchange", "CoSimulation") for element in root.iterfind(tag)]

    def is_state(self, variable: ET.Element) -> bool:
        """Return whether another variable is the derivative of this one."""
        return self.keys[variable] in self.rates

    def is_known(self, variable: ET.Element) -> bool:
        """Return whether outputs and derivatives may depend on a variable."""
        more = ("parameter", "structuralParameter") if self.third else ()
        discrete = self.third and variable.get("variability") == "discrete"
        return variable.get("causality") in ("input", "independent", *more) or self.is_state(variable) or discrete

    def is_continuous(self, variable: ET.Element) -> bool:
        """Return whether a variable is continuous, and the model computes it."""
        return variable.get("variability") == "continuous" and variable.get("causality") in ("local", "output")

    def size(self, variable: ET.Element) -> int:
        """Return the number of values."""
        return math.prod(int(dimension.get("start", "0")) for dimension in variable.iterfind("Dimension"))

    def base(self, variable: ET.Element) -> dict[str, float] | None:
        """Return exponents and factor of the unit, None without a unit."""
        unit = self.typed[variable].get("unit")
        element = next((x for x in self.root.iterfind("UnitDefinitions/Unit") if x.get("name") == unit), None)
        base = element.find("BaseUnit") if element is not None else None
        return None if base is None else {"factor": 1.0, "s": 0.0, **{key: float(x) for key, x in base.items()}}


def _of_variables(model: Description) -> Iterator[str]:
    for variable in model.variables:
        name = variable.get("name", "")
        if model.typed[variable].tag != "Boolean":
            yield from (f"{name}: {fault}" for fault in _of_numbers(model, variable))
        yield from (f"{name}: {fault}" for fault in _of_derivative(model, variable))


def _of_numbers(model: Description, variable: ET.Element) -> Iterator[str]:
    attributes, size = model.typed[variable].attrib, model.size(variable)
    low, high = float(attributes.get("min", "-inf")), float(attributes.get("max", "inf"))
    if not low <= high:
        yield "min and max are no range"
    if size == 0:
        yield "a dimension is zero"
    if "start" in attributes:
        starts = [float(start) for start in attributes["start"].split()]
        if len(starts) != size:
            yield f"{size} values have {len(starts)} start values"
        if not all(math.isfinite(start) and low <= start <= high for start in starts):
            yield "a start value is not finite, or outside min and max"


def _of_derivative(model: Description, variable: ET.Element) -> Iterator[str]:
    key = model.typed[variable].get("derivative")
    if model.typed[variable].get("reinit") == "true" and not model.is_state(variable):
        yield "reinit belongs to states"
    if key is None:
        return
    state = model.by_key[key]
    if not (model.is_continuous(state) and model.is_continuous(variable)):
        yield "derivative names no state"
        return
    if state is variable or model.rates[key] is not variable:
        yield "derivative names a state with another derivative"
    if model.size(state) != model.size(variable):
        yield "derivative names a state of another size"
    of_state, of_rate = model.base(state), model.base(variable)
    if of_state is not None and of_rate is not None and {**of_state, "s": of_state["s"] - 1.0} != of_rate:
        yield "the unit is not the state's over a second"


def _of_structure(model: Description) -> Iterator[str]:
    structure = model.root.find("ModelStructure")
    assert structure is not None
    for entry in structure.iter():
        initial = entry.tag == "InitialUnknown" or entry in structure.findall("InitialUnknowns/Unknown")
        known = _is_initial if initial else model.is_known
        if not all(known(model.by_key[key]) for key in entry.get("dependencies", "").split()):
            yield f"{entry.tag} depends on a variable that is not known"


def _is_initial(variable: ET.Element) -> bool:
    """Return whether initial unknowns may depend on a variable."""
    return variable.get("causality") in ("input", "independent") or variable.get("initial") == "exact"


def _of_interfaces(model: Description) -> Iterator[str]:
    unknown = {key for element in model.root.iter() for key in element.attrib if not _ATTRIBUTES.fullmatch(key)}
    if model.third and unknown:
        yield f"no attribute is called {unknown}"
    for interface in model.interfaces:
        identifier = interface.get("modelIdentifier", "")
        if not _C_NAME.fullmatch(identifier) or _RESERVED.fullmatch(identifier):
            yield f"{identifier} is not an identifier of C"


def _of_experiment(model: Description) -> Iterator[str]:
    experiment = model.root.find("DefaultExperiment")
    assert experiment is not None
    start, stop, step, tolerance = (
        float(experiment.get(key, "1")) for key in ("startTime", "stopTime", "stepSize", "tolerance")
    )
    if not start < stop or not 0.0 < step <= stop - start or not tolerance > 0.0:
        yield "the default experiment cannot be run"
