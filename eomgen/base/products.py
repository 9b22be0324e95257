"""Register of products: packages around the core in ``eomgen/products``, each with a row in its ``__init__``, and the
import of modules by the public names that these rows give.

A row names modules and functions as texts, so that a list of all rows imports none of them. A product that was deleted
has no row, and the core works without it; so does every product that needs no module of it. The core asks for the rows
of a register, and names no product.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from eomgen.base.data import dataclass, field
from eomgen.errors import Problem, UsageError
from eomgen.products.offered import OFFERED

Row = TypeVar("Row")


@dataclass(frozen=True)
class Product:
    """Public names of one product, and the product's rows in the registers of the core.

    Parameters
    ----------
    modules : mapping
        Name of a public module below ``eomgen`` -> name of the module itself.
    names : mapping
        Public name of ``eomgen`` -> ``module:name``.
    rows : mapping
        Group of a register, as of the entry points of other distributions -> rows: objects, or texts ``module:name``
        of objects or of tuples of objects, which are imported when the register is read.
    needs : tuple of str
        Products whose modules this product imports.
    moved : mapping
        Earlier name of a module below ``eomgen``, by which users may import it -> name of the module itself.
    """

    modules: Mapping[str, str] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)
    rows: Mapping[str, tuple[object, ...]] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    moved: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class LateRow:
    """A row of a register by name, whose object is imported on request.

    Attributes
    ----------
    key : name of the row
    target : ``module:name`` of the object
    behind : name of the preceding row
    """

    key: str
    target: str
    behind: str = ""


@cache
def products() -> dict[str, Product]:
    """Return the products by name, in alphabetical order; a product that needs an absent one is left out."""
    folder = Path(__file__).resolve().parents[1] / "products"
    names = sorted(file.parent.name for file in folder.glob("*/__init__.py"))
    rows: dict[str, Product] = {name: import_module(f"eomgen.products.{name}").PRODUCT for name in names}
    while incomplete := [name for name, row in rows.items() if not rows.keys() >= set(row.needs)]:
        rows = {name: row for name, row in rows.items() if name not in incomplete}
    return rows


@cache
def rows_of(group: str, kind: type[Row]) -> tuple[Row, ...]:
    """Return the rows of all products in the register ``group`` that are objects of the class ``kind``, also out of
    tuples; texts ``module:name`` are imported."""
    rows = (row for product in products().values() for row in product.rows.get(group, ()))
    objects = (import_target(row) if isinstance(row, str) else row for row in rows)
    tables = (row if type(row) is tuple else (row,) for row in objects)
    return tuple(row for row in chain.from_iterable(tables) if isinstance(row, kind))


@cache
def objects_of(group: str) -> tuple[Any, ...]:
    """Return the objects of all late rows of a register."""
    return tuple(import_target(row.target) for row in rows_of(group, LateRow))


def insert(
    rows: Sequence[Row], added: Sequence[Row], name: Callable[[Row], str], behind: Callable[[Row], str]
) -> tuple[Row, ...]:
    """Return rows with the added rows among them, each directly after the row that the added row names.

    Parameters
    ----------
    rows, added : sequences
        The added rows have no order of their own.
    name : callable
        Name of a row.
    behind : callable
        Name of the row before an added row; without a row of this name the added row is at the end.
    """
    result, waiting = list(rows), list(added)
    while waiting:
        names = [name(row) for row in result]
        row = waiting.pop(next((index for index, row in enumerate(waiting) if behind(row) in names), 0))
        result.insert(names.index(behind(row)) + 1 if behind(row) in names else len(result), row)
    return tuple(result)


def fault_of_absent(name: str) -> tuple[str, str] | None:
    """Return the fault of a name, of a section or command for instance, that a product offers which is not installed,
    and a remedy; None for any other name."""
    absent = [product for product, names in OFFERED.items() if name in names and product not in products()]
    if not absent:
        return None
    return (
        f"it is part of the product {absent[0]} of eomgen, which is not installed [E1682]",
        "all of eomgen installed again",
    )


def replacements(kind: str) -> dict[str, str]:
    """Return the replacements of names that were removed, of the core and of all products, as ``REMOVED``."""
    tables = (REMOVED, *rows_of("eomgen.removed", dict))
    return {name: replacement for table in tables for name, replacement in table.get(kind, {}).items()}


def fault_of_removed(kind: str, name: str) -> tuple[str, str] | None:
    """Return the fault of a name that was removed, and its replacement; None for any other name."""
    replacement = replacements(kind).get(name)
    return (f"the {kind} {name} was removed [E2236]", replacement) if replacement else None


def public_modules() -> dict[str, str]:
    """Return the public modules of all products: name below ``eomgen`` -> name of the module itself."""
    return {name: module for product in products().values() for name, module in product.modules.items()}


def public_names() -> dict[str, str]:
    """Return the public names of all products: name of ``eomgen`` -> ``module:name``."""
    return {name: target for product in products().values() for name, target in product.names.items()}


def earlier_names() -> dict[str, str]:
    """Return the modules that moved, of the core and of all products, as ``MOVED``."""
    return MOVED | {name: module for product in products().values() for name, module in product.moved.items()}


def import_target(target: str) -> object:
    """Return the object of a target ``module:name``."""
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)


def optional_package(name: str, missing: Problem) -> Any:
    """Return a package that eomgen does not require. Raises UsageError with a problem if the package is missing."""
    try:
        return import_module(name)
    except ImportError:
        raise UsageError(missing) from None


#: Public modules of the core: name below ``eomgen`` -> name of the module itself.
OF_THE_CORE = {"extending": "eomgen.base.extending", "verbs": "eomgen.base.verbs"}
#: Earlier names of modules of the core below ``eomgen``, by which users may import them -> name of the module itself.
MOVED = {"analysis": "eomgen.compiled.rest", "analysis.base_parameters": "eomgen.compiled.base_parameters"}
#: Removed names of the core, by kind, with their replacements; rows of products are in the register ``eomgen.removed``.
#: Options follow their verb, ``tune --step``; arguments are ``tune(step)``.
REMOVED: Mapping[str, Mapping[str, str]] = {
    "method": {
        "hermite": "rk4, or taylor for small errors",
        "bcss2": "bcss3, with a step half as large again",
        **{f"{name}_adaptive": f"{name}, with steps of one size" for name in ("tdg1", "tdg1_star", "tdg2", "tdg3")},
    }
}


class _RenamedLoader:
    """Loader that puts the module of another name in place; ``importlib.abc`` has the base class of loaders, and
    imports much."""

    def __init__(self, name: str) -> None:
        self.name = name

    def create_module(self, spec: ModuleSpec) -> None:
        """Let Python make the module."""

    def exec_module(self, module: ModuleType) -> None:
        sys.modules[module.__name__] = import_module(self.name)


def _specification(fullname: str, name: str, *, is_package: bool = False) -> ModuleSpec:
    loader: Any = _RenamedLoader(name)
    return ModuleSpec(fullname, loader, is_package=is_package)


class _SubmoduleFinder:
    """Finder for imports of modules within public modules that were imported under another name; it is the first
    finder, since the folders of these modules hold files of the same names."""

    def __init__(self) -> None:
        #: Prefix of names with the dot -> prefix of the names of the modules themselves.
        self.prefixes: dict[str, str] = {}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        for prefix, replacement in self.prefixes.items():
            if fullname.startswith(prefix):
                name = replacement + fullname.removeprefix(prefix)
                return _specification(fullname, name) if find_spec(name) is not None else None
        return None


_WITHIN = _SubmoduleFinder()


def spec_of(name: str) -> ModuleSpec | None:
    """Return the import specification of a public module ``eomgen.name``, or of a module that had this name; None if
    there is no such module. A finder for modules within is added to ``sys.meta_path``."""
    module = OF_THE_CORE.get(name) or public_modules().get(name) or earlier_names().get(name)
    if module is None:
        return None
    if not _WITHIN.prefixes:
        sys.meta_path.insert(0, _WITHIN)
    _WITHIN.prefixes[f"eomgen.{name}."] = f"{module}."
    return _specification(f"eomgen.{name}", module, is_package=True)
