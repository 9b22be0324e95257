"""A Stewart platform: a free plate on six telescopic legs, each closed by a ball at the plate."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import eomgen
from eomgen.scene.scene import Scene

#: Angles of the anchors on the ground and on the plate, rad, their radii, and the plate's height, m.
_GROUND = np.radians([-10.0, 10.0, 110.0, 130.0, 230.0, 250.0])
_PLATE = np.radians([-50.0, 50.0, 70.0, 170.0, 190.0, 290.0])
_RADII, _HEIGHT = (1.0, 0.6), 1.2


def stewart() -> Scene:
    """Return the platform where it stands level; each leg is pushed by a spring, a damper and a constant effort."""
    builder = eomgen.SceneBuilder("stewart")
    builder.body("plate", mass=40.0, center_of_mass=[0.05, -0.02, 0.1], inertia=[4.0, 4.5, 7.0, 0.1, -0.2, 0.05])
    builder.joint("float", "free", "base", "plate", initial={"position": [0.0, 0.0, _HEIGHT]})
    for k in range(6):
        foot = _RADII[0] * np.array([np.cos(_GROUND[k]), np.sin(_GROUND[k]), 0.0])
        top = _RADII[1] * np.array([np.cos(_PLATE[k]), np.sin(_PLATE[k]), 0.0])
        along = top - foot + np.array([0.0, 0.0, _HEIGHT])
        length = float(np.linalg.norm(along))
        turn = Rotation.align_vectors([along / length], [[0.0, 0.0, 1.0]])[0]
        angle = float(turn.magnitude())
        axis = turn.as_rotvec() / angle
        builder.body(f"cylinder{k}", mass=3.0, center_of_mass=[0.0, 0.01, 0.3], inertia=[0.1, 0.11, 0.02])
        builder.body(f"rod{k}", mass=2.0, center_of_mass=[0.0, 0.0, -0.3], inertia=[0.06, 0.06, 0.004])
        builder.joint(
            f"foot{k}", "universal", "base", f"cylinder{k}", axis=[1, 0, 0], second_axis=[0, 1, 0],
            position=foot.tolist(), rotation=[(axis.tolist(), angle)],
        )  # fmt: skip  # a joint on two lines
        builder.joint(
            f"stroke{k}", "prismatic", f"cylinder{k}", f"rod{k}", axis=[0, 0, 1], position=[0, 0, length],
            stiffness=4e4, damping=300.0,
        )  # fmt: skip  # a joint on two lines
        builder.effort(f"push{k}", f"stroke{k}", 120.0)
        builder.constraint(f"ball{k}", "spherical", {"body": f"rod{k}"}, {"body": "plate", "position": top.tolist()})
    return builder.build()
