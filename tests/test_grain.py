"""The package keeps its grain: modules and import statements do not grow in number unnoticed."""

from __future__ import annotations

import ast
import json

from tests.grain import BUDGET, excesses, grain, import_lines, measured


def test_modules_and_imports_are_within_their_budget() -> None:
    higher = excesses(measured(), json.loads(BUDGET.read_text(encoding="utf-8")))
    assert not higher, "\n".join([*higher, "merge modules that share an idea, or import from packages"])


def test_imports_count_with_all_their_lines() -> None:
    source = "import a\nfrom b import (\n    c,\n    d,\n)\n\n\ndef f():\n    import e\n"
    assert import_lines(ast.walk(ast.parse(source))) == 6
    assert grain([(5, 3), (4, 3)]) == {"modules": 2, "import lines per 100": 66.7}
    assert excesses({"modules": 3}, {"modules": 2}) == ["modules: 3, 2 allowed"]
