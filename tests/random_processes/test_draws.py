"""Standard normal variables by seed."""

from __future__ import annotations

import numpy as np

from eomgen.base.random_inputs import standard_normals

SEED_0 = [float.fromhex("-0x1.383741d50dd27p+1"), float.fromhex("-0x1.12c5fe15d2adcp-1")]


def test_the_same_seed_has_the_same_bits_and_more_follow_the_first() -> None:
    first = standard_normals(7, 40)
    np.testing.assert_array_equal(standard_normals(7, 90)[:40], first)
    assert not np.any(np.isin(standard_normals(8, 40), first))
    assert not np.any(np.isin(standard_normals(7, 40, "wind"), first))
    # written down: they are the same on every machine
    np.testing.assert_array_equal(standard_normals(0, 2), SEED_0)
