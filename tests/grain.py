"""Grain of the package: number of modules, and the share of lines that import. ``python -m tests.grain`` prints both.

``--update`` writes them to ``tests/grain_budget.json`` unless one is higher than before. A feature that needs a module
of its own raises the number of modules by hand, in the commit that explains it.
"""

from __future__ import annotations

import ast
import json
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
BUDGET = Path(__file__).with_name("grain_budget.json")


def import_lines(source: str) -> int:
    """Return the number of lines of import statements."""
    nodes = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Import | ast.ImportFrom))
    return sum((node.end_lineno or node.lineno) - node.lineno + 1 for node in nodes)


def grain(files: Iterable[Path]) -> dict[str, float]:
    """Return the number of modules, and the import lines per 100 lines, rounded up to a tenth."""
    sources = [file.read_text(encoding="utf-8") for file in files]
    lines, imports = sum(source.count("\n") for source in sources), sum(map(import_lines, sources))
    return {"modules": len(sources), "import lines per 100": -(-1000 * imports // lines) / 10}


def measured() -> dict[str, float]:
    """Return the grain of the package."""
    return grain(sorted((ROOT / "eomgen").rglob("*.py")))


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
