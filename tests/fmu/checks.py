"""The check of FMUs that eomgen writes: FMPy's by the schemas of both standards, and rules that FMPy does not know.

The check reads the files alone, and shares no code with the writer, so that mistakes of the writer stay visible.
"""

from __future__ import annotations

import io
import math
import posixpath
import re
import zipfile
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from xml.etree import ElementTree as ET

from fmpy import read_model_description

MANIFEST = "extra/org.fmi-standard.fmi-ls-dae/fmi-ls-manifest.xml"
_BUILD = "sources/buildDescription.xml"
_LS = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-"
_QUOTED = r"'(?:[_a-zA-Z0-9!#$%&()*+,\-./:;<>=?@\[\]^{}| ~]|\\['\"?\\abfnrtv])+'"
_PART = rf"(?:[_a-zA-Z][_a-zA-Z0-9]*|{_QUOTED})(?:\[\d+(?:,\d+)*\])?"
_STRUCTURED = re.compile(rf"{_PART}(?:\.{_PART})*|der\({_PART}(?:\.{_PART})*\)")
_C_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_RESERVED = re.compile(
    r"auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|"
    r"restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while|"
    r"_Bool|_Complex|_Imaginary"
)
_ASKED = re.compile(r"\*enterEventMode\s*=(?:[^;=]+=)*([^;=]+);")
_INCLUDED = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)
_PLATFORM = {
    True: re.compile(r"(?:aarch64|x86|x86_64)-(darwin|linux|windows)"),
    False: re.compile(r"(win|linux|darwin)(?:32|64)"),
}
_ENDINGS = {"win": "dll", "windows": "dll", "linux": "so", "darwin": "dylib"}
#: Attributes that eomgen has in FMI 3.0, whose schema allows any.
_ATTRIBUTES = re.compile(
    "A|K|author|canGetAndSetFMUState|canHandleVariableCommunicationStepSize|canSerializeFMUState|causality|copyright|"
    "declaredType|dependencies|dependenciesKind|derivative|description|factor|fixedInternalStepSize|fmiVersion|"
    "generationTool|initial|instantiationToken|kg|license|m|max|min|modelIdentifier|modelName|name|"
    "needsCompletedIntegratorStep|providesAdjointDerivatives|providesDirectionalDerivatives|quantity|rad|reinit|s|"
    "start|startTime|stepSize|stopTime|tolerance|unit|valueReference|variability|variableNamingConvention|version"
)
#: Lists of the model structure of FMI 2.0 by the elements of FMI 3.0.
_LISTS = {"Output": "Outputs", "ContinuousStateDerivative": "Derivatives", "InitialUnknown": "InitialUnknowns"}


def findings(files: Mapping[str, str | bytes], *more: str) -> list[str]:
    """Return a sentence for each fault of an archive, whose files are given by path, with further paths ``more``. Where
    FMPy has findings, the other rules do not apply."""
    texts = {name: text for name, text in files.items() if isinstance(text, str)}
    if faults := _of_fmpy({name: text for name, text in texts.items() if name in ("modelDescription.xml", _BUILD)}):
        return faults
    model = Description(ET.fromstring(texts["modelDescription.xml"]))
    rules = (_of_variables, _of_units, _of_structure, _of_interfaces, _of_experiment)
    found = [fault for rule in rules for fault in rule(model)]
    if manifest := texts.get(MANIFEST):
        found += _of_manifest(model, manifest)
    if len(files) > 1:
        found += [*_of_paths(model, [*files, *more]), *_of_sources(model, texts)]
    return found


def _of_fmpy(files: Mapping[str, str]) -> list[str]:
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as target:
        for name, text in files.items():
            target.writestr(name, text)
    try:
        read_model_description(archive, validate_model_structure=True)
    except Exception as fault:  # of any kind, where documents do not fit together
        return [f"FMPy: {fault!r}"]
    return []


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
    references = Counter(variable.get("valueReference") for variable in model.variables)
    structured = model.root.get("variableNamingConvention") == "structured"
    if sum(variable.get("causality") == "independent" for variable in model.variables) != 1:
        yield "there is not one independent variable"
    for variable in model.variables:
        name = variable.get("name", "")
        if not (_STRUCTURED.fullmatch(name) if structured else name.isprintable()):
            yield f"{name} does not fit the grammar of names"
        if references[variable.get("valueReference")] > 1:
            yield f"another variable has the value reference of {name}"
        if variable.get("causality") == "input" and variable.get("initial") is not None and not model.third:
            yield f"the input {name} has the attribute initial"
        if model.typed[variable].tag == "Boolean":
            if model.typed[variable].get("start") not in ("true", "false"):
                yield f"{name} has another start value than true or false"
        else:
            yield from (f"{name}: {fault}" for fault in _of_numbers(model, variable))
        yield from (f"{name}: {fault}" for fault in _of_derivative(model, variable, name if structured else ""))


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


def _of_derivative(model: Description, variable: ET.Element, name: str) -> Iterator[str]:
    """Yield faults of derivatives and states; ``name`` is empty where names have no grammar."""
    named, key = re.fullmatch(r"der\((.*)\)", name), model.typed[variable].get("derivative")
    if model.typed[variable].get("reinit") == "true" and not model.is_state(variable):
        yield "reinit belongs to states"
    if key is None:
        if named is not None:
            yield "derivative is missing"
        return
    state = model.by_key.get(key)
    if state is None or not (model.is_continuous(state) and model.is_continuous(variable)):
        yield "derivative names no state"
        return
    if state is variable or model.rates[key] is not variable:
        yield "derivative names a state with another derivative"
    if model.size(state) != model.size(variable):
        yield "derivative names a state of another size"
    if named is not None and named[1] != state.get("name"):
        yield "derivative names another state than the name"
    of_state, of_rate = model.base(state), model.base(variable)
    if of_state is not None and of_rate is not None and {**of_state, "s": of_state["s"] - 1.0} != of_rate:
        yield "the unit is not the state's over a second"


def _of_units(model: Description) -> Iterator[str]:
    units = [unit.get("name") for unit in model.root.iterfind("UnitDefinitions/Unit")]
    types = {element.get("name"): element for element in model.root.iterfind("TypeDefinitions/*")}
    of_types = {(x if model.third else x[0]).get("unit") for x in types.values()}
    used, declared = ({typed.get(key) for typed in model.typed.values()} for key in ("unit", "declaredType"))
    if Counter(units) != Counter((used | of_types) - {None}):
        yield "units are not defined once each, and used"
    if types.keys() != declared - {None} or types.keys() & {variable.get("name") for variable in model.variables}:
        yield "types are not those of the variables, or have names of variables"
    for unit in model.root.iterfind("UnitDefinitions/Unit"):
        shown = [element.get("name") for element in unit.iterfind("DisplayUnit")]
        factors = [float(element.get("factor", "1")) for element in unit]
        if len(shown) != len(set(shown)) or not all(math.isfinite(factor) and factor for factor in factors):
            yield f"{unit.get('name')} has a display unit twice, or a factor that is zero or not finite"


def _entries(model: Description, structure: ET.Element, name: str) -> list[tuple[ET.Element, ET.Element | None]]:
    """Return the entries of a list, named as in FMI 3.0, with the variables."""
    found = structure.iterfind(name if model.third else f"{_LISTS.get(name, name)}/Unknown")
    return [(entry, model.by_key.get(entry.get("valueReference" if model.third else "index", ""))) for entry in found]


def _of_lists(
    model: Description, structure: ET.Element, lists: Mapping[str, Collection[ET.Element]], known: Callable[..., bool]
) -> Iterator[str]:
    """Yield entries of lists that repeat or are not allowed, and dependencies that are not known."""
    for name, allowed in lists.items():
        entries = _entries(model, structure, name)
        listed = [variable for _, variable in entries]
        if len(set(listed)) < len(listed) or not set(listed) <= set(allowed):
            yield f"{name} has an entry twice, or one that does not belong there"
        for entry, _ in entries:
            keys, kinds = entry.get("dependencies", "").split(), entry.get("dependenciesKind", "").split()
            knowns = [model.by_key.get(key) for key in keys]
            if len(set(keys)) < len(keys) or len(kinds) not in (0, len(keys)):
                yield f"{name} has a dependency twice, or another number of kinds"
            if not all(x is not None and (_is_initial(x) if name == "InitialUnknown" else known(x)) for x in knowns):
                yield f"{name} depends on a variable that is not known"
            if name == "InitialUnknown" and model.third and not set(kinds) <= {"dependent", "constant"}:
                yield f"{name} has a kind of other lists"


def _is_initial(variable: ET.Element) -> bool:
    """Return whether initial unknowns may depend on a variable."""
    return variable.get("causality") in ("input", "independent") or variable.get("initial") == "exact"


def _of_structure(model: Description) -> Iterator[str]:
    structure, rates = model.root.find("ModelStructure"), list(model.rates.values())
    assert structure is not None
    numbers = [variable for variable in model.variables if model.is_continuous(variable)]
    lists = dict.fromkeys(("Output", "InitialUnknown"), model.variables)
    lists |= {"ContinuousStateDerivative": rates, "EventIndicator": numbers}
    yield from _of_lists(model, structure, lists, model.is_known)
    listed = [variable for _, variable in _entries(model, structure, "ContinuousStateDerivative")]
    if model.root.find("ModelExchange") is not None and set(listed) != set(rates):
        yield "not all derivatives of states are listed"


def _of_interfaces(model: Description) -> Iterator[str]:
    unknown = {key for element in model.root.iter() for key in element.attrib if not _ATTRIBUTES.fullmatch(key)}
    if model.third and unknown:
        yield f"no attribute is called {unknown}"
    word = "State" if model.third else "state"
    for interface in model.interfaces:
        identifier = interface.get("modelIdentifier", "")
        if not _C_NAME.fullmatch(identifier) or _RESERVED.fullmatch(identifier):
            yield f"{identifier} is not an identifier of C"
        if interface.get(f"canSerializeFMU{word}") == "true" != interface.get(f"canGetAndSetFMU{word}"):
            yield "states are serialized, and not set"
        if not float(interface.get("fixedInternalStepSize", "1")) > 0.0:
            yield "the internal step is not positive"
    if model.root.find("ModelExchange") is None and model.root.get("numberOfEventIndicators", "0") != "0":
        yield "event indicators belong to model exchange"


def _of_experiment(model: Description) -> Iterator[str]:
    experiment = model.root.find("DefaultExperiment")
    assert experiment is not None
    start, stop, step, tolerance = (
        float(experiment.get(key, "1")) for key in ("startTime", "stopTime", "stepSize", "tolerance")
    )
    if not start < stop or not 0.0 < step <= stop - start or not tolerance > 0.0:
        yield "the default experiment cannot be run"


def _of_paths(model: Description, names: Collection[str]) -> Iterator[str]:
    for name, count in Counter(name.lower() for name in names).items():
        if count > 1:
            yield f"the path {name} is there {count} times"
    for name in names:
        if "\\" in name or ":" in name or name.startswith("/") or ".." in name.split("/"):
            yield f"the path {name} is not relative with slashes"
        if model.third and re.search(r"(^|/)fmi3\w+\.h$", name):
            yield f"{name} is the importer's"
    if "documentation/index.html" not in names:
        yield "documentation has no index.html"
    folders = {name.split("/")[1] for name in names if name.startswith("binaries/")}
    for folder in folders:
        platform = _PLATFORM[model.third].fullmatch(folder)
        if platform is None:
            yield f"binaries/{folder} is not the name of a platform"
            continue
        for identifier in {interface.get("modelIdentifier") for interface in model.interfaces}:
            library = f"binaries/{folder}/{identifier}.{_ENDINGS[platform[1]]}"
            if library not in names:
                yield f"{library} is missing"


def _of_sources(model: Description, texts: Mapping[str, str]) -> Iterator[str]:
    """Yield faults of lists of sources, and C without the token, the prefix or the flags of the model."""
    sources = {name.removeprefix("sources/"): text for name, text in texts.items() if name.endswith((".c", ".h"))}
    whole = "\n".join(sources.values())
    token = model.root.get("instantiationToken" if model.third else "guid")
    if f'"{token}"' not in whole:
        yield "the token is in no source"
    prefixes = set(re.findall(rf"#\s*define\s+FMI{3 if model.third else 2}_FUNCTION_PREFIX\s+(\w+)_\s", whole))
    identifiers = {interface.get("modelIdentifier") for interface in model.interfaces}
    if not identifiers <= prefixes:
        yield "no source defines the prefix of functions"
    lists = [[file.get("name", "") for file in interface.iter("File")] for interface in model.interfaces]
    if model.third:
        build = ET.fromstring(texts.get(_BUILD, "<none/>"))
        lists = [[file.get("name", "") for file in build.iter("SourceFile")]]
        named = {x.get("modelIdentifier") for x in build.iter("BuildConfiguration")}
        macros = [x.get("name") for x in build.iter("PreprocessorDefinition")]
        if named != identifiers or macros != ["FMI3_OVERRIDE_FUNCTION_PREFIX"]:
            yield "the build description has another identifier or another macro"
    for listed in lists:
        if len(set(listed)) < len(listed) or _reached(sources, listed) != sources.keys() | set(listed):
            yield "sources are listed twice, missing, or neither listed nor included"
    exchange = model.root.find("ModelExchange")
    asks = {value.strip() for value in _ASKED.findall(whole)} - {"fmi2False", "fmi3False"}
    if exchange is not None and asks:
        needed = exchange.get("needsCompletedIntegratorStep") == "true"
        if not (needed if model.third else exchange.get("completedIntegratorStepNotNeeded") != "true"):
            yield "the sources ask for events after completed steps, and model exchange does not say so"


def _reached(sources: Mapping[str, str], listed: Iterable[str]) -> set[str]:
    """Return the names of the sources that compilers read."""
    reached, waiting = set[str](), [name for name in listed if name in sources]
    while waiting:
        name = waiting.pop()
        reached.add(name)
        folder = posixpath.dirname(name)
        included = (posixpath.normpath(posixpath.join(folder, x)) for x in _INCLUDED.findall(sources[name]))
        waiting += [x for x in included if x in sources and x not in reached]
    return reached


def _of_manifest(model: Description, text: str) -> Iterator[str]:
    """Yield faults of a manifest of FMI-LS-DAE, draft 1.0.0-alpha.1: switch, algebraic variables, residuals."""
    root = ET.fromstring(text)
    structure = root.find("ModelStructure")
    named = root.get(f"{_LS}name") == "org.fmi-standard.fmi-ls-dae"
    if root.tag != "fmiDAEManifest" or structure is None or not named:
        yield "the manifest is not of FMI-LS-DAE"
        return
    if not root.get(f"{_LS}version") or not root.get(f"{_LS}description"):
        yield "the manifest has no version or description"
    switches = [model.by_key.get(x.get("valueReference", "")) for x in root.iterfind("EnableDAEParameter")]
    if [(x.tag, x.get("causality")) for x in switches if x is not None] != [("Boolean", "structuralParameter")]:
        yield "the manifest has not one switch, a structural parameter"
    keys = [x.get("valueReference", "") for x in root.iterfind("AlgebraicVariables/AlgebraicVariable")]
    algebraic = [model.by_key.get(key) for key in keys]
    if len(set(keys)) < len(keys) or not all(x is not None and model.is_continuous(x) for x in algebraic):
        yield "the manifest has an algebraic variable twice, or one that is not continuous"
    if any(x is not None and model.is_state(x) for x in algebraic):
        yield "the manifest has a state among the algebraic variables"
    rates, outputs = list(model.rates.values()), [x for x in model.variables if x.get("causality") == "output"]
    numbers = [x for x in model.variables if model.is_continuous(x)]
    residuals = [x for x in numbers if x not in algebraic and x not in rates]
    lists = {"Output": outputs, "ContinuousStateDerivative": rates, "EventIndicator": numbers}
    yield from _of_lists(model, structure, lists, lambda x: x in algebraic or model.is_known(x))
    of_residuals = {"Residual": residuals}
    yield from _of_lists(model, structure, of_residuals, lambda x: x in algebraic or x in rates or model.is_known(x))
    count = {name: len(_entries(model, structure, name)) for name in (*lists, *of_residuals)}
    if count["Output"] != len(outputs):
        yield "the manifest does not list all outputs"
    if count["Residual"] != len(algebraic) + len(rates) - count["ContinuousStateDerivative"]:
        yield "the manifest has another number of residuals than of unknowns"
