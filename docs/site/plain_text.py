"""Plain text of the site for programs that read: ``llms.txt``, a list of all pages, and the reference of scene files in
one file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from docs.site.pages import Site, headings

SCENE = "scene_reference.txt"


def llms_text(site: Site) -> str:
    """Return a list of the pages of the site: address within the site, title and first sentence."""
    pages = [
        (place, page.text) for place, page in sorted(site.pages.items()) if page.ending == ".md" and place != "index"
    ]
    about = first_sentence(site.pages["index"].text)
    lines = [f"- [{headings(text)[0]}]({place}/): {first_sentence(text)}" for place, text in pages if headings(text)]
    return "\n".join(
        [
            "# eomgen",
            "",
            f"> {about}",
            "",
            f"- [Reference of scene files as text]({SCENE}): every section and key",
            *lines,
            "",
        ]
    )


def scene_text(site: Site) -> str:
    """Return the pages of the reference of scene files in one text, without links."""
    return "\n".join(_scene_pages(site))


def _scene_pages(site: Site) -> Iterator[str]:
    for place, page in sorted(site.pages.items()):
        if place.startswith("reference/scene/") and not place.endswith("/contents"):
            yield re.sub(
                r"(?<!!)\[([^\[\]]+)\]\([^)\s]+\)", r"\1", re.sub(r"<!--.*?-->\n?|<a id=\"[^\"]*\"></a>", "", page.text)
            )


def first_sentence(text: str) -> str:
    """Return the first sentence of the first paragraph of a page without links; empty for a page without one."""
    paragraphs = [part for part in text.split("\n\n")[1:] if part[:1].isalnum()]
    plain = re.sub(r"\[([^\[\]]+)\]\([^)\s]+\)", r"\1", " ".join((paragraphs or [""])[0].split()))
    return re.split(r"(?<=\.)\s", plain)[0]


def write_plain_text(site: Site, folder: Path) -> None:
    """Write ``llms.txt`` and the reference of scene files into the folder of the site."""
    (folder / "llms.txt").write_text(llms_text(site), encoding="utf-8")
    (folder / SCENE).write_text(scene_text(site), encoding="utf-8")
