"""Three storeys on shaking ground with a pendulum below the top floor: a benchmark with reference digits."""

from __future__ import annotations

import numpy as np

import eomgen
from tests.anchors import anchor

#: q and v at 10 s with the parameters below: DOP853 at a relative tolerance of 3e-14, equations written by hand.
RESPONSE = anchor("shear_frame").reference
#: Largest magnitudes of q and v on the way.
SCALE = np.array([0.07402, 0.14103, 0.17839, 1.08743, 0.51653, 0.78989, 0.98830, 5.33598])


def shear_frame(frequency: float = 7.0, ground_stiffness: float = 2e5) -> eomgen.Scene:
    """Return the scene.

    Parameters
    ----------
    frequency : rad/s, of the ground
    ground_stiffness : N/m, of the first storey
    """
    builder = eomgen.SceneBuilder("shear_frame").parameter("k", 2e5).parameter("c", 1e3)
    builder.base(position=[f"{-2.0 / frequency**2!r} * sin({frequency!r} * t)", 0, 0])
    for number in (1, 2, 3):
        ground = {"stiffness": ground_stiffness, "damping": "c"} if number == 1 else {}
        builder.body(f"floor{number}", 2000.0)
        builder.joint(f"x{number}", "prismatic", "base", f"floor{number}", axis=[1, 0, 0], **ground)
    for below, above in ((1, 2), (2, 3)):
        force = f"k * (q.x{above} - q.x{below}) + c * (v.x{above} - v.x{below})"
        builder.effort(f"below{above}", f"x{below}", force).effort(f"above{above}", f"x{above}", f"-({force})")
    builder.body("pendulum", 200.0, center_of_mass=[0, 0, -0.5])
    hinge = {"axis": [0, -1, 0], "damping": 2.0, "initial": {"position": 0.3}}
    return builder.joint("theta", "revolute", "floor3", "pendulum", **hinge).build()
