"""Efforts of chosen actuators: a slider-crank by its kinetic energy, redundant drives by the motion that they give.

By the same energy: the operational-space inertia of a slider that a crank and a rod hold.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import eomgen
from eomgen.compiled.actuators import ActuatorEfforts
from eomgen.errors import ModelError, NumericalError, UsageError
from tests.models.library import scene

R, L = 0.1, 0.3
CRANK, ROD, SLIDER = 1.0, 2.0, 3.0
CRANK_INERTIA, ROD_INERTIA = 0.01, 0.02
G = 9.81


@cache
def slider_crank() -> eomgen.Model:
    """Return a slider-crank in the x-z plane, the slider moving along x, every joint with an input."""
    builder = eomgen.SceneBuilder("slider_crank")
    builder.body("crank", CRANK, center_of_mass=[R / 2, 0, 0], inertia=[0, CRANK_INERTIA, 0.01])
    builder.body("rod", ROD, center_of_mass=[L / 2, 0, 0], inertia=[0, ROD_INERTIA, 0.02])
    builder.body("slider", SLIDER)
    builder.joint("turn", "revolute", "base", "crank", axis=[0, 1, 0])
    builder.joint("knee", "revolute", "crank", "rod", axis=[0, 1, 0], position=[R, 0, 0])
    builder.joint("rail", "prismatic", "base", "slider", axis=[1, 0, 0])
    end = {"body": "rod", "position": [L, 0, 0], "axis": [0, 1, 0]}
    builder.constraint("pin", "revolute", end, {"body": "slider", "axis": [0, 1, 0]})
    for joint in ("turn", "knee", "rail"):
        builder.input(f"at_{joint}").effort(joint, joint, f"at_{joint}")
    return eomgen.build(builder.build(), profile="quick")


def motion(angle: complex, rate: complex) -> tuple[list[complex], list[complex]]:
    """Return turn, knee and rail with their rates; turning about y, a positive angle leads downwards."""
    sine, cosine = R * np.sin(angle) / L, R * np.cos(angle) / L
    lean = -np.arcsin(sine)
    lean_rate = -cosine * rate / np.sqrt(1 - sine**2)
    place = R * np.cos(angle) + L * np.cos(lean)
    return [angle, lean - angle, place], [
        rate,
        lean_rate - rate,
        -R * np.sin(angle) * rate - L * np.sin(lean) * lean_rate,
    ]


def energies(angle: complex, rate: complex) -> tuple[complex, complex]:
    """Return kinetic and potential energy of the machine with one degree of freedom."""
    (_, knee, _), (_, knee_rate, slide) = motion(angle, rate)
    lean, lean_rate = angle + knee, rate + knee_rate
    vx = -R * np.sin(angle) * rate - L / 2 * np.sin(lean) * lean_rate
    vz = -R * np.cos(angle) * rate - L / 2 * np.cos(lean) * lean_rate
    turning = 0.5 * (CRANK_INERTIA + CRANK * R**2 / 4) * rate**2 + 0.5 * ROD_INERTIA * lean_rate**2
    kinetic = turning + 0.5 * ROD * (vx**2 + vz**2) + 0.5 * SLIDER * slide**2
    potential = -G * (CRANK * R / 2 * np.sin(angle) + ROD * (R * np.sin(angle) + L / 2 * np.sin(lean)))
    return kinetic, potential


def crank_torque(angle: float, rate: float, acceleration: float) -> float:
    """Return m a + m' rate^2 / 2 + V' by complex steps of the energies; m is twice the kinetic energy at rate 1."""
    step = 1e-30
    mass = 2.0 * energies(angle, 1.0)[0].real
    change = 2.0 * energies(angle + 1j * step, 1.0)[0].imag / step
    weight = energies(angle + 1j * step, 0.0)[1].imag / step
    return mass * acceleration + 0.5 * change * rate**2 + weight


def state(angle: float, rate: float, acceleration: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    step = 1e-30
    q, v = (np.real(part) for part in motion(angle, rate))
    a = np.imag(motion(angle + 1j * step * rate, rate + 1j * step * acceleration)[1]) / step
    return np.array(q), np.array(v), a


@pytest.mark.parametrize("angle", [0.3, -2.4])
def test_torque_at_the_crank_is_that_of_one_degree_of_freedom(angle: float) -> None:
    q, v, a = state(angle, 3.0, -7.0)
    found = slider_crank().actuator_efforts(q, v, a, ["turn"])
    assert found.unique and found.internal == () and found.names == ("turn",)
    np.testing.assert_allclose(found.efforts, [crank_torque(angle, 3.0, -7.0)], rtol=1e-11)
    slide = v[2] / v[0]
    at_rail = slider_crank().actuator_efforts(q, v, a, ["rail"])
    np.testing.assert_allclose(at_rail.efforts * slide, found.efforts, rtol=1e-11)  # the same power


def test_efforts_and_multipliers_give_the_motion() -> None:
    model = slider_crank()
    q, v, a = (np.stack(part) for part in zip(*(state(x, 2.0, 1.0) for x in (0.4, 1.1, 2.2)), strict=True))
    found = model.actuator_efforts(q, v, a)
    assert found.names == ("at_turn", "at_knee", "at_rail") and found.null_space.shape == (3, 3, 2)
    assert not found.unique and all("at_turn" in words or "at_knee" in words for words in found.internal)
    for internal in (0.0, 5.0):
        u = found.efforts + internal * found.null_space[..., 0] - internal * found.null_space[..., 1]
        np.testing.assert_allclose(model.forward_dynamics(q, v, u=u), a, atol=1e-9)
    reached, multipliers = model.constrained_dynamics(q, v, u=found.efforts)
    np.testing.assert_allclose(multipliers, found.multipliers, atol=1e-8 * np.abs(multipliers).max())
    np.testing.assert_allclose(
        np.einsum("nij,nik->njk", found.null_space, found.null_space), [np.eye(2)] * 3, atol=1e-13
    )
    others = found.efforts + found.null_space[..., 0]
    assert np.all(np.linalg.norm(found.efforts, axis=-1) < np.linalg.norm(others, axis=-1))
    assert reached.shape == a.shape


def test_inertia_of_a_frame_that_a_loop_holds() -> None:
    """Kinetic energy is half of the crank's inertia times its rate squared, and of the slider's times its velocity."""
    model, angles = slider_crank(), np.array([0.4, 1.1, -2.2])
    q = np.stack([state(angle, 1.0, 0.0)[0] for angle in angles])
    inertia = np.array([2.0 * energies(angle, 1.0)[0].real for angle in angles])
    slide = np.array([np.real(motion(angle, 1.0)[1][2]) for angle in angles])
    for frame, rows, ratio in (("slider", [3], slide), ("crank", [1], np.ones(3)), ("rod", [1], lean_rates(angles))):
        found = model.operational_inertia(frame, q, rows=rows)
        np.testing.assert_allclose(found[:, 0, 0], inertia / ratio**2, rtol=1e-11)
    v = np.zeros_like(q)
    J = model.jacobian("slider", q, reference="local_world_aligned")[:, 3:4]
    push = np.array([0.0, 0.0, 7.0])  # of the rail's input
    gained = model.forward_dynamics(q, v, u=push) - model.forward_dynamics(q, v, u=np.zeros(3))
    found = model.operational_inertia("slider", q, rows=[3])[:, 0]
    np.testing.assert_allclose(7.0 / found, np.einsum("nij,nj->ni", J, gained), rtol=1e-9)
    for rows, at in (([3, 4], q), ([3], state(0.0, 1.0, 0.0)[0])):
        what = (
            "of slider is singular: there is a direction in which it cannot move, for joints and constraints together"
        )
        with pytest.raises(NumericalError, match=what):
            model.operational_inertia("slider", at, rows=rows)


def lean_rates(angles: np.ndarray) -> np.ndarray:
    return np.array([sum(np.real(motion(angle, 1.0)[1][:2])) for angle in angles])


def test_trees_are_a_special_case(rng: np.random.Generator) -> None:
    terms = ["mass", "inverse_dynamics", "force", "residual"]
    model = eomgen.build(scene("double_pendulum", events=None), terms=terms, profile="quick")
    q, v, a = rng.normal(size=(3, 4, 2))
    found = model.actuator_efforts(q, v, a, ["elbow", "shoulder"])
    np.testing.assert_allclose(found.efforts[:, ::-1], model.inverse_dynamics(q, v, a), atol=1e-12)
    assert found.multipliers.shape == (4, 0) and found.unique
    with pytest.raises(NumericalError, match=r"actuators shoulder cannot give this motion: \S+ remains along v.elbow"):
        model.actuator_efforts(q, v, a, ["shoulder"])
    with pytest.raises(UsageError, match="there are no actuators: the scene has no inputs that a caller drives"):
        model.actuator_efforts(q, v, a)


def test_what_is_said_of_mistakes() -> None:
    model = slider_crank()
    q, v, a = state(0.4, 1.0, 0.0)
    with pytest.raises(UsageError, match="there is no actuator 'trun'; try: turn"):
        model.actuator_efforts(q, v, a, ["trun"])
    with pytest.raises(UsageError, match=r"a: the accelerations do not meet the constraint pin: .* off by"):
        model.actuator_efforts(q, v, a + np.array([0.0, 1.0, 0.0]), ["turn"])


def test_accelerations_that_are_off_by_forces_of_constraints_are_mended() -> None:
    model = slider_crank()
    q, v, a = state(0.4, 1.0, 2.0)
    (B,) = model.evaluate("constraint_jacobian", q).values()
    off = a + 1e-4 * np.linalg.solve(model.mass(q), B.T @ np.ones(len(B)))
    with pytest.raises(UsageError, match="try: tolerance=1e-2 for accelerations of an implicit run"):
        model.actuator_efforts(q, v, off, ["turn"])
    mended = model.actuator_efforts(np.stack([q, q]), v, off, ["turn"], tolerance=1e-2).efforts
    exact = model.actuator_efforts(q, v, a, ["turn"]).efforts
    np.testing.assert_allclose(mended, np.stack([exact, exact]), rtol=1e-11)


def test_held_coordinates_keep_their_values() -> None:
    model = slider_crank()
    q, v, _ = state(0.4, 1.0, 0.0)
    guess = q + np.array([0.0, 0.05, -0.01])
    for name in ("turn", "q.turn", ["turn"]):
        held = model.consistent(guess, [1.0, 0.0, 0.0], hold=name)
        assert held.q[0] == 0.4 and held.v[0] == 1.0
        np.testing.assert_allclose(held.q, np.real(q), atol=1e-12)
        np.testing.assert_allclose(held.v, np.real(v), atol=1e-12)
    assert abs(model.consistent(guess, [1.0, 0.0, 0.0]).q[0] - 0.4) > 1e-3
    with pytest.raises(ModelError, match=r"cannot be met together: .*; try: fewer names in hold, an"):
        model.consistent(guess, v, hold=["turn", "rail"])


def test_efforts_print_by_name_and_whether_they_are_unique() -> None:
    none = np.zeros(0)
    one = ActuatorEfforts(("left", "right"), np.array([1.5, -2.0]), none, np.zeros((2, 0)))
    assert repr(one) == "<ActuatorEfforts: left 1.5, right -2; unique>"
    many = ActuatorEfforts(("left", "right"), np.zeros((4, 2)), np.zeros((4, 0)), np.ones((4, 2, 1)))
    assert repr(many) == "<ActuatorEfforts: left, right at 4 states; the least of many>"
