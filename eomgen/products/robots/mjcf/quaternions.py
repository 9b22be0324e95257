"""Rotations as formulas: quaternions whose components are terms, (w, x, y, z), and their logarithms."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.products.robots.mjcf.draft import MjcfDraft, times, total

#: Square of a length below which a direction does not count.
_SMALLEST = "1e-32"
#: Sign and factors of each component of a product: (sign, index of the first, index of the second).
_PRODUCT = (
    ((1, 0, 0), (-1, 1, 1), (-1, 2, 2), (-1, 3, 3)),
    ((1, 0, 1), (1, 1, 0), (1, 2, 3), (-1, 3, 2)),
    ((1, 0, 2), (-1, 1, 3), (1, 2, 0), (1, 3, 1)),
    ((1, 0, 3), (1, 1, 2), (-1, 2, 1), (1, 3, 0)),
)


def product(draft: MjcfDraft, wanted: str, first: Sequence[str], second: Sequence[str]) -> list[str]:
    """Return the names of the components (w, x, y, z) of the product of two quaternions, which are added as
    definitions."""
    sums = [total([f"{sign}.0 * {first[i]} * {second[j]}" for sign, i, j in terms]) for terms in _PRODUCT]
    return draft.define_each(wanted, sums, "wxyz")


def inverse(quaternion: Sequence[str]) -> list[str]:
    """Return the inverse of a unit quaternion."""
    return [quaternion[0], *(f"(-{part})" for part in quaternion[1:])]


def exponential(draft: MjcfDraft, wanted: str, vector: Sequence[str]) -> list[str]:
    """Return the names of the components (w, x, y, z), added as definitions, of the quaternion of a rotation vector."""
    square = total([f"{part}**2" for part in vector])
    angle = draft.define(f"{wanted}_angle", f"sqrt(max({square}, {_SMALLEST}))")
    factor = draft.define(f"{wanted}_factor", f"sin(0.5 * {angle}) / {angle}")
    real = draft.define(f"{wanted}_w", f"cos(0.5 * {angle})")
    return [real, *draft.define_each(wanted, [f"{factor} * {x}" for x in vector])]


def logarithm(draft: MjcfDraft, wanted: str, quaternion: Sequence[str]) -> list[str]:
    """Return the names of the components (3), added as definitions, of a quaternion's rotation vector by less than half
    a turn."""
    w, *vector = quaternion
    square = total([f"{part}**2" for part in vector])
    size = draft.define(f"{wanted}_size", f"sqrt(max({square}, {_SMALLEST}))")
    sign = f"(1.0 if {w} >= 0.0 else (-1.0))"
    factor = draft.define(f"{wanted}_factor", f"2.0 * atan2({size}, abs({w})) / {size} * {sign}")
    return draft.define_each(wanted, [f"{factor} * {x}" for x in vector])


def turned_back(quaternion: Sequence[str], vector: Sequence[float]) -> list[str]:
    """Return formulas (3) of R^T c, for a constant vector c and the rotation R by a unit quaternion whose components
    are terms."""
    w, x, y, z = quaternion
    rows = (
        (f"(1.0 - 2.0 * ({y}**2 + {z}**2))", f"(2.0 * ({x} * {y} - {w} * {z}))", f"(2.0 * ({x} * {z} + {w} * {y}))"),
        (f"(2.0 * ({x} * {y} + {w} * {z}))", f"(1.0 - 2.0 * ({x}**2 + {z}**2))", f"(2.0 * ({y} * {z} - {w} * {x}))"),
        (f"(2.0 * ({x} * {z} - {w} * {y}))", f"(2.0 * ({y} * {z} + {w} * {x}))", f"(1.0 - 2.0 * ({x}**2 + {y}**2))"),
    )
    return [total([times(c, row[j]) for c, row in zip(vector, rows, strict=True) if c]) for j in range(3)]
