"""Usual mistakes of conversions, by the resulting numbers: degrees against radians, opposite or other axes,
inertias about another point or in another frame, units, missing values."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import permutations

import numpy as np

from eomgen.base.arrays import Array
from eomgen.scene.inertia import entries_of, steiner, tensor

#: A mistake of lengths alone.
_HALF = "a factor of 2, as of a diameter against a radius"
_LENGTHS = ("length", "radius", "limit")
#: Factors between two values, with the mistake.
_FACTORS = (
    (180.0 / math.pi, "degrees against radians"),
    (1e3, "millimetres against metres, or grams against kilograms"),
    (1e6, "square millimetres against square metres"),
    (1e9, "g mm^2 against kg m^2"),
    (9.81, "a weight against a mass"),
    (9.80665, "a weight against a mass"),
    (2.0, _HALF),
    (2.0 * math.pi, "turns against radians"),
    (60.0 / (2.0 * math.pi), "revolutions per minute against rad/s"),
    (0.0254, "inches against metres"),
    (0.45359237, "pounds against kilograms"),
)
#: Relative error of a factor that counts as the factor.
_NEAR = 1e-4


def of_number(first: float | str, second: float | str, quantity: str) -> str:
    """Return the likely cause of two different numbers; empty if none is usual."""
    if isinstance(first, str) or isinstance(second, str):
        return ""
    if not math.isfinite(first) or not math.isfinite(second):
        absent = "the first" if not math.isfinite(first) else "the second"
        return f"missing in {absent}"
    if second == 0.0 or first == 0.0:
        return f"missing {quantity} in the {'second' if second == 0.0 else 'first'}"
    if abs(first + second) <= _NEAR * abs(first):
        return "opposite sign"
    cause = _factor(second / first)
    return cause if cause != _HALF or quantity in _LENGTHS else ""


def _factor(ratio: float) -> str:
    for factor, cause in _FACTORS:
        if any(abs(ratio / expected - 1.0) < _NEAR for expected in (factor, 1.0 / factor)):
            return cause
        if any(abs(ratio / expected + 1.0) < _NEAR for expected in (factor, 1.0 / factor)):
            return f"{cause}, with the opposite sign"
    return ""


def of_vector(first: Array, second: Array, turned: Array, noun: str) -> str:
    """Return the likely cause of two different vectors.

    Parameters
    ----------
    first, second : (3,) in the frame of the first description
    turned : (3, 3) axes of the frame to the parent's; vectors may have been given in the wrong one
    noun : ``axis`` or ``position``, for the text
    """
    size = max(float(np.linalg.norm(first)), float(np.linalg.norm(second)))
    if size == 0.0:
        return ""

    def alike(vector: Array) -> bool:
        return bool(np.linalg.norm(second - vector) <= _NEAR * size)

    if not np.any(np.abs(second) > _NEAR * size):
        return f"missing {noun} in the second"
    if not np.any(np.abs(first) > _NEAR * size):
        return f"missing {noun} in the first"
    if alike(-first):
        return f"opposite {noun}"
    for axes in (turned, turned.T):
        if alike(axes @ first):
            return f"{noun} given in another frame, the parent's against the child's"
        if alike(-axes @ first):
            return f"{noun} given in another frame, with the opposite sign"
    ratio = float(first @ second) / float(first @ first) if np.any(first) else 0.0
    if ratio and alike(ratio * first) and (cause := _factor(ratio)):
        return cause
    for order in permutations(range(3)):
        if alike(first[list(order)]):
            return f"{noun} with components in a different order"
    for signs in np.array(np.meshgrid([1, -1], [1, -1], [1, -1])).T.reshape(-1, 3):
        if alike(signs * first):
            return f"{noun} with the opposite sign of {' and '.join('xyz'[k] for k in range(3) if signs[k] < 0)}"
    if abs(np.linalg.norm(first) - np.linalg.norm(second)) <= _NEAR * size:
        return f"{noun} of equal length in another direction, as if given in another frame"
    return ""


def of_inertia(first: Array, second: Array, mass: float, center: Array, turned: Array) -> str:
    """Return the likely cause of two different inertias (3, 3) about the centre of mass, in one frame.

    Parameters
    ----------
    mass, center : kg and (3,) m, of the first description
    turned : (3, 3) axes of the frame to the parent's
    """
    size = float(np.abs(first).max())

    def alike(matrix: Array) -> bool:
        return bool(np.abs(second - matrix).max() <= _NEAR * size)

    arm = tensor(steiner(mass, center.tolist()))
    for matrix, which in ((second, "second"), (first, "first")):
        if not matrix.any():
            return f"missing inertia in the {which}"
    if cause := _of_products(first, second, _NEAR * size):
        return cause
    if np.abs(arm).max() > _NEAR * size:
        for matrix, which in ((first + arm, "second"), (first - arm, "first")):
            if alike(matrix):
                return f"the {which} is about the origin of the frame, not about the centre of mass"
    ratio = float(np.trace(second) / np.trace(first)) if np.trace(first) else 0.0
    cause = _factor(ratio) if ratio and alike(ratio * first) else ""
    if cause not in ("", _HALF):
        return cause
    for axes in (turned, turned.T):
        if alike(axes @ first @ axes.T):
            return "inertia given in another frame, the parent's against the body's"
    for order in permutations(range(3)):
        if alike(first[np.ix_(order, order)]):
            return "inertia given in another frame: the axes are in a different order"
    moments = [np.linalg.eigvalsh(matrix) for matrix in (first, second)]
    if np.abs(moments[0] - moments[1]).max() <= _NEAR * size:
        return "inertia given in another frame: the principal moments are equal"
    for order in permutations(range(6)):
        entries = entries_of(first)
        if alike(tensor([entries[k] for k in order])):
            return "entries of the inertia in another order, as xx, xy, xz, yy, yz, zz"
    return ""


def _of_products(first: Array, second: Array, near: float) -> str:
    """Return the likely cause if two inertias (3, 3) differ in products of inertia alone; empty for other ones."""
    mine, theirs = (matrix - np.diag(np.diag(matrix)) for matrix in (first, second))
    if np.abs(np.diag(first - second)).max() > near:
        return ""
    if not np.any(np.abs(theirs) > near):
        return "missing products of inertia in the second"
    if not np.any(np.abs(mine) > near):
        return "missing products of inertia in the first"
    if np.abs(mine + theirs).max() <= near:
        return "products of inertia with the opposite sign: entries of the tensor against the products of masses"
    return ""


def of_rotation(first: Array, second: Array) -> str:
    """Return the likely cause of two different rotations (3, 3), child axes to parent axes."""

    def alike(matrix: Array) -> bool:
        return bool(np.abs(second - matrix).max() <= 1e-3)

    if alike(first.T):
        return "the inverse rotation"
    if alike(np.eye(3)):
        return "missing rotation in the second"
    if bool(np.abs(first - np.eye(3)).max() <= 1e-3):
        return "missing rotation in the first"
    for angles in _fixed_angles(first):
        x, y, z = (_about(k, angle) for k, angle in enumerate(angles))
        if alike(x @ y @ z):
            return "the angles are about moving axes in one description, about fixed axes in the second"
        for factor in (math.pi / 180.0, 180.0 / math.pi):
            x, y, z = (_about(k, factor * angle) for k, angle in enumerate(angles))
            if alike(z @ y @ x):
                return "degrees against radians"
        x, y, z = (_about(k, -angle) for k, angle in enumerate(angles))
        if alike(z @ y @ x):
            return "angles of opposite sign"
    apart = second @ first.T
    angle = math.degrees(math.acos(min(1.0, max(-1.0, (np.trace(apart) - 1.0) / 2.0))))
    return f"axes turned by {angle:.4g} degrees"


def _fixed_angles(rotation: Array) -> Iterator[tuple[float, float, float]]:
    """Yield roll, pitch and yaw of a rotation Rz Ry Rx."""
    pitch = math.asin(min(1.0, max(-1.0, -rotation[2, 0])))
    if abs(math.cos(pitch)) > 1e-6:
        yield math.atan2(rotation[2, 1], rotation[2, 2]), pitch, math.atan2(rotation[1, 0], rotation[0, 0])
    else:
        yield 0.0, pitch, math.atan2(-rotation[0, 1], rotation[1, 1])


def _about(axis: int, angle: float) -> Array:
    """Return the rotation (3, 3) about a coordinate axis."""
    result = np.eye(3)
    one, two = (axis + 1) % 3, (axis + 2) % 3
    result[one, one] = result[two, two] = math.cos(angle)
    result[one, two], result[two, one] = -math.sin(angle), math.sin(angle)
    return result
