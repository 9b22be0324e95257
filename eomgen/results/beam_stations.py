"""Frames along bent beams, for pictures: from the beam's frame and its elastic coordinates, as exact as the model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import SE3, SO3

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def axes_of(model: CompiledModel) -> list[dict[str, Any]]:
    """Return the axes of a model's beams as JSON types: fields of ``BeamAxis``, and the first of their coordinates."""
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
    """Return the number of the frame at a place of the undeformed beam, with the place in that frame.

    There is a frame at each place to which the scene attaches something.
    """
    number = int(np.argmin(np.abs(np.array(axis["x"]) - position[0])))
    return number, [position[0] - axis["x"][number], *position[1:]]
