"""Branches of equations: which there are, and on which side of each a state is, against the formulas themselves."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.symbolic.operations import InputSymbol
from eomgen.system.branches import Branches

STEPS = [0.0, 0.25, 0.5, 1.0]
N = 40


@cache
def branches() -> Branches:
    builder = eomgen.SceneBuilder("rail").parameter("level", 0.3, tunable=True).input("push")
    builder.body("slug", 2.0).joint("slide", "prismatic", "base", "slug", axis=[1, 0, 0])
    builder.curve("table", points=[[x, (-1.0) ** k] for k, x in enumerate(STEPS)], interpolation="steps")
    builder.curve("gear", points=[[0.0, 0.0], [0.5, 1.0], [2.0, 0.0]], interpolation="steps", outside="periodic")
    builder.effort("friction", "slide", "-sign(v.slide) * 3")
    builder.effort("stop", "slide", "(push if q.slide < level else 0) - 2 * abs(q.slide) * max(push, 1)")
    builder.effort("notches", "slide", "table(q.slide) + gear(3 * q.slide)")
    builder.output("travel", formula="abs(v.slide)").output("plain", formula="q.slide")
    system = eomgen.derive(builder.build(), terms=["residual", "outputs"])
    return Branches(system)


def states() -> dict[str, Any]:
    rng = np.random.default_rng(4)
    blocks = {name: rng.uniform(-2.0, 2.0, (N, 1)) for name in ("q", "v", "a", "u")}
    return {**blocks, "p": np.full((N, 1), 0.3), "t": np.zeros((N, 1))}


def column(word: str) -> int:
    (index,) = (k for k, branch in enumerate(branches().branches) if word in branch.description)
    return index


def test_branches_are_named_with_the_numbers_that_decide_them() -> None:
    found = {branch.description: branch.symbols for branch in branches().branches}
    assert {words.partition(" in ")[0] for words in found} == {
        "a sign", "a comparison", "the curve table", "the curve gear",
    }  # fmt: skip  # a list
    (sign,), (comparison,) = (
        [symbols for words, symbols in found.items() if words.startswith(kind)] for kind in ("a sign", "a comparison")
    )
    assert sign == {InputSymbol("v", 0)} and comparison == {InputSymbol("q", 0), InputSymbol("p", 0)}
    assert any(words.endswith("friction") for words in found)


def test_arguments_and_sides_are_those_of_the_formulas() -> None:
    values = states()
    q, v = values["q"][:, 0], values["v"][:, 0]
    arguments = branches().arguments(values)
    sides = branches().sides(arguments.copy())
    assert arguments.shape == sides.shape == (N, 4)
    for word, argument, side in (
        ("sign", v, np.sign(v)),
        ("comparison", q - 0.3, np.sign(q - 0.3)),
        ("table", q, (q[:, np.newaxis] >= STEPS[1:]).sum(axis=1)),
        ("gear", 3 * q, 2 * np.floor(3 * q / 2.0) + (np.mod(3 * q, 2.0) >= 0.5)),
    ):
        np.testing.assert_allclose(arguments[:, column(word)], argument, rtol=1e-15)
        part = sides[:, column(word)]
        np.testing.assert_array_equal(part - part[0], side - side[0])  # numbers from any place on
    single = {name: block[3] for name, block in values.items()}
    np.testing.assert_array_equal(branches().arguments(single), arguments[3:4])


def test_equations_are_the_residual() -> None:
    values = states()
    q, v, a, u = (values[name][:, 0] for name in "qvau")
    table = (-1.0) ** (q[:, np.newaxis] >= STEPS[1:]).sum(axis=1)
    gear = (np.mod(3 * q, 2.0) >= 0.5).astype(float)
    force = -3 * np.sign(v) + (q < 0.3) * u - 2 * np.abs(q) * np.maximum(u, 1.0) + table + gear
    np.testing.assert_allclose(branches().equations(values)[:, 0], 2.0 * a - force, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(("part", "kinds"), [(slice(0, 0), 2), (slice(0, 1), 3), (slice(1, 2), 2)])
def test_kinks_are_of_equations_and_of_chosen_outputs(part: slice, kinds: int) -> None:
    found = branches().kinks(part)
    assert len(found) == kinds
    words = sorted(branch.description.partition(" in ")[0] for branch in found)
    assert words == sorted(["an absolute value"] * (kinds - 1) + ["a largest value"])
    moving = {symbol for branch in found for symbol in branch.symbols}
    assert (InputSymbol("v", 0) in moving) == (kinds == 3) and {InputSymbol("q", 0), InputSymbol("u", 0)} <= moving
