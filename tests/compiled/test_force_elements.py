"""Stops, friction, bushings and tyres in C: one meaning in four number types, on every side of their selections."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from tests.compiled.test_examples import check_four_number_types
from tests.oracles.states import random_states


@pytest.mark.long
def test_four_number_types_agree_on_force_elements(tmp_path: Path, rng: np.random.Generator) -> None:
    builder = (
        SceneBuilder("elements").body("hub", 5.0, inertia=[0.1, 0.18, 0.1]).body("arm", 1.0, inertia=[0.05, 0.04, 0.03])
    )
    builder.joint("free", "free", "base", "hub").point("center", "hub", [0.02, 0.05, -0.01])
    limits = {"lower": -0.4, "upper": 0.5, "stiffness": 50.0, "damping": 4.0, "onset": 0.2}
    friction = {"coulomb": 2.0, "velocity": 0.5, "static": 3.0, "stribeck": 1.0}
    builder.joint(
        "elbow", "revolute", "hub", "arm", axis=[0, 0.6, 0.8], position=[0.3, 0, 0], limits=limits, friction=friction
    )
    slip = {"stiffness": [15, 12], "friction": 0.8, "velocity": 0.3}
    road = "0.2 * sin(position.center[0]) + 0.1 * sin(t)"
    builder.tyre("tyre", "center", radius=0.3, stiffness=90.0, damping=10.0, onset=0.2, road=road, slip=slip)
    rotational = {"rotational_stiffness": [1, 2, 3], "rotational_damping": [1, 1, 1]}
    builder.bushing("mount", {"body": "base"}, {"body": "arm"}, stiffness=[3, 4, 5], **rotational)
    builder.output("tyre", formula=["load.tyre", "deflection.tyre"])
    system = derive(builder.build())
    state = random_states(system, 16, rng)
    state["q"][:, 6] = rng.uniform(-0.1, 0.6, 16)
    state["q"][:, 7] = rng.uniform(-1.0, 1.0, 16)
    check_four_number_types(
        system, state | {"u": np.zeros((16, 1)), "p": np.zeros((16, 1)), "lam": np.zeros((16, 1))}, tmp_path
    )
