"""Derivatives of the strain of an element by the twists of its nodes, against differences; blocks against SciPy's."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.solvers.strain_energy import _along_twists, _block_diagonal, _geometric


def test_blocks_stand_on_the_diagonal(rng: np.random.Generator) -> None:
    blocks = rng.normal(size=(3, 2, 4))
    made = _block_diagonal(blocks)
    assert made.shape == (6, 12)
    np.testing.assert_array_equal(made.toarray(), scipy.linalg.block_diag(*blocks))


def logarithm(first: np.ndarray, second: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """Return log(h_1^-1 h_2) of two nodes that are moved by twists in their own axes."""
    moved = [numeric.compose(SE3, h, numeric.exp(SE3, part)) for h, part in ((first, twists[:6]), (second, twists[6:]))]
    return numeric.log(SE3, numeric.compose(SE3, numeric.inverse(SE3, moved[0]), moved[1]))


def test_strains_change_along_the_twists_of_both_nodes(rng: np.random.Generator) -> None:
    first, second = (numeric.exp(SE3, 0.4 * rng.normal(size=6)) for _ in range(2))
    d = logarithm(first, second, np.zeros(12))
    (found,) = _along_twists(d[np.newaxis])
    step = 1e-6
    expected = np.stack(
        [
            (logarithm(first, second, step * way) - logarithm(first, second, -step * way)) / (2.0 * step)
            for way in np.eye(12)
        ],
        axis=1,
    )
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_forces_on_nodes_change_with_the_strain(rng: np.random.Generator) -> None:
    d, forces = 0.5 * rng.normal(size=(2, 6)), rng.normal(size=(2, 6))
    found = _geometric(d, forces)
    assert found.shape == (2, 12, 6)
    step = 1e-6
    for k, way in enumerate(np.eye(6)):
        ahead, behind = (np.einsum("eij,ei->ej", _along_twists(d + s * step * way), forces) for s in (1.0, -1.0))
        np.testing.assert_allclose(found[:, :, k], (ahead - behind) / (2.0 * step), atol=1e-8)
