"""Seas that cannot be, each with one message."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.waves import Components, Sea

VECTORS, ONE = np.array([[0.05, 0.0], [0.06, 0.0]]), np.ones(2)


@pytest.mark.parametrize(
    ("components", "options", "text"),
    [
        (
            (VECTORS, ONE * 30.0, ONE),
            {},
            "component 1 has k A coth(k h) = 1.8; from 1 on a wave crosses itself",
        ),
        (
            (VECTORS, ONE, ONE),
            {"depth": 0.0},
            "Sea: depth: 0 m is not above 0; try: math.inf for water without a bottom",
        ),
        ((VECTORS, ONE, ONE), {"depth": math.nan}, "Sea: depth: nan m is not above 0"),
        ((VECTORS * [[0.0], [1.0]], ONE, ONE), {}, "component 0 has the wave vector (0, 0), which is a change of the"),
        ((VECTORS[[0, 0]], ONE, ONE), {}, "two components have the same wave vector; try: one with the sum of both"),
        ((VECTORS, -ONE, ONE), {}, "the amplitude -1 m is negative; try: the phase + pi"),
        ((VECTORS, ONE[:1], ONE), {}, "2 wave vectors have amplitudes of shape (1,) and phases of (2,)"),
        ((VECTORS[0], ONE, ONE), {}, "wave vectors have the shape (2,); try: (n, 2), at least one"),
        ((VECTORS, ONE * np.inf, ONE), {}, "a wave vector, an amplitude or a phase is no finite number"),
        ((VECTORS, ONE, ONE), {"order": 3}, "Sea: order: there is no order 3; try: 1 or 2"),
        ((VECTORS, ONE, ONE), {"gravity": -9.81}, "Sea: gravity: -9.81 m/s^2 is not above 0"),
    ],
)
def test_what_cannot_be_is_named(components: tuple[Any, ...], options: dict[str, Any], text: str) -> None:
    with pytest.raises(UsageError) as refused:
        Sea(Components(*components), **options)
    assert text in str(refused.value)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda sea: sea.motion([1.0, 2.0], 0.0), "Sea: labels: an array of shape (2,); try: finite numbers of shape"),
        (
            lambda sea: sea.at([[1.0, np.nan]], 0.0),
            "an array of shape (1, 2), with what is no finite number",
        ),
        (
            lambda sea: sea.motion([[1.0, 2.0]], 0.0, 3.0),
            "at c = 3 m are outside of the water, which is from -20 m to 0",
        ),
        (lambda sea: sea.motion([[1.0, 2.0]], 0.0, -21.0), "labels at c = -21 m are outside of the water"),
        (lambda sea: sea.motion([[1.0, 2.0]]), "time"),
        (lambda sea: Sea(Components(VECTORS, ONE, ONE), dept=3.0), "depth"),
    ],
)
def test_calls_that_cannot_be_taken(call: Callable[[Sea], Any], text: str) -> None:
    with pytest.raises(UsageError) as refused:
        call(Sea(Components(VECTORS, ONE, ONE), 20.0))
    assert text in str(refused.value)


def test_pairs_that_do_not_fit_memory_are_refused_before_they_are_made() -> None:
    k = np.linspace(0.01, 1.0, 20_000)
    many = Components(np.column_stack((k, np.zeros_like(k))), np.full(len(k), 1e-4), np.zeros(len(k)))
    with pytest.raises(
        UsageError, match=r"20000 components have 199990000 pairs, whose table takes 17.6 GB; try: .* or a SteppedSea"
    ):
        Sea(many)


def test_shallow_water_is_warned_of() -> None:
    with pytest.warns(RuntimeWarning, match=r"A / \(k\^2 h\^3\) = 0.4 for the largest wave, k = 0.05 rad/m; an"):
        Sea.of_one_wave(0.05, 1.0, 10.0)
