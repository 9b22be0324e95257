"""Functions that parts of the equations share take the workspace twice, to read and to write, both ``restrict``."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from eomgen.products.fmu.export import fmu_files

EXAMPLES = Path(__file__).parents[2] / "examples"
FUNCTION = re.compile(r"void \w+?_(shared\d+)\([^)]*\)\s*\n\{\n(.*?)\n\}", re.DOTALL)
CALL = re.compile(
    r"at\[\d+\] = \{([\d,\s]*)\};(?:\s*static const double k\[\d+\] = \{[^}]*\};)?\s*\w+?_(shared\d+)\(w, w,"
)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["misaligned_four_bar", "hanging_chain"])
def test_no_call_reads_an_element_that_it_writes(name: str) -> None:
    """C allows one array for both only then (C99 6.7.3.1)."""
    made = fmu_files(EXAMPLES / name / "scene.toml", binary=False, reference=False)
    text = "\n".join(str(content) for path, content in made.files.items() if path.endswith(".c"))
    read, write = (
        {
            name: {int(i) for i in re.findall(rf"\b{array}\[at\[(\d+)\]\]", body)}
            for name, body in FUNCTION.findall(text)
        }
        for array in ("r", "w")
    )
    calls = [([int(place) for place in places.split(",")], function) for places, function in CALL.findall(text)]
    assert len(calls) == len(re.findall(r"_shared\d+\(w, w,", text)) > 100
    for places, function in calls:
        assert not {places[i] for i in read[function]} & {places[i] for i in write[function]}, function
