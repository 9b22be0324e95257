"""Kernels of pairs against arithmetic of 60 digits, their operations, and what a case leaves out."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from mpmath import cosh, hypot, mpf

from eomgen.products.waves.second_order.pairs import COLUMNS, Case, PairTape
from eomgen.products.waves.second_order.routines import routines
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape
from eomgen.waves import WaveNumber, gravity_waves
from tests.waves import oracle

Vector = tuple[float, float]


def kernel(first: Vector, second: Vector, depth: float | None, c: float, *, spread: bool) -> dict[str, float]:
    """Return the compiled kernel of a pair, the faster component first."""
    made, p = routines(Case(depth is not None, spread, c == 0.0)), np.array([9.81, depth or 0.0, c])
    columns = made.table("components", np.array([second, first]), p)
    assert columns[COLUMNS.index("w"), 0] <= columns[COLUMNS.index("w"), 1]
    return dict(zip(made.case.entries, made.table("pairs", columns, p)[:, 0].tolist(), strict=True))


TURNED = (0.055 * math.cos(math.pi / 6.0), 0.055 * math.sin(math.pi / 6.0))


@pytest.mark.parametrize(
    ("other", "depth", "plus", "minus"),
    [
        ((0.055, 0.0), None, 0.0, 0.367270336401),
        ((0.055, 0.0), 40.0, 0.034346447812, 2.20207490674),
        ((0.055, 0.0), 20.0, 0.400865416304, 8.23823413652),
        ((0.055, 0.0), 6.0, 17.0713784885, 339.502340618),
        (TURNED, None, -0.0464781172408, 0.0608572815046),
        (TURNED, 20.0, 0.290646001954, 0.155512133220),
        ((-0.08, 0.0), None, -0.442944691807, 0.0),
        ((-0.08, 0.0), 20.0, -0.430909734708, -0.0336247319918),
    ],
)
def test_potentials_of_a_pair_are_those_of_the_table(
    other: Vector, depth: float | None, plus: float, minus: float
) -> None:
    """The table has them for each of both orders, the other component first: a difference changes its sign."""
    found = kernel(other, (0.05, 0.0), depth, 0.0, spread=True)
    assert found["Bp"] / 2.0 == pytest.approx(plus, rel=1e-11, abs=1e-14)
    assert found["Bm"] / 2.0 == pytest.approx(-minus, rel=1e-11, abs=1e-14)


GEOMETRIES = {
    "behind one another": (0.0, 1.1),
    "nearly equal": (0.0, 1.0 + 1e-6),
    "three times as long": (0.0, 3.0),
    "oblique": (0.5, 1.1),
    "oblique and nearly as long": (0.5, 1.0 + 1e-6),
    "nearly equal and nearly parallel": (1e-3, 1.001),
    "across": (2.0, 1.5),
    "opposed": (math.pi, 1.2),
}


@pytest.mark.parametrize(("angle", "ratio"), GEOMETRIES.values(), ids=GEOMETRIES)
def test_kernels_have_nine_digits_in_any_depth(angle: float, ratio: float) -> None:
    depth = 20.0
    for kd in 10.0 ** np.arange(-3.0, 3.1, 0.5):
        k = float(kd) / depth
        first = (ratio * k * math.cos(angle), ratio * k * math.sin(angle) if angle not in (0.0, math.pi) else 0.0)
        for c in (0.0, -min(0.3 / k, 0.5 * depth)):
            exact = oracle.pair(first, (k, 0.0), depth, c)
            for spread in (True, False) if angle == 0.0 else (True,):
                _compare(kernel(first, (k, 0.0), depth, c, spread=spread), exact, (first, (k, 0.0)), depth, c)


def _compare(
    found: dict[str, float], exact: dict[str, Any], vectors: tuple[Vector, Vector], depth: float, c: float
) -> None:
    """Compare to nine digits, and to rounding where terms cancel that are equal in deep water."""
    k = math.hypot(*vectors[0])
    natural = {"B": math.sqrt(9.81 / k), "w": 0.0}
    for name in set(found) - {"Dx", "Dy"}:
        expected = exact[name]
        if name.startswith("B"):  # of both orders, and at the depth
            sign = 1 if name == "Bp" else -1
            length = hypot(*(mpf(x) + sign * mpf(y) for x, y in zip(*vectors, strict=True)))
            expected *= 2 * cosh(length * (c + mpf(depth))) / cosh(length * mpf(depth))
        floor = 1e-15 * natural.get(name[0], k / abs(math.tanh(k * depth)) ** 2)
        assert abs(found[name] - expected) <= 1e-9 * abs(expected) + floor, (name, vectors, c)


def test_functions_of_dispersion_relations_are_those_of_numpy() -> None:
    algebra = Algebra(Tape())
    wave = WaveNumber(*algebra.block("w", 5), algebra)
    found = [wave.sqrt(wave.k), wave.tanh(wave.kx), wave.exp(wave.ky), wave.gravity_waves, gravity_waves(wave)]
    kx, ky, k, g, h = numbers = np.array([0.3, -0.4, 0.5, 9.81, 1.7])
    values = evaluate(algebra.tape, [item.ref for item in found], {"w": numbers})
    w = math.sqrt(g * k * math.tanh(k * h))
    assert values == pytest.approx([math.sqrt(k), math.tanh(kx), math.exp(ky), w, w], rel=1e-15)


def test_operations_of_a_pair_are_within_their_budgets() -> None:
    """Every addition, product, quotient and function counted as one; committed counts, so that a change is seen."""
    tapes = [PairTape(Case(*flags)) for flags in itertools.product((False, True), repeat=3)]
    cases = [(made.case.finite, made.case.spread, made.case.surface) for made in tapes]
    counts = dict(zip(cases, (made.tape.counts(made.pair).statements for made in tapes), strict=True))
    assert counts == {
        (False, False, False): 35,
        (False, False, True): 27,
        (False, True, False): 116,
        (False, True, True): 96,
        (True, False, False): 144,
        (True, False, True): 93,
        (True, True, False): 215,
        (True, True, True): 155,
    }
    assert counts[False, False, True] <= 40
    assert counts[True, True, True] <= 160
