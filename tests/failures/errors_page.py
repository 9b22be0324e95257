"""The page of errors, made of the failure catalogue: ``make errors``.

python -m tests.failures.errors_page out/errors.md
"""

from __future__ import annotations

import argparse
import os
import unicodedata
from pathlib import Path

from tests.failures.catalogue import CHAPTERS
from tests.failures.failure import SCENE, SHOWN_FOLDER, Failure

ROOT = Path(__file__).parents[2]
_LONGEST = 160

INTRODUCTION = """# Errors

The answers of eomgen to {count} bad inputs: one message on stderr, behind the notes of the scene, with place, cause and
remedy, and an [exit code]({docs}/command_line.md#exit-codes) for each kind; no traceback, and no file is lost. Each
entry shows the input, the command and the answer. Tests hold every one of them to the letter; this page is made of the
same data by `make errors`.

Most entries change one place of this scene:

```text
{scene}```

Contents: {contents}
"""


def page(folder: Path) -> str:
    """Return the text of the page for a folder, from which its links lead to the documentation."""
    titles = [title for title, _, _ in CHAPTERS]
    contents = " · ".join(f"[{title}](#{title.lower().replace(' ', '-')})" for title in titles)
    docs = Path(os.path.relpath(ROOT / "docs", folder)).as_posix()
    count = sum(len(entries) for _, _, entries in CHAPTERS)
    parts = [INTRODUCTION.format(count=count, docs=docs, scene=SCENE, contents=contents)]
    for title, first, entries in CHAPTERS:
        parts.append(f"## {title}\n\n{first}\n")
        parts += [_entry(entry) for entry in entries]
    return "\n".join(parts)


def shown_entry(entry: Failure, answer: str = "") -> str:
    """Return the bad input of an entry, its command and its answer, or another one, as text."""
    shown = [_visible(line) for line in entry.shown().splitlines()]
    told = (answer or entry.answer).replace("{any}", "...").replace("{folder}", SHOWN_FOLDER)
    lines = [*shown, *([""] if shown else []), f"$ eomgen {entry.command}", told]
    return "\n".join(lines)


def _entry(entry: Failure) -> str:
    block = shown_entry(entry)
    return f"**{entry.title}**: exit code {entry.code}\n\n```text\n{block}\n```\n"


def _visible(line: str) -> str:
    """Return a line with characters that cannot be seen, or that would turn the page around, written out, and not too
    long."""
    text = "".join(c if unicodedata.category(c)[0] != "C" else c.encode("unicode_escape").decode() for c in line)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m tests.failures.errors_page", description="Write the page of errors."
    )
    parser.add_argument("file", type=Path, nargs="?", default=ROOT / "out" / "errors.md")
    file = parser.parse_args(arguments).file
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(page(file.parent), encoding="utf-8")
    print(file)


if __name__ == "__main__":
    main()
