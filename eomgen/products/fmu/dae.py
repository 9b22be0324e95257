"""FMI-LS-DAE: an FMU as a differential-algebraic system whose accelerations and multipliers the importer solves for.

Layered standard of the Modelica Association, draft 1.0.0-alpha.1 of 2 September 2026 (modelica/fmi-ls-dae, commit
78313f4). The FMU is an ordinary one until the importer sets a structural parameter. Then q, v and internal states are
the differential variables, accelerations a and multipliers lam the algebraic ones, of index 1:

    der(q) = T(q) v,    der(v) = a,    der(z) = f,    0 = M a + h + b + B^T lam - Q,    0 = B a + bias

Constraints and the rates of constraints are variables, too, with which an importer can bring a drifted state back.
"""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree as ET

from eomgen.products.fmu.interface import Interface, Unknown, Variable, unknown_by
from eomgen.products.fmu.model_description import add_unknowns

#: Version of the draft, and the commit in the repository of the standard.
VERSION, COMMIT = "1.0.0-alpha.1", "78313f4"
#: Path of the manifest in the archive.
MANIFEST = "extra/org.fmi-standard.fmi-ls-dae/fmi-ls-manifest.xml"
_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"


def dae_manifest(interface: Interface) -> str:
    """Return the manifest: switch, algebraic variables, and the structure of the system of index 1."""
    ET.register_namespace("fmi-ls", _NAMESPACE)
    names = {"name": "org.fmi-standard.fmi-ls-dae", "version": VERSION}
    names["description"] = "Layered standard for DAE support in FMI."
    root = ET.Element("fmiDAEManifest", {f"{{{_NAMESPACE}}}fmi-ls-{key}": text for key, text in names.items()})
    (switch,) = interface.of("switch")
    ET.SubElement(root, "EnableDAEParameter", valueReference=str(switch.reference))
    algebraic = ET.SubElement(root, "AlgebraicVariables")
    for item in interface.of("algebraic"):
        ET.SubElement(algebraic, "AlgebraicVariable", valueReference=str(item.reference))
    structure = ET.SubElement(root, "ModelStructure")
    rates = [item for item in interface.variables if item.derivative is not None]
    for name, unknowns in (
        ("Output", _unknowns(interface, interface.of("output"))),
        ("ContinuousStateDerivative", _unknowns(interface, rates)),
        ("InitialUnknown", interface.initial_unknowns),
        ("EventIndicator", interface.indicators),
        ("Residual", _unknowns(interface, interface.of("residual"))),
    ):
        add_unknowns(structure, interface, name, unknowns)
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _unknowns(interface: Interface, items: Iterable[Variable]) -> list[Unknown]:
    """Return the unknowns of variables, with dependencies on states, algebraic variables, inputs, parameters and the
    time. Dependencies that are not known are None: all."""
    places = {**interface.places, **{("z", item.index): item.reference for item in interface.of("sampled")}}
    result = []
    for item in items:
        dependencies = interface.dependencies.direct(item.kind, item.index)
        if dependencies is None:
            result.append(Unknown(item.reference))
            continue
        linear, others = ([places[key] for key in part if key in places] for part in dependencies)
        result.append(unknown_by(item.reference, linear, others))
    return result
