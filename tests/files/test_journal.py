"""Journals of resumable work: whole lines are kept, other work is refused, cut lines are dropped."""

from __future__ import annotations

from pathlib import Path

import pytest

from eomgen.base.journal import Journal
from eomgen.errors import FileError


def journal(folder: Path | None, *, identity: str = "one", resume: bool = False) -> Journal[int]:
    return Journal(
        folder,
        "rows.jsonl",
        "rows of a study",
        identity=identity,
        others="another scene",
        row_of=lambda line: int(line["row"]) if "row" in line else len(line["rows"].items()),
        resume=resume,
    )


def test_work_resumes_from_every_place_at_which_a_file_may_be_cut(tmp_path: Path) -> None:
    written = journal(tmp_path)
    for number in range(3):
        written.append({"row": number})
    path = tmp_path / "rows.jsonl"
    text = path.read_text(encoding="utf-8")
    first = text.index("\n") + 1
    for length in range(first, len(text) + 1):
        path.write_text(text[:length], encoding="utf-8")
        found = journal(tmp_path, resume=True)
        assert found.rows == list(range(text[first:length].count("\n")))
        found.append({"row": 9})
        assert journal(tmp_path, resume=True).rows == [*found.rows, 9]


def test_other_work_and_other_files_are_refused(tmp_path: Path) -> None:
    journal(tmp_path)
    with pytest.raises(
        FileError, match=r"holds the rows of a study, rows\.jsonl; try: --resume, which goes on with it"
    ):
        journal(tmp_path)
    with pytest.raises(FileError, match="holds the rows of a study of another scene; try: another folder"):
        journal(tmp_path, identity="two", resume=True)
    for text in (
        "",
        "no JSON\n",
        '{"study": "one"}\n{"row": "x"}\n',
        '{"study": "one"}\n{"rows": []}\n',
        "[]\n",
        "\xff",
    ):
        (tmp_path / "rows.jsonl").write_text(text, encoding="latin-1")
        with pytest.raises(FileError, match=r"rows\.jsonl.*these are not the rows of a study"):
            journal(tmp_path, resume=True)


def test_a_file_that_cannot_be_written_or_read_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written = journal(tmp_path)

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", full)
        with pytest.raises(FileError, match=r"rows\.jsonl.*cannot be written: No space left on device"):
            written.append({"row": 1})
        patch.setattr(Path, "read_text", full)
        with pytest.raises(FileError, match=r"rows\.jsonl.*cannot be read: No space left on device"):
            journal(tmp_path, resume=True)


def test_without_a_folder_rows_are_not_written() -> None:
    found = journal(None)
    found.append({"row": 1})
    assert found.rows == []
