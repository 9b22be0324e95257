"""One rotation algebra: the recorded forms and the NumPy form of a rotation give the same bits, on any quaternion."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from eomgen.lie import numeric, rotations
from eomgen.mechanics.laws.derived import LAWS
from eomgen.mechanics.tree.base import quaternion_product
from eomgen.symbolic.calculus.configuration import rotation
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape

QUATERNIONS = np.random.default_rng(3).normal(size=(200, 4))
QUATERNIONS /= np.linalg.norm(QUATERNIONS, axis=1, keepdims=True)


def recorded(form: str) -> NDArray[np.float64]:
    """Return the rotation matrices of a form on the tape, (200, 9)."""
    tape = Tape()
    algebra = Algebra(tape)
    p = algebra.block("q", 4)
    match form:
        case "law":
            entries = [
                x.ref for x in LAWS["rotation_of_quaternion"].instantiate(algebra, dict(zip("wxyz", p, strict=True)))
            ]
        case "groups":
            entries = [x.ref for row in rotations.rotation_matrix(p) for x in row]
        case _:
            entries = [ref for row in rotation(tape, [x.ref for x in p]) for ref in row]
    return np.array([evaluate(tape, entries, {"q": quaternion}) for quaternion in QUATERNIONS]).reshape(-1, 9)


@pytest.mark.parametrize("form", ["law", "groups", "seeds"])
def test_every_recorded_rotation_matrix_has_the_bits_of_the_numeric_one(form: str) -> None:
    assert np.array_equal(recorded(form), numeric.rotation_matrix(QUATERNIONS).reshape(-1, 9))


def test_products_and_turns_are_those_of_matrices() -> None:
    p, r = QUATERNIONS[:100], QUATERNIONS[100:]
    P, R = numeric.rotation_matrix(p), numeric.rotation_matrix(r)
    np.testing.assert_allclose(numeric.rotation_matrix(numeric.quaternion_product(p, r)), P @ R, atol=1e-14)
    x = np.random.default_rng(4).normal(size=(100, 3))
    np.testing.assert_allclose(numeric.rotated(p, x), np.einsum("nij,nj->ni", P, x), atol=1e-14)
    np.testing.assert_array_equal(np.einsum("nij,nj->ni", numeric.skew(x), x[::-1]), np.cross(x, x[::-1]))
    assert np.linalg.norm(numeric.unit(3.7 * p), axis=1) == pytest.approx(1.0, abs=1e-15)


def test_the_recorded_product_of_links_is_the_same_to_rounding() -> None:
    """Its sums are associated otherwise than in the groups: poses and steppers keep the bits that each has."""
    p, r = QUATERNIONS[:100].T, QUATERNIONS[100:].T
    np.testing.assert_allclose(
        np.array(quaternion_product(p, r)).T, numeric.quaternion_product(p.T, r.T), rtol=0.0, atol=4e-16
    )
