"""Every entry of the failure catalogue gets its answer, to the letter, and loses nothing."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

import pytest

import eomgen
from tests.failures.catalogue import CHAPTERS
from tests.failures.failure import Failure

ENTRIES = [(title, entry) for title, _, entries in CHAPTERS for entry in entries]
IDS = [f"{title}-{entry.title}" for title, entry in ENTRIES]
#: Chapters whose entries run no scene.
READ = ("Beams", "Events", "Formulas", "Included files", "Internal states", "Names", "Tables", "Units", "URDF")
#: Exit codes of commands that did what they could: a run that stopped keeps what it has, a warning stops nothing.
GOES_ON = (0, eomgen.NumericalError.exit_code)


#: A code at the end of a line.
CODE = r"\[([EW]\d{4})\]"
#: Codes of kinds of errors, of messages without a code.
GENERAL = {f"E{number:04d}" for number in range(8)}


def matches(found: str, expected: str) -> bool:
    """Return whether a text is the expected one, in which ``{any}`` stands for what differs from machine to machine."""
    return re.fullmatch(r"[^\n]*?".join(map(re.escape, expected.split("{any}"))), found) is not None


def check_codes(complaint: str, entry: Failure) -> None:
    """Assert that each problem, note and warning has a code, of its own."""
    for line in complaint.splitlines():
        found = re.findall(f"{CODE}$", line)
        of_problem = re.match(r"(?:[a-z/]+ error|note|warning): (?!\d+ problems)|  \d+\. ", line)
        assert len(found) == bool(of_problem), f"{entry.title}: {line}"
        assert not GENERAL & set(found), f"{entry.title}: {complaint}"


@pytest.mark.slow_except("Feedback-Modal control of forces that lag", *(name for name in IDS if name.startswith(READ)))
@pytest.mark.parametrize("entry", [entry for _, entry in ENTRIES], ids=IDS)
def test_the_answer(entry: Failure, tmp_path: Path) -> None:
    entry.lay_out(tmp_path)
    before = {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()}
    code, printed, complaint = entry.told(tmp_path)
    check_codes(complaint, entry)
    expected = entry.answer.replace("{folder}", str(tmp_path)) + "\n"
    assert code == entry.code and matches(complaint, expected), f"{code}, {complaint!r}\nis not\n{expected!r}"
    assert not printed or code in GOES_ON
    assert "Traceback" not in complaint
    assert not [c for c in complaint if c != "\n" and unicodedata.category(c)[0] == "C"]
    assert {file: file.read_bytes() for file in before} == before  # nothing is lost
    # a record of a scene that was read is a file of the cache
    after = {file for file in tmp_path.rglob("*") if file.is_file() and file.parent.name != "readings"}
    assert after == set(before) or code in GOES_ON  # and nothing is left about


def test_answers_that_differ_are_told_apart() -> None:
    assert matches("a 12 b", "a {any} b") and not matches("a 12 b\nc", "a {any} b") and not matches("a.b", "a b")
