"""Grain of the package: number of modules, and the share of lines that import. ``python -m tests.grain`` prints both.

``--update`` writes them to ``tests/grain_budget.json`` unless one is higher than before. A feature that needs a module
of its own raises the number of modules by hand, in the commit that explains it.
"""

from __future__ import annotations

import ast
import json
import sys
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
BUDGET = Path(__file__).with_name("grain_budget.json")


def import_lines(nodes: Iterable[ast.AST]) -> int:
    """Return the number of lines of import statements."""
    imports = (node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom))
    return sum((node.end_lineno or node.lineno) - node.lineno + 1 for node in imports)


def grain(sizes: Collection[tuple[int, int]]) -> dict[str, float]:
    """Return the number of modules, and the import lines per 100 lines, rounded up to a tenth; from lines and import
    lines of each module."""
    lines, imports = (sum(column) for column in zip(*sizes, strict=True))
    return {"modules": len(sizes), "import lines per 100": -(-1000 * imports // lines) / 10}


def measured() -> dict[str, float]:
    """Return the grain of the package."""
    from tests.syntax import facts  # gathers facts by this module

    modules = {file: row for file, row in facts().items() if file.suffix == ".py"}
    return grain([(file.read_text(encoding="utf-8").count("\n"), row.import_lines) for file, row in modules.items()])


def excesses(now: Mapping[str, float], allowed: Mapping[str, float]) -> list[str]:
    """Return the numbers above their budget."""
    return [f"{name}: {value:g}, {allowed[name]:g} allowed" for name, value in now.items() if value > allowed[name]]


def main(*arguments: str) -> int:
    """Print the grain, or update the budget."""
    now, allowed = measured(), json.loads(BUDGET.read_text(encoding="utf-8"))
    print(json.dumps(now))
    if "--update" not in arguments:
        return 0
    if higher := excesses(now, allowed):
        print(*higher, sep="\n", file=sys.stderr)
        return 1
    BUDGET.write_text(json.dumps(now, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
