"""The right-angle cantilever: its energy after the push, and its moment of momentum by what the clamp transmits."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.oracles.states import rotation_of

cantilever: Any = SimpleNamespace(
    **runpy.run_path(str(Path(__file__).parents[2] / "examples" / "right_angle_cantilever" / "cantilever.py"))
)


@pytest.mark.long
def test_it_keeps_its_energy_at_second_order_and_turns_as_loads_on_its_clamp_say() -> None:
    """The moment about the clamp of all momenta changes by that of the push and of the clamp (Newton and Euler)."""
    scene = cantilever.scene(3)
    scene["outputs"]["reaction"] = {"reaction_moment": "clamp"}
    model = eomgen.build(scene, profile="quick")
    kept = []
    for step in (0.02, 0.01):
        run = model.simulate(6.0, step, error_estimate=False)
        assert run.success, run.message
        kept.append(cantilever.energy_kept(run)[1])
        np.testing.assert_allclose(
            run.outputs["root"], -run.outputs["reaction"], atol=1e-6 * np.abs(run.outputs["root"]).max()
        )
    assert kept[1] < 1e-4
    assert np.log2(kept[0] / kept[1]) == pytest.approx(2.0, abs=0.3)
    bodies, pose = list(model.bodies), model.evaluate("poses", run.q)["pose"]
    twist = model.evaluate("twists", run.q, run.v)["twist"]
    spin = np.zeros((len(run.t), 3))
    for leg in ("arm", "forearm"):
        nodes = [name for name in bodies if name.partition(".")[0] == leg]
        for place, name in enumerate(nodes):
            k = bodies.index(name)
            share = 10.0 / 3.0 * (0.5 if place in (0, 3) else 1.0)
            R = rotation_of(pose[:, k, :4])
            velocity = np.einsum("tij,tj->ti", R, twist[:, k, 3:])
            own = np.einsum("tij,tj->ti", R, np.array([20.0, 10.0, 10.0]) * twist[:, k, :3])
            spin += share * (np.cross(pose[:, k, 4:], velocity) + own)
    push = 50.0 * np.maximum(0.0, 1.0 - np.abs(run.t - 1.0))
    torque = run.outputs["reaction"] + np.cross(run.outputs["elbow"], push[:, None] * np.array([0.0, 0.0, 1.0]))
    step = run.t[1] - run.t[0]
    summed = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * step * (torque[1:] + torque[:-1]), axis=0)])
    np.testing.assert_allclose(spin, summed, atol=2e-3 * np.abs(spin).max())
