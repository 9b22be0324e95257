"""Axes of beams for pictures: frames along each beam as functions of its elastic coordinates, as numbers.

They are the stations of ``tree.beam_stations`` at evenly spaced places and wherever something is attached. Whoever
draws a motion knows the coordinates and the beam's frame, so no function is compiled for them.
"""

from __future__ import annotations

import numpy as np

from eomgen.mechanics.tree.beam_body import ElasticBody
from eomgen.mechanics.tree.beam_fields import DEFLECTS, ROTATIONS
from eomgen.mechanics.tree.links import Tree
from eomgen.system.system import BeamAxis


def beam_axes(tree: Tree) -> tuple[BeamAxis, ...]:
    """Return the axes of all elastic bodies (links with elastic coordinates) of a tree, as numbers for drawings.
    Stations along each axis are 17 evenly spaced places and all places at which other bodies or points are attached."""
    return tuple(
        _axis(link.name, link.elastic, {x for body, x in tree.stations if body == link.name})
        for link in tree.links
        if link.elastic is not None
    )


def _axis(name: str, body: ElasticBody, attached: set[float]) -> BeamAxis:
    """Return a beam's axis as numbers: places, m, and the effect of the elastic coordinates on each place.

    Per place there are the deflections and the rotation vectors, (3, n) each, in beam axes per unit of each of the n
    coordinates; and the shortening as coefficients of products of two coordinates, zero without ``beam.stiffening``.
    ``attached`` holds places, m, in addition to the evenly spaced places.
    """
    beam, integrals = body.beam, body.mass.integrals
    places = sorted(attached.union(np.linspace(beam.start, beam.start + beam.length, 17).tolist()))
    stations = integrals.along(places)
    shape = (len(places), 3, len(integrals.kinds))
    deflections, rotations = np.zeros(shape), np.zeros(shape)
    for k, kind in enumerate(integrals.kinds):
        values, slopes = ([getattr(station, field)[k] for station in stations] for field in ("value", "slope"))
        if kind in DEFLECTS:
            deflections[:, DEFLECTS[kind], k] = values
        if kind in ROTATIONS:
            axis, sign = ROTATIONS[kind]
            rotations[:, axis, k] = sign * np.array(values if kind == "torsion" else slopes)
    shortening = np.array([station.shortening for station in stations]) * (1.0 if beam.stiffening else 0.0)
    pairs = [(k, j) for k, j in np.argwhere(shortening.any(axis=0)).tolist() if k <= j]
    return BeamAxis(
        name,
        tuple(places),
        tuple(tuple(map(tuple, part)) for part in deflections.tolist()),
        tuple(tuple(map(tuple, part)) for part in rotations.tolist()),
        tuple(pairs),
        tuple(tuple(float(entry[k, j]) * (0.5 if k == j else 1.0) for k, j in pairs) for entry in shortening),
    )
