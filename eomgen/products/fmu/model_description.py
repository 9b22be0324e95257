"""The files modelDescription.xml of FMI 2.0 and 3.0, and buildDescription.xml.

FMI 2.0.5 numbers variables from 1 in dependencies and in ``derivative``; FMI 3.0.2 has value references there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from xml.etree import ElementTree as ET

from eomgen.base.version import __version__
from eomgen.codegen.targets.c.printer import number
from eomgen.products.fmu.arrays import folded, listed
from eomgen.products.fmu.interface import Interface, Unknown, Variable, event_rows
from eomgen.products.fmu.units import FmuUnit
from eomgen.system.description import Simulation

#: Categories of messages, with descriptions.
CATEGORIES: Mapping[str, str] = {
    "logStatusError": "why a call failed",
    "logStatusWarning": "values that are replaced, and calls without effect",
    "logEvents": "events of the scene, samples of controllers, corrections of states",
}


def element(tag: str, attributes: Mapping[str, str], *parts: ET.Element) -> ET.Element:
    """Return an element of XML with its parts."""
    result = ET.Element(tag, dict(attributes))
    result.extend(parts)
    return result


def text_of(root: ET.Element) -> str:
    """Return a document of XML."""
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def model_description(interface: Interface, simulation: Simulation, sources: Sequence[str]) -> str:
    """Return modelDescription.xml.

    Parameters
    ----------
    simulation : default experiment
    sources : files to compile, which FMI 2.0 lists here
    """
    old = interface.version == 2
    files = [element("SourceFiles", {}, *(element("File", {"name": name}) for name in sources))] if old else []
    times = {"stopTime": simulation.duration, "stepSize": simulation.step, "tolerance": simulation.tolerance}
    numbers = {name: number(value) for name, value in times.items() if value is not None}
    groups = {
        "UnitDefinitions": [_unit(unit) for unit in interface.units],
        "TypeDefinitions": [_type(unit, name, interface) for unit, name in interface.types.items()],
        "LogCategories": [element("Category", {"name": key, "description": text}) for key, text in CATEGORIES.items()],
    }
    variables = _variables_2(interface) if old else _variables_3(interface)
    root = element(
        "fmiModelDescription",
        _attributes(interface),
        *(element(name, flags, *files) for name, flags in _interfaces(interface, simulation.step)),
        *(element(name, {}, *parts) for name, parts in groups.items() if parts),
        element("DefaultExperiment", {"startTime": "0", **numbers}),
        element("ModelVariables", {}, *variables),
        element("ModelStructure", {}, *(_structure_2(interface) if old else _structure_3(interface))),
    )
    return text_of(root)


def _interfaces(interface: Interface, step: float) -> list[tuple[str, dict[str, str]]]:
    """Return (element, attributes) of model exchange and of co-simulation, as far as the FMU has these."""
    method, flags = interface.program.method, {"canHandleVariableCommunicationStepSize": "true"}
    identity = {"modelIdentifier": interface.identifier}
    if interface.version == 2:
        common = {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"}
        common |= {"providesDirectionalDerivative": "true"} if interface.provides_derivatives else {}
        completed = {} if interface.projects else {"completedIntegratorStepNotNeeded": "true"}
        exchange = {**identity, **completed, **common}
        flags |= {"canInterpolateInputs": "true"} if method["inputs"] == "sampled" else {}
    else:
        common = {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
        if interface.provides_derivatives:
            common |= {"providesDirectionalDerivatives": "true", "providesAdjointDerivatives": "true"}
        completed = {"needsCompletedIntegratorStep": "true"} if interface.projects else {}
        exchange = {**identity, **common, **completed}
        flags |= {} if method["own_steps"] else {"fixedInternalStepSize": repr(step)}
    made = [("ModelExchange", exchange)] if interface.exchange else []
    return made + ([("CoSimulation", {**identity, **common, **flags})] if interface.simulation else [])


def build_description(interface: Interface, sources: Sequence[str], language: str = "C99") -> str:
    """Return buildDescription.xml of FMI 3.0.

    Functions have a prefix for static linking unless FMI3_OVERRIDE_FUNCTION_PREFIX is defined; builders of shared
    libraries define this macro, and builders that do not know the prefix take the definition from here.
    """
    definition = {
        "name": "FMI3_OVERRIDE_FUNCTION_PREFIX",
        "value": "1",
        "optional": "true",
        "description": "for shared libraries; otherwise functions have the prefix of the model, for static linking",
    }
    files = [element("SourceFile", {"name": name}) for name in sources]
    files.append(element("PreprocessorDefinition", definition))
    source_set = element("SourceFileSet", {"language": language}, *files)
    configuration = element("BuildConfiguration", {"modelIdentifier": interface.identifier}, source_set)
    return text_of(element("fmiBuildDescription", {"fmiVersion": "3.0"}, configuration))


def _attributes(interface: Interface) -> dict[str, str]:
    token = "guid" if interface.version == 2 else "instantiationToken"
    attributes = {"fmiVersion": f"{interface.version}.0", "modelName": interface.name, token: interface.token}
    about = interface.options.about
    said = {"author": about.author, "version": about.version, "copyright": about.copyright, "license": about.license}
    attributes |= {"description": described(interface), **{name: text for name, text in said.items() if text}}
    attributes["generationTool"] = f"eomgen {__version__}"
    attributes["variableNamingConvention"] = "structured" if interface.structured else "flat"
    if interface.version == 2 and interface.exchange:
        attributes["numberOfEventIndicators"] = str(len(event_rows(interface.program)))
    return attributes


def described(interface: Interface) -> str:
    """Return the description of the model in one line, with the form of constraints in model exchange."""
    text = " ".join(interface.description.split())
    if interface.exchange and interface.program.sizes["lam"]:
        form = (
            "accelerations and multipliers of index 1, with projection of positions and velocities at completed steps"
        )
        if interface.options.minimal:
            form = "minimal coordinates: states are independent coordinates and velocities"
        text = f"{text}{'. ' if text else ''}Model exchange: constraints by {form}"
    return text


def _unit(unit: FmuUnit) -> ET.Element:
    base = {name: str(power) for name, power in unit.exponents.items()}
    base |= {"factor": number(unit.factor)} if unit.factor != 1.0 else {}
    shown = [element("DisplayUnit", {"name": name, "factor": number(factor)}) for name, factor in unit.displayed]
    return element("Unit", {"name": unit.name}, element("BaseUnit", base), *shown)


def _type(unit: str, name: str, interface: Interface) -> ET.Element:
    attributes = {"quantity": name.removesuffix("Type"), "unit": unit}
    if interface.version == 3:
        return element("Float64Type", {"name": name, **attributes})
    return element("SimpleType", {"name": name}, element("Real", attributes))


def _value_attributes(item: Variable, interface: Interface) -> dict[str, str]:
    """Return the XML attributes of a variable's number: type, unit, range, start, ``derivative`` and ``reinit``. FMI
    2.0 counts states from 1."""
    result = {"declaredType": interface.types[item.unit]} if item.unit in interface.types else {}
    if item.unit:
        result["unit"] = item.unit
    for name, value in (("min", item.lower), ("max", item.upper), ("start", item.start)):
        if value is not None:
            result[name] = number(value)
    if item.derivative is not None:
        result["derivative"] = str(item.derivative + (interface.version == 2))
    if item.reinit and interface.exchange:
        result["reinit"] = "true"
    return result


def _head(item: Variable) -> dict[str, str]:
    result = {"name": item.name, "valueReference": str(item.reference)}
    if item.description:
        result["description"] = " ".join(item.description.split())
    result |= {"causality": item.causality, "variability": item.variability}
    if item.initial:
        result["initial"] = item.initial
    return result


def _variables_2(interface: Interface) -> Iterator[ET.Element]:
    for item in interface.variables:
        yield element("ScalarVariable", _head(item), element("Real", _value_attributes(item, interface)))


def _variables_3(interface: Interface) -> Iterator[ET.Element]:
    for whole in listed(interface):
        item = whole.variable
        attributes = {**_head(item), **_value_attributes(item, interface)}
        if item.kind == "switch":
            yield element("Boolean", {**attributes, "start": "false"})
            continue
        if whole.size > 1 and item.start is not None:
            attributes["start"] = " ".join(number(scalar.start or 0.0) for scalar in whole.numbers)
        dimensions = [element("Dimension", {"start": str(whole.size)})] if whole.size > 1 else []
        yield element("Float64", attributes, *dimensions)


def _structure_2(interface: Interface) -> Iterator[ET.Element]:
    groups = {"Outputs": interface.outputs, "Derivatives": interface.derivatives}
    for name, unknowns in {**groups, "InitialUnknowns": interface.initial_unknowns}.items():
        if unknowns:
            places = [{"index": str(item.reference + 1), **_dependencies(item, 1)} for item in unknowns]
            yield element(name, {}, *(element("Unknown", attributes) for attributes in places))


def _structure_3(interface: Interface) -> list[ET.Element]:
    return [
        *unknown_elements(interface, "Output", interface.outputs),
        *unknown_elements(interface, "ContinuousStateDerivative", interface.derivatives),
        *unknown_elements(interface, "InitialUnknown", interface.initial_unknowns),
        *unknown_elements(interface, "EventIndicator", interface.indicators),
    ]


def unknown_elements(interface: Interface, name: str, unknowns: Iterable[Unknown]) -> list[ET.Element]:
    """Return the entries of unknowns in a model structure, with arrays in place of their numbers."""
    every = folded(interface, unknowns)
    return [element(name, {"valueReference": str(item.reference), **_dependencies(item, 0)}) for item in every]


def _dependencies(unknown: Unknown, first: int) -> dict[str, str]:
    """Return the attributes of dependencies, with the variables counted from ``first``."""
    if unknown.dependencies is None:
        return {}
    references = " ".join(str(reference + first) for reference in unknown.dependencies)
    return {"dependencies": references, "dependenciesKind": " ".join(unknown.kinds)}
