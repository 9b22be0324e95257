"""Regions in which a response passes a threshold: their most probable points, by searches from several places and from
samples that pass it, and samples about all of them.

Samples are drawn about each point, about the mean, and about the mean with so large a deviation that they come as far
as the nearest point: of a region without a point some of these see something. A sample that passes the threshold and is
hardly of the points' own samples starts another search.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy import special

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError
from eomgen.products.reliability.tails.distribution import FEWEST, Draws
from eomgen.products.reliability.tails.most_probable_point import FARTHEST, MostProbablePoint, descended
from eomgen.products.reliability.tails.quadratic_form import Response

#: Samples about the points for each one about the mean, at least.
_ABOUT_POINTS = 4
#: Searches from samples at most; share of a sample in the probability from which on it starts one; points of a ray.
_SEARCHES, _NOTABLE, _ALONG = 8, 0.02, 16
#: Ratio of the deviations of samples, one after the other, that look for a first passage.
_FARTHER = 1.5
#: Probability beyond a point, relative to all, that is left out, and distance of two points, in standard deviations.
_UNSEEN, _APART = 1e-3, 1.0


def draws_about(run: Callable[[Array], tuple[Array, ...]], centres: Array, seed: int) -> Draws:
    """Return samples about centres (c, n), about the mean, and about the mean with a deviation that reaches these.

    References
    ----------
    Owen, Zhou: Safe and effective importance sampling, J. Am. Stat. Assoc. 95 (2000): defensive mixtures.
    """
    count, size = centres.shape
    times = -(-_ABOUT_POINTS // count)
    reach = max(1.0, float(np.linalg.norm(centres, axis=1).min()) / np.sqrt(size))
    means = np.vstack([*([centres] * times), np.zeros((2, size))])
    return Draws(run, means, seed, np.append(np.ones(len(means) - 1), reach))


def all_centres(
    response: Response, points: Sequence[Array], threshold: float, *, above: bool, seed: int
) -> tuple[Array, Draws | None]:
    """Return points (c, n) about which the response passes a threshold, and samples about all of them.

    The samples are None if none of them passes it.

    Parameters
    ----------
    response : Response
    points : sequence of (n,)
        Known points.
    threshold : float
    above : bool
        Whether y > threshold is the passage, or y <= threshold.
    """
    centres = np.array(points) if points else _first_centre(response, threshold, above=above, seed=seed)
    if not len(centres):
        return centres, None
    searches = 0
    while True:
        draws = draws_about(lambda z: (response.values(z),), centres, seed)
        z, y, *_ = draws.first(FEWEST)
        passed = np.where(np.isnan(y), False, (y > threshold) == above)
        parts = draws.weights(z) * passed
        total = float(parts.sum())
        own = draws.shares(z)[:, :-2].sum(axis=1)
        order = np.argsort(-parts)
        new: Array | None = None
        for k in order[(parts[order] > _NOTABLE * total) & (own[order] < 0.5)].tolist():
            if searches == _SEARCHES:
                break
            searches += 1
            found = _nearest(response, z[k], threshold, above=above)
            likely = special.ndtr(-np.linalg.norm(found)) > _UNSEEN * total / len(z)
            if likely and np.linalg.norm(centres - found, axis=1).min() > _APART:
                new = found
                break
        if new is None:
            return centres, draws
        centres = np.vstack([centres, new])


def _first_centre(response: Response, threshold: float, *, above: bool, seed: int) -> Array:
    """Return a point that passes a threshold, (1, n), by samples that come farther and farther; (0, n) if none does."""
    reach = 1.0
    while reach * np.sqrt(response.size) <= max(FARTHEST, np.sqrt(response.size)):
        draws = Draws(lambda z: (response.values(z),), np.zeros(response.size), seed, np.array([reach]))
        z, y, *_ = draws.first(FEWEST)
        passed = z[np.where(np.isnan(y), False, (y > threshold) == above)]
        if len(passed):
            first = passed[np.argmin(np.linalg.norm(passed, axis=1))]
            return _nearest(response, first, threshold, above=above)[np.newaxis]
        reach *= _FARTHER
    return np.empty((0, response.size))


def _nearest(response: Response, point: Array, threshold: float, *, above: bool) -> Array:
    """Return a point near the mean that passes the threshold, from one that does: the most probable one if a search
    comes to it, else the first one of the ray from the mean."""
    ray = np.linspace(0.0, 1.0, _ALONG + 1)[1:, np.newaxis] * point
    y = response.values(ray)
    first = int(np.argmax((y > threshold) == above))
    begin: Array = ray[first]
    try:
        found = descended(response, begin, threshold, [])
    except EomgenError:  # a run without derivatives there
        found = None
    return begin if found is None else found.point


def searched_points(
    response: Response, threshold: float, starts: int, seed: int, distance: float = 1.0
) -> list[MostProbablePoint]:
    """Return most probable points of a threshold, the nearest first, by searches from random directions.

    Parameters
    ----------
    starts : int
        Number of directions, of which each is followed by its opposite.
    distance : float
        Of the starts from the mean.
    """
    directions = np.random.default_rng(seed).standard_normal((starts, response.size))
    directions *= distance / np.linalg.norm(directions, axis=1)[:, np.newaxis]
    found: list[MostProbablePoint] = []
    for begin in np.concatenate([directions, -directions]):
        point = descended(response, begin, threshold, found)
        if point is not None and all(np.linalg.norm(point.point - other.point) > _APART for other in found):
            found.append(point)
    return sorted(found, key=lambda one: float(np.linalg.norm(one.point)))
