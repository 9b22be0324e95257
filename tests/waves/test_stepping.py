"""Second order stepped wave number by wave number against the sums over pairs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from eomgen.products.waves.second_order.stepping import source
from eomgen.waves import Components, Ramp, Sea, SteppedSea

LENGTH, LABELS, END = 600.0, 64, 20.0


def five_waves(order: int = 2) -> Sea:
    """Five waves over 30 m of water, one against the others."""
    k = 2.0 * math.pi / LENGTH * np.array([5.0, 7.0, 8.0, 11.0, -6.0])
    vectors = np.column_stack((k, np.zeros(5)))
    return Sea(
        Components(vectors, np.array([0.5, 0.4, 0.3, 0.2, 0.3]), np.array([0.1, 1.0, 2.0, 3.0, 4.0])), 30.0, order=order
    )


def error(method: str, first: str, size: float) -> tuple[float, float]:
    """Return the greatest errors of potential and of displacements at the end, in parts of the greatest value."""
    sea = five_waves()
    stepped, exact = SteppedSea(sea, (LENGTH, 1.0), (LABELS, 1), method=method, first=first), at_end(sea)
    stepped.step(size, round(END / size))
    assert stepped.time == pytest.approx(END, abs=1e-11)
    pairs = ((stepped.potential(), exact.potential()), (stepped.displacement(), exact.displacement()))
    of_potential, of_places = (float(np.abs(found - known).max() / np.abs(known).max()) for found, known in pairs)
    return of_potential, of_places


def at_end(sea: Sea) -> SteppedSea:
    return SteppedSea(sea, (LENGTH, 1.0), (LABELS, 1), time=END)


def test_sums_over_pairs_on_the_grid_are_the_motion_of_its_labels() -> None:
    labels = np.column_stack((np.arange(LABELS) * LENGTH / LABELS, np.zeros(LABELS)))
    second = five_waves().motion(labels, END).position - five_waves(1).motion(labels, END).position
    assert at_end(five_waves()).displacement()[:, 0] == pytest.approx(second, abs=1e-12)


@pytest.mark.parametrize(
    ("method", "first", "order", "sizes"),
    [
        ("leapfrog", "drift", 2, (0.2, 0.1)),
        ("leapfrog", "kick", 2, (0.2, 0.1)),
        ("suzuki4", "drift", 4, (0.5, 0.25)),
        ("suzuki4", "kick", 4, (0.5, 0.25)),
        ("omf4", "drift", 4, (0.5, 0.25)),
        ("yoshida6", "drift", 6, (0.5, 0.25)),
    ],
)
def test_steps_have_the_order_of_their_composition(
    method: str, first: str, order: int, sizes: tuple[float, float]
) -> None:
    coarse, fine = (np.array(error(method, first, size)) for size in sizes)
    assert np.log2(coarse / fine) == pytest.approx([order, order], abs=0.05 * order)


def test_directions_in_two_dimensions_are_stepped() -> None:
    lengths, counts = (400.0, 300.0), (32, 32)
    multiples = np.array([[3, 1], [4, -2], [2, 3], [-3, 1], [3, -1]])
    vectors = 2.0 * math.pi * multiples / np.array(lengths)
    waves = Components(vectors, np.array([0.5, 0.4, 0.3, 0.2, 0.3]), np.array([0.1, 1.0, 2.0, 3.0, 4.0]))
    stepped = SteppedSea(Sea(waves, 30.0), lengths, counts)
    stepped.step(0.2, 50)
    a, b = np.meshgrid(*(np.arange(n) * length / n for n, length in zip(counts, lengths, strict=True)), indexing="ij")
    labels = np.column_stack((a.ravel(), b.ravel()))
    one, two = (Sea(waves, 30.0, order=order).motion(labels, 10.0).position for order in (1, 2))
    assert stepped.displacement().reshape(-1, 3) == pytest.approx(two - one, abs=1e-6)


def test_a_forcing_that_comes_in_slowly_makes_fewer_free_waves() -> None:
    """Deviations from the bound waves that the sums over pairs are, after the start."""
    waves, end = five_waves(), 60.0
    exact = SteppedSea(waves, (LENGTH, 1.0), (LABELS, 1), time=end).potential()
    left = []
    for ramp in (Ramp(1e-6), Ramp(30.0)):
        stepped = SteppedSea(waves, (LENGTH, 1.0), (LABELS, 1), ramp=ramp)
        stepped.step(1.0, 60)
        left.append(float(np.abs(stepped.potential() - exact).max()))
    assert left[1] < 0.6 * left[0]


def test_one_direction_has_no_products_across_it() -> None:
    along, plane = source(plane=False), source(plane=True)
    assert "carried_y" in plane
    assert "carried_y" not in along
    assert along.count("fields[") < plane.count("fields[")
