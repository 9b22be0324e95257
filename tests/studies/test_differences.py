"""The ladder of differences on functions whose derivatives are known: agreement, step, slope, and error bars that
hold."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.lie.product import Factor
from eomgen.products.studies.verification import check as checking
from eomgen.products.studies.verification.claims.claim import Array, Blocks, Claim, Engine, column, move_state
from eomgen.products.studies.verification.differences import (
    BARS,
    LADDER,
    ClaimAtStates,
    complex_steps,
    differences,
    sizes_of,
)

FACTORS = (Factor("R", "slide", 0, 1, 0, 1), Factor("SO3", "ball", 1, 4, 1, 3))


def engine_of(function) -> Engine:
    return Engine(FACTORS, {"f": ("q", "v"), "base": ("t",)}, lambda name, blocks: {"y": function(blocks)})


def at(claim: Claim, engine: Engine, state: Blocks) -> ClaimAtStates:
    return ClaimAtStates(claim, engine, engine, state)


def states(count: int, rng: np.random.Generator) -> dict[str, Array]:
    turn = rng.normal(size=(count, 4))
    q = np.concatenate([rng.uniform(-1, 1, (count, 1)), turn / np.linalg.norm(turn, axis=1, keepdims=True)], axis=1)
    return {"q": q, "v": rng.normal(size=(count, 4))}


def form_of(block: str, size: int) -> Claim:
    def source(engine: Engine, state: Blocks) -> Array:
        return engine("f", state)["y"]

    return Claim("f", "", lambda engine, state: column(source(engine, state)), source, lambda _: {block: np.eye(size)})


def test_error_bars_hold_and_are_small(rng: np.random.Generator) -> None:
    state = states(5, rng)
    scales = np.array([1e-3, 1.0, 300.0, 1.0])

    def function(blocks: Blocks) -> Array:
        v = blocks["v"]
        return np.stack([np.sin(scales * v).sum(axis=-1), 1e6 + np.exp(v[..., 0]), v[..., 1] ** 2], axis=-1)

    engine = engine_of(function)
    found = differences(at(form_of("v", 4), engine, state))
    v = state["v"]
    exact = np.zeros((5, 3, 4))
    exact[:, 0] = scales * np.cos(scales * v)
    exact[:, 1, 0], exact[:, 2, 1] = np.exp(v[:, 0]), 2.0 * v[:, 1]
    assert np.all(np.abs(found.best - exact) <= 5.0 * found.bar + 1e-13)
    assert np.all(found.bar <= 1e-5 * np.maximum(np.abs(exact), 1.0))
    assert not found.kink.any()
    assert np.abs(complex_steps(at(form_of("v", 4), engine, state)) - exact).max() <= 1e-12


@pytest.mark.parametrize(("bend", "kinked"), [(np.abs, True), (lambda x: x * np.abs(x), False), (lambda x: x, False)])
def test_one_sided_differences_tell_kinks(bend, kinked: bool) -> None:
    state = {"q": np.array([[0.0, 1.0, 0.0, 0.0, 0.0]]), "v": np.zeros((1, 4))}
    engine = engine_of(lambda blocks: bend(blocks["v"][..., :1]) + blocks["v"][..., 1:2] ** 2)
    found = differences(at(form_of("v", 4), engine, state))
    assert found.kink[0, 0].tolist() == [kinked, False, False, False]
    assert not kinked or found.kink_step[0, 0, 0] < 1e-8


def test_a_value_that_leaves_its_domain_has_differences_at_small_steps() -> None:
    state = {"q": np.array([[0.0, 1.0, 0.0, 0.0, 0.0]]), "v": np.full((1, 4), 1e-3)}
    found = differences(at(form_of("v", 4), engine_of(lambda blocks: np.sqrt(blocks["v"])), state))
    assert np.isnan(found.ladder[LADDER > 1e-3]).any() and found.bar.max() < 1e-4
    assert np.allclose(np.diagonal(found.best[0]), 0.5 / np.sqrt(1e-3), rtol=1e-7)


def test_a_large_row_hides_no_feature_of_a_small_row() -> None:
    """Drag at a speed of 1e-6 beside a force of 4e9: steps above 1e-5 see the mean of the slopes on both sides."""
    state = {"q": np.array([[0.0, 1.0, 0.0, 0.0, 0.0]]), "v": np.full((1, 4), 1e-6)}
    speed = 1e-6

    def function(blocks: Blocks) -> Array:
        v = blocks["v"][..., :1]
        return np.concatenate([30.0 * np.sqrt(v**2 + speed**2) + v, np.full_like(v, 4.5e9)], axis=-1)

    found = differences(at(form_of("v", 4), engine_of(function), state))
    exact = 30.0 / np.sqrt(2.0) + 1.0
    assert abs(found.best[0, 0, 0] - exact) <= BARS * found.bar[0, 0, 0]


def test_turns_are_moved_by_the_exponential_and_to_first_order_alike(rng: np.random.Generator) -> None:
    """The derivative of R(q) r along a body turn d is R (d x r), by finite and by infinitesimal steps."""
    state, r = states(4, rng), np.array([0.3, -0.2, 0.5])

    def rotated(quaternion: Array, vector: Array) -> Array:
        w, n = quaternion[..., :1], quaternion[..., 1:]
        twice = 2.0 * np.cross(n, np.broadcast_to(vector, n.shape))
        return vector + w * twice + np.cross(n, twice)

    engine = engine_of(lambda blocks: rotated(blocks["q"][..., 1:], r))
    expected = np.stack([rotated(state["q"][:, 1:], np.cross(d, r)) for d in np.eye(3)], axis=-1)
    for found in (
        differences(at(form_of("q", 4), engine, state)).best,
        complex_steps(at(form_of("q", 4), engine, state)),
    ):
        assert np.allclose(found[..., 1:], expected, atol=1e-9) and not found[..., 0].any()
    turned = move_state(engine, state, {"q": np.ones((4, 4))}, 0.7)["q"]
    assert np.allclose(np.linalg.norm(turned[:, 1:], axis=1), 1.0, atol=1e-15)


@pytest.mark.parametrize("size", [1e6, 1.0])
def test_what_cancels_along_a_direction_is_known_as_well_as_what_it_is_of(
    size: float, rng: np.random.Generator
) -> None:
    state = states(2, rng)
    claim = Claim(
        "f",
        "",
        lambda engine, state: np.zeros((2, 2, 4)),
        lambda engine, state: engine("f", state)["y"],
        lambda _: {"v": np.eye(4)},
    )
    engine = engine_of(lambda blocks: np.tile([size, 0.0], (2, 1)))
    allowed = sizes_of(at(claim, engine, state), np.zeros((2, 2, 4)), rng).exact
    assert np.broadcast_to(allowed, (2, 2, 4)) == pytest.approx(max(1e-13 * size, 1e-13), rel=1e-3)


@pytest.mark.parametrize("entries", [[(0, 1)], [(2, 0), (2, 1)], [(0, 0), (1, 1), (2, 0)]])
def test_numbers_that_no_formula_explains_are_failures_of_their_first_entry(entries: list[tuple[int, int]]) -> None:
    finite = np.ones((3, 3, 2), bool)
    finite[(1, *np.transpose(entries))] = False
    claim = Claim("f", "", lambda engine, state: state["q"], rows=("a", "b", "c"), columns=("x", "y"))
    quiet = SimpleNamespace(singular=lambda state: [])
    remarks, state = checking.Remarks(), {"q": np.zeros((3, 1))}
    there = replace(at(claim, engine_of(np.zeros_like), state), names=("first", "second", "third"))
    (failure,) = checking._not_numbers(there, cast(Any, quiet), finite, remarks)
    row, column_of = entries[0]
    assert (failure.state, failure.entry) == ("second", f"{'abc'[row]} along {'xy'[column_of]}")
    told = SimpleNamespace(singular=lambda state: ["a root of 0"])
    assert not checking._not_numbers(there, cast(Any, told), finite, remarks)
    assert remarks.texts and "a root of 0" in remarks.texts[0]
