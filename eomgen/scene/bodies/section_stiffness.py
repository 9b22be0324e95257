"""Conditions on the stiffness of a section: symmetric, so that it has a potential, and positive definite."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.scene.bodies.cosserat import CONSTRAINED, STRAINS

#: Part of the largest entry by which entries across the diagonal may differ: written matrices have few digits.
_ROUNDING = 1e-9
#: Eigenvalue of a matrix scaled to a diagonal of 1 that is none.
_NONE = 1e-12
_DEFINITE = "a positive definite matrix"


@dataclass(frozen=True)
class ResistsItsStrains:
    """Rule for the 36 entries of the stiffness of a section, row by row, of a beam of a model."""

    stage: ClassVar[int] = 1

    model: str

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        matrices = np.stack(np.broadcast_arrays(*numbers), axis=-1).astype(float).reshape(-1, 6, 6)
        result = np.array([bool(_fault(matrix, self.model)[0]) for matrix in matrices])
        return result.reshape(np.broadcast_shapes(*map(np.shape, numbers)))

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        return _fault(np.array(numbers, dtype=float).reshape(6, 6), self.model)


def unlike(matrix: Array) -> tuple[int, int] | None:
    """Return the first entry of a matrix that differs from its mirror across the diagonal; None if it is symmetric."""
    result = np.argwhere(np.abs(matrix - matrix.T) > _ROUNDING * float(np.max(np.abs(matrix))))
    return (int(result[0][0]), int(result[0][1])) if len(result) else None


def _fault(matrix: Array, model: str) -> tuple[str, str]:
    """Return the fault of a stiffness matrix and a hint, both empty for a valid one: a matrix without a potential, one
    that does not resist some strain, or one that resists a strain that the model constrains."""
    if not np.all(np.isfinite(matrix)):
        return "", ""
    if (pair := unlike(matrix)) is not None:
        fault = f"the matrix is not symmetric, so it has no potential: entry [{pair[0]}][{pair[1]}] differs from"
        return f"{fault} [{pair[1]}][{pair[0]}]", "the mean of both"
    for place in map(STRAINS.index, CONSTRAINED[model]):
        if matrix[place].any():
            fault = f"a beam of the model {model} has no {STRAINS[place]}, and row [{place}] of the matrix is not 0"
            return fault, "0 in rows and columns of strains that it does not have"
    free = [place for place, strain in enumerate(STRAINS) if strain not in CONSTRAINED[model]]
    diagonal = np.diag(matrix)
    if weak := [place for place in free if not diagonal[place] > 0.0]:
        place = min(weak, key=lambda place: float(diagonal[place]))
        entry = f"entry [{place}][{place}] is {matrix[place, place]:.6g}"
        return f"the section does not resist {STRAINS[place]}: {entry}", _DEFINITE
    scale = np.sqrt(diagonal[free])
    smallest = float(np.linalg.eigvalsh(matrix[np.ix_(free, free)] / np.outer(scale, scale))[0])
    if smallest > _NONE:
        return "", ""
    fault = "the matrix is not positive definite, so the section gives way to some strain: scaled to a diagonal of 1,"
    return f"{fault} its smallest eigenvalue is {smallest:.6g}", _DEFINITE
