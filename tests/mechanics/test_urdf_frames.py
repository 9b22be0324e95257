"""Frames and centroidal terms of URDFs of example-robot-data, against Pinocchio to 1e-11.

Pinocchio's model has the placements and inertias that the scene has, whose right angles are exact. Joints that follow
others move on their own there; its columns are projected.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from eomgen.errors import EomgenError
from eomgen.mechanics.derive import derive
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from eomgen.system.terms import REFERENCES
from tests.oracles.evaluation import Array, tape_evaluator
from tests.oracles.states import random_states, rotation_of
from tests.oracles.urdf_robots import oracle_of_scene, robot_files

SWAP = [3, 4, 5, 0, 1, 2]
TOLERANCE = 1e-11
#: Links whose frames are compared in each file: all of them where there are no more, else evenly chosen ones.
MOST_FRAMES = 5
OF_PINOCCHIO = {"body": pin.LOCAL, "local_world_aligned": pin.LOCAL_WORLD_ALIGNED, "world": pin.WORLD}
#: Every sixth file, and two that the first tier has.
FIRST = ("solo_description/robots/solo12.urdf", "ur_description/urdf/ur5_robot.urdf")
CHOSEN = sorted({*list(robot_files())[::6], *FIRST})
KINDS = ("frame_jacobians", "frame_jacobian_rates", "frame_drifts")
CENTROIDAL = (
    "center_of_mass", "center_of_mass_jacobian", "center_of_mass_drift", "centroidal_momentum",
    "centroidal_momentum_rate", "centroidal_drift",
)  # fmt: skip  # a table
TERMS = ["frame_poses", *(f"{kind}{ending}" for kind in KINDS for ending, _ in REFERENCES.values()), *CENTROIDAL]


def loaded(path: Path) -> tuple[str, Scene | None]:
    """Return how a file's root can be held, free where that loads, since it has more columns, and the scene."""
    for root in ("free", "fixed"):
        with contextlib.suppress(EomgenError):
            return root, load(path, root=root)
    return "", None


def chosen(scene: Scene) -> list[str]:
    names = [frame.name for frame in scene.frames_of_terms()]
    return names[:: max(1, -(-len(names) // MOST_FRAMES))]


def off(found: Array, expected: Array) -> float:
    size = float(np.linalg.norm(expected))
    return float(np.linalg.norm(found - expected)) / (size if size > 1e-9 else 1.0)


@pytest.mark.slow_except(*FIRST)
@pytest.mark.parametrize("name", CHOSEN)
def test_frames_and_momentum(name: str, rng: np.random.Generator) -> None:
    path = robot_files()[name]
    root, scene = loaded(path)
    if scene is None:
        assert Path(name).stem in ("alex_psyonic_hands", "romeo", "romeo_laas_small", "ur3")
        return
    scene = load(path, root=root, task_frames=chosen(scene))
    oracle, configuration, P = oracle_of_scene(path, scene, root)
    system = derive(scene, TERMS)
    state = random_states(system, 2, rng)
    evaluate = tape_evaluator(system)
    values = {term: evaluate(term, state) for term in TERMS}
    model, data = oracle.model, oracle.data
    written = {frame.name: number for number, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY}
    fixed = {frame.name for frame in scene.frames}
    compared = 0
    for k in range(2):
        q, v = oracle.q(configuration(state["q"])[k]), oracle.v(state["v"][k] @ P.T)
        pin.computeJointJacobians(model, data, q)
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        pin.updateFramePlacements(model, data)
        for place, frame in enumerate(system.frames):
            if frame not in written or (frame not in fixed and model.frames[written[frame]].placement != pin.SE3(1)):
                continue
            number = written[frame]
            pose = values["frame_poses"]["frame_pose"][k, place]
            assert np.abs(rotation_of(pose[:4]) - data.oMf[number].rotation).max() <= TOLERANCE
            assert np.abs(pose[4:] - data.oMf[number].translation).max() <= TOLERANCE
            for reference, (ending, _) in REFERENCES.items():
                J = pin.getFrameJacobian(model, data, number, OF_PINOCCHIO[reference])
                rate = pin.getFrameJacobianTimeVariation(model, data, number, OF_PINOCCHIO[reference])
                J, rate = (matrix[np.ix_(SWAP, oracle.order)] @ P for matrix in (J, rate))
                for kind, expected in zip(KINDS, (J, rate, rate @ state["v"][k]), strict=True):
                    found = next(iter(values[f"{kind}{ending}"].values()))[k, place]
                    assert off(found, expected) <= TOLERANCE, (frame, kind, ending)
                    compared += 1
        rate = pin.dccrba(model, data, q, v)[np.ix_(SWAP, oracle.order)] @ P
        A = data.Ag[np.ix_(SWAP, oracle.order)] @ P
        J = pin.jacobianCenterOfMass(model, data, q)[:, oracle.order] @ P
        c = pin.centerOfMass(model, data, q)
        of_mass = rate[3:] @ state["v"][k] / data.mass[0]
        expected_values = (c, J, of_mass, A, rate, rate @ state["v"][k])
        for term, expected in zip(CENTROIDAL, expected_values, strict=True):
            assert off(next(iter(values[term].values()))[k], expected) <= TOLERANCE, term
    assert compared > 0
