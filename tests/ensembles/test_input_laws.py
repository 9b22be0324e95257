"""Seeds of roads and factors of inputs that vary, against scenes that say the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.ensembles.carts import CART

#: A cart that two wheels in one track push, the second with a formula besides.
INPUTS = """
[inputs.push]
road = {{ class = "D", speed = 10, seed = {seed}, harmonics = 8 }}
[inputs.rear]
road = {{ class = "D", speed = 10, seed = {seed}, harmonics = 8, offset = 2.5 }}
formula = "sin(3 * t)"
"""


def model_of(folder: Path, seed: int) -> eomgen.Model:
    path = folder / "cart.toml"
    text = CART.replace('[inputs.push]\nunit = "N"\n', INPUTS.format(seed=seed))
    path.write_text(text.replace('effort = "push"', 'effort = "100 * push + 50 * rear"'), encoding="utf-8")
    return eomgen.build(path)


@pytest.mark.long
@pytest.mark.slow
def test_wheels_of_a_track_follow_its_seed(tmp_path: Path) -> None:
    """As scenes with these seeds; generalized-alpha takes functions in its steps otherwise than compiled formulas."""
    cart, changed = model_of(tmp_path, 3), model_of(tmp_path, 4)
    for method, off in (("rk4", 1e-12), (None, 1e-4)):
        found = cart.simulate_many(vary={"seed.push": "values(3, 4)"}, method=method).results["output.place.final"]
        same = cart.simulate(error_estimate=False, method=method).outputs["place"][-1]
        other = changed.simulate(error_estimate=False, method=method).outputs["place"][-1]
        np.testing.assert_allclose(found, [same, other], rtol=off)
        assert abs(other - same) > 1e-3 * abs(same)
