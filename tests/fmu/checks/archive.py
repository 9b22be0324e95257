"""Rules for the files of an archive: sources and build description, binaries, and the identity of XML and C."""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from collections.abc import Collection, Mapping

from tests.fmu.checks.document import Element, Malformed, Report, parsed

_C_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_ASKED = re.compile(r"\*enterEventMode\s*=(?:[^;=]+=)*([^;=]+);")
_INCLUDED = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)
#: Words of C that no identifier may be.
_RESERVED = re.compile(
    r"auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|"
    r"inline|int|long|register|restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while|_Bool|_Complex|_Imaginary"
)
_PLATFORMS2 = ("win32", "win64", "linux32", "linux64", "darwin32", "darwin64")
_PLATFORM3 = re.compile(
    r"(aarch32|aarch64|riscv32|riscv64|x86|x86_64|ppc32|ppc64)-(darwin|linux|windows)(-[A-Za-z0-9_]+)?"
)
_ENDINGS = {"win": ".dll", "windows": ".dll", "linux": ".so", "darwin": ".dylib"}
_HEADERS = ("fmi3PlatformTypes.h", "fmi3FunctionTypes.h", "fmi3Functions.h")
#: Languages of sources in build descriptions.
_LANGUAGES = (
    *("C89", "C90", "C95", "C99", "C11", "C17", "C18", "C23"),
    *("C++98", "C++03", "C++11", "C++14", "C++17", "C++20", "C++23"),
)
_INTERFACES = ("ModelExchange", "CoSimulation", "ScheduledExecution")
#: Elements of a build description with the required attributes.
_BUILD = {
    "fmiBuildDescription": ("fmiVersion",),
    "BuildConfiguration": ("modelIdentifier",),
    "SourceFileSet": (),
    "SourceFile": ("name",),
    "PreprocessorDefinition": ("name",),
    "Option": (),
    "IncludeDirectory": ("name",),
    "Library": ("name",),
    "Annotations": (),
}


def interfaces(root: Element) -> list[Element]:
    """Return the elements of model exchange, co-simulation and scheduled execution."""
    return [element for element in root.children if element.tag in _INTERFACES]


def is_c_name(text: str) -> bool:
    """Return whether a text is an identifier of C."""
    return bool(_C_NAME.fullmatch(text)) and not _RESERVED.fullmatch(text)


def check_names(names: Collection[str], report: Report) -> None:
    """Report paths that an archive must not have."""
    lower = dict[str, str]()
    for name, count in sorted(Counter(iter(names)).items()):
        if count > 1:
            report.add(None, f'the path "{name}" is there {count} times', "paths of the archive")
        if "\\" in name or name.startswith("/") or ".." in name.split("/") or ":" in name:
            report.add(None, f'the path "{name}" is not relative with slashes', "paths of the archive")
        other = lower.setdefault(name.lower(), name)
        if other != name:
            report.add(None, f'"{name}" and "{other}" differ in case alone', "paths of the archive")
    if "modelDescription.xml" not in names:
        report.add(None, "modelDescription.xml is not at the root of the archive", "files of the archive")
    if any(name.startswith("documentation/") for name in names) and "documentation/index.html" not in names:
        report.add(None, "documentation has no index.html", "documentation of the archive")


def check_headers(names: Collection[str], report: Report) -> None:
    """Report headers of FMI in an archive of FMI 3.0."""
    for name in sorted(names) if report.standard.startswith("FMI 3") else ():
        if posixpath.basename(name) in _HEADERS:
            report.add(None, f"{name} is the importer's", "headers of FMI, which an archive must not have")


def check_binaries(root: Element, names: Collection[str], report: Report) -> None:
    """Report folders of binaries that are not named by a platform, and libraries with other names than the model."""
    third = report.standard.startswith("FMI 3")
    identifiers = {element.attributes.get("modelIdentifier", "") for element in interfaces(root)}
    folders = {name.split("/")[1]: set[str]() for name in names if name.startswith("binaries/") and name.count("/") > 1}
    for name in names:
        parts = name.split("/")
        if parts[0] == "binaries" and len(parts) == 3:
            folders[parts[1]].add(parts[2])
    for folder, files in sorted(folders.items()):
        match = _PLATFORM3.fullmatch(folder) if third else None
        if match is None and (third or folder not in _PLATFORMS2):
            report.add(None, f"binaries/{folder} is not the name of a platform", "folders of binaries")
            continue
        system = match[2] if match is not None else folder.rstrip("0123456789")
        for identifier in sorted(identifiers):
            library = f"{identifier}{_ENDINGS[system]}"
            if library not in files:
                report.add(None, f"binaries/{folder}/{library} is missing", "folders of binaries")


def check_second_sources(root: Element, names: Collection[str], report: Report) -> None:
    """Report sources of FMI 2.0 that are listed and missing, or not listed."""
    for interface in interfaces(root):
        section = interface.first("SourceFiles")
        listed = [] if section is None else section.all("File")
        for file in listed:
            path = posixpath.join("sources", file.attributes.get("name", ""))
            if path not in names:
                report.add(file, f"{path} is not in the archive", "SourceFiles")
        if not listed and any(name.startswith("sources/") for name in names):
            report.add(interface, "there are sources, and SourceFiles lists none", "SourceFiles")


def check_build_description(root: Element, text: str, names: Collection[str], model: Report) -> list[str]:
    """Return the findings in a build description of FMI 3.0.

    Parameters
    ----------
    root : of the model description
    text : of the build description, empty for none
    names : paths of the archive
    model : findings in the model description, for sources without a build description
    """
    file = "sources/buildDescription.xml"
    if not text:
        if any(name.startswith("sources/") for name in names):
            model.add(None, f"there are sources, and {file} is missing", "build descriptions")
        return []
    report = Report(file, model.standard)
    try:
        build = parsed(text)
    except Malformed as fault:
        report.add(Element("document", {}, fault.line), fault.cause, "XML")
        return report.findings
    if build.tag != "fmiBuildDescription":
        report.add(build, "the root is not fmiBuildDescription", "build descriptions")
        return report.findings
    for element, _ in build.walk():
        for key in _BUILD.get(element.tag, ()):
            if not element.attributes.get(key):
                report.add(element, f"the attribute {key} is missing", "build descriptions")
        if element.tag not in _BUILD:
            report.add(element, f"the element {element.tag} is not in the schema", "build descriptions")
    version, own = build.attributes.get("fmiVersion"), root.attributes.get("fmiVersion")
    if version != own:
        report.add(build, f'fmiVersion="{version}", and the model has "{own}"', "fmiVersion of build descriptions")
    _check_configurations(root, build, report)
    for files in (x for configuration in build.all("BuildConfiguration") for x in configuration.all("SourceFileSet")):
        _check_files(files, names, report)
    return report.findings


def _check_configurations(root: Element, build: Element, report: Report) -> None:
    identifiers = {element.attributes.get("modelIdentifier") for element in interfaces(root)}
    configurations = build.all("BuildConfiguration")
    if not configurations:
        report.add(build, "there is no BuildConfiguration", "BuildConfiguration")
    named = set[str | None]()
    for configuration in configurations:
        identifier = configuration.attributes.get("modelIdentifier")
        named.add(identifier)
        if identifier not in identifiers:
            cause = f'modelIdentifier="{identifier}" is not one of the model'
            report.add(configuration, cause, "BuildConfiguration")
        if not configuration.all("SourceFileSet"):
            report.add(configuration, "there is no SourceFileSet", "BuildConfiguration")
    for identifier in sorted(str(x) for x in identifiers - named if configurations):
        report.add(build, f'no BuildConfiguration has modelIdentifier="{identifier}"', "BuildConfiguration")
    general = [x for x in configurations if "platform" not in x.attributes]
    for identifier in sorted({str(x.attributes.get("modelIdentifier")) for x in general}):
        own = [x for x in general if x.attributes.get("modelIdentifier") == identifier]
        if len(own) > 1:
            report.add(own[1], "two build configurations have no platform", "BuildConfiguration")


def _check_files(files: Element, names: Collection[str], report: Report) -> None:
    sources, language = files.all("SourceFile"), files.attributes.get("language")
    if language is not None and language not in _LANGUAGES:
        report.add(files, f'language="{language}" is not one of {", ".join(_LANGUAGES)}', "SourceFileSet")
    if not sources:
        report.add(files, "there is no SourceFile", "SourceFileSet")
    seen = set[str]()
    for source in sources:
        name = source.attributes.get("name", "")
        if name in seen:
            report.add(source, "the file is listed twice", "SourceFile")
        seen.add(name)
        if names and posixpath.join("sources", name) not in names:
            report.add(source, f"sources/{name} is not in the archive", "SourceFile")
    for directory in files.all("IncludeDirectory"):
        folder = posixpath.normpath(posixpath.join("sources", directory.attributes.get("name", "")))
        if names and not any(name.startswith(f"{folder}/") for name in names):
            report.add(directory, f"{folder} is not in the archive", "IncludeDirectory")
    for definition in files.all("PreprocessorDefinition"):
        name, value = definition.attributes.get("name", ""), definition.attributes.get("value")
        if not is_c_name(name):
            report.add(definition, f'"{name}" is not an identifier of C', "PreprocessorDefinition")
        options = [option.attributes.get("value") for option in definition.all("Option")]
        if options and value not in options:
            report.add(definition, f'the value "{value}" is not one of the options', "PreprocessorDefinition")
    if not any(
        x.attributes.get("name") == "FMI3_OVERRIDE_FUNCTION_PREFIX" for x in files.all("PreprocessorDefinition")
    ):
        cause = (
            "FMI3_OVERRIDE_FUNCTION_PREFIX is not among the definitions, without which shared libraries have prefixes"
        )
        report.add(files, cause, "prefix of functions")


def check_source_texts(
    root: Element, sources: Mapping[str, str], lists: Mapping[str, Collection[str]], report: Report
) -> None:
    """Report C without the token or the identifier of the model, files that no other includes, and completed steps that
    ask for events without the flag.

    Parameters
    ----------
    sources : texts by path in ``sources``
    lists : names that compilers are given, by the listing element
    """
    third = report.standard.startswith("FMI 3")
    key = "instantiationToken" if third else "guid"
    token = root.attributes.get(key, "")
    if not any(f'"{token}"' in text for text in sources.values()):
        report.add(root, f'{key}="{token}" is in no source', f"{key}, which instances are checked against")
    each = {element: _reached(sources, listed) for element, listed in lists.items()}
    reached = set[str]().union(*each.values())
    for name in sorted(set(sources) - reached):
        if name.endswith((".c", ".h")):
            report.add(None, f"sources/{name} is neither listed nor included", "sources")
    for element, own in each.items():
        for name in sorted(reached - own):
            report.add(None, f"{element} lists no source that needs sources/{name}, as others do", "lists of sources")
    _check_completed_steps(root, sources, report)
    macro = "FMI3_FUNCTION_PREFIX" if third else "FMI2_FUNCTION_PREFIX"
    defined = {x for text in sources.values() for x in re.findall(rf"#\s*define\s+{macro}\s+(\w+)", text)}
    for identifier in sorted({element.attributes.get("modelIdentifier", "") for element in interfaces(root)}):
        if f"{identifier}_" not in defined:
            report.add(root, f"no source defines {macro} as {identifier}_", "prefix of functions")


def _check_completed_steps(root: Element, sources: Mapping[str, str], report: Report) -> None:
    """Report completed steps that may ask for an event, and model exchange that does not say so."""
    values = {value.strip() for text in sources.values() for value in _ASKED.findall(text)}
    exchange = root.first("ModelExchange")
    if exchange is None or not values - {"fmi2False", "fmi3False"}:
        return
    flags = exchange.attributes
    if report.standard.startswith("FMI 3"):
        missing = flags.get("needsCompletedIntegratorStep") not in ("true", "1")
        cause = 'the sources ask for events after completed steps, and needsCompletedIntegratorStep is not "true"'
    else:
        missing = flags.get("completedIntegratorStepNotNeeded") in ("true", "1")
        cause = 'the sources ask for events after completed steps, and completedIntegratorStepNotNeeded is "true"'
    if missing:
        report.add(exchange, cause, "completed steps")


def _reached(sources: Mapping[str, str], listed: Collection[str]) -> set[str]:
    """Return the names of the sources that compilers read."""
    reached, waiting = set[str](), [name for name in listed if name in sources]
    while waiting:
        name = waiting.pop()
        reached.add(name)
        folder = posixpath.dirname(name)
        included = (posixpath.normpath(posixpath.join(folder, x)) for x in _INCLUDED.findall(sources[name]))
        waiting += [x for x in included if x in sources and x not in reached]
    return reached
