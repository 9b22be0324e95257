"""Whether a scene's equations have constraints, foreseen from the scene and seen in the equations."""

from __future__ import annotations

from typing import Any

import pytest

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.pipeline.methods import is_constrained
from tests.models.cosserat import ROLL_UP, beam_scene
from tests.models.library import scene

TIP = {"force": ["load", 0, 0]}
UNSHEARED = {strain: value for strain, value in ROLL_UP.items() if not strain.startswith("shear")}


@pytest.mark.parametrize(
    ("data", "constrained"),
    [
        (scene("arm"), False),
        (scene("slider_crank"), True),
        (scene("pendulum", coordinates="absolute"), True),
        (scene("wheel", joints__travel__drive="0.1 * sin(t)"), True),
        (beam_scene(1, TIP), False),
        (beam_scene(1, TIP, {"model": "kirchhoff", "stiffness": UNSHEARED}), True),
    ],
    ids=["tree", "loop", "absolute", "drive", "beam", "kirchhoff"],
)
def test_constraints_are_foreseen(data: dict[str, Any], constrained: bool) -> None:
    described = eomgen.load(data)
    assert is_constrained(described) is constrained
    assert bool(derive(described, ["residual"]).multipliers) is constrained
