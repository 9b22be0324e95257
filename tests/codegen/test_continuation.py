"""Data of many equal parts, continued from three samples with few, against data that are written out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eomgen.codegen.continuation import IrregularSamples, Samples, continued_integers, continued_sums, extrapolate
from eomgen.codegen.program import Statement


def samples(made: Callable[[int], Any], first: int, more: int) -> Samples:
    return made(first), made(first + more), made(first + 2 * more)


def chain(count: int) -> dict[str, Any]:
    """Return data of a chain as a Program has them: sizes, lists by element with exceptions at the ends, texts."""
    elements = [
        {"name": f"b1.{k}", "start": 7 * k, "left": 6 * (count - k), "mass": 0.5, "last": k == count - 1}
        for k in range(count)
    ]
    return {
        "size": 6 * count,
        "elements": elements,
        "places": (*(3 * k + k % 2 for k in range(count)), -1),
        "text": f"poses of {', '.join(f'b1.{k}' for k in range(count))}; 0.25 m each",
        "statements": (Statement("repeat", (count, (("row", "w", 12 * count, 6),))),),
    }


@settings(max_examples=12, deadline=None)
@given(st.integers(14, 20), st.integers(1, 3), st.integers(3, 40))
def test_evenly_growing_data_are_continued(first: int, half: int, number: int) -> None:
    more = 2 * half  # the places have a period of two
    assert extrapolate(samples(chain, first, more), number) == chain(first + number * more)


@given(st.integers(6, 9), st.integers(1, 2), st.integers(3, 20), st.integers(0, 3), st.integers(0, 3))
def test_lists_keep_their_beginning_and_their_end(few: int, more: int, number: int, head: int, tail: int) -> None:
    def made(count: int) -> list[int]:
        return [100 - k for k in range(head)] + [5 * k + 3 for k in range(count)] + [k - count for k in range(tail)]

    assert extrapolate(samples(made, few, more), number) == made(few + number * more)


def test_lists_that_do_not_grow_are_continued_item_by_item() -> None:
    assert continued_sums(([1.0, 2.0], [2.0, 2.5], [3.0, 3.0]), 5) == [6.0, 4.5]
    with pytest.raises(IrregularSamples, match="a list"):
        continued_sums(([1.0, 2.0], [2.0, 2.5], [3.0, 4.0]), 5)
    known = extrapolate((1.0, 2.0, 3.0), 4, lambda lists: [5.0] if lists == ((1.0,), (2.0,), (3.0,)) else None)
    assert known == 5.0
    for irregular in ((1, "1", 2), (1.0, 2.0, 3.0), ({"a": 1}, {"b": 1}, {"a": 1})):
        with pytest.raises(IrregularSamples):
            extrapolate(irregular, 4)


@settings(max_examples=12, deadline=None)
@given(st.integers(8, 12), st.integers(3, 20), st.integers(1, 3))
def test_lists_may_grow_in_several_places(few: int, number: int, rows: int) -> None:
    def made(count: int) -> list[int]:
        accelerations = [2 * k + 5 * count for k in range(count)]
        return [*accelerations, *(3 * count - k for k in range(rows * count)), -1, *range(count)]

    assert extrapolate(samples(made, few, 1), number) == made(few + number)


@pytest.mark.parametrize(
    "made",
    [
        lambda n: n * n,
        lambda n: list(range(n * n)),
        lambda n: [k * k for k in range(n)],
        lambda n: [1.5 * k for k in range(n)],
        lambda n: f"{n / 7:.6f} m",
        lambda n: {"a" * n: 1},
        lambda n: n / 2,
        lambda n: [list(range(k)) for k in range(n)],
        lambda n: [0] * (20 - n),
    ],
    ids=["squares", "quadratic", "bent", "numbers", "decimals", "keys", "number", "triangle", "shorter"],
)
def test_other_data_are_refused(made: Callable[[int], Any]) -> None:
    with pytest.raises(IrregularSamples):
        extrapolate(samples(made, 8, 2), 5)


def test_numbers_of_another_rule_are_asked_for() -> None:
    def places(count: int) -> list[float]:
        return [0.1 * k for k in range(count)]

    known = {tuple(places(8)): places(30)}
    assert extrapolate(samples(places, 8, 2), 11, lambda three: known.get(tuple(three[0]))) == places(30)


@pytest.mark.parametrize("number", [3, 11])
def test_sums_along_a_chain_are_continued_up_to_rounding(number: int) -> None:
    def sums(count: int) -> list[float]:
        return [*np.cumsum(np.full(count, 0.1)).tolist(), *(-0.1 * count * k for k in range(3)), 7.0]

    lists = samples(sums, 9, 2)
    np.testing.assert_allclose(continued_sums(lists, number), sums(9 + 2 * number), rtol=1e-14)
    bent = [*lists[2]]
    bent[4] += 1e-10
    with pytest.raises(IrregularSamples):
        continued_sums((lists[0], lists[1], bent), number)


def test_tables_of_integers_are_continued() -> None:
    def rows(count: int) -> Any:
        return np.array([[-1, count], *([k, 3 * k - count] for k in range(count))])

    np.testing.assert_array_equal(continued_integers(samples(rows, 8, 2), 6), rows(20))

    def sizes(count: int) -> Any:
        return np.array([[count, 2 * count + 1], [5, -count]])

    np.testing.assert_array_equal(continued_integers(samples(sizes, 8, 2), 6), sizes(20))


@pytest.mark.parametrize(
    "made",
    [
        lambda n: f"rows {3 * n} to {5 * n - 2} of beam.7, 0.25 m each",
        lambda n: f"b{n}",
        lambda n: ", ".join(f"q[{2 * k}]" for k in range(n)),
        lambda n: [f"value {k} of {n}" for k in range(n)],
        lambda n: [[k, 2 * n] for k in range(n)],
        lambda n: [(0.5, {"index": k, "name": ("a", k + n)}) for k in range(n)],
        lambda n: {"steps": n, "kinds": ["first", *["inner"] * n, "last"], "none": None},
    ],
)
def test_counts_within_texts_and_items_grow(made: Callable[[int], Any]) -> None:
    assert extrapolate(samples(made, 8, 2), 6) == made(20)


@pytest.mark.parametrize(
    "texts", [("r08", "r10", "r12"), ("1.50", "1.60", "1.70"), ("a1", "a2", "b3"), ("1", "2", "4")]
)
def test_texts_that_do_not_count_are_refused(texts: Any) -> None:
    with pytest.raises(IrregularSamples):
        extrapolate(texts, 5)
