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
from eomgen.products.fmu.model_description import element, text_of, unknown_elements

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
    (switch,), algebraic = interface.of("switch"), interface.of("algebraic")
    references = [{"valueReference": str(item.reference)} for item in algebraic]
    rates = [item for item in interface.variables if item.derivative is not None]
    structure = {
        "Output": _unknowns(interface, interface.of("output")),
        "ContinuousStateDerivative": _unknowns(interface, rates),
        "InitialUnknown": interface.initial_unknowns,
        "EventIndicator": interface.indicators,
        "Residual": _unknowns(interface, interface.of("residual")),
    }
    entries = [entry for name, items in structure.items() for entry in unknown_elements(interface, name, items)]
    root = element(
        "fmiDAEManifest",
        {f"{{{_NAMESPACE}}}fmi-ls-{key}": text for key, text in names.items()},
        element("EnableDAEParameter", {"valueReference": str(switch.reference)}),
        element("AlgebraicVariables", {}, *(element("AlgebraicVariable", item) for item in references)),
        element("ModelStructure", {}, *entries),
    )
    return text_of(root)


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
