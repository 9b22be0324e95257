"""The compiled functions against the textbook pendulum, against each other, and what is said of wrong arguments."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.compiled.coordinates import coordinate_units
from eomgen.lie.product import Factor
from eomgen.system.description import Coordinates
from tests.models.scenes import (
    DAMPING,
    GRAVITY,
    INERTIA,
    LENGTH,
    MASS,
    RATE,
    SHAKE,
    flyer,
    flyer_scene,
    pendulum,
    pendulum_scene,
)

Q, V, A, T = np.array([0.7]), np.array([-1.1]), np.array([2.3]), 0.31


def _support_acceleration(t: float, shake: float = SHAKE) -> float:
    return -shake * RATE**2 * float(np.sin(RATE * t))


def test_separated_terms_of_the_pendulum() -> None:
    model = pendulum()
    s, c = np.sin(Q), np.cos(Q)
    np.testing.assert_allclose(model.mass(Q), [[MASS * LENGTH**2 + INERTIA]], rtol=1e-14)
    np.testing.assert_allclose(model.coupling(Q, V), [0.0], atol=1e-14)
    np.testing.assert_allclose(model.base_motion(Q, V, T), -MASS * LENGTH * c * _support_acceleration(T), rtol=1e-13)
    expected = -MASS * GRAVITY * LENGTH * s - DAMPING * V + 0.2 * np.sin(3.0 * T)
    np.testing.assert_allclose(model.force(Q, V, T), expected, rtol=1e-13)
    np.testing.assert_allclose(model.force(Q, V, T, [4.0]), expected - 0.2 * np.sin(3.0 * T) + 4.0, rtol=1e-13)
    np.testing.assert_allclose(model.force(Q, V, T, {"torque": 4.0}), model.force(Q, V, T, [4.0]), rtol=0)


def test_dynamics_and_partials_of_the_pendulum() -> None:
    model = pendulum()
    inertia = MASS * LENGTH**2 + INERTIA
    tau = model.mass(Q) @ A + model.coupling(Q, V) + model.base_motion(Q, V, T) - model.force(Q, V, T)
    np.testing.assert_allclose(model.inverse_dynamics(Q, V, A, T), tau, rtol=1e-13)
    np.testing.assert_allclose(model.forward_dynamics(Q, V, T), A - tau / inertia, rtol=1e-13)
    K, C, M = model.partials(Q, V, A, T)
    stiffness = MASS * LENGTH * (GRAVITY * np.cos(Q) + np.sin(Q) * _support_acceleration(T))
    np.testing.assert_allclose([K[0, 0], C[0, 0], M[0, 0]], [stiffness[0], DAMPING, inertia], rtol=1e-13)


def test_poses_points_outputs_and_energies_of_the_pendulum() -> None:
    model = pendulum()
    s, c = float(np.sin(Q[0])), float(np.cos(Q[0]))
    support, speed = SHAKE * np.sin(RATE * T), SHAKE * RATE * np.cos(RATE * T)
    pose = model.pose("link", Q, T)
    np.testing.assert_allclose(pose, [np.cos(Q[0] / 2), 0, np.sin(Q[0] / 2), 0, support, 0, 0], atol=1e-15)
    tip = model.point("link", [0, 0, -2 * LENGTH], Q, V, T)
    np.testing.assert_allclose(tip.position, [support - 2 * LENGTH * s, 0, -2 * LENGTH * c], atol=1e-15)
    assert tip.velocity is not None
    np.testing.assert_allclose(tip.velocity, [speed - 2 * LENGTH * c * V[0], 0, 2 * LENGTH * s * V[0]], atol=1e-14)
    outputs = model.outputs(Q, V, t=T)
    np.testing.assert_allclose(outputs["tip"], tip.position, atol=1e-15)
    np.testing.assert_allclose(outputs["angle"], Q[0], rtol=0)
    energy = model.energy(Q, V, t=T)
    center = np.array([speed - LENGTH * c * V[0], LENGTH * s * V[0]])
    np.testing.assert_allclose(energy["kinetic"], 0.5 * MASS * center @ center + 0.5 * INERTIA * V[0] ** 2, rtol=1e-13)
    np.testing.assert_allclose(energy["potential"], -MASS * GRAVITY * LENGTH * c, rtol=1e-13)
    np.testing.assert_allclose(energy["total"], energy["kinetic"] + energy["potential"], rtol=0)
    np.testing.assert_allclose(energy["power"], -DAMPING * V[0] ** 2 + 0.2 * np.sin(3 * T) * V[0], rtol=1e-12)


def test_parameters_by_name_by_array_and_by_batch() -> None:
    model = pendulum()
    lengths = np.array([0.3, 0.6, 0.9])
    masses = model.mass(Q, parameters={"length": lengths})
    np.testing.assert_allclose(masses[:, 0, 0], MASS * lengths**2 + INERTIA, rtol=1e-14)
    np.testing.assert_allclose(model.mass(Q, parameters=[0.6, 0.0])[0, 0], masses[1, 0, 0], rtol=0)
    np.testing.assert_array_equal(model.mass(Q, parameters={"length": "600 mm"}), masses[1])


def test_base_can_be_handed_in() -> None:
    model = pendulum()
    state = model.base(T)
    assert state.shape == (19,)
    np.testing.assert_allclose(model.base_motion(Q, V, base=state), model.base_motion(Q, V, T), rtol=0)
    state[16] = 5.0
    np.testing.assert_allclose(model.base_motion(Q, V, base=state), -MASS * LENGTH * np.cos(Q) * 5.0, rtol=1e-13)


def test_leading_axes_broadcast() -> None:
    model = pendulum()
    q, v, t = np.linspace(-1, 1, 5).reshape(5, 1, 1), np.linspace(0, 2, 3).reshape(3, 1), np.linspace(0, 1, 3)
    tau = model.inverse_dynamics(q, v, A, t)
    assert tau.shape == (5, 3, 1)
    for i in range(5):
        for j in range(3):
            assert tau[i, j] == model.inverse_dynamics(q[i, 0], v[j], A, t[j])
    assert model.mass(q).shape == (5, 1, 1, 1)
    assert model.pose("link", q, t).shape == (5, 3, 7)
    assert model.outputs(q, v, A, t)["tip"].shape == (5, 3, 3)
    assert model.outputs(q, v, A, t)["angle"].shape == (5, 3)
    assert model.mass(np.zeros((0, 1))).shape == (0, 1, 1)


def test_rates_of_quaternions_follow_the_velocity(rng: np.random.Generator) -> None:
    from eomgen.lie import product

    model = flyer()
    q = product.update(model.factors, model.initial_q, rng.normal(size=model.nv))
    v = rng.normal(size=model.nv)
    rate = model.rhs(0.0, np.concatenate([q, v]))
    small = 1e-6
    ahead, behind = (product.update(model.factors, q, sign * small * v) for sign in (1.0, -1.0))
    np.testing.assert_allclose(rate[: model.nq], (ahead - behind) / (2 * small), atol=2e-9)
    np.testing.assert_allclose(rate[model.nq :], model.forward_dynamics(q, v), rtol=1e-12)


def test_base_at_rest_has_no_base_terms() -> None:
    model = flyer()
    assert not np.any(model.base_motion(np.broadcast_to(model.initial_q, (4, model.nq)), model.initial_v))
    np.testing.assert_array_equal(model.base(3.0)[:7], [1, 0, 0, 0, 0, 0, 0])
    with pytest.raises(eomgen.UsageError, match=r"base: the base of this scene is at rest; try: a \[base\] section"):
        model.force(model.initial_q, model.initial_v, base=np.zeros(19))


def test_in_absolute_coordinates_a_moving_base_has_no_inertia_terms() -> None:
    builder = eomgen.SceneBuilder("shaken", coordinates="absolute").base(position=["0.1 * cos(6 * t)", 0, 0])
    builder.body("bob", mass=1.0, inertia=[0.01, 0.01, 0.01]).joint("ball", "spherical", "base", "bob")
    model = eomgen.build(builder.build(), ["inverse_dynamics"], profile="quick")
    for base, shape in ((None, (3, 6)), (model.base(T), (3, 6)), (model.base([[0.1], [0.2]]), (2, 3, 6))):
        found = model.base_motion(np.broadcast_to(model.initial_q, (3, 7)), np.ones(6), T, base=base)
        np.testing.assert_array_equal(found, np.zeros(shape))
    with pytest.raises(eomgen.UsageError, match=r"base: the shape is \(3,\)"):
        model.base_motion(model.initial_q, np.ones(6), base=[1.0, 2.0, 3.0])


def test_terms_with_weights_are_no_terms_to_evaluate() -> None:
    model = eomgen.build(pendulum_scene(), ["second_partials", "outputs_hessian"], profile="quick")
    for term, call in (
        ("second_partials", "sensitivities(...).hessian"),
        ("outputs_hessian", 'hessian("outputs", weights,'),
    ):
        text = f"weights: the term {term} needs weights; try: model.{call}"
        with pytest.raises(eomgen.UsageError, match=re.escape(text)):
            model.evaluate(term, Q, V, A)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda m: m.mass([1.0, 2.0]), "usage error: q: the shape is (2,), (..., 1) is needed"),
        (lambda m: m.coupling(Q, 1.0), "usage error: v: the shape is (), (..., 1) is needed"),
        (lambda m: m.mass(["x"]), "usage error: q: an array of real numbers is needed, not list"),
        (lambda m: m.mass([1j]), "usage error: q: an array of real numbers is needed, not list"),
        (lambda m: m.force(Q, V, T, [1.0, 2.0]), "usage error: u: the shape is (2,), (..., 1) is needed"),
        (lambda m: m.force(Q, V, T, {"torqe": 1.0}), "usage error: there is no input 'torqe'; try: torque"),
        (lambda m: m.mass(Q, parameters={"lenght": 1.0}), "usage error: there is no parameter 'lenght'; try: length"),
        (
            lambda m: m.mass(Q, parameters={"length": "600 kg"}),
            "usage error: parameter length: '600 kg' is a mass, a length in m is expected; try: \"600 m\"",
        ),
        (lambda m: m.mass(Q, parameters=[1.0]), "usage error: parameters: the shape is (1,), (..., 2) is needed"),
        (
            lambda m: m.mass(Q, parameters={"length": np.nan}),
            "usage error: parameters: parameter length is nan, not a finite number",
        ),
        (lambda m: m.pose("lnk", Q), "usage error: there is no body 'lnk'; try: link"),
        (lambda m: m.point("link", [0, 0], Q), "usage error: r: the shape is (2,), (..., 3) is needed"),
        (lambda m: m.inverse_dynamics(np.zeros((3, 1)), np.zeros((2, 1)), A), "the leading axes do not broadcast"),
    ],
)
def test_wrong_arguments_are_named(call: Callable[[eomgen.Model], Any], text: str) -> None:
    with pytest.raises(eomgen.UsageError, match=re.escape(text)):
        call(pendulum())


def test_quaternions_must_be_of_unit_length() -> None:
    q = flyer().initial_q.copy()
    q[7] = 1.1
    with pytest.raises(
        eomgen.UsageError,
        match=r"q\[\.\.\., 7:11\]: the quaternion \(w, x, y, z\) of this joint has length 1\.1, not 1",
    ):
        flyer().mass(q)


def test_only_the_terms_a_method_needs_are_enough_for_it() -> None:
    model = eomgen.build(flyer_scene(), terms=["forward_dynamics"], profile="quick")
    run = model.simulate(0.1, 1e-2, method="rk4")
    np.testing.assert_allclose(run.q[-1], flyer().simulate(0.1, 1e-2, method="rk4").q[-1], rtol=0, atol=1e-14)
    assert run.outputs == {} and run.energy == {}


def test_units_follow_groups_and_joints() -> None:
    model = flyer()
    assert model.q_units == [*["1"] * 4, *["m"] * 3, *["1"] * 4, "m"]
    assert model.v_units == [*["rad/s"] * 3, *["m/s"] * 3, *["rad/s"] * 3, "m/s"]
    assert model.q_names[6:8] == ["q.root[6]", "q.ball[0]"] and model.v_names[-1] == "v.slide"


def test_units_are_those_of_groups_and_those_said() -> None:
    last = Factor("R", "rail.position", 7, 1, 6, 1)
    factors = [Factor("SO3", "top.orientation", 0, 4, 0, 3), Factor("R", "top.position", 4, 3, 3, 3), last]
    said = [Coordinates("rail.position", ("rad",)), Coordinates("top.position", ("m",) * 3)]
    assert coordinate_units(factors, said) == ([*["1"] * 4, *["m"] * 3, "rad"], [*["rad/s"] * 3, *["m/s"] * 3, "rad/s"])


def test_models_and_solutions_show_what_they_are() -> None:
    assert repr(pendulum()).startswith("<Model shaken: nq 1, nv 1, nu 1; mass, coupling, ")
    assert repr(pendulum().simulate(0.01)) == "<Solution of shaken: 11 rows; reached t = 0.01 s in 10 steps>"
