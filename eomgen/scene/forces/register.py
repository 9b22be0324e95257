"""The register of force elements: the rows of all modules of this folder, in the order of the sections in a file.

A module that is added needs no line here: its row stands after the section that it names, by default the efforts.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from eomgen.base.products import placed
from eomgen.scene.forces import springs
from eomgen.scene.forces.element_section import ElementSection


def elements_of(package: str) -> tuple[ElementSection, ...]:
    """Return the rows in the modules of a package: springs first, each other row after the section that it names."""
    files = [file for folder in import_module(package).__path__ for file in Path(folder).glob("*.py")]
    names = [f"{package}.{name}" for name in sorted(file.stem for file in files) if name != "__init__"]
    modules = (import_module(name) for name in names if name != __name__)
    rows = [row for module in modules for row in vars(module).values() if isinstance(row, ElementSection)]
    others = [row for row in dict.fromkeys(rows) if row is not springs.SECTION]
    return placed((springs.SECTION,), others, lambda row: row.key, lambda row: row.behind)


ELEMENTS = elements_of(__name__.rpartition(".")[0])
