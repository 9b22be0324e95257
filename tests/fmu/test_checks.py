"""Every rule of the check of FMUs: changes of what eomgen writes, each of which has a finding wherever it applies."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from eomgen.products.fmu.export import fmu_files
from tests.fmu.checks import MANIFEST, findings
from tests.fmu.test_fmu import pendulum

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / "examples"
DESCRIPTION, BUILD = "modelDescription.xml", "sources/buildDescription.xml"
#: Variables of both versions.
_VARIABLE = r"(<(?:Float64|ScalarVariable)[^>]*? "

#: File, pattern and replacement of each change.
CHANGES = {
    "end of an element left out": (DESCRIPTION, "</ModelVariables>", ""),
    "unknown element": (DESCRIPTION, "<ModelStructure>", "<Model/><ModelStructure>"),
    "unknown attribute": (DESCRIPTION, 'modelIdentifier="', 'canFly="true" modelIdentifier="'),
    "sections out of order": (DESCRIPTION, r"(?s)(<UnitDef.*?</UnitDefinitions>)(.*?)(<DefaultExp.*?/>)", r"\3\2\1"),
    "value reference of another variable": (DESCRIPTION, rf'{_VARIABLE}valueReference=")\d+', r"\g<1>1"),
    "name of another variable": (DESCRIPTION, rf'{_VARIABLE}?name=")[^"]*', r"\1time"),
    "name outside the grammar": (DESCRIPTION, rf'{_VARIABLE}?name=")([^"]*)', r"\1\2 %"),
    "causality that is not one": (DESCRIPTION, r'causality="\w+"', 'causality="state"'),
    "variability that does not fit": (
        DESCRIPTION,
        r'(causality="\w+") variability="\w+"',
        r'\1 variability="constant"',
    ),
    "initial that is not one": (DESCRIPTION, r'initial="\w+"', 'initial="guess"'),
    "input with initial": (DESCRIPTION, r'(<Scalar[^>]*causality="input")', r'\1 initial="exact"'),
    "two independent variables": (DESCRIPTION, 'causality="input"', 'causality="independent"'),
    "start of another type": (DESCRIPTION, r' start="[^"]*"', ' start="x"'),
    "start of infinity": (DESCRIPTION, r'( unit="[^>]*) start="[^"]*"', r'\1 start="INF"'),
    "start that is empty": (DESCRIPTION, r' start="[^"]*"', ' start=""'),
    "start of two numbers": (DESCRIPTION, r' start="([^ "]*)"', r' start="\1 \1"'),
    "start left out": (DESCRIPTION, r'(initial="exact"[^>]*>?[^<]*(?:<Real)?[^>]*?) start="[^"]*"', r"\1"),
    "start that is calculated": (DESCRIPTION, r'("calculated"[^/]*?) derivative="', r'\1 start="0" derivative="'),
    "start below the minimum": (DESCRIPTION, r' start="([0-9.]+)"( [^>]*reinit)', r' min="1e9" start="\1"\2'),
    "range of no number": (DESCRIPTION, r' start="([0-9.]+)"( [^>]*reinit)', r' max="NaN" start="\1"\2'),
    "dimension of zero": (DESCRIPTION, r'<Dimension start="\d+"', '<Dimension start="0"'),
    "start values too few": (DESCRIPTION, r' start="\S+ (\S+ [^"]*")', r' start="\1'),
    "reinit of a derivative": (DESCRIPTION, ' derivative="', ' reinit="true" derivative="'),
    "derivative of no variable": (DESCRIPTION, r' derivative="1?(\d)"', r' derivative="1\g<1>7"'),
    "derivative of the time": (DESCRIPTION, r' derivative="\d+"', ' derivative="0"'),
    "derivative of another state": (DESCRIPTION, r' derivative="[4-9]"', ' derivative="3"'),
    "derivative left out": (DESCRIPTION, r' derivative="\d+"', ""),
    "unit that is not defined": (DESCRIPTION, r'(<(?:Float64|Real)[^>]* unit=")[^"]*', r"\1furlong"),
    "definition of a unit left out": (DESCRIPTION, r"(?s)<Unit name=.*?</Unit>", ""),
    "definition of a unit twice": (DESCRIPTION, r"(?s)(<Unit name=.*?</Unit>)", r"\1\1"),
    "unit of a rate": (DESCRIPTION, r'(<Unit name="rad/s">\s*<BaseUnit s=")-1', r"\1-2"),
    "factor of a display unit": (DESCRIPTION, r'(<DisplayUnit [^>]*factor=")[^"]*', r"\1NaN"),
    "display unit twice": (DESCRIPTION, r"(<DisplayUnit [^>]*/>)", r"\1\1"),
    "type that is not defined": (DESCRIPTION, r'declaredType="\w+"', 'declaredType="Corner"'),
    "type of no variable": (DESCRIPTION, r'(<(?:Float64|Simple)Type name=")\w+', r"\1Corner"),
    "output left out": (DESCRIPTION, r"(?:<Output |(?<=<Outputs>)\s*<Unknown )[^>]*/>", ""),
    "output twice": (DESCRIPTION, r"(<Output [^>]*/>|(?<=<Outputs>)\s*<Unknown [^>]*/>)", r"\1\1"),
    "state derivative left out": (DESCRIPTION, r"(?:<Cont\w+ |(?<=<Derivatives>)\s*<Unknown )[^>]*/>", ""),
    "initial unknown left out": (DESCRIPTION, r"(?:<InitialUnknown |(?<=<InitialUnknowns>)\s*<Unknown )[^>]*/>", ""),
    "indicator that is the time": (DESCRIPTION, r'(<EventIndicator valueReference=")\d+', r"\g<1>0"),
    "dependency on no variable": (DESCRIPTION, r' dependencies="(\d+)', r' dependencies="99\g<1>9'),
    "dependency on itself": (
        DESCRIPTION,
        r'(<(?:Cont\w+ valueReference|Unknown index)=")(\d+)(" dependencies=")\d+',
        r"\1\2\3\2",
    ),
    "dependency twice": (DESCRIPTION, r' dependencies="(\d+)([ "])', r' dependencies="\1 \1\2'),
    "kind too many": (DESCRIPTION, r' dependenciesKind="(\w+)', r' dependenciesKind="\1 \1'),
    "kind that is not one": (DESCRIPTION, r' dependenciesKind="\w+', ' dependenciesKind="linear'),
    "kind of an initial unknown": (DESCRIPTION, r'(<Initial[^>]* dependenciesKind=")\w+', r"\1tunable"),
    "identifier with a dash": (DESCRIPTION, r'modelIdentifier="(\w+)"', r'modelIdentifier="\1-x"'),
    "identifier that is a word of C": (DESCRIPTION, r'modelIdentifier="(\w+)"', 'modelIdentifier="int"'),
    "serialisation alone": (DESCRIPTION, r'canGetAndSetFMU[Ss]tate="true"', ""),
    "internal step of zero": (DESCRIPTION, r'fixedInternalStepSize="[^"]*"', 'fixedInternalStepSize="0"'),
    "step of zero": (DESCRIPTION, r' stepSize="[^"]*"', ' stepSize="0"'),
    "step longer than the experiment": (DESCRIPTION, r' stepSize="[^"]*"', ' stepSize="1e9"'),
    "stop before the start": (DESCRIPTION, r'stopTime="[^"]*"', 'stopTime="-1"'),
    "tolerance of zero": (DESCRIPTION, "<DefaultExperiment ", '<DefaultExperiment tolerance="0" '),
    "another token": (DESCRIPTION, r'(guid|instantiationToken)="[^"]*"', r'\1="{8c4e810f}"'),
    "steps that need no completion": (
        DESCRIPTION,
        '(?<=<ModelExchange )(.*)needsCompletedIntegratorStep="true"|(?=model.*getAndSetFMUstate)',
        r'\1 completedIntegratorStepNotNeeded="true" ',
    ),
    "source that is not listed": (DESCRIPTION, r'<File name="[^"]*" />', ""),
    "source that is no file": (DESCRIPTION, r'<File name="[^"]*" />', '<File name="other.c" />'),
    "another root of the build description": (BUILD, "fmiBuildDescription", "buildDescription"),
    "identifier of the build description": (BUILD, r'modelIdentifier="\w+"', 'modelIdentifier="arm"'),
    "listed source that is no file": (BUILD, r'<SourceFile name="[^"]*"', '<SourceFile name="other.c"'),
    "listed source left out": (BUILD, r'<SourceFile name="[^"]*" />', ""),
    "listed source twice": (BUILD, r'(<SourceFile name="[^"]*" />)', r"\1\1"),
    "macro left out": (BUILD, "FMI3_OVERRIDE_FUNCTION_PREFIX", "PREFIX"),
    "token of the sources": (r"sources/\w+_fmi\d\.c", r'"\{[0-9a-f-]{36}\}"', '"{8c4e810f}"'),
    "prefix of the sources": (r"sources/.*", r"(#define FMI\d_FUNCTION_PREFIX )\w+", r"\1arm_"),
    "root of the manifest": (MANIFEST, "(?s)fmiDAEManifest(.*)fmiDAEManifest", r"fmi-dae\1fmi-dae"),
    "name of the manifest": (MANIFEST, r"org\.fmi-standard\.fmi-ls-dae", "org.other"),
    "version of the manifest": (MANIFEST, r'fmi-ls-version="[^"]*"', 'fmi-ls-version=""'),
    "no switch": (MANIFEST, "EnableDAEParameter", "Other"),
    "switch that is a number": (MANIFEST, r'(<EnableDAEParameter valueReference=")\d+', r"\g<1>1"),
    "algebraic variable of no variable": (MANIFEST, r'(<AlgebraicVariable valueReference=")', r"\g<1>9"),
    "algebraic variable that is a state": (MANIFEST, r'(<AlgebraicVariable valueReference=")\d+', r"\g<1>1"),
    "residual of no variable": (MANIFEST, r'(<Residual valueReference=")', r"\g<1>9"),
    "residual left out": (MANIFEST, r"<Residual [^>]*/>", ""),
    "output of no variable": (MANIFEST, r'(<Output valueReference=")', r"\g<1>9"),
    "output of the manifest left out": (MANIFEST, r"<Output [^>]*/>", ""),
}


@cache
def documents() -> tuple[dict[str, str], ...]:
    """Return the files of FMUs with parameters, inputs, rotations, internal states, events, constraints and arrays."""
    made = (
        fmu_files(scene, version=version, binary=False, reference=False, **options)
        for scene, version, options in (
            (EXAMPLES / "bouncing_ball" / "scene.toml", 3, {}),
            (EXAMPLES / "free_spinning_body" / "scene.toml", 2, {}),
            (pendulum(), 2, {}),
            (EXAMPLES / "free_spinning_body" / "scene.toml", 3, {"arrays": True}),
            (EXAMPLES / "four_bar" / "scene.toml", 2, {}),
            (EXAMPLES / "four_bar" / "scene.toml", 3, {"dae": True}),
        )
    )
    return tuple({path: str(text) for path, text in one.files.items()} for one in made)


def test_what_eomgen_writes_has_no_findings() -> None:
    assert [findings(files) for files in documents()] == [[]] * 6


@pytest.mark.parametrize("change", CHANGES)
def test_changes_of_what_eomgen_writes_are_named(change: str) -> None:
    """At the first match, and in every other document at the last."""
    file, pattern, replacement = CHANGES[change]
    tried = 0
    for number, files in enumerate(documents()):
        for path, text in files.items():
            places = list(re.finditer(pattern, text)) if re.fullmatch(file, path) else []
            for match in places[-1:] if number % 2 else places[:1]:
                changed = text[: match.start()] + match.expand(replacement) + text[match.end() :]
                if changed != text:
                    tried += 1
                    assert findings({**files, path: changed}), (number, path, match)
    assert tried


@pytest.mark.parametrize(
    ("path", "cause"),
    [
        ("binaries/linux64/four_bar.so", "binaries/linux64 is not the name of a platform"),
        ("binaries/x86_64-windows/other.dll", "binaries/x86_64-windows/four_bar.dll is missing"),
        ("extra\\other.c", "is not relative with slashes"),
        ("../outside.txt", "is not relative with slashes"),
        ("Documentation/index.html", "the path documentation/index.html is there 2 times"),
        ("sources/four_bar_fmi3.c", "the path sources/four_bar_fmi3.c is there 2 times"),
        ("extra/include/fmi3FunctionTypes.h", "is the importer's"),
    ],
)
def test_paths_that_an_archive_must_not_have(path: str, cause: str) -> None:
    (finding,) = findings(documents()[-1], path)
    assert finding.endswith(cause)


def test_platforms_and_pages_of_archives() -> None:
    files = dict(documents()[4])
    assert findings(files, "binaries/linux64/four_bar.so") == []
    (finding,) = findings(files, "binaries/x86_64-linux/four_bar.so")
    assert finding == "binaries/x86_64-linux is not the name of a platform"
    del files["documentation/index.html"]
    assert findings(files) == ["documentation has no index.html"]
