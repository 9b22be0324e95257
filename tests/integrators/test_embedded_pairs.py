"""Embedded pairs are data of their orders, and a new row is a method on every group."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction as F
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.integrators.families import embedded_pair, partitioned, register
from eomgen.integrators.families.embedded_pair import DORMAND_PRINCE
from eomgen.integrators.families.register import method_named
from eomgen.integrators.families.runge_kutta import (
    RUNGE_KUTTA_MUNTHE_KAAS_4,
    EmbeddedPair,
    real_stability,
    strictly_lower,
)
from tests.integrators.similar_scenes import rods
from tests.oracles.orders import density, order_of_tableau, rooted_trees, weight_conditions

SCENE = Path(__file__).parents[2] / "examples" / "spherical_pendulum" / "scene.toml"
BOGACKI_SHAMPINE = EmbeddedPair(
    name="rk23",
    source="Bogacki and Shampine 1989",
    order=3,
    embedded_order=2,
    A=strictly_lower((), (F(1, 2),), (F(0), F(3, 4)), (F(2, 9), F(1, 3), F(4, 9))),
    b=(F(2, 9), F(1, 3), F(4, 9), F(0)),
    b_hat=(F(7, 24), F(1, 4), F(1, 3), F(1, 8)),
    c=(F(0), F(1, 2), F(3, 4), F(1)),
    extension_source="cubic of Hermite",
    extension=((F(1), F(-4, 3), F(5, 9)), (F(0), F(1), F(-2, 3)), (F(0), F(4, 3), F(-8, 9)), (F(0), F(-1), F(1))),
)


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    for module in (embedded_pair, partitioned):
        monkeypatch.setattr(module, "PAIRS", (DORMAND_PRINCE, BOGACKI_SHAMPINE))
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path))
    register._own_row.cache_clear()
    yield
    register._own_row.cache_clear()


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("constrained", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_new_row_has_its_order_on_the_rotation_group(constrained: bool) -> None:
    method, known = ("rk23_partitioned", "rk45_partitioned") if constrained else ("rk23", "rk45")
    model = eomgen.build(rods("R3xSO3") if constrained else SCENE, method=method)
    assert any(factor.group == "SO3" for factor in model.factors)
    start = {} if constrained else {"initial": {"q": [1.0, 0.0, 0.0, 0.0], "v": [2.0, -1.0, 3.0]}}
    exact = model.simulate(0.2, 0.02, method=known, tolerance=1e-12, error_estimate=False, **start)
    errors = []
    for step in (0.004, 0.002):
        held = {"largest_step": step}
        run = model.simulate(0.2, 0.02, method=method, tolerance=0.1, settings=held, error_estimate=False, **start)
        assert run.success
        assert run.stats["own_steps"] == pytest.approx(0.2 / step, rel=0.02)
        errors.append(np.abs(run.q - exact.q).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.15)


@pytest.mark.usefixtures("registered")
def test_a_new_row_has_an_order_a_source_and_an_alternative() -> None:
    method, partitioned = method_named("rk23", tolerance=1e-4), method_named("rk23_partitioned")
    assert (method.order, method.source.partition(";")[0]) == (3, "Bogacki and Shampine 1989")
    assert [need.alternative for need in partitioned.needs] == ["rk23"]


@pytest.mark.parametrize("pair", [*embedded_pair.PAIRS, BOGACKI_SHAMPINE], ids=lambda pair: pair.name)
def test_pairs_and_their_extensions_have_their_orders(pair: EmbeddedPair) -> None:
    """Weights at the fraction s of a step are those of s^order, to the order of the extension; at 1 they are b."""
    assert order_of_tableau(pair.A, pair.b, pair.c) == pair.order
    assert order_of_tableau(pair.A, pair.b_hat, pair.c) == pair.embedded_order < pair.order
    assert pair.A[-1] == pair.b and pair.c[-1] == 1
    assert tuple(map(sum, pair.extension)) == pair.b
    for power, weights in enumerate(zip(*pair.extension, strict=True), 1):
        for order in range(1, len(pair.extension[0]) + 1):
            for found, target in weight_conditions(pair.A, pair.c, weights, order):
                assert found == (target if order == power else 0)


def test_trees_are_as_many_and_as_dense_as_published() -> None:
    """Butcher 2016, section 300: 1, 1, 2, 4, 9, 20, 48 trees of 1 to 7 vertices."""
    assert [len(rooted_trees(order)) for order in range(1, 8)] == [1, 1, 2, 4, 9, 20, 48]
    assert sorted(density(tree) for tree in rooted_trees(4)) == [4, 8, 12, 24]


def test_real_stability_follows_from_the_tableau() -> None:
    """Hairer and Wanner 1996, table IV.2.1: 2, 2, 2.51, 2.78 for orders 1 to 4 in as many stages; 3.31 for rk45."""
    zero = (F(0),)
    assert real_stability((zero,), (F(1),)) == pytest.approx(2.0, abs=1e-12)
    assert real_stability(strictly_lower((), (F(1),)), (F(1, 2), F(1, 2))) == pytest.approx(2.0, abs=1e-12)
    assert real_stability(BOGACKI_SHAMPINE.A, BOGACKI_SHAMPINE.b) == pytest.approx(2.5127, abs=1e-4)
    assert RUNGE_KUTTA_MUNTHE_KAAS_4.real_stability == pytest.approx(2.785293563405282, abs=1e-12)
    assert method_named("rk4_partitioned").real_stability == RUNGE_KUTTA_MUNTHE_KAAS_4.real_stability
    assert method_named("rk45").real_stability == pytest.approx(3.3066, abs=1e-4)
