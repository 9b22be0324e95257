"""The section of laws: schema, and reading of functions in files."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from typing import Annotated, Any

from pydantic import Field

from eomgen.base.messages import is_legal, key_of, nearest, shown
from eomgen.formula.units.conversion import coherent
from eomgen.formula.units.parser import UnitError, read_unit
from eomgen.products.laws.code import CCode, PythonCode, arguments_of, python_code
from eomgen.products.laws.law import FileLaw
from eomgen.scene.control.sampled import c_source, text_of
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.key_metadata import ForeignKeys, Table, key, optional
from eomgen.scene.reading.kinds import Description, Value
from eomgen.scene.reading.report import Report
from eomgen.scene.section import Reading, Section, UnusedEntries
from eomgen.scene.signals.curves import unit_factor
from eomgen.scene.signals.tables import is_in_si
from eomgen.system.signals import CSource

#: Names of arguments, parameters or results, of each at most.
_MOST = 64
_Name = Annotated[str, Field(min_length=1, max_length=64)]
_Path = Annotated[str, Field(min_length=1, max_length=1000)]
_Units = Annotated[dict[str, str], Field(min_length=1, max_length=_MOST)]


class LawEntry(Table):
    """A function of several numbers in a C file, or in a Python file for prototypes; in formulas `law.NAME(x, y)`, or
    `law.NAME.RESULT(x, y)` for one of several results."""

    source: _Path | None = optional(
        "path of a C file, from the folder of the scene file; required unless `python` is given", path=True, kind="text"
    )
    python: _Path | None = optional(
        "path of a Python file, from the folder of the scene file; in place of `source`, for prototypes",
        path=True,
        kind="text",
    )
    function: _Name = key("name of the function in the file", kind="text")
    partials: _Name | None = optional(
        "name of the function of partial derivatives in the file", kind="text", shown_default="differences"
    )
    complex_step: bool = key("partials of a `python` function by complex steps; it takes complex numbers", False)
    arguments: _Units = key("names of the arguments, in order, with units in SI", kind="table of texts")
    results: _Units = key("names of the results, in order, with units in SI", kind="table of texts")
    parameters: Annotated[dict[str, Value], Field(max_length=_MOST)] | None = optional(
        "names of further numbers, in order, with formulas of parameters", names=PARAMETERS, kind="table of formulas"
    )
    scales: Annotated[dict[str, Annotated[float, Field(gt=0.0)]], Field(max_length=2 * _MOST)] | None = optional(
        "typical sizes of arguments and parameters, in SI, for differences and checks",
        kind="table of numbers",
        shown_default="1 for each",
    )
    description: Description = key("text of one line for tables", "")


def _read(name: str, entry: LawEntry, reading: Reading) -> FileLaw | None:
    """Return the law of an entry of ``laws``. None for a fault, which goes into the report."""
    where, report = key_of("laws", name), reading.report
    before = len(report.noted)
    for part in ("arguments", "results", "parameters"):
        for label in getattr(entry, part) or {}:
            if not is_legal(label):
                report.add(
                    f"{where}.{part}", f"{shown(label)} is not a name [E0888]", "letters, digits and underscores"
                )
    for part in ("arguments", "results"):
        for label, unit in getattr(entry, part).items():
            _check_unit(f"{where}.{part}.{label}", unit, report)
    parameters, sizes = entry.parameters or {}, entry.scales or {}
    for label in parameters:
        if label in entry.arguments:
            report.add(
                f"{where}.parameters.{label}", f"{label} is an argument, too [E0890]", "another name for the parameter"
            )
    labels = [*entry.arguments, *parameters]
    for label in sizes:
        if label not in labels:
            fault = f"{shown(label)} is neither an argument nor a parameter of the law [E0891]"
            report.add(f"{where}.scales", fault, f"one of {', '.join(labels)}")
    parameter_formulas = {
        label: reading.values.formula(f"{where}.parameters.{label}", value, PARAMETERS)
        for label, value in parameters.items()
    }
    code = _code(where, entry, reading)
    if code is None or len(report.noted) > before:
        return None
    scales = tuple(float(sizes.get(label, 1.0)) for label in labels)
    return FileLaw(name, entry.arguments, entry.results, parameter_formulas, scales, code)


def _code(where: str, entry: LawEntry, reading: Reading) -> CCode | PythonCode | None:
    """Return the functions of a law in C or Python, read from the file that the entry names. None for a fault, which
    goes into the report under the law's key."""
    report = reading.report
    if (entry.source is None) == (entry.python is None):
        fault = (
            "source and python are both given [E0892]"
            if entry.source
            else "a file with the function is missing [E0893]"
        )
        report.add(where, fault, 'source = "law.c", or python = "law.py" for a prototype')
        return None
    if entry.partials == entry.function:
        report.add(f"{where}.partials", "values and partials are the same function [E0894]", "a function for each")
    if entry.python is not None:
        return _in_python(where, entry, entry.python, reading)
    if entry.complex_step:
        fault = "complex_step belongs to a law in Python [E0895]"
        report.add(f"{where}.complex_step", fault, "no complex_step, or partials in C")
    functions = {"function": (entry.function, f"void {entry.function}({arguments_of('double', 'results')})")}
    if entry.partials is not None:
        prototype = f"void {entry.partials}({arguments_of('double', 'partials')})"
        functions["partials"] = (entry.partials, prototype)
    if (entry.source or "").endswith(".py"):
        report.add(f"{where}.source", f"{shown(entry.source)} is a Python file [E0896]", f'python = "{entry.source}"')
        return None
    source = c_source(where, entry.source or "", functions, reading.folder, report)
    return None if source is None else CCode(source, entry.function, entry.partials or "")


def _in_python(key: str, entry: LawEntry, file: str, reading: Reading) -> PythonCode | None:
    """Return the code of a law in a Python file, which is parsed and not executed; None for a reported fault: an
    unreadable file, a missing function, or partials given twice."""
    report, path = reading.report, reading.folder / file
    if path.suffix != ".py":
        hint = "the path of a Python file, from the scene file's folder"
        report.add(f"{key}.python", f"{shown(file)} does not end in .py [E0903]", hint)
        return None
    if (text := text_of(f"{key}.python", path, report)) is None:
        return None
    try:
        body = ast.parse(text, path.name).body
    except (SyntaxError, ValueError) as error:
        line = f":{line}" if (line := getattr(error, "lineno", None)) else ""
        fault = f"{path.name}{line}: {getattr(error, 'msg', error)} [E2226]"
        report.add(f"{key}.python", fault, "a file in Python")
        return None
    functions = sorted(node.name for node in body if isinstance(node, ast.FunctionDef))
    assigned = {name.id for node in body for name in ast.walk(node) if isinstance(name, ast.Name)}
    for word, function in (("function", entry.function), ("partials", entry.partials)):
        if function is not None and function not in {*functions, *assigned}:
            hint = nearest(function, functions) if functions else f"def {function}(...): in the file"
            report.add(f"{key}.{word}", f"{path.name} has no function {shown(function)} [E0904]", hint)
            return None
    if entry.partials is not None and entry.complex_step:
        report.add(f"{key}.complex_step", "partials are given by a function, too [E0905]", "one of the two")
        return None
    sizes = (len(entry.arguments), len(entry.parameters or {}), len(entry.results))
    return python_code(key, path, text, (entry.function, entry.partials or ""), entry.complex_step, sizes)


def _check_unit(key: str, unit: str, report: Report) -> None:
    """Report a unit that is unknown or not of SI at ``key``: numbers of a law are not converted."""
    with suppress(UnitError):
        if not unit.strip() or is_in_si(unit):
            return
    if unit_factor(key, unit, report) != 1.0:
        fault = f"a law has numbers in SI that are not converted, and {shown(unit)} is not of SI [E0906]"
        report.add(key, fault, f'"{coherent(read_unit(unit))}", and the factor in the file')


def _twice(laws: Mapping[str, FileLaw]) -> Iterator[tuple[str, str, str]]:
    """Yield key, reason and remedy for each function whose name a law with another source uses, too: models have all
    files linked."""
    first: dict[str, FileLaw] = {}
    for law in laws.values():
        for function in filter(None, (law.code.function, law.code.slopes)):
            earlier_law = first.setdefault(function, law)
            if earlier_law.code.source.text != law.code.source.text:
                fault = f"the law {earlier_law.name} has a function {function} in another file [E2227]"
                yield f"{key_of('laws', law.name)}.function", fault, "another name for one of the functions in C"


class _Laws(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"entries": {"laws": {}}}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        laws = reading.tables["entries"]["laws"]
        for name, entry in reading.document.section("laws").items():
            laws[name] = _read(name, entry, reading) or _refused(name, entry)
        for fault in _twice(laws):
            reading.report.add(*fault)
        return dict(laws)

    def unused(self, reading: Reading) -> UnusedEntries:
        mentioned = reading.values.mentioned
        names = [name for name in reading.document.section("laws") if ("laws", name) not in mentioned]
        return UnusedEntries("law", "laws", names)

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"parts": {"laws": tuple(reading.items["laws"].values())}}


def _refused(name: str, entry: LawEntry) -> FileLaw:
    """Return a law in place of a refused one, so that reading goes on to the next problem."""
    return FileLaw(name, entry.arguments, entry.results, {}, (), CCode(CSource("", ""), ""))


LAWS = _Laws(
    key="laws",
    entry=LawEntry,
    after=("parameters",),
    before=("inputs", "bodies", "definitions"),
    bounds={"parameters": None},
    documentation="""
    Add a function of several numbers in a C file, or in a Python file for prototypes: ``law.NAME(x, y)``.""",
)


def _key_meant(name: str, keys: Collection[str], value: object) -> str:
    """Return the hint for a law in Python, the language of prototypes in other tools."""
    if name in ("module", "callable", "file") and {"source", "partials", "scales"} <= set(keys):
        return "source, a C file; python, a file in Python; or [definitions], if the law has a formula"
    return ""


ELSEWHERE = ForeignKeys(_key_meant)
