"""Blocks of ``second_partials``: parts of its weights and its direction, in order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class SecondBlocks(NamedTuple):
    """Numbers of components by name, in their order.

    Attributes
    ----------
    weights : of the residual ``r``, ``zdot``, holonomic constraints ``Phi``, rates ``w`` and accelerations ``wdot`` of
        all constraints, outputs ``y``
    direction : of ``q`` (left-trivialised), ``v``, ``a``, ``z``, ``lam``, ``p``, ``u``
    """

    weights: Mapping[str, int]
    direction: Mapping[str, int]

    def places(self, block: str) -> dict[str, slice]:
        """Return the slices of the parts of ``weights`` or ``direction``."""
        result, first = {}, 0
        for name, size in getattr(self, block).items():
            result[name], first = slice(first, first + size), first + size
        return result


def second_blocks(
    *, nv: int, nz: int, nu: int, holonomic: int, rows: int, outputs: int, parameters: int
) -> SecondBlocks:
    """Return the blocks of a system with so many of each; ``rows``: of all constraints."""
    weights = {"r": nv, "zdot": nz, "Phi": holonomic, "w": rows, "wdot": rows, "y": outputs}
    return SecondBlocks(weights, {"q": nv, "v": nv, "a": nv, "z": nz, "lam": rows, "p": parameters, "u": nu})
