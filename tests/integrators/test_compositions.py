"""Compositions of drifts and kicks: coefficients, orders, stability limits and errors against published and measured
values, and what is refused. Orders of compiled steps are in test_symplectic_compositions.py."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.integrators.compositions import Composition, composition_named, compositions, leapfrog_recursion
from tests.oracles.orders import order_of

EVERY = [*compositions("drift"), *compositions("kick")]

#: Measured with step matrices of the oscillator in another program: order, gradients, h_max, and sqrt(rho)/h^p at h of
#: 0.1.
MEASURED = {
    "leapfrog": (2, 1, 2.0, 0.1770),
    "minimum_norm2": (2, 2, 2.55315, 1.70e-3),
    "bcss3": (2, 3, 4.66185, 3.57e-3),
    "yoshida4": (4, 3, 1.57340, 5.42e-2),
    "suzuki4": (4, 5, 2.72097, 5.07e-3),
    "creutz_gocksch4_3": (4, 7, 2.96526, 1.69e-3),
    "creutz_gocksch4_4": (4, 9, 3.04784, 8.19e-4),
    "omf4": (4, 5, 2.97634, 1.37e-5),
    "yoshida6": (6, 9, 1.59537, 6.48e-2),
    "suzuki6": (6, 25, 3.12205, 1.46e-5),
}


@pytest.mark.parametrize("name", MEASURED)
def test_stability_limits_and_errors_are_those_that_were_measured_elsewhere(name: str) -> None:
    order, gradients, limit, at_tenth = MEASURED[name]
    found = composition_named(name)
    assert (found.order, found.gradients) == (order, gradients)
    assert found.stability_limit == pytest.approx(limit, abs=1e-5)
    matrix = found.oscillator(np.array(0.1))
    rho = -((matrix[0, 1] + matrix[1, 0]) ** 2) / (2 * matrix[0, 1] * matrix[1, 0])
    assert math.sqrt(rho) / 0.1**order == pytest.approx(at_tenth, rel=5e-3)
    # the limit of the same for h to 0; omf4 is small at order 4 and 9 per cent off it at 0.1
    assert found.error_constant == pytest.approx(at_tenth, rel=0.1 if name == "omf4" else 0.03)


def test_leapfrog_has_its_closed_forms() -> None:
    leapfrog = composition_named("leapfrog")
    assert leapfrog.error_constant == pytest.approx(1 / math.sqrt(32), rel=1e-15)
    step = 0.7
    assert np.trace(leapfrog.oscillator(np.array(step))) == pytest.approx(2 - step**2, rel=1e-15)


@pytest.mark.parametrize("method", EVERY, ids=lambda method: f"{method.name}-{method.first}")
def test_steps_are_symmetric_and_their_drifts_and_kicks_sum_up(method: Composition) -> None:
    assert method.fractions == method.fractions[::-1]
    assert abs(math.fsum(method.drifts) - 1) <= 1e-15
    assert abs(math.fsum(method.kicks) - 1) <= 1e-15
    assert len(method.drifts) - len(method.kicks) == (1 if method.first == "drift" else -1)


def test_recursions_have_the_published_fractions() -> None:
    assert set(composition_named("creutz_gocksch4_4").kicks) == {1 / 6, -1 / 3}  # rational: exactly
    for forward, order, ahead, back in (
        (1, 4, 1.351207191959658, 1.702414383919315),
        (2, 4, 0.414490771794376, 0.657963087177503),
        (3, 4, 0.239069765742321, 0.434418594453928),
    ):
        kicks = leapfrog_recursion(order, forward).kicks
        assert kicks == pytest.approx((*[ahead] * forward, -back, *[ahead] * forward), abs=1e-15)
    for forward, ahead, back in ((1, 1.174671758089364, 1.349343516178727), (2, 0.373065827733273, 0.492263310933091)):
        blocks = np.reshape(leapfrog_recursion(6, forward).kicks, (2 * forward + 1, -1)).sum(axis=1)
        assert blocks == pytest.approx((*[ahead] * forward, -back, *[ahead] * forward), abs=1e-14)
    assert leapfrog_recursion(10, 1).order == 10


def test_orders_are_found_from_coefficients_alone() -> None:
    assert order_of((0.0, 1.0, 1.0)) == 1  # symplectic Euler
    assert order_of((0.5, 1.0, 0.5)) == 2
    assert order_of((0.5, 0.9, 0.5)) == 0
    # Ruth's third order, which is not symmetric
    assert order_of((7 / 24, 2 / 3, 3 / 4, -2 / 3, -1 / 24, 1.0)) == 3
    for method in compositions():
        if method.gradients < 30:
            assert order_of(method.fractions, method.order + 2) == method.order


def test_parameters_of_the_other_version_of_omf4_have_another_order() -> None:
    drifts, kicks = (0.08398315262876693, 0.2539785108410595), (0.6822365335719091, -0.03230286765269967)
    half = [drifts[0], kicks[0], drifts[1], kicks[1], 0.5 - sum(drifts), 1 - 2 * sum(kicks)]
    assert order_of((*half, *half[-2::-1])) == 2


def test_names_that_are_not_there_are_refused() -> None:
    with pytest.raises(UsageError, match="composition: the method bcss2 was removed; try: bcss3, with a step half as"):
        composition_named("bcss2")
    with pytest.raises(UsageError, match="there is no composition 'yosida4'; try: yoshida4"):
        composition_named("yosida4")


def test_adjacent_parts_of_steps_are_merged() -> None:
    for method in (composition_named("suzuki4"), composition_named("omf4", "kick")):
        parts = list(method.parts(3))
        assert all(before[0] != after[0] for before, after in itertools.pairwise(parts))
        assert len(parts) == 3 * 2 * method.gradients + 1
        for part in ("drift", "kick"):
            assert math.fsum(fraction for kind, fraction in parts if kind == part) == pytest.approx(3, rel=1e-14)
    assert list(composition_named("leapfrog").parts(2)) == [
        ("drift", 0.5), ("kick", 1.0), ("drift", 1.0), ("kick", 1.0), ("drift", 0.5),
    ]  # fmt: skip


def test_kicks_are_at_the_times_that_drifts_have_come_to() -> None:
    """A force that depends on time alone is integrated exactly up to the order: Int t^3 = 1/4 at order 4."""
    for first in ("drift", "kick"):
        for name, order in (("leapfrog", 2), ("suzuki4", 4), ("omf4", 4), ("yoshida6", 6)):
            method = composition_named(name, "drift" if first == "drift" else "kick")
            for power in range(order):
                moment = sum(k * t**power for k, t in zip(method.kicks, method.kick_times, strict=True))
                assert moment == pytest.approx(1 / (power + 1), abs=1e-13)


def test_products_of_leapfrogs_are_known_as_such() -> None:
    for name, sizes in (("leapfrog", 1), ("yoshida4", 3), ("suzuki6", 25), ("kahan_li6", 9), ("kahan_li8", 17)):
        for first in ("drift", "kick"):
            leapfrogs = composition_named(name, "drift" if first == "drift" else "kick").leapfrogs
            assert len(leapfrogs) == sizes and math.fsum(leapfrogs) == pytest.approx(1, abs=1e-14)
    for name in ("minimum_norm2", "bcss3", "omf4", "blanes_moan4", "blanes_moan6"):
        assert composition_named(name).leapfrogs == ()
