"""The page docs/errors.md, made of the failure catalogue.

python -m tests.failures.errors_page      writes it anew
"""

from __future__ import annotations

import unicodedata
from pathlib import Path

from tests.failures.catalogue import CHAPTERS
from tests.failures.failure import SCENE, Failure

PAGE = Path(__file__).parents[2] / "docs" / "errors.md"
COMMAND = "python -m tests.failures.errors_page"
_LONGEST = 160

INTRODUCTION = """# Errors

What eomgen answers to {count} bad inputs: one message on stderr, behind the notes of the scene, with place, cause and
remedy, and an [exit code](command_line.md#exit-codes) for each kind; no traceback, and nothing that was there before is
lost. Each entry shows what was written, the command, and the answer. Tests hold every one of them to the letter; this
page is made of the same data by `{command}`.

Most entries change one place of this scene:

```text
{scene}```

Contents: {contents}
"""


def page() -> str:
    """Return the text of the page."""
    titles = [title for title, _, _ in CHAPTERS]
    contents = " · ".join(f"[{title}](#{title.lower().replace(' ', '-')})" for title in titles)
    count = sum(len(entries) for _, _, entries in CHAPTERS)
    parts = [INTRODUCTION.format(count=count, command=COMMAND, scene=SCENE, contents=contents)]
    for title, first, entries in CHAPTERS:
        parts.append(f"## {title}\n\n{first}\n")
        parts += [_entry(entry) for entry in entries]
    return "\n".join(parts)


def _entry(entry: Failure) -> str:
    shown = [_visible(line) for line in entry.shown().splitlines()]
    answer = entry.message.replace("{any}", "...").replace("{folder}", "/an/empty/folder").splitlines()
    lines = [*shown, *([""] if shown else []), f"$ eomgen {entry.command}", *answer]
    block = "\n".join(lines)
    return f"**{entry.title}**: exit code {entry.code}\n\n```text\n{block}\n```\n"


def _visible(line: str) -> str:
    """Return a line with characters that cannot be seen, or that would turn the page around, written out, and not too
    long."""
    text = "".join(c if unicodedata.category(c)[0] != "C" else c.encode("unicode_escape").decode() for c in line)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)
