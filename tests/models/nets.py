"""Nets of point-like bodies between springs, within a fixed frame: scenes of any size whose parts are equal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import eomgen

LENGTH, MASS, STIFFNESS, SLACK = 1.0, 0.1, 1000.0, 0.9


def net(
    rows: int,
    columns: int,
    *,
    coordinates: Literal["joint", "absolute"] = "absolute",
    group: Literal["SE3", "R3xSO3"] | None = None,
    joint: Literal["free", "prismatic"] = "free",
    place: Sequence[float] = (0.0, 0.0, 0.0),
    damping: float = 1.0,
    gravity: float = 9.81,
    anchors: Literal["base", "world"] = "base",
    tunable: bool = False,
) -> eomgen.Scene:
    """Return a horizontal square net with knots 1 m apart, each on its own, whose outer knots springs tie to the frame.

    Parameters
    ----------
    joint : ``free``, or ``prismatic`` for point masses on three travels each
    place : where springs end in axes of their knots, m
    anchors : what the outer springs are tied to
    tunable : whether stiffness and length are tunable parameters
    """
    builder = eomgen.SceneBuilder("net", coordinates=coordinates, gravity=[0.0, 0.0, -gravity])
    stiffness: float | str = STIFFNESS
    slack: float | str = SLACK
    if tunable:
        builder.parameter("k", STIFFNESS, tunable=True).parameter("slack", SLACK, tunable=True)
        stiffness, slack = "k", "slack"
    for i in range(rows):
        for j in range(columns):
            knot, at = f"knot_{i}_{j}", [LENGTH * (i + 1), LENGTH * (j + 1), 0.0]
            if joint == "free":
                builder.body(knot, MASS, inertia=[1e-4, 1e-4, 1e-4], group=group)
                builder.joint(f"free_{i}_{j}", "free", "base", knot, initial={"position": at})
            else:
                before = "base"
                for axis, name in enumerate("xyz"):
                    last = name == "z"
                    body = knot if last else f"{knot}_{name}"
                    builder.body(body, MASS if last else 0.0)
                    direction = [float(k == axis) for k in range(3)]
                    start = {"position": at[axis]}
                    builder.joint(f"{name}_of_{knot}", "prismatic", before, body, axis=direction, initial=start)
                    before = body
            builder.point(f"{knot}_c", knot, list(place))

    def tie(name: str, first: str, second: str) -> None:
        builder.spring(name, first, second, stiffness=stiffness, damping=damping, length=slack)

    for i in range(rows):
        for j in range(columns):
            own = f"knot_{i}_{j}_c"
            if i + 1 < rows:
                tie(f"x_{i}_{j}", own, f"knot_{i + 1}_{j}_c")
            if j + 1 < columns:
                tie(f"y_{i}_{j}", own, f"knot_{i}_{j + 1}_c")
            ends = {"left": (-1, 0, i == 0), "right": (1, 0, i == rows - 1)}
            ends |= {"front": (0, -1, j == 0), "back": (0, 1, j == columns - 1)}
            for name, (x, y, there) in ends.items():
                if there:
                    position = [LENGTH * (i + 1 + x), LENGTH * (j + 1 + y), 0.0]
                    builder.point(f"{name}_{i}_{j}_end", anchors, position)
                    tie(f"{name}_{i}_{j}", f"{name}_{i}_{j}_end", own)
    return builder.simulation(step=1e-3, duration=0.5, rho_inf=0.8).build()
