"""Rules of the check of FMUs: changes of what eomgen writes, each of which has a finding wherever it applies."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from eomgen.products.fmu.export import fmu_files
from tests.fmu.checks import findings
from tests.fmu.test_fmu import pendulum

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / "examples"
DESCRIPTION, BUILD = "modelDescription.xml", "sources/buildDescription.xml"
#: Variables of both versions.
_VARIABLE = r"(<(?:Float64|ScalarVariable)[^>]*? "

#: File, pattern and replacement of each change.
CHANGES = {
    "unknown attribute": (DESCRIPTION, 'modelIdentifier="', 'canFly="true" modelIdentifier="'),
    "name outside the grammar": (DESCRIPTION, rf'{_VARIABLE}?name=")([^"]*)', r"\1\2 %"),
    "start of infinity": (DESCRIPTION, r'( unit="[^>]*) start="[^"]*"', r'\1 start="INF"'),
    "start below the minimum": (DESCRIPTION, r' start="([0-9.]+)"( [^>]*reinit)', r' min="1e9" start="\1"\2'),
    "range of no number": (DESCRIPTION, r' start="([0-9.]+)"( [^>]*reinit)', r' max="NaN" start="\1"\2'),
    "dimension of zero": (DESCRIPTION, r'<Dimension start="\d+"', '<Dimension start="0"'),
    "start values too few": (DESCRIPTION, r' start="\S+ (\S+ [^"]*")', r' start="\1'),
    "reinit of a derivative": (DESCRIPTION, ' derivative="', ' reinit="true" derivative="'),
    "derivative of the time": (DESCRIPTION, r' derivative="\d+"', ' derivative="0"'),
    "derivative of another state": (DESCRIPTION, r' derivative="[4-9]"', ' derivative="3"'),
    "unit of a rate": (DESCRIPTION, r'(<Unit name="rad/s">\s*<BaseUnit s=")-1', r"\1-2"),
    "output left out": (DESCRIPTION, r"(?:<Output |(?<=<Outputs>)\s*<Unknown )[^>]*/>", ""),
    "dependency on itself": (
        DESCRIPTION,
        r'(<(?:Cont\w+ valueReference|Unknown index)=")(\d+)(" dependencies=")\d+',
        r"\1\2\3\2",
    ),
    "identifier with a dash": (DESCRIPTION, r'modelIdentifier="(\w+)"', r'modelIdentifier="\1-x"'),
    "identifier that is a word of C": (DESCRIPTION, r'modelIdentifier="(\w+)"', 'modelIdentifier="int"'),
    "step longer than the experiment": (DESCRIPTION, r' stepSize="[^"]*"', ' stepSize="1e9"'),
    "stop before the start": (DESCRIPTION, r'stopTime="[^"]*"', 'stopTime="-1"'),
    "another root of the build description": (BUILD, "fmiBuildDescription", "buildDescription"),
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
