"""Bent beams in pictures: frames along their axes, as exact as the model, outlines of sections, and the frame nearest
to a place.

A pose between two nodes is H_A exp(share log(H_A^-1 H_B)) on SE(3): Sonneville, Cardona and Bruls, Comput. Methods
Appl. Mech. Engrg. 268 (2014) 451.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import SE3, SO3

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


#: Principal moments that differ by less than this part of the largest are drawn as equal.
EQUAL = 1e-3
#: Half heights of sections in pictures, as parts of the beam's length.
_THINNEST, _THICKEST = 1.0 / 400.0, 1.0 / 30.0


def pieces_of(elements: int) -> int:
    """Return the number of pieces in which each element of a beam is drawn, given the number of elements: up to 8, for
    48 frames along the beam."""
    return min(max(-(-48 // elements), 1), 8)


def frames_along(poses: Mapping[str, Array], nodes: Sequence[str]) -> Array:
    """Return the poses along a beam, (nt, elements * pieces + 1, 7), from the poses (nt, 7) of its nodes, in order, by
    name."""
    pieces = pieces_of(len(nodes) - 1)
    parts = []
    for first, second in pairwise(poses[name] for name in nodes):
        relative = numeric.compose(SE3, numeric.inverse(SE3, first), second)
        relative[relative[:, 0] < 0.0, :4] *= -1.0
        screw = numeric.log(SE3, relative)
        parts += [numeric.compose(SE3, first, numeric.exp(SE3, share * screw)) for share in np.arange(pieces) / pieces]
    return np.stack([*parts, poses[nodes[-1]]], axis=1)


def outline(mass: float, inertia: Sequence[float], length: float) -> list[list[float]]:
    """Return the corners of a section in a picture, (n, 2): y and z, m.

    The section is the circle, or the rectangle, with the rotary inertia of a node, within limits for a picture: not
    thinner than a 400th of the beam's length nor thicker than a 15th.

    Parameters
    ----------
    mass : of a node, kg
    inertia : of a node, about x, y and z, kg m^2
    """
    about_y, about_z = (max(part, 0.0) / mass if mass > 0.0 else 0.0 for part in inertia[1:3])
    largest = max(about_y, about_z)

    def shown(half: float) -> float:
        return min(max(half, _THINNEST * length), _THICKEST * length)

    if abs(about_y - about_z) <= EQUAL * largest:
        radius = shown(2.0 * math.sqrt(largest))
        angles = [math.pi * corner / 8 for corner in range(16)]
        return [[radius * math.cos(angle), radius * math.sin(angle)] for angle in angles]
    # the larger side as drawn, the smaller side in proportion
    y, z = math.sqrt(3.0 * about_z), math.sqrt(3.0 * about_y)
    factor = shown(max(y, z)) / max(y, z)
    y, z = (max(factor * half, _THINNEST * length) for half in (y, z))
    return [[y, z], [-y, z], [-y, -z], [y, -z]]


def drawn_beams(
    beams: Sequence[Sequence[str]], bodies: Sequence[Mapping[str, Any]], lengths: Sequence[float]
) -> list[dict[str, Any]]:
    """Return nodes and outline of each beam as JSON types.

    Parameters
    ----------
    beams : names of the nodes of each
    bodies : with ``name``, ``mass`` and ``inertia`` (six numbers, xx, yy and zz first)
    lengths : of the beams, m
    """
    by_name = {body["name"]: body for body in bodies}
    result = []
    for nodes, length in zip(beams, lengths, strict=True):
        heaviest = max((by_name[node] for node in nodes), key=lambda body: body["mass"])  # one on the base has none
        result.append({"nodes": list(nodes), "outline": outline(heaviest["mass"], heaviest["inertia"], length)})
    return result


def axes_of(model: CompiledModel) -> list[dict[str, Any]]:
    """Return the axes of a model's modal beams as JSON types: the fields of ``BeamAxis``, and ``q_start``, the index of
    the beam's first coordinate."""
    begins = {factor.name: factor.q_start for factor in model.factors}
    return [{**axis, "q_start": begins[axis["name"]]} for axis in model.library.layout["axes"]]


def stations(axis: Mapping[str, Any], pose: Array, q: Array) -> Array:
    """Return the poses of the frames along a beam, (nt, p, 7), quaternion (to world axes) and position in the world.

    Parameters
    ----------
    axis : mapping
        Of ``axes_of``.
    pose : (nt, 7)
        Of the beam's frame.
    q : (nt, nq)
        The configuration at the same times.
    """
    deflections, rotations = np.array(axis["deflections"]), np.array(axis["rotations"])
    bent = q[:, axis["q_start"] : axis["q_start"] + deflections.shape[-1]]
    position = np.einsum("pik,tk->tpi", deflections, bent)
    position[..., 0] += axis["x"]
    if axis["pairs"]:
        first, second = np.transpose(axis["pairs"])
        position[..., 0] -= (bent[:, first] * bent[:, second]) @ np.transpose(axis["shortening"])
    turned = numeric.exp(SO3, np.einsum("pik,tk->tpi", rotations, bent))
    return numeric.compose(SE3, pose[:, None, :], np.concatenate([turned, position], axis=-1))


def nearest_station(axis: Mapping[str, Any], position: list[float]) -> tuple[int, list[float]]:
    """Return the index of the station nearest to a point along the axis, and the point's position in its frame.

    There is a station at each place to which the scene attaches something.

    Parameters
    ----------
    axis : axis as of ``axes_of``
    position : (3,) in the frame of the undeformed beam, m
    """
    number = int(np.argmin(np.abs(np.array(axis["x"]) - position[0])))
    return number, [position[0] - axis["x"][number], *position[1:]]
