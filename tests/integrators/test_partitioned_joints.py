"""Coordinate partitioning on single joints in absolute coordinates: every type, oblique axes, friction.

A body that only travels turns by rounding, which was held against itself.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.scene.joint_types import JOINTS

KINDS = [name for name, row in JOINTS.items() if row.rows[0] and row.moves]
SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))]
OTHERS = [pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS if kind != "prismatic"]


def numbers(values: np.ndarray) -> str:
    return f"[{', '.join(format(value, '.12f') for value in np.atleast_1d(values))}]"


def scene(kind: str, coordinates: str, seed: int) -> str:
    """Return a body on one joint with an oblique axis, under oblique gravity, if possible with friction."""
    rng = np.random.default_rng(seed)
    row = JOINTS[kind]
    axis, other = rng.normal(size=3), rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    other = np.cross(axis, other)
    own = {"axis": numbers(axis), "second_axis": numbers(other), "x_axis": numbers(other), "pitch": "0.07"}
    keys = ("axis",) * bool(row.coordinates) + tuple(dict.fromkeys((*row.needed, *filter(None, [row.second_key]))))
    lines = [
        "format = 1",
        'name = "one"',
        f'coordinates = "{coordinates}"',
        f"gravity = {numbers(6.0 * rng.normal(size=3))}",
        "[bodies.it]",
        f"mass = {rng.uniform(0.2, 5.0):.3f}",
        f"center_of_mass = {numbers(0.3 * rng.normal(size=3))}",
        f"inertia = {numbers(rng.uniform(0.1, 0.19, 3))}",
        "[joints.it]",
        f'type = "{kind}"',
        'parent = "base"',
        'child = "it"',
        f"position = {numbers(rng.normal(size=3))}",
        f"rotation = [{{ axis = [0, 1, 0], angle = {rng.uniform(0, 3):.3f} }}]",
        *(f"{key} = {own[key]}" for key in keys),
    ]
    if row.v_size == 1:
        lines += [f"friction = {{ coulomb = {rng.uniform(0.05, 3):.3f}, velocity = 0.5 }}"]
        lines += [f"initial = {{ position = {rng.uniform(-1, 1):.3f}, velocity = {rng.uniform(-2, 2):.3f} }}"]
    return "\n".join(lines)


@pytest.mark.slow
@pytest.mark.long_except_every(18)
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", ["prismatic", *OTHERS])
def test_partitioned_methods_run_on_every_joint(kind: str, seed: int, tmp_path: Path) -> None:
    poses = []
    for coordinates, methods in (("absolute", ("rk4_partitioned", "rk45_partitioned")), ("joint", ("rk4",))):
        path = tmp_path / f"{coordinates}.toml"
        path.write_text(scene(kind, coordinates, seed))
        for method in methods[: 1 + (seed == 1)]:
            model = eomgen.build(path, method=method, profile="quick")
            run = model.simulate(0.5, 1e-3, error_estimate=False)
            assert run.success, run.message
            poses.append(model.pose("it", run.q[-1]))
    for pose in poses[:-1]:
        assert np.max(np.abs(pose - poses[-1])) < 1e-8
