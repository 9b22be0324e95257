"""Mutants of model descriptions that eomgen writes: rules for changes of XML, applied to real documents of both versions."""
# ruff: noqa: E501  # one change a line

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from eomgen.products.fmu.export import fmu_files
from tests.fmu.checks import findings

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Scenes with parameters, inputs, rotations, internal states, events and constraints among them.
SCENES = ("gear_with_backlash", "free_spinning_body", "pi_servo", "four_bar")


@cache
def described(name: str, version: int) -> str:
    scene = EXAMPLES / name / "scene.toml"
    return str(fmu_files(scene, version=version, binary=False, reference=False).files["modelDescription.xml"])


def _nth(pattern: str, replacement: str, number: int) -> Callable[[str], str]:
    """Return the change of the nth match of a pattern."""

    def changed(text: str) -> str:
        places = list(re.finditer(pattern, text))
        if not places:
            return text
        match = places[min(number, len(places) - 1)]
        return text[: match.start()] + match.expand(replacement) + text[match.end() :]

    return changed


#: Changes that break a rule wherever they apply, most with the first and with a late match.
CHANGES = {
    f"{name}, {place}": _nth(pattern, replacement, number)
    for place, number in (("first", 0), ("late", 10**6))
    for name, (pattern, replacement) in {
        "value reference of another variable": (r'(<(?:Float64|ScalarVariable)[^>]* valueReference=")\d+', r"\g<1>1"),
        "causality that is not one": (r'causality="\w+"', 'causality="state"'),
        "variability that does not fit": (r'causality="(\w+)" variability="\w+"', r'causality="\1" variability="fixed"'),
        "initial that is not one": (r'initial="\w+"', 'initial="guess"'),
        "start of another type": (r' start="[^"]*"', ' start="x"'),
        "start of infinity": (r' start="[^"]*"', ' start="INF"'),
        "start that is empty": (r' start="[^"]*"', ' start=""'),
        "reinit of a derivative": (r' derivative="', ' reinit="true" derivative="'),
        "factor of a display unit that is no number": (r'(<DisplayUnit [^>]*factor=")[^"]*', r"\1NaN"),
        "encoding of no program": (r'encoding="UTF-8"', 'encoding="KLINGON-7"'),
        "start left out": (r'(initial="exact"[^>]*>?[^<]*(?:<Real)?[^>]*?) start="[^"]*"', r"\1"),
        "unit that is not defined": (r'(<(?:Float64|Real)[^>]* unit=")[^"]*', r"\1furlong"),
        "definition of a unit left out": (r"(?s)<Unit name=.*?</Unit>", ""),
        "derivative of the next state": (r' derivative="1?(\d)"', r' derivative="1\g<1>7"'),
        "derivative left out": (r' derivative="\d+"', ""),
        "name of another variable": (r'(<(?:Float64|ScalarVariable) name=")[^"]*', r"\1time"),
        "name outside the grammar": (r'(<(?:Float64|ScalarVariable) name=")([^"]*)', r"\1\2 %"),
        "dependency on no variable": (r' dependencies="(\d+)', r' dependencies="99\g<1>9'),
        "dependency twice": (r' dependencies="(\d+)([ "])', r' dependencies="\1 \1\2'),
        "kind too many": (r' dependenciesKind="(\w+)', r' dependenciesKind="\1 \1'),
        "kind that is not one": (r' dependenciesKind="\w+', ' dependenciesKind="linear'),
        "identifier with a dash": (r'modelIdentifier="(\w+)"', r'modelIdentifier="\1-x"'),
        "flag of no standard": (r'modelIdentifier="', 'canFly="true" modelIdentifier="'),
        "serialisation alone": (r'canGetAndSetFMU[Ss]tate="true"', ""),
        "step of zero": (r'stepSize="[^"]*"', 'stepSize="0"'),
        "stop before the start": (r'stopTime="[^"]*"', 'stopTime="-1"'),
        "category twice": (r'<Category name="\w+"', '<Category name="logEvents"'),
        "output left out": (r'(?:<Output |(?<=<Outputs>)\s*<Unknown )[^>]*/>', ""),
        "state derivative left out": (r'(?:<ContinuousStateDerivative |(?<=<Derivatives>)\s*<Unknown )[^>]*/>', ""),
        "initial unknown left out": (r'(?:<InitialUnknown |(?<=<InitialUnknowns>)\s*<Unknown )[^>]*/>', ""),
        "sections out of order": (r"(?s)(<UnitDefinitions>.*?</UnitDefinitions>|<LogCategories>.*?</LogCategories>)(.*?)(<DefaultExperiment[^>]*/>)", r"\3\2\1"),
        "unknown element": ("<ModelStructure>", "<Model/><ModelStructure>"),
        "end of an element left out": ("</ModelVariables>", ""),
    }.items()
}  # fmt: skip


@pytest.mark.slow_cases("free_spinning_body-2")
@pytest.mark.long_except("gear_with_backlash-3", "free_spinning_body-2", "pi_servo-3", "four_bar-2")
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", SCENES)
def test_changes_of_real_descriptions_are_named(name: str, version: int) -> None:
    good = described(name, version)
    assert findings(good) == []
    applied = {change: act(good) for change, act in CHANGES.items()}
    applied = {change: text for change, text in applied.items() if text != good}
    silent = [change for change, text in applied.items() if not findings(text)]
    assert not silent
    assert len(applied) >= 45


def _files(name: str, version: int) -> dict[str, str]:
    made = fmu_files(EXAMPLES / name / "scene.toml", version=version, binary=False, reference=False)
    return {path: str(text) for path, text in made.files.items()}


def _findings(files: dict[str, str], *more: str) -> list[str]:
    sources = {path.removeprefix("sources/"): text for path, text in files.items() if path.endswith((".c", ".h"))}
    build = files.get("sources/buildDescription.xml", "")
    return findings(files["modelDescription.xml"], build, names=[*files, *more], sources=sources)


@pytest.mark.parametrize("version", [2, 3])
def test_changes_of_real_archives_are_named(version: int) -> None:
    files = _files("four_bar", version)
    assert _findings(files) == []
    description, model = files["modelDescription.xml"], f"sources/four_bar_fmi{version}.c"
    (twice,) = _findings(files, model)
    assert f'the path "{model}" is there 2 times' in twice
    if version == 2:
        changed = description.replace("<ModelExchange ", '<ModelExchange completedIntegratorStepNotNeeded="true" ')
        (flag,) = _findings({**files, "modelDescription.xml": changed})
        less = {**files, "modelDescription.xml": description.replace('<File name="four_bar.c" />', "", 1)}
        assert any("ModelExchange lists no source that needs sources/four_bar.c" in found for found in _findings(less))
    else:
        changed = description.replace(' needsCompletedIntegratorStep="true"', "")
        (flag,) = _findings({**files, "modelDescription.xml": changed})
        (header,) = _findings(files, "documentation/fmi3Functions.h")
        assert "documentation/fmi3Functions.h is the importer's" in header
        build = files["sources/buildDescription.xml"]
        (language,) = _findings({**files, "sources/buildDescription.xml": build.replace('"C99"', '"C98"')})
        assert 'language="C98" is not one of' in language
        less = {**files, "sources/buildDescription.xml": build.replace('<SourceFile name="four_bar.c" />', "")}
        assert any("sources/four_bar.c is neither listed nor included" in found for found in _findings(less))
    assert "ModelExchange" in flag and "the sources ask for events after completed steps" in flag
