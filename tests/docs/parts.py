"""Pages in parts, ``docs/scene.md`` with ``docs/scene``: the page lists its parts, each a file of the folder."""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ("scene", "python", "command_line")


def parts(page: str) -> list[Path]:
    """Return the files of the parts of a page in the order of the list."""
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    return [DOCS / name for name in dict.fromkeys(re.findall(rf"\]\(({page}/\w+\.md)\)", text))]


def whole(page: str) -> str:
    """Return the text of a page and of all its parts."""
    files = [DOCS / f"{page}.md", *parts(page)]
    return "\n".join(file.read_text(encoding="utf-8") for file in files)


def sections(page: str) -> dict[str, str]:
    """Return the texts of the parts of a page by their titles."""
    texts = (file.read_text(encoding="utf-8") for file in parts(page))
    return {text[2 : text.index("\n")]: text for text in texts}
