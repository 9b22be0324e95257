"""Reading of constant orientations: a list of rotations, or a matrix."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.scene.geometry.rotations import is_rotation, rows, sequence, snapped_rotation
from eomgen.scene.reading.rotation_schema import Rotations
from eomgen.scene.reading.values import Values


def read_orientation(
    key: str, rotation: Rotations | None, orientation: Sequence[Sequence[float]] | None, values: Values
) -> tuple[tuple[float, float, float], ...]:
    """Return the rotation matrix from the keys ``rotation`` or ``orientation`` of an entry, own axes to the carrier's
    axes, right angles made exact; faults go to the report of ``values``."""
    if orientation is not None and rotation is not None:
        values.report.add(f"{key}.orientation", "orientation and rotation are both given", "one of them")
    if orientation is not None:
        matrix = np.array(orientation)
        if is_rotation(matrix):
            return rows(snapped_rotation(matrix))
        fault = "the matrix is not a rotation: orthonormal and right-handed to 1e-6"
        values.report.add(f"{key}.orientation", fault, "rotation")
        return rows(np.eye(3))
    return rows(sequence(values.constant_rotations(f"{key}.rotation", rotation or ()) or []))
