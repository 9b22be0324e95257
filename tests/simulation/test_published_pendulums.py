"""Pendulums and sliders on single joints against runs of another program.

Places of the centre of mass and angular accelerations are printed with 7 digits by MSC Adams, in the reference data of
Project Chrono's tests of joints (BSD-3-Clause). It is known to some 1e-5 m for the revolute joint, 4e-4
for the spherical and the universal ones, which in the plane are the same pendulum: the first three cases have one
motion, and differ among each other by this much.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

import eomgen

Row = tuple[float, float, float]


class Published(NamedTuple):
    """Printed results of a rod of 1 kg: its centre of mass at 1 s and 5 s, its angular acceleration at 5 s, and their
    scatter."""

    at_1_s: Row
    at_5_s: Row
    alpha_at_5_s: Row
    scatter: float


PLANE = Published((-0.892381, 0.0, -1.78988), (-1.99968, 0.0, -0.0355587), (0.0, -4.78297, 0.0), 1e-5)


RESULTS = {
    "revolute": PLANE,
    "cylindrical": PLANE,
    "spherical": Published((-0.892369, 0, -1.78988), (-1.99967, 0, -0.0361929), (0, -4.78295, 0), 7e-4),
    "universal": Published((0, -0.892369, -1.78988), (0, -1.99967, -0.0361929), (4.78295, 0, 0), 7e-4),
    "prismatic": Published((3.0, -0.451662, 0.548338), (3.0, -59.2916, -58.2916), (0, 0, 0), 5e-5),
    "distance": Published((0, -0.956545, -1.756423), (0, -1.999998, -0.002779575), (0, 0, 0), 1e-6),
}


#: Joints and centres of mass.
JOINTS: dict[str, tuple[dict[str, Any], list[float]]] = {
    "revolute": ({"type": "revolute", "axis": [0, 1, 0]}, [2.0, 0.0, 0.0]),
    "cylindrical": ({"type": "cylindrical", "axis": [0, 1, 0]}, [2.0, 0.0, 0.0]),
    "spherical": ({"type": "spherical"}, [2.0, 0.0, 0.0]),
    "universal": ({"type": "universal", "axis": [1, 0, 0], "second_axis": [0, 0, 1]}, [0.0, 2.0, 0.0]),
    "prismatic": ({"type": "prismatic", "axis": [0, 1, 1], "position": [3, 2, 3]}, [0.0, 0.0, 0.0]),
    "distance": ({"type": "free", "initial": {"position": [0, 2, 0]}}, [0.0, 0.0, 0.0]),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", RESULTS)
def test_a_rod_on_one_joint_is_where_another_program_has_it(name: str) -> None:
    (joint, center), known = JOINTS[name], RESULTS[name]
    inertia = [0.1, 0.04, 0.1] if name == "universal" else [0.04, 0.1, 0.1]
    builder = eomgen.SceneBuilder(name, gravity=[0, 0, -9.80665]).body(
        "rod", 1.0, inertia=inertia, center_of_mass=center
    )
    builder.joint("joint", joint["type"], "base", "rod", **{key: joint[key] for key in joint if key != "type"})
    builder.point("center", "rod", center)
    for key, word in (("place", "position.center"), ("alpha", "angular_acceleration.rod")):
        builder.output(key, formula=[f"{word}[{k}]" for k in range(3)])
    if name == "distance":
        builder.constraint("rope", "distance", {"body": "base"}, "center", length=2.0)
    method = "rk4_partitioned" if name == "distance" else "rk4"
    run = eomgen.build(builder.build(), profile="quick").simulate(5.0, 1e-3, method=method, record_every=1000)
    assert run.success
    np.testing.assert_allclose(run.outputs["place"][[1, 5]], [known.at_1_s, known.at_5_s], atol=known.scatter)
    np.testing.assert_allclose(run.outputs["alpha"][5], known.alpha_at_5_s, atol=5.0 * known.scatter)
