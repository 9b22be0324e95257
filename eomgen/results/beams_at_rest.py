"""Displacements against an initial shape, and section loads, of geometrically exact beams at rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.initial_state import initial_state
from eomgen.compiled.section_loads import SectionLoads
from eomgen.lie import numeric
from eomgen.lie.groups import SO3
from eomgen.results.scenery import poses_and_scenery

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def beams_at_rest(
    model: CompiledModel,
    initial: Mapping[str, Any] | None,
    q: Array,
    t: float,
    p: Array,
    loads: Mapping[str, SectionLoads],
) -> dict[str, dict[str, Any]]:
    """Return by beam, as JSON types, displacements, rotations and section loads, with the largest ones.

    Parameters
    ----------
    initial : values of the initial shape that differ from the scene's
    q : (nq,), the shape at rest
    p : (np,) parameters
    loads : at rest

    Returns
    -------
    mapping
        ``x`` of the nodes, m; ``displacement``, m, and ``rotation``, a vector in rad, in world axes, (nodes, 3);
        ``moment``, N m, and ``force``, N, at both ends of each element, (n, 2, 3), in section axes; ``end``,
        ``first_section``, ``last_section``, ``largest_displacement``, ``largest_moment``, ``largest_force``
    """
    start = initial_state(model, initial, p).q
    seen = poses_and_scenery(model, np.full(2, t), np.stack([start, q]), p)
    result = {}
    for nodes in model.description.exact_beams:
        of_beam = loads[nodes[0]]
        poses, x = np.stack([seen.poses[node] for node in nodes], axis=1), of_beam.nodes
        moved = poses[1, :, 4:] - poses[0, :, 4:]
        turned = _turns(poses[0, :, :4], poses[1, :, :4])
        sizes = np.linalg.norm(moved, axis=1)
        most = int(np.argmax(sizes))
        entry: dict[str, Any] = {
            "x": x.tolist(),
            "displacement": moved.tolist(),
            "rotation": turned.tolist(),
            "end": {"x": float(x[-1]), "displacement": moved[-1].tolist(), "rotation": turned[-1].tolist()},
            "largest_displacement": {"x": float(x[most]), "size": float(sizes[most])},
            "first_section": {"x": float(x[0])},
            "last_section": {"x": float(x[-1])},
        }
        for quantity, ends in (("moment", of_beam.moment_at_ends), ("force", of_beam.force_at_ends)):
            entry[quantity] = ends.tolist()
            element, end = np.unravel_index(int(np.argmax(np.linalg.norm(ends, axis=-1))), ends.shape[:-1])
            size = float(np.linalg.norm(ends[element, end]))
            entry[f"largest_{quantity}"] = {"x": float(x[element + end]), "size": size}
            entry["first_section"][quantity] = ends[0, 0].tolist()
            entry["last_section"][quantity] = ends[-1, 1].tolist()
        result[nodes[0]] = entry
    return result


def _turns(before: Array, after: Array) -> Array:
    """Return rotation vectors, rad, in world axes, of turns between quaternions (nodes, 4)."""
    relative = numeric.compose(SO3, after, numeric.inverse(SO3, before))
    relative[relative[:, 0] < 0.0] *= -1.0
    return numeric.log(SO3, relative)
