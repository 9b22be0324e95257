"""Trajectories of fields by compositions: orders of their energy errors, ways back, the errors of free oscillators."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, Literal

import numpy as np
import pytest

from eomgen.fields import FieldPosterior, follow
from eomgen.integrators.compositions import Composition, composition_named, compositions
from tests.fields.density import alone, counted, density, optimised

__all__ = ["optimised"]

FIRSTS: tuple[Literal["drift", "kick"], ...] = ("drift", "kick")


def momenta(posterior: FieldPosterior, seed: int, mass: Any) -> Any:
    white = posterior.mesh.white(np.random.Generator(np.random.Philox(seed)))
    return white if mass is None else white * np.sqrt(mass)


def energy_error(
    posterior: FieldPosterior, method: Composition, step: float, steps: int, x: Any, p: Any, m: Any
) -> float:
    x, p, inverse = x.copy(), p.copy(), None if m is None else 1.0 / m
    before = posterior.energy(x) + 0.5 * posterior.norm(p, inverse)
    follow(posterior, method, step, steps, x, p, inverse)
    return posterior.energy(x) + 0.5 * posterior.norm(p, inverse) - before


@cache
def rms(name: str, step: float, trajectories: int, first: Literal["drift", "kick"] = "drift") -> float:
    """Return the deviation of the energy error from 0 after a time of 1.2 from a typical field."""
    posterior, truth = counted(16, 0.04)
    mass = posterior.mass()
    method = composition_named(name, first)
    errors = [
        energy_error(posterior, method, step, round(1.2 / step), truth, momenta(posterior, 100 + seed, mass), mass)
        for seed in range(trajectories)
    ]
    return math.sqrt(np.mean(np.square(errors)))


ORDERS = {
    "leapfrog": (2, 0.1, 0.05),
    "minimum_norm2": (2, 0.1, 0.05),
    "yoshida4": (4, 0.05, 0.05),
    "suzuki4": (4, 0.15, 0.05),
    "creutz_gocksch4_3": (4, 0.15, 0.05),
    "omf4": (4, 0.15, 0.3),
    "blanes_moan4": (4, 0.15, 0.15),
    "yoshida6": (6, 0.1, 0.25),
    "suzuki6": (6, 0.3, 0.25),
}


@pytest.mark.parametrize("name", ORDERS)
def test_energy_errors_have_the_order_of_the_method(name: str) -> None:
    order, step, within = ORDERS[name]
    assert math.log2(rms(name, step, 8) / rms(name, step / 2, 8)) == pytest.approx(order, abs=within)


def test_every_composition_goes_back_the_way_it_came() -> None:
    posterior, _ = counted(8, 0.3)
    mass = posterior.mass()
    assert mass is not None
    inverse = 1.0 / mass
    start, p0 = momenta(posterior, 1, None), momenta(posterior, 2, mass)
    seen = 0
    for first in FIRSTS:
        for method in compositions(first):
            if method.gradients > 20:
                continue
            step = 0.1 if seen % 2 else -0.1
            x, p = start.copy(), p0.copy()
            follow(posterior, method, step, 4, x, p, inverse)
            assert np.abs(x - start).max() > 0.1
            p *= -1.0
            follow(posterior, method, step, 4, x, p, inverse)
            assert np.abs(x - start).max() <= 1e-12 and np.abs(p + p0).max() <= 1e-12, method.name
            seen += 1
    assert seen >= 20


@pytest.mark.parametrize(("step", "steps"), [(0.3, 5), (0.6, 3), (1.0, 2)])
def test_errors_of_free_oscillators_have_their_closed_form(step: float, steps: int) -> None:
    posterior = alone(16)
    method = composition_named("leapfrog")
    angle = math.acos(1.0 - step**2 / 2)
    n = posterior.mesh.size
    mean = n * math.sin(steps * angle) ** 2 * step**4 / (32.0 * (1.0 - step**2 / 4))
    errors = [
        energy_error(
            posterior, method, step, steps, momenta(posterior, 2 * k, None), momenta(posterior, 2 * k + 1, None), None
        )
        for k in range(150)
    ]
    assert abs(np.mean(errors) - mean) <= 3.0 * np.std(errors) / math.sqrt(len(errors))
    assert np.mean(errors) > 4.0 * np.std(errors) / math.sqrt(len(errors))  # so the test can tell it from nothing


#: First trajectory of a time of 1.2 from a field of 0: dH = kappa n step^p (research dossier, A4, to 2 or 3 digits),
#: and within what part of it figures are held on 32^3 cells. Free oscillators have sin(time)^2/8 for leapfrogs.
KAPPA = {
    ("leapfrog", "drift"): (-0.103, 0.03), ("leapfrog", "kick"): (0.102, 0.03), ("yoshida4", "drift"): (0.033, 0.03),
    ("yoshida4", "kick"): (-0.030, 0.03), ("suzuki4", "drift"): (0.0029, 0.03), ("suzuki4", "kick"): (-0.0029, 0.04),
    ("minimum_norm2", "drift"): (-1.13e-3, 0.03), ("minimum_norm2", "kick"): (8.7e-4, 0.07),
}  # fmt: skip  # a table


def first_error(cells: int, name: str, first: Literal["drift", "kick"], trajectories: int) -> float:
    """Return kappa as a mean over momenta, which are twice as many with their negatives: odd parts drop out."""
    method = composition_named(name, first)
    posterior, _ = counted(cells, 0.04)
    mass = posterior.mass()
    step = 0.1 if method.order == 2 else 0.15
    zero = np.zeros(density(cells).mesh.half, complex)
    errors = []
    for k in range(trajectories):
        p = momenta(posterior, k, mass)
        errors += [energy_error(posterior, method, step, round(1.2 / step), zero, sign * p, mass) for sign in (1, -1)]
    return float(np.mean(errors)) / (cells**3 * step**method.order)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "first"), KAPPA)
def test_barriers_are_those_of_the_dossier(name: str, first: Literal["drift", "kick"]) -> None:
    kappa, within = KAPPA[name, first]
    assert first_error(32, name, first, 6) == pytest.approx(kappa, rel=within)
