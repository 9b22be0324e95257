"""Loops and functions over the C files of a model, which compile side by side."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from eomgen.codegen.targets.c.target import plan_files


def files_of(functions: list[int], loops: list[int]) -> list[tuple[int, list[int]]]:
    """Return for each file the number of its functions and its loops, by operations and statements of all of them."""
    program: Any = SimpleNamespace(
        prefix="model",
        functions=[SimpleNamespace(operations=size, parts=(None,)) for size in functions],
        loops=[SimpleNamespace(statements=(None,) * size) for size in loops],
        shared=[],
    )
    return [(len(file.functions), file.loops) for file in plan_files(program, 1000)]


def test_a_small_model_is_one_file() -> None:
    assert files_of([300, 300], [100, 99]) == [(2, [0, 1])]


def test_long_loops_are_spread_over_files() -> None:
    assert files_of([300, 300], [450, 450, 100]) == [(2, [2]), (0, [0]), (0, [1])]
