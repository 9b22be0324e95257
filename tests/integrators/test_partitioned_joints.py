"""Coordinate partitioning on single joints in absolute coordinates: every type, oblique axes, friction.

A body that only travels turns by rounding, which was held against itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.scene.joint_types import JOINTS

KINDS = [name for name, row in JOINTS.items() if row.rows[0] and row.moves]


def scene(kind: str, coordinates: str, seed: int) -> dict[str, Any]:
    """Return a body on one joint with an oblique axis, under oblique gravity, if possible with friction."""
    rng = np.random.default_rng(seed)
    row = JOINTS[kind]
    axis, other = rng.normal(size=3), rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    other = np.cross(axis, other).tolist()
    own = {"axis": axis.tolist(), "second_axis": other, "x_axis": other, "pitch": 0.07}
    keys = ("axis",) * bool(row.coordinates) + tuple(dict.fromkeys((*row.needed, *filter(None, [row.second_key]))))
    body = {"mass": rng.uniform(0.2, 5.0), "center_of_mass": (0.3 * rng.normal(size=3)).tolist()}
    joint: dict[str, Any] = {"type": kind, "parent": "base", "child": "it", "position": rng.normal(size=3).tolist()}
    joint |= {"rotation": [{"axis": [0, 1, 0], "angle": rng.uniform(0, 3)}], **{key: own[key] for key in keys}}
    if row.v_size == 1:
        joint["friction"] = {"coulomb": rng.uniform(0.05, 3), "velocity": 0.5}
        joint["initial"] = {"position": rng.uniform(-1, 1), "velocity": rng.uniform(-2, 2)}
    return {
        "format": 1,
        "name": "one",
        "coordinates": coordinates,
        "gravity": (6.0 * rng.normal(size=3)).tolist(),
        "bodies": {"it": body | {"inertia": rng.uniform(0.1, 0.19, 3).tolist()}},
        "joints": {"it": joint},
    }


@pytest.mark.slow
@pytest.mark.long_except("prismatic", "revolute")
@pytest.mark.parametrize("kind", KINDS)
def test_partitioned_methods_run_on_every_joint(kind: str) -> None:
    poses, seed = [], KINDS.index(kind)
    for coordinates, methods in (("absolute", ("rk4_partitioned", "rk45_partitioned")), ("joint", ("rk4",))):
        model = eomgen.build(scene(kind, coordinates, seed), method=methods[0], profile="quick")
        for method in methods:
            run = model.simulate(0.5, 1e-3, method=method, error_estimate=False)
            assert run.success, run.message
            poses.append(model.pose("it", run.q[-1]))
    for pose in poses[:-1]:
        assert np.max(np.abs(pose - poses[-1])) < 1e-8
