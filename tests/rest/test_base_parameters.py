"""Base parameters: closed forms of plane arms, numbers of robots, and as many as the regressor's rank."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.scene.load import load
from eomgen.solvers.redundancy import NoRankGap, independent_columns, short
from tests.oracles.pinocchio_oracle import robot_file

TERMS = ["inverse_dynamics", "regressor", "regressor_parameters"]


def plane_arm(**given: object) -> eomgen.SceneBuilder:
    """Return two links in the vertical x-y plane, 0.5 m apart."""
    builder = eomgen.SceneBuilder("plane_arm", gravity=[0, -9.81, 0], **given).parameter("length", 0.5, tunable=True)
    for name, parent, place in (("upper", "base", [0, 0, 0]), ("lower", "upper", ["length", 0, 0])):
        builder.body(name, 2.0, center_of_mass=[0.2, 0, 0], inertia=[0.02, 0.05, 0.05])
        builder.joint(f"to_{name}", "revolute", parent, name, axis=[0, 0, 1], position=place, rotor_inertia=0.03)
    return builder


@pytest.mark.slow
def test_a_plane_arm_by_hand() -> None:
    model = eomgen.build(plane_arm().build(), TERMS)
    found = model.base_parameters()
    assert found.expressions == (
        "upper.first_moment_x + 0.5 lower.mass",
        "upper.first_moment_y",
        "upper.inertia_zz + 0.25 lower.mass + to_upper.rotor_inertia",
        "lower.first_moment_x",
        "lower.first_moment_y",
        "lower.inertia_zz",
        "to_lower.rotor_inertia",
    )
    about_origin = 0.05 + 2.0 * 0.2**2
    np.testing.assert_allclose(
        found.values, [0.4 + 1.0, 0, about_origin + 0.5 + 0.03, 0.4, 0, about_origin, 0.03], rtol=1e-12, atol=1e-15
    )
    assert {"upper.mass", "lower.inertia_xy", "upper.first_moment_z"} <= set(found.without_effect)
    assert len(found) == 7 and repr(found) == "<BaseParameters: 7 of 22 parameters>"
    assert str(found).startswith(
        "7 combinations of 22 parameters\n  upper.first_moment_x + 0.5 lower.mass = 1.4 kg m\n"
    )
    longer = model.base_parameters({"length": 1 / 3})
    assert longer.matrix[0, 10] == 1 / 3


@pytest.mark.slow
def test_they_decide_inverse_dynamics_and_no_fewer_do(rng: np.random.Generator) -> None:
    """Of a robot whose number is known to be 36 (Gautier's rules for six revolute joints, one along gravity)."""
    scene = load(robot_file("ur_description/urdf/ur5_robot.urdf"))
    model = eomgen.build(scene, TERMS)
    found = model.base_parameters()
    q, v, a = rng.normal(size=(3, 60, 6))
    Y, tau0 = model.regressor(q, v, a)
    tau = Y[..., found.columns] @ found.values + tau0
    np.testing.assert_allclose(tau, model.inverse_dynamics(q, v, a), rtol=1e-11, atol=1e-11)
    values = np.linalg.svd(Y.reshape(-1, Y.shape[-1]), compute_uv=False)
    assert len(found) == 36 == np.sum(values > 1e-10 * values[0])
    assert len(model.base_parameters(seed=5)) == 36
    with pytest.raises(UsageError, match="seed: a whole number from 0 on is needed, not -1; try: 0"):
        model.base_parameters(seed=-1)
    free = eomgen.build(load(robot_file("ur_description/urdf/ur5_robot.urdf"), root="free"), TERMS)
    assert len(free.base_parameters()) == 10 + 7 * 6  # nothing is at rest that could hide parameters of the root
    assert np.array_equal(model.base_parameters(seed=5).matrix, found.matrix)


@pytest.mark.slow
def test_what_has_none() -> None:
    builder = plane_arm()
    builder.constraint(
        "pin",
        "distance",
        {"body": "base", "position": [0, 0.5, 0]},
        {"body": "lower", "position": [0.3, 0, 0]},
        length="sqrt(0.89)",
    )
    looped = eomgen.build(builder.build(), ["mass"])
    with pytest.raises(
        UsageError, match="base_parameters: constraints share efforts out, so fewer combinations decide"
    ):
        looped.base_parameters()
    builder = eomgen.SceneBuilder("rod", coordinates="absolute").body("rod", 1.0, inertia=[0.1, 0.1, 0.1])
    absolute = eomgen.build(builder.joint("fall", "free", "base", "rod").build(), ["mass"])
    with pytest.raises(UsageError, match="regressor: in absolute coordinates q has positions of centres of mass"):
        absolute.base_parameters()


def test_independent_columns(rng: np.random.Generator) -> None:
    A = rng.normal(size=(40, 4))
    columns = np.stack([A[:, 0], 0 * A[:, 0], 1e-3 * A[:, 1], 2 * A[:, 0] - 1e-3 * A[:, 1] / 3, A[:, 2]], axis=1)
    found = independent_columns(columns)
    assert (found.kept, found.others) == ((0, 2, 4), (3,))
    assert found.coefficients.tolist() == [[2.0], [-1 / 3], [0.0]]
    close = np.stack([A[:, 0], A[:, 1], A[:, 0] + 3e-10 * A[:, 2], A[:, 1] + 5e-11 * A[:, 3]], axis=1)
    with pytest.raises(NoRankGap, match="a column differs from those before it by"):
        independent_columns(close)
    assert short(0.1 + 0.2) == 0.3 and short(1 / 7) == 1 / 7 and short(np.pi) == np.pi
    assert short(2.608225000000001e-4) == 2.608225e-4
