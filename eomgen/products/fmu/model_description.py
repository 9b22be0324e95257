"""The files modelDescription.xml of FMI 2.0 and 3.0, and buildDescription.xml.

FMI 2.0.5 numbers variables from 1 in dependencies and in ``derivative``; FMI 3.0.2 has value references there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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


def model_description(interface: Interface, simulation: Simulation, sources: Sequence[str]) -> str:
    """Return modelDescription.xml.

    Parameters
    ----------
    simulation : default experiment
    sources : files to compile, which FMI 2.0 lists here
    """
    root = _root(interface)
    for name, attributes in _interfaces(interface, simulation.step):
        element = ET.SubElement(root, name, attributes)
        if interface.version == 2:
            files = ET.SubElement(element, "SourceFiles")
            for source in sources:
                ET.SubElement(files, "File", name=source)
    _units(root, interface.units)
    _types(root, interface)
    categories = ET.SubElement(root, "LogCategories")
    for name, text in CATEGORIES.items():
        ET.SubElement(categories, "Category", name=name, description=text)
    times = {"stopTime": simulation.duration, "stepSize": simulation.step, "tolerance": simulation.tolerance}
    numbers = {name: number(value) for name, value in times.items() if value is not None}
    ET.SubElement(root, "DefaultExperiment", {"startTime": "0", **numbers})
    variables, structure = ET.SubElement(root, "ModelVariables"), ET.SubElement(root, "ModelStructure")
    if interface.version == 2:
        _write_variables_2(interface, variables, structure)
    else:
        _write_variables_3(interface, variables, structure)
    return _text(root)


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
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=interface.identifier)
    files = ET.SubElement(configuration, "SourceFileSet", language=language)
    for name in sources:
        ET.SubElement(files, "SourceFile", name=name)
    ET.SubElement(
        files,
        "PreprocessorDefinition",
        name="FMI3_OVERRIDE_FUNCTION_PREFIX",
        value="1",
        optional="true",
        description="for shared libraries; otherwise functions have the prefix of the model, for static linking",
    )
    return _text(root)


def _text(root: ET.Element) -> str:
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _root(interface: Interface) -> ET.Element:
    token = "guid" if interface.version == 2 else "instantiationToken"
    attributes = {"fmiVersion": f"{interface.version}.0", "modelName": interface.name, token: interface.token}
    about = interface.options.about
    said = {"author": about.author, "version": about.version, "copyright": about.copyright, "license": about.license}
    attributes |= {"description": described(interface), **{name: text for name, text in said.items() if text}}
    attributes["generationTool"] = f"eomgen {__version__}"
    attributes["variableNamingConvention"] = "structured" if interface.structured else "flat"
    if interface.version == 2 and interface.exchange:
        attributes["numberOfEventIndicators"] = str(len(event_rows(interface.program)))
    return ET.Element("fmiModelDescription", attributes)


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


def _units(root: ET.Element, units: Sequence[FmuUnit]) -> None:
    if not units:
        return
    parent = ET.SubElement(root, "UnitDefinitions")
    for unit in units:
        item = ET.SubElement(parent, "Unit", name=unit.name)
        base = {name: str(power) for name, power in unit.exponents.items()}
        if unit.factor != 1.0:
            base["factor"] = number(unit.factor)
        ET.SubElement(item, "BaseUnit", base)
        for name, factor in unit.displayed:
            ET.SubElement(item, "DisplayUnit", name=name, factor=number(factor))


def _types(root: ET.Element, interface: Interface) -> None:
    if not interface.types:
        return
    parent = ET.SubElement(root, "TypeDefinitions")
    for unit, name in interface.types.items():
        attributes = {"quantity": name.removesuffix("Type"), "unit": unit}
        if interface.version == 3:
            ET.SubElement(parent, "Float64Type", {"name": name, **attributes})
        else:
            ET.SubElement(ET.SubElement(parent, "SimpleType", name=name), "Real", attributes)


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


def _write_variables_3(interface: Interface, variables: ET.Element, structure: ET.Element) -> None:
    """Add the variables and the model structure of FMI 3 to these two XML elements."""
    for whole in listed(interface):
        item = whole.variable
        attributes = {**_head(item), **_value_attributes(item, interface)}
        if item.kind == "switch":
            ET.SubElement(variables, "Boolean", {**attributes, "start": "false"})
            continue
        if whole.size > 1 and item.start is not None:
            attributes["start"] = " ".join(number(scalar.start or 0.0) for scalar in whole.numbers)
        element = ET.SubElement(variables, "Float64", attributes)
        if whole.size > 1:
            ET.SubElement(element, "Dimension", start=str(whole.size))
    for name, unknowns in (
        ("Output", interface.outputs),
        ("ContinuousStateDerivative", interface.derivatives),
        ("InitialUnknown", interface.initial_unknowns),
        ("EventIndicator", interface.indicators),
    ):
        add_unknowns(structure, interface, name, unknowns)


def add_unknowns(parent: ET.Element, interface: Interface, name: str, unknowns: Iterable[Unknown]) -> None:
    """Add unknowns to a model structure, with arrays in place of their numbers."""
    for unknown in folded(interface, unknowns):
        ET.SubElement(parent, name, {"valueReference": str(unknown.reference), **_dependencies(unknown, 0)})


def _dependencies(unknown: Unknown, first: int) -> dict[str, str]:
    """Return the attributes of dependencies, with the variables counted from ``first``."""
    if unknown.dependencies is None:
        return {}
    return {
        "dependencies": " ".join(str(reference + first) for reference in unknown.dependencies),
        "dependenciesKind": " ".join(unknown.kinds),
    }


def _write_variables_2(interface: Interface, variables: ET.Element, structure: ET.Element) -> None:
    for item in interface.variables:
        parent = ET.SubElement(variables, "ScalarVariable", _head(item))
        ET.SubElement(parent, "Real", _value_attributes(item, interface))
    for name, unknowns in (
        ("Outputs", interface.outputs),
        ("Derivatives", interface.derivatives),
        ("InitialUnknowns", interface.initial_unknowns),
    ):
        if unknowns:
            parent = ET.SubElement(structure, name)
            for unknown in unknowns:
                ET.SubElement(parent, "Unknown", {"index": str(unknown.reference + 1), **_dependencies(unknown, 1)})
