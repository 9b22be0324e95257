"""The check of an FMU that is about to be written: all rules that a model description and its archive must keep.

The check reads the XML alone, and shares no code with the writer, so that mistakes of the writer stay visible.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

from eomgen.products.fmu.dae import MANIFEST
from tests.fmu.checks.archive import (
    check_binaries,
    check_build_description,
    check_headers,
    check_names,
    check_second_sources,
    check_source_texts,
    interfaces,
    is_c_name,
)
from tests.fmu.checks.document import Element, Malformed, Report, parsed
from tests.fmu.checks.grammar import FMI2, FMI3, Standard, check_form, number
from tests.fmu.checks.manifest import manifest_findings
from tests.fmu.checks.structure import check_structure
from tests.fmu.checks.variables import Variables, check_units_and_types, check_variables

_FILE = "modelDescription.xml"
_VERSIONS: tuple[tuple[re.Pattern[str], Standard], ...] = (
    (re.compile(r"2\.0"), FMI2),
    (re.compile(r"3\.0(\.\d+)?"), FMI3),
)


def findings(
    model_description: str,
    build_description: str = "",
    *,
    names: Collection[str] = (),
    sources: Mapping[str, str] | None = None,
    manifest: str = "",
) -> list[str]:
    """Return the faults of a model description, of FMI 2.0 or FMI 3.0, and of the archive around.

    Parameters
    ----------
    model_description : text of ``modelDescription.xml``
    build_description : text of ``sources/buildDescription.xml``, empty for none
    names : paths of all files of the archive; empty: files are not checked
    sources : texts of the files in ``sources``, by paths there; None: texts are not checked
    manifest : text of the manifest of FMI-LS-DAE, empty for none

    Returns
    -------
    list of str
        A sentence for each fault: file, line, element, cause, and the rule of the standard; empty without faults.
    """
    try:
        root = parsed(model_description)
    except Malformed as fault:
        return [f"{_FILE}, line {fault.line}: {fault.cause} (XML)"]
    version = root.attributes.get("fmiVersion", "")
    standard = next((standard for pattern, standard in _VERSIONS if pattern.fullmatch(version)), None)
    if root.tag != "fmiModelDescription" or standard is None:
        cause = f'the root {root.tag} with fmiVersion="{version}" is not a model description of FMI 2.0 or FMI 3.0'
        return [f"{_FILE}, line {root.line}: {cause} (fmiVersion)"]
    report, variables = Report(_FILE, standard.name), Variables(root, standard)
    check_form(root, standard, report)
    _check_interfaces(root, standard, report)
    _check_experiment(root, report)
    _check_categories(root, report)
    check_units_and_types(root, variables, report)
    check_variables(root, variables, report)
    check_structure(root, variables, report)
    of_build = list[str]()
    if names:
        check_names(names, report)
        check_binaries(root, names, report)
    if not standard.third:
        check_second_sources(root, names, report) if names else None
    elif build_description or names:
        of_build = check_build_description(root, build_description, names, report)
    check_headers({*names, *(f"sources/{name}" for name in sources or ())}, report)
    if sources is not None:
        check_source_texts(root, sources, _listed(root, build_description), report)
    of_manifest = manifest_findings(manifest, variables) if manifest else []
    return [*report.findings, *of_build, *of_manifest]


def _listed(root: Element, build_description: str) -> dict[str, list[str]]:
    """Return the names of the sources that compilers are given, by the listing element."""
    if not build_description:
        return {x.tag: _names(x, "File") for x in interfaces(root)}
    try:
        build = parsed(build_description)
    except Malformed:
        return {}
    result: dict[str, list[str]] = {}
    for place, configuration in enumerate(build.all("BuildConfiguration"), 1):
        result[f"BuildConfiguration {place}"] = _names(configuration, "SourceFile")
    return result


def _names(element: Element, tag: str) -> list[str]:
    return [x.attributes.get("name", "") for inner, _ in element.walk() for x in inner.all(tag)]


def _check_interfaces(root: Element, standard: Standard, report: Report) -> None:
    """Report identifiers that are not names of C, and flags that need others."""
    if not interfaces(root):
        report.add(root, "there is neither ModelExchange nor CoSimulation", "types of FMUs")
    for interface in interfaces(root):
        flags = interface.attributes
        identifier = flags.get("modelIdentifier", "")
        if not is_c_name(identifier):
            cause = f'modelIdentifier="{identifier}" is not an identifier of C'
            report.add(interface, cause, "modelIdentifier")
        word = "State" if standard.third else "state"
        needed = {f"canSerializeFMU{word}": f"canGetAndSetFMU{word}"}
        if interface.tag == "CoSimulation":
            needed |= {
                "canReturnEarlyAfterIntermediateUpdate": "providesIntermediateUpdate",
                "providesEvaluateDiscreteStates": "hasEventMode",
            }
        for flag, other in needed.items():
            if flags.get(flag) in ("true", "1") and flags.get(other) not in ("true", "1"):
                report.add(interface, f"{flag} needs {other}", flag)
        step = flags.get("fixedInternalStepSize")
        if step is not None and not (number(step) or 0.0) > 0.0:
            report.add(interface, "the internal step is not positive", "fixedInternalStepSize")
    indicators = root.attributes.get("numberOfEventIndicators", "0")
    if indicators not in ("0", "") and root.first("ModelExchange") is None:
        report.add(root, "event indicators belong to model exchange", "numberOfEventIndicators")


def _check_experiment(root: Element, report: Report) -> None:
    """Report a default experiment that cannot be run."""
    experiment = root.first("DefaultExperiment")
    if experiment is None:
        return
    keys = ("startTime", "stopTime", "stepSize", "tolerance")
    start, stop, step, tolerance = (number(experiment.attributes.get(key, "")) for key in keys)
    if start is not None and stop is not None and not start < stop:
        report.add(experiment, f"the start {start:g} is not before the stop {stop:g}", "DefaultExperiment")
    if step is not None and not step > 0.0:
        report.add(experiment, f"the step {step:g} is not positive", "DefaultExperiment")
    if start is not None and stop is not None and step is not None and start < stop < start + step:
        report.add(experiment, f"the step {step:g} is longer than the experiment", "DefaultExperiment")
    if tolerance is not None and not tolerance > 0.0:
        report.add(experiment, f"the tolerance {tolerance:g} is not positive", "DefaultExperiment")


def _check_categories(root: Element, report: Report) -> None:
    section = root.first("LogCategories")
    names = [] if section is None else [x.attributes.get("name", "") for x in section.all("Category")]
    for name in sorted({name for name in names if names.count(name) > 1}):
        report.add(section, f'the category "{name}" is listed twice', "LogCategories")


def findings_of_files(files: Mapping[str, str | bytes]) -> list[str]:
    """Return the faults of an archive, whose files are given by path."""
    texts = {name: text for name, text in files.items() if isinstance(text, str)}
    sources = {name.removeprefix("sources/"): text for name, text in texts.items() if name.endswith((".c", ".h"))}
    build, manifest = (texts.get(name, "") for name in ("sources/buildDescription.xml", MANIFEST))
    return findings(texts["modelDescription.xml"], build, names=files, sources=sources, manifest=manifest)
