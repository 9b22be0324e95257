"""Inertias of bodies: measured ones slightly beyond the triangle inequality, rotors about one axis, shafts without
mass."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.arrays import Array
from eomgen.errors import DescriptionError
from eomgen.scene.load import load_toml

SHIP = """format = 1
name = "ship"
gravity = [0, 0, 0]
bodies.ship = {{ mass = 3.0, inertia = [1.0, 1.2, 1.5] }}
bodies.wheel = {{ mass = 0.5, inertia = {inertia}{consent} }}
joints.free = {{ type = "free", parent = "base", child = "ship", initial = {{ velocity = [0.3, -0.2, 0.5, 0, 0, 0] }} }}
joints.spin = {{ type = "revolute", parent = "ship", child = "wheel", axis = {axis}, initial = {{ velocity = 20 }} }}
efforts.motor = {{ joint = "spin", effort = "-0.05 * v.spin" }}
"""


CONSENT = ", check_inertia = false"


def ship(inertia: str, consent: str = "", axis: str = "[0, 0, 1]") -> str:
    return SHIP.format(inertia=inertia, consent=consent, axis=axis)


def test_a_measured_inertia_is_taken_and_the_note_says_by_how_much_it_misses() -> None:
    """2.3 % beyond, as of a bicycle's measured front frame."""
    (note,) = load_toml(ship("[0.1, 0.1, 0.2046]")).notes
    assert note.startswith("bodies.wheel.inertia: the principal moments 0.1, 0.1, 0.2046 violate the triangle")
    assert "the largest exceeds the sum of the other two by 2.3 %; try: check_inertia = false" in note
    assert load_toml(ship("[0.1, 0.1, 0.2046]", CONSENT)).notes == ()


def test_a_larger_violation_needs_consent() -> None:
    with pytest.raises(DescriptionError, match=r"exceeds the sum of the other two by 10 %.*check_inertia = false"):
        load_toml(ship("[0.1, 0.1, 0.22]"))
    assert load_toml(ship("[0.1, 0.1, 0.22]", CONSENT)).notes == ()
    with pytest.raises(DescriptionError, match="not positive semidefinite"):  # M could be indefinite
        load_toml(ship("[0.1, -0.1, 0.1]", CONSENT))


def test_a_tunable_inertia_is_judged_at_each_call() -> None:
    tunable = "parameters.J = { value = 0.2, tunable = true }\n"
    text = ship('[0.1, 0.1, "J"]').replace("bodies.ship", tunable + "bodies.ship", 1)
    model = eomgen.build(load_toml(text), terms=["mass"])
    model.mass(model.initial_q, parameters={"J": 0.209})
    with pytest.raises(eomgen.EomgenError, match="violate the triangle inequality"):
        model.mass(model.initial_q, parameters={"J": 0.212})


@pytest.mark.slow_cases("axis1")
@pytest.mark.slow_cases("axis0")
@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8)])
def test_a_rotor_about_one_axis_turns_its_carrier_as_a_gyrostat(axis: tuple[float, float, float]) -> None:
    """Against Euler's equations of a body with a rotor of inertia J e e^T at its centre of mass: the momentum
    I w + J W e is constant in space, and J (W + w . e) changes by the motor alone."""
    J, e = 0.3, np.array(axis)
    tensor = (J * np.outer(e, e)).round(12).tolist()
    scene = load_toml(ship(str(tensor), axis=str(list(axis))))
    assert scene.notes == ()
    inertia = np.diag([1.0, 1.2, 1.5])

    def rate(t: float, x: Array) -> Array:
        w, relative = x[:3], x[3]
        torque = -0.05 * relative
        momentum = inertia @ w + J * (relative + w @ e) * e
        w_dot = np.linalg.solve(inertia, np.cross(momentum, w) - torque * e)
        return np.array([*w_dot, torque / J - w_dot @ e])

    expected = solve_ivp(rate, (0.0, 2.0), [0.3, -0.2, 0.5, 20.0], rtol=1e-11, atol=1e-12).y[:, -1]
    solution = eomgen.build(scene).simulate(2.0, 1e-3, method="rk4")
    names = list(eomgen.build(scene).v_names)
    found = solution.v[-1][[*range(3), names.index("v.spin")]]
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-9)


SHAFTS = """format = 1
name = "shafts"
bodies.motor = { mass = 0, inertia = [0, 0, 0.1] }
bodies.load = { mass = 0, inertia = [0.2, 0.2, 0.3] }
joints.first = { type = "revolute", parent = "base", child = "motor", axis = [0, 0, 1] }
joints.second = { type = "revolute", parent = "base", child = "load", axis = [0, 0, 1] }
efforts.motor = { joint = "first", effort = "1 - 10 * (q.first - q.second)" }
efforts.load = { joint = "second", effort = "10 * (q.first - q.second)" }
outputs.twist = { formula = "q.first - q.second" }
"""


@pytest.mark.slow
def test_shafts_without_mass_have_every_term() -> None:
    """The twist of two shafts under a step of the torque, in closed form; nothing is divided by the mass, 0."""
    scene = load_toml(SHAFTS)
    model = eomgen.build(scene)
    q = model.initial_q
    assert float(model.total_mass()) == 0.0
    np.testing.assert_array_equal(model.center_of_mass(q), [0.0, 0.0, 0.0])
    np.testing.assert_array_equal(model.center_of_mass_jacobian(q), np.zeros((3, 2)))
    np.testing.assert_allclose(model.centroidal_momentum(q) @ [1.0, 2.0], [0, 0, 0.7, 0, 0, 0], rtol=1e-15)
    solution = model.simulate(1.0, 1e-3, method="rk4")
    omega = np.sqrt(10.0 * (1.0 / 0.1 + 1.0 / 0.3))
    expected = (1.0 / 0.1) / omega**2 * (1.0 - np.cos(omega * solution.t))
    np.testing.assert_allclose(solution.outputs["twist"], expected, atol=1e-9)


@pytest.mark.slow
def test_a_tunable_mass_may_be_zero() -> None:
    text = SHAFTS.replace("mass = 0,", 'mass = "m",', 1).replace(
        "bodies.motor", "parameters.m = { value = 1, tunable = true }\nbodies.motor", 1
    )
    model = eomgen.build(load_toml(text))
    turning = model.centroidal_momentum(model.initial_q, parameters={"m": 0.0}) @ [1.0, 2.0]
    np.testing.assert_allclose(turning, [0, 0, 0.7, 0, 0, 0], rtol=1e-15)
