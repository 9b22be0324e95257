"""Matrices of products of groups, made for all factors of a group at once, are the matrices of the factors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor, bracket_matrix, moved_frames, tangent, transport, turned, update

#: Two factors of a group side by side, one apart from them.
KINDS = ("SE3", "R", "SO3", "R", "SE3", "SE3", "R")
SIZES = {"R": (1, 1), "SO3": (4, 3), "SE3": (7, 6)}


def factors() -> list[Factor]:
    made, q, v = [], 0, 0
    for kind in KINDS:
        made.append(Factor(kind, kind, q, SIZES[kind][0], v, SIZES[kind][1]))
        q, v = q + SIZES[kind][0], v + SIZES[kind][1]
    return made


@pytest.mark.parametrize(
    ("whole", "part", "of_numbers"),
    [
        (tangent, numeric.tangent, 1.0),
        (bracket_matrix, numeric.bracket_matrix, 0.0),
        (transport, lambda group, x: numeric.adjoint(group, numeric.exp(group, -x)), 1.0),
        (moved_frames, lambda group, q: numeric.adjoint(group, numeric.inverse(group, q)), 0.0),
    ],
)
@pytest.mark.parametrize("batch", [(), (3,), (2, 3)])
def test_they_are_the_matrices_of_their_factors(
    whole: Callable[..., Any], part: Callable[..., Any], of_numbers: float, batch: tuple[int, ...], rng: Any
) -> None:
    own = factors()
    nv = sum(factor.v_size for factor in own)
    x = rng.normal(size=(*batch, sum(factor.q_size for factor in own) if whole is moved_frames else nv))
    expected = np.zeros((*batch, nv, nv))
    for factor in own:
        values = x[..., factor.q if whole is moved_frames else factor.v]
        group = group_named(factor.group, factor.v_size)
        expected[..., factor.v, factor.v] = of_numbers if factor.group == "R" else part(group, values)
    assert np.array_equal(whole(own, x), expected)


def test_turned_velocities_are_the_same_vectors_in_the_axes_of_the_parents(rng: Any) -> None:
    made = factors()
    v, identity = rng.normal(size=made[-1].v.stop), np.zeros(made[-1].q.stop)
    identity[[factor.q.start for factor in made if factor.group != "R"]] = 1.0
    before, after = (update(made, identity, rng.normal(size=len(v))) for _ in range(2))
    found = turned(made, v, before, after)
    for factor in made:
        for first in range(factor.v.start, factor.v.stop, 3):
            part = slice(first, min(first + 3, factor.v.stop))
            axes = [
                numeric.rotation_matrix(q[factor.q][:4]) if factor.group != "R" else np.eye(1) for q in (before, after)
            ]
            np.testing.assert_allclose(axes[1] @ found[part], axes[0] @ v[part], rtol=1e-12)
