"""Blocks of the stiffness of beams against SciPy's."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from eomgen.solvers.strain_energy import _block_diagonal


def test_blocks_stand_on_the_diagonal(rng: np.random.Generator) -> None:
    blocks = rng.normal(size=(3, 2, 4))
    made = _block_diagonal(blocks)
    assert made.shape == (6, 12)
    np.testing.assert_array_equal(made.toarray(), scipy.linalg.block_diag(*blocks))
