"""Register of products: packages around the core in ``eomgen/products``, each with a row in its ``__init__``.

A row names modules and functions as texts, so that a list of all rows imports none of them. A product that was deleted
has no row, and the core works without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path


@dataclass(frozen=True)
class Product:
    """Public names of one product.

    Parameters
    ----------
    modules : mapping
        Name of a public module below ``eomgen`` -> name of the module itself.
    names : mapping
        Public name of ``eomgen`` -> ``module:name``.
    """

    modules: Mapping[str, str] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)


@cache
def products() -> dict[str, Product]:
    """Return the rows of all products by name, in alphabetical order."""
    folder = Path(__file__).resolve().parents[1] / "products"
    names = sorted(file.parent.name for file in folder.glob("*/__init__.py"))
    return {name: import_module(f"eomgen.products.{name}").PRODUCT for name in names}


def public_modules() -> dict[str, str]:
    """Return the public modules of all products: name below ``eomgen`` -> name of the module itself."""
    return {name: module for product in products().values() for name, module in product.modules.items()}


def public_names() -> dict[str, str]:
    """Return the public names of all products: name of ``eomgen`` -> ``module:name``."""
    return {name: target for product in products().values() for name, target in product.names.items()}


def named(target: str) -> object:
    """Return the object of a target ``module:name``."""
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)
