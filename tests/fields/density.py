"""Counts of objects in cells under a lognormal density field: the posterior of the benchmarks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache, partial

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.fields import CellEnergy, FieldPosterior, LinearOperator, Mesh, lognormal_amplitude, poisson
from eomgen.products.fields.posteriors.cells import _compile
from eomgen.toolchain.builder import Builder


@pytest.fixture(scope="module", autouse=True)
def optimised() -> Iterator[None]:
    """Compile as users do: gradients take a sixth of the time then, and the C of a cell is short."""
    _compile.cache_clear()
    with pytest.MonkeyPatch.context() as changed:
        changed.setattr("eomgen.products.fields.posteriors.cells.Builder", partial(Builder, "fast"))
        yield


CELL = 4.8828125  # Mpc/h


def power(k: Array) -> Array:
    """Return the linear power spectrum without wiggles of Eisenstein and Hu (ApJ 496 (1998) 605), (Mpc/h)^3."""
    matter, baryons, h, tilt, at_8, growth = 0.307115, 0.048206, 0.6777, 0.96, 0.8288, 0.7447
    w, part = matter * h**2, baryons / matter
    horizon = 44.5 * math.log(9.83 / w) / math.sqrt(1.0 + 10.0 * (baryons * h**2) ** 0.75)
    less = 1.0 - 0.328 * math.log(431.0 * w) * part + 0.38 * math.log(22.3 * w) * part**2

    def shape(k: Array) -> Array:
        effective = matter * h * (less + (1.0 - less) / (1.0 + (0.43 * k * h * horizon) ** 4))
        q = k * (2.7255 / 2.7) ** 2 / effective
        low = np.log(2.0 * math.e + 1.8 * q)
        return np.asarray(k**tilt * (low / (low + (14.2 + 731.0 / (1.0 + 62.5 * q)) * q**2)) ** 2)

    grid = np.geomspace(1e-5, 50.0, 20001)
    x = 8.0 * grid
    window = 3.0 * (np.sin(x) - x * np.cos(x)) / x**3
    variance = np.trapezoid(shape(grid) * window**2 * grid**3 / (2.0 * math.pi**2), np.log(grid))
    return np.asarray((at_8 * growth) ** 2 / variance * shape(k))


@cache
def density(cells: int) -> LinearOperator:
    mesh = Mesh((cells,) * 3, cells * CELL)
    return lognormal_amplitude(mesh, power)


def counted(cells: int, mean: float, seed: int = 1, response: Array | None = None) -> tuple[FieldPosterior, Array]:
    """Return the posterior of counts of a draw of the prior, and the white spectrum that was drawn."""
    operator = density(cells)
    mesh, variance = operator.mesh, operator.variance
    stream = np.random.Generator(np.random.Philox(seed))
    truth = mesh.white(stream)
    intensity = mean * np.exp(operator.apply(truth) - variance / 2.0)
    data = {"counts": stream.poisson(intensity if response is None else response * intensity).astype(float)}
    if response is not None:
        data["response"] = response
    energy = poisson(mean, variance, response=response is not None)
    return FieldPosterior(mesh, energy, {"s": operator}, data), truth


def alone(cells: int) -> FieldPosterior:
    """Return the prior of the density field without data."""
    return FieldPosterior(density(cells).mesh, CellEnergy("0"), {"s": density(cells)})
