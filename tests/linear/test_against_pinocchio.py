"""The state matrix of robots against Pinocchio's derivatives of forward dynamics (Carpentier and Mansard 2018)."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import eomgen
from eomgen.lie.product import bracket_matrix, update
from tests.oracles.pinocchio_oracle import oracle_from_urdf, robot_file

ROBOTS = {
    "panda": ("panda_description/urdf/panda.urdf", "fixed", ("panda_finger_joint1", "panda_finger_joint2")),
    "solo12": ("solo_description/robots/solo12.urdf", "free", ()),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_state_matrix(name: str, rng: np.random.Generator) -> None:
    path, root, lock = ROBOTS[name]
    scene = eomgen.load(robot_file(path), root=root, lock=lock)
    model = eomgen.build(
        scene, terms=["linearization", "forward_dynamics", "mass", "residual", "partials"], profile="instant"
    )
    oracle = oracle_from_urdf(robot_file(path), scene, root, lock)
    # numbers in a URDF
    damping = {joint.name: joint.damping.value for joint in scene.joints}  # type: ignore[union-attr]
    by_component = np.array([damping[factor.name] for factor in model.factors for _ in range(factor.v_size)])
    q = update(model.factors, model.initial_q, rng.uniform(-0.8, 0.8, model.nv))
    v = rng.uniform(-1.0, 1.0, model.nv)

    space = model.linearize(q, v).state_space()
    nv = model.nv
    state = {"q": q[np.newaxis], "v": v[np.newaxis], "tau": (-by_component * v)[np.newaxis]}
    by_q = oracle.each(lambda *given: pin.computeABADerivatives(*given)[0], state, "v", "tau")[0]
    by_v = oracle.each(lambda *given: pin.computeABADerivatives(*given)[1], state, "v", "tau")[0]
    inverse = np.linalg.inv(oracle.mass(state)[0])
    expected = np.block([[-bracket_matrix(model.factors, v), np.eye(nv)], [by_q, by_v - inverse * by_component]])
    scale = np.max(np.abs(expected), axis=1, keepdims=True)
    np.testing.assert_allclose(space.A / scale, expected / scale, rtol=0, atol=1e-11)
