"""Generated C in single precision: what rounding does to a run is said."""

from __future__ import annotations

import re
from typing import Any

import pytest

import eomgen
from tests.models.library import scene


def rods(**changes: Any) -> dict[str, Any]:
    """Return two rods in absolute coordinates, on a ball and a hinge."""
    return scene("../tests/integrators/scenes/rods", bodies__ring=None, joints__slide=None, **changes)


@pytest.mark.long
def test_multipliers_that_are_rounding_are_said() -> None:
    model = eomgen.build(rods(), real="float")
    held = model.simulate(1.0, 1e-3)
    assert held.message == "reached t = 1 s in 1000 steps"
    for step in (1e-3, 1e-4):
        run = model.simulate(1.0, step, method="generalized_alpha_index3")
        said = r"up to \S+ % of the multipliers is rounding, which grows as 1/step\^2"
        hint = f"try: generalized_alpha, a step larger than {step:g} s, or double precision"
        assert re.fullmatch(
            rf"reached t = 1 s in \d+ steps; (the estimated error is .*, and )?{said}; {hint}", run.message
        )
