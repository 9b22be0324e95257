"""A scene whose own state is singular, as of a gimbal with aligned rings, serves runs that start elsewhere."""

from __future__ import annotations

from typing import Any

import pytest

import eomgen
from eomgen import ModelError


def gimbal(**rotor: Any) -> dict[str, Any]:
    """Return a rotor in two rings without mass, whose outer and inner axes are one where the scene starts."""
    body = {"mass": 2.0, "center_of_mass": [0, 0, 0.1], "inertia": [0.02, 0.03, 0.04]} | rotor
    carriers = ["base", "outer", "middle", "rotor"]
    joints = {
        name: {"type": "revolute", "parent": carriers[k], "child": carriers[k + 1], "axis": axis}
        for k, (name, axis) in enumerate({"yaw": [0, 0, 1], "lean": [1, 0, 0], "spin": [0, 0, 1]}.items())
    }
    bodies = {"outer": {"mass": 0}, "middle": {"mass": 0}, "rotor": body}
    return {"format": 1, "name": "gimbal", "gravity": [0, 0, -9.81], "bodies": bodies, "joints": joints}


@pytest.mark.slow
def test_a_run_from_the_singular_state_itself_stops_and_says_so() -> None:
    run = eomgen.build(gimbal(), profile="quick").simulate(0.2, 5e-4, method="generalized_alpha")
    assert not run.success and run.message.startswith("stopped at t = 0 s")


def test_what_is_singular_everywhere_is_refused() -> None:
    """With all axes one, the outer ring can turn with the rotor turned back, wherever the rings are."""
    data = gimbal()
    data["joints"]["lean"]["axis"] = [0, 0, 1]
    with pytest.raises(ModelError, match="no inertia resists the revolute joint yaw together with"):
        eomgen.build(data, profile="quick").simulate(0.1, 1e-3, method="generalized_alpha")
