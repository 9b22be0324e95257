"""The nearest correlation matrix, against Higham's example and against what it must be."""

from __future__ import annotations

import numpy as np

from eomgen.products.reliability.random_processes.coherence import nearest_correlation
from tests.anchors import anchor


def test_the_nearest_correlation_matrix_of_higham() -> None:
    """Higham (2002), sections 1 and 4: the 3 by 3 example, and the tridiagonal one, as of NAG's g02aa."""
    found = nearest_correlation(np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]))
    anchor("nearest_correlation").check(found[0])
    second = np.eye(4) * 2.0 - np.eye(4, k=1) - np.eye(4, k=-1)
    anchor("nearest_correlation_tridiagonal").check(nearest_correlation(second)[0])


def test_what_is_found_is_a_correlation_matrix_and_no_other_is_nearer() -> None:
    random = np.random.default_rng(0)
    wrong = np.clip(random.uniform(-1.5, 1.5, (5, 5)), -1.0, 1.0)
    wrong = 0.5 * (wrong + wrong.T)
    np.fill_diagonal(wrong, 1.0)
    found = nearest_correlation(wrong)
    np.testing.assert_allclose(np.diag(found), 1.0, rtol=1e-12)
    assert np.linalg.eigvalsh(found)[0] > 0.0 > np.linalg.eigvalsh(wrong)[0]
    away = np.linalg.norm(found - wrong)
    for _ in range(200):
        rows = random.standard_normal((5, 5))
        rows /= np.linalg.norm(rows, axis=1)[:, None]
        other = found + random.uniform(0.0, 0.2) * (rows @ rows.T - found)
        assert np.linalg.norm(other - wrong) > away - 1e-8
    fine = np.array([[1.0, 0.3], [0.3, 1.0]])
    np.testing.assert_allclose(nearest_correlation(fine), fine, rtol=1e-12)
