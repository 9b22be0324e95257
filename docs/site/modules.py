"""The page of modules, made of the first sentences of their docstrings; ``python -m docs.site.modules`` prints it."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "eomgen"
_HEAD = """# Modules

Paths are below `eomgen`; each line is the first sentence of a module's docstring. Rooms, their order, and a table of
changes with their files are on [three pages](../contributing/changes_of_scenes_and_equations.md). `python -m
docs.site.modules` prints this page.
"""


def first_sentence(file: Path) -> str:
    """Return the first sentence of a module's docstring on one line; empty for a module without docstring."""
    docstring = re.match(r'"""(.*?)"""', file.read_text(encoding="utf-8"), re.DOTALL)
    paragraph = docstring[1].split("\n\n")[0] if docstring else ""
    text = " ".join(paragraph.split()).replace("``", "`").replace("|", "\\|")
    return re.split(r"(?<=[.;])\s(?=[A-Z`])", text, maxsplit=1)[0].rstrip(".;")


def folders() -> Iterator[tuple[Path, list[Path]]]:
    """Yield each folder of the package that has modules besides its ``__init__``, with them."""
    for folder in [PACKAGE, *sorted(path for path in PACKAGE.rglob("*") if path.is_dir())]:
        files = sorted(file for file in folder.glob("*.py") if file.name not in ("__init__.py", "__main__.py"))
        if files:
            yield folder, files


def page() -> str:
    """Return the text of the page."""
    lines = [_HEAD]
    for folder, files in folders():
        name = folder.relative_to(PACKAGE).as_posix()
        about = first_sentence(folder / "__init__.py")
        lines += [f"## {'eomgen' if name == '.' else name}", "", *([f"{about}.", ""] if about else [])]
        lines += [f"- `{file.name}`: {first_sentence(file)}" for file in files]
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


if __name__ == "__main__":
    sys.stdout.write(page())
