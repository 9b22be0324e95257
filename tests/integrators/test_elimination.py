"""What is said of matrices that cannot be eliminated."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.errors import ModelError
from eomgen.integrators.newton.elimination import eliminate


@pytest.mark.parametrize(
    ("constrained", "expected"),
    [
        (True, "constraints repeat each other, or a mass is missing; try: remove constraints that say the same twice"),
        (
            False,
            (
                "a mass is missing, or masses and stiffnesses differ by more orders of magnitude than numbers have"
                " digits (entries from 1e-12 to 1e+30); try: give every moving part a mass, and stiffnesses and lengths"
                " that differ less"
            ),
        ),
    ],
)
def test_a_singular_matrix_is_explained_by_what_it_can_have(constrained: bool, expected: str) -> None:
    samples = {(0, 0): np.array([1e30]), (0, 1): np.array([0.0]), (1, 0): np.array([1e-12]), (1, 1): np.array([0.0])}
    with pytest.raises(ModelError) as caught:
        eliminate(2, samples, constrained=constrained)
    assert f"it is singular at the initial state: {expected}" in str(caught.value)
