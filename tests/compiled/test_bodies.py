"""Points and Jacobians of compiled models: against each other, against differences, in batches, and what is said of
mistakes."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import eomgen
from eomgen.lie import product
from tests.models.scenes import flyer_scene, pendulum_scene

TERMS = ["poses", "twists", "accelerations", "jacobians"]
R = np.array([0.1, -0.3, 0.2])
T = 0.31


@cache
def shaken() -> eomgen.Model:
    return eomgen.build(pendulum_scene(), terms=TERMS, profile="quick")


@cache
def flying() -> eomgen.Model:
    return eomgen.build(flyer_scene(), terms=TERMS, profile="quick")


def some_state(
    model: eomgen.Model, rng: np.random.Generator, count: int = 7
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q = np.array([product.update(model.factors, model.initial_q, rng.normal(size=model.nv)) for _ in range(count)])
    v, a = rng.normal(size=(2, count, model.nv))
    return q, v, a


@pytest.mark.parametrize("body", ["hull", "arm", "slug"])
def test_jacobians_take_velocities_to_twists_and_points(body: str, rng: np.random.Generator) -> None:
    model = flying()
    q, v, _ = some_state(model, rng)
    J, L = model.body_jacobian(body, q), model.point_jacobian(body, R, q)
    assert J.shape == (7, 6, model.nv) and L.shape == (7, 3, model.nv)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", J, v), model.twist(body, q, v), atol=1e-13)
    point = model.point(body, R, q, v)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", L, v), point.velocity, atol=1e-13)
    assert point.acceleration is None


@pytest.mark.parametrize(("model", "body"), [(shaken, "link"), (flying, "arm")])
def test_velocity_and_acceleration_are_differences_of_position(model, body: str, rng: np.random.Generator) -> None:
    """Central differences along q' = q tilde(v), v' = a and the base's law; their error is of the order of step
    squared."""
    model = model()
    q, v, a = (part[0] for part in some_state(model, rng))
    step = 1e-4

    def at(s: float) -> np.ndarray:
        # exp(s v + s^2 a / 2) is the motion to third order at s = 0, so its second difference is the acceleration
        return model.point(body, R, product.update(model.factors, q, s * v + 0.5 * s * s * a), t=T + s).position

    motion = model.point(body, R, q, v, T, a=a)
    np.testing.assert_allclose(motion.velocity, (at(step) - at(-step)) / (2 * step), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(motion.acceleration, (at(step) - 2 * at(0) + at(-step)) / step**2, rtol=1e-5, atol=1e-5)


def test_points_and_states_broadcast(rng: np.random.Generator) -> None:
    model = flying()
    q, v, a = some_state(model, rng, 4)
    corners = rng.normal(size=(5, 1, 3))
    motion = model.point("arm", corners, q, v, a=a)
    for part in motion:
        assert part is not None and part.shape == (5, 4, 3)
    L = model.point_jacobian("arm", corners, q)
    assert L.shape == (5, 4, 3, model.nv)
    np.testing.assert_array_equal(L[3, 2], model.point_jacobian("arm", corners[3, 0], q[2]))
    np.testing.assert_array_equal(
        motion.acceleration[3, 2], model.point("arm", corners[3, 0], q[2], v[2], a=a[2]).acceleration
    )


def test_a_force_on_a_point_does_the_work_that_its_jacobian_says(rng: np.random.Generator) -> None:
    """The generalized force of a force by formula, derived from virtual work, is the transposed Jacobian times the
    force."""
    builder = eomgen.SceneBuilder("pushed", gravity=[0, 0, 0])
    builder.body("upper", 1.0, inertia=[0.1, 0.2, 0.15]).body("lower", 1.0, inertia=[0.1, 0.2, 0.15])
    builder.joint("ball", "spherical", "base", "upper")
    builder.joint("hinge", "revolute", "upper", "lower", axis=[1, 2, 3], position=[0.2, 0, -0.5])
    builder.force("push", "lower", point=R.tolist(), force=[3.0, -1.0, 2.0])
    model = eomgen.build(builder.build(), terms=["force", "poses", "jacobians"], profile="quick")
    q, v, _ = some_state(model, rng)
    expected = np.einsum("nji,j->ni", model.point_jacobian("lower", R, q), [3.0, -1.0, 2.0])
    np.testing.assert_allclose(model.force(q, v), expected, atol=1e-13)


@pytest.mark.slow
def test_what_a_model_was_built_without_is_compiled_when_it_is_called_for(rng: np.random.Generator) -> None:
    few, whole = eomgen.build(flyer_scene(), terms=["forward_dynamics"], profile="quick"), flying()
    q, v, a = some_state(few, rng)
    for name in ("hull", "slug"):
        np.testing.assert_array_equal(few.pose(name, q), whole.pose(name, q))
        np.testing.assert_array_equal(few.twist(name, q, v), whole.twist(name, q, v))
        np.testing.assert_array_equal(few.body_jacobian(name, q), whole.body_jacobian(name, q))
        np.testing.assert_array_equal(few.point_jacobian(name, R, q), whole.point_jacobian(name, R, q))
        for found, expected in zip(few.point(name, R, q, v, a=a), whole.point(name, R, q, v, a=a), strict=True):
            np.testing.assert_array_equal(found, expected)
    assert few.terms == ("forward_dynamics",)
