"""Designs: the point of each sample in the unit cube, by the number of the sample alone.

Sample k of a study is the same on any machine, by any method and in any order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.errors import Problem, UsageError
from eomgen.products.ensembles.distributions import Distribution

#: From the first sample and a number of samples to the points of these samples, (n, d), within (0, 1).
Points = Callable[[int, int], Array]


@dataclass(frozen=True)
class Design:
    """Points of all samples.

    Attributes
    ----------
    name : of ``DESIGNS``, or ``grid`` or ``table``
    samples : how many there are
    values : from the first sample and a number of samples to the varied quantities, (n, d)
    """

    name: str
    samples: int
    values: Callable[[int, int], Array]


def _monte_carlo(samples: int, dimensions: int, seed: int) -> Points:
    blocks = -(-dimensions // 4)  # a block of Philox is four numbers, and each sample begins with a new one

    def points(first: int, count: int) -> Array:
        generator = np.random.Philox(seed).advance(first * blocks)
        return np.random.Generator(generator).random((count, 4 * blocks))[:, :dimensions]

    return points


def _latin_hypercube(samples: int, dimensions: int, seed: int) -> Points:
    from scipy.stats import qmc  # noqa: PLC0415  # it takes half a second, and random numbers need none of it

    every = qmc.LatinHypercube(dimensions, seed=np.random.default_rng(seed)).random(samples)
    return lambda first, count: every[first : first + count]


def _sequence_points(kind: str, dimensions: int, seed: int, first: int, count: int) -> Array:
    from scipy.stats import qmc  # noqa: PLC0415  # it takes half a second, and random numbers need none of it

    engine = getattr(qmc, kind)(dimensions, seed=np.random.default_rng(seed))
    if first:
        engine.fast_forward(first)
    elif count > 1:
        # the first point alone: SciPy warns of blocks of other sizes than powers of two, which these are part of
        return np.concatenate([engine.random(1), engine.random(count - 1)])
    return np.asarray(engine.random(count))


def _saltelli(samples: int, dimensions: int, seed: int) -> Points:
    """Return the points of Saltelli's design by number: first A, then B, then A with one column after the other from B,
    `samples` points each (Comput. Phys. Commun. 145 (2002) 280)."""

    def points(first: int, count: int) -> Array:
        numbers = np.arange(first, first + count)
        part, row = numbers // samples, numbers % samples
        begin = int(row.min()) if part[0] == part[-1] else 0
        end = int(row.max()) + 1 if part[0] == part[-1] else samples
        both = _sequence_points("Sobol", 2 * dimensions, seed, begin, end - begin)[row - begin]
        result = np.where((part == 1)[:, np.newaxis], both[:, dimensions:], both[:, :dimensions])
        mixed = np.flatnonzero(part > 1)
        result[mixed, part[mixed] - 2] = both[mixed, dimensions + part[mixed] - 2]
        return np.asarray(result)

    return points


#: Designs by name, from a number of samples, of dimensions and a seed. ``latin_hypercube`` depends on the number of
#: samples; for all other designs the first samples of a larger design are the same.
DESIGNS: dict[str, Callable[[int, int, int], Points]] = {
    "monte_carlo": _monte_carlo,
    "latin_hypercube": _latin_hypercube,
    "sobol": lambda _, dimensions, seed: partial(_sequence_points, "Sobol", dimensions, seed),
    "halton": lambda _, dimensions, seed: partial(_sequence_points, "Halton", dimensions, seed),
    "saltelli": _saltelli,
}
#: Designs that follow from the varied quantities.
OTHER_DESIGNS = ("grid",)
#: Designs that are balanced if the number of samples is a power of two, with their largest number of dimensions.
_BALANCED = {"sobol": 21201, "saltelli": 21201 // 2}


def random_design(name: str, distributions: Sequence[Distribution], samples: int, seed: int) -> Design:
    """Return a design of random points, an axis for each distribution, as values by the quantiles of the distributions.

    The base number ``samples`` gives samples (d + 2) points in the design ``saltelli`` of d axes.

    Parameters
    ----------
    name : str
        Name in ``DESIGNS``.
    distributions : sequence of Distribution
        One for each of the d axes.
    samples, seed : int
        Base number of samples, and seed from 0 on.

    Raises
    ------
    UsageError
        For more dimensions than a design has, and more samples than a Latin hypercube holds.
    """
    dimensions = len(distributions)
    if dimensions > (most := _BALANCED.get(name, dimensions)):
        fault = f"{name} has {most} dimensions at most, not {dimensions} [E0656]"
        raise UsageError(Problem("design", fault, "monte_carlo"))
    if name == "latin_hypercube" and samples * dimensions > 10**8:
        fault = f"{name} makes all of its {samples * dimensions} numbers at once, {10**8} at most [E0657]"
        raise UsageError(Problem("samples", fault, "fewer of them, or sobol"))
    points = DESIGNS[name](samples, dimensions, seed)

    def values(first: int, count: int) -> Array:
        eps = np.finfo(float).epsneg
        inside = np.clip(points(first, count), 0.5 * eps, 1.0 - eps)
        columns = [item.quantiles(inside[:, k]) for k, item in enumerate(distributions)]
        return np.stack(columns, axis=-1) if columns else np.zeros((count, 0))

    return Design(name, samples * (dimensions + 2) if name == "saltelli" else samples, values)


def note_on_balance(name: str, samples: int) -> str:
    """Return a note on a number of samples that a design is not made for; empty if there is none."""
    if name not in _BALANCED or samples & (samples - 1) == 0:
        return ""
    return f"{name} is balanced for a power of two: {1 << (samples.bit_length() - 1)} or {1 << samples.bit_length()}"


def grid_design(names: Sequence[str], distributions: Sequence[Distribution]) -> Design:
    """Return the design of all combinations of the levels of lists; the last list varies fastest. `names` are for
    messages.

    Raises
    ------
    UsageError
        For a distribution that has no levels.
    """
    for name, item in zip(names, distributions, strict=True):
        if not item.levels:
            fault = f"a grid needs lists of values, and {item.text} is not a list [E0658]"
            raise UsageError(Problem(f"vary {name}", fault, "linspace(low, high, count), or values(1, 2, 4)"))
    sizes = [len(item.levels) for item in distributions]

    def values(first: int, count: int) -> Array:
        places = np.unravel_index(np.arange(first, first + count), sizes)
        return np.stack([np.array(item.levels)[row] for item, row in zip(distributions, places, strict=True)], axis=-1)

    return Design("grid", math.prod(sizes), values)
