"""Import of modules by public names that differ from their places: ``eomgen.waves`` is one object with the module of
the product that registers it, and so are the modules within."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType

from eomgen.base.products import public_modules

#: Public modules of the core: name below ``eomgen`` -> name of the module itself.
OF_THE_CORE = {
    "control": "eomgen.linear.control",
    "spectra": "eomgen.linear.spectra",
    "verbs": "eomgen.base.verbs",
}


class _Renamed(Loader):
    """Loader that puts the module of another name in place."""

    def __init__(self, name: str) -> None:
        self.name = name

    def exec_module(self, module: ModuleType) -> None:
        sys.modules[module.__name__] = import_module(self.name)


class _Within(MetaPathFinder):
    """Finder of modules within imported public modules; asked first, since their folders hold files of these names."""

    def __init__(self) -> None:
        #: Prefix of names with the dot -> prefix of the names of the modules themselves.
        self.prefixes: dict[str, str] = {}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        for prefix, other in self.prefixes.items():
            if fullname.startswith(prefix):
                name = other + fullname.removeprefix(prefix)
                return ModuleSpec(fullname, _Renamed(name)) if find_spec(name) is not None else None
        return None


_WITHIN = _Within()


def spec_of(name: str) -> ModuleSpec | None:
    """Return the import specification of a public module ``eomgen.name``; None if there is no such module."""
    module = OF_THE_CORE.get(name) or public_modules().get(name)
    if module is None:
        return None
    if not _WITHIN.prefixes:
        sys.meta_path.insert(0, _WITHIN)
    _WITHIN.prefixes[f"eomgen.{name}."] = f"{module}."
    return ModuleSpec(f"eomgen.{name}", _Renamed(module), is_package=True)
