"""Location of files that are not Python: templates are beside the package in a checkout, inside it when installed."""

from __future__ import annotations

from pathlib import Path

from eomgen.errors import FileError


def template_folder() -> Path:
    """Return the folder of the templates, one folder in it for each kind of text that is made."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "_templates", package.parent / "templates"):
        if (folder / "c").is_dir():
            return folder
    raise FileError(
        f"the templates are neither in {package / '_templates'} nor in {package.parent / 'templates'}",
        "reinstall eomgen",
    )
