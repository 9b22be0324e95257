"""Rules for the manifest of FMI-LS-DAE, draft 1.0.0-alpha.1: switch, algebraic variables, residuals, dependencies."""

from __future__ import annotations

from collections.abc import Callable, Collection

from tests.fmu.checks.document import Element, Malformed, Report, parsed
from tests.fmu.checks.grammar import integer
from tests.fmu.checks.structure import KINDS, Structure, is_known
from tests.fmu.checks.variables import Variable, Variables

MANIFEST = "extra/org.fmi-standard.fmi-ls-dae/fmi-ls-manifest.xml"
_NAME = "org.fmi-standard.fmi-ls-dae"


def manifest_findings(text: str, variables: Variables) -> list[str]:
    """Return the findings in a manifest of FMI-LS-DAE.

    Parameters
    ----------
    text : of the manifest
    variables : of the model description
    """
    report = Report(MANIFEST, "FMI-LS-DAE 1.0.0-alpha.1")
    try:
        root = parsed(text)
    except Malformed as fault:
        report.add(Element("document", {}, fault.line), fault.cause, "XML")
        return report.findings
    if root.tag != "fmiDAEManifest":
        report.add(root, "the root is not fmiDAEManifest", "manifests")
        return report.findings
    if root.attributes.get("fmi-ls:fmi-ls-name") != _NAME:
        report.add(root, f"fmi-ls-name is not {_NAME}", "manifests")
    for key in ("fmi-ls:fmi-ls-version", "fmi-ls:fmi-ls-description"):
        if not root.attributes.get(key):
            report.add(root, f"the attribute {key} is missing", "manifests")
    _check_switch(root, variables, report)
    _check_structure(root, variables, report)
    return report.findings


def _check_structure(root: Element, variables: Variables, report: Report) -> None:
    """Report lists that are not complete, numbers of residuals and unknowns that differ, and wrong dependencies."""
    algebraic = _algebraic(root, variables, report)
    structure = Structure(root, variables, report)
    outputs = [variable for variable in variables.all if variable.causality == "output"]
    structure.check("Output", outputs, 'all variables with causality="output"')
    rates = [variable for variable in variables.all if variable.derivative is not None]
    structure.check("ContinuousStateDerivative", rates, "derivatives of states", complete=False)
    places, of_rates = {variable.index for variable in algebraic}, {variable.index for variable in rates}
    numbers = [x for x in variables.all if x.index not in places | of_rates and x.causality in ("local", "output")]
    residuals = [variable for variable in numbers if variable.floating and variable.variability == "continuous"]
    structure.check("Residual", residuals, "continuous local variables", complete=False)
    implicit = len(rates) - len(structure.entries("ContinuousStateDerivative"))
    count, needed = len(structure.entries("Residual")), len(algebraic) + implicit
    if count != needed:
        report.add(structure.element, f"{count} residuals determine {needed} unknowns", "Residual")
    for name in ("Output", "ContinuousStateDerivative", "EventIndicator", "Residual"):
        more = places | of_rates if name == "Residual" else places
        structure.check_dependencies(name, _known_with(more, variables), KINDS)


def _known_with(places: Collection[int], variables: Variables) -> Callable[[Variable], bool]:
    """Return the test of knowns, of which variables at some places are further ones."""
    return lambda variable: variable.index in places or is_known(variable, variables)


def _check_switch(root: Element, variables: Variables, report: Report) -> None:
    switch = root.first("EnableDAEParameter")
    if switch is None:
        report.add(root, "the element EnableDAEParameter is missing", "EnableDAEParameter")
        return
    variable = variables.referred(integer(switch.attributes.get("valueReference", "")))
    if variable is None or variable.kind != "Boolean" or variable.causality != "structuralParameter":
        report.add(switch, "the reference names no structural parameter of type Boolean", "EnableDAEParameter")


def _algebraic(root: Element, variables: Variables, report: Report) -> list[Variable]:
    """Return the algebraic variables."""
    section, result = root.first("AlgebraicVariables"), list[Variable]()
    for element in section.all("AlgebraicVariable") if section is not None else ():
        variable = variables.referred(integer(element.attributes.get("valueReference", "")))
        if variable is None or not variable.floating or variable.variability != "continuous":
            report.add(element, "the reference names no continuous number", "AlgebraicVariable")
        elif variable in result:
            report.add(element, f'"{variable.name}" is listed twice', "AlgebraicVariable")
        elif variable.causality not in ("local", "output") or variables.is_state(variable):
            report.add(element, f'"{variable.name}" is a state, or neither local nor an output', "AlgebraicVariable")
        else:
            result.append(variable)
    return result
