"""Every rule of the check of FMUs: one mutant of a good description for each, with the place of its finding."""
# ruff: noqa: E501  # one row of the tables a line

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest
from fmpy.validation import validate_fmu

from tests.fmu.checks import findings
from tests.fmu.descriptions import BUILD, NAMES2, NAMES3, SECOND, SOURCES, THIRD


class Mutant(NamedTuple):
    """A change of a good text, and parts of the one finding that names the fault."""

    old: str
    new: str
    place: str
    cause: str


_ANGLE = 'variable "joint.angle"'
_RATE = 'variable "der(joint.rate)"'

#: Mutants of the description of FMI 2.0.
OF_SECOND = {
    "not well-formed": Mutant("</ModelVariables>", "</ModelVariable>", "line 69", "mismatched tag"),
    "document type": Mutant("<fmiModelDescription ", "<!DOCTYPE x><fmiModelDescription ", "line 2", "document type"),
    "version": Mutant('fmiVersion="2.0"', 'fmiVersion="2.1"', "line 2", 'fmiVersion="2.1" is not a model description'),
    "guid missing": Mutant('guid="{8c4e810f}"', "", "fmiModelDescription", "the attribute guid is missing"),
    "guid empty": Mutant('guid="{8c4e810f}"', 'guid=""', "fmiModelDescription", 'guid="" is not a text'),
    "token of FMI 3": Mutant('guid="', 'instantiationToken="x" guid="', "line 2", "instantiationToken is not in the"),
    "date": Mutant("2026-11-25T08:00:00Z", "2026-11-25 08:00:00", "line 2", "is not a date"),
    "convention": Mutant('Convention="structured"', 'Convention="nested"', "line 2", "is not one of flat, structured"),
    "no types": Mutant("ModelExchange", "Unknown", "line 5", "Unknown must not be within fmiModelDescription"),
    "identifier": Mutant(
        '<ModelExchange modelIdentifier="pendulum"', '<ModelExchange modelIdentifier="a-b"', "ModelExchange", '"a-b"'
    ),
    "reserved identifier": Mutant(
        '<ModelExchange modelIdentifier="pendulum"', '<ModelExchange modelIdentifier="int"', "ModelExchange", '"int"'
    ),
    "flag of FMI 3": Mutant(
        "providesDirectionalDerivative=", "providesDirectionalDerivatives=", "ModelExchange", "Derivatives is not in"
    ),
    "flag of the other type": Mutant(
        'canInterpolateInputs="true"', 'completedIntegratorStepNotNeeded="true"', "CoSimulation", "is not in the schema"
    ),
    "value of a flag": Mutant('canInterpolateInputs="true"', 'canInterpolateInputs="yes"', "CoSimulation", "true or"),
    "serialisation alone": Mutant(
        'canGetAndSetFMUstate="true"', "", "ModelExchange", "canSerializeFMUstate needs canGetAndSetFMUstate"
    ),
    "missing source": Mutant("pendulum.c", "other.c", 'File name="other.c"', "sources/other.c is not in the archive"),
    "unit twice": Mutant('<Unit name="kg">', '<Unit name="s">', 'Unit name="s"', 'the unit "s" is defined twice'),
    "unit undefined": Mutant('unit="kg"', 'unit="g"', "Real", 'the unit "g" is not defined'),
    "unit unused": Mutant('max="10" unit="kg"', 'max="10"', 'Unit name="kg"', 'no variable has the unit "kg"'),
    "exponent": Mutant('<BaseUnit rad="1"/>', '<BaseUnit rad="half"/>', "BaseUnit", "is not an integer"),
    "base unit": Mutant('<BaseUnit kg="1"/>', '<BaseUnit g="1"/>', "BaseUnit", "the attribute g is not in the schema"),
    "factor zero": Mutant('factor="57.29577951308232"', 'factor="0"', "DisplayUnit", "the factor is zero"),
    "display unit": Mutant('displayUnit="deg"', 'displayUnit="grad"', "Real", 'the display unit "grad"'),
    "unit of a rate": Mutant(
        '<Real unit="rad/s^2" derivative="5"/>', '<Real unit="rad/s" derivative="5"/>', _RATE, "other values of s"
    ),
    "type undefined": Mutant(
        'declaredType="Angle"', 'declaredType="Corner"', _ANGLE, 'the type "Corner" is not defined'
    ),
    "type of another kind": Mutant('declaredType="Angle"', 'declaredType="Mode"', _ANGLE, "is of another kind"),
    "type named as a variable": Mutant(
        "Angle", "torque", 'SimpleType name="torque"', 'the type "torque" has the name of a variable'
    ),
    "type twice": Mutant('SimpleType name="Mode"', 'SimpleType name="Angle"', "SimpleType", "is defined twice"),
    "items of one value": Mutant('value="2"', 'value="1"', 'SimpleType name="Mode"', "two items have the same value"),
    "category twice": Mutant('name="logStatusError"', 'name="logEvents"', "LogCategories", "is listed twice"),
    "stop before start": Mutant('stopTime="2"', 'stopTime="0"', "DefaultExperiment", "is not before the stop"),
    "step negative": Mutant('stepSize="0.01"', 'stepSize="-0.01"', "DefaultExperiment", "is not positive"),
    "step too long": Mutant('stepSize="0.01"', 'stepSize="3"', "DefaultExperiment", "is longer than the experiment"),
    "tolerance zero": Mutant('tolerance="1e-6"', 'tolerance="0"', "DefaultExperiment", "the tolerance 0 is not"),
    "number": Mutant('stopTime="2"', 'stopTime="two"', "DefaultExperiment", "is not a number"),
    "order of sections": Mutant(
        "<UnitDefinitions>", "<LogCategories/><UnitDefinitions>", "UnitDefinitions", "follows LogCategories"
    ),
    "name twice": Mutant('name="reaction"', 'name="torque"', 'variable "torque"', "is taken by line 45"),
    "name empty": Mutant('name="reaction"', 'name=""', 'variable ""', 'name="" is not a text'),
    "name with a space": Mutant('name="reaction"', 'name="the reaction"', "the reaction", "does not fit the grammar"),
    "name of indices": Mutant('name="reaction"', 'name="reaction[1;2]"', "reaction", "does not fit the grammar"),
    "reference twice": Mutant('valueReference="7"', 'valueReference="2"', '"reaction"', 'belongs to "torque"'),
    "reference negative": Mutant('valueReference="7"', 'valueReference="-7"', '"reaction"', "is not an integer from 0"),
    "causality": Mutant('causality="calculatedParameter"', 'causality="derived"', '"weight"', "is not one of"),
    "input that is tunable": Mutant(
        'causality="input" variability="continuous"', 'causality="input" variability="tunable"', '"torque"', "allowed"
    ),
    "parameter that is continuous": Mutant(
        'causality="parameter" variability="tunable"', 'causality="parameter" variability="continuous"', '"mass"', "not"
    ),
    "input with initial": Mutant(
        'causality="input" variability="continuous"',
        'causality="input" variability="continuous" initial="exact"',
        '"torque"',
        'initial="exact", and a variable',
    ),
    "parameter that is calculated": Mutant(
        'variability="tunable" initial="exact"', 'variability="tunable" initial="calculated"', '"mass"', "has exact"
    ),
    "structural parameter": Mutant(
        'causality="parameter"', 'causality="structuralParameter"', '"mass"', "is not one of parameter"
    ),
    "start missing": Mutant('start="0" unit="N m"', 'unit="N m"', '"torque"', "there is no start value"),
    "start of a calculated variable": Mutant('<Real unit="N m"/>', '<Real start="0" unit="N m"/>', '"reaction"', "is a"),
    "start of time": Mutant('<Real unit="s"/>', '<Real start="0" unit="s"/>', '"time"', "has a start value"),
    "start of another type": Mutant('start="2"', 'start="two"', '"mass"', "is not a finite Real"),
    "start not finite": Mutant('start="2"', 'start="NaN"', '"mass"', "is not a finite Real"),
    "start out of range": Mutant('start="2"', 'start="12"', '"mass"', "is outside min and max"),
    "range": Mutant('min="0" max="10"', 'min="10" max="0"', '"mass"', "min 10 is above max 0"),
    "nominal zero": Mutant('nominal="1"', 'nominal="0"', _ANGLE, "the nominal value is zero"),
    "mode that is continuous": Mutant(
        'valueReference="0" causality="local" variability="discrete"',
        'valueReference="0" causality="local" variability="continuous"',
        '"mode"',
        "of type Enumeration cannot be continuous",
    ),
    "reinit of no state": Mutant('<Real start="0" unit="N m"/>', '<Real start="0" reinit="true" unit="N m"/>', '"torque"', "reinit belongs"),
    "derivative of the neighbour": Mutant('derivative="4"', 'derivative="5"', "der(joint.angle)", 'and the name says "joint.angle"'),
    "derivative out of range": Mutant('derivative="5"', 'derivative="50"', _RATE, "names the index 50, which is not"),
    "derivative of itself": Mutant('derivative="5"', 'derivative="7"', _RATE, "which is not another variable"),
    "derivative of an input": Mutant('derivative="5"', 'derivative="3"', _RATE, "which is neither a local variable nor an output"),
    "derivative missing": Mutant(' derivative="5"', "", _RATE, "derivative is missing"),
    "two independent": Mutant(
        'causality="input" variability="continuous">\n      <Real start="0" ',
        'causality="independent" variability="continuous">\n      <Real ',
        '"torque"',
        "at most one must be",
    ),
    "output not listed": Mutant(
        '      <Unknown index="8" dependencies="3 4 5" dependenciesKind="fixed dependent dependent"/>\n',
        "",
        '"reaction"',
        "Output does not list the variable",
    ),
    "local listed as output": Mutant('<Unknown index="8" dependencies="3 4 5"', '<Unknown index="4" dependencies="3 4 5"', 'index="4"', "must not be listed"),
    "output twice": Mutant('<Unknown index="8" dependencies="3 4 5"', '<Unknown index="5" dependencies="3 4 5"', 'index="5"', "is listed twice"),
    "index from zero": Mutant('<Unknown index="7" dependencies="3 4"', '<Unknown index="0" dependencies="3 4"', 'index="0"', "names no variable"),
    "derivative not listed": Mutant(
        '      <Unknown index="7" dependencies="3 4" dependenciesKind="tunable dependent"/>\n', "", _RATE, "does not list"
    ),
    "initial unknown that is exact": Mutant('<Unknown index="6" dependencies="5"/>', '<Unknown index="4"/>', 'index="4"', "must not be listed"),
    "initial unknown missing": Mutant('      <Unknown index="10" dependencies="2" dependenciesKind="constant"/>\n', "", '"weight"', "InitialUnknown does not list"),
    "dependency on an output": Mutant('dependencies="3 4" dep', 'dependencies="3 8" dep', 'index="7"', '"reaction", does not belong'),
    "dependency on a parameter": Mutant('dependencies="3 4" dep', 'dependencies="2 4" dep', 'index="7"', '"mass", does not belong'),
    "dependency out of range": Mutant('dependencies="3 4" dep', 'dependencies="3 40" dep', 'index="7"', "40 names no variable"),
    "dependency twice": Mutant('dependencies="3 4" dep', 'dependencies="3 3" dep', 'index="7"', "3 is listed twice"),
    "number of kinds": Mutant('"tunable dependent"', '"dependent"', 'index="7"', "2 dependencies have 1 kinds"),
    "kind": Mutant('"tunable dependent"', '"linear dependent"', 'index="7"', 'the kind "linear" is not one of'),
    "kinds alone": Mutant('dependencies="3 4" dep', "dep", 'index="7"', "there are kinds and no dependencies"),
    "lists in another order": Mutant("<Derivatives>", "<InitialUnknowns/><Derivatives>", "Derivatives", "follows InitialUnknowns"),
    "list without a name": Mutant("Outputs>", "Output>", "Output", "is not in the schema"),
    "start empty": Mutant('start="2"', 'start=""', '"mass"', "is not a finite Real"),
    "reinit of a derivative": Mutant('<Real unit="rad/s^2" derivative="5"/>', '<Real unit="rad/s^2" derivative="5" reinit="true"/>', _RATE, "reinit belongs to a state, and the variable is a derivative"),
    "factor that is no number": Mutant('factor="57.29577951308232"', 'factor="NaN"', "DisplayUnit", "the factor nan is not finite"),
    "range that is no number": Mutant('min="0" max="10"', 'min="NaN" max="10"', '"mass"', "min is not a number"),
    "encoding": Mutant('encoding="UTF-8"', 'encoding="ISO-8859-1"', "line 1", 'encoding="ISO-8859-1", and the standards ask for UTF-8'),
    "encoding of no program": Mutant('encoding="UTF-8"', 'encoding="KLINGON-7"', "line 1", "and the standards ask for UTF-8"),
    "structure missing": Mutant("ModelStructure", "Structure", "fmiModelDescription", "the element ModelStructure is missing"),
}  # fmt: skip

#: Mutants of the description of FMI 3.0.
OF_THIRD = {
    "version": Mutant('fmiVersion="3.0"', 'fmiVersion="3.1"', "line 2", "is not a model description"),
    "guid of FMI 2": Mutant("instantiationToken", "guid", "fmiModelDescription", "guid is not in the schema"),
    "event indicators of FMI 2": Mutant('modelName="', 'numberOfEventIndicators="1" modelName="', "line 2", "is not in"),
    "flag of FMI 2": Mutant("canGetAndSetFMUState", "canGetAndSetFMUstate", "ModelExchange", "is not in the schema"),
    "internal step": Mutant('StepSize="0.001"', 'StepSize="0"', "CoSimulation", "the internal step is not positive"),
    "early return": Mutant('hasEventMode="true"', 'canReturnEarlyAfterIntermediateUpdate="true"', "CoSimulation", "needs providesIntermediateUpdate"),
    "sections out of order": Mutant("<UnitDefinitions>", "<ModelVariables/><UnitDefinitions>", "line 8", "UnitDefinitions follows ModelVariables"),
    "display unit alone": Mutant('unit="rad" displayUnit="deg"', 'displayUnit="deg"', "Float64Type", 'the display unit "deg" is not one of'),
    "types unused": Mutant(' declaredType="Angle"', ' unit="rad"', 'Float64Type name="Angle"', "no variable has the type"),
    "time missing": Mutant('causality="independent"', 'causality="local" initial="calculated"', "modelDescription.xml:", "exactly one must be"),
    "time that is an integer": Mutant('<Float64 name="time"', '<Int32 name="time"', '"time"', "is not a floating-point number"),
    "time with initial": Mutant('causality="independent"', 'causality="independent" initial="exact"', '"time"', "has no value"),
    "alias of a taken name": Mutant('<Alias name="m"/>', '<Alias name="torque"/>', '"torque"', "is taken by line"),
    "reference twice": Mutant('name="reaction" valueReference="7"', 'name="reaction" valueReference="8"', '"mode"', "belongs to"),
    "input that is calculated": Mutant('causality="input" variability="continuous"', 'causality="input" variability="continuous" initial="calculated"', '"torque"', "has exact"),
    "start of a structural parameter": Mutant(' start="3"', "", '"size"', "there is no start value"),
    "values of a scalar": Mutant('start="0.5"', 'start="0.5 0.5"', _ANGLE, "a scalar has 2 start values"),
    "value of an integer": Mutant('declaredType="Mode" start="1"', 'declaredType="Mode" start="1.5"', '"mode"', "is not a finite Enumeration"),
    "enumeration without a type": Mutant(' declaredType="Mode"', "", '"mode"', "the attribute declaredType is missing"),
    "unit of an enumeration": Mutant('declaredType="Mode" start', 'declaredType="Mode" unit="s" start', '"mode"', "unit is not in the schema"),
    "derivative by index": Mutant('derivative="3"', 'derivative="4"', "der(joint.angle)", 'and the name says "joint.angle"'),
    "derivative of no variable": Mutant('derivative="4"', 'derivative="44"', _RATE, "names the value reference 44"),
    "dimension without size": Mutant('<Dimension valueReference="11"/>', "<Dimension/>", "Dimension", "has a start or a value reference"),
    "dimension zero": Mutant('<Dimension valueReference="11"/>', '<Dimension start="0"/>', "Dimension", "is zero"),
    "dimension by a mass": Mutant('<Dimension valueReference="11"/>', '<Dimension valueReference="1"/>', "Dimension", "names no structural parameter"),
    "clock that is continuous": Mutant('causality="input" variability="discrete" intervalV', 'causality="input" variability="continuous" intervalV', '"clock"', "a clock is a discrete"),
    "clock without interval": Mutant('intervalVariability="constant" ', "", '"clock"', "intervalVariability is missing"),
    "clocks of no clock": Mutant('clocks="13"', 'clocks="12"', '"held"', "which is not a clock"),
    "previous of another type": Mutant('previous="15"', 'previous="8"', '"held"', "which is not a variable of type Float64"),
    "clocked state not listed": Mutant('    <ClockedState valueReference="14" dependencies="13 15"/>\n', "", '"held"', "ClockedState does not list"),
    "output that is no variable": Mutant('<Output valueReference="7"', '<Output valueReference="77"', "77", "names no variable"),
    "outputs behind derivatives": Mutant('    <Output valueReference="4" dependencies="4" dependenciesKind="constant"/>\n    <Output valueReference="7" dependencies="1 2 3 4" dependenciesKind="dependent fixed dependent dependent"/>\n    <ContinuousStateDerivative valueReference="5" dependencies="4" dependenciesKind="constant"/>', '    <ContinuousStateDerivative valueReference="5" dependencies="4" dependenciesKind="constant"/>\n    <Output valueReference="4"/>\n    <Output valueReference="7"/>', "Output", "Output follows ContinuousStateDerivative"),
    "event indicator among initial unknowns": Mutant('<InitialUnknown valueReference="9"', '<InitialUnknown valueReference="10"/><InitialUnknown valueReference="9"', "10", "must not be listed"),
    "event indicator that is a mode": Mutant('<EventIndicator valueReference="10"', '<EventIndicator valueReference="8"', "EventIndicator", "must not be listed"),
    "state among initial unknowns": Mutant('<InitialUnknown valueReference="5"', '<InitialUnknown valueReference="3"/><InitialUnknown valueReference="5"', "3", '"joint.angle" must not be listed'),
    "kind of an initial unknown": Mutant('dependencies="1" dependenciesKind="constant"', 'dependencies="1" dependenciesKind="fixed"', "9", 'the kind "fixed" is not one of'),
    "dependency on a local variable": Mutant('valueReference="6" dependencies="1 2 3"', 'valueReference="6" dependencies="1 2 5"', "6", '"der(joint.angle)", does not belong'),
    "initial dependency on a derivative": Mutant('<InitialUnknown valueReference="6" dependencies="1 2 3"', '<InitialUnknown valueReference="6" dependencies="1 2 5"', "6", "does not belong to the knowns"),
    "start empty": Mutant('start="0.5"', 'start=""', _ANGLE, 'start="" has no value'),
    "start of an array empty": Mutant('start="0 0 0"', 'start=""', '"force"', 'start="" has no value'),
    "reinit of a derivative": Mutant('unit="rad/s^2" derivative="4"', 'unit="rad/s^2" derivative="4" reinit="true"', _RATE, "reinit belongs to a state, and the variable is a derivative"),
    "factor that is no number": Mutant('factor="57.29577951308232"', 'factor="NaN"', "DisplayUnit", "the factor nan is not finite"),
    "encoding of no program": Mutant('encoding="UTF-8"', 'encoding="KLINGON-7"', "line 1", "and the standards ask for UTF-8"),
    "state that is an input": Mutant('causality="local" variability="continuous" initial="exact" declaredType="Angle"', 'causality="input" variability="continuous" declaredType="Angle"', "der(joint.angle)", "which is neither a local variable nor an output"),
}  # fmt: skip

#: Mutants of the build description.
OF_BUILD = {
    "not well-formed": Mutant("</SourceFileSet>", "", "line 9", "mismatched tag"),
    "another root": Mutant("fmiBuildDescription", "buildDescription", "line 2", "the root is not fmiBuildDescription"),
    "version": Mutant('fmiVersion="3.0"', 'fmiVersion="3.0.1"', "line 2", 'the model has "3.0"'),
    "identifier": Mutant('modelIdentifier="pendulum"', 'modelIdentifier="arm"', "arm", "is not one of the model"),
    "source missing": Mutant("pendulum.c", "other.c", "other.c", "sources/other.c is not in the archive"),
    "source twice": Mutant('<SourceFile name="pendulum.c"/>', '<SourceFile name="pendulum.c"/><SourceFile name="pendulum.c"/>', "pendulum.c", "is listed twice"),
    "no source": Mutant('<SourceFile name="pendulum.c"/>', "", "SourceFileSet", "there is no SourceFile"),
    "name of a macro": Mutant("FMI3_OVERRIDE_FUNCTION_PREFIX", "-DX", "-DX", "is not an identifier of C"),
    "no override": Mutant('      <PreprocessorDefinition name="FMI3_OVERRIDE_FUNCTION_PREFIX" value="1" optional="true"/>\n', "", "SourceFileSet", "is not among the definitions"),
    "directory": Mutant('IncludeDirectory name="include"', 'IncludeDirectory name="headers"', "headers", "is not in the archive"),
    "element": Mutant("SourceFileSet", "Sources", "Sources", "is not in the schema"),
    "language": Mutant('language="C99"', 'language="C98"', "SourceFileSet", 'language="C98" is not one of C89, C90'),
    "encoding of no program": Mutant('encoding="UTF-8"', 'encoding="KLINGON-7"', "line 1", "and the standards ask for UTF-8"),
    "attribute": Mutant('SourceFile name="pendulum.c"', 'SourceFile file="pendulum.c"', "SourceFile", "name is missing"),
}  # fmt: skip


def of_second(text: str) -> list[str]:
    return findings(text, names=NAMES2, sources=SOURCES)


def of_third(text: str, build: str = BUILD) -> list[str]:
    return findings(text, build, names=NAMES3, sources=SOURCES)


def test_good_descriptions_have_no_findings() -> None:
    assert of_second(SECOND) == []
    assert of_third(THIRD) == []


def _expect(found: list[str], good: str, mutant: Mutant, file: str) -> None:
    assert good.count(mutant.old) >= 1
    hits = [sentence for sentence in found if mutant.place in sentence and mutant.cause in sentence]
    assert hits, "\n".join(["no finding names the fault:", *found])
    assert all(sentence.startswith(file) and sentence.endswith(")") for sentence in hits)


@pytest.mark.parametrize("name", OF_SECOND)
def test_mutants_of_fmi_2_are_named(name: str) -> None:
    mutant = OF_SECOND[name]
    _expect(of_second(SECOND.replace(mutant.old, mutant.new)), SECOND, mutant, "modelDescription.xml")


@pytest.mark.parametrize("name", OF_THIRD)
def test_mutants_of_fmi_3_are_named(name: str) -> None:
    mutant = OF_THIRD[name]
    _expect(of_third(THIRD.replace(mutant.old, mutant.new)), THIRD, mutant, "modelDescription.xml")


@pytest.mark.parametrize("name", OF_BUILD)
def test_mutants_of_build_descriptions_are_named(name: str) -> None:
    mutant = OF_BUILD[name]
    _expect(of_third(THIRD, BUILD.replace(mutant.old, mutant.new)), BUILD, mutant, "sources/buildDescription.xml")


@pytest.mark.parametrize(
    ("more", "less", "cause"),
    [
        ("binaries/linux64/pendulum.so", "", "binaries/linux64 is not the name of a platform"),
        ("binaries/x86_64-windows/other.dll", "", "binaries/x86_64-windows/pendulum.dll is missing"),
        ("sources\\extra.c", "", "is not relative with slashes"),
        ("../outside.txt", "", "is not relative with slashes"),
        ("Documentation/index.html", "", "differ in case alone"),
        ("extra/include/fmi3FunctionTypes.h", "", "extra/include/fmi3FunctionTypes.h is the importer's"),
        ("", "documentation/index.html", "documentation has no index.html"),
        ("", "modelDescription.xml", "is not at the root of the archive"),
    ],
)
def test_paths_of_archives(more: str, less: str, cause: str) -> None:
    found = findings(THIRD, BUILD, names=(NAMES3 | {more}) - {"", less}, sources=SOURCES)
    assert len(found) == 1
    assert cause in found[0]


def test_a_path_that_an_archive_has_twice() -> None:
    found = findings(THIRD, BUILD, names=[*NAMES3, "sources/pendulum.c"], sources=SOURCES)
    assert found == [
        'modelDescription.xml: the path "sources/pendulum.c" is there 2 times (FMI 3.0: paths of the archive)'
    ]


def test_sources_that_one_type_alone_lists() -> None:
    sources = {**SOURCES, "more.c": "int more;\n"}
    names = {*NAMES2, "sources/more.c"}
    text = SECOND.replace('<File name="pendulum.c"/>', '<File name="pendulum.c"/><File name="more.c"/>')
    assert findings(text, names=names, sources=sources) == []
    less = text.replace('<File name="more.c"/>', "", 1)
    cause = "ModelExchange lists no source that needs sources/more.c, as others do"
    assert findings(less, names=names, sources=sources) == [
        f"modelDescription.xml: {cause} (FMI 2.0: lists of sources)"
    ]


def test_completed_steps_that_ask_for_events() -> None:
    asking = "void completed(fmi3Boolean *enterEventMode)\n{\n    *enterEventMode = moved(c) != 0;\n}\n"
    sources = {**SOURCES, "pendulum.c": SOURCES["pendulum.c"] + asking}
    assert findings(THIRD, BUILD, names=NAMES3, sources=sources) == []
    for flag in ("", 'needsCompletedIntegratorStep="false"'):
        text = THIRD.replace('needsCompletedIntegratorStep="true"', flag)
        (found,) = findings(text, BUILD, names=NAMES3, sources=sources)
        assert 'ask for events after completed steps, and needsCompletedIntegratorStep is not "true"' in found
    silent = {**SOURCES, "pendulum.c": SOURCES["pendulum.c"] + "*enterEventMode = *terminateSimulation = fmi3False;"}
    assert findings(THIRD.replace('needsCompletedIntegratorStep="true"', ""), BUILD, names=NAMES3, sources=silent) == []
    text = SECOND.replace(
        'canGetAndSetFMUstate="true"', 'completedIntegratorStepNotNeeded="true" canGetAndSetFMUstate="true"', 1
    )
    (found,) = findings(text, names=NAMES2, sources=sources)
    assert 'completedIntegratorStepNotNeeded is "true"' in found and "ModelExchange" in found


def test_platforms_of_fmi_2() -> None:
    names = (NAMES2 - {"binaries/linux64/pendulum.so"}) | {"binaries/x86_64-linux/pendulum.so"}
    found = findings(SECOND, names=names, sources=SOURCES)
    rule = "(FMI 2.0: folders of binaries)"
    assert found == [f"modelDescription.xml: binaries/x86_64-linux is not the name of a platform {rule}"]


def test_sources_without_a_build_description() -> None:
    found = findings(THIRD, names=NAMES3)
    assert found == [
        "modelDescription.xml: there are sources, and sources/buildDescription.xml is missing (FMI 3.0: build descriptions)"
    ]


@pytest.mark.parametrize(
    ("sources", "cause"),
    [
        ({"pendulum.c": SOURCES["pendulum.c"].replace("8c4e810f", "0")}, "is in no source"),
        (
            {"pendulum.c": SOURCES["pendulum.c"].replace("PREFIX pendulum_", "PREFIX arm_")},
            "defines FMI3_FUNCTION_PREF",
        ),
        ({"pendulum.c": SOURCES["pendulum.c"].replace("model.h", "other.h")}, "is neither listed nor included"),
        ({"fmi3Functions.h": "", **SOURCES}, "sources/fmi3Functions.h is the importer's"),
    ],
)
def test_texts_of_sources(sources: dict[str, str], cause: str) -> None:
    found = findings(THIRD, BUILD, names=NAMES3, sources={**SOURCES, **sources})
    assert any(cause in sentence for sentence in found), found


@pytest.mark.long
def test_a_second_opinion(tmp_path: Path) -> None:
    """FMPy accepts the good descriptions, and all mutants that it refuses are among the mutants that are named."""
    refused = 0
    for good, mutants in ((SECOND, OF_SECOND), (THIRD, OF_THIRD)):
        texts = {"good": good, **{name: good.replace(m.old, m.new) for name, m in mutants.items()}}
        for name, text in texts.items():
            (tmp_path / "modelDescription.xml").write_text(text, encoding="utf-8")
            faults = validate_fmu(str(tmp_path))
            if name == "good":
                assert faults == []
            refused += bool(faults)
    assert refused >= 60
