"""The package keeps its weight: code, private numbers and names of the core never grow, products with a reason."""

from __future__ import annotations

import ast
import subprocess

import pytest

from tests.budgets import (
    HIGHEST,
    PACKAGE,
    allowed,
    complex_functions,
    constants,
    core,
    excesses,
    is_participle,
    line_counts,
    measured,
    refusals,
    short_functions,
)
from tests.syntax import facts

UPDATE = "remove code or move it into a product; `python -m tests.budgets --update` writes lower numbers"


def test_rooms_and_phrases_are_within_their_budgets() -> None:
    now, most = measured(), allowed()
    higher = [*excesses(now["rooms"], most["rooms"]), *excesses(now["phrases"], most["phrases"])]
    assert not higher, "\n".join([*higher, UPDATE])


def test_docstrings_and_blank_lines_keep_their_shares() -> None:
    now, before = measured()["shares"]["all"], allowed()["shares"]["all"]
    assert now["blank"] == pytest.approx(before["blank"], abs=1.0)
    assert before["docstrings"] - 1.0 < now["docstrings"] < before["docstrings"] + 3.5


def test_no_function_is_too_complex() -> None:
    worst = {
        f"{file.relative_to(PACKAGE).as_posix()}::{name}": number
        for file, row in facts().items()
        for name, number in row.complexities
        if number > HIGHEST
    }
    assert not worst, "decompose into functions with one job each, or replace branches by a table"


@pytest.mark.skipif(not (PACKAGE.parent / ".git").exists(), reason="an archive has no list of tracked files")
def test_tracked_files_are_small() -> None:
    root = PACKAGE.parent
    listed = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True, check=True).stdout.split(
        "\n"
    )
    sizes = {name: (root / name).stat().st_size for name in listed if (root / name).is_file()}
    assert {name: size for name, size in sizes.items() if size > 300_000} == {}
    drawn = sum(size for name, size in sizes.items() if name.endswith((".png", ".svg", ".gif", ".jpg")))
    assert drawn < 1_500_000, "save photographs and plots with a palette of 256 colours: Image.quantize(256) of Pillow"


SOURCE = '''"""Text of the
module."""

from a import (
    b,
)

# a comment
LIMIT = 3.0
_STEP, _SLACK = 1e-3, -2
TABLE = (1, 2)
NAME = "x"
HALF: float = 1 / 2


def _made(x):
    """Text."""

    return b(x)  # counted


def _of_x(y):
    return _made(y)
'''


def test_lines_numbers_and_names_are_counted() -> None:
    tree = ast.parse(SOURCE)
    nodes = list(ast.walk(tree))
    assert line_counts(SOURCE, nodes) == {"lines": 23, "code": 9, "docstrings": 3, "blank": 7}
    assert constants(tree) == 4
    assert short_functions(SOURCE, tree) == [("_made", 1), ("_of_x", 0)]
    participles = ("placed", "_told", "_of_body", "made", "begun", "written")
    others = ("placed_bodies", "read", "need", "_speed", "embed", "__init_subclass__", "seed", "proceed", "force")
    assert [is_participle(name) for name in (*participles, *others)] == [True] * 6 + [False] * 9


def test_the_core_only_falls_and_products_grow_with_a_reason() -> None:
    old = {"scene": {"code": 10.0}, "linear": {"code": 5.0}, "products.fmu": {"code": 3.0}}
    moved = {"scene": {"code": 12.0}, "linear": {"code": 3.0}, "products.fmu": {"code": 3.0}}
    assert core(moved)["code"] == 15.0 and refusals(moved, old, ()) == []
    grown = {**moved, "scene": {"code": 13.0}, "products.fmu": {"code": 4.0}}
    assert refusals(grown, old, ()) == [
        "core: 16 code, 15 allowed",
        'products.fmu: 4 code, 3 allowed; --why "fmu: reason"',
    ]
    assert refusals({**moved, "products.fmu": {"code": 4.0}}, old, ("fmu",)) == []
    assert excesses({"new": {"code": 1.0}}, old) == ["new: 1 code, 0 allowed"]


EXAMPLE = """
class Reader:
    async def read(self, rows=[a for a in b if c]):
        def inner():
            return x if y else z
        for row in rows:
            pass
        else:
            pass
        while True:
            break
        try:
            with a or b and c: pass
        except ValueError:
            pass
        else:
            assert a and b
        match row:
            case 1: pass
            case [2, *_]: pass
            case _: pass
        return lambda: [b for a in b if c if d]
"""


def test_decisions_are_counted_by_the_rules() -> None:
    # loop 2, while 1, try 2, operators 2, assertion 1, cases 2, comprehension 3; defaults are not of the body
    tree = ast.parse(EXAMPLE)
    assert dict(complex_functions(EXAMPLE, 0, tree)) == {"Reader.read": 14, "Reader.read.inner": 2}
    assert dict(complex_functions(EXAMPLE, 13, tree)) == {"Reader.read": 14}
    assert not dict(complex_functions(EXAMPLE, 14, tree))
