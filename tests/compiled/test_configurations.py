"""Steps, differences, neutral and random configurations, against matrix exponentials and Pinocchio."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import expm

import eomgen
from eomgen.compiled.arguments import check_quaternions
from eomgen.errors import UsageError
from eomgen.lie.product import Factor
from tests.models.scenes import flyer
from tests.oracles.pinocchio_oracle import oracle_from_urdf, robot_file
from tests.oracles.states import rotation_of

SOLO = robot_file("solo_description/robots/solo12.urdf")


@cache
def solo() -> eomgen.Model:
    scene = eomgen.load(SOLO, root="free", actuated=True)
    return eomgen.build(scene, terms=["mass"], profile="quick")


def test_steps_and_differences_are_pinocchios(rng: np.random.Generator) -> None:
    model = solo()
    oracle = oracle_from_urdf(SOLO, eomgen.load(SOLO, root="free"), "free")
    q = model.random(6, generator=rng)
    dq = rng.normal(size=(6, model.nv))
    moved, back = model.integrate(q, dq), model.difference(q[:5], q[1:])
    for k in range(6):
        expected = pin.integrate(oracle.model, oracle.q(q[k]), oracle.v(dq[k]))
        found = oracle.q(moved[k])
        sign = np.sign(found[3:7] @ expected[3:7])
        np.testing.assert_allclose(np.r_[found[:3], sign * found[3:7], found[7:]], expected, atol=1e-13)
    for k in range(5):
        expected = pin.difference(oracle.model, oracle.q(q[k]), oracle.q(q[k + 1]))[oracle.order]
        np.testing.assert_allclose(back[k], expected, atol=1e-12)


def test_a_step_of_a_free_body_is_the_exponential_of_its_twist(rng: np.random.Generator) -> None:
    model = solo()
    q, dq = model.neutral(), rng.normal(size=model.nv)
    assert q[:7].tolist() == [1.0, 0, 0, 0, 0, 0, 0] and not q[7:].any()
    omega, velocity = dq[:3], dq[3:6]
    twist = np.zeros((4, 4))
    twist[:3, :3], twist[:3, 3] = np.cross(np.eye(3), omega), velocity
    pose = expm(twist)
    found = model.integrate(q, dq)
    np.testing.assert_allclose(rotation_of(found[:4]), pose[:3, :3], atol=1e-14)
    np.testing.assert_allclose(found[4:7], pose[:3, 3], atol=1e-14)
    np.testing.assert_allclose(found[7:], dq[6:], atol=1e-15)


def test_differences_undo_steps_in_batches(rng: np.random.Generator) -> None:
    model = flyer()
    q, dq = model.random((3, 1), generator=1), 0.9 * rng.normal(size=(4, model.nv))
    back = model.difference(q, model.integrate(q, dq))
    np.testing.assert_allclose(back, np.broadcast_to(dq, (3, 4, model.nv)), atol=1e-12)
    np.testing.assert_array_equal(model.random(2, generator=5), model.random(2, generator=5))


def test_random_stays_within_limits() -> None:
    path = robot_file("ur_description/urdf/ur5_joint_limited_robot.urdf")
    model = eomgen.build(eomgen.load(path, limits=True), terms=["mass"], profile="quick")
    q = model.random(2000, generator=2)
    lower = [model.description.limits[k].lower.value for k in range(6)]
    upper = [model.description.limits[k].upper.value for k in range(6)]
    assert np.all(q >= lower) and np.all(q <= upper)
    np.testing.assert_allclose(q.mean(axis=0), np.add(lower, upper) / 2, atol=0.05 * np.subtract(upper, lower).max())
    free = solo().random(2000, generator=3)
    assert np.abs(np.mean(rotation_of(free[:, :4]), axis=0)).max() < 0.06  # uniform orientations have mean zero


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "ends"),
    [
        ({"lower": 4.0}, (4.0, 4.0 + np.pi)),
        ({"upper": -4.0}, (-4.0 - np.pi, -4.0)),
        ({"lower": 1.0}, (1.0, np.pi)),
        ({"lower": np.pi}, (np.pi, 2.0 * np.pi)),
    ],
)
def test_random_reaches_out_from_a_limit_of_one_side(limits: dict[str, float], ends: tuple[float, float]) -> None:
    builder = eomgen.SceneBuilder("door").body("leaf", mass=1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("hinge", "revolute", "base", "leaf", axis=[0, 1, 0], limits=limits | {"stiffness": 10.0})
    q = eomgen.build(builder.build(), terms=["mass"], profile="quick").random(2000, generator=2)
    np.testing.assert_allclose((q.min(), q.max()), ends, atol=0.01)
    assert np.all((q >= ends[0]) & (q <= ends[1]))


def test_what_is_said_of_mistakes() -> None:
    with pytest.raises(UsageError, match=r"dq: the shape is \(3,\), \(..., 18\) is needed"):
        solo().integrate(solo().neutral(), np.zeros(3))
    with pytest.raises(UsageError, match=r"random: .*; try: random"):
        solo().random("many")
    with pytest.raises(UsageError, match="one set of parameters is needed, not a batch of shape"):
        solo().random(2, parameters=np.zeros((2, len(solo().evaluator.parameter_names))))


# few are looked over one by one
@pytest.mark.parametrize(("count", "batch"), [(1, ()), (2, (2, 3)), (31, (1,)), (32, (3,)), (40, ())])
def test_each_quaternion_has_to_be_of_unit_length(count: int, batch: tuple[int, ...], rng: np.random.Generator) -> None:
    factors = [Factor("SE3", f"body {k}", 8 * k + 1, 7, 7 * k + 1, 6) for k in range(count)]
    factors = [one for k, free in enumerate(factors) for one in (Factor("R", f"hinge {k}", 8 * k, 1, 7 * k, 1), free)]
    q = rng.normal(size=(*batch, 8 * count))
    for k in range(count):
        q[..., 8 * k + 1 : 8 * k + 5] /= np.linalg.norm(q[..., 8 * k + 1 : 8 * k + 5], axis=-1, keepdims=True)
    check_quaternions("q", q, factors)
    for k in {0, count // 2, count - 1}:
        for length in (0.999, 1.001, 2.0):
            wrong = q.copy()
            wrong[(*(size - 1 for size in batch), slice(8 * k + 1, 8 * k + 5))] *= length
            with pytest.raises(UsageError, match=rf"{8 * k + 1}:{8 * k + 5}\]: the quaternion .* length {length:g}"):
                check_quaternions("q", wrong, factors)
