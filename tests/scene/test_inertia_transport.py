"""Moving and rotating an inertia, against sums over point masses; numbers and batches take the same arithmetic."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.scene.inertia import Inertia, combine_inertias, entries_of, not_physical, rotate_inertia, steiner, tensor
from eomgen.scene.rotations import about_axis

RNG = np.random.default_rng(7)


def of_points(masses: Array, places: Array) -> Inertia:
    """Return mass, centre and inertia of point masses (n,) at places (n, 3)."""
    center = masses @ places / masses.sum()
    arms = places - center
    about = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, arms, strict=True))
    return Inertia(float(masses.sum()), center, np.asarray(about))


@pytest.mark.parametrize("case", range(5))
def test_transport_is_that_of_the_points(case: int) -> None:
    masses, places = RNG.uniform(0.1, 2.0, 6), RNG.normal(size=(6, 3))
    axis = RNG.normal(size=3)
    R, p = about_axis(axis / np.linalg.norm(axis), float(RNG.uniform(-3.0, 3.0))), RNG.normal(size=3)
    whole, moved = of_points(masses, places), of_points(masses, places @ R.T + p)
    found = whole.transform(R, p)
    np.testing.assert_allclose(found.center, moved.center, atol=1e-13)
    np.testing.assert_allclose(found.about_center, moved.about_center, atol=1e-13)
    halves = combine_inertias([of_points(masses[:2], places[:2]), of_points(masses[2:], places[2:])])
    np.testing.assert_allclose(halves.about_center, whole.about_center, atol=1e-13)
    about_origin = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, places, strict=True))
    np.testing.assert_allclose(whole.spatial(1.0)[:3, :3], about_origin, atol=1e-13)


def test_batches_have_the_bits_of_numbers() -> None:
    entries, arms, masses = RNG.normal(size=(6, 40)), RNG.normal(size=(3, 40)), RNG.uniform(size=40)
    R = about_axis(np.array([0.6, 0.0, 0.8]), 0.7)
    rotated, shifted = np.array(rotate_inertia(R, list(entries))), np.array(steiner(masses, list(arms)))
    for k in range(40):
        assert rotated[:, k].tolist() == rotate_inertia(R, entries[:, k].tolist())
        assert shifted[:, k].tolist() == steiner(float(masses[k]), arms[:, k].tolist())
    assert entries_of(tensor(entries[:, 0].tolist())) == entries[:, 0].tolist()


@pytest.mark.parametrize("products", [(0.0, 0.0, 0.0), (1e-9, 0.0, 0.0)])
@pytest.mark.parametrize("moments", [(3.0, 1.0, 2.0), (1.0, 5.0, 2.0), (-1.0, 1.0, 1.0), (np.nan, 1.0, 9.0)])
def test_numbers_are_judged_as_batches(moments: tuple[float, ...], products: tuple[float, ...]) -> None:
    entries = (*moments, *products)
    batches = [np.full(2, entry) for entry in entries]
    assert not_physical(batches).tolist() == [bool(not_physical(entries))] * 2
