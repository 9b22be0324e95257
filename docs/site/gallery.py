"""The gallery: pictures that lead to the examples, and for each its text, animation, cost of accuracy and files.

The animations are runs of the scenes whose cost of accuracy ``benchmarks.example_pages`` measures, five seconds at
most. A build of the site makes them, each anew only if a file of the example changed.
"""

from __future__ import annotations

import hashlib
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import eomgen
from benchmarks.example_pages import BEGIN, END, STUDIES
from docs.site.pages import ROOT, Page, headings, read

FOLDER = "gallery"
#: Files of an example that are shown, by ending, and the language of their block; longer ones are named.
SHOWN, MOST_LINES = {".toml": "toml", ".py": "python", ".c": "c"}, 160
#: Seconds of motion that are animated.
LONGEST = 5.0


def examples() -> list[str]:
    """Return the names of all examples, folders with a page."""
    return sorted(path.parent.name for path in (ROOT / "examples").glob("*/README.md"))


def files_of(name: str) -> list[Path]:
    """Return the files of an example whose text is shown or named, scenes first."""
    folder = ROOT / "examples" / name
    files = [path for path in sorted(folder.rglob("*")) if path.suffix in SHOWN and "__pycache__" not in path.parts]
    return sorted(files, key=lambda path: list(SHOWN).index(path.suffix))


def text_of(name: str) -> str:
    """Return the text of an example's page: its own page, the animation, the cost of accuracy and the files."""
    text = read(f"examples/{name}/README.md")
    if name in STUDIES:
        text += f"\n## Animation\n\nUp to {LONGEST:g} s of `{STUDIES[name].file}`; drag to turn.\n\n"
        # the frame's path starts at the page's own folder
        text += f'<iframe class="animation" src="../../animations/{name}.html" loading="lazy"></iframe>\n'
        measured = read(f"docs/examples/{name}.md").partition(BEGIN)[2].partition(END)[0]
        text += "\n" + measured.replace(f"]({name}.png)", f"](../../docs/examples/{name}.png)").strip() + "\n"
    text += "\n## Files\n"
    for path in files_of(name):
        content = path.read_text(encoding="utf-8")
        shown = path.relative_to(ROOT / "examples" / name)
        if content.count("\n") <= MOST_LINES:
            text += f"\n`{shown}`\n\n```{SHOWN[path.suffix]}\n{content.rstrip()}\n```\n"
        else:
            text += f"\n`{shown}`, {content.count(chr(10))} lines\n"
    return text


def picture_of(name: str) -> str:
    """Return the path of the first picture on an example's page."""
    (first, *_) = re.findall(r"!\[[^\]]*\]\(([\w.]+)\)", read(f"examples/{name}/README.md"))
    return f"examples/{name}/{first}"


def gallery_pages() -> Iterator[Page]:
    """Yield the page of pictures, the pages of all examples, and the table of the cost of accuracy."""
    cards = "\n".join(
        f'<a class="card" href="../{name}/"><img src="../../{copied(name)}" alt="" loading="lazy">'
        f"<span>{headings(read(f'examples/{name}/README.md'))[0]}</span></a>"
        for name in examples()
    )
    listed = "\n".join(("index", *examples()))
    text = "# Gallery\n\nAll examples; each page has the scene or the program, and of scenes the motion.\n"
    text += "How much accuracy costs on them is [one table](index.md).\n"
    yield Page(
        f"{FOLDER}/contents",
        f'{text}\n<div class="cards">\n{cards}\n</div>\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n',
    )
    for name in examples():
        also = f"docs/examples/{name}.md" if name in STUDIES else ""
        yield Page(f"{FOLDER}/{name}", text_of(name), f"examples/{name}/README.md", also=also)
    yield Page(f"{FOLDER}/index", read("docs/examples/README.md"), "docs/examples/README.md")


def copied(name: str) -> str:
    """Return the path of the picture of an example among the files of the site."""
    return f"pictures/{name}{Path(picture_of(name)).suffix}"


def write_files(html: Path, kept: Path) -> None:
    """Copy pictures and animations into the HTML of a site; animations are kept in a folder by their content."""
    for name in examples():
        target = html / copied(name)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / picture_of(name), target)
    (html / "animations").mkdir(exist_ok=True)
    kept.mkdir(parents=True, exist_ok=True)
    for name, study in STUDIES.items():
        digest = hashlib.sha256(eomgen.__version__.encode())
        for path in files_of(name):
            digest.update(path.read_bytes())
        page = kept / f"{name}-{digest.hexdigest()[:16]}.html"
        if not page.is_file():
            scene = eomgen.load(ROOT / "examples" / name / study.file)
            model = eomgen.build(scene, profile="quick")
            model.simulate(min(LONGEST, scene.simulation.duration), error_estimate=False).animate(page)
        shutil.copyfile(page, html / "animations" / f"{name}.html")
