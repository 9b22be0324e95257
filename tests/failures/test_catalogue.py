"""Every entry of the failure catalogue gets its answer, to the letter, and loses nothing; the page is that of the
catalogue."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

import pytest

import eomgen
from tests.failures import errors_page
from tests.failures.catalogue import CHAPTERS
from tests.failures.failure import SHOWN_FOLDER, Failure

ENTRIES = [(title, entry) for title, _, entries in CHAPTERS for entry in entries]
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


@pytest.mark.slow_except("Feedback-Modal control of forces that lag")
@pytest.mark.parametrize(
    "entry", [entry for _, entry in ENTRIES], ids=[f"{title}-{entry.title}" for title, entry in ENTRIES]
)
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


@pytest.mark.slow
def test_a_page_is_written_with_every_entry_in_its_chapter(tmp_path: Path) -> None:
    errors_page.main([str(tmp_path / "new" / "errors.md")])
    text = (tmp_path / "new" / "errors.md").read_text(encoding="utf-8")
    chapters = dict(part.split("\n", 1) for part in text.split("\n## ")[1:])
    assert list(chapters) == [title for title, _, _ in CHAPTERS]
    anchors = {title.lower().replace(" ", "-") for title in chapters}
    assert set(re.findall(r"\(#([^)]+)\)", text)) == anchors
    (other,) = set(re.findall(r"\(([^#)][^)]*\.md)#", text))
    assert (tmp_path / "new" / other).resolve() == errors_page.ROOT / "docs" / "command_line.md"
    for title, entry in ENTRIES:
        answer = entry.answer.replace("{any}", "...").replace("{folder}", SHOWN_FOLDER)
        assert f"**{entry.title}**: exit code {entry.code}\n\n```text\n" in chapters[title]
        assert f"$ eomgen {entry.command}\n{answer}\n```" in chapters[title], f"{title}: {entry.title}"
    assert not [c for c in text if c != "\n" and unicodedata.category(c)[0] == "C"]


def test_answers_that_differ_are_told_apart() -> None:
    assert matches("a 12 b", "a {any} b") and not matches("a 12 b\nc", "a {any} b") and not matches("a.b", "a b")
