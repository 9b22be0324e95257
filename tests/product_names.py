"""Writes the names that products offer to users, for messages about a product that is not installed:
``python -m tests.product_names eomgen/products/offered.py``."""

from __future__ import annotations

import sys
from pathlib import Path

from eomgen.base.products import Product, import_target, products
from eomgen.base.verbs import OWNERS, Verb, methods_of

COMMAND = "python -m tests.product_names eomgen/products/offered.py"
#: Registers whose rows have no names for users.
_UNNAMED = (
    "eomgen.attributes",
    "eomgen.causes",
    "eomgen.checks",
    "eomgen.doctor",
    "eomgen.ensemble_notes",
    "eomgen.info",
    "eomgen.jax_cards",
    "eomgen.keys_elsewhere",
    "eomgen.mode_figures",
    "eomgen.notes",
    "eomgen.scenery",
    "eomgen.searches",
    "eomgen.starts",
    "eomgen.state_warnings",
    "eomgen.unresolved_motions",
    "eomgen.unseen_laws",
)
#: Attributes by which rows of registers are called by users.
_KEYS = ("key", "name", "kind")


def names_of(product: Product) -> set[str]:
    """Return the names of a product: of ``eomgen``, of verbs and methods, and of the rows of its registers."""
    rows = [
        import_target(row) if isinstance(row, str) else row
        for group, of_group in product.rows.items()
        if group not in _UNNAMED
        for row in of_group
    ]
    called = {str(getattr(row, key)) for row in rows for key in _KEYS if isinstance(getattr(row, key, None), str)}
    verbs = tuple(row for row in rows if isinstance(row, Verb))
    methods = {name for owner in OWNERS for name, _, _ in methods_of(verbs, owner)}
    parts = [(verb, import_target(part)) for row in verbs for verb, part in row.parts.items()]
    options = {f"{verb} {option.opts[0]}" for verb, part in parts for option in getattr(part, "OPTIONS", ())}
    endings = {ending for row in rows for ending in getattr(row, "endings", ())}
    return {*product.modules, *product.names, *called, *methods, *options, *endings} - {""}


def table() -> str:
    """Return the lines of the table in ``eomgen.products.offered``."""
    lines = []
    offering = {name: product for name, product in products().items() if names_of(product)}
    for name, product in offering.items():
        listed = ", ".join(f'"{word}"' for word in sorted(names_of(product)))
        line = f'    "{name}": ({listed},),' if "," not in listed else f'    "{name}": ({listed}),'
        if len(line) > 120:
            line = (
                f'    "{name}": (\n' + "".join(f'        "{word}",\n' for word in sorted(names_of(product))) + "    ),"
            )
        lines.append(line)
    return "\n".join(lines) + "\n"


def text_of(module: str) -> str:
    """Return the text of ``eomgen.products.offered`` with its table as it should be."""
    return f"{module.partition('= {')[0]}= {{\n{table()}}}\n"


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(text_of(path.read_text(encoding="utf-8")), encoding="utf-8")
