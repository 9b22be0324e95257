"""Pivots that were chosen beforehand and vanish along the motion, in a matrix too large for a dense factorization.

The axis of a wobble plate moves around a cone; a guide keeps the plate from turning with the shaft. So the places of
all pistons follow from the angle of the shaft in closed form.
"""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array

PISTONS, TILT, RADIUS, ROD = 5, 0.3, 0.2, 0.4
UP = {"axis": [0, 0, 1], "x_axis": [1, 0, 0]}


def plate_at(angle: float) -> Array:
    """Return the axes of the plate, as columns, at an angle of the shaft."""
    normal = np.array([np.sin(TILT) * np.cos(angle), np.sin(TILT) * np.sin(angle), np.cos(TILT)])
    x = np.array([normal[2], 0.0, -normal[0]])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x), normal], axis=1)


def places(piston: int, angle: float) -> tuple[Array, Array]:
    """Return the ends of a rod, at the plate and at the piston."""
    direction = 2.0 * np.pi * piston / PISTONS
    outward = np.array([np.cos(direction), np.sin(direction), 0.0])
    foot = plate_at(angle) @ (RADIUS * outward)
    across = RADIUS * outward - foot
    return foot, RADIUS * outward + [0.0, 0.0, foot[2] + np.sqrt(ROD**2 - across[0] ** 2 - across[1] ** 2)]


def pump() -> eomgen.Scene:
    """Return the pump, every part of which is free but for constraints: 72 velocities and 72 multipliers."""
    builder = eomgen.SceneBuilder("pump", gravity=[0, 0, -9.81])
    builder.body("shaft", 1.0, inertia=[0.02, 0.03, 0.04]).body("plate", 1.0, inertia=[0.02, 0.03, 0.04])
    builder.joint("shaft", "free", "base", "shaft")
    builder.joint("plate", "free", "base", "plate", orientation=plate_at(0.0).tolist())
    shaft, plate = {"body": "shaft", **UP}, {"body": "plate", "axis": [0, 0, 1]}
    builder.constraint("main", "revolute", first={"body": "base", **UP}, second=shaft, drive="2 * pi * t**2")
    inclined = {"body": "shaft", "axis": plate_at(0.0)[:, 2].tolist()}
    builder.constraint("swash", "revolute", first=inclined, second=plate)
    guided = {"body": "plate", "position": [0.1, 0, 0]}
    builder.constraint("guide", "formula", first={"body": "base"}, second=guided, equation="y")
    for k in range(PISTONS):
        foot, head = places(k, 0.0)
        outward = head * [1.0, 1.0, 0.0]
        along = (head - foot) / ROD
        y = np.cross(along, outward)
        y /= np.linalg.norm(y)
        axes = np.stack([np.cross(y, along), y, along], axis=1)
        builder.body(f"rod{k}", 0.1, center_of_mass=[0, 0, ROD / 2], inertia=[0.002, 0.003, 0.004])
        builder.body(f"piston{k}", 0.3, inertia=[0.002, 0.003, 0.004])
        builder.joint(f"rod{k}", "free", "base", f"rod{k}", position=foot.tolist(), orientation=axes.tolist())
        builder.joint(f"piston{k}", "free", "base", f"piston{k}", position=head.tolist())
        ball = {"body": "plate", "position": (plate_at(0.0).T @ foot).tolist()}
        builder.constraint(f"ball{k}", "spherical", first=ball, second={"body": f"rod{k}"})
        pin = {"body": f"piston{k}", "axis": [0, 0, 1], "x_axis": outward.tolist()}
        builder.constraint(f"pin{k}", "universal", first=pin, second={"body": f"rod{k}", "position": [0, 0, ROD], **UP})
        bore = {"body": "base", "position": outward.tolist(), **UP}
        builder.constraint(f"bore{k}", "prismatic", first=bore, second={"body": f"piston{k}", **UP})
    return builder.build()


@pytest.mark.long
def test_a_pump_runs_through_positions_with_vanishing_pivots() -> None:
    model = eomgen.build(pump(), profile="quick")
    assert model.nv == 72
    run = model.simulate(1.0, 0.01, method="rattlie", error_estimate=False)
    assert run.success, run.message
    for k in range(PISTONS):
        heights = [places(k, 2.0 * np.pi * t**2)[1][2] for t in run.t]
        np.testing.assert_allclose(model.pose(f"piston{k}", run.q, t=run.t)[:, 6], heights, atol=1e-13)
