"""Files of one product: ``python -m tests.product_parts fmu`` prints the commands that remove it.

A product ``NAME`` has the folders ``eomgen/products/NAME``, ``templates/NAME`` and ``tests/NAME``, as far as it needs
them, stubs of its public modules, and the paths in ``tests/NAME/product.toml``: pages, examples, and tests in other
folders; ``shared`` are tests in the folder of another product that need this one as well. The commands that follow the
removal renew texts that are written from all products. ``--strays`` lists tests elsewhere that import the product.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from eomgen.base.products import products

ROOT = Path(__file__).parents[1]
#: Commands that write texts from all products anew.
RENEWALS = (
    "python -m tests.product_names eomgen/products/offered.py",
    "python -m tests.model_stub",
    "python -m tests.builder_keys eomgen/scene/builder_keys.pyi",
    "python -m tests.public_names",
    "python -m tests.rooms docs/rooms.svg",
    "python -m tests.budgets --update",
)


def facts_of(product: str, root: Path = ROOT) -> dict[str, Any]:
    """Return the content of ``product.toml``: ``paths``, ``shared``, ``uses``, ``scenes``, ``results``; empty without
    the file."""
    file = root / "tests" / product / "product.toml"
    return tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}


def paths_of(product: str, root: Path = ROOT) -> list[str]:
    """Return all files and folders of a product."""
    folders = [f"eomgen/products/{product}", f"templates/{product}", f"tests/{product}"]
    folders += [f"eomgen/{module}.pyi" for module in products()[product].modules]
    facts = facts_of(product, root)
    optional = [path for path in (*folders, *facts.get("shared", ())) if (root / path).exists()]
    return optional + facts.get("paths", [])


def dependents(product: str) -> list[str]:
    """Return a product and the products that need it."""
    found = [product]
    while more := [name for name, row in products().items() if name not in found and set(row.needs) & set(found)]:
        found += more
    return found


def removal(product: str) -> str:
    """Return the command that removes a product and the products that need it, for Git."""
    return f"git rm -r --quiet {' '.join(path for one in dependents(product) for path in paths_of(one))}"


def strays(product: str, root: Path = ROOT) -> Iterator[str]:
    """Yield the tests that import a product and are not removed with it and the products that need it."""
    own = tuple(
        path if path.endswith(".py") else f"{path}/" for one in dependents(product) for path in paths_of(one, root)
    )
    row = products()[product]
    modules = "|".join(map(re.escape, (f"products.{product}", *row.modules, *row.moved)))
    names = "|".join((product, *row.modules, *row.names))
    places = rf"(eomgen\.({modules})|tests\.{product})"
    named = re.compile(rf"^\s*((from|import) {places}\b|from eomgen(\.products)? import .*\b({names})\b)", re.M)
    for file in sorted((root / "tests").rglob("*.py")):
        place = file.relative_to(root).as_posix()
        if not place.startswith(own) and named.search(file.read_text(encoding="utf-8")):
            yield place


def main(*words: str) -> int:
    """Print the commands, or the tests elsewhere."""
    names = [word for word in words if not word.startswith("--")]
    for product in names:
        lines = [*strays(product)] if "--strays" in words else [removal(product), *RENEWALS]
        sys.stdout.write("\n".join(lines) + "\n")
    return 0 if names else 2


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
